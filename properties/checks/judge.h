#pragma once
// Any saved case of any property: read, made again, judged.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "properties/checks/counterexample.h"

namespace dlsd {

struct Verdict {
  nlohmann::ordered_json judged;  ///< The case as it was understood.
  std::string failure;            ///< Empty: the property holds. Else one line.
  /// Where the property is one of many frames, of whose lines a share may be missed or wrong: what
  /// of this frame counts towards that share, one line. Empty: nothing.
  std::string noted;
  /// Where the case was saved of another version of its scene, and so of another picture: one line.
  std::string other_scene;
  std::string summary;               ///< What was counted, one line.
  std::vector<std::string> details;  ///< A line for each thing that fails, where several can.
  /// Labels, pixels or lines of which the property speaks.
  long counted = 0;
  /// False: the case says nothing about the property, e.g. because nothing was painted, or found.
  bool is_judged = false;
  std::vector<ShownPicture> shown;  ///< If asked for.
};

/// Judges the case by the property that it names. What the detector throws, or
/// the labels, is a failure. Throws
/// InputError with source, key and value for anything missing, unknown or out of range.
[[nodiscard]] Verdict judgeCase(const nlohmann::json& json,
                                const std::string& source,
                                bool with_shown);

}  // namespace dlsd
