#include "detector/joints.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace dlsd {
namespace {

/// How far the other line must go on beyond the end, and depart elsewhere.
constexpr double kGoesOnPx = 8, kDepartsPx = 2.5;
/// How far from the crossing the other line may begin.
constexpr double kGapPx = 12;
constexpr double kMaxShare = 1.0 / 3;

double pxBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double px_per_rad) {
  return (a - b).norm() * px_per_rad;
}

/// The crossing at which `line` is cut if its end `end_ray` belongs to `other`; false if not.
bool crossingBefore(const RayTable& rays,
                    const DetectedLine& line,
                    const Eigen::Vector3d& end_ray,
                    const Eigen::Vector2d& end_px,
                    const DetectedLine& other,
                    Eigen::Vector3d* crossing) {
  const Eigen::Vector3d &n = line.arc.normal, &m = other.arc.normal;
  const double same_way = n.dot(m) < 0 ? -1 : 1;
  if (same_way * line.polarity * other.polarity < 0) return false;
  // On the other arc, which goes on beyond.
  const double way = m.dot(other.arc.from.cross(other.arc.to)) < 0 ? -1 : 1;
  const bool is_beside = way * m.dot(other.arc.from.cross(end_ray)) > 0 &&
                         way * m.dot(end_ray.cross(other.arc.to)) > 0;
  if (!is_beside || !rays.covers(end_px.x(), end_px.y())) return false;
  const double px_per_rad = rays.at(end_px.x(), end_px.y()).pxPerRad();
  if (std::abs(end_ray.dot(m)) * px_per_rad > kSharedPx) return false;
  Eigen::Vector3d at = n.cross(m);
  if (!(at.norm() > 0)) return false;
  at.normalize();
  if (at.dot(end_ray) < 0) at = -at;
  // On this line, not far from its end.
  const double its_way = n.dot(line.arc.from.cross(line.arc.to)) < 0 ? -1 : 1;
  if (!(its_way * n.dot(line.arc.from.cross(at)) > 0 &&
        its_way * n.dot(at.cross(line.arc.to)) > 0)) {
    return false;
  }
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

}  // namespace

void cutAtJoints(const RayTable& rays, std::vector<DetectedLine>* lines) {
  const Camera& camera = rays.camera();
  for (DetectedLine& line : *lines) {
    for (const bool at_from : {true, false}) {
      for (const DetectedLine& other : *lines) {
        Eigen::Vector3d& ray = at_from ? line.arc.from : line.arc.to;
        Eigen::Vector2d& px = at_from ? line.from_px : line.to_px;
        Eigen::Vector3d crossing;
        if (&other == &line || !crossingBefore(rays, line, ray, px, other, &crossing)) continue;
        const auto crossing_px = camera.project(crossing);
        if (!crossing_px || !camera.inImage(*crossing_px)) continue;
        line.length_px = std::max(0.0, line.length_px - (*crossing_px - px).norm());
        ray = crossing;
        px = *crossing_px;
      }
    }
  }
}

}  // namespace dlsd
