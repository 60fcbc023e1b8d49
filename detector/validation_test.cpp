#include "detector/validation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "detector/test_scene.h"

namespace dlsd {
namespace {

TEST(Validation, PixelsOnThePlanesImageHaveNoError) {
  for (const auto& [name, camera] : test::testCameras()) {
    int beyond_90 = 0, count = 0;
    for (uint64_t k = 0; k < 300; ++k) {
      const Eigen::Vector2d pixel(640 * test::uniform(1, 3 * k), 512 * test::uniform(1, 3 * k + 1));
      const auto ray = camera.unproject(pixel);
      if (!ray) continue;
      const Eigen::Vector3d normal =
          Eigen::AngleAxisd(6.28 * test::uniform(1, 3 * k + 2), *ray) * ray->unitOrthogonal();
      const auto err = reprojectionErrorPx(camera, pixel, normal);
      ASSERT_TRUE(err) << name;
      EXPECT_LE(*err, 1e-9) << name;
      beyond_90 += ray->z() < 0;
      ++count;
    }
    EXPECT_GT(count, 150) << name;
    if (camera.maxFieldAngle() > 1.7 && std::string(name) != "fov") {
      EXPECT_GT(beyond_90, 0) << name;
    }
  }
}

TEST(Validation, APlaneOnePixelAwayGivesOnePixel) {
  const Camera camera = makeCamera("pinhole", std::array{300.0, 300.0, 320.0, 256.0}, 640, 512);
  // The image of y = z c is the row 256 + 300 c; near the axis the foot is straight below.
  const Eigen::Vector3d normal = Eigen::Vector3d(0, 1, -1.0 / 300).normalized();
  const auto err = reprojectionErrorPx(camera, {320, 256}, normal);
  ASSERT_TRUE(err);
  EXPECT_NEAR(*err, 1, 1e-4);
}

TEST(Validation, NoAnswerOutsideTheDomain) {
  const Camera camera = makeCamera("omni", std::array{1.4, 420.0, 421.0, 320.0, 256.0}, 640, 512);
  EXPECT_FALSE(reprojectionErrorPx(camera, {320 + 500, 256}, Eigen::Vector3d::UnitY()));
  // The ray of the pixel is the normal: its foot is the origin.
  EXPECT_FALSE(reprojectionErrorPx(camera, {320, 256}, Eigen::Vector3d::UnitZ()));
}

TEST(Validation, ScoreIsTheChernoffBoundOfTheBestTolerance) {
  AlignmentCounter counter;
  const Eigen::Vector2d e(0.6, 0.8);
  for (int i = 0; i < 60; ++i) counter.add(-60, -80, e, true);
  // All within the finest of five tolerances, p = 1/64, with 60 / 3 independent samples.
  const double tests = 100.0 * 200 * 5;
  EXPECT_NEAR(counter.score(100, 200), 20 * std::log10(64.0) - std::log10(tests), 1e-9);
  // Gradients along the curve, or none at all, count against it.
  for (int i = 0; i < 30; ++i) counter.add(80, -60, e, true);
  for (int i = 0; i < 30; ++i) counter.add(60, 80, e, false);
  const double divergence = 0.5 * std::log(0.5 * 64) + 0.5 * std::log(0.5 / (1 - 1.0 / 64));
  EXPECT_NEAR(counter.score(100, 200), 40 * divergence / std::log(10.0) - std::log10(tests), 1e-9);
  EXPECT_NEAR(AlignmentCounter{}.score(100, 200), -std::log10(tests), 1e-12);
}

TEST(Validation, ScoreNeverExceedsTheBinomialTail) {
  // Chernoff's bound lies above the tail, so the score lies below -log10(tests * tail).
  for (const int n : {12, 30, 90}) {
    for (int k = 0; k <= n; ++k) {
      AlignmentCounter counter;
      for (int i = 0; i < 3 * n; ++i) {
        // Within pi / 8 but not within pi / 16: only the first tolerance, p = 1/4.
        const double angle = i < 3 * k ? 0.3 : 1.0;
        counter.add(std::cos(angle), std::sin(angle), {1, 0}, true);
      }
      double tail = 0;
      for (int j = k; j <= n; ++j) {
        tail += std::exp(std::lgamma(n + 1) - std::lgamma(j + 1) - std::lgamma(n - j + 1) +
                         j * std::log(0.25) + (n - j) * std::log(0.75));
      }
      EXPECT_LE(counter.score(10, 10), -std::log10(tail * 500) + 1e-9) << n << " " << k;
    }
  }
}

}  // namespace
}  // namespace dlsd
