#include "detector/edge_map.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <vector>

#include "detector/edge_linking.h"
#include "detector/gradient.h"
#include "detector/test_scene.h"

namespace dlsd {
namespace {

BitRows inner(int width, int height) {
  BitRows usable(width, height);
  for (int y = 2; y < height - 2; ++y) {
    for (int x = 2; x < width - 2; ++x) usable.set(x, y);
  }
  return usable;
}

GreyPixels pixelsOf(const std::vector<uint8_t>& image, int width, int height) {
  return {.u8 = image.data(), .fixed = nullptr, .stride = width, .width = width, .height = height};
}

/// Noise, a blurred disc and stripes: gradients of every direction and strength.
std::vector<uint8_t> busyImage(int width, int height, uint64_t seed) {
  std::vector<uint8_t> image(static_cast<size_t>(width * height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t i = static_cast<size_t>(y * width + x);
      const double r = std::hypot(x - 0.4 * width, y - 0.6 * height);
      double v = 120 + 60 * std::erf((0.3 * height - r) / 1.3) + 4 * test::gaussian(seed, i);
      if (x > 0.7 * width) v += (x / 5 + y / 9) % 2 == 0 ? 50 : -50;
      image[i] = static_cast<uint8_t>(std::clamp(v, 0.0, 255.0));
    }
  }
  return image;
}

EdgeMap mapOf(const GreyPixels& pixels,
              const EdgeDrawingOptions& options,
              const EdgeRowKernels& kernels) {
  EdgeMapper mapper(pixels.width, pixels.height, options, kernels);
  EdgeMap map;
  mapper.compute(pixels, inner(pixels.width, pixels.height), &map);
  return map;
}

TEST(EdgeMap, EveryInstructionSetGivesTheSameBits) {
  const EdgeRowKernels* avx2 = avx2EdgeRowKernels();
  if (avx2 == nullptr) GTEST_SKIP() << "no AVX2 here";
  long crests = 0;
  for (const auto& [w, h] : {std::pair{5, 5}, {31, 40}, {64, 33}, {65, 9}, {300, 200}, {129, 64}}) {
    const auto image = busyImage(w, h, 3);
    const EdgeMap a = mapOf(pixelsOf(image, w, h), {}, *avx2);
    const EdgeMap b = mapOf(pixelsOf(image, w, h), {}, portableEdgeRowKernels());
    for (size_t plane = 0; plane < kCrestPlanes; ++plane) {
      EXPECT_EQ(a.crests[plane].words, b.crests[plane].words) << w << " " << plane;
      for (const uint64_t word : a.crests[plane].words) crests += std::popcount(word);
    }
    EXPECT_EQ(a.strong.words, b.strong.words) << w;
  }
  EXPECT_GT(crests, 3000);
}

// Against the paper's gradient, which is the same kernel computed in another way.
TEST(EdgeMap, CrestsAreMaximaOfTheGradient) {
  constexpr int kWidth = 150, kHeight = 90;
  const auto image = busyImage(kWidth, kHeight, 4);
  EdgeDrawingOptions options;
  options.anchor_noise_ratio = options.min_noise_ratio = 0;
  options.min_gradient = 3;
  options.anchor_gradient = 6;
  const EdgeMap map = mapOf(pixelsOf(image, kWidth, kHeight), options, portableEdgeRowKernels());
  GradientFilter filter(kWidth, kHeight);
  GradientField field;
  filter.compute({.data = image.data(), .width = kWidth, .height = kHeight, .stride_bytes = kWidth},
                 inner(kWidth, kHeight),
                 &field);
  // Both round, differently.
  constexpr int kRounding = 24;
  int crests = 0;
  for (int y = 3; y < kHeight - 3; ++y) {
    for (int x = 3; x < kWidth - 3; ++x) {
      const size_t i = field.at(x, y);
      const int m = field.magnitude[i], gx = field.gx[i], gy = field.gy[i];
      for (size_t plane = 0; plane < kCrestPlanes; ++plane) {
        const bool along_x = plane == kRight || plane == kLeft;
        const size_t step = along_x ? 1 : kWidth;
        const int beside = std::max(field.magnitude[i - step], field.magnitude[i + step]);
        const int along = along_x ? gx : gy, across = std::abs(along_x ? gy : gx);
        const int signed_along = plane == kRight || plane == kDown ? along : -along;
        const double reach = along_x ? 1.25 : 1.0;
        if (map.crests[plane].test(x, y)) {
          ++crests;
          ASSERT_GE(m, 3 * kGradientUnit - kRounding);
          ASSERT_GE(m, beside - kRounding);
          ASSERT_GE(signed_along, -kRounding);
          ASSERT_LE(across, reach * signed_along + kRounding);
          if (m > 6 * kGradientUnit + kRounding) {
            ASSERT_TRUE(map.strong.test(x, y));
          }
          if (m < 6 * kGradientUnit - kRounding) {
            ASSERT_FALSE(map.strong.test(x, y));
          }
        } else if (m > beside + kRounding && m > 3 * kGradientUnit + kRounding &&
                   across < reach * signed_along - kRounding) {
          ADD_FAILURE() << "no crest at " << x << " " << y << " in plane " << plane;
        } else {
          continue;
        }
      }
    }
  }
  EXPECT_GT(crests, 900);
}

TEST(EdgeMap, NoiseOfWhiteNoiseIsMeasured) {
  constexpr int kSize = 256;
  for (const double sigma : {2.0, 8.0, 30.0}) {
    std::vector<uint8_t> image(size_t{kSize} * kSize);
    for (size_t i = 0; i < image.size(); ++i) {
      image[i] = static_cast<uint8_t>(std::clamp(128.5 + sigma * test::gaussian(5, i), 0.0, 255.0));
    }
    EdgeMapper mapper(kSize, kSize, {}, portableEdgeRowKernels());
    EdgeMap map;
    mapper.compute(pixelsOf(image, kSize, kSize), inner(kSize, kSize), &map);
    // Sum of squares of the kernel: 924 / 4096 across, 84 / 1024 along.
    const double expected = sigma * std::sqrt(924.0 / 4096 * 84 / 1024);
    EXPECT_NEAR(mapper.noise() / expected, 1, 0.08) << sigma;
  }
}

/// A step through (50, 45) whose gradient points along `angle`, and the pixels that a chain of it
/// crosses.
std::vector<uint8_t> step(double angle, int width, int height) {
  std::vector<uint8_t> image(static_cast<size_t>(width * height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double d = std::cos(angle) * (x - 50.3) + std::sin(angle) * (y - 45.2);
      image[static_cast<size_t>(y * width + x)] =
          static_cast<uint8_t>(100.5 + 40 * std::erf(d / 1.1));
    }
  }
  return image;
}

TEST(EdgeLinking, AStepInAnyDirectionIsOneLongChain) {
  constexpr int kWidth = 100, kHeight = 90;
  for (int k = 0; k < 72; ++k) {
    const double angle = 2 * M_PI * (k + 0.25) / 72;
    const auto image = step(angle, kWidth, kHeight);
    EdgeMap map = mapOf(pixelsOf(image, kWidth, kHeight), {}, portableEdgeRowKernels());
    EdgeLinker linker(kWidth, {});
    CrestChains chains;
    linker.link(&map, &chains);
    ASSERT_FALSE(chains.chains.empty());
    uint32_t longest = 0;
    for (const auto& chain : chains.chains) {
      longest = std::max(longest, chain.size);
      ASSERT_LE(chain.first + chain.size, chains.across.size());
      for (uint32_t i = 0; i < chain.size; ++i) {
        const int along = chain.start + static_cast<int>(i);
        const int across = chains.across[chain.first + i];
        const int x = chain.crosses_rows ? across : along, y = chain.crosses_rows ? along : across;
        const double d = std::cos(angle) * (x - 50.3) + std::sin(angle) * (y - 45.2);
        ASSERT_LE(std::abs(d), 1) << k;
      }
    }
    // The rows (or columns) between where the step meets the border of the image.
    const double c = std::abs(std::cos(angle)), s = std::abs(std::sin(angle));
    const double rows = std::min(kHeight - 4.0, s > 0 ? (kWidth - 4) * c / s : 1e9);
    const double columns = std::min(kWidth - 4.0, c > 0 ? (kHeight - 4) * s / c : 1e9);
    EXPECT_GE(longest, std::max(c >= s ? rows : columns, 0.0) * 0.75) << k;
    for (const BitRows& plane : map.crests) {
      for (const uint64_t word : plane.words) EXPECT_EQ(word, 0U);
    }
  }
}

TEST(EdgeLinking, GapsOfOnePixelAreCrossedAndFaintChainsDropped) {
  constexpr int kSize = 64;
  const auto linked = [&](int gap_px, bool strong, bool rows) {
    EdgeMap map;
    for (BitRows& plane : map.crests) plane = BitRows(kSize, kSize);
    map.strong = BitRows(kSize, kSize);
    for (int i = 5; i < 45; ++i) {
      if (i >= 20 && i < 20 + gap_px) continue;
      const int across = 30 + i / 10;
      rows ? map.crests[kLeft].set(across, i) : map.crests[kUp].set(i, across);
    }
    if (strong) rows ? map.strong.set(33, 35) : map.strong.set(35, 33);
    EdgeLinker linker(kSize, {});
    CrestChains chains;
    linker.link(&map, &chains);
    std::vector<uint32_t> sizes;
    for (const auto& chain : chains.chains) {
      EXPECT_EQ(chain.crosses_rows, rows);
      sizes.push_back(chain.size);
    }
    return sizes;
  };
  for (const bool rows : {true, false}) {
    EXPECT_EQ(linked(0, true, rows), std::vector<uint32_t>{40});
    EXPECT_EQ(linked(1, true, rows), std::vector<uint32_t>{40});
    EXPECT_EQ(linked(2, true, rows), std::vector<uint32_t>{23});
    EXPECT_EQ(linked(0, false, rows), std::vector<uint32_t>{});
  }
}

}  // namespace
}  // namespace dlsd
