#pragma once
// Statistical efficiency: how well the planes of detected lines are known, next to how well noise
// lets anybody know them.

#include <cstdint>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// A convex polygon, alone in its image, seen in many noises.
struct EfficiencyCase {
  Camera camera;
  uint64_t seed = 0;  ///< Of the polygon and the noises.
  double contrast = 60, noise_levels = 4, blur_px = 0.7;
  int repeats = 10;
};

/// What is seen of one side: 60 px or longer, 15 px or farther from border and rim.
struct SideErrors {
  double length_px = 0;
  int tried = 0, found = 0;
  /// Sums over the detections of squares of errors over the Cramer-Rao bound (normal_bound.h).
  double offset2 = 0, roll2 = 0;
  double bias_px = 0;          ///< Sum: positive towards the brighter side.
  double offset_bound_px = 0;  ///< Standard deviation that the bound allows.
};

[[nodiscard]] std::vector<SideErrors> sideErrors(const EfficiencyCase& efficiency_case);

}  // namespace dlsd
