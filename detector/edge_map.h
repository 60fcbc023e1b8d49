#pragma once
// Image -> crests of the gradient, one bit per pixel, in a single pass over the rows: neither the
// smoothed image nor its gradient is ever written out.

#include <array>
#include <cstdint>
#include <vector>

#include "detector/grey_rows.h"
#include "detector/options.h"
#include "detector/usable_mask.h"

namespace dlsd {

/// Crests by the direction of the gradient. Along an edge the direction turns slowly, so that a
/// straight edge lies in one plane, an edge near 45 degrees to the axes in two of them.
enum CrestPlane { kRight, kLeft, kDown, kUp };
inline constexpr int kCrestPlanes = 4;

struct EdgeMap {
  /// Set where the magnitude is at least the lower threshold and has a maximum along the row
  /// (kRight, kLeft: |gy| <= 5/4 |gx|) or column (kDown, kUp: |gx| <= |gy|).
  std::array<BitRows, kCrestPlanes> crests;
  BitRows strong;  ///< A crest of at least the upper threshold.
};

/// Rows of one image in fixed point. All arrays have room for whole blocks of 64 entries. The same
/// results to the last bit whichever instructions are used.
struct EdgeRowKernels {
  /// out[i] = (1 5 10 10 5 1) . in[i ... i + 5] / 32, rounded.
  void (*smoothAlong)(const uint16_t* in, size_t count, uint16_t* out);
  /// The same across six rows, times 8.
  void (*smoothAcross)(const std::array<const uint16_t*, 6>& rows, size_t count, int16_t* out);
  /// From the values at the pixels' corners, above and below.
  void (*gradient)(const int16_t* above,
                   const int16_t* below,
                   size_t count,
                   int16_t* gx,
                   int16_t* gy,
                   int16_t* magnitude);
  struct CrestRows {
    const int16_t *above, *row, *below;  ///< Magnitudes; row[-1] can be read.
    const int16_t *gx, *gy;
    const uint64_t* usable;
    int16_t low, high;                              ///< Thresholds, > 0.
    std::array<uint64_t*, kCrestPlanes + 1> words;  ///< Out: the four planes, and strong.
  };
  void (*crests)(const CrestRows& rows, size_t words);
};
[[nodiscard]] const EdgeRowKernels& portableEdgeRowKernels();
/// Null where the processor (or the compiler) has no AVX2.
[[nodiscard]] const EdgeRowKernels* avx2EdgeRowKernels();

/// Smoothing and gradient together are the binomial kernel of seven (variance 1.5 px^2 along an
/// edge) and its derivative; the border pixels are repeated.
class EdgeMapper {
 public:
  /// One grey level per px in the units of magnitudes.
  static constexpr int kGradientUnit = 128;

  EdgeMapper(int width,
             int height,
             const EdgeDrawingOptions& options,
             const EdgeRowKernels& kernels);

  /// Marks crests where `usable` is set, which must keep UsableMask::kBorderPx from the border.
  void compute(const GreyPixels& pixels, const BitRows& usable, EdgeMap* map);

  /// Standard deviation of one gradient component in the part of the image without edges, in grey
  /// levels per px: from the 40 % quantile of the magnitude over a sample of usable pixels, which
  /// for Gaussian noise is 1.01 standard deviations. White noise of s grey levels gives 0.136 s.
  /// 0 if the options do not ask for it.
  [[nodiscard]] double noise() const { return noise_; }

 private:
  double measureNoise(const GreyPixels& pixels, const BitRows& usable);
  void loadRow(const GreyPixels& pixels, int y);

  EdgeDrawingOptions options_;
  EdgeRowKernels kernels_;
  int width_, height_;
  size_t words_per_row_;
  size_t padded_;  // entries of a row
  double noise_ = 0;
  std::vector<uint16_t> grey_;                // 3 entries before the row
  std::vector<uint16_t> along_;               // ring of 8 rows
  std::vector<int16_t> corners_;              // ring of 2 rows
  std::vector<int16_t> gx_, gy_, magnitude_;  // rings of 4 rows
  std::vector<int> histogram_;
};

}  // namespace dlsd
