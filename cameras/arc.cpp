#include "cameras/arc.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace dlsd {
namespace {

constexpr double kDeg = M_PI / 180;
constexpr double kRise = 1.5;

/// An arc with everything that Arc::at needs worked out once.
class ArcSampler {
 public:
  explicit ArcSampler(const Arc& arc)
      : from_(arc.from),
        // The perpendicular of `from` in the plane, towards `to`.
        side_(arc.from.cross(arc.to).dot(arc.normal) < 0
                  ? Eigen::Vector3d(arc.from.cross(arc.normal))
                  : Eigen::Vector3d(arc.normal.cross(arc.from))),
        angle_(arc.angle()) {}

  [[nodiscard]] double angle() const { return angle_; }
  [[nodiscard]] const Eigen::Vector3d& from() const { return from_; }
  [[nodiscard]] const Eigen::Vector3d& side() const { return side_; }
  /// t: fraction of the angle.
  [[nodiscard]] Eigen::Vector3d at(double t) const {
    const double phi = t * angle_;
    return std::cos(phi) * from_ + std::sin(phi) * side_;
  }

 private:
  Eigen::Vector3d from_, side_;
  double angle_;
};

enum class Where { kInside, kOutsideImage, kOutsideDomain };

Where whereIs(const Camera& camera, const ArcSampler& arc, double t) {
  const auto pixel = camera.project(arc.at(t));
  if (!pixel) return Where::kOutsideDomain;
  return camera.inImage(*pixel) ? Where::kInside : Where::kOutsideImage;
}

/// A point of the arc and how far it is from where its state can change.
struct Probe {
  double t;
  Where where;
  double domain_rad;  ///< Angle to the bound of the domain.
  double border_px;   ///< Distance to the image border; 0 outside the domain.
  double scale;       ///< Bound of px per rad here; 0 outside the domain.
};

Probe probe(const Camera& camera, const ArcSampler& arc, double max_field_angle, double t) {
  const Eigen::Vector3d ray = arc.at(t);
  const double theta = std::atan2(std::sqrt(ray.x() * ray.x() + ray.y() * ray.y()), ray.z());
  Probe p{t, Where::kOutsideDomain, std::abs(max_field_angle - theta), 0, 0};
  const auto pixel = camera.project(ray);
  if (!pixel) return p;
  const ProjectionJacobian J = std::visit(
      [&](const auto& m) { return m.jacobian(ray.x(), ray.y(), ray.z()); }, camera.model());
  // Largest singular value of the 2 x 3 Jacobian, from the eigenvalues of J J^T.
  const double a = J.row(0).squaredNorm(), b = J.row(1).squaredNorm();
  const double c = J.row(0).dot(J.row(1));
  p.scale = std::sqrt((a + b) / 2 + std::hypot((a - b) / 2, c));
  // Positive inside, per axis.
  const double inner_u = std::min(pixel->x() + 0.5, camera.width() - 0.5 - pixel->x());
  const double inner_v = std::min(pixel->y() + 0.5, camera.height() - 0.5 - pixel->y());
  if (camera.inImage(*pixel)) {
    p.where = Where::kInside;
    p.border_px = std::min(inner_u, inner_v);
  } else {
    p.where = Where::kOutsideImage;
    p.border_px = std::hypot(std::min(inner_u, 0.0), std::min(inner_v, 0.0));
  }
  return p;
}

/// Whether the arc between two probes, length_rad apart, certainly keeps their common state.
bool nothingBetween(const Probe& a, const Probe& b, double length_rad) {
  // The scale in between is at most kRise times the larger one of the ends (arc.h).
  if (a.where != b.where || !(a.domain_rad + b.domain_rad > length_rad)) return false;
  if (a.where == Where::kOutsideDomain) return true;
  return a.border_px + b.border_px > kRise * std::max(a.scale, b.scale) * length_rad;
}

/// Angle to +z beyond which nothing is imaged. The models turn away from the axis as a pixel's
/// ((u - cx) / fx, (v - cy) / fy) gets longer, so the image's corners look furthest.
double imageFieldAngle(const Camera& camera) {
  double largest = 0;
  for (const double u : {-0.5, camera.width() - 0.5}) {
    for (const double v : {-0.5, camera.height() - 0.5}) {
      const auto ray = camera.unproject({u, v});
      if (!ray) return camera.maxFieldAngle();
      largest = std::max(largest, std::atan2(std::hypot(ray->x(), ray->y()), ray->z()));
    }
  }
  return largest;
}

/// Pieces of [0, 1] in which the arc is at most cone_rad from +z, with a little to spare.
std::vector<std::pair<double, double>> insideCone(const ArcSampler& arc, double cone_rad) {
  constexpr double kSpare = 1e-6;
  const double angle = arc.angle();
  // z(phi) = amplitude cos(phi - top) >= cos(cone)
  const double amplitude = std::hypot(arc.from().z(), arc.side().z());
  const double least = cone_rad + kSpare < M_PI ? std::cos(cone_rad + kSpare) : -1.0;
  if (!(amplitude >= least)) return {};
  if (!(-amplitude < least) || !(angle > 0)) return {{0, 1}};
  const double half = std::acos(std::clamp(least / amplitude, -1.0, 1.0)) + kSpare;
  const double top = std::atan2(arc.side().z(), arc.from().z());
  std::vector<std::pair<double, double>> pieces;
  for (const double centre : {top, top + 2 * M_PI}) {  // phi is in [0, pi], top in [-pi, pi]
    const double lo = std::max(0.0, (centre - half) / angle);
    const double hi = std::min(1.0, (centre + half) / angle);
    if (!(lo < hi)) continue;
    if (!pieces.empty() && lo <= pieces.back().second) {
      pieces.back().second = std::max(pieces.back().second, hi);
    } else {
      pieces.emplace_back(lo, hi);
    }
  }
  return pieces;
}

/// Between t_in (inside) and t_out (outside), the last t that is inside.
double lastInside(
    const Camera& camera, const ArcSampler& arc, double t_in, double t_out, Where* outside) {
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

/// Appends the points between p0 and p1 (exclusive) that keep the curve within tolerance of its
/// chords, judged by the middle of each piece.
void refine(const Camera& camera,
            const ArcSampler& arc,
            double t0,
            const Eigen::Vector2d& p0,
            double t1,
            const Eigen::Vector2d& p1,
            double tolerance,
            int depth,
            std::vector<Eigen::Vector2d>* out) {
  const double tm = t0 + (t1 - t0) / 2;
  const auto pm = camera.project(arc.at(tm));
  if (depth == 0 || !pm || distanceToChord(*pm, p0, p1) <= tolerance) return;
  refine(camera, arc, t0, p0, tm, *pm, tolerance, depth - 1, out);
  out->push_back(*pm);
  refine(camera, arc, tm, *pm, t1, p1, tolerance, depth - 1, out);
}

}  // namespace

double Arc::angle() const {
  return std::atan2(from.cross(to).norm(), from.dot(to));
}

Eigen::Vector3d Arc::at(double t) const {
  return ArcSampler(*this).at(t);
}

double Arc::angleToPlane(const Eigen::Vector3d& unit_ray) const {
  return std::asin(std::clamp(normal.dot(unit_ray), -1.0, 1.0));
}

std::optional<Arc> arcBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  // a x (b - a) = a x b = a x (b + a), whichever factor is small: without it, nearly (anti)parallel
  // rays would leave a normal that is perpendicular to neither.
  const Eigen::Vector3d n = a.cross(a.dot(b) > 0 ? Eigen::Vector3d(b - a) : Eigen::Vector3d(b + a));
  const double sine = n.norm();
  if (!(sine > 1e-12)) return std::nullopt;
  return Arc{n / sine, a, b};
}

std::optional<Arc> arcOnPlane(const Eigen::Vector3d& normal,
                              const Eigen::Vector3d& from,
                              const Eigen::Vector3d& to) {
  if (!(normal.norm() > 0)) return std::nullopt;
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
  const ArcSampler sampler(arc);
  const double cone = imageFieldAngle(camera);
  const double max_field_angle = camera.maxFieldAngle();
  constexpr double kCoarse = 4 * kDeg;
  constexpr double kFineRad = 0.1 * kDeg;
  constexpr double kFinePx = 2;
  std::vector<ImageSpan> spans;

  // Feeds neighbouring probes, in order, between which the state changes at most once.
  const auto join = [&](const Probe& a, const Probe& b) {
    if (a.where != Where::kInside && b.where == Where::kInside) {
      Where outside{};
      const double t0 = lastInside(camera, sampler, b.t, a.t, &outside);
      spans.push_back({t0, b.t, endFor(outside), ImageEnd::kArcEnd});
    } else if (a.where == Where::kInside && b.where != Where::kInside) {
      Where outside{};
      spans.back().t1 = lastInside(camera, sampler, a.t, b.t, &outside);
      spans.back().end1 = endFor(outside);
    } else if (b.where == Where::kInside) {
      spans.back().t1 = b.t;
    }
  };

  std::vector<Probe> right;  // Right ends of the stretches that are still to be looked at.
  for (const auto& [begin, end] : insideCone(sampler, cone)) {
    Probe left = probe(camera, sampler, max_field_angle, begin);
    if (left.where == Where::kInside) {
      spans.push_back({begin, begin, ImageEnd::kArcEnd, ImageEnd::kArcEnd});
    }
    const int count =
        std::max(1, static_cast<int>(std::ceil((end - begin) * sampler.angle() / kCoarse)));
    for (int i = 1; i <= count; ++i) {
      const double t = i == count ? end : begin + (end - begin) * i / count;
      right.push_back(probe(camera, sampler, max_field_angle, t));
      while (!right.empty()) {
        const double length = (right.back().t - left.t) * sampler.angle();
        const double scale = std::max(left.scale, right.back().scale);
        const bool fine = length <= kFineRad && kRise * scale * length <= kFinePx;
        const double middle = left.t + (right.back().t - left.t) / 2;
        if (fine || nothingBetween(left, right.back(), length) || !(middle > left.t) ||
            !(middle < right.back().t)) {
          join(left, right.back());
          left = right.back();
          right.pop_back();
        } else {
          right.push_back(probe(camera, sampler, max_field_angle, middle));
        }
      }
    }
  }
  return spans;
}

std::vector<Eigen::Vector2d> imageCurve(
    const Camera& camera, const Arc& arc, double t0, double t1, double max_chord_err_px) {
  const ArcSampler sampler(arc);
  // The curve may be a little further from its chord beside the middle, where it is measured.
  const double tolerance = 0.9 * max_chord_err_px;
  std::vector<Eigen::Vector2d> points;
  points.reserve(64);
  // Four pieces to start from, each looked at in three inner points, so that a long S-shaped curve
  // is never taken for a straight one.
  constexpr int kPieces = 4, kInner = 4;
  std::array<std::optional<Eigen::Vector2d>, kPieces * kInner + 1> coarse;
  const auto coarse_t = [&](size_t i) {
    return i + 1 == coarse.size() ? t1
                                  : t0 + (t1 - t0) * static_cast<double>(i) / (kPieces * kInner);
  };
  for (size_t i = 0; i < coarse.size(); ++i) coarse[i] = camera.project(sampler.at(coarse_t(i)));

  std::optional<Eigen::Vector2d> left;
  double t_left = t0;
  // Continues the curve to the point at t; the piece is cut in `parts` at once, then refined.
  const auto extend = [&](double t, const std::optional<Eigen::Vector2d>& p, int parts) {
    if (!p) return;
    const double t_begin = t_left;
    for (int i = 1; i <= parts; ++i) {
      const double t_next = i == parts ? t : t_begin + (t - t_begin) * i / parts;
      const auto next = i == parts ? p : camera.project(sampler.at(t_next));
      if (!next) continue;
      if (left) {
        refine(camera, sampler, t_left, *left, t_next, *next, tolerance, 16, &points);
      }
      points.push_back(*next);
      left = next;
      t_left = t_next;
    }
  };
  extend(t0, coarse[0], 1);
  for (size_t i = 0; i + 1 < coarse.size(); i += kInner) {
    const bool complete =
        coarse[i] && coarse[i + 1] && coarse[i + 2] && coarse[i + 3] && coarse[i + 4];
    double bend = 0;
    for (size_t j = 1; complete && j < kInner; ++j) {
      bend = std::max(bend, distanceToChord(*coarse[i + j], *coarse[i], *coarse[i + kInner]));
    }
    if (!complete) {
      for (size_t j = 1; j <= kInner; ++j) extend(coarse_t(i + j), coarse[i + j], 1);
    } else if (bend <= tolerance) {
      points.push_back(*coarse[i + kInner]);
      left = coarse[i + kInner];
      t_left = coarse_t(i + kInner);
    } else {
      // The distance to the chord falls with the square of the number of parts.
      const double parts = std::ceil(std::sqrt(1.1 * bend / tolerance));
      extend(coarse_t(i + kInner), coarse[i + kInner], static_cast<int>(std::min(parts, 1e3)));
    }
  }
  return points;
}

}  // namespace dlsd
