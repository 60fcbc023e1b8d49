#include "cameras/fov.h"

#include <gtest/gtest.h>

#include "cameras/pinhole.h"

namespace dlsd {
namespace {

/// omega = pi / 2: 2 tan(omega / 2) = 2, so r = z is at alpha = atan(2).
Fov quarter() {
  return Fov::fromParams({100, 100, 10, 20, M_PI / 2});
}

TEST(Fov, KnownPoints) {
  struct {
    double z, r_d;
  } const known[] = {{2, 0.5}, {0, 1}, {-2, 1.5}};  // alpha = 45, 90, 135 degrees
  for (const auto& [z, r_d] : known) {
    const auto p = quarter().project(1.0, 0.0, z);
    ASSERT_TRUE(p.valid);
    EXPECT_NEAR(p.u, 10 + 100 * r_d, 1e-13);
    EXPECT_EQ(p.v, 20);
    const auto ray = quarter().unproject(p.u, p.v);
    ASSERT_TRUE(ray.valid);
    const double norm = std::hypot(1, z);
    EXPECT_NEAR(ray.x, 1 / norm, 1e-15);
    EXPECT_NEAR(ray.z, z / norm, 1e-15);
  }
}

TEST(Fov, EndsStraightBehindTheCamera) {
  EXPECT_FALSE(quarter().project(0.0, 0.0, -1.0).valid);
  EXPECT_TRUE(quarter().project(1e-15, 0.0, -1.0).valid);
  // r_d < pi / omega = 2
  EXPECT_TRUE(quarter().unproject(10 + 200 * (1 - 1e-12), 20.0).valid);
  EXPECT_FALSE(quarter().unproject(10 + 200 * (1 + 1e-12), 20.0).valid);
}

TEST(Fov, TheRestOfTheSphereIsValidForTheSmallestOmega) {
  const Fov camera = Fov::fromParams({1e-3, 1e-3, 0, 0, Fov::kPinholeOmega});
  EXPECT_TRUE(camera.project(1e-9, 0.0, -1.0).valid);
}

TEST(Fov, OmegaZeroIsThePinhole) {
  const Fov fov = Fov::fromParams({500, 501, 320, 240, 0});
  const Pinhole pinhole{500, 501, 320, 240};
  for (const double x : {-3.0, 0.0, 0.5}) {
    const auto a = fov.project(x, 0.25, 1.0);
    const auto b = pinhole.project(x, 0.25, 1.0);
    ASSERT_TRUE(a.valid && b.valid);
    EXPECT_EQ(a.u, b.u);
    EXPECT_EQ(a.v, b.v);
  }
  EXPECT_FALSE(fov.project(1.0, 0.0, 0.0).valid);
  EXPECT_FALSE(fov.project(0.0, 0.0, -1.0).valid);
  EXPECT_EQ(fov.maxFieldAngle(), M_PI / 2);
  EXPECT_LE((fov.jacobian(0.1, 0.2, 1) - pinhole.jacobian(0.1, 0.2, 1)).norm(), 1e-12);
}

// Small omega is where other programs switch to a series, one of them with the wrong sign.
TEST(Fov, SmallOmegaFollowsItsSeries) {
  for (const double omega : {9.9e-3, 1e-3, 1e-4, 1e-6, 1.1e-9}) {
    const Fov fov = Fov::fromParams({500, 500, 0, 0, omega});
    for (const double r : {0.5, 1.0, 2.0}) {
      const auto p = fov.project(r, 0.0, 1.0);
      ASSERT_TRUE(p.valid);
      const double w2 = omega * omega;
      EXPECT_NEAR(p.u, 500 * r * (1 + w2 / 12 - w2 * r * r / 3), 1e-12 * 500 + 5e4 * w2 * w2)
          << omega << " " << r;
      const auto ray = fov.unproject(p.u, p.v);
      ASSERT_TRUE(ray.valid);
      EXPECT_NEAR(ray.x / ray.z, r, 1e-14);
    }
  }
}

TEST(Fov, TheTumWideImageHasARayForEveryPixelAndSomeLookPast90Degrees) {
  const Fov camera = Fov::fromParams({446.915863, 447.071228, 631.219238, 510.997498, 0.933271});
  long behind = 0;
  for (int v = 0; v < 1024; ++v) {
    for (int u = 0; u < 1280; ++u) {
      const auto ray = camera.unproject<double>(u, v);
      ASSERT_TRUE(ray.valid) << u << " " << v;
      behind += static_cast<long>(ray.z < 0);
    }
  }
  EXPECT_NEAR(static_cast<double>(behind) / (1280 * 1024), 0.015, 0.001);
}

}  // namespace
}  // namespace dlsd
