#include "cameras/radtan.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dlsd {
namespace {

double leastEigenvalue(const Eigen::Matrix2d& J) {
  return (J(0, 0) + J(1, 1)) / 2 - std::hypot((J(0, 0) - J(1, 1)) / 2, J(0, 1));
}

/// Of the Jacobian, over many azimuths of a circle.
double leastEigenvalue(const Radtan& d, double r) {
  double least = 1e300;
  for (int i = 0; i < 720; ++i) {
    const double phi = i * M_PI / 360;
    least = std::min(least, leastEigenvalue(d.jacobian(r * std::cos(phi), r * std::sin(phi))));
  }
  return least;
}

TEST(Radtan, TheDiscEndsWhereTheJacobianDegenerates) {
  struct {
    double k1, k2, p1, p2, k3;
  } const known[] = {
      {-0.3, 0, 0, 0, 0},
      {-0.23294918206407358,
       0.06172427072793471,
       -1.8042344369185743e-05,
       3.396357463982982e-05,
       -0.007549618066613639},
      {-0.3, 0.02, 0.01, -0.02, 0},
      {0, 0, 0.1, 0, 0},
      {0, 0, 0.03, 0.04, 0},
      {0.5, -0.2, 0.05, 0.1, 0},
      {0, 0, 1e-3, 0, -100},
      {3, -0.3, 0, 0.62, 0},
      // Ends neither along p nor across it.
      {2.3954553203700995, -0.814914766790414, 0, 0.8503538541280451, 0.15428790422744124}};
  for (const auto& k : known) {
    const Radtan d = Radtan::make(k.k1, k.k2, k.p1, k.p2, k.k3);
    ASSERT_LT(d.max_radius, Radtan::kUnbounded) << k.k1;
    // 720 azimuths miss the worst one by at most 0.25 degrees.
    EXPECT_GT(leastEigenvalue(d, d.max_radius * 0.999), 0) << k.k1 << " " << k.p2;
    EXPECT_LT(leastEigenvalue(d, d.max_radius * 1.001), 0) << k.k1 << " " << k.p2;
    for (int i = 1; i < 100; ++i) EXPECT_GT(leastEigenvalue(d, d.max_radius * i / 100), 0);
  }
}

TEST(Radtan, KnownDiscs) {
  EXPECT_NEAR(Radtan::make(-1. / 3, 0, 0, 0, 0).max_radius, 1, 1e-15);
  EXPECT_NEAR(Radtan::make(0, -1. / 5, 0, 0, 0).max_radius, 1, 1e-15);
  EXPECT_NEAR(Radtan::make(0, 0, 0, 0, -1. / 7).max_radius, 1, 1e-15);
  EXPECT_NEAR(Radtan::make(0, 0, 0.06, 0.08, 0).max_radius, 1 / 0.6, 1e-15);
  // f' = (1 - t)(1 - t / 4): the first of two folds counts.
  EXPECT_NEAR(Radtan::make(-5. / 12, 1. / 20, 0, 0, 0).max_radius, 1, 1e-15);
  EXPECT_NEAR(Radtan::make(-1e-20, 0, 0, 0, 0).max_radius / std::sqrt(1e20 / 3), 1, 1e-15);
  EXPECT_EQ(Radtan::make(0, 0, 0, 0, 0).max_radius, Radtan::kUnbounded);
  EXPECT_EQ(Radtan::make(0.1, 0, 0.001, 0, 0.01).max_radius, Radtan::kUnbounded);
  // f' = (1 - t)^2 touches zero at r = 1 and rises on: no fold.
  EXPECT_GT(Radtan::make(-2. / 3, 1. / 5, 0, 0, 0).max_radius, 1e14);
}

TEST(Radtan, AGoProFoldsAtSixtyTwoDegrees) {
  const Radtan d = Radtan::make(-0.23294918206407358,
                                0.06172427072793471,
                                -1.8042344369185743e-05,
                                3.396357463982982e-05,
                                -0.007549618066613639);
  EXPECT_NEAR(std::atan(d.max_radius) * 180 / M_PI, 62.3, 0.05);
}

TEST(Radtan, EveryPointOfTheDiscComesBackAndNoOtherIsInvented) {
  int back = 0, refused = 0;
  for (const double k1 : {-0.3, 0.0, 0.4, 3.0}) {
    for (const double k3 : {-0.05, 0.0, 0.02}) {
      for (const double p : {0.0, 1e-3, 0.05, 0.6}) {
        const Radtan d = Radtan::make(k1, 0.01, 0.6 * p, -0.8 * p, k3);
        const double limit = std::min(d.max_radius, 3.0);
        for (int i = 0; i < 2000; ++i) {
          const double r = limit * (i % 50) / 50, phi = i * 0.37;
          const double x = r * std::cos(phi), y = r * std::sin(phi);
          const auto [u, v] = d.distort(x, y);
          const auto q = d.undistort<double>(u, v, d.max_radius);
          ASSERT_TRUE(q.valid) << k1 << " " << k3 << " " << p << " " << r;
          // 1e-15 in (u, v) over the least eigenvalue.
          const double allowed = 4e-15 * (1 + std::hypot(u, v)) / leastEigenvalue(d.jacobian(x, y));
          ASSERT_LE(std::hypot(static_cast<double>(q.x) - x, static_cast<double>(q.y) - y), allowed)
              << k1 << " " << k3 << " " << p << " " << r;
          ++back;
        }
        // Just outside the image of the disc, and far away.
        if (d.max_radius == Radtan::kUnbounded) continue;
        for (int i = 0; i < 100; ++i) {
          const double x = d.max_radius * std::cos(i * 0.2), y = d.max_radius * std::sin(i * 0.2);
          const auto [u, v] = d.distort(x, y);
          const Eigen::Vector2d out = Eigen::Vector2d(x, y).normalized();
          for (const double by : {1e-9, 0.1, 10.0, 1e6}) {
            // Outside a convex set, along the normal of its rim; D is the gradient of a convex
            // function, and the rim is convex for these.
            if (p > 0.1) continue;
            EXPECT_FALSE(
                d.undistort<double>(u + by * out.x(), v + by * out.y(), d.max_radius).valid)
                << k1 << " " << k3 << " " << p;
            ++refused;
          }
        }
      }
    }
  }
  EXPECT_GT(back, 90000);
  EXPECT_GT(refused, 5000);
}

TEST(Radtan, ASmallerDiscIsRespected) {
  const Radtan d = Radtan::make(0.1, 0, 1e-3, 2e-3, 0);
  for (const double phi : {0.0, 1.0, 4.0}) {
    const auto at = [&](double r) {
      const auto [u, v] = d.distort(r * std::cos(phi), r * std::sin(phi));
      return d.undistort<double>(u, v, 0.5).valid;
    };
    EXPECT_TRUE(at(0.5 * (1 - 1e-13)));
    EXPECT_FALSE(at(0.5 * (1 + 1e-13)));
  }
}

TEST(Radtan, TheInverseOfAPointOfInflection) {
  const Radtan d = Radtan::make(-2. / 3, 1. / 5, 0, 0, 0);
  for (const double r : {0.9, 1.0, 1.1, 2.0}) {
    const auto [u, v] = d.distort(0.6 * r, 0.8 * r);
    const auto q = d.undistort<double>(u, v, d.max_radius);
    ASSERT_TRUE(q.valid);
    EXPECT_NEAR(std::hypot(static_cast<double>(q.x), static_cast<double>(q.y)), r, 2e-5);
    const auto [u2, v2] = d.distort(static_cast<double>(q.x), static_cast<double>(q.y));
    EXPECT_NEAR(std::hypot(u2 - u, v2 - v), 0, 1e-15);
  }
}

}  // namespace
}  // namespace dlsd
