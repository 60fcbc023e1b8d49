#include "detector/ray_table.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "detector/test_scene.h"
#include "detector/validation.h"

namespace dlsd {
namespace {

using test::uniform;

TEST(RayTable, InterpolatedRaysAreWithinTheStatedError) {
  for (const auto& [name, camera] : test::testCameras()) {
    const RayTable table(camera);
    double largest_px = 0, largest_derivative = 0;
    int count = 0;
    for (uint64_t k = 0; k < 20000; ++k) {
      const double u = uniform(1, 2 * k) * camera.width() - 0.5;
      const double v = uniform(1, 2 * k + 1) * camera.height() - 0.5;
      const int x = static_cast<int>(std::lround(u)), y = static_cast<int>(std::lround(v));
      if (!table.isUsable(x, y)) continue;
      ASSERT_TRUE(table.covers(u, v)) << name << " " << u << " " << v;
      const RaySample s = table.at(u, v);
      const auto exact = camera.unproject({u, v});
      ASSERT_TRUE(exact);
      EXPECT_NEAR(s.ray.norm(), 1, 1e-12);
      // Small angle between the two, times the scale.
      largest_px = std::max(largest_px, s.ray.cross(*exact).norm() * s.pxPerRad());
      const auto J = camera.jacobian(*exact);
      ASSERT_TRUE(J);
      Eigen::Matrix<double, 3, 2> D;
      D << s.du, s.dv;
      largest_derivative =
          std::max(largest_derivative, (*J * D - Eigen::Matrix2d::Identity()).norm());
      ++count;
    }
    EXPECT_GT(count, 10000) << name;
    EXPECT_LE(largest_px, 0.002) << name;
    EXPECT_LE(largest_derivative, 0.02) << name;
    RecordProperty(std::string("largest_px_") + name, std::to_string(largest_px));
  }
}

TEST(RayTable, UsableIsWhatKeepsClearOfBorderAndRim) {
  for (const auto& [name, camera] : test::testCameras(20)) {
    const RayTable table(camera);
    const int w = camera.width(), h = camera.height();
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        bool expected = x >= 2 && y >= 2 && x < w - 2 && y < h - 2;
        for (int j = 0; j < h && expected; ++j) {
          for (int i = 0; i < w && expected; ++i) {
            if ((i - x) * (i - x) + (j - y) * (j - y) > 25) continue;
            expected = camera.unproject({double(i), double(j)}).has_value();
          }
        }
        ASSERT_EQ(table.isUsable(x, y), expected) << name << " " << x << " " << y;
      }
    }
  }
}

TEST(RayTable, TinyImagesHaveNoUsablePixel) {
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 9}, {9, 1}, {2, 2}, {3, 3}, {4, 4}}) {
    const RayTable table(makeCamera("pinhole", std::array{10.0, 10.0, 1.0, 1.0}, w, h));
    for (const uint16_t usable : table.usable()) EXPECT_EQ(usable, 0);
    EXPECT_FALSE(table.covers(w - 1.0, h - 1.0));
  }
}

TEST(RayTable, FirstOrderReprojectionErrorIsThatOfEquation8) {
  for (const auto& [name, camera] : test::testCameras()) {
    const RayTable table(camera);
    int count = 0;
    for (uint64_t k = 0; k < 500; ++k) {
      const Eigen::Vector2d pixel(uniform(2, 4 * k) * 639, uniform(2, 4 * k + 1) * 511);
      if (!table.isUsable(static_cast<int>(std::lround(pixel.x())),
                          static_cast<int>(std::lround(pixel.y())))) {
        continue;
      }
      // A plane about 1 px from the pixel, in any direction.
      const auto ray = camera.unproject(pixel);
      ASSERT_TRUE(ray);
      const double turn = 2 * M_PI * uniform(2, 4 * k + 2);
      const Eigen::Vector3d a = ray->unitOrthogonal(), b = ray->cross(a);
      const Eigen::Vector3d across = std::cos(turn) * a + std::sin(turn) * b;
      const double tilt = 0.004 * uniform(2, 4 * k + 3);
      const Eigen::Vector3d normal = std::cos(tilt) * across + std::sin(tilt) * *ray;
      const auto exact = reprojectionErrorPx(camera, pixel, normal);
      ASSERT_TRUE(exact) << name;
      const RaySample sample = table.at(pixel.x(), pixel.y());
      EXPECT_NEAR(reprojectionErrorFirstOrder(sample, normal), *exact, 0.003 + 0.02 * *exact);
      // The distance to the curve is at most the way to the foot on the sphere.
      EXPECT_LE(std::abs(curveOffset(sample, normal).offset_px), 1.02 * *exact + 0.003);
      ++count;
    }
    EXPECT_GT(count, 200) << name;
  }
}

}  // namespace
}  // namespace dlsd
