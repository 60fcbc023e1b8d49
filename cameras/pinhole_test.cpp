#include "cameras/pinhole.h"

#include <gtest/gtest.h>

namespace dlsd {
namespace {

constexpr Pinhole kCamera{100, 200, 10, 20};

TEST(Pinhole, KnownPoint) {
  const auto p = kCamera.project(1.0, 2.0, 4.0);
  ASSERT_TRUE(p.valid);
  EXPECT_EQ(p.u, 35);
  EXPECT_EQ(p.v, 120);
  const auto ray = kCamera.unproject(35.0, 120.0);
  ASSERT_TRUE(ray.valid);
  EXPECT_NEAR(ray.x, 1 / std::sqrt(21.0), 1e-16);
  EXPECT_NEAR(ray.y, 2 / std::sqrt(21.0), 1e-16);
  EXPECT_NEAR(ray.z, 4 / std::sqrt(21.0), 2e-16);
}

TEST(Pinhole, EndsAt90Degrees) {
  EXPECT_TRUE(kCamera.project(1.0, 0.0, 1e-6).valid);
  EXPECT_FALSE(kCamera.project(1.0, 0.0, 1e-8).valid);  // 1e10 px
  EXPECT_FALSE(kCamera.project(1.0, 0.0, 0.0).valid);
  EXPECT_FALSE(kCamera.project(1.0, 0.0, -1.0).valid);
  EXPECT_FALSE(kCamera.project(0.0, 0.0, -1.0).valid);
  EXPECT_FALSE(kCamera.project(0.0, 0.0, 0.0).valid);
}

TEST(Pinhole, EveryPixelHasARayInFront) {
  for (const double u : {-1e9, -1.0, 0.0, 10.0, 1e5, 1e9}) {
    const auto ray = kCamera.unproject(u, 3 * u / 4);
    ASSERT_TRUE(ray.valid) << u;
    EXPECT_GT(ray.z, 0);
    const auto back = kCamera.project(ray.x, ray.y, ray.z);
    ASSERT_TRUE(back.valid) << u;
    EXPECT_NEAR(back.u, u, 4e-16 * std::max(std::abs(u), 10.0));
  }
  EXPECT_FALSE(kCamera.unproject(1.1e9, 0.0).valid);
}

TEST(Pinhole, FloatIsTheSameModel) {
  const auto p = kCamera.project(1.0F, 2.0F, 4.0F);
  ASSERT_TRUE(p.valid);
  EXPECT_EQ(p.u, 35.0F);
}

}  // namespace
}  // namespace dlsd
