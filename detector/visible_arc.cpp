#include "detector/visible_arc.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

bool isSeen(const Camera& camera, const Eigen::Vector3d& ray) {
  const auto pixel = camera.project(ray);
  return pixel && camera.inImage(*pixel);
}

/// How far an arc stays in image and domain when walked from fraction t_from, which is inside,
/// towards t_to. Steps are short against the distance to the image border, at least kStepPx.
double lastInside(const Camera& camera, const Arc& arc, double t_from, double t_to) {
  constexpr double kStepPx = 1;
  constexpr double kSmallestStep = 1e-9;
  const auto inside = [&](double t) {
    const auto pixel = camera.project(arc.at(t));
    return pixel && camera.inImage(*pixel) ? pixel : std::nullopt;
  };
  std::optional<Eigen::Vector2d> here = inside(t_from);
  double t = t_from, step = (t_to - t_from) / 8;
  while (here && t != t_to) {
    if (std::abs(step) >= std::abs(t_to - t)) step = t_to - t;
    const double next_t = step == t_to - t ? t_to : t + step;
    const auto next = inside(next_t);
    const double border_px = std::min({here->x() + 0.5,
                                       camera.width() - 0.5 - here->x(),
                                       here->y() + 0.5,
                                       camera.height() - 0.5 - here->y()});
    if (next && (*next - *here).norm() <= std::max(kStepPx, border_px / 2)) {
      t = next_t;
      here = next;
      step *= 2;
    } else {
      step /= 2;
      if (!(std::abs(step) > kSmallestStep)) break;
    }
  }
  return t;
}

/// The part of the arc around its middle whose image stays in image and domain. No value if there
/// is none.
std::optional<Arc> clippedToImage(const Camera& camera, const Arc& arc) {
  constexpr double kMiddle = 0.5;
  const double t0 = lastInside(camera, arc, kMiddle, 0), t1 = lastInside(camera, arc, kMiddle, 1);
  if (!(t1 > t0)) return std::nullopt;
  // The very rays that were looked at: arc.at(1) differs from arc.to by rounding.
  Arc clipped = arc;
  if (!DLSD_MUTANT("clip-start")) clipped.from = arc.at(t0);
  clipped.to = arc.at(t1);
  return clipped;
}

}  // namespace

bool isBesideArc(const Arc& arc, const Eigen::Vector3d& ray) {
  const double way = arc.normal.dot(arc.from.cross(arc.to)) < 0 ? -1 : 1;
  return way * arc.normal.dot(arc.from.cross(ray)) >= 0 &&
         way * arc.normal.dot(ray.cross(arc.to)) >= 0;
}

std::optional<Arc> visibleArc(const Camera& camera,
                              const Eigen::Vector3d& plane_normal,
                              const Eigen::Vector3d& from_ray,
                              const Eigen::Vector3d& middle_ray,
                              const Eigen::Vector3d& to_ray,
                              bool ends_tell) {
  const auto traced = arcOnPlane(
      plane_normal,
      from_ray,
      DLSD_MUTANT("line-ends") ? Eigen::Vector3d(to_ray + 0.05 * (to_ray - from_ray)) : to_ray);
  if (!traced || !isBesideArc(*traced, middle_ray)) return std::nullopt;
  // The last fit may have moved an end; where a pixel is hardly an angle, rounding decides.
  if (ends_tell && isSeen(camera, traced->from) && isSeen(camera, traced->to)) return traced;
  return clippedToImage(camera, *traced);
}

double curveLengthPx(const Camera& camera, const Arc& arc) {
  constexpr int kSamples = 32;
  double length = 0;
  std::optional<Eigen::Vector2d> previous = camera.project(arc.from);
  for (int i = 1; i <= kSamples; ++i) {
    const auto pixel = camera.project(arc.at(static_cast<double>(i) / kSamples));
    if (previous && pixel) length += (*pixel - *previous).norm();
    previous = pixel;
  }
  return length;
}

}  // namespace dlsd
