#include "cameras/double_sphere.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace dlsd {
namespace {

Pixel<double> projectAt(const DoubleSphere& m, double theta) {
  return m.project(std::sin(theta), 0.0, std::cos(theta));
}

TEST(DoubleSphere, KnownPoints) {
  // d1 = 5, z1 = 3 + 0.5 * 5 = 5.5, d2 = sqrt(16 + 30.25), denominator 0.6 d2 + 0.4 * 5.5.
  const DoubleSphere m{0.5, 0.6, 100, 200, 10, 20};
  const double denom = 0.6 * std::sqrt(46.25) + 2.2;
  const auto p = m.project(4.0, 0.0, 3.0);
  ASSERT_TRUE(p.valid);
  EXPECT_NEAR(p.u, 10 + 400 / denom, 1e-13);
  EXPECT_EQ(p.v, 20);
  const auto q = m.project(0.0, -4.0, 3.0);
  ASSERT_TRUE(q.valid);
  EXPECT_NEAR(q.v, 20 - 800 / denom, 1e-13);
  const auto ray = m.unproject(p.u, p.v);
  ASSERT_TRUE(ray.valid);
  EXPECT_NEAR(ray.x, 0.8, 1e-15);
  EXPECT_EQ(ray.y, 0);
  EXPECT_NEAR(ray.z, 0.6, 1e-15);
  // Behind the camera, xi < 0: z1 = -3 - 0.2 * 5 = -4.
  const auto behind = DoubleSphere{-0.2, 0.5, 1, 1, 0, 0}.project(4.0, 0.0, -3.0);
  ASSERT_TRUE(behind.valid);
  EXPECT_NEAR(behind.u, 4 / (0.5 * std::sqrt(32) - 2), 1e-14);
}

TEST(DoubleSphere, XiOneAlphaZeroIsStereographic) {
  // Seen from the sphere itself, an angle is halved: psi = theta / 2.
  const DoubleSphere m{1, 0, 1, 1, 0, 0};
  EXPECT_EQ(m.maxFieldAngle(), M_PI);
  EXPECT_FALSE(m.project(0.0, 0.0, -1.0).valid);
  for (const double theta : {1e-9, 0.1, 1.0, 2.0, 3.0, M_PI - 1e-6, M_PI - 1e-8}) {
    const auto p = projectAt(m, theta);
    ASSERT_TRUE(p.valid) << theta;
    EXPECT_NEAR(p.u / std::tan(theta / 2), 1, theta < 3.1 ? 1e-15 : 1e-8) << theta;
    const auto ray = m.unproject(std::tan(theta / 2), 0.0);
    ASSERT_TRUE(ray.valid);
    EXPECT_NEAR(std::atan2(ray.x, ray.z), theta, 1e-15);
  }
}

TEST(DoubleSphere, AboveXiOneTheFirstSphereFolds) {
  // cos theta = -1 / 2: psi = 30 degrees at most, whatever alpha.
  for (const double alpha : {0.0, 0.3, 0.5, 0.8, 1.0}) {
    const DoubleSphere m{2, alpha, 100, 100, 0, 0};
    const double fold = 2 * M_PI / 3;
    const double radius = 100 * 0.5 / (alpha + (1 - alpha) * std::sqrt(0.75));
    EXPECT_NEAR(m.maxFieldAngle(), fold, 1e-15);
    EXPECT_TRUE(projectAt(m, fold * (1 - 1e-12)).valid);
    EXPECT_FALSE(projectAt(m, fold * (1 + 1e-12)).valid);
    EXPECT_NEAR(projectAt(m, fold * (1 - 1e-9)).u, radius, 1e-12);
    EXPECT_TRUE(m.unproject(radius * (1 - 1e-12), 0.0).valid);
    EXPECT_FALSE(m.unproject(radius * (1 + 1e-12), 0.0).valid);
    // psi = 150 degrees has the same sine, and a pixel of the second sphere for alpha < 0.54.
    const double mirrored = 0.5 / (alpha - (1 - alpha) * std::sqrt(0.75));
    if (mirrored > 0) {
      EXPECT_FALSE(m.unproject(100 * mirrored * 1.01, 0.0).valid);
    }
  }
}

TEST(DoubleSphere, BelowXiOneTheSecondSphereBounds) {
  // alpha 0.25 and 0.75: cos psi = -1 / 3. On the unit circle, psi is seen from (0, -xi).
  for (const double xi : {-0.9, -0.3, 0.0, 0.4, 0.9}) {
    for (const double alpha : {0.25, 0.75}) {
      const DoubleSphere m{xi, alpha, 100, 100, 0, 0};
      const double bound = m.maxFieldAngle();
      const double psi = std::atan2(std::sin(bound), std::cos(bound) + xi);
      EXPECT_NEAR(std::cos(psi), -1.0 / 3, 1e-15 / (1 - std::abs(xi))) << xi;
      EXPECT_FALSE(projectAt(m, bound * (1 + 1e-12)).valid);
      if (alpha > 0.5) {
        const double radius = 100 / std::sqrt(0.5);
        EXPECT_TRUE(projectAt(m, bound * (1 - 1e-12)).valid);
        EXPECT_TRUE(m.unproject(radius * (1 - 1e-12), 0.0).valid);
        EXPECT_FALSE(m.unproject(radius * (1 + 1e-12), 0.0).valid);
      } else {
        EXPECT_TRUE(projectAt(m, bound * (1 - 1e-6)).valid);
        EXPECT_TRUE(m.unproject(1e9, -1e9).valid);
      }
    }
  }
}

TEST(DoubleSphere, TheBoundOfThePaperIsAnotherOne) {
  // Here z > -0.447 d1 leaves out rays up to z > -0.5 d1; for xi = -0.3 it lets in z1 < 0.
  EXPECT_NEAR(std::cos(DoubleSphere{0.5, 0, 1, 1, 0, 0}.maxFieldAngle()), -0.5, 1e-15);
  EXPECT_NEAR(std::cos(DoubleSphere{-0.3, 0, 1, 1, 0, 0}.maxFieldAngle()), 0.3, 1e-15);
  const auto left_out = projectAt({0.5, 0, 1, 1, 0, 0}, std::acos(-0.48));
  ASSERT_TRUE(left_out.valid);
  const auto back = DoubleSphere{0.5, 0, 1, 1, 0, 0}.unproject(left_out.u, left_out.v);
  ASSERT_TRUE(back.valid);
  EXPECT_NEAR(back.z, -0.48, 1e-14);
  EXPECT_FALSE(projectAt({-0.3, 0, 1, 1, 0, 0}, std::acos(0.29)).valid);
}

TEST(DoubleSphere, NearXiMinusOneTheAxisIsExact) {
  const DoubleSphere m{-0.99, 0.5, 1, 1, 0, 0};
  for (const double theta : {1e-12, 1e-8, 1e-4}) {
    const auto p = projectAt(m, theta);
    ASSERT_TRUE(p.valid);
    // z1 = cos theta - 0.99 = 0.01 - 2 sin^2(theta / 2)
    const double half = std::sin(theta / 2), z1 = (1 - 0.99) - 2 * half * half;
    const double exact = std::sin(theta) / (0.5 * std::hypot(std::sin(theta), z1) + 0.5 * z1);
    EXPECT_NEAR(p.u / exact, 1, 3e-15) << theta;
  }
  // Half the sphere that is seen at xi = 0: psi = 180 degrees still means theta = 180 degrees.
  EXPECT_EQ(m.maxFieldAngle(), M_PI);
  EXPECT_NEAR((DoubleSphere{-0.99, 0, 1, 1, 0, 0}.maxFieldAngle()), std::acos(0.99), 1e-15);
}

}  // namespace
}  // namespace dlsd
