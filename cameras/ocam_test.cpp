#include "cameras/ocam.h"

#include <gtest/gtest.h>

namespace dlsd {
namespace {

Ocam withPolynomial(const std::array<double, 9>& a) {
  std::array<double, 14> p{};
  std::copy(a.begin(), a.end(), p.begin());
  p[11] = 1;
  return Ocam::fromParams(p);
}

TEST(Ocam, KnownRay) {
  // f(5) = -100 + 0.2 * 5 + 0.1 * 25 = -96.5; (row, column) - centre = [c d; e 1] (x, y).
  const Ocam m = Ocam::fromParams({-100, 0.2, 0.1, 0, 0, 0, 0, 0, 0, 30, 40, 1.5, 0.25, 0.125});
  const double row = 1.5 * 4 + 0.25 * 3 + 40, column = 0.125 * 4 + 3 + 30;
  const auto ray = m.unproject(column, row);
  ASSERT_TRUE(ray.valid);
  const double norm = std::hypot(5, 96.5);
  EXPECT_NEAR(ray.x, 3 / norm, 1e-16);
  EXPECT_NEAR(ray.y, 4 / norm, 1e-16);
  EXPECT_NEAR(ray.z, 96.5 / norm, 1e-16);
  const auto pixel = m.project(3.0, 4.0, 96.5);
  ASSERT_TRUE(pixel.valid);
  EXPECT_NEAR(pixel.u, column, 1e-14);
  EXPECT_NEAR(pixel.v, row, 1e-14);
}

TEST(Ocam, TheFieldAngleRisesToTheEndOfTheDomain) {
  // -f = 2 + rho^2: rho f' - f = 2 - rho^2, so the turn is at sqrt(2), where tan = sqrt(2) / 4.
  const Ocam turning = withPolynomial({-2, 0, -1, 0, 0, 0, 0, 0, 0});
  EXPECT_NEAR(turning.max_rho, std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(turning.maxFieldAngle(), std::atan(std::sqrt(2.0) / 4), 1e-15);
  EXPECT_TRUE(turning.unproject(1.41421, 0.0).valid);
  EXPECT_FALSE(turning.unproject(1.41422, 0.0).valid);
  // An x^2 mirror sees all but -z.
  const Ocam mirror = withPolynomial({-2, 0, 1, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(mirror.maxFieldAngle(), M_PI);
  EXPECT_TRUE(mirror.project(1e-6, 0.0, -1.0).valid);
  EXPECT_FALSE(mirror.project(0.0, 0.0, -1.0).valid);
  // Straight lines rise to their slope: the pinhole, and cones on both sides of it.
  EXPECT_EQ(withPolynomial({-2, 0, 0, 0, 0, 0, 0, 0, 0}).maxFieldAngle(), M_PI / 2);
  EXPECT_NEAR(withPolynomial({-2, 1, 0, 0, 0, 0, 0, 0, 0}).maxFieldAngle(), 3 * M_PI / 4, 1e-15);
  EXPECT_NEAR(withPolynomial({-2, -1, 0, 0, 0, 0, 0, 0, 0}).maxFieldAngle(), M_PI / 4, 1e-15);
}

TEST(Ocam, SparseCoefficientsAreInvertedToTheLastBits) {
  int tried = 0;
  for (const std::array<double, 9>& a : {std::array<double, 9>{-200, 0, 1e-3, 0, 0, 0, 0, 0, 0},
                                         {-200, 0, 0, 1e-6, 0, 0, 0, 0, 0},
                                         {-200, 0, 0, 0, 0, 0, 0, 0, 1e-18},
                                         {-200, 0, 0, 0, 3e-9, 0, 0, -1e-18, 0},
                                         {-200, 0.3, 0, -1e-6, 0, 0, 0, 0, 0},
                                         {-200, 0, 1.5e-3, -2e-6, 8e-9, 0, 0, 0, 0}}) {
    const Ocam m = withPolynomial(a);
    for (double rho = 1e-12; rho < std::min(0.99 * m.max_rho, 1e4); rho = rho * 1.3 + 1, ++tried) {
      const auto ray = m.unproject(0.6 * rho, 0.8 * rho);
      ASSERT_TRUE(ray.valid) << rho;
      const auto pixel = m.project(ray.x, ray.y, ray.z);
      ASSERT_TRUE(pixel.valid) << rho;
      const double scale = m.jacobian(ray.x, ray.y, ray.z).norm();
      EXPECT_LE(std::hypot(pixel.u - 0.6 * rho, pixel.v - 0.8 * rho), 4e-16 * (rho + scale)) << rho;
    }
  }
  EXPECT_GT(tried, 100);
}

}  // namespace
}  // namespace dlsd
