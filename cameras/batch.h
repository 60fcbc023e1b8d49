#pragma once
// Projection and unprojection of many points at once: the model is dispatched once, then one plain
// loop over arrays runs. Arrays are structures of arrays; input and output must not overlap.

#include <cstdint>
#include <span>

#include "cameras/camera.h"

namespace dlsd {

/// Rays (any positive scale) to pixels. All spans have the same length, else std::invalid_argument.
/// valid[i] is 1 where the ray projects; elsewhere u[i], v[i] are unspecified.
void projectAll(const Camera& camera,
                std::span<const double> x,
                std::span<const double> y,
                std::span<const double> z,
                std::span<double> u,
                std::span<double> v,
                std::span<uint8_t> valid);

/// Pixels to unit rays. All spans have the same length, else std::invalid_argument.
void unprojectAll(const Camera& camera,
                  std::span<const double> u,
                  std::span<const double> v,
                  std::span<double> x,
                  std::span<double> y,
                  std::span<double> z,
                  std::span<uint8_t> valid);

}  // namespace dlsd
