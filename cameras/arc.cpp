#include "cameras/arc.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

constexpr double kDeg = M_PI / 180;
constexpr double kRise = 1.5;
/// A great circle this near to a pole of a panorama (rad) goes through it, and is cut kPoleGap
/// before and behind: nearer, rounding decides the longitude.
constexpr double kAtPole = 1e-14;
constexpr double kPoleGap = 1e-8;

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
  [[nodiscard]] Eigen::Vector3d at(double t) const { return atAngle(t * angle_); }
  [[nodiscard]] Eigen::Vector3d atAngle(double phi) const {
    return std::cos(phi) * from_ + std::sin(phi) * side_;
  }

  /// Angles phi in [0, angle] at which a from_value cos(phi) + side_value sin(phi) is `value`.
  template <class Take>
  void solve(double from_value, double side_value, double value, const Take& take) const {
    const double amplitude = std::hypot(from_value, side_value);
    if (!(std::abs(value) <= amplitude) || !(amplitude > 0)) return;
    const double top = std::atan2(side_value, from_value);
    const double half = std::acos(value / amplitude);
    for (const double phi : {top - half, top + half}) {
      for (const double turn : {-2 * M_PI, 0.0, 2 * M_PI}) {
        if (phi + turn >= 0 && phi + turn <= angle_) take(phi + turn);
      }
    }
  }

 private:
  Eigen::Vector3d from_, side_;
  double angle_;
};

/// The same for one piece of an arc on a panorama, between cuts: there the sign of x must be right
/// to the last bit, for behind the camera it says on which side of the image the ray is.
class SeamedSampler {
 public:
  SeamedSampler(const Arc& arc, double t0, double t1) : arc_(arc) {
    // x(phi) = slope_ sin(phi - zero_), zero_ in [0, pi).
    const double from = arc_.from().x(), side = arc_.side().x();
    zero_ = std::atan2(-from, side);
    slope_ = std::hypot(from, side);
    if (zero_ < 0) {
      zero_ += M_PI;
      slope_ = -slope_;
    }
    middle_ = (t0 + t1) / 2 * arc_.angle();
    on_seam_ = slope_ == 0 ? 0.0
                           : std::copysign(std::numeric_limits<double>::min(),
                                           slope_ * std::sin(middle_ - zero_));
    through_poles_ = std::abs(arc_.from().cross(arc_.side()).y()) <= kAtPole;
    pole_ = std::atan2(arc_.side().y(), arc_.from().y());
    if (pole_ < 0) pole_ += M_PI;
  }

  [[nodiscard]] double angle() const { return arc_.angle(); }
  /// Angles in [0, pi) at which the arc must be cut: where it meets the seam, and a pole.
  [[nodiscard]] std::optional<double> seamCut() const {
    if (slope_ == 0 || !(arc_.atAngle(zero_).z() < 0)) return std::nullopt;
    if (through_poles_ && std::abs(std::remainder(zero_ - pole_, M_PI)) < kPoleGap) {
      return std::nullopt;
    }
    return zero_;
  }
  [[nodiscard]] std::optional<double> poleCut() const {
    return through_poles_ ? std::optional(pole_) : std::nullopt;
  }

  [[nodiscard]] Eigen::Vector3d at(double t) const {
    double phi = t * arc_.angle();
    if (through_poles_) {
      const double off = std::remainder(phi - pole_, M_PI);
      if (std::abs(off) < kPoleGap) {
        const double pole = phi - off;
        phi = middle_ < pole ? pole - kPoleGap : pole + kPoleGap;
      }
    }
    Eigen::Vector3d ray = arc_.atAngle(phi);
    const double off = phi - zero_;
    ray.x() = std::abs(off) <= 1e-15 * arc_.angle() ? on_seam_ : slope_ * std::sin(off);
    return ray;
  }

 private:
  ArcSampler arc_;
  double zero_, slope_;
  double middle_;   ///< Of the piece.
  double on_seam_;  ///< x at zero_: next to nothing, on the piece's side.
  bool through_poles_;
  double pole_;  ///< Where |y| is largest, in [0, pi).
};

enum class Where { kInside, kOutsideImage, kOutsideDomain };

template <class Sampler>
Where whereIs(const Camera& camera, const Sampler& arc, double t) {
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
  Probe p{t, Where::kOutsideDomain, std::abs(max_field_angle - fieldAngle(ray)), 0, 0};
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
template <class Sampler>
double lastInside(
    const Camera& camera, const Sampler& arc, double t_in, double t_out, Where* outside) {
  *outside = whereIs(camera, arc, t_out);
  while (std::abs(t_out - t_in) > (DLSD_MUTANT("arc-border") ? 1e-7 : 1e-13)) {
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
/// chords, judged by the middle and the quarters of each piece.
template <class Sampler>
void refine(const Camera& camera,
            const Sampler& arc,
            double t0,
            const Eigen::Vector2d& p0,
            double t1,
            const Eigen::Vector2d& p1,
            double tolerance,
            int depth,
            std::vector<Eigen::Vector2d>* out) {
  const auto at = [&](double share) { return camera.project(arc.at(t0 + (t1 - t0) * share)); };
  const auto isNear = [&](const std::optional<Eigen::Vector2d>& p) {
    return !p || distanceToChord(*p, p0, p1) <= tolerance;
  };
  const auto pm = at(0.5);
  if (depth == 0 || !pm || (isNear(pm) && isNear(at(0.25)) && isNear(at(0.75)))) return;
  const double tm = t0 + (t1 - t0) / 2;
  refine(camera, arc, t0, p0, tm, *pm, tolerance, depth - 1, out);
  out->push_back(*pm);
  refine(camera, arc, tm, *pm, t1, p1, tolerance, depth - 1, out);
}

/// imageCurve with the sampler that the camera needs.
template <class Sampler>
std::vector<Eigen::Vector2d> curveOf(
    const Camera& camera, const Sampler& sampler, double t0, double t1, double tolerance) {
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

/// lo, hi and the angles between them at which an arc on a panorama must be cut, in order.
std::vector<double> cutsBetween(const Arc& arc, double lo, double hi) {
  std::vector<double> cuts{lo, hi};
  const SeamedSampler sampler(arc, 0, 1);
  for (const auto& cut : {sampler.seamCut(), sampler.poleCut()}) {
    if (cut && *cut > lo && *cut < hi) cuts.push_back(*cut);
  }
  std::sort(cuts.begin(), cuts.end());
  return cuts;
}

/// imageSpans of a panorama: its borders are parts of great circles and of circles around y, so all
/// places where something can happen are known, and it is enough to look between them.
std::vector<ImageSpan> panoramaSpans(const Equirectangular& model,
                                     const Camera& camera,
                                     const Arc& arc) {
  constexpr double kAtCut = 1e-9;       // An event so near to a cut happens there, rad.
  constexpr double kSameEvent = 1e-13;  // Events so near to each other are one.
  constexpr double kShortest = 1e-12;   // Of a piece.
  const ArcSampler sampler(arc);
  const double angle = sampler.angle();
  const Eigen::Vector3d &from = sampler.from(), &side = sampler.side();

  std::vector<double> events;
  const auto add = [&](double phi) { events.push_back(phi); };
  for (const double u : {-0.5, camera.width() - 0.5}) {
    const double longitude = (u - model.cx) / model.fx;
    const double c = std::cos(longitude), s = std::sin(longitude);
    sampler.solve(c * from.x() - s * from.z(), c * side.x() - s * side.z(), 0, add);
  }
  for (const double v : {-0.5, camera.height() - 0.5}) {
    const double latitude = (v - model.cy) / model.fy;
    if (std::abs(latitude) > M_PI / 2) continue;
    sampler.solve(from.y(), side.y(), std::sin(latitude), add);
  }
  sampler.solve(from.z(), side.z(), std::cos(camera.maxFieldAngleLimit()), add);
  std::sort(events.begin(), events.end());

  const std::vector<double> cuts = cutsBetween(arc, 0, angle);
  std::vector<ImageSpan> spans;
  for (size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double lo = cuts[i], hi = cuts[i + 1];
    if (!(hi - lo > kShortest)) continue;
    const bool from_cut = lo > 0, to_cut = hi < angle;
    // Stretches in which nothing happens: the piece's ends, and a point in each.
    std::vector<double> t{lo / angle};
    double last = lo;
    for (const double phi : events) {
      if (!(phi > lo + (from_cut ? kAtCut : 0)) || !(phi < hi - (to_cut ? kAtCut : 0))) continue;
      if (phi > last + kSameEvent) t.push_back((last + phi) / 2 / angle);
      last = phi;
    }
    t.push_back((last + hi) / 2 / angle);
    t.push_back(to_cut ? hi / angle : 1.0);
    const SeamedSampler piece(arc, t.front(), t.back());

    // Where a span that holds t[k] ends towards t[k_out]; the piece's own ends are inside or not by
    // rounding.
    const auto endOf = [&](size_t k, size_t k_out) -> std::pair<double, ImageEnd> {
      Where outside{};
      const bool at_end = k_out == 0 || k_out + 1 == t.size();
      const bool at_cut = k_out == 0 ? from_cut : to_cut;
      if (at_end && whereIs(camera, piece, t[k_out]) == Where::kInside) {
        return {t[k_out], at_cut ? ImageEnd::kSeam : ImageEnd::kArcEnd};
      }
      const double end = lastInside(camera, piece, t[k], t[k_out], &outside);
      return {end, at_end && at_cut ? ImageEnd::kSeam : endFor(outside)};
    };
    bool open = false;
    for (size_t k = 1; k + 1 < t.size(); ++k) {
      const bool inside = whereIs(camera, piece, t[k]) == Where::kInside;
      if (inside && !open) {
        const auto [begin, why] = endOf(k, k - 1);
        spans.push_back({begin, begin, why, ImageEnd::kArcEnd});
      }
      if (open && !inside) std::tie(spans.back().t1, spans.back().end1) = endOf(k - 1, k);
      open = inside;
    }
    if (open) {
      std::tie(spans.back().t1, spans.back().end1) = endOf(t.size() - 2, t.size() - 1);
    }
  }
  return spans;
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
  const double sine = DLSD_MUTANT("arc-normal") ? n.norm() * (1 + 1e-12) : n.norm();
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
  if (const auto* panorama = std::get_if<Equirectangular>(&camera.model())) {
    return panoramaSpans(*panorama, camera, arc);
  }
  const ArcSampler sampler(arc);
  const double cone = imageFieldAngle(camera);
  const double max_field_angle = camera.maxFieldAngle();
  constexpr double kCoarse = 4 * kDeg;
  constexpr double kFineRad = 0.1 * kDeg;
  constexpr double kFinePx = 2;
  // Where pixels differ in size by many powers of ten (a focal length of 0.001 px beside one of
  // 1000, say), so fine a look would take for ever: what is left is taken as it is.
  constexpr int kMostProbes = 1 << 16;
  int probes = 0;
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
        if (fine || ++probes > kMostProbes || nothingBetween(left, right.back(), length) ||
            !(middle > left.t) || !(middle < right.back().t)) {
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
  if (std::holds_alternative<Equirectangular>(camera.model())) {
    // The longest part that one line can show: for a span, all of it.
    const double angle = arc.angle();
    const std::vector<double> cuts = cutsBetween(arc, t0 * angle, t1 * angle);
    size_t longest = 1;
    for (size_t i = 2; i < cuts.size(); ++i) {
      if (cuts[i] - cuts[i - 1] > cuts[longest] - cuts[longest - 1]) longest = i;
    }
    if (longest > 1) t0 = cuts[longest - 1] / angle;
    if (longest + 1 < cuts.size()) t1 = cuts[longest] / angle;
    // Past a pole, where the longitude runs away like 1 / t, up to twice as far beside the middle.
    return curveOf(camera, SeamedSampler(arc, t0, t1), t0, t1, 0.45 * max_chord_err_px);
  }
  const ArcSampler sampler(arc);
  if (std::holds_alternative<ThetaPolynomial>(camera.model()) ||
      std::holds_alternative<Ocam>(camera.model())) {
    // These bend lines sharply where they pass the optical axis, maybe between all places where
    // curveOf looks: cut there.
    const double t_axis =
        std::atan2(sampler.side().z(), sampler.from().z()) / std::max(sampler.angle(), 1e-300);
    if (t_axis > t0 && t_axis < t1) {
      const double tolerance = 0.6 * max_chord_err_px;
      std::vector<Eigen::Vector2d> points = curveOf(camera, sampler, t0, t_axis, tolerance);
      const std::vector<Eigen::Vector2d> rest = curveOf(camera, sampler, t_axis, t1, tolerance);
      const bool both = !points.empty() && !rest.empty() && points.back() == rest.front();
      points.insert(points.end(), rest.begin() + (both ? 1 : 0), rest.end());
      return points;
    }
  }
  // Between the places where it is measured, a curve whose distance to the chord is a cubic of t is
  // at most 1.094 times as far off.
  return curveOf(
      camera, sampler, t0, t1, (DLSD_MUTANT("arc-chord") ? 1.5 : 0.9) * max_chord_err_px);
}

}  // namespace dlsd
