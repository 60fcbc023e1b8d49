#include "detector/thin_bars.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "cameras/mutant.h"
#include "detector/plane_curve.h"
#include "detector/plane_fit.h"
#include "detector/visible_arc.h"

namespace dlsd {
namespace {

/// Where the width is hardly seen, the sides may even be taken for each other.
constexpr double kMinApartPx = -1;
/// Of the contrasts of both sides, if the ground is even.
constexpr double kEvenRatio = 0.8;
/// How much of the longer side must have a partner.
constexpr double kMinCovered = 0.3;

}  // namespace

/// Whether `line` is the other side of a thin bar along `of`; how far away its middle is.
bool ThinBarMerger::isBeside(const DetectedLine& line,
                             const Middle& middle,
                             const DetectedLine& of,
                             double* offset_px) const {
  const double same_way = line.arc.normal.dot(of.arc.normal) < 0 ? -1 : 1;
  if ((same_way * line.polarity * of.polarity > 0 && !DLSD_MUTANT("bar-polarity")) ||
      !isBesideArc(of.arc, middle.ray))
    return false;
  const auto [fainter, stronger] = std::minmax(line.contrast, of.contrast);
  const double max_apart_px = fainter > kEvenRatio * stronger ? kMaxEvenApartPx : kMaxApartPx;
  const double at_middle =
      curveOffset(rays_.at(middle.px.x(), middle.px.y()), of.arc.normal).offset_px;
  for (const Eigen::Vector2d& px : {line.from_px, line.to_px}) {
    if (!rays_.covers(px.x(), px.y())) return false;
    const double offset = curveOffset(rays_.at(px.x(), px.y()), of.arc.normal).offset_px;
    const double outwards = at_middle < 0 ? -offset : offset;
    if (!(outwards >= kMinApartPx && outwards <= max_apart_px)) return false;
  }
  *offset_px = at_middle;
  return std::abs(at_middle) <= max_apart_px;
}

/// Moves a line half way to its partners; false (and unchanged) if that gives no line.
bool ThinBarMerger::mergeInto(DetectedLine* line,
                              const std::vector<DetectedLine>& lines,
                              const std::vector<size_t>& partners) {
  const Eigen::Vector3d& normal = line->arc.normal;
  centres_.clear();
  double shift_px = 0, longest = 0;
  for (const size_t i : partners) {
    const Arc& arc = lines[i].arc;
    for (const Eigen::Vector3d& ray : {arc.from, middles_[i].ray, arc.to}) {
      centres_.push_back(
          (ray - (DLSD_MUTANT("bar-middle") ? 0.4 : 0.5) * ray.dot(normal) * normal).normalized());
    }
    // What the longest partner says of the separation holds for the ends, too.
    if (lines[i].length_px > longest) {
      longest = lines[i].length_px;
      shift_px =
          0.5 * curveOffset(rays_.at(middles_[i].px.x(), middles_[i].px.y()), normal).offset_px;
    }
  }
  for (const auto& [ray, px] :
       {std::pair(line->arc.from, line->from_px), std::pair(line->arc.to, line->to_px)}) {
    if (!rays_.covers(px.x(), px.y())) return false;
    const double rad_per_px = curveOffset(rays_.at(px.x(), px.y()), normal).rad_per_px;
    centres_.push_back((ray + shift_px * rad_per_px * normal).normalized());
  }
  const auto fit = fitPlane(centres_);
  if (!fit) return false;
  // From the first to the last of all ends, along the line.
  const Eigen::Vector3d across = line->arc.from.cross(line->arc.to);
  const double way = normal.dot(across) < 0 ? -1 : 1;
  Eigen::Vector3d from = line->arc.from, to = line->arc.to;
  for (const size_t i : partners) {
    for (const Eigen::Vector3d& end : {lines[i].arc.from, lines[i].arc.to}) {
      if (way * normal.dot(from.cross(end)) < 0 && from.dot(end) > 0) from = end;
      if (way * normal.dot(end.cross(to)) < 0 && to.dot(end) > 0) to = end;
    }
  }
  const Eigen::Vector3d fitted =
      fit->normal.dot(normal) < 0 ? Eigen::Vector3d(-fit->normal) : fit->normal;
  const Camera& camera = rays_.camera();
  const auto on_plane = arcOnPlane(fitted, from, to);
  if (!on_plane) return false;
  // At the border, half way to a partner may be outside.
  auto arc = visibleArc(camera, fitted, from, on_plane->at(0.5), to, true);
  if (!arc) return false;
  const auto from_px = camera.project(arc->from), to_px = camera.project(arc->to);
  if (!from_px || !to_px || !camera.inImage(*from_px) || !camera.inImage(*to_px)) return false;
  const Eigen::Vector3d canonical = canonicalNormal(fitted);
  if (canonical.dot(line->arc.normal) < 0) line->polarity = -line->polarity;
  arc->normal = canonical;
  // Their distances add to the length, however curved the line is in between.
  line->length_px +=
      std::max(0.0, (*from_px - *to_px).norm() - (line->from_px - line->to_px).norm());
  // The covariance is that of a plane: nothing along its normal.
  const Eigen::Matrix3d in_plane = Eigen::Matrix3d::Identity() - canonical * canonical.transpose();
  line->normal_cov = in_plane * line->normal_cov * in_plane;
  line->arc = *arc;
  line->from_px = *from_px;
  line->to_px = *to_px;
  return true;
}

void ThinBarMerger::merge(std::vector<DetectedLine>* lines) {
  const size_t count = lines->size();
  order_.resize(count);
  middles_.resize(count);
  gone_.assign(count, 0);
  for (size_t i = 0; i < count; ++i) {
    order_[i] = i;
    const DetectedLine& line = (*lines)[i];
    middles_[i].ray = line.arc.at(0.5);
    const auto px = rays_.camera().project(middles_[i].ray);
    middles_[i].px_per_rad = 0;
    if (!px || !rays_.covers(px->x(), px->y())) continue;
    middles_[i].px = *px;
    middles_[i].px_per_rad = rays_.at(px->x(), px->y()).pxPerRad();
  }
  std::sort(order_.begin(), order_.end(), [&](size_t a, size_t b) {
    const double length_a = (*lines)[a].length_px, length_b = (*lines)[b].length_px;
    return length_a != length_b ? length_a > length_b : a < b;
  });
  for (size_t k = 0; k < count; ++k) {
    DetectedLine& line = (*lines)[order_[k]];
    if (gone_[order_[k]] != 0 || middles_[order_[k]].px_per_rad == 0) continue;
    left_.clear();
    right_.clear();
    double left_px = 0, right_px = 0;
    for (size_t m = k + 1; m < count; ++m) {
      const size_t i = order_[m];
      const Middle& middle = middles_[i];
      const double apart_px = std::abs(middle.ray.dot(line.arc.normal)) * middle.px_per_rad;
      // Pixels differ in size across and along a line: twice the bound is certainly too far.
      if (apart_px > 2 * kMaxEvenApartPx || gone_[i] != 0 || middle.px_per_rad == 0) continue;
      double offset_px = 0;
      if (!isBeside((*lines)[i], middle, line, &offset_px)) continue;
      (offset_px < 0 ? left_ : right_).push_back(i);
      (offset_px < 0 ? left_px : right_px) += (*lines)[i].length_px;
    }
    const std::vector<size_t>& partners = left_px > right_px ? left_ : right_;
    if (!(std::max(left_px, right_px) >= kMinCovered * line.length_px)) continue;
    if (!mergeInto(&line, *lines, partners)) continue;
    for (const size_t i : partners) gone_[i] = 1;
  }
  size_t kept = 0;
  for (size_t i = 0; i < count; ++i) {
    if (gone_[i] == 0) (*lines)[kept++] = (*lines)[i];
  }
  lines->erase(lines->begin() + static_cast<ptrdiff_t>(kept), lines->end());
}

}  // namespace dlsd
