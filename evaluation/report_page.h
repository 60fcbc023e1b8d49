#pragma once
// The fixed parts of the report's page.

#include <string_view>

namespace dlsd {

extern const std::string_view kReportStyle;
extern const std::string_view kReportViewer;  ///< The dialog that shows one frame.
extern const std::string_view kReportScript;

}  // namespace dlsd
