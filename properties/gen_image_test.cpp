#include "properties/gen_image.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "cameras/calibration/files.h"
#include "detector/test_scene.h"
#include "properties/checks/counterexample.h"
#include "properties/gen.h"
#include "properties/holds.h"
#include "synth/scene.h"

namespace dlsd {
namespace {

TestImage draw(uint64_t seed, int max_side) {
  return makeTestImage(genTestImage(max_side)(rc::Random(seed), rc::kNominalSize).value());
}

TEST(GenImage, EveryKindIsDrawnAndFits) {
  std::set<Fill> fills;
  std::set<std::tuple<int, PixelType, bool>> types;
  std::set<int> widths, heights;
  int tiny = 0;
  for (uint64_t seed = 0; seed < 2000; ++seed) {
    const TestImage image = draw(seed, 64);
    fills.insert(image.fill);
    types.insert({image.channels, image.type, image.bgr});
    widths.insert(image.width);
    heights.insert(image.height);
    tiny += image.width < 8 && image.height < 8 ? 1 : 0;
    const ptrdiff_t size = image.type == PixelType::kU8 ? 1 : image.type == PixelType::kU16 ? 2 : 4;
    EXPECT_GE(image.stride_bytes, size * image.channels * image.width);
    EXPECT_EQ(image.stride_bytes % size, 0);
    EXPECT_EQ(image.bytes.size(), static_cast<size_t>(image.stride_bytes * image.height));
  }
  EXPECT_EQ(fills.size(), static_cast<size_t>(kFillCount));
  EXPECT_EQ(types.size(), 3U * 3U * 2U);
  EXPECT_EQ(widths.size(), 64U);  // 1 and 64 included.
  EXPECT_EQ(heights.size(), 64U);
  EXPECT_GE(tiny, 20);
}

TEST(GenImage, ShrinksToOneGreyPixel) {
  rc::Shrinkable<TestImageSpec> image = genTestImage(64)(rc::Random(5), rc::kNominalSize);
  for (int steps = 0; steps < 10000; ++steps) {
    auto next = image.shrinks().next();
    if (!next) break;
    image = *next;
  }
  const TestImageSpec smallest = image.value();
  EXPECT_EQ(smallest.width, 1);
  EXPECT_EQ(smallest.height, 1);
  EXPECT_EQ(smallest.channels, 1);
  EXPECT_EQ(smallest.fill, Fill::kConstant);
  EXPECT_EQ(smallest.type, PixelType::kU8);
}

TEST(GenImage, FillsAreWhatTheySay) {
  constexpr int kWidth = 200, kHeight = 120;
  for (int f = 0; f < kFillCount; ++f) {
    const auto fill = static_cast<Fill>(f);
    for (uint64_t seed = 0; seed < 20; ++seed) {
      const std::vector<float> grey = filled(fill, kWidth, kHeight, seed, 20, 1);
      ASSERT_EQ(grey.size(), static_cast<size_t>(kWidth) * kHeight);
      EXPECT_EQ(grey, filled(fill, kWidth, kHeight, seed, 20, 1)) << nameOf(fill);
      double sum = 0, squares = 0;
      for (const float value : grey) {
        ASSERT_TRUE(value >= 0 && value <= 255) << nameOf(fill);
        sum += static_cast<double>(value);
        squares += static_cast<double>(value) * static_cast<double>(value);
      }
      const double n = static_cast<double>(grey.size()), mean = sum / n;
      const double sigma = std::sqrt(std::max(0.0, squares / n - mean * mean));
      if (fill == Fill::kConstant) {
        EXPECT_LE(sigma, 1e-3);
      }
      if (fill == Fill::kWhiteNoise) {
        EXPECT_NEAR(sigma, 20, 1);
      }
      // A Gaussian of 1 px leaves 1 / (2 sqrt(pi)) of the standard deviation.
      if (fill == Fill::kBlurredNoise) {
        EXPECT_NEAR(sigma, 20 * 0.2821, 0.6);
      }
    }
  }
}

// Saved cases are seeds: if this fails, kSceneVersion must be raised.
TEST(GenImage, PaintedScenesAreThoseOfTheirVersion) {
  const test::Scene scene = test::randomScene(1, 2, 1, 1);
  double sum = 0;
  for (const test::Shape& shape : scene.shapes) {
    sum += shape.axis.x() + 2 * shape.axis.y() + 3 * shape.grey / 255 + 5 * shape.cos_radius;
    for (const Eigen::Vector3d& vertex : shape.vertices) sum += vertex.x() + 2 * vertex.y();
  }
  EXPECT_STREQ(test::kSceneVersion, "painted/1");
  EXPECT_NEAR(scene.background, 93.179651636612, 1e-9);
  EXPECT_NEAR(sum, 10.5863002671322, 1e-9);
}

// --- Saved cases ---

TEST(UnfinishedCase, IsOnDiskUntilItIsJudged) {
  const std::string folder = testing::TempDir() + "unfinished_test";
  std::filesystem::remove_all(folder);
  const nlohmann::ordered_json json{{"format", "dlsd-case/1"}, {"scene", "room"}};
  const std::string path = folder + "/unfinished-" + std::to_string(::getpid()) + ".json";
  {
    const UnfinishedCase unfinished(folder, json);
    const auto saved = nlohmann::json::parse(readFile(path));
    EXPECT_EQ(saved["format"], "dlsd-case/1");
    EXPECT_EQ(saved["versions"]["scene"], presetVersion("room"));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  std::filesystem::remove_all(folder);
}

// The distribution, not only its spread: the chance of so many electrons, of 1 and 49 on average.
TEST(GenImage, ShotNoiseIsPoisson) {
  for (const double mean : {1.0, 49.0}) {
    const std::vector<float> grey = filled(Fill::kShotNoise, 500, 400, 7, 128 / std::sqrt(mean), 0);
    const auto n = static_cast<double>(grey.size());
    double probability = std::exp(-mean);
    for (int count = 0; count * 128 / mean < 255; ++count) {
      if (count > 0) probability *= mean / count;
      const double level = count * 128 / mean;
      const auto found = static_cast<double>(std::count_if(grey.begin(), grey.end(), [&](float g) {
        return std::abs(static_cast<double>(g) - level) < 0.01;
      }));
      EXPECT_LE(std::abs(found - n * probability), 5 * std::sqrt(n * probability) + 5)
          << count << " of " << mean;
    }
  }
}

// What is rounded to 8 bits is still noise.
TEST(GenImage, NoiseIsAsStrongAsStated) {
  for (const Fill kind : kNoiseFills) {
    for (uint64_t seed = 0; seed < 200; ++seed) {
      const TestImageSpec spec = genNoise(kind, 100, 100)(rc::Random(seed), 100).value();
      const TestImage image = makeTestImage(spec);
      double sum = 0, squares = 0;
      for (const std::byte byte : image.bytes) {
        const auto value = static_cast<double>(byte);
        sum += value;
        squares += value * value;
      }
      const auto n = static_cast<double>(image.bytes.size());
      const double variance = squares / n - sum / n * (sum / n);
      if (kind != Fill::kSaltAndPepper) {
        EXPECT_GE(variance, 0.05) << spec;
      }
      if (kind == Fill::kBlurredNoise) {
        // Rounding adds a twelfth, or takes the most of what is much below a level.
        const double sigma = spec.noise_sigma * blurGain(spec.blur_px);
        EXPECT_LE(std::abs(std::sqrt(variance) - sigma), 0.15 + 0.15 * sigma) << spec;
      }
    }
  }
}

TEST(GenImage, PartsAndScaledCamerasSeeTheSame) {
  const auto same = [](const std::optional<Eigen::Vector3d>& a,
                       const std::optional<Eigen::Vector3d>& b) {
    return a.has_value() == b.has_value() && (!a || (*a - *b).norm() <= 1e-9);
  };
  holds(1, [&] {
    const Camera camera = *genAnyCamera(Range::kRealistic);
    const Eigen::Vector2d pixel = *genPixelInImage(camera);
    const int left = *genInt(0, 50), top = *genInt(0, 50);
    RC_ASSERT(same(
        camera.unproject(pixel),
        croppedCamera(camera, left, top, 100, 80).unproject({pixel.x() - left, pixel.y() - top})));
    const double factor = *genReal(0.25, 2);
    RC_ASSERT(
        same(camera.unproject(pixel),
             scaledCamera(camera, factor, 100, 80)
                 .unproject({(pixel.x() + 0.5) * factor - 0.5, (pixel.y() + 0.5) * factor - 0.5})));
  });
  for (const std::string_view model : cameraModelNames()) {
    for (uint64_t seed = 0; seed < 50; ++seed) {
      const Camera camera = genSmallCamera(model, 300)(rc::Random(seed), 100).value();
      EXPECT_LE(std::max(camera.width(), camera.height()), 300);
      EXPECT_GE(std::max(camera.width(), camera.height()), 100);
    }
  }
}

}  // namespace
}  // namespace dlsd
