#include "detector/plane_curve.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "detector/test_scene.h"
#include "detector/usable_mask.h"
#include "detector/validation.h"

namespace dlsd {
namespace {

using test::uniform;

TEST(PlaneCurve, FirstOrderReprojectionErrorIsThatOfEquation8) {
  for (const auto& [name, camera] : test::testCameras()) {
    const RayTable table(camera);
    const UsableMask mask(camera);
    int count = 0;
    for (uint64_t k = 0; k < 500; ++k) {
      const Eigen::Vector2d pixel(uniform(2, 4 * k) * 639, uniform(2, 4 * k + 1) * 511);
      if (!mask.bits().contains(static_cast<int>(std::lround(pixel.x())),
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
