#include "detector/plane_fit.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "detector/test_scene.h"

namespace dlsd {
namespace {

using test::gaussian;
using test::uniform;
using Vector3l = Eigen::Matrix<long double, 3, 1>;

Eigen::Vector3d randomUnit(uint64_t seed, uint64_t k) {
  return Eigen::Vector3d(
             gaussian(seed, 3 * k), gaussian(seed, 3 * k + 1), gaussian(seed, 3 * k + 2))
      .normalized();
}

/// Rays on an exact great circle, computed in long double and rounded once.
struct ExactArc {
  Eigen::Vector3d normal;
  std::vector<Eigen::Vector3d> rays;
};

ExactArc exactArc(uint64_t seed, double arc_rad, int count) {
  const Vector3l a = randomUnit(seed, 0).cast<long double>().normalized();
  Vector3l n = a.cross(randomUnit(seed, 1).cast<long double>()).normalized();
  const Vector3l b = n.cross(a);
  ExactArc out;
  for (int i = 0; i < count; ++i) {
    const long double t = static_cast<long double>(arc_rad) * i / (count - 1);
    out.rays.push_back((std::cos(t) * a + std::sin(t) * b).cast<double>());
  }
  out.normal = n.cast<double>();
  return out;
}

double normalError(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::min((a - b).norm(), (a + b).norm());
}

RC_GTEST_PROP(PlaneFit, ExactArcsGiveTheirNormalWithinTheBudget, ()) {
  const auto seed = *rc::gen::inRange<uint64_t>(0, 1U << 30);
  const double exponent = *rc::gen::inRange(-60, 5) / 10.0;  // arc 1e-6 ... 3.1 rad
  const double arc_rad = std::min(std::pow(10.0, exponent), 3.1);
  const int count = *rc::gen::inRange(3, 500);
  const ExactArc arc = exactArc(seed, arc_rad, count);
  const auto fit = fitPlane(arc.rays);
  RC_ASSERT(fit.has_value());
  RC_ASSERT(normalError(fit->normal, arc.normal) <= 1e-12 / std::sin(std::min(arc_rad, M_PI / 2)));
  RC_ASSERT(std::abs(fit->normal.norm() - 1) <= 1e-14);
}

RC_GTEST_PROP(PlaneFit, MomentsGiveExactArcsWithinTheBudget, ()) {
  const auto seed = *rc::gen::inRange<uint64_t>(0, 1U << 30);
  const double arc_rad = *rc::gen::inRange(10, 3100) / 1000.0;
  const ExactArc arc = exactArc(seed, arc_rad, 50);
  RayMoments moments;
  for (const auto& ray : arc.rays) moments.add(ray, 1);
  const auto fit = fitPlane(moments);
  RC_ASSERT(fit.has_value());
  const double s2 = std::min(1.0, arc_rad * arc_rad / 12);
  RC_ASSERT(normalError(fit->normal, arc.normal) <= 1e-14 / s2);
}

RC_GTEST_PROP(PlaneFit, AgreesWithEigenOnNoisyRays, ()) {
  const auto seed = *rc::gen::inRange<uint64_t>(0, 1U << 30);
  const double arc_rad = *rc::gen::inRange(20, 3000) / 1000.0;
  const double noise_rad = *rc::gen::inRange(0, 100) / 10000.0;
  ExactArc arc = exactArc(seed, arc_rad, 40);
  RayMoments moments;
  for (size_t i = 0; i < arc.rays.size(); ++i) {
    arc.rays[i] = (arc.rays[i] + noise_rad * gaussian(seed + 1, i) * arc.normal).normalized();
    moments.add(arc.rays[i], 1 + uniform(seed, i));
  }
  const auto fit = fitPlane(moments);
  RC_ASSERT(fit.has_value());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moments.matrix());
  const double gap = eigen.eigenvalues()[1] - eigen.eigenvalues()[0];
  const double scale = eigen.eigenvalues()[2];
  RC_ASSERT(normalError(fit->normal, eigen.eigenvectors().col(0)) <= 1e-13 * scale / gap);
  RC_ASSERT(std::abs(fit->squared_residuals - eigen.eigenvalues()[0]) <= 1e-13 * scale);
  // Optimality against any other unit vector.
  for (uint64_t k = 0; k < 20; ++k) {
    const Eigen::Vector3d other = randomUnit(seed + 7, k);
    RC_ASSERT(other.dot(moments.matrix() * other) >= fit->squared_residuals - 1e-12 * scale);
  }
}

RC_GTEST_PROP(PlaneFit, AgreesWithEigenFarFromAnyPlane, ()) {
  const auto seed = *rc::gen::inRange<uint64_t>(0, 1U << 30);
  const int count = *rc::gen::inRange(4, 40);
  RayMoments moments;
  std::vector<Eigen::Vector3d> rays;
  for (int i = 0; i < count; ++i) {
    rays.push_back(randomUnit(seed, static_cast<uint64_t>(i)));
    moments.add(rays.back(), 1);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moments.matrix());
  const double gap = eigen.eigenvalues()[1] - eigen.eigenvalues()[0];
  RC_PRE(gap > 1e-3 * count);
  for (const auto& fit : {fitPlane(moments), fitPlane(rays)}) {
    RC_ASSERT(fit.has_value());
    RC_ASSERT(normalError(fit->normal, eigen.eigenvectors().col(0)) <= 1e-11 * count / gap);
  }
}

TEST(PlaneFit, NoValueWithoutTwoDirections) {
  EXPECT_FALSE(fitPlane(RayMoments{}));
  EXPECT_FALSE(fitPlane(std::vector<Eigen::Vector3d>{}));
  EXPECT_FALSE(fitPlane(std::vector<Eigen::Vector3d>{{0, 0, 1}}));
  EXPECT_FALSE(fitPlane(std::vector<Eigen::Vector3d>(5, Eigen::Vector3d(0.6, 0, 0.8))));
  EXPECT_FALSE(fitPlane(std::vector<Eigen::Vector3d>{{0.6, 0, 0.8}, {-0.6, 0, -0.8}}));
  RayMoments one;
  one.add({0.6, 0, 0.8}, 1);
  one.add({0.6, 0, 0.8}, 2);
  EXPECT_FALSE(fitPlane(one));
  one.add({std::nan(""), 0, 1}, 1);
  EXPECT_FALSE(fitPlane(one));
}

TEST(PlaneFit, TwoRaysGiveTheirCrossProduct) {
  const Eigen::Vector3d a = randomUnit(3, 0), b = randomUnit(3, 1);
  const auto fit = fitPlane(std::vector<Eigen::Vector3d>{a, b});
  ASSERT_TRUE(fit);
  EXPECT_LE(normalError(fit->normal, a.cross(b).normalized()), 1e-15 / a.cross(b).norm() * 10);
  EXPECT_GE(fit->normal.x(), 0);
}

TEST(PlaneFit, OneStepFromNearbyIsTheBestPlane) {
  for (const double arc_rad : {0.03, 0.3, 2.0}) {
    const ExactArc arc = exactArc(11, arc_rad, 60);
    RayMoments moments;
    for (size_t i = 0; i < arc.rays.size(); ++i) {
      moments.add((arc.rays[i] + 1e-4 * gaussian(5, i) * arc.normal).normalized(), 450.0 * 450);
    }
    const auto best = fitPlane(moments);
    ASSERT_TRUE(best);
    // 2e-3 rad: 1 px at 450 px / rad, along the plane's tangents.
    const Eigen::Vector3d a = arc.normal.unitOrthogonal();
    const auto refined = refinePlane(moments, (arc.normal + 2e-3 * a).normalized());
    ASSERT_TRUE(refined);
    EXPECT_LE(normalError(*refined, best->normal), 1e-5) << arc_rad;
    EXPECT_NEAR(refined->norm(), 1, 1e-12);
  }
  RayMoments one;
  one.add(Eigen::Vector3d::UnitZ(), 1);
  EXPECT_FALSE(refinePlane(one, Eigen::Vector3d::UnitX()));
  EXPECT_FALSE(refinePlane(RayMoments{}, Eigen::Vector3d::UnitX()));
}

TEST(PlaneFit, InverseInPlaneIsTheCovarianceOfTheNormal) {
  // Monte Carlo: rays moved across the plane by sigma; weights 1 / sigma^2.
  const double sigma = 1e-3;
  const ExactArc arc = exactArc(17, 0.4, 30);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero(), predicted;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    RayMoments moments;
    for (size_t i = 0; i < arc.rays.size(); ++i) {
      const double shift = sigma * gaussian(100 + static_cast<uint64_t>(trial), i);
      moments.add((arc.rays[i] + shift * arc.normal).normalized(), 1 / (sigma * sigma));
    }
    const auto fit = fitPlane(moments);
    ASSERT_TRUE(fit);
    const Eigen::Vector3d n = fit->normal.dot(arc.normal) < 0 ? -fit->normal : fit->normal;
    sum += (n - arc.normal) * (n - arc.normal).transpose();
    predicted = fit->inverse_in_plane;
  }
  // 4000 trials: relative standard error of a variance 2.2 %.
  EXPECT_LE((sum / kTrials - predicted).norm(), 0.1 * predicted.norm());
}

}  // namespace
}  // namespace dlsd
