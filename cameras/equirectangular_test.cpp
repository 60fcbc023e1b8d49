#include "cameras/equirectangular.h"

#include <gtest/gtest.h>

#include "cameras/camera.h"

namespace dlsd {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

/// The whole sphere in 1024 x 512 px.
Equirectangular whole() {
  return {1024 / (2 * M_PI), 512 / M_PI, 511.5, 255.5};
}

TEST(Equirectangular, KnownPoints) {
  const Equirectangular m = whole();
  const auto expect = [&](double x, double y, double z, double u, double v) {
    const auto p = m.project(x, y, z);
    ASSERT_TRUE(p.valid);
    EXPECT_NEAR(p.u, u, 1e-12) << x << " " << y << " " << z;
    EXPECT_NEAR(p.v, v, 1e-12) << x << " " << y << " " << z;
  };
  expect(0, 0, 3, 511.5, 255.5);
  expect(2, 0, 0, 511.5 + 256, 255.5);   // 90 degrees to the right.
  expect(-2, 0, 0, 511.5 - 256, 255.5);  // To the left.
  expect(0, 1, 1, 511.5, 255.5 + 128);   // 45 degrees down.
  expect(-1, 0, -1, 511.5 - 384, 255.5);
  expect(1, -std::sqrt(2), -1, 511.5 + 384, 255.5 - 128);
  const auto ray = m.unproject(511.5 + 128, 255.5 - 128);
  ASSERT_TRUE(ray.valid);
  EXPECT_NEAR(ray.x, 0.5, 1e-15);
  EXPECT_NEAR(ray.y, -std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(ray.z, 0.5, 1e-15);
}

TEST(Equirectangular, TheSeamIsHalfOpen) {
  const Equirectangular m = whole();
  // The seam itself has the longitude -pi, whatever the sign of its zero.
  for (const double y : {-0.5, 0.0, 2.0}) {
    EXPECT_EQ(m.project(0.0, y, -1.0).u, -0.5);
    EXPECT_EQ(m.project(-0.0, y, -1.0).u, -0.5);
  }
  // Next to it, however near, there is either side.
  for (const double x : {1e-3, 1e-16, 1e-100, 5e-324}) {
    EXPECT_NEAR(m.project(x, 0.0, -1.0).u, 1023.5 - std::atan(x) * m.fx, 2e-13) << x;
    EXPECT_NEAR(m.project(-x, 0.0, -1.0).u, -0.5 + std::atan(x) * m.fx, 2e-13) << x;
  }
  // Both borders of the image have rays, next to the seam on their own side.
  const auto left = m.unproject(-0.5, 255.5), right = m.unproject(1023.5, 255.5);
  ASSERT_TRUE(left.valid && right.valid);
  EXPECT_LT(left.x, 0);
  EXPECT_GT(left.x, -1e-15);
  EXPECT_GT(right.x, 0);
  EXPECT_LT(right.x, 1e-15);
  EXPECT_FALSE(m.unproject(-0.5 - 1e-9, 255.5).valid);
  EXPECT_FALSE(m.unproject(1023.5 + 1e-9, 255.5).valid);
  EXPECT_EQ(m.project(left.x, left.y, left.z).u, -0.5);
  EXPECT_EQ(m.project(right.x, right.y, right.z).u, 1023.5);
  EXPECT_EQ(m.maxFieldAngle(), M_PI);
}

TEST(Equirectangular, ThePolesAreRowsOfPixels) {
  const Equirectangular m = whole();
  for (const double sign : {-1.0, 1.0}) {
    const auto pole = m.project(0.0, sign * 3, 0.0);
    ASSERT_TRUE(pole.valid);
    EXPECT_EQ(pole.u, 511.5);
    EXPECT_NEAR(pole.v, 255.5 + sign * 256, 1e-13);
    EXPECT_EQ(m.project(0.0, sign, -0.0).u, 511.5);
    // Every pixel of the row looks there and comes back.
    for (const double u : {-0.5, 0.0, 200.25, 511.5, 1000.0, 1023.5}) {
      const auto ray = m.unproject(u, 255.5 + sign * 256);
      ASSERT_TRUE(ray.valid);
      EXPECT_EQ(ray.y, sign);
      EXPECT_LE(std::hypot(ray.x, ray.z), 1e-16);
      EXPECT_NEAR(m.project(ray.x, ray.y, ray.z).u, u, 1e-12);
    }
    EXPECT_FALSE(m.unproject(511.5, 255.5 + sign * 256.000000001).valid);
  }
  // Rays that differ from the pole by less than a double still have their longitude.
  EXPECT_NEAR(m.project(1e-200, 1.0, 1e-200).u, 511.5 + 128, 1e-12);
}

TEST(Equirectangular, ThereIsNoJacobianAtThePoles) {
  const Camera camera(whole(), 1024, 512);
  const Eigen::Vector3d pole(0, 1, 0);
  EXPECT_TRUE(camera.project(pole));
  EXPECT_FALSE(camera.jacobian(pole));
  EXPECT_FALSE(camera.jacobian({5e-324, 1, 0}));  // f / 5e-324 is beyond doubles.
  const auto near = camera.jacobian({1e-200, 1, 0});
  ASSERT_TRUE(near);
  EXPECT_NEAR((*near)(0, 2) / -1e200, whole().fx, 1e-12);
  const auto behind = camera.jacobian({0, 0, -1});
  ASSERT_TRUE(behind);
  EXPECT_DOUBLE_EQ((*behind)(0, 0), -whole().fx);
  EXPECT_DOUBLE_EQ((*behind)(1, 1), whole().fy);
}

TEST(Equirectangular, NothingIsNotARay) {
  const Equirectangular m = whole();
  EXPECT_FALSE(m.project(0.0, 0.0, 0.0).valid);
  EXPECT_FALSE(m.project(kInf, 0.0, 1.0).valid);
  EXPECT_FALSE(m.unproject(std::nan(""), 0.0).valid);
}

TEST(Equirectangular, FloatHasNoRayBeyondTheSeam) {
  // The float nearest to pi is above it: taken for a longitude, it would be on the other side.
  const Equirectangular m{1, 1, 0, 0};
  const auto right = m.unproject(static_cast<float>(M_PI), 0.0F);
  EXPECT_TRUE(!right.valid || right.x > 0);
  const auto inside = m.unproject(0x1.921fb4p1F, 0.0F);
  ASSERT_TRUE(inside.valid);
  EXPECT_GT(inside.x, 0);
  EXPECT_LE(m.project(1e-20F, 0.0F, -1.0F).u, 0x1.921fb4p1F);
}

}  // namespace
}  // namespace dlsd
