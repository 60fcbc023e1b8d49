#pragma once
// Where an edge crosses a row (or column) of the image as given: responses of two pairs of filters
// on the unsmoothed pixels around a predicted position.

#include <array>
#include <cstdint>

#include "detector/grey_rows.h"

namespace dlsd {

/// Response of the derivative of a Gaussian, in grey levels: the contrast of an isolated step that
/// is exactly here, positive if it rises. And of the second derivative: even / odd (of sums over
/// rows) is the offset in px from here to the step, to first order. The narrow filters keep apart
/// what is close together, the wide ones average more noise.
struct EdgeResponse {
  float odd_narrow, even_narrow, odd_wide, even_wide;
};

/// Eight rows (columns) that a straight edge crosses.
struct EdgeWindow {
  bool crosses_rows;  ///< False: it crosses columns, and rows below are columns.
  int first_row;
  double across;  ///< Predicted position in the middle of the eight, first_row + 3.5.
  double slope;   ///< Change of the position from row to row.
};

class EdgeProfiler {
 public:
  static constexpr int kRows = 8;
  /// Standard deviations of the two Gaussians in px.
  static constexpr double kNarrowPx = 1, kWidePx = 2.2;
  /// Variance of what blurs the edges: lens and pixel. Only the size of a correction depends on it,
  /// not where it is 0.
  static constexpr double kBlurVariance = 0.7;

  EdgeProfiler();

  void setPixels(const GreyPixels& pixels) { pixels_ = pixels; }

  /// At the predicted positions, one per row. Pixels beyond the border repeat it; rows beyond it
  /// answer 0.
  void measure(const EdgeWindow& window, std::array<EdgeResponse, kRows>* responses) const;

  /// Standard deviations of one row's responses in white noise of one grey level.
  [[nodiscard]] const EdgeResponse& whiteNoise() const { return white_noise_; }

  /// Responses to shading that rises by one grey level per px; the even ones are 0.
  [[nodiscard]] const EdgeResponse& shading() const { return ramp_; }

  static constexpr int kTaps = 16;
  struct Kernels {
    alignas(32) int16_t taps[4][kTaps];
  };

 private:
  template <class T>
  void measureTyped(const T* data,
                    const EdgeWindow& window,
                    std::array<std::array<int32_t, 4>, kRows>* sums) const;

  static constexpr int kPhases = 64;
  GreyPixels pixels_;
  std::array<Kernels, kPhases> kernels_;
  std::array<float, 4> scale_;  // of integer sums of 8-bit pixels
  EdgeResponse white_noise_{}, ramp_{};
  using RowSums8 = void (*)(const uint8_t*, const Kernels&, int32_t*);
  using RowSums16 = void (*)(const uint16_t*, const Kernels&, int32_t*);
  RowSums8 row_sums_8_;
  RowSums16 row_sums_16_;
};

}  // namespace dlsd
