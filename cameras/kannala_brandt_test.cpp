#include "cameras/kannala_brandt.h"

#include <gtest/gtest.h>

namespace dlsd {
namespace {

KannalaBrandt withCoefficients(double k1, double k2, double k3, double k4) {
  return KannalaBrandt::fromParams({100, 100, 0, 0, k1, k2, k3, k4});
}

double radiusAt(const KannalaBrandt& m, double theta) {
  const auto p = m.project(0.0, std::sin(theta), std::cos(theta));
  EXPECT_TRUE(p.valid) << theta;
  EXPECT_EQ(p.u, 0);
  return p.v;
}

TEST(KannalaBrandt, WithoutDistortionTheRadiusIsTheAngle) {
  const KannalaBrandt m = withCoefficients(0, 0, 0, 0);
  for (const double theta : {0.0, 1e-9, 0.5, M_PI / 2, 2.0, 3.1}) {
    EXPECT_NEAR(radiusAt(m, theta), 100 * theta, 1e-13);
  }
  EXPECT_EQ(m.maxFieldAngle(), M_PI);
  EXPECT_FALSE(m.project(0.0, 0.0, -1.0).valid);
  EXPECT_TRUE(m.project(1e-12, 0.0, -1.0).valid);
}

TEST(KannalaBrandt, KnownDistortion) {
  EXPECT_NEAR(radiusAt(withCoefficients(1, 0, 0, 0), 1), 200, 1e-13);
  EXPECT_NEAR(radiusAt(withCoefficients(1, 2, 4, 8), 0.5),
              100 * (0.5 + 1. / 8 + 2. / 32 + 4. / 128 + 8. / 512),
              1e-13);
}

TEST(KannalaBrandt, TheFoldIsWhereTheSlopeVanishes) {
  struct {
    KannalaBrandt m;
    double theta, radius;
  } const known[] = {
      {withCoefficients(-1. / 3, 0, 0, 0), 1, 2. / 3},
      {withCoefficients(0, 0, 0, -1. / 9), 1, 8. / 9},
      {withCoefficients(0, -1. / 5, 0, 0), 1, 4. / 5},
      {withCoefficients(-100, 0, 0, 0), std::sqrt(1. / 300), 2 * std::sqrt(1. / 300) / 3},
      // d' = (1 - t)(1 - t / 4): the first of two folds counts.
      {withCoefficients(-5. / 12, 1. / 20, 0, 0), 1, 1 - 5. / 12 + 1. / 20}};
  for (const auto& [m, theta, radius] : known) {
    EXPECT_NEAR(m.maxFieldAngle(), theta, 4e-16);
    EXPECT_NEAR(m.max_radius, radius, 4e-16);
    EXPECT_TRUE(m.project(std::sin(theta * (1 - 1e-12)), 0.0, std::cos(theta * (1 - 1e-12))).valid);
    EXPECT_FALSE(
        m.project(std::sin(theta * (1 + 1e-12)), 0.0, std::cos(theta * (1 + 1e-12))).valid);
    EXPECT_TRUE(m.unproject(100 * radius * (1 - 1e-12), 0.0).valid);
    EXPECT_FALSE(m.unproject(100 * radius * (1 + 1e-12), 0.0).valid);
  }
}

TEST(KannalaBrandt, APointOfInflectionIsNoFold) {
  // d' = (1 - t)^2 touches zero at theta = 1 and rises on.
  const KannalaBrandt m = withCoefficients(-2. / 3, 1. / 5, 0, 0);
  EXPECT_GT(m.maxFieldAngle(), 3);
  for (const double theta : {0.9, 1.0, 1.1, 2.0}) {
    const auto ray = m.unproject(100 * m.distort(theta), 0.0);
    ASSERT_TRUE(ray.valid);
    // The inverse has a cube root there: 1e-16 in the radius are 1e-5 in the angle.
    EXPECT_NEAR(std::atan2(ray.x, ray.z), theta, 2e-5);
    EXPECT_NEAR(m.project(ray.x, ray.y, ray.z).u, 100 * m.distort(theta), 1e-13);
  }
}

// Zero inner or leading coefficients have broken other solvers of this equation.
TEST(KannalaBrandt, SparseCoefficientsAreInvertedToTheLastBits) {
  const KannalaBrandt models[] = {withCoefficients(0, .01, .004, .005),
                                  withCoefficients(.02, 0, 0, .003),
                                  withCoefficients(0, 0, 0.01, 0),
                                  withCoefficients(0, 0, 0, 0),
                                  withCoefficients(100, 100, 100, 100),
                                  withCoefficients(-0.05, 0.004, 0, -1e-7)};
  int tried = 0;
  for (const KannalaBrandt& m : models) {
    for (double theta = 1e-12; theta < 0.99 * m.maxFieldAngle();
         theta = theta * 1.3 + 1e-3, ++tried) {
      EXPECT_NEAR(m.undistort(m.distort(theta)) / theta, 1, 4e-15) << theta;
    }
  }
  EXPECT_GT(tried, 100);
}

TEST(KannalaBrandt, TheRealCameraSeesPast90Degrees) {
  const KannalaBrandt m = KannalaBrandt::fromParams({190.97847715128717,
                                                     190.9733070521226,
                                                     254.93170605935475,
                                                     256.8974428996504,
                                                     0.0034823894022493434,
                                                     0.0007150348452162257,
                                                     -0.0020532361418706202,
                                                     0.00020293673591811182});
  EXPECT_GT(m.maxFieldAngle(), 100 * M_PI / 180);
  const auto ray = m.unproject(254.93170605935475 + 310, 256.8974428996504);
  ASSERT_TRUE(ray.valid);
  EXPECT_LT(ray.z, 0);
}

}  // namespace
}  // namespace dlsd
