#include "evaluation/normal_bound.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "evaluation/hand_made.h"
#include "synth/dataset/random.h"

namespace dlsd {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using hand_made::label;
using hand_made::pinholeCamera;

constexpr ImageNoise kNoise{0.7, 2};

TEST(NormalBound, OffsetBoundIsTheFormula) {
  const double blur = std::sqrt(0.49 + 1.0 / 12), noise2 = 4 + 1.0 / 12;
  EXPECT_NEAR(offsetBoundPx(kNoise, 50, 200),
              std::sqrt(2 * std::sqrt(M_PI) * blur * noise2 / (50.0 * 50 * 200)),
              1e-15);
}

/// The offset of a blurred step in noise, estimated by maximum likelihood, reaches the bound. This
/// checks the formula itself against nothing but its model.
TEST(NormalBound, AnEstimatorReachesTheOffsetBoundAndNoneIsBetter) {
  constexpr int kRows = 40, kHalf = 8, kTrials = 3000;
  const double blur = std::sqrt(0.49 + 1.0 / 12), sigma = std::sqrt(4 + 1.0 / 12);
  const double contrast = 60;
  const auto edge = [&](double x) { return contrast * 0.5 * std::erfc(-x / (blur * M_SQRT2)); };
  const auto slope = [&](double x) {
    return contrast * std::exp(-0.5 * x * x / (blur * blur)) / (blur * std::sqrt(2 * M_PI));
  };
  const Random random(0, 5);
  uint64_t counter = 0;
  double sum2 = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double truth = random.uniform(counter++, -0.5, 0.5);
    std::vector<double> grey;
    for (int k = 0; k < kRows * (2 * kHalf + 1); ++k) {
      const double x = k % (2 * kHalf + 1) - kHalf;
      grey.push_back(edge(x - truth) + sigma * random.normal(counter++));
    }
    double estimate = 0;
    for (int step = 0; step < 5; ++step) {  // Gauss-Newton
      double g = 0, h = 0;
      for (size_t k = 0; k < grey.size(); ++k) {
        const double x = double(int(k) % (2 * kHalf + 1) - kHalf) - estimate;
        g += (grey[k] - edge(x)) * slope(x);
        h += slope(x) * slope(x);
      }
      estimate -= g / h;
    }
    sum2 += (estimate - truth) * (estimate - truth);
  }
  const double rms = std::sqrt(sum2 / kTrials);
  const double bound = offsetBoundPx(kNoise, contrast, kRows);
  EXPECT_NEAR(rms / bound, 1, 0.05);  // +- 1.3 % by chance
}

TEST(NormalBound, ShortLineInTheMiddleHasItsClosedForm) {
  // Length l at focal length f: rays (t, 0, 1) / sqrt(1 + t^2), nearly of one length. Across, f px
  // a rad; offset information i l f^2, roll information i l f^2 (angle)^2 / 12.
  const Camera camera = pinholeCamera();
  const LabelLine line = label(camera, {305, 240}, {335, 240}, 0);
  const auto information = normalInformation(camera, line, kNoise);
  ASSERT_TRUE(information);
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(*information);
  const double sigma_px = offsetBoundPx(kNoise, line.contrast, line.length_px);
  EXPECT_NEAR(eigen.eigenvalues()(0), 0, 1e-6 * eigen.eigenvalues()(2));
  EXPECT_NEAR(std::sqrt(eigen.eigenvalues()(2)) / (400 / sigma_px), 1, 2e-3);
  EXPECT_NEAR(std::sqrt(eigen.eigenvalues()(1)) / (400 / sigma_px * line.angle_rad / std::sqrt(12)),
              1,
              2e-3);
  EXPECT_GE(std::abs(eigen.eigenvectors().col(0).dot(line.normal)), 1 - 1e-9);
}

/// Offsets of independent noise at points along the curve, fitted: the covariance of the fitted
/// normal is the inverse of the information, on any camera.
TEST(NormalBound, InformationIsThatOfIndependentOffsetsAlongTheCurve) {
  const Camera cameras[] = {pinholeCamera(),
                            {Fov::fromParams({220, 220, 320, 240, 0.93}), 640, 480},
                            {UnifiedOmni::fromParams({1.2, 260, 250, 320, 240}), 640, 480}};
  for (const Camera& camera : cameras) {
    SCOPED_TRACE(camera.modelName());
    const LabelLine line = label(camera, {80, 90}, {560, 200}, 0);
    const auto information = normalInformation(camera, line, kNoise);
    ASSERT_TRUE(information);
    // Numerically: how far does a curve point move across when the normal changes by d?
    const Arc arc = arcOnPlane(line.normal, line.points_in_cam[0], line.points_in_cam[1]).value();
    const Vector3d e1 = line.normal.unitOrthogonal(), e2 = line.normal.cross(e1);
    const double variance_1px = std::pow(offsetBoundPx(kNoise, line.contrast, 1), 2);
    Eigen::Matrix2d numeric = Eigen::Matrix2d::Zero();
    constexpr int kSteps = 4000;
    constexpr double kChange = 1e-6;
    for (int k = 0; k < kSteps; ++k) {
      const double t = (k + 0.5) / kSteps;
      const Vector2d p = *camera.project(arc.at(t));
      const Vector2d along =
          *camera.project(arc.at(t + 0.5 / kSteps)) - *camera.project(arc.at(t - 0.5 / kSteps));
      const Vector2d across = Vector2d(-along.y(), along.x()).normalized();
      Vector2d gradient;
      for (int i = 0; i < 2; ++i) {
        const Vector3d n = (line.normal + kChange * (i == 0 ? e1 : e2)).normalized();
        const Vector3d ray = arc.at(t) - n.dot(arc.at(t)) * n;
        gradient(i) = (*camera.project(ray) - p).dot(across) / kChange;
      }
      numeric += along.norm() / variance_1px * gradient * gradient.transpose();
    }
    Eigen::Matrix<double, 3, 2> basis;
    basis << e1, e2;
    const Eigen::Matrix2d analytic = basis.transpose() * *information * basis;
    EXPECT_LE((analytic - numeric).norm(), 2e-3 * numeric.norm());
  }
}

TEST(NormalBound, ErrorsAreMeasuredInSigmas) {
  const Camera camera = pinholeCamera();
  const LabelLine line = label(camera, {200, 240}, {440, 240}, 0);
  const Matrix3d information = normalInformation(camera, line, kNoise).value();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(information);
  const Vector3d strong = eigen.eigenvectors().col(2), weak = eigen.eigenvectors().col(1);
  const double per_strong = 1 / std::sqrt(eigen.eigenvalues()(2));
  const double per_weak = 1 / std::sqrt(eigen.eigenvalues()(1));
  for (const double sign : {1.0, -1.0}) {
    const Vector3d normal =
        sign * (line.normal + 2 * per_strong * strong - 3 * per_weak * weak).normalized();
    const auto error = normalErrorInSigmas(information, line.normal, normal);
    ASSERT_TRUE(error);
    EXPECT_NEAR(error->offset, 2, 1e-5);
    EXPECT_NEAR(error->roll, 3, 1e-5);
    EXPECT_NEAR(error->bound_rad, std::hypot(per_strong, per_weak), 1e-12);
    EXPECT_NEAR(error->angle,
                std::hypot(2 * per_strong, 3 * per_weak) / std::hypot(per_strong, per_weak),
                1e-5);
  }
  EXPECT_FALSE(normalErrorInSigmas(Matrix3d::Zero(), line.normal, line.normal));
}

TEST(NormalBound, NoBoundWhereItDoesNotHold) {
  const Camera camera = pinholeCamera();
  LabelLine line = label(camera, {200, 240}, {440, 240}, 0);
  EXPECT_TRUE(normalInformation(camera, line, kNoise));
  line.kind = LineKind::kWire;
  EXPECT_FALSE(normalInformation(camera, line, kNoise));
  line.kind = LineKind::kCrease;
  line.contrast = 0;
  EXPECT_FALSE(normalInformation(camera, line, kNoise));

  LabelRecord record;
  const auto known = [&](const char* json) {
    record.sensor = nlohmann::ordered_json::parse(json);
    return imageNoise(record).has_value();
  };
  EXPECT_TRUE(known(R"({"psf_sigma_px": 0.7, "read_noise_levels": 2, "encoding": "linear"})"));
  EXPECT_EQ(imageNoise(record)->blur_px, 0.7);
  EXPECT_EQ(imageNoise(record)->noise_levels, 2);
  EXPECT_TRUE(
      known(R"({"psf_sigma_px": 0.7, "exposure": 2, "read_noise_levels": 2, "read_noise_seed": 9,
                        "encoding": "linear", "bits": 8, "vignetting": 0})"));
  EXPECT_FALSE(known(R"({"psf_sigma_px": 0.7, "read_noise_levels": 2, "encoding": "srgb"})"));
  EXPECT_FALSE(known(R"({"psf_sigma_px": 0.7, "encoding": "linear"})"));
  EXPECT_FALSE(known(R"({"psf_sigma_px": 0.7, "read_noise_levels": 2, "encoding": "linear",
                         "shot_noise": 0.1})"));
  EXPECT_FALSE(known("{}"));
  EXPECT_FALSE(known("null"));
}

}  // namespace
}  // namespace dlsd
