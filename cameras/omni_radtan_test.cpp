#include "cameras/omni_radtan.h"

#include <gtest/gtest.h>

namespace dlsd {
namespace {

TEST(OmniRadtan, KnownPixel) {
  const OmniRadtan m = OmniRadtan::fromParams({1, 100, 200, 10, 20, 0.5, 0.25, 0.125, 0.0625, 8});
  // z + d = 4 + 5, n = (3, 0) / 9: t = 1/9, R = 1 + 1/18 + 1/324.
  const double n = 1. / 3, R = 1 + 0.5 / 9 + 0.25 / 81;
  const double mx = n * R + 0.0625 * 3 / 9, my = 0.125 / 9;
  const auto p = m.project(3.0, 0.0, 4.0);
  ASSERT_TRUE(p.valid);
  EXPECT_NEAR(p.u, 100 * mx + 8 * my + 10, 1e-13);
  EXPECT_NEAR(p.v, 200 * my + 20, 1e-13);
  const auto ray = m.unproject(p.u, p.v);
  ASSERT_TRUE(ray.valid);
  EXPECT_NEAR(ray.x, 0.6, 1e-15);
  EXPECT_NEAR(ray.y, 0, 1e-15);
  EXPECT_NEAR(ray.z, 0.8, 1e-15);
}

TEST(OmniRadtan, TheDomainEndsWhereTheFirstStepFolds) {
  const auto angle = [](double xi, double k1) {
    return OmniRadtan::fromParams({xi, 1, 1, 0, 0, k1, 0, 0, 0, 0}).maxFieldAngle();
  };
  EXPECT_EQ(angle(0, 0), M_PI / 2);
  EXPECT_EQ(angle(1, 0), M_PI);
  EXPECT_NEAR(angle(0.5, 0), 2 * M_PI / 3, 1e-15);
  EXPECT_NEAR(angle(2, 0), 2 * M_PI / 3, 1e-15);
  // The plane folds at r = 1: tan(theta) = 1 and tan(theta / 2) = 1.
  EXPECT_NEAR(angle(0, -1. / 3), M_PI / 4, 1e-15);
  EXPECT_NEAR(angle(1, -1. / 3), M_PI / 2, 1e-15);
  // With xi = 2 the sphere folds before that, at 1 / sqrt(3).
  EXPECT_NEAR(angle(2, -1. / 3), 2 * M_PI / 3, 1e-15);
  EXPECT_LT(angle(2, -1.1), 2 * M_PI / 3);
}

}  // namespace
}  // namespace dlsd
