#pragma once
// Properties of exact labels on one view of a scene, or on two of them: cases, and the predicates
// that judge them. No RapidCheck here, so that `dlsd replay` and the suites use the very same code.
// docs/properties.md says what each property means.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cameras/camera.h"
#include "properties/checks/counterexample.h"
#include "synth/scene.h"

namespace dlsd {

enum class LabelProperty {
  kOnBorders,  ///< To both sides of a label there are different surfaces, or light and shadow.
  kVisible,    ///< What is visible is what brute force over all triangles and round things finds.
  kComplete,   ///< Every straight border belongs to a label.
  kOtherLens,  ///< Seen through `other` from the same place: the same arcs.
  kTurned,     ///< Scene and camera turned by a quarter: the same labels, the same picture.
  kMirrored,   ///< A mirrored scene has the mirrored picture and the mirrored labels.
};
inline constexpr int kLabelPropertyCount = 6;
[[nodiscard]] std::string_view nameOf(LabelProperty property);
[[nodiscard]] std::optional<LabelProperty> labelPropertyFromName(std::string_view name);

/// Everything that is needed to judge a property again.
struct LabelCase {
  LabelProperty property = LabelProperty::kOnBorders;
  Camera camera;
  std::optional<Camera> other = std::nullopt;
  std::string scene = "room";  ///< Preset.
  uint64_t seed = 0, index = 0;
  bool things_on_top = false;  ///< Round things and clutter besides.
  /// Of the scene's parts (scene_parts.h) these alone.
  std::optional<std::vector<int>> parts = std::nullopt;
};

[[nodiscard]] nlohmann::ordered_json toJson(const LabelCase& label_case);
/// Throws InputError with source, key and value for anything missing, unknown or out of range.
[[nodiscard]] LabelCase labelCaseFromJson(const nlohmann::json& json, const std::string& source);

/// The scene that the case describes, and where its cameras stand.
[[nodiscard]] SceneView viewOf(const LabelCase& label_case);

/// What came of a case.
struct LabelsOutcome {
  /// False: the case says nothing about the property (e.g. because nothing is in view).
  bool applies = true;
  std::string failure;  ///< Empty: the property holds. Else one line: what, where, by how much.
  /// Places on labels (kOnBorders) or edges (kVisible), places where the picture jumps (kComplete),
  /// ends of spans (kOtherLens), labels.
  long counted = 0;
  /// Besides those that are counted, what cannot be told. kOnBorders: places within rounding of an
  /// end; places where pictures show no shadow. kVisible: places on edges too short.
  long at_ends = 0, in_gaps = 0, on_short_edges = 0;
  long round = 0;  ///< kComplete: of those counted, on outlines of balls and tubes.
  /// kComplete: the longest straight border without a label, px; kOtherLens: difference of each
  /// end, rad; kTurned, kMirrored: share of the pixels that differ.
  std::vector<double> errors;
  std::vector<std::string> details;  ///< A line for each thing that fails, where several can.
  std::vector<ShownPicture> shown;
};

/// Makes the case's views and judges. `with_shown`: fills in `shown`.
[[nodiscard]] LabelsOutcome checkLabels(const LabelCase& label_case, bool with_shown = false);

}  // namespace dlsd
