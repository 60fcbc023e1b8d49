#include "cameras/theta_polynomial.h"

#include <gtest/gtest.h>

namespace dlsd {
namespace {

ThetaPolynomial withCoefficients(double k1, double k2, double k3, double k4) {
  return ThetaPolynomial::fromParams({k1, k2, k3, k4, 1.5, 0, 0});
}

TEST(ThetaPolynomial, KnownPixel) {
  const ThetaPolynomial m = withCoefficients(8, 4, 2, 1);
  const double rho = 8 * 0.5 + 4 * 0.25 + 2 * 0.125 + 0.0625;
  const auto p = m.project(0.6 * std::sin(0.5), 0.8 * std::sin(0.5), std::cos(0.5));
  ASSERT_TRUE(p.valid);
  EXPECT_NEAR(p.u, 0.6 * rho, 1e-14);
  EXPECT_NEAR(p.v, 1.5 * 0.8 * rho, 1e-14);
  const auto ray = m.unproject(p.u, p.v);
  ASSERT_TRUE(ray.valid);
  EXPECT_NEAR(std::atan2(std::hypot(ray.x, ray.y), ray.z), 0.5, 1e-15);
}

TEST(ThetaPolynomial, TheFoldIsWhereTheSlopeVanishes) {
  EXPECT_EQ(withCoefficients(1, 0, 0, 0).maxFieldAngle(), M_PI);
  EXPECT_NEAR(withCoefficients(1, -0.5, 0, 0).maxFieldAngle(), 1, 1e-15);
  EXPECT_NEAR(withCoefficients(1, 0, -1. / 3, 0).maxFieldAngle(), 1, 1e-15);
  EXPECT_NEAR(withCoefficients(1, 0, 0, -0.25).maxFieldAngle(), 1, 1e-15);
  // (1 - theta)(1 - theta / 2): the first of two.
  EXPECT_NEAR(withCoefficients(1, -0.75, 0.5 / 3, 0).maxFieldAngle(), 1, 1e-15);
  // (1 - theta)^2 touches zero and rises on.
  EXPECT_GT(withCoefficients(1, -1, 1. / 3, 0).maxFieldAngle(), 3);
}

TEST(ThetaPolynomial, SparseCoefficientsAreInvertedToTheLastBits) {
  int tried = 0;
  for (const ThetaPolynomial& m : {withCoefficients(300, 0, 40, 5),
                                   withCoefficients(300, 0, 0, 7),
                                   withCoefficients(300, -30, 0, 0),
                                   withCoefficients(339.749, -31.988, 48.275, -7.201)}) {
    for (double theta = 1e-12; theta < 0.99 * m.maxFieldAngle();
         theta = theta * 1.3 + 1e-3, ++tried) {
      EXPECT_NEAR(m.fieldAngle(m.radius(theta)) / theta, 1, 4e-15) << theta;
    }
  }
  EXPECT_GT(tried, 80);
}

}  // namespace
}  // namespace dlsd
