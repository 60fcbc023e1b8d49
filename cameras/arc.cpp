#include "cameras/arc.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace dlsd {
namespace {

enum class Where { kInside, kOutsideImage, kOutsideDomain };

Where whereIs(const Camera& camera, const Arc& arc, double t) {
  const auto pixel = camera.project(arc.at(t));
  if (!pixel) return Where::kOutsideDomain;
  return camera.inImage(*pixel) ? Where::kInside : Where::kOutsideImage;
}

/// Between t_in (inside) and t_out (outside), the last t that is inside.
double lastInside(const Camera& camera, const Arc& arc, double t_in, double t_out, Where* outside) {
  *outside = whereIs(camera, arc, t_out);
  while (std::abs(t_out - t_in) > 1e-13) {
    const double t = t_in + (t_out - t_in) / 2;
    if (t == t_in || t == t_out) break;
    const Where w = whereIs(camera, arc, t);
    if (w == Where::kInside) {
      t_in = t;
    } else {
      t_out = t;
      *outside = w;
    }
  }
  return t_in;
}

ImageEnd endFor(Where outside) {
  return outside == Where::kOutsideDomain ? ImageEnd::kRim : ImageEnd::kBorder;
}

double distanceToChord(const Eigen::Vector2d& p,
                       const Eigen::Vector2d& a,
                       const Eigen::Vector2d& b) {
  const Eigen::Vector2d d = b - a;
  const double len2 = d.squaredNorm();
  const double s = len2 > 0 ? std::clamp((p - a).dot(d) / len2, 0.0, 1.0) : 0.0;
  return (p - (a + s * d)).norm();
}

void subdivide(const Camera& camera,
               const Arc& arc,
               double t0,
               const Eigen::Vector2d& p0,
               double t1,
               const Eigen::Vector2d& p1,
               double tolerance,
               int depth,
               std::vector<Eigen::Vector2d>* out) {
  // Three inner points, so that an inflection at the middle does not hide a bend.
  std::optional<Eigen::Vector2d> inner[3];
  bool flat = true;
  for (int i = 0; i < 3; ++i) {
    inner[i] = camera.project(arc.at(t0 + (t1 - t0) * 0.25 * (i + 1)));
    if (inner[i] && !(distanceToChord(*inner[i], p0, p1) <= tolerance)) flat = false;
  }
  if (flat || depth == 0 || !inner[1]) return;
  const double tm = t0 + (t1 - t0) * 0.5;
  subdivide(camera, arc, t0, p0, tm, *inner[1], tolerance, depth - 1, out);
  out->push_back(*inner[1]);
  subdivide(camera, arc, tm, *inner[1], t1, p1, tolerance, depth - 1, out);
}

}  // namespace

double Arc::angle() const { return std::atan2(from.cross(to).norm(), from.dot(to)); }

Eigen::Vector3d Arc::at(double t) const {
  // In the arc's own frame: from and its perpendicular in the plane, towards `to`.
  const Eigen::Vector3d side = from.cross(to).dot(normal) < 0 ? Eigen::Vector3d(-normal) : normal;
  const double phi = t * angle();
  return std::cos(phi) * from + std::sin(phi) * side.cross(from);
}

double Arc::angleToPlane(const Eigen::Vector3d& unit_ray) const {
  return std::asin(std::clamp(normal.dot(unit_ray), -1.0, 1.0));
}

std::optional<Arc> arcBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const Eigen::Vector3d n = a.cross(b);
  const double sine = n.norm();
  if (!(sine > 1e-12)) return std::nullopt;
  return Arc{n / sine, a, b};
}

std::optional<Arc> arcOnPlane(const Eigen::Vector3d& normal,
                              const Eigen::Vector3d& from,
                              const Eigen::Vector3d& to) {
  const Eigen::Vector3d n = normal.normalized();
  const Eigen::Vector3d a = from - n * n.dot(from), b = to - n * n.dot(to);
  if (!(a.norm() > 1e-12 * from.norm()) || !(b.norm() > 1e-12 * to.norm())) return std::nullopt;
  return Arc{n, a.normalized(), b.normalized()};
}

Eigen::Vector3d canonicalNormal(const Eigen::Vector3d& normal) {
  for (int i = 0; i < 3; ++i) {
    if (normal[i] != 0) return normal[i] < 0 ? Eigen::Vector3d(-normal) : normal;
  }
  return normal;
}

double angleBetweenPlanes(const Eigen::Vector3d& n1, const Eigen::Vector3d& n2) {
  return std::atan2(n1.cross(n2).norm(), std::abs(n1.dot(n2)));
}

std::vector<ImageSpan> imageSpans(const Camera& camera, const Arc& arc) {
  // Steps of at most 0.2 degrees and, where the arc is in the image, of about 2 px.
  const double diagonal = std::hypot(camera.width(), camera.height());
  const double step = std::min(0.2 * M_PI / 180, 2 * M_PI / (2 * diagonal));
  const int count = std::max(8, static_cast<int>(std::ceil(arc.angle() / step)));
  std::vector<ImageSpan> spans;
  Where previous = whereIs(camera, arc, 0);
  if (previous == Where::kInside) spans.push_back({0, 0, ImageEnd::kArcEnd, ImageEnd::kArcEnd});
  for (int i = 1; i <= count; ++i) {
    const double t_previous = static_cast<double>(i - 1) / count;
    const double t = static_cast<double>(i) / count;
    const Where now = whereIs(camera, arc, t);
    if (previous != Where::kInside && now == Where::kInside) {
      Where outside{};
      const double t0 = lastInside(camera, arc, t, t_previous, &outside);
      spans.push_back({t0, t0, endFor(outside), ImageEnd::kArcEnd});
    } else if (previous == Where::kInside && now != Where::kInside) {
      Where outside{};
      spans.back().t1 = lastInside(camera, arc, t_previous, t, &outside);
      spans.back().end1 = endFor(outside);
    }
    if (now == Where::kInside) spans.back().t1 = t;
    previous = now;
  }
  return spans;
}

std::vector<Eigen::Vector2d> imageCurve(
    const Camera& camera, const Arc& arc, double t0, double t1, double max_chord_err_px) {
  std::vector<Eigen::Vector2d> points;
  // Start from eight pieces, so that a long S-shaped curve is never taken for a straight one.
  constexpr int kStart = 8;
  std::optional<Eigen::Vector2d> previous = camera.project(arc.at(t0));
  double t_previous = t0;
  if (previous) points.push_back(*previous);
  for (int i = 1; i <= kStart; ++i) {
    const double t = i == kStart ? t1 : t0 + (t1 - t0) * i / kStart;
    const auto p = camera.project(arc.at(t));
    if (!p) continue;
    if (previous) {
      subdivide(camera, arc, t_previous, *previous, t, *p, max_chord_err_px, 16, &points);
    }
    points.push_back(*p);
    previous = p;
    t_previous = t;
  }
  return points;
}

}  // namespace dlsd
