#include "detector/edge_profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "detector/test_scene.h"

namespace dlsd {
namespace {

constexpr int kSize = 80;
constexpr double kContrast = 80;

/// Column at which the edge crosses row y.
double edgeAt(double y, double slope, double phase) {
  return 40 + phase + slope * (y - 40);
}

std::vector<double> stepImage(double slope, double phase, double blur, bool transposed) {
  std::vector<double> image(size_t{kSize} * kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double d = (transposed ? y - edgeAt(x, slope, phase) : x - edgeAt(y, slope, phase)) /
                       std::hypot(1, slope);
      image[static_cast<size_t>(y * kSize + x)] =
          90 + kContrast / 2 * std::erf(d / (std::sqrt(2.0) * blur));
    }
  }
  return image;
}

EdgeResponse mean(const std::array<EdgeResponse, EdgeProfiler::kRows>& rows) {
  EdgeResponse sum{};
  for (const EdgeResponse& r : rows) {
    sum.odd_narrow += r.odd_narrow / 8;
    sum.even_narrow += r.even_narrow / 8;
    sum.odd_wide += r.odd_wide / 8;
    sum.even_wide += r.even_wide / 8;
  }
  return sum;
}

// Both pixel types, both directions, any slope and phase: the offset from where the edge was looked
// for is found, and is not biased where it is 0.
TEST(EdgeProfile, OffsetOfABlurredStep) {
  EdgeProfiler profiler;
  int count = 0;
  for (const bool crosses_rows : {true, false}) {
    for (const double slope : {-1.0, -0.3, 0.0, 0.45, 1.0}) {
      for (const double phase : {0.0, 0.17, 0.5, 0.83}) {
        const auto image = stepImage(slope, phase, 0.8, !crosses_rows);
        std::vector<uint8_t> u8;
        std::vector<uint16_t> fixed;
        for (const double v : image) {
          u8.push_back(static_cast<uint8_t>(v + 0.5));
          fixed.push_back(static_cast<uint16_t>(v * kGreyUnit + 0.5));
        }
        for (const bool is_u8 : {true, false}) {
          profiler.setPixels({.u8 = is_u8 ? u8.data() : nullptr,
                              .fixed = fixed.data(),
                              .stride = kSize,
                              .width = kSize,
                              .height = kSize});
          for (const double offset : {-0.3, 0.0, 0.3}) {
            std::array<EdgeResponse, EdgeProfiler::kRows> rows;
            profiler.measure({crosses_rows, 36, edgeAt(39.5, slope, phase) - offset, slope}, &rows);
            const EdgeResponse r = mean(rows);
            // Slanted edges are wider along the rows than the filters expect.
            EXPECT_NEAR(r.odd_narrow, kContrast, 0.25 * kContrast);
            EXPECT_NEAR(r.odd_wide, kContrast, 0.15 * kContrast);
            const double rounding = is_u8 ? 0.015 : 0.006;
            const double scale = offset == 0 ? 0 : 0.1;
            EXPECT_NEAR(r.even_narrow / r.odd_narrow, offset, rounding + scale) << slope;
            EXPECT_NEAR(r.even_wide / r.odd_wide, offset, rounding + scale) << slope;
            ++count;
          }
        }
      }
    }
  }
  EXPECT_EQ(count, 2 * 5 * 4 * 2 * 3);
}

TEST(EdgeProfile, WhiteNoiseScattersAsStated) {
  EdgeProfiler profiler;
  std::vector<uint16_t> image(size_t{kSize} * kSize);
  for (size_t i = 0; i < image.size(); ++i) {
    image[i] = static_cast<uint16_t>((128 + 10 * test::gaussian(3, i)) * kGreyUnit);
  }
  profiler.setPixels(
      {.u8 = nullptr, .fixed = image.data(), .stride = kSize, .width = kSize, .height = kSize});
  EdgeResponse sum{};
  int count = 0;
  for (int y = 0; y + 8 <= kSize; y += 8) {
    for (int x = 8; x < kSize - 9; x += 3) {
      std::array<EdgeResponse, EdgeProfiler::kRows> rows;
      profiler.measure({true, y, x + 0.01 * x, 0}, &rows);
      for (const EdgeResponse& r : rows) {
        sum.odd_narrow += r.odd_narrow * r.odd_narrow;
        sum.even_narrow += r.even_narrow * r.even_narrow;
        sum.odd_wide += r.odd_wide * r.odd_wide;
        sum.even_wide += r.even_wide * r.even_wide;
        ++count;
      }
    }
  }
  const EdgeResponse& white = profiler.whiteNoise();
  const auto ratio = [&](float squares, float one) {
    return std::sqrt(squares / static_cast<float>(count)) / (10 * one);
  };
  EXPECT_NEAR(ratio(sum.odd_narrow, white.odd_narrow), 1, 0.08);
  EXPECT_NEAR(ratio(sum.even_narrow, white.even_narrow), 1, 0.08);
  EXPECT_NEAR(ratio(sum.odd_wide, white.odd_wide), 1, 0.15);
  EXPECT_NEAR(ratio(sum.even_wide, white.even_wide), 1, 0.15);
}

// Windows at and beyond every border: nothing is read outside (the sanitizer preset would say so),
// rows outside answer 0.
TEST(EdgeProfile, WindowsBeyondTheBorder) {
  EdgeProfiler profiler;
  for (const auto& [w, h] : {std::pair{1, 1}, {7, 5}, {40, 30}}) {
    const std::vector<uint8_t> image(static_cast<size_t>(w * h), 77);
    profiler.setPixels(
        {.u8 = image.data(), .fixed = nullptr, .stride = w, .width = w, .height = h});
    for (const bool crosses_rows : {true, false}) {
      for (const int first : {-9, -3, 0, h - 3, h + 2}) {
        for (const double across : {-3.0, 0.0, w - 1.0, w + 4.0}) {
          std::array<EdgeResponse, EdgeProfiler::kRows> rows;
          profiler.measure({crosses_rows, first, across, 0.5}, &rows);
          for (const EdgeResponse& r : rows) {
            EXPECT_EQ(r.odd_narrow, 0);  // constant images have no edge, nor have rows outside
            EXPECT_EQ(r.even_wide, 0);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace dlsd
