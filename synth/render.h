#pragma once
// Radiance images: what falls onto each pixel, in linear light, before the sensor.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "cameras/camera.h"
#include "synth/labels.h"
#include "synth/raycaster.h"
#include "synth/scene.h"
#include "synth/shading.h"

namespace dlsd {

/// Rays of all pixel corners of a camera, computed once and shared by frames and threads.
/// Inside a pixel the ray is interpolated bilinearly between the corners; where that is off by more
/// than kMaxErrPx at the centre (where it is worst, to second order), or a corner has no ray, the
/// pixel is "exact": every sample is unprojected.
class CameraRays {
 public:
  /// px; the label tolerance is 1e-3.
  static constexpr double kMaxErrPx = 6e-4;

  explicit CameraRays(const Camera& camera);

  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] int width() const { return camera_.width(); }
  [[nodiscard]] int height() const { return camera_.height(); }

  /// Corner (i, j) of 0..width, 0..height is the point (i - 0.5, j - 0.5) of the image.
  [[nodiscard]] bool cornerValid(int i, int j) const { return valid_[corner(i, j)] != 0; }
  [[nodiscard]] Eigen::Vector3f cornerRay(int i, int j) const {
    const size_t k = corner(i, j);
    return {x_[k], y_[k], z_[k]};
  }
  [[nodiscard]] bool isExact(int i, int j) const {
    return exact_[static_cast<size_t>(j) * static_cast<size_t>(width()) + static_cast<size_t>(i)] !=
           0;
  }
  /// Pixels that are exact, for statistics.
  [[nodiscard]] size_t exactCount() const;

 private:
  [[nodiscard]] size_t corner(int i, int j) const {
    return static_cast<size_t>(j) * static_cast<size_t>(width() + 1) + static_cast<size_t>(i);
  }

  Camera camera_;
  std::vector<float> x_, y_, z_;
  std::vector<uint8_t> valid_, exact_;
};

/// How finely a pixel is looked at.
enum class Sampling {
  kAdaptive,    ///< Corners where a pixel shows one surface, kFineSamples elsewhere.
  kEverywhere,  ///< kFineSamples in every pixel: the reference.
};

inline constexpr int kFineSamples = 64;

struct Rendering {
  std::vector<float> radiance;  ///< width * height, row-major: mean over the pixel's square.
  size_t fine_pixels = 0;       ///< Pixels with kFineSamples.
};

/// Box-filtered radiance. A pixel whose four corners see one surface, and through which no span's
/// curve passes, gets the mean of its corners; all others kFineSamples samples in a rank-1 lattice,
/// shifted by a hash of (key, pixel); the first four of each flat surface are shaded. So no visible
/// edge or thin rod is missed, and curved outlines are found by the corners. Samples without a ray
/// are left out of the mean; a pixel without any is 0.
[[nodiscard]] Rendering renderRadiance(const Scene& scene,
                                       const Raycaster& raycaster,
                                       const Shader& shader,
                                       const CameraRays& rays,
                                       const Pose& pose,
                                       const std::vector<EdgeSpan>& spans,
                                       uint64_t key,
                                       Sampling sampling = Sampling::kAdaptive);

}  // namespace dlsd
