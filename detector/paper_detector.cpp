#include "detector/paper_detector.h"

#include <algorithm>
#include <cmath>

#include "detector/plane_curve.h"
#include "detector/plane_fit.h"
#include "detector/stop_watch.h"
#include "detector/validation.h"
#include "detector/visible_arc.h"

namespace dlsd {
namespace {

/// Residuals of neighbouring edge points are correlated by the smoothing along the edge (kernel
/// variance 1.5 px^2), so N points are worth N / sqrt(4 pi 1.5).
constexpr double kPointsPerIndependentPoint = 4.34;

}  // namespace

PaperDetector::PaperDetector(const RayTable& rays, const DetectorOptions& options)
    : rays_(rays),
      camera_(rays.camera()),
      options_(options),
      filter_(camera_.width(), camera_.height()),
      drawer_(camera_.width(), camera_.height(), options.edges) {}

void PaperDetector::addPolygon(std::span<const Eigen::Vector2d> pixels,
                               std::span<const StraightPiece> group,
                               std::vector<DetectedLine>* lines,
                               StageTimes* times) {
  const int begin = group.front().begin, end = group.back().end;
  if (group.size() == 1 && end - begin < options_.polygons.min_single_px) return;

  const auto pixel = [&](int i) -> const Eigen::Vector2d& {
    return pixels[static_cast<size_t>(i)];
  };
  const auto x = [&](int i) { return static_cast<int>(std::lround(pixel(i).x())); };
  const auto y = [&](int i) { return static_cast<int>(std::lround(pixel(i).y())); };
  std::optional<PlaneFit> fit;
  {
    const StopWatch watch(&times->planes);
    group_rays_.clear();
    for (int i = begin; i < end; ++i) group_rays_.push_back(rays_.at(x(i), y(i)).ray);
    fit = fitPlane(group_rays_);
  }
  if (!fit) return;

  const StopWatch watch(&times->validation);
  for (const StraightPiece& piece : group) {
    for (const int i : {piece.begin, piece.end - 1}) {
      const auto err = reprojectionErrorPx(camera_, pixel(i), fit->normal);
      if (!err || !(*err <= options_.validation.rho_px)) return;
    }
  }
  AlignmentCounter alignment;
  double sum2 = 0, max_px = 0, fit_sum2 = 0, side = 0;
  for (int i = begin; i < end; ++i) {
    const RaySample sample = rays_.at(pixel(i).x(), pixel(i).y());
    const CurveOffset curve = curveOffset(sample, fit->normal);
    const double err = reprojectionErrorFirstOrder(sample, fit->normal);
    sum2 += err * err;
    max_px = std::max(max_px, err);
    const double f = sample.ray.dot(fit->normal);
    fit_sum2 += f * f;
    const size_t k = field_.at(x(i), y(i));
    const double gx = field_.gx[k], gy = field_.gy[k];
    alignment.add(gx, gy, curve.normal, true);
    side += gx * curve.normal.x() + gy * curve.normal.y();
  }
  const auto arc = visibleArc(camera_,
                              fit->normal,
                              group_rays_.front(),
                              group_rays_[group_rays_.size() / 2],
                              group_rays_.back(),
                              false);
  if (!arc) return;
  DetectedLine& line = lines->emplace_back();
  line.arc = *arc;
  const double count = end - begin;
  line.rms_px = std::sqrt(sum2 / count);
  line.max_px = max_px;
  line.length_px = curveLengthPx(camera_, line.arc);
  line.score = alignment.score(field_.width, field_.height);
  line.polarity = side < 0 ? -1 : 1;
  line.normal_cov = fit->inverse_in_plane * (fit_sum2 / count * kPointsPerIndependentPoint);
}

void PaperDetector::detect(const ImageView& image,
                           const BitRows& usable,
                           std::vector<DetectedLine>* lines,
                           StageTimes* times) {
  const EdgeThresholds thresholds = edgeThresholds(options_.edges);
  {
    const StopWatch stage(&times->gradient);
    filter_.compute(image, usable, &field_);
  }
  {
    const StopWatch stage(&times->anchors);
    drawer_.findAnchors(field_, thresholds);
  }
  {
    const StopWatch stage(&times->linking);
    drawer_.link(field_, thresholds, &chains_);
  }
  for (size_t c = 0; c < chains_.count(); ++c) {
    {
      const StopWatch watch(&times->chains);
      points_.clear();
      for (uint32_t i = chains_.starts[c]; i < chains_.starts[c + 1]; ++i) {
        points_.emplace_back(chains_.pixels[i].x, chains_.pixels[i].y);
      }
      splitStraight(points_, options_.polygons, &straight_);
      groupConvex(straight_, options_.polygons, &groups_);
    }
    for (const ConvexGroup& g : groups_) {
      const auto pieces = std::span<const StraightPiece>(straight_);
      addPolygon(
          points_,
          pieces.subspan(static_cast<size_t>(g.first), static_cast<size_t>(g.last - g.first)),
          lines,
          times);
    }
  }
}

}  // namespace dlsd
