#include "synth/pixel_response.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "synth/dataset/random.h"

namespace dlsd {
namespace {

constexpr int kPositions = PixelResponse::kPositions;

/// Response of the pixel at an offset (x, y) to light at sub-pixel position (u, v) of pixel 0.
double responseAt(const PixelResponse& response, int x, int y, int u, int v) {
  if (std::max(std::abs(x), std::abs(y)) > response.radius()) return 0;
  double sum = 0;
  for (size_t term = 0; term < response.terms(); ++term) {
    sum += static_cast<double>(response.sign(term)) *
           static_cast<double>(response.taps(term, u)[x + response.radius()]) *
           static_cast<double>(response.taps(term, v)[y + response.radius()]);
  }
  return sum;
}

/// The same by its definition: the share of random points of square + disc + Gaussian around the
/// light that fall where the pixel is.
double responseByDice(double sigma, double disc, double dx, double dy, double* standard_error) {
  const Random random(7, 1);
  // The square's share is an integral over a box around (dx, dy), so dice only disc and Gaussian.
  constexpr int kDraws = 400000;
  double hits = 0;
  for (uint64_t i = 0; i < kDraws; ++i) {
    const double r = disc * std::sqrt(random.uniform(4 * i, 0, 1));
    const double phi = random.uniform(4 * i + 1, 0, 2 * M_PI);
    const double x = r * std::cos(phi) + sigma * random.normal(4 * i + 2);
    const double y = r * std::sin(phi) + sigma * random.normal(4 * i + 3);
    hits += std::abs(x - dx) < 0.5 && std::abs(y - dy) < 0.5 ? 1 : 0;
  }
  const double share = hits / kDraws;
  *standard_error = std::sqrt(share * (1 - share) / kDraws);
  return share;
}

const std::vector<std::pair<double, double>>& blurs() {
  static const std::vector<std::pair<double, double>> all{
      {0, 0}, {0.3, 0}, {0.7, 0}, {1.2, 0}, {0.7, 0.6}, {0.7, 3}, {0.2, 2}, {0, 1.5}};
  return all;
}

TEST(PixelResponse, IsSquareDiscAndGaussianConvolved) {
  int checked = 0;
  for (const auto& [sigma, disc] : blurs()) {
    const PixelResponse response(sigma, disc);
    const double peak = responseAt(response, 0, 0, kPositions / 2, kPositions / 2);
    for (const auto& [u, v] : {std::pair(128, 128), std::pair(3, 128), std::pair(40, 230)}) {
      for (const auto& [x, y] : {std::pair(0, 0), std::pair(1, 0), std::pair(-1, 2)}) {
        // The place of the pixel as seen from the light.
        const double dx = x - ((u + 0.5) / kPositions - 0.5);
        const double dy = y - ((v + 0.5) / kPositions - 0.5);
        double standard_error = 0;
        const double expected = responseByDice(sigma, disc, dx, dy, &standard_error);
        // 4 sigma of the dice, the tolerance of the expansion, the cut at 4 sigma.
        const double tolerance =
            4 * standard_error + (disc > 0 ? PixelResponse::kMaxTermError : 0) * peak + 3e-4;
        // Without any blur the square's own border is a jump.
        EXPECT_NEAR(responseAt(response, x, y, u, v), expected, tolerance + (sigma + disc == 0))
            << sigma << " " << disc << " at " << dx << " " << dy;
        ++checked;
      }
    }
  }
  EXPECT_EQ(checked, 72);
  const PixelResponse square;
  EXPECT_EQ(square.radius(), 0);
  for (int k = 0; k < kPositions; ++k) EXPECT_EQ(responseAt(square, 0, 0, k, 9), 1);
}

// Light from any place is kept, and its place is where it was.
TEST(PixelResponse, KeepsLightAndItsPlace) {
  for (const auto& [sigma, disc] : blurs()) {
    const PixelResponse response(sigma, disc);
    for (int u = 0; u < kPositions; u += 5) {
      const int v = (u * 37 + 11) % kPositions;
      double sum = 0, mean = 0;
      for (int y = -response.radius(); y <= response.radius(); ++y) {
        for (int x = -response.radius(); x <= response.radius(); ++x) {
          sum += responseAt(response, x, y, u, v);
          mean += x * responseAt(response, x, y, u, v);
        }
      }
      EXPECT_NEAR(sum, 1, 1e-5) << sigma << " " << disc;
      // A pixel's square samples the place at whole pixels, unless there is a blur.
      const double tolerance = sigma + disc < 0.5 ? 0.51 : sigma < 0.5 ? 0.03 : 1e-3;
      EXPECT_NEAR(mean, (u + 0.5) / kPositions - 0.5, tolerance) << sigma << " " << disc;
    }
  }
}

// Constant pixels are convolved as if each were made of its positions.
TEST(PixelResponse, ConvolvesPixelsAsTheSumOfTheirPositions) {
  constexpr int kWidth = 41, kHeight = 37;
  int checked = 0;
  for (const auto& [sigma, disc] : blurs()) {
    const PixelResponse response(sigma, disc);
    std::vector<float> in(kWidth * kHeight, 0), out;
    in[18 * kWidth + 20] = 1;
    response.convolve(kWidth, kHeight, in, &out);
    for (const auto& [x, y] : {std::pair(0, 0), std::pair(2, -1), std::pair(-3, 3)}) {
      double expected = 0;
      for (int u = 0; u < kPositions; u += 4) {
        for (int v = 2; v < kPositions; v += 4) {
          expected += responseAt(response, x, y, u, v) / (kPositions * kPositions / 16);
        }
      }
      EXPECT_NEAR(out[static_cast<size_t>((18 + y) * kWidth + 20 + x)], expected, 2e-3)
          << sigma << " " << disc << " at " << x << " " << y;
      ++checked;
    }
    std::fill(in.begin(), in.end(), 0.25F);
    response.convolve(kWidth, kHeight, in, &out);
    for (const float value : out) ASSERT_NEAR(value, 0.25F, 1e-6) << sigma << " " << disc;
  }
  EXPECT_EQ(checked, 24);
}

TEST(PixelResponse, WideGaussiansAreSplit) {
  constexpr int kSize = 101;
  for (const double sigma : {1.25, 1.26, 2.0, 8.0}) {
    const PixelResponse response(sigma, 0);
    std::vector<float> in(kSize * kSize, 0), image;
    in[50 * kSize + 50] = 1;
    response.convolve(kSize, kSize, in, &image);
    response.blurRest(kSize, kSize, &image);
    double sum = 0, variance = 0;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const auto value = static_cast<double>(image[static_cast<size_t>(y * kSize + x)]);
        sum += value;
        variance += value * (x - 50) * (x - 50);
      }
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    // The pixel that shines and the one that sees are squares; the cut at 4 sigma takes 0.1 %.
    EXPECT_NEAR(variance, sigma * sigma + 2.0 / 12, 2e-3 * sigma * sigma) << sigma;
    std::fill(in.begin(), in.end(), 0.5F);
    response.convolve(kSize, kSize, in, &image);
    response.blurRest(kSize, kSize, &image);
    for (const float value : image) ASSERT_NEAR(value, 0.5F, 1e-5);
  }
}

}  // namespace
}  // namespace dlsd
