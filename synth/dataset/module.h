#pragma once
// Parts of our programs that are loaded when they are first needed. Some of OpenCV's libraries
// bring more than a hundred others along, which take longer to load than most commands run.

namespace dlsd {

/// Address of a table (extern "C") in one of our modules, dlsd_add_module in CMake, which stays
/// loaded; modules are found by the program's RPATH. Throws SystemError if there is none.
[[nodiscard]] const void* moduleTable(const char* module, const char* table);

}  // namespace dlsd
