#include "synth/dataset/module.h"

#include <dlfcn.h>

#include <string>

#include "cameras/calibration/files.h"

namespace dlsd {

const void* moduleTable(const char* module, const char* table) {
  const std::string file = std::string("libdlsd_") + module + "_module.so";
  void* const library = ::dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL);
  const void* const found = library != nullptr ? ::dlsym(library, table) : nullptr;
  if (found == nullptr) {
    const char* why = ::dlerror();
    throw SystemError(file + ": cannot be loaded: " + (why != nullptr ? why : table));
  }
  return found;
}

}  // namespace dlsd
