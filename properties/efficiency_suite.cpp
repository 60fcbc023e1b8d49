// How near the detector is to what statistics allow, over random cameras of every model; and that
// its planes are the optimum of the paper's Eq. 2.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <iostream>
#include <string>

#include "detector/plane_fit.h"
#include "properties/checks/efficiency.h"
#include "properties/gen.h"
#include "properties/gen_image.h"
#include "properties/holds.h"
#include "properties/worst.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

class EfficiencySuite : public ::testing::TestWithParam<std::string_view> {};
INSTANTIATE_TEST_SUITE_P(,
                         EfficiencySuite,
                         ::testing::ValuesIn(cameraModelNames()),
                         [](const auto& test) { return std::string(test.param); });

// Each case is a polygon in ten noises. Root mean squares over all sides and noises of a model.
TEST_P(EfficiencySuite, PlanesAreKnownNearlyAsWellAsNoiseAllows) {
  // 1 is the bound; the offset's 1.2 are those of the detector's filters (edge_profile.h), the rest
  // is for the pieces of sides near the corners that lines leave out.
  // Towards the poles of a panorama lines bend so much that some are found in pieces.
  const bool is_panorama = GetParam() == Equirectangular::kName;
  const double most_offset = is_panorama ? 3 : 2.1, most_roll = is_panorama ? 3 : 2.2;
  const double least_found = 0.9;
  constexpr double kBiasPx = 0.02, kSideBiasPx = 0.05;
  SideErrors all;
  Worst side_bias("mean offset of a side beyond 4 standard errors, px");
  holds(0.05, [&] {
    const EfficiencyCase c{.camera = *genSmallCamera(GetParam(), 360),
                           .seed = static_cast<uint64_t>(*genInt(0, 1 << 30)),
                           .contrast = *genReal(40, 150),
                           .noise_levels = *genReal(1, 6),
                           .blur_px = *genReal(0.6, 1.2)};
    const std::vector<SideErrors> sides = sideErrors(c);
    for (const SideErrors& side : sides) {
      all.tried += side.tried;
      all.found += side.found;
      all.offset2 += side.offset2;
      all.roll2 += side.roll2;
      all.bias_px += side.bias_px;
      if (side.found < 5) continue;
      const double mean = std::abs(side.bias_px / side.found);
      const double beyond = mean - 4 * most_offset * side.offset_bound_px / std::sqrt(side.found);
      side_bias.see(std::max(0.0, beyond));
      RC_LOG() << "mean offset of a side of " << side.length_px << " px: " << mean << " px";
      RC_ASSERT(beyond <= kSideBiasPx);
    }
  });
  if (HasFailure()) return;  // Shrinking has added to the sums.
  ASSERT_GE(all.found, 50);
  const double offset = std::sqrt(all.offset2 / all.found), roll = std::sqrt(all.roll2 / all.found);
  const double bias_px = all.bias_px / all.found;
  std::cout << "    found " << all.found << "/" << all.tried << ", offset " << offset << ", roll "
            << roll << " standard deviations of the bound, bias " << bias_px << " px\n";
  EXPECT_GE(all.found, least_found * all.tried);
  EXPECT_LE(offset, most_offset);
  EXPECT_LE(roll, most_roll);
  EXPECT_LE(std::abs(bias_px), kBiasPx);
}

// Rays of the pixels along a line, off by up to a pixel: the plane that fits costs what the
// smallest eigenvalue of a solver in long double says, to rounding, and no plane near it costs
// less.
TEST_P(EfficiencySuite, PlanesAreTheOptimumOfEquation2) {
  using Matrix3l = Eigen::Matrix<long double, 3, 3>;
  Worst worst("cost above the optimum, in units of 1e-15 of the number of rays");
  holds(1, [&] {
    const Camera camera = *genCamera(GetParam(), Range::kRealistic);
    const Vector2d from = *genPixelInImage(camera), to = *genPixelInImage(camera);
    const double noise_px = *genReal(0, 1);
    const int count = *genInt(3, 300);
    const auto seed = *genInt(0, 1 << 30);
    std::vector<Vector3d> rays;
    for (int i = 0; i < count; ++i) {
      const Vector2d shift(std::sin(seed + 12.9898 * i), std::cos(seed + 78.233 * i));
      const auto ray = camera.unproject(from + (to - from) * i / (count - 1) + noise_px * shift);
      if (ray) rays.push_back(*ray);
    }
    const auto fit = fitPlane(rays);
    Matrix3l moments = Matrix3l::Zero();
    for (const Vector3d& ray : rays) {
      const Eigen::Matrix<long double, 3, 1> x = ray.cast<long double>();
      moments += x * x.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3l> eigen(moments);
    // Nearly one direction has no plane.
    RC_PRE(fit.has_value() && eigen.eigenvalues()(1) > 1e-12L * eigen.eigenvalues()(2));
    const Eigen::Matrix<long double, 3, 1> n = fit->normal.cast<long double>().normalized();
    const long double cost = n.dot(moments * n);
    const auto beyond = static_cast<double>((cost - eigen.eigenvalues()(0)) / 1e-15L /
                                            static_cast<long double>(rays.size()));
    worst.see(std::abs(beyond));
    RC_LOG() << "cost " << static_cast<double>(cost) << ", smallest eigenvalue "
             << static_cast<double>(eigen.eigenvalues()(0)) << ", " << rays.size() << " rays";
    RC_ASSERT(beyond <= 1);
    RC_ASSERT(std::abs(fit->normal.norm() - 1) <= 1e-14);
  });
}

}  // namespace
}  // namespace dlsd
