#pragma once
// A failing case on disk: what makes it again, and what a person wants to look at.

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "synth/dataset/image.h"

namespace dlsd {

/// One picture with curves to look at.
struct ShownPicture {
  using Curves = std::vector<std::vector<Eigen::Vector2d>>;
  Image image;    ///< 8 bit.
  Curves labels;  ///< Thin blue.
  Curves lines;   ///< Detections: green.
  Curves failed;  ///< What the failure speaks of: red.
};

/// Writes the folder `parent`/counterexample-<hash of the case>/ with
///   case.json           the case with the failure, the command that replays it and the versions;
///                       `dlsd replay` makes it again
///   image.png, image-2.png, ...   its pictures
///   overlay.svg         the pictures side by side with their curves
/// and returns its path. The same case gives the same folder. Throws SystemError.
std::string saveCounterexample(const std::string& parent,
                               const nlohmann::ordered_json& failing_case,
                               const std::string& failure,
                               const std::vector<ShownPicture>& shown);

/// Version of what makes the case's picture: the scene preset's, or that of the painted scenes.
[[nodiscard]] std::string sceneVersionOf(const nlohmann::json& json);

/// Keeps a case on disk while it is judged, as `parent`/unfinished-<process id>.json: where the
/// process dies (a crash, a sanitizer's report, a time limit), the file stays, and `dlsd replay`
/// takes it. Throws SystemError.
class UnfinishedCase {
 public:
  UnfinishedCase(const std::string& parent, const nlohmann::ordered_json& judged);
  ~UnfinishedCase();
  UnfinishedCase(const UnfinishedCase&) = delete;
  UnfinishedCase& operator=(const UnfinishedCase&) = delete;

 private:
  std::string path_;
};

}  // namespace dlsd
