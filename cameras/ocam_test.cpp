#include "cameras/ocam.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

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

// However near the fold, where the solve of a radius has little to hold on to.
TEST(Ocam, TheJacobianIsThatOfTheAnswerUpToTheFold) {
  int answers = 0;
  for (const double shape : {-1.0, -0.3, -0.07, -0.011}) {
    const Ocam m = withPolynomial({-200, 0, 1e-3 * shape, 1e-6 * shape, 0, 0, 0, 0, 0});
    for (int k = -400; k <= 400; ++k) {
      const double theta = m.max_theta * (1 + k * 0x1p-54);
      for (const double scale : {1.0, 0.7}) {
        const double r = scale * std::sin(theta), z = scale * std::cos(theta);
        const double x = 0.8 * r, y = 0.6 * r;
        const auto pixel = m.project(x, y, z);
        if (!pixel.valid) continue;
        ++answers;
        // Along the circle the image moves by rho / r, whatever the fold does across it.
        const double rho = std::hypot(pixel.u, pixel.v);
        EXPECT_LE(std::abs((m.jacobian(x, y, z) * Eigen::Vector3d(-0.6, 0.8, 0)).norm() - rho / r),
                  1e-4 * rho / r)
            << k;
      }
    }
  }
  EXPECT_GE(answers, 2000);
  // The angle of this ray is, to rounding, that of the fold: the solve has no answer.
  const Ocam at_fold = Ocam::fromParams({-1997.6105866011678,
                                         -0.0099999999989873398,
                                         2.7012043665725778e-05,
                                         -5.0119685110113029e-08,
                                         -7.5130124381050611e-13,
                                         -1.2289805383626913e-16,
                                         -1.1246556500456632e-19,
                                         -2.5179957534153688e-23,
                                         -5.6371443433445157e-27,
                                         53.050000000000004,
                                         1792.75,
                                         0.9,
                                         -0.01,
                                         -0.01});
  const Eigen::Vector3d ray(0.65141695514958264, 0.1794586966995704, 0.7371909703208106);
  const auto pixel = at_fold.project(ray.x(), ray.y(), ray.z());
  ASSERT_TRUE(pixel.valid);
  const Eigen::Matrix<double, 2, 3> J = at_fold.jacobian(ray.x(), ray.y(), ray.z());
  ASSERT_TRUE(J.allFinite());
  const Eigen::Vector2d turned = J * Eigen::Vector3d(-ray.y(), ray.x(), 0);
  const double u = pixel.u - at_fold.cx, v = pixel.v - at_fold.cy;
  Eigen::Matrix2d affine;  // of (u, v) from the ideal plane
  affine << 1, at_fold.e, at_fold.d, at_fold.c;
  const Eigen::Vector2d ideal = affine.inverse() * Eigen::Vector2d(u, v);
  const Eigen::Vector2d expected = affine * Eigen::Vector2d(-ideal.y(), ideal.x());
  EXPECT_LE((turned - expected).norm(), 1e-6 * expected.norm());
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
