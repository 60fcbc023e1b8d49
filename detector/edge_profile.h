#pragma once
// Where an edge crosses a row (or column) of the image as given: responses of two pairs of filters
// on the unsmoothed pixels around a predicted position.

#include <array>
#include <cstdint>

#include "detector/grey_rows.h"

namespace dlsd {

/// Response of the derivative of a Gaussian, in grey levels: the contrast of an isolated step that
/// is exactly here, positive if it rises. And of an even filter: even / odd (of sums over rows) is
/// the offset in px from here to the step, to first order, if its blur is
/// EdgeProfiler::kBlurVariance (StepGain: for others). The narrow filters keep apart what is close
/// together, the wide ones average more noise.
struct alignas(16) EdgeResponse {
  float odd_narrow, even_narrow, odd_wide, even_wide;
};

/// How offsets follow from responses to a step of known blur.
struct StepGain {
  float narrow;  ///< offset = narrow * even_narrow / odd_narrow
  float wide;    ///< offset = wide * even_wide / odd_wide
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
  /// Variance of the Gaussian that the wide even filter is, less a window. With the levels of both
  /// sides unknown it estimates a step's offset in white noise with a standard deviation of 1.2
  /// times the Cramer-Rao bound at optical blur 0.7 px, 1.2 at 1 px, 1.4 at 1.5 px; the narrow even
  /// filter (the second derivative) with 1.4, 1.8, 3.0.
  static constexpr double kWideEvenVariance = 1.5;
  /// Variance of what blurs the edges: lens and pixel. Only the size of a correction depends on it,
  /// not where it is 0.
  static constexpr double kBlurVariance = 0.7;

  EdgeProfiler() : EdgeProfiler(computed()) {}

  void setPixels(const GreyPixels& pixels) { pixels_ = pixels; }

  /// At the predicted positions, one per row. Pixels beyond the border repeat it; rows beyond it
  /// answer 0.
  void measure(const EdgeWindow& window, std::array<EdgeResponse, kRows>* responses) const;

  /// Variance (px^2, along the rows) of the blur that makes a step's response odd_narrow so many
  /// times odd_wide; between kLeastVariance and kMostVariance.
  [[nodiscard]] double blurVariance(double narrow_over_wide) const;
  static constexpr double kLeastVariance = 0.01, kMostVariance = 5.93;
  /// odd_narrow over odd_wide at these two.
  [[nodiscard]] double sharpestRatio() const { return static_cast<double>(ratio_[0]); }
  [[nodiscard]] double softestRatio() const { return static_cast<double>(ratio_[kShapes - 1]); }

  /// For a step of this blur.
  [[nodiscard]] StepGain gain(double blur_variance) const;

  /// Responses to a step of one grey level that rises so many px from here, seen through a Gaussian
  /// blur of this variance.
  [[nodiscard]] EdgeResponse stepResponse(double position_px, double blur_variance) const;

  /// Standard deviations of one row's responses in white noise of one grey level.
  [[nodiscard]] const EdgeResponse& whiteNoise() const { return white_noise_; }

  /// Responses to shading that rises by one grey level per px; the even ones are 0.
  [[nodiscard]] const EdgeResponse& shading() const { return ramp_; }

  static constexpr int kTaps = 16;
  static constexpr size_t kPhases = 64;
  static constexpr size_t kShapes = 24;  ///< Blurs for which gains are tabulated.
  /// The taps of the four filters: of pixels 2j and 2j + 1, then 2j + 8 and 2j + 9, for all j < 4.
  struct Kernels {
    alignas(32) int16_t taps[4][2][4][2];
    int16_t& tap(size_t filter, size_t i) { return taps[i % 8 / 2][i / 8][filter][i % 2]; }
    [[nodiscard]] int16_t tap(size_t filter, size_t i) const {
      return taps[i % 8 / 2][i / 8][filter][i % 2];
    }
  };
  /// Eight rows: where their pixels are, by which filters they are seen, and how far the true
  /// positions are behind those of the filters.
  template <class T>
  struct Rows {
    std::array<const T*, kRows> pixels;
    std::array<int32_t, kRows> phases;
    std::array<float, kRows> rounding_px;
  };
  /// Kernels of all phases; scale: of the four integer sums.
  template <class T>
  using Measure = void (*)(const Rows<T>& rows,
                           const Kernels* kernels,
                           const std::array<float, 4>& scale,
                           EdgeResponse* responses);

 private:
  struct Compute {};
  explicit EdgeProfiler(Compute);
  /// All are the same. Its tables are integrals, which take milliseconds.
  static const EdgeProfiler& computed();

  template <class T>
  void measureTyped(const T* data,
                    const EdgeWindow& window,
                    Measure<T> measure_rows,
                    const std::array<float, 4>& scale,
                    std::array<EdgeResponse, kRows>* responses) const;

  GreyPixels pixels_;
  std::array<Kernels, kPhases> kernels_;
  alignas(16) std::array<float, 4> scale_;  // of integer sums of 8-bit pixels
  EdgeResponse white_noise_{}, ramp_{};
  std::array<float, kShapes> ratio_{}, narrow_gain_{}, wide_gain_{};
  Measure<uint8_t> measure_8_;
  Measure<uint16_t> measure_16_;
};

}  // namespace dlsd
