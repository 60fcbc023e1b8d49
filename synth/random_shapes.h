#pragma once
// Draws that several presets share.

#include <Eigen/Geometry>
#include <cmath>

#include "synth/dataset/random.h"
#include "synth/scene_builder.h"

namespace dlsd {

/// Uniform on the unit sphere.
[[nodiscard]] inline Eigen::Vector3d drawDirection(Random* random) {
  const double z = random->next(-1, 1), a = random->next(0, 2 * M_PI);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

/// By any angle about any axis.
[[nodiscard]] inline Eigen::Matrix3d drawRotation(Random* random) {
  return Eigen::AngleAxisd(random->next(0, 2 * M_PI), drawDirection(random)).toRotationMatrix();
}

}  // namespace dlsd
