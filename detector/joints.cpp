#include "detector/joints.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "cameras/mutant.h"
#include "detector/plane_curve.h"
#include "detector/visible_arc.h"

namespace dlsd {
namespace {

/// How far the other line must go on beyond the end, and depart elsewhere.
constexpr double kGoesOnPx = 8, kDepartsPx = 2.5;
/// How far from the crossing the other line may begin.
constexpr double kGapPx = 12;
constexpr double kMaxShare = 1.0 / 3;
/// An end moves by a share of its line's length: of short lines corners are often chance.
constexpr double kMaxLonger = 0.12;
/// Of the angle between the edges of a corner.
constexpr double kCosLeastAngle = 0.966;

double pxBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double px_per_rad) {
  return (a - b).norm() * px_per_rad;
}

}  // namespace

/// Where `line` is cut if its end belongs to `other`, whose plane is near; false if it does not.
bool JointCutter::crossingBefore(const DetectedLine& line,
                                 const Eigen::Vector3d& end_ray,
                                 double px_per_rad,
                                 const DetectedLine& other,
                                 Eigen::Vector3d* crossing) const {
  const Eigen::Vector3d &n = line.arc.normal, &m = other.arc.normal;
  const double same_way = n.dot(m) < 0 ? -1 : 1;
  if (same_way * line.polarity * other.polarity < 0 && !DLSD_MUTANT("joint-polarity")) {
    return false;
  }
  // On the other arc, which goes on beyond.
  if (!isBesideArc(other.arc, end_ray)) return false;
  Eigen::Vector3d at = n.cross(m);
  if (!(at.norm() > 0)) return false;
  at.normalize();
  if (at.dot(end_ray) < 0) at = -at;
  // On this line, not far from its end.
  if (!isBesideArc(line.arc, at)) return false;
  if (pxBetween(at, end_ray, px_per_rad) > kMaxShare * line.length_px) return false;
  // The other line comes from about there and goes on where this one ends.
  const Eigen::Vector3d ahead = end_ray - at;
  const bool to_is_ahead = (other.arc.to - other.arc.from).dot(ahead) > 0;
  const Eigen::Vector3d& far = to_is_ahead ? other.arc.to : other.arc.from;
  const Eigen::Vector3d& near = to_is_ahead ? other.arc.from : other.arc.to;
  if (pxBetween(far, end_ray, px_per_rad) < kGoesOnPx ||
      std::abs(far.dot(n)) * px_per_rad < kDepartsPx) {
    return false;
  }
  if ((near - at).dot(ahead) > 0 && pxBetween(near, at, px_per_rad) > kGapPx) return false;
  *crossing = at;
  return true;
}

void JointCutter::cut(std::vector<DetectedLine>* lines) {
  const Camera& camera = rays_.camera();
  const size_t count = lines->size();
  constexpr size_t kBlock = 16;
  for (size_t axis = 0; axis < 3; ++axis) {
    // Whole blocks.
    normals_[axis].assign((count / kBlock + 1) * kBlock, 0);
    for (size_t i = 0; i < count; ++i) {
      normals_[axis][i] = static_cast<float>((*lines)[i].arc.normal[static_cast<int>(axis)]);
    }
  }
  for (size_t i = 0; i < count; ++i) {
    DetectedLine& line = (*lines)[i];
    for (const bool at_from : {true, false}) {
      Eigen::Vector3d& ray = at_from ? line.arc.from : line.arc.to;
      Eigen::Vector2d& px = at_from ? line.from_px : line.to_px;
      if (!rays_.covers(px.x(), px.y())) continue;
      const double px_per_rad = rays_.at(px.x(), px.y()).pxPerRad();
      if (!(px_per_rad > 0)) continue;
      const Eigen::Vector3f at = ray.cast<float>();
      const float bound_rad = static_cast<float>(kSharedPx / px_per_rad);
      // Most of the others are far away: a block of them is passed at once.
      for (size_t k = 0; k < count; ++k) {
        if (k % kBlock == 0) {
          int near = 0;  // an integer: the loop is vectorised
          for (size_t j = k; j < k + kBlock; ++j) {
            const float distance = std::abs(normals_[0][j] * at.x() + normals_[1][j] * at.y() +
                                            normals_[2][j] * at.z());
            near |= distance <= bound_rad ? 1 : 0;
          }
          if (near == 0) {
            k += kBlock - 1;
            continue;
          }
        }
        const float distance =
            normals_[0][k] * at.x() + normals_[1][k] * at.y() + normals_[2][k] * at.z();
        Eigen::Vector3d crossing;
        if (k == i || !(std::abs(distance) <= bound_rad) ||
            !crossingBefore(line, ray, px_per_rad, (*lines)[k], &crossing)) {
          continue;
        }
        const auto crossing_px = camera.project(crossing);
        if (!crossing_px || !camera.inImage(*crossing_px)) continue;
        const double length_px = line.length_px - (*crossing_px - px).norm();
        if (!(length_px >= min_length_px_)) continue;
        line.length_px = length_px;
        ray = crossing;
        px = *crossing_px;
        break;
      }
    }
  }
}

/// Tells two ends of the corner between them, if there is one.
void JointCutter::offerCorner(const std::vector<DetectedLine>& lines, Tip* a, Tip* b) const {
  const Eigen::Vector3d &n = lines[a->line].arc.normal, &m = lines[b->line].arc.normal;
  Eigen::Vector3d corner = n.cross(m);
  if (!(corner.norm() > 0)) return;
  corner.normalize();
  // Between the edges of a corner it is brighter than beyond both, or darker.
  const auto farEnd = [&](const Tip& tip) -> const Eigen::Vector3d& {
    return tip.at_from ? lines[tip.line].arc.to : lines[tip.line].arc.from;
  };
  const double towards_b = lines[a->line].polarity * n.dot(farEnd(*b));
  const double towards_a = lines[b->line].polarity * m.dot(farEnd(*a));
  if (!(towards_a * towards_b > 0)) return;
  if (corner.dot(a->at_from ? lines[a->line].arc.from : lines[a->line].arc.to) < 0) {
    corner = -corner;
  }
  const auto px = rays_.camera().project(corner);
  if (!px || !rays_.covers(px->x(), px->y())) return;
  const double from_a = (*px - a->px).norm(), from_b = (*px - b->px).norm();
  const auto isNear = [&](const Tip& tip, double distance_px) {
    return distance_px <=
           std::min(kCornerPx,
                    (DLSD_MUTANT("corner-share") ? 1 : kMaxLonger) * lines[tip.line].length_px);
  };
  if (!isNear(*a, from_a) || !isNear(*b, from_b)) return;
  const RaySample sample = rays_.at(px->x(), px->y());
  const Eigen::Vector2d across_a = curveOffset(sample, n).normal;
  const Eigen::Vector2d across_b = curveOffset(sample, m).normal;
  if (std::abs(across_a.dot(across_b)) > kCosLeastAngle) return;
  for (const auto& [tip, distance] : {std::pair(a, from_a), std::pair(b, from_b)}) {
    if (distance >= tip->nearest_px) continue;
    tip->nearest_px = distance;
    tip->corner_px = *px;
    tip->corner_ray = corner;
  }
}

void JointCutter::meetAtCorners(const BitRows& usable, std::vector<DetectedLine>* lines) {
  // What ends at the border, at the rim or at a mask goes on.
  constexpr int kBorderPx = 3;
  const auto isInside = [&](const Eigen::Vector2d& px) {
    const int x = static_cast<int>(px.x() + 0.5), y = static_cast<int>(px.y() + 0.5);
    for (const auto& [dx, dy] :
         {std::pair(-kBorderPx, 0), {kBorderPx, 0}, {0, -kBorderPx}, {0, kBorderPx}}) {
      if (x + dx < 0 || y + dy < 0 || x + dx >= usable.width || y + dy >= usable.height ||
          !usable.contains(x + dx, y + dy)) {
        return false;
      }
    }
    return true;
  };
  tips_.clear();
  for (size_t i = 0; i < lines->size(); ++i) {
    for (const bool at_from : {true, false}) {
      const Eigen::Vector2d& px = at_from ? (*lines)[i].from_px : (*lines)[i].to_px;
      if (!isInside(px)) continue;
      tips_.push_back({i, at_from, px, px, Eigen::Vector3d::Zero(), 2 * kCornerPx});
    }
  }
  std::sort(tips_.begin(), tips_.end(), [](const Tip& a, const Tip& b) {
    return std::make_tuple(a.px.x(), a.px.y(), a.line) <
           std::make_tuple(b.px.x(), b.px.y(), b.line);
  });
  for (size_t i = 0; i < tips_.size(); ++i) {
    for (size_t k = i + 1; k < tips_.size(); ++k) {
      const Eigen::Vector2d apart = tips_[k].px - tips_[i].px;
      if (apart.x() > 2 * kCornerPx) break;
      if (std::abs(apart.y()) > 2 * kCornerPx || tips_[k].line == tips_[i].line) continue;
      offerCorner(*lines, &tips_[i], &tips_[k]);
    }
  }
  for (const Tip& tip : tips_) {
    if (!(tip.nearest_px <= kCornerPx) || !isInside(tip.corner_px)) continue;
    DetectedLine& line = (*lines)[tip.line];
    const Eigen::Vector2d& other_px = tip.at_from ? line.to_px : line.from_px;
    const double longer_px = (tip.corner_px - other_px).norm() - (tip.px - other_px).norm();
    if (!(line.length_px + longer_px >= min_length_px_)) continue;
    line.length_px += longer_px;
    (tip.at_from ? line.from_px : line.to_px) = tip.corner_px;
    (tip.at_from ? line.arc.from : line.arc.to) = tip.corner_ray;
  }
}

}  // namespace dlsd
