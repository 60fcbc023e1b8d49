#pragma once
// What one pixel answers to light that falls onto the image plane: its square aperture, blurred by
// the optics.

#include <cstddef>
#include <vector>

namespace dlsd {

/// The continuous response h of a pixel: the square of 1 px, convolved with a Gaussian (sigma) and
/// with a uniform disc (defocus). A pixel at p answers to light at x with h(x - p), whose integral
/// is 1; so edges stay where they are at any sub-pixel position, which a blur of pixel means at
/// whole pixels does not achieve (it moves them by up to 0.05 px).
///
/// h is held as a sum of separable terms, h(x, y) = sum_r sign_r f_r(x) f_r(y): one without
/// defocus, where it is exact; with it as many as it takes to get within kMaxTermError of the peak
/// of h. Gaussians are cut at 4 sigma and normalised.
///
/// A Gaussian of more than kMaxSplatSigmaPx is split: h holds one of kSplitSigmaPx, which leaves
/// nothing above the image's sampling limit, and the rest is a convolution at whole pixels.
class PixelResponse {
 public:
  /// Sub-pixel positions that h is tabulated for: (k + 0.5) / kPositions - 0.5 px from the centre
  /// of a pixel, k = 0 .. kPositions - 1.
  static constexpr int kPositions = 256;
  static constexpr double kMaxSplatSigmaPx = 1.25, kSplitSigmaPx = 0.8;
  static constexpr double kMaxDefocusPx = 10;
  static constexpr double kMaxTermError = 2e-3;

  /// sigma_px >= 0, defocus_radius_px in [0, kMaxDefocusPx].
  PixelResponse(double sigma_px, double defocus_radius_px);
  /// The square alone.
  PixelResponse() : PixelResponse(0, 0) {}

  /// Light at a position of pixel 0 reaches the pixels -radius .. radius.
  [[nodiscard]] int radius() const { return radius_; }
  [[nodiscard]] size_t terms() const { return terms_.size(); }
  /// Floats from the first tap of one position to the first of the next; taps beyond 2 radius are
  /// 0.
  [[nodiscard]] size_t stride() const { return stride_; }

  /// f_r at position k for the pixels -radius .. radius.
  [[nodiscard]] const float* taps(size_t term, int position) const {
    return terms_[term].taps.data() + static_cast<size_t>(position) * stride_;
  }
  [[nodiscard]] float sign(size_t term) const { return terms_[term].sign; }

  /// Convolves an image of light that is constant over each pixel with h. The image is continued by
  /// its border pixels. Exact for constant images.
  void convolve(int width, int height, const std::vector<float>& in, std::vector<float>* out) const;
  /// The rest of a split Gaussian; does nothing where nothing was split.
  void blurRest(int width, int height, std::vector<float>* image) const;

 private:
  struct Term {
    float sign;
    std::vector<float> taps;  ///< [position][stride]
    std::vector<float> cell;  ///< Mean of f over the positions, for the pixels -radius .. radius.
  };

  int radius_ = 0;
  size_t stride_ = 8;
  std::vector<Term> terms_;
  std::vector<float> rest_;  ///< Kernel at whole pixels; empty if nothing was split.
};

}  // namespace dlsd
