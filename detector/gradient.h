#pragma once
// Grey image -> smoothing -> gradient, in one pass over the rows.

#include <cstdint>
#include <vector>

#include "detector/image_view.h"
#include "detector/usable_mask.h"

namespace dlsd {

/// One grey level per pixel in the units of gx, gy and magnitude.
inline constexpr int kGradientUnit = 128;

/// Gradient of the smoothed image at pixel centres, row-major, width * height entries each.
struct GradientField {
  int width = 0, height = 0;
  std::vector<int16_t> gx, gy;  ///< In 1 / kGradientUnit grey levels per px (8-bit scale).
  /// max(|gx|, |gy|) + 3/8 min(|gx|, |gy|), within [-3, +7] % of the Euclidean norm; 0 where
  /// masked.
  std::vector<uint16_t> magnitude;

  [[nodiscard]] size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
};

/// Smoothing is the binomial 5x5 kernel (variance 1 px^2 per axis), the gradient Sobel's (central
/// difference, smoothed across by 1 2 1); both repeat the border pixels. Any pixel type is first
/// brought to fixed point of 1/16 grey level; float values outside [0, 255] are clamped, and what
/// is not a number counts as 0.
class GradientFilter {
 public:
  GradientFilter(int width, int height);

  /// The view must have the filter's size and be well formed (the detector checks it). Magnitudes
  /// are 0 where `usable` is not set.
  void compute(const ImageView& image, const BitRows& usable, GradientField* field);

 private:
  int width_, height_;
  std::vector<uint16_t> grey_row_;  // 2 px of padding on each side
  std::vector<uint16_t> smooth_x_;  // ring of 5 rows
  std::vector<int16_t> smooth_;     // ring of 3 rows, 1 px of padding on each side
};

}  // namespace dlsd
