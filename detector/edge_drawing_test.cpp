#include "detector/edge_drawing.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstdlib>
#include <set>

#include "detector/test_scene.h"

namespace dlsd {
namespace {

/// Usable everywhere but on the two outermost pixels.
GradientField gradientOf(const std::vector<uint8_t>& image, int width, int height) {
  BitRows usable(width, height);
  for (int y = 2; y < height - 2; ++y) {
    for (int x = 2; x < width - 2; ++x) usable.set(x, y);
  }
  GradientFilter filter(width, height);
  GradientField field;
  filter.compute({.data = image.data(), .width = width, .height = height, .stride_bytes = width},
                 usable,
                 &field);
  return field;
}

EdgeChains chainsOf(const GradientField& field, const EdgeDrawingOptions& options) {
  EdgeDrawer drawer(field.width, field.height, options);
  const EdgeThresholds thresholds = edgeThresholds(options);
  drawer.findAnchors(field, thresholds);
  EdgeChains chains;
  drawer.link(field, thresholds, &chains);
  return chains;
}

RC_GTEST_PROP(EdgeDrawing, ChainsAreConnectedUniqueAndAboveTheThreshold, ()) {
  const int width = *rc::gen::inRange(5, 70).as("width");
  const int height = *rc::gen::inRange(5, 70).as("height");
  const auto seed = *rc::gen::inRange<uint64_t>(0, 1 << 20).as("seed");
  const int smooth = *rc::gen::inRange(1, 12).as("block size of the texture");
  EdgeDrawingOptions options;
  options.min_chain_px = *rc::gen::inRange(2, 12).as("min_chain_px");
  options.anchor_interval_px = *rc::gen::inRange(1, 6).as("interval");
  std::vector<uint8_t> image(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto block = static_cast<uint64_t>((y / smooth) * 100 + x / smooth);
      image[static_cast<size_t>(y * width + x)] =
          static_cast<uint8_t>(256 * test::uniform(seed, block));
    }
  }
  const GradientField field = gradientOf(image, width, height);
  const EdgeChains chains = chainsOf(field, options);
  const EdgeThresholds thresholds = edgeThresholds(options);

  std::set<std::pair<int, int>> seen;
  RC_ASSERT(chains.starts.front() == 0U);
  RC_ASSERT(chains.starts.back() == chains.pixels.size());
  for (size_t c = 0; c < chains.count(); ++c) {
    RC_ASSERT(chains.starts[c + 1] - chains.starts[c] >=
              static_cast<uint32_t>(options.min_chain_px));
    for (uint32_t i = chains.starts[c]; i < chains.starts[c + 1]; ++i) {
      const ChainPixel p = chains.pixels[i];
      RC_ASSERT(seen.emplace(p.x, p.y).second);
      RC_ASSERT(field.magnitude[field.at(p.x, p.y)] >= thresholds.chain);
      if (i == chains.starts[c]) continue;
      const ChainPixel q = chains.pixels[i - 1];
      RC_ASSERT(std::max(std::abs(p.x - q.x), std::abs(p.y - q.y)) == 1);
    }
  }
  RC_CLASSIFY(chains.count() > 0, "has chains");
}

TEST(EdgeDrawing, AStepGivesOneChainOverItsWholeHeight) {
  constexpr int kWidth = 60, kHeight = 50;
  std::vector<uint8_t> image(size_t{kWidth} * kHeight);
  for (size_t i = 0; i < image.size(); ++i) image[i] = i % kWidth < 31 ? 50 : 150;
  const EdgeChains chains = chainsOf(gradientOf(image, kWidth, kHeight), EdgeDrawingOptions{});
  ASSERT_EQ(chains.count(), 1U);
  EXPECT_EQ(chains.pixels.size(), size_t{kHeight - 4});
}

TEST(EdgeDrawing, AClosedContourIsVisitedOnce) {
  constexpr int kSize = 80;
  std::vector<uint8_t> image(size_t{kSize} * kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double d = 25 - std::hypot(x - 40.2, y - 39.6);
      image[static_cast<size_t>(y * kSize + x)] =
          static_cast<uint8_t>(60 + 100 * 0.5 * std::erfc(-d / 1.2));
    }
  }
  const EdgeChains chains = chainsOf(gradientOf(image, kSize, kSize), EdgeDrawingOptions{});
  ASSERT_EQ(chains.count(), 1U);
  // A digital circle of 8-connected pixels: 4 sqrt(2) r, plus the steps linking takes to turn.
  EXPECT_NEAR(static_cast<double>(chains.pixels.size()), 4 * std::sqrt(2.0) * 25, 12);
}

TEST(EdgeDrawing, ThresholdsAreInUnitsOfTheGradient) {
  EdgeDrawingOptions options;
  options.anchor_gradient = 2;
  options.min_gradient = 1;
  EXPECT_EQ(edgeThresholds(options).anchor, 2 * kGradientUnit);
  EXPECT_EQ(edgeThresholds(options).chain, 1 * kGradientUnit);
  options.anchor_gradient = options.min_gradient = 0;
  EXPECT_EQ(edgeThresholds(options).chain, 1);
}

}  // namespace
}  // namespace dlsd
