#pragma once
// One case of a property over generated frames: everything that is needed to make it again.
// No RapidCheck here, so that `dlsd replay` and the suites use the very same code.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "synth/dataset/json_fields.h"
#include "synth/generate.h"

namespace dlsd {

[[nodiscard]] nlohmann::ordered_json cameraToJson(const Camera& camera);
[[nodiscard]] Camera cameraFromJson(const JsonField& json);  ///< Throws InputError.
/// A text that must be one of these. Throws InputError.
[[nodiscard]] std::string oneOf(const std::vector<std::string>& names, const JsonField& json);
/// Numbers of parts (scene_parts.h) of this scene. Throws InputError.
[[nodiscard]] std::vector<int> partsFromJson(const JsonField& json, const Scene& scene);

/// What a property is checked on: a frame, made again bit for bit from these values, and the
/// options of the detector by name.
struct FrameCase {
  std::string property;  ///< Which predicate judges it: "recovery" or "soundness".
  Camera camera;
  std::string scene = "room";  ///< Preset.
  uint64_t seed = 0, index = 0;
  SensorOptions sensor = {};
  SceneVariety variety = {};
  std::string detector = "dlsd";  ///< One of builtinDetectors().
  /// Of the scene's parts (scene_parts.h) these alone.
  std::optional<std::vector<int>> parts = std::nullopt;
};

[[nodiscard]] nlohmann::ordered_json toJson(const FrameCase& frame_case);

/// Throws InputError with source, key and value for anything missing, unknown or out of range.
[[nodiscard]] FrameCase frameCaseFromJson(const nlohmann::json& json, const std::string& source);

/// The frame that the case describes.
[[nodiscard]] Frame renderCase(const FrameCase& frame_case);

}  // namespace dlsd
