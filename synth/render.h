#pragma once
// Radiance images: what falls onto each pixel, in linear light, before the sensor.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "cameras/camera.h"
#include "synth/labels.h"
#include "synth/pixel_response.h"
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
  /// How many of the pixel's four corners have a ray.
  [[nodiscard]] int validCorners(int i, int j) const {
    return (cornerValid(i, j) ? 1 : 0) + (cornerValid(i + 1, j) ? 1 : 0) +
           (cornerValid(i, j + 1) ? 1 : 0) + (cornerValid(i + 1, j + 1) ? 1 : 0);
  }
  /// Of a pixel with four valid corners; nearly of unit length.
  [[nodiscard]] Eigen::Vector3f centreRay(int i, int j) const;

  /// Squares of kBlock pixels: which of their pixels' corners have a ray.
  static constexpr int kBlock = 4;
  enum class Block : uint8_t { kInvalid, kPartlyValid, kValid };
  /// The block that holds pixel (i, j).
  [[nodiscard]] Block block(int i, int j) const {
    return blocks_[static_cast<size_t>(j / kBlock * block_columns_ + i / kBlock)];
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
  int block_columns_ = 0;
  std::vector<Block> blocks_;
};

/// How finely a pixel is looked at.
enum class Sampling {
  kAdaptive,    ///< kFineSamples where they make a difference.
  kEverywhere,  ///< kFineSamples in every pixel, all of them shaded: the reference.
};

inline constexpr int kFineSamples = 64;

struct Rendering {
  std::vector<float> radiance;  ///< width * height, row-major: what the pixels answer.
  size_t fine_pixels = 0;       ///< Pixels that got more than one sample.
};

/// Radiance as pixels of the given response see it; black where there is no ray, and continued by
/// the border pixels beyond the image.
///
/// Where surfaces may meet is known before a ray is cast: along the curves of the spans, and the
/// outlines of spheres, discs and elliptic decals. These pixels, the rim of the camera's domain,
/// those that show a pattern, and pixels that differ from a neighbour (where round things enter
/// others) get kFineSamples
/// samples in a rank-1 lattice, mirrored and shifted by a hash of (key, pixel); a fourth of them if
/// at most one curve passes and the step between the surfaces is at most 2 grey levels. Where
/// nothing but one or two straight edges passes and a fourth of the samples show one surface on
/// each of their sides, the others are told apart by the edges' planes in place of rays. So neither
/// edges nor rods of any thinness are missed. Flat surfaces are shaded once a pixel, in the middle
/// of their samples. Samples reach neighbouring pixels with the response's weight at their very
/// positions.
///
/// All other pixels are constant. Blocks of 4 x 4 of them whose corners show one surface in nearly
/// the same light are interpolated from the corners, others (all, where lights cast shadows) have
/// one sample in the centre.
///
/// Uses the threads of the caller's task arena; the result does not depend on their number.
[[nodiscard]] Rendering renderRadiance(const Scene& scene,
                                       const Raycaster& raycaster,
                                       const Shader& shader,
                                       const CameraRays& rays,
                                       const Pose& pose,
                                       const std::vector<EdgeSpan>& spans,
                                       uint64_t key,
                                       const PixelResponse& response = PixelResponse(),
                                       Sampling sampling = Sampling::kAdaptive);

}  // namespace dlsd
