#include "detector/gradient.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "detector/grey_rows.h"
#include "detector/test_scene.h"

namespace dlsd {
namespace {

constexpr int kWidth = 61, kHeight = 43;  // no multiple of any SIMD width
constexpr size_t kCount = size_t{kWidth} * kHeight;

std::vector<uint8_t> randomImage(uint64_t seed) {
  std::vector<uint8_t> image(kCount);
  for (size_t i = 0; i < kCount; ++i) image[i] = static_cast<uint8_t>(256 * test::uniform(seed, i));
  return image;
}

GradientField gradientOf(const ImageView& view) {
  BitRows usable(view.width, view.height);
  std::fill(usable.words.begin(), usable.words.end(), ~uint64_t{0});
  GradientFilter filter(view.width, view.height);
  GradientField field;
  filter.compute(view, usable, &field);
  return field;
}

ImageView viewOf(const std::vector<uint8_t>& image) {
  return {.data = image.data(), .width = kWidth, .height = kHeight, .stride_bytes = kWidth};
}

/// Direct convolution in double, border pixels repeated.
std::array<double, 2> slowGradient(const std::vector<uint8_t>& image, int x, int y) {
  const auto grey = [&](int i, int j) {
    return static_cast<double>(image[static_cast<size_t>(std::clamp(j, 0, kHeight - 1)) * kWidth +
                                     static_cast<size_t>(std::clamp(i, 0, kWidth - 1))]);
  };
  const double binomial[5] = {1, 4, 6, 4, 1};
  const auto smooth = [&](int i, int j) {
    i = std::clamp(i, 0, kWidth - 1);
    j = std::clamp(j, 0, kHeight - 1);
    double sum = 0;
    for (int b = -2; b <= 2; ++b) {
      for (int a = -2; a <= 2; ++a) sum += binomial[a + 2] * binomial[b + 2] * grey(i + a, j + b);
    }
    return sum / 256;
  };
  double gx = 0, gy = 0;
  for (int k = -1; k <= 1; ++k) {
    const double w = (2 - std::abs(k)) / 8.0;
    gx += w * (smooth(x + 1, y + k) - smooth(x - 1, y + k));
    gy += w * (smooth(x + k, y + 1) - smooth(x + k, y - 1));
  }
  return {gx, gy};
}

TEST(Gradient, EqualsDirectConvolution) {
  const auto image = randomImage(1);
  const GradientField field = gradientOf(viewOf(image));
  double largest = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto expected = slowGradient(image, x, y);
      const size_t i = field.at(x, y);
      largest = std::max(largest, std::abs(field.gx[i] / double{kGradientUnit} - expected[0]));
      largest = std::max(largest, std::abs(field.gy[i] / double{kGradientUnit} - expected[1]));
    }
  }
  // Two roundings to 1/16 grey level, of at most 1/32 each, times the gradient's weights (sum 1).
  EXPECT_LE(largest, 2.0 / 32 + 1e-12);
}

TEST(Gradient, MagnitudeIsNearTheNorm) {
  const auto image = randomImage(2);
  const GradientField field = gradientOf(viewOf(image));
  for (size_t i = 0; i < kCount; ++i) {
    const double norm = std::hypot(field.gx[i], field.gy[i]);
    EXPECT_GE(field.magnitude[i], 0.97 * norm - 2);
    EXPECT_LE(field.magnitude[i], 1.07 * norm + 2);
  }
}

TEST(Gradient, AllPixelTypesOfTheSameGreyAgree) {
  const auto image = randomImage(3);
  const GradientField expected = gradientOf(viewOf(image));
  std::vector<uint16_t> u16(kCount);
  std::vector<float> f32(kCount);
  for (size_t i = 0; i < kCount; ++i) {
    u16[i] = static_cast<uint16_t>(image[i] * 257);
    f32[i] = image[i];
  }
  ImageView view{.data = u16.data(),
                 .width = kWidth,
                 .height = kHeight,
                 .stride_bytes = 2 * kWidth,
                 .type = PixelType::kU16};
  EXPECT_EQ(gradientOf(view).gx, expected.gx);
  view.data = f32.data();
  view.stride_bytes = 4 * kWidth;
  view.type = PixelType::kF32;
  EXPECT_EQ(gradientOf(view).gy, expected.gy);
}

TEST(Gradient, ColourChannelsAndStridesAreRead) {
  const auto image = randomImage(4);
  const GradientField expected = gradientOf(viewOf(image));
  for (const int channels : {3, 4}) {
    const size_t stride = static_cast<size_t>(kWidth * channels + 13);
    std::vector<uint8_t> colour(stride * kHeight, 99);
    for (size_t y = 0; y < kHeight; ++y) {
      for (size_t x = 0; x < kWidth; ++x) {
        for (size_t c = 0; c < 3; ++c) {
          colour[y * stride + x * static_cast<size_t>(channels) + c] = image[y * kWidth + x];
        }
      }
    }
    const ImageView view{.data = colour.data(),
                         .width = kWidth,
                         .height = kHeight,
                         .channels = channels,
                         .stride_bytes = static_cast<ptrdiff_t>(stride)};
    EXPECT_EQ(gradientOf(view).gx, expected.gx);
  }
  // Rows upside down through a negative stride: gy changes sign.
  ImageView flipped = viewOf(image);
  flipped.data = image.data() + kCount - kWidth;
  flipped.stride_bytes = -kWidth;
  const GradientField upside_down = gradientOf(flipped);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      ASSERT_EQ(upside_down.gy[upside_down.at(x, y)],
                -expected.gy[expected.at(x, kHeight - 1 - y)]);
    }
  }
}

TEST(Gradient, BgrWeighsBlueLess) {
  std::vector<uint8_t> colour(kCount * 3, 0);
  for (size_t i = 0; i < kCount; ++i)
    colour[3 * i] = static_cast<uint8_t>(i % kWidth < 30 ? 0 : 200);
  ImageView view{.data = colour.data(),
                 .width = kWidth,
                 .height = kHeight,
                 .channels = 3,
                 .stride_bytes = 3 * kWidth};
  const GradientField red = gradientOf(view);
  view.bgr = true;
  const GradientField blue = gradientOf(view);
  const size_t edge = red.at(30, 20);
  EXPECT_NEAR(static_cast<double>(red.gx[edge]) / blue.gx[edge], 77.0 / 29, 0.05);
}

TEST(Gradient, SixteenBitsAreRoundedToTheNearest) {
  std::vector<uint16_t> values(65536), row(65536);
  for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<uint16_t>(i);
  loadGreyRow({.data = values.data(),
               .width = 65536,
               .height = 1,
               .stride_bytes = 2 * 65536,
               .type = PixelType::kU16},
              0,
              row.data());
  for (size_t i = 0; i < values.size(); ++i) {
    const double exact = static_cast<double>(i) * 255 * kGreyUnit / 65535;
    ASSERT_LE(std::abs(static_cast<double>(row[i]) - exact), 0.5) << i;
  }
}

TEST(Gradient, FloatsOutsideTheRangeAreClamped) {
  std::vector<float> image(kCount, 0);
  for (size_t i = 0; i < kCount; ++i) {
    const size_t x = i % kWidth;
    image[i] = x < 20 ? -1e30F : x < 40 ? std::numeric_limits<float>::quiet_NaN() : 1e30F;
  }
  const ImageView view{.data = image.data(),
                       .width = kWidth,
                       .height = kHeight,
                       .stride_bytes = 4 * kWidth,
                       .type = PixelType::kF32};
  const GradientField field = gradientOf(view);
  EXPECT_EQ(field.gx[field.at(20, 20)], 0);
  // A step of 255 through a kernel whose largest weight is 5/16.
  EXPECT_GT(field.gx[field.at(40, 20)], 50 * kGradientUnit);
  EXPECT_LE(field.gx[field.at(40, 20)], 255 * 5 / 16 * kGradientUnit + kGradientUnit);
}

TEST(Gradient, MaskedPixelsHaveNoMagnitude) {
  const auto image = randomImage(6);
  BitRows usable(kWidth, kHeight);
  std::fill(usable.words.begin(), usable.words.end(), ~uint64_t{0});
  usable.clear(100 % kWidth, 100 / kWidth);
  usable.clear(1234 % kWidth, 1234 / kWidth);
  GradientFilter filter(kWidth, kHeight);
  GradientField field;
  filter.compute(viewOf(image), usable, &field);
  EXPECT_EQ(field.magnitude[100], 0);
  EXPECT_EQ(field.magnitude[1234], 0);
  EXPECT_GT(field.magnitude[1235], 0);
}

}  // namespace
}  // namespace dlsd
