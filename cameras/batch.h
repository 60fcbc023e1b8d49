#pragma once
// Projection and unprojection of many points at once: the model is dispatched once, then plain
// loops over arrays run, vectorised where the model's kernels have no branches. Arrays are
// structures of arrays; input and output must not overlap. Nothing is allocated.
//
// In double, every value equals that of Camera::project and Camera::unproject to the last bit, on
// every instruction set. In float, docs/cameras.md states how far from the double ones they are.

#include <cstdint>
#include <span>

#include "cameras/camera.h"

namespace dlsd {

/// Instruction sets for which the loops are built. The results are the same to the last bit.
enum class Simd { kPortable, kAvx2, kAvx512 };

/// Whether this build and this processor have it. kPortable always.
[[nodiscard]] bool simdSupported(Simd simd);

/// The widest that is supported.
[[nodiscard]] Simd widestSimd();

/// Rays (any positive scale) to pixels. All spans have the same length, else std::invalid_argument.
/// valid[i] is 1 where the ray projects, else 0; there u[i], v[i] are unspecified.
/// @param simd  Must be supported, else std::invalid_argument. For tests and measurements.
void projectAll(const Camera& camera,
                std::span<const double> x,
                std::span<const double> y,
                std::span<const double> z,
                std::span<double> u,
                std::span<double> v,
                std::span<uint8_t> valid,
                Simd simd = widestSimd());
void projectAll(const Camera& camera,
                std::span<const float> x,
                std::span<const float> y,
                std::span<const float> z,
                std::span<float> u,
                std::span<float> v,
                std::span<uint8_t> valid,
                Simd simd = widestSimd());

/// Pixels to unit rays. All spans have the same length, else std::invalid_argument.
/// valid[i] is 1 where the pixel has a ray, else 0; there x[i], y[i], z[i] are unspecified.
void unprojectAll(const Camera& camera,
                  std::span<const double> u,
                  std::span<const double> v,
                  std::span<double> x,
                  std::span<double> y,
                  std::span<double> z,
                  std::span<uint8_t> valid,
                  Simd simd = widestSimd());
void unprojectAll(const Camera& camera,
                  std::span<const float> u,
                  std::span<const float> v,
                  std::span<float> x,
                  std::span<float> y,
                  std::span<float> z,
                  std::span<uint8_t> valid,
                  Simd simd = widestSimd());

}  // namespace dlsd
