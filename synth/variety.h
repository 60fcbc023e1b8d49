#pragma once
// Variety on demand: ranges from which scenes get more than their preset gives them, and random
// cameras. Without it presets are what they are.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "cameras/camera.h"
#include "synth/scene.h"

namespace dlsd {

/// Saved cases carry it: raised with each change after which a seed draws other things.
inline constexpr const char* kVarietyVersion = "variety/1";

/// Uniform draws from [lo, hi].
struct VarietyRange {
  double lo, hi;
  bool operator==(const VarietyRange&) const = default;
};

/// "ball", "disc", "ring" (a torus), "string" (a sagging wire), "cylinder".
[[nodiscard]] const std::vector<std::string>& distractorKinds();

/// What is drawn for each frame. The defaults change nothing.
struct SceneVariety {
  /// Factor on how far the albedos are from their mean, within [0, 3].
  VarietyRange contrast{1, 1};
  /// Round things in the open, within [0, 30], of the kinds below. Only cylinders have something
  /// straight, their sides.
  VarietyRange distractors{0, 0};
  /// Any of distractorKinds(), none twice.
  std::vector<std::string> distractor_kinds = distractorKinds();
  /// Solids (boxes, blocks, prisms, pyramids) and bars in the open, within [0, 60].
  VarietyRange clutter{0, 0};
  /// From the camera to the middle of each of all these, m, within [0.1, 60]; they stand at most at
  /// 0.85 of the way to what is there already. What finds no room in eight tries is left out.
  VarietyRange distance_m{0.4, 6};
  /// The longest straight edge of each solid or bar, m, within [0.01, 20].
  VarietyRange length_m{0.1, 1};
  /// Share of the plain rectangular faces that get a print without straight edges (dots, or rings
  /// like those of wood), within [0, 1].
  VarietyRange prints{0, 0};
  /// Shares of the surfaces that get smooth patterns (Texture), within [0, 1]: blotches; rings like
  /// those of wood on the rest.
  VarietyRange noise{0, 0}, wood{0, 0};
  /// Share of the frames in which all lights cast shadows, in [0, 1]; -1: as the preset has it.
  /// Lamps inside a ball never do.
  double shadows = -1;

  bool operator==(const SceneVariety&) const = default;
  /// Throws std::invalid_argument naming the field, its value and the allowed range.
  void check() const;
};

/// What is drawn for each random camera.
struct CameraVariety {
  /// Seen from the left border to the right one, degrees, within [20, 300]; less where the model
  /// cannot.
  VarietyRange field_of_view_deg{60, 220};
  VarietyRange width_px{640, 1280};  ///< Within [64, 8192].
  VarietyRange aspect{0.5625, 1};    ///< Height over width, within [0.25, 4].
  VarietyRange principal_offset{
      0, 0.03};  ///< From the image's centre, over the width, within [0, 0.3].
  /// 0: the model's nearest to a plain projection (kannala_brandt: equidistant); 1: as far from it
  /// as real lenses are.
  VarietyRange distortion{0, 1};

  bool operator==(const CameraVariety&) const = default;
  void check() const;
};

[[nodiscard]] nlohmann::ordered_json toJson(const SceneVariety& variety);
[[nodiscard]] nlohmann::ordered_json toJson(const CameraVariety& variety);

/// A configuration file: {"scene": {"contrast": [lo, hi], ..}, "camera": {..}}; what is left out
/// keeps its value. Throws InputError naming file and key for unknown keys and values out of range.
void readVariety(const std::string& path, SceneVariety* scene, CameraVariety* camera);

/// Sets one of these ranges or values, as a command line does: "clutter=4,12", "shadows=0.5",
/// "distractor_kinds=ring,cylinder", "field_of_view_deg=90,180"; one number is both ends of a
/// range. Throws InputError.
void setVariety(const std::string& assignment, SceneVariety* scene, CameraVariety* camera);

/// Adds to a frame what the variety draws for it: a function of the arguments.
void addVariety(const SceneVariety& variety, uint64_t seed, uint64_t index, SceneView* view);

/// Names that drawCamera knows: "pinhole", "fov", "kb", "omni", "eucm", "ds".
[[nodiscard]] const std::vector<std::string>& randomCameraModels();

/// Random camera number `index` of a model. Throws std::invalid_argument for an unknown name.
[[nodiscard]] Camera drawCamera(std::string_view model,
                                const CameraVariety& variety,
                                uint64_t seed,
                                uint64_t index);

}  // namespace dlsd
