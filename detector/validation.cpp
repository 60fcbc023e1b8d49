#include "detector/validation.h"

#include <algorithm>
#include <cmath>

#include "cameras/mutant.h"

namespace dlsd {

std::optional<double> reprojectionErrorPx(const Camera& camera,
                                          const Eigen::Vector2d& pixel,
                                          const Eigen::Vector3d& plane_normal) {
  const auto ray = camera.unproject(pixel);
  if (!ray) return std::nullopt;
  const auto foot = camera.project(*ray - ray->dot(plane_normal) * plane_normal);
  if (!foot) return std::nullopt;
  return (DLSD_MUTANT("eq8-scale") ? 0.98 : 1) * (pixel - *foot).norm();
}

namespace {

// tan(pi / 8 / 2^level)
constexpr double kTangents[AlignmentCounter::kLevels] = {0.41421356237309503,
                                                         0.198912367379658,
                                                         0.09849140335716425,
                                                         0.04912684976946725,
                                                         0.02454862210892544};

}  // namespace

void AlignmentCounter::add(double gx,
                           double gy,
                           const Eigen::Vector2d& curve_normal,
                           bool has_gradient) {
  ++count_;
  if (!has_gradient) return;
  const double along = std::abs(gx * curve_normal.x() + gy * curve_normal.y());
  const double across = std::abs(gx * curve_normal.y() - gy * curve_normal.x());
  for (int level = 0; level < kLevels; ++level) {
    if (!(across <= kTangents[level] * along)) break;
    ++aligned_[level];
  }
}

double AlignmentCounter::score(int width, int height) const {
  const double log_tests =
      std::log10(static_cast<double>(width) * height * (DLSD_MUTANT("score-levels") ? 1 : kLevels));
  double best = 0;
  double p = 0.25;
  for (int level = 0; level < kLevels; ++level, p /= 2) {
    if (count_ == 0) break;
    const double share = static_cast<double>(aligned_[level]) / count_;
    if (share <= p) continue;
    double divergence = share * std::log(share / p);
    if (share < 1 && !DLSD_MUTANT("score-chernoff"))
      divergence += (1 - share) * std::log((1 - share) / (1 - p));
    best = std::max(best, divergence * count_ / kCorrelatedPx / std::log(10.0));
  }
  return best - log_tests;
}

}  // namespace dlsd
