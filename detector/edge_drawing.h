#pragma once
// Gradient field -> chains of connected edge pixels, after the idea of Edge Drawing (Topal and
// Akinlar, J. Vis. Commun. Image Represent. 23(6), 2012): anchors on crests of the gradient
// magnitude, joined by walking along the crest.

#include <cstdint>
#include <vector>

#include "detector/gradient.h"
#include "detector/options.h"

namespace dlsd {

struct ChainPixel {
  uint16_t x, y;
};

/// Chain i is pixels[starts[i]] ... pixels[starts[i + 1] - 1]; there is one more start than chains.
/// Consecutive pixels are 8-neighbours, every pixel of the image occurs at most once, and walking
/// along a chain the brighter side stays on the same hand.
struct EdgeChains {
  std::vector<ChainPixel> pixels;
  std::vector<uint32_t> starts;

  [[nodiscard]] size_t count() const { return starts.empty() ? 0 : starts.size() - 1; }
};

/// Gradient bounds of one image, in the units of GradientField.
struct EdgeThresholds {
  uint16_t anchor = 0, chain = 1;  ///< chain >= 1, so that masked pixels (0) never pass.
};

[[nodiscard]] EdgeThresholds edgeThresholds(const EdgeDrawingOptions& options);

class EdgeDrawer {
 public:
  EdgeDrawer(int width, int height, const EdgeDrawingOptions& options);

  /// Crests of the magnitude on every anchor_interval_px-th row (edges that cross rows) and column
  /// (edges that cross columns), in row order.
  void findAnchors(const GradientField& field, const EdgeThresholds& thresholds);

  /// Chains through the anchors. The magnitude must be 0 on the image's outermost pixels.
  void link(const GradientField& field, const EdgeThresholds& thresholds, EdgeChains* chains);

  [[nodiscard]] const std::vector<uint32_t>& anchors() const { return anchors_; }

 private:
  /// Appends the pixels that follow (not including) the start. direction = +1 or -1 says along
  /// which of the two tangents of the crest.
  void walk(const GradientField& field,
            uint16_t min_magnitude,
            int x,
            int y,
            int direction,
            std::vector<ChainPixel>* pixels);

  int width_, height_;
  EdgeDrawingOptions options_;
  std::vector<uint8_t> is_crest_;  // one row
  std::vector<uint32_t> anchors_;  // pixel indices
  std::vector<uint8_t> visited_;   // one byte per pixel
};

}  // namespace dlsd
