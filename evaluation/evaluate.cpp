#include "evaluation/evaluate.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "cameras/arc.h"
#include "cameras/mutant.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A polyline with the length up to each point. Its direction is the one that sorts first, so that
/// a reversed curve gives the same samples to the last bit.
struct Curve {
  std::vector<Vector2d> points;
  std::vector<double> length_to;
  [[nodiscard]] double length() const { return length_to.back(); }
};

bool sortsBefore(const Vector2d& a, const Vector2d& b) {
  return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
}

Curve makeCurve(const Camera& camera,
                const std::vector<Vector2d>& points,
                const char* what,
                size_t index) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("{} {} {}", what, index, why));
  };
  if (points.size() < 2) {
    refuse(fmt::format("has {} points, at least 2 are needed", points.size()));
  }
  const double w = camera.width();
  const double h = camera.height();
  for (const Vector2d& p : points) {
    if (!(p.x() >= -w && p.x() <= 2 * w && p.y() >= -h && p.y() <= 2 * h)) {
      refuse(fmt::format("has the point ({}, {}), allowed are [{}, {}] x [{}, {}]",
                         p.x(),
                         p.y(),
                         -w,
                         2 * w,
                         -h,
                         2 * h));
    }
  }
  Curve curve;
  curve.points = points;
  if (std::lexicographical_compare(
          points.rbegin(), points.rend(), points.begin(), points.end(), sortsBefore)) {
    std::reverse(curve.points.begin(), curve.points.end());
  }
  curve.length_to.reserve(points.size());
  curve.length_to.push_back(0);
  for (size_t i = 1; i < points.size(); ++i) {
    curve.length_to.push_back(curve.length_to.back() +
                              (curve.points[i] - curve.points[i - 1]).norm());
  }
  if (!(curve.length() > 0)) {
    refuse("has no length");
  }
  return curve;
}

struct Samples {
  std::vector<Vector2d> points;
  double step_px = 0;
};

/// Middles of equal pieces of the curve between two lengths along it.
void sampleBetween(const Curve& curve, double from_px, double to_px, Samples& samples) {
  const auto n = std::max<size_t>(1, size_t(std::ceil((to_px - from_px) / kSampleStepPx - 1e-9)));
  samples.step_px = (to_px - from_px) / double(n);
  samples.points.clear();
  size_t i = 1;
  for (size_t k = 0; k < n; ++k) {
    const double s = from_px + (double(k) + 0.5) * samples.step_px;
    while (i + 1 < curve.points.size() && curve.length_to[i] < s) {
      ++i;
    }
    const double piece = curve.length_to[i] - curve.length_to[i - 1];
    const double t = piece > 0 ? (s - curve.length_to[i - 1]) / piece : 0;
    samples.points.emplace_back((1 - t) * curve.points[i - 1] + t * curve.points[i]);
  }
}

/// A straight piece of a curve. `beyond_a`: a is an end of the curve, so what lies beyond it is
/// beyond the curve; the same for b.
struct Piece {
  Vector2d a, b;
  int curve;
  bool beyond_a, beyond_b;
};

/// Point of the straight piece from a to b that is nearest to p.
struct Foot {
  Vector2d point;
  double t;  ///< Where p lies along the piece: in [0, 1] beside it.
};

Foot footOn(const Vector2d& a, const Vector2d& b, const Vector2d& p) {
  const Vector2d ab = b - a;
  const double norm2 = ab.squaredNorm();
  const double t = norm2 > 0 ? (p - a).dot(ab) / norm2 : 0;
  return {a + std::clamp(t, 0.0, 1.0) * ab, t};
}

struct PieceDistance {
  double d2_px2;
  bool beside;  ///< The nearest point is not an end of the curve with the point beyond it.
};

PieceDistance distanceTo(const Piece& piece, const Vector2d& p) {
  const Foot foot = footOn(piece.a, piece.b, p);
  return {(p - foot.point).squaredNorm(),
          !((foot.t < 0 && piece.beyond_a) || (foot.t > 1 && piece.beyond_b))};
}

/// Where a point lies along a curve.
struct Place {
  double length_px = 0;    ///< From the curve's start to the nearest point; not clamped.
  double distance_px = 0;  ///< To the nearest point.
  bool before = false, after = false;  ///< Beyond the start, the end.
};

Place placeAlong(const Curve& curve, const Vector2d& p) {
  Place place;
  double least_d2 = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < curve.points.size(); ++i) {
    const Foot foot = footOn(curve.points[i - 1], curve.points[i], p);
    if (const double d2 = (p - foot.point).squaredNorm(); d2 < least_d2) {
      least_d2 = d2;
      const double piece = curve.length_to[i] - curve.length_to[i - 1];
      place.before = i == 1 && foot.t < 0;
      place.after = i + 1 == curve.points.size() && foot.t > 1;
      place.length_px =
          curve.length_to[i - 1] +
          (place.before || place.after ? foot.t : std::clamp(foot.t, 0.0, 1.0)) * piece;
    }
  }
  place.distance_px = std::sqrt(least_d2);
  return place;
}

/// Axis-aligned box of pixels.
struct Bounds {
  Vector2d min{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Vector2d max{-min};
};

/// The pieces of curves near a point: each cell lists the pieces that come within `reach` of it,
/// the curves in the given order and those of one curve together. Points outside the bounds have
/// none.
class PieceGrid {
 public:
  PieceGrid(const std::vector<Curve>& curves,
            const std::vector<int>& order,
            const Bounds& bounds,
            double reach_px)
      : origin_(bounds.min), cell_px_(std::max(8.0, reach_px)) {
    if (!(bounds.min.x() <= bounds.max.x())) {
      return;
    }
    const Vector2d extent = bounds.max - bounds.min;
    columns_ = int(extent.x() / cell_px_) + 1;
    rows_ = int(extent.y() / cell_px_) + 1;
    for (const int c : order) {
      addPieces(curves[size_t(c)], c, bounds, reach_px);
    }
    first_.assign(size_t(columns_) * size_t(rows_) + 1, 0);
    for (const Piece& piece : pieces_) {
      forCells(piece, reach_px, [&](size_t cell) { ++first_[cell + 1]; });
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    entries_.resize(first_.back());
    std::vector<size_t> next(first_.begin(), first_.end() - 1);
    for (size_t i = 0; i < pieces_.size(); ++i) {
      forCells(pieces_[i], reach_px, [&](size_t cell) { entries_[next[cell]++] = pieces_[i]; });
    }
  }

  [[nodiscard]] std::span<const Piece> near(const Vector2d& p) const {
    const Vector2d q = (p - origin_) / cell_px_;
    if (!(q.x() >= 0 && q.y() >= 0 && q.x() < columns_ && q.y() < rows_)) {
      return {};
    }
    const size_t cell = size_t(q.y()) * size_t(columns_) + size_t(q.x());
    return {entries_.data() + first_[cell], first_[cell + 1] - first_[cell]};
  }

 private:
  /// Cuts straight runs into pieces of at most a cell, so that a long one does not fill its whole
  /// box.
  void addPieces(const Curve& curve, int index, const Bounds& bounds, double reach_px) {
    for (size_t i = 1; i < curve.points.size(); ++i) {
      const Vector2d& a = curve.points[i - 1];
      const Vector2d& b = curve.points[i];
      if (std::max(a.x(), b.x()) < bounds.min.x() - reach_px ||
          std::min(a.x(), b.x()) > bounds.max.x() + reach_px ||
          std::max(a.y(), b.y()) < bounds.min.y() - reach_px ||
          std::min(a.y(), b.y()) > bounds.max.y() + reach_px) {
        continue;
      }
      const int n = std::max(1, int(std::ceil((b - a).norm() / cell_px_)));
      for (int k = 0; k < n; ++k) {
        pieces_.push_back({a + (b - a) * (double(k) / n),
                           a + (b - a) * (double(k + 1) / n),
                           index,
                           i == 1 && k == 0,
                           i + 1 == curve.points.size() && k + 1 == n});
      }
    }
  }

  template <class F>
  void forCells(const Piece& piece, double reach_px, F&& f) const {
    const auto cellOf = [&](double value, double origin, int count) {
      return int(std::clamp(std::floor((value - origin) / cell_px_), -1.0, double(count)));
    };
    const int x0 = cellOf(std::min(piece.a.x(), piece.b.x()) - reach_px, origin_.x(), columns_);
    const int x1 = cellOf(std::max(piece.a.x(), piece.b.x()) + reach_px, origin_.x(), columns_);
    const int y0 = cellOf(std::min(piece.a.y(), piece.b.y()) - reach_px, origin_.y(), rows_);
    const int y1 = cellOf(std::max(piece.a.y(), piece.b.y()) + reach_px, origin_.y(), rows_);
    for (int y = std::max(0, y0); y <= std::min(rows_ - 1, y1); ++y) {
      for (int x = std::max(0, x0); x <= std::min(columns_ - 1, x1); ++x) {
        f(size_t(y) * size_t(columns_) + size_t(x));
      }
    }
  }

  Vector2d origin_;
  double cell_px_;
  int columns_ = 0, rows_ = 0;
  std::vector<Piece> pieces_;
  std::vector<size_t> first_;  ///< [cell] start of its entries; one more at the end.
  std::vector<Piece> entries_;
};

/// The point of one curve that is nearest to p, if the curve comes near.
std::optional<Vector2d> nearestOn(const PieceGrid& grid, int curve, const Vector2d& p) {
  double least_d2 = std::numeric_limits<double>::infinity();
  std::optional<Vector2d> nearest;
  for (const Piece& piece : grid.near(p)) {
    if (piece.curve != curve) {
      continue;
    }
    const Vector2d foot = footOn(piece.a, piece.b, p).point;
    if (const double d2 = (p - foot).squaredNorm(); d2 < least_d2) {
      least_d2 = d2;
      nearest = foot;
    }
  }
  return nearest;
}

/// Calls f(curve, least d2, least d2 of the pieces beside it) for every curve near a point.
template <class F>
void forCurvesNear(const PieceGrid& grid, const Vector2d& p, F&& f) {
  const std::span<const Piece> pieces = grid.near(p);
  for (size_t i = 0; i < pieces.size();) {
    const int curve = pieces[i].curve;
    double d2 = std::numeric_limits<double>::infinity();
    double beside_d2 = d2;
    for (; i < pieces.size() && pieces[i].curve == curve; ++i) {
      const PieceDistance distance = distanceTo(pieces[i], p);
      d2 = std::min(d2, distance.d2_px2);
      if (distance.beside) {
        beside_d2 = std::min(beside_d2, distance.d2_px2);
      }
    }
    f(curve, d2, beside_d2);
  }
}

/// A sample near a curve or a carrier.
struct Hit {
  size_t sample;
  int group;
  double d2_px2, beside_d2_px2;
};

/// Adds a hit to those of the same sample, of which a group has one: the nearest. Groups come
/// together.
void addHit(std::vector<Hit>& hits, const Hit& hit) {
  if (!hits.empty() && hits.back().sample == hit.sample && hits.back().group == hit.group) {
    hits.back().d2_px2 = std::min(hits.back().d2_px2, hit.d2_px2);
    hits.back().beside_d2_px2 = std::min(hits.back().beside_d2_px2, hit.beside_d2_px2);
  } else {
    hits.push_back(hit);
  }
}

/// Counters per group and rho that forget only what was touched.
class Counters {
 public:
  Counters(size_t groups, size_t rhos) : rhos_(rhos), counts_(groups * rhos), d2_(groups) {}

  /// Counts a sample at every rho that it is within.
  void add(int group, double d2_px2, std::span<const double> rho2_px2) {
    const auto g = size_t(group);
    if (!(d2_px2 <= rho2_px2.back())) {
      return;
    }
    if (counts_[g * rhos_ + rhos_ - 1] == 0) {
      touched_.push_back(group);
    }
    for (size_t r = 0; r < rhos_; ++r) {
      counts_[g * rhos_ + r] += d2_px2 <= rho2_px2[r] ? 1 : 0;
    }
    d2_[g] += d2_px2;
  }
  [[nodiscard]] std::span<const int> touched() const { return touched_; }
  [[nodiscard]] size_t count(int group, size_t rho) const {
    return counts_[size_t(group) * rhos_ + rho];
  }
  /// The group with the largest count; among equals the one with the most at the largest rho, then
  /// the nearest, then the first. -1 if no group has any.
  [[nodiscard]] int best(size_t rho) const {
    int best = -1;
    for (const int g : touched_) {
      if (count(g, rho) > 0 && (best < 0 || key(g, rho) < key(best, rho))) {
        best = g;
      }
    }
    return best;
  }
  void clear() {
    for (const int g : touched_) {
      std::fill_n(counts_.begin() + long(size_t(g) * rhos_), rhos_, size_t{0});
      d2_[size_t(g)] = 0;
    }
    touched_.clear();
  }

 private:
  [[nodiscard]] std::tuple<long, long, double, int> key(int group, size_t rho) const {
    return {-long(count(group, rho)), -long(count(group, rhos_ - 1)), d2_[size_t(group)], group};
  }

  size_t rhos_;
  std::vector<size_t> counts_;  ///< [group][rho]
  std::vector<double> d2_;
  std::vector<int> touched_;
};

bool atLeastNineTenths(size_t counted, size_t total) {
  return 10 * counted >= (DLSD_MUTANT("nine-tenths") ? 8 : 9) * total;
}

struct LabelSet {
  std::vector<Curve> curves;
  std::vector<int> order;       ///< Labels sorted by carrier, those of a run together.
  std::vector<int> carriers;    ///< Carrier ids, ascending.
  std::vector<int> carrier_of;  ///< [label] index into carriers.
  std::vector<int> run_of;      ///< [label] number of its run; runs of a carrier are consecutive.
  int runs = 0;
  /// [label][end] Whether another label of its run goes on there; ends as the curve has them.
  std::vector<std::array<bool, 2>> goes_on;
  std::vector<Vector3d> normals;  ///< [carrier index] of its line's plane.
  Bounds bounds;
};

/// Whether a point lies on a curve or at most kMaxBridgePx from it.
bool bridgeable(const Curve& curve, const Vector2d& p) {
  return placeAlong(curve, p).distance_px <= kMaxBridgePx;
}

/// Numbers the runs of `order`, which is sorted by carrier, and sorts it by run.
void makeRuns(LabelSet& set) {
  set.run_of.assign(set.curves.size(), -1);
  set.goes_on.assign(set.curves.size(), {false, false});
  for (auto first = set.order.begin(); first != set.order.end();) {
    const auto end = std::find_if(first, set.order.end(), [&](int label) {
      return set.carrier_of[size_t(label)] != set.carrier_of[size_t(*first)];
    });
    // Labels of one carrier lie on one curve, so they are near each other if an end is near the
    // other label.
    const auto joined = [&](int a, int b) {
      const Curve& ca = set.curves[size_t(a)];
      const Curve& cb = set.curves[size_t(b)];
      const std::array<bool, 2> a_goes_on{bridgeable(cb, ca.points.front()),
                                          bridgeable(cb, ca.points.back())};
      for (size_t e = 0; e < 2; ++e) {
        set.goes_on[size_t(a)][e] = set.goes_on[size_t(a)][e] || a_goes_on[e];
      }
      return a_goes_on[0] || a_goes_on[1] || bridgeable(ca, cb.points.front()) ||
             bridgeable(ca, cb.points.back());
    };
    std::vector<int> members;
    for (auto seed = first; seed != end; ++seed) {
      if (set.run_of[size_t(*seed)] >= 0) {
        continue;
      }
      members.assign(1, *seed);
      set.run_of[size_t(*seed)] = set.runs;
      for (size_t m = 0; m < members.size(); ++m) {
        for (auto it = first; it != end; ++it) {
          if (*it != members[m] && joined(members[m], *it) && set.run_of[size_t(*it)] < 0) {
            set.run_of[size_t(*it)] = set.runs;
            members.push_back(*it);
          }
        }
      }
      ++set.runs;
    }
    first = end;
  }
  std::stable_sort(set.order.begin(), set.order.end(), [&](int a, int b) {
    return set.run_of[size_t(a)] < set.run_of[size_t(b)];
  });
}

LabelSet makeLabelSet(const Camera& camera, const std::vector<LabelLine>& labels) {
  LabelSet set;
  for (size_t i = 0; i < labels.size(); ++i) {
    set.curves.push_back(makeCurve(camera, labels[i].points, "label", i));
    for (const Vector2d& p : labels[i].points) {
      set.bounds.min = set.bounds.min.cwiseMin(p);
      set.bounds.max = set.bounds.max.cwiseMax(p);
    }
    set.carriers.push_back(labels[i].carrier);
  }
  std::sort(set.carriers.begin(), set.carriers.end());
  set.carriers.erase(std::unique(set.carriers.begin(), set.carriers.end()), set.carriers.end());
  set.normals.resize(set.carriers.size(),
                     Vector3d::Constant(std::numeric_limits<double>::infinity()));
  for (size_t i = 0; i < labels.size(); ++i) {
    const auto it = std::lower_bound(set.carriers.begin(), set.carriers.end(), labels[i].carrier);
    set.carrier_of.push_back(int(it - set.carriers.begin()));
    // Labels of one carrier have the same normal up to rounding: take one that their order can't
    // change.
    Vector3d& normal = set.normals[size_t(set.carrier_of.back())];
    const Vector3d& candidate = labels[i].normal;
    if (std::lexicographical_compare(
            candidate.begin(), candidate.end(), normal.begin(), normal.end())) {
      normal = candidate;
    }
  }
  set.order.resize(labels.size());
  std::iota(set.order.begin(), set.order.end(), 0);
  std::stable_sort(set.order.begin(), set.order.end(), [&](int a, int b) {
    return set.carrier_of[size_t(a)] < set.carrier_of[size_t(b)];
  });
  makeRuns(set);
  return set;
}

bool isCrowded(
    const LabelSet& set, const PieceGrid& grid, size_t label, double crowded_px, Samples& samples) {
  const Curve& curve = set.curves[label];
  sampleBetween(curve, 0, curve.length(), samples);
  const auto meetsNear = [&](const Curve& other, const Vector2d& p) {
    for (const Vector2d& end : {curve.points.front(), curve.points.back()}) {
      if ((p - end).norm() <= (DLSD_MUTANT("crowd-radius") ? 1.3 : 1) * kSharedEndRadiusPx &&
          ((other.points.front() - end).norm() <= kSharedEndPx ||
           (other.points.back() - end).norm() <= kSharedEndPx)) {
        return true;
      }
    }
    return false;
  };
  bool crowded = false;
  for (const Vector2d& p : samples.points) {
    forCurvesNear(grid, p, [&](int other, double d2, double) {
      if (size_t(other) != label && d2 < crowded_px * crowded_px &&
          !meetsNear(set.curves[size_t(other)], p)) {
        crowded = true;
      }
    });
    if (crowded) {
      return true;
    }
  }
  return false;
}

/// Whether a pixel lies within rho of the image of the infinite line behind a label. The image's
/// tangent where the nearest ray of its plane arrives says how far: that place itself is not the
/// nearest one where the scales along and across the line differ.
bool onCarrier(const Camera& camera, const Vector3d& normal, const Vector2d& pixel, double rho_px) {
  const std::optional<Vector3d> ray = camera.unproject(pixel);
  if (!ray) {
    return false;
  }
  const Vector3d on_plane = *ray - normal.dot(*ray) * normal;
  const std::optional<Vector2d> foot = camera.project(on_plane);
  const std::optional<ProjectionJacobian> jacobian = camera.jacobian(on_plane);
  if (!foot || !jacobian) {
    return false;
  }
  const Vector2d tangent = *jacobian * normal.cross(on_plane);
  const Vector2d away = pixel - *foot;
  return std::abs(tangent.x() * away.y() - tangent.y() * away.x()) <= rho_px * tangent.norm();
}

/// What a carrier's labels say about one sample of a detection.
enum class Evidence : uint8_t { kNone, kCovered, kBeside };

/// Whether a detection bridges stretches without label evidence along its carrier, and is in
/// position when they count as such.
bool isMerged(const Camera& camera,
              const Vector3d& normal,
              const Samples& samples,
              std::span<const Evidence> evidence,
              double rho_px) {
  size_t in_position = size_t(std::count_if(
      evidence.begin(), evidence.end(), [](Evidence e) { return e != Evidence::kNone; }));
  bool bridges = false;
  const auto beside = [](Evidence e) { return e == Evidence::kBeside; };
  auto gap = std::find_if(evidence.begin(), evidence.end(), beside);
  while (gap != evidence.end()) {
    gap = std::find_if_not(gap, evidence.end(), beside);
    const auto next = std::find_if(gap, evidence.end(), beside);
    // The last stretch, with no evidence after it, is not between two of them.
    if (next != evidence.end() && double(next - gap) * samples.step_px >
                                      (DLSD_MUTANT("bridge-length") ? 6 : kMaxBridgePx) + 1e-9) {
      bridges = true;
      for (auto it = gap; it != next; ++it) {
        const Vector2d& pixel = samples.points[size_t(it - evidence.begin())];
        in_position += *it == Evidence::kNone && onCarrier(camera, normal, pixel, rho_px) ? 1 : 0;
      }
    }
    gap = next;
  }
  return bridges && atLeastNineTenths(in_position, samples.points.size());
}

/// The plane of a detection: its own normal, else the one that fits the rays of its curve best.
/// None if the rays are too few or too close to have a plane.
std::optional<Vector3d> planeOf(const Camera& camera,
                                const DetectionLine& line,
                                const Curve& curve) {
  if (line.normal) {
    return line.normal;
  }
  Samples samples;
  sampleBetween(curve, 0, curve.length(), samples);
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const Vector2d& p : samples.points) {
    if (const std::optional<Vector3d> ray = camera.unproject(p)) {
      moments += *ray * ray->transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moments);
  // Rays of two directions at least: 1e-10 is a spread of some 1e-5 rad.
  if (!(eigen.eigenvalues()(1) > 1e-10 * eigen.eigenvalues()(2))) {
    return std::nullopt;
  }
  return eigen.eigenvectors().col(0);
}

/// A label's end `label_at_end` of its curve against an end of the detection.
EndError endError(const Curve& label,
                  const Curve& detection,
                  const Place& detection_end,
                  bool label_at_end,
                  bool detection_at_end) {
  const bool beyond = label_at_end ? detection_end.after : detection_end.before;
  if (!beyond) {
    return {-(label_at_end ? label.length() - detection_end.length_px : detection_end.length_px),
            detection_end.distance_px};
  }
  const Place place =
      placeAlong(detection, label_at_end ? label.points.back() : label.points.front());
  const double at = std::clamp(place.length_px, 0.0, detection.length());
  return {detection_at_end != DLSD_MUTANT("end-error-side") ? detection.length() - at : at,
          place.distance_px};
}

/// Of both ends of a label, in the order of its curve.
std::array<EndError, 2> endErrors(const Curve& label, const Curve& detection) {
  const Place start = placeAlong(label, detection.points.front());
  const Place end = placeAlong(label, detection.points.back());
  const bool same_way = start.length_px <= end.length_px;
  return {endError(label, detection, same_way ? start : end, false, !same_way),
          endError(label, detection, same_way ? end : start, true, same_way)};
}

/// Angle between the rays of a curve's first and last points that have one; 0 if none has.
double endAngle(const Camera& camera, const std::vector<Vector2d>& points) {
  const auto firstRay = [&](auto begin, auto end) -> std::optional<Vector3d> {
    for (auto it = begin; it != end; ++it) {
      if (const std::optional<Vector3d> ray = camera.unproject(*it)) {
        return ray;
      }
    }
    return std::nullopt;
  };
  const std::optional<Vector3d> from = firstRay(points.begin(), points.end());
  const std::optional<Vector3d> to = firstRay(points.rbegin(), points.rend());
  return from && to ? std::atan2(from->cross(*to).norm(), from->dot(*to)) : 0;
}

}  // namespace

void EvaluationOptions::check() const {
  const auto refuse = [](const char* field, double value, const char* range) {
    throw std::invalid_argument(fmt::format("{} is {}, allowed is {}", field, value, range));
  };
  if (rho_px.empty()) {
    throw std::invalid_argument("rho_px is empty, at least one tolerance is needed");
  }
  if (rho_px.size() > kMaxTolerances) {
    throw std::invalid_argument(fmt::format(
        "rho_px has {} tolerances, at most {} are allowed", rho_px.size(), kMaxTolerances));
  }
  for (size_t i = 0; i < rho_px.size(); ++i) {
    if (!(rho_px[i] > 0 && rho_px[i] <= 100)) {
      refuse("rho_px", rho_px[i], "(0, 100]");
    }
    if (i > 0 && !(rho_px[i] > rho_px[i - 1])) {
      refuse("rho_px", rho_px[i], "an ascending list");
    }
  }
  if (!(headline_contrast >= 0 && headline_contrast <= 255)) {
    refuse("headline_contrast", headline_contrast, "[0, 255]");
  }
  if (!(headline_angle_rad >= 0 && headline_angle_rad <= M_PI)) {
    refuse("headline_angle_rad", headline_angle_rad, "[0, pi]");
  }
  if (!(headline_length_px >= 0 && headline_length_px <= 1e6)) {
    refuse("headline_length_px", headline_length_px, "[0, 1e6]");
  }
  if (!(crowded_px >= 0 && crowded_px <= 100)) {
    refuse("crowded_px", crowded_px, "[0, 100]");
  }
}

Stratum stratumOf(const LabelConditions& conditions) {
  return conditions.faint      ? Stratum::kFaint
         : conditions.is_short ? Stratum::kShort
         : conditions.crowded  ? Stratum::kCrowded
                               : Stratum::kHeadline;
}

std::string_view toString(Stratum stratum) {
  switch (stratum) {
    case Stratum::kHeadline:
      return "headline";
    case Stratum::kCrowded:
      return "crowded";
    case Stratum::kShort:
      return "short";
    case Stratum::kFaint:
      return "faint";
  }
  return "";
}

void DistanceStats::add(double distance_px) {
  sum_px += distance_px;
  sum2_px2 += distance_px * distance_px;
  ++count;
  const auto bin = size_t(distance_px / kBinPx);
  if (bin >= bins.size()) {
    bins.resize(bin + 1);
  }
  ++bins[bin];
}

DistanceStats& DistanceStats::operator+=(const DistanceStats& other) {
  sum_px += other.sum_px;
  sum2_px2 += other.sum2_px2;
  count += other.count;
  bins.resize(std::max(bins.size(), other.bins.size()));
  for (size_t i = 0; i < other.bins.size(); ++i) {
    bins[i] += other.bins[i];
  }
  return *this;
}

double DistanceStats::quantile(double q) const {
  const double rank = q * double(count);
  double below = 0;
  for (size_t i = 0; i < bins.size(); ++i) {
    const auto in_bin = double(bins[i]);
    if (in_bin > 0 && below + in_bin >= rank) {
      return (double(i) + std::clamp((rank - below) / in_bin, 0.0, 1.0)) * kBinPx;
    }
    below += in_bin;
  }
  return 0;
}

FrameOutcome evaluateFrame(const Camera& camera,
                           const std::vector<LabelLine>& labels,
                           const std::vector<DetectionLine>& detections,
                           const EvaluationOptions& options,
                           const std::optional<ImageNoise>& noise) {
  options.check();
  const size_t rhos = options.rho_px.size();
  std::vector<double> rho2;
  for (const double rho : options.rho_px) {
    rho2.push_back(rho * rho);
  }
  const double max_rho = options.rho_px.back();

  LabelSet set = makeLabelSet(camera, labels);
  std::vector<Curve> curves;
  for (size_t i = 0; i < detections.size(); ++i) {
    curves.push_back(makeCurve(camera, detections[i].points, "detection", i));
  }
  std::vector<int> detection_order(curves.size());
  std::iota(detection_order.begin(), detection_order.end(), 0);

  const double label_reach = std::max(max_rho, options.crowded_px);
  Bounds reached = set.bounds;  // where a point can be near a label
  reached.min.array() -= label_reach;
  reached.max.array() += label_reach;
  const PieceGrid label_grid(set.curves, set.order, reached, label_reach);
  Bounds labelled = set.bounds;  // where samples of labels can be, rounding included
  labelled.min.array() -= 1;
  labelled.max.array() += 1;
  const PieceGrid detection_grid(curves, detection_order, labelled, max_rho);

  FrameOutcome outcome;
  outcome.labels.assign(rhos, std::vector<LabelOutcome>(labels.size()));
  outcome.detections.assign(rhos, std::vector<DetectionOutcome>(detections.size()));
  Samples samples;
  std::vector<Hit> hits;

  // Strata.
  for (size_t i = 0; i < labels.size(); ++i) {
    const LabelLine& label = labels[i];
    outcome.conditions.push_back(
        {.faint = !(label.contrast >= options.headline_contrast),
         .is_short = !(label.angle_rad >= options.headline_angle_rad &&
                       label.length_px >= options.headline_length_px),
         .crowded = isCrowded(set, label_grid, i, options.crowded_px, samples)});
    outcome.strata.push_back(stratumOf(outcome.conditions.back()));
  }
  outcome.run_of = set.run_of;
  outcome.run_strata.resize(size_t(set.runs));
  std::vector<double> run_length_px(size_t(set.runs), 0.0);
  for (size_t i = 0; i < labels.size(); ++i) {
    const auto run = size_t(set.run_of[i]);
    const std::pair mine(set.curves[i].length(), -int(outcome.strata[i]));
    if (mine > std::pair(run_length_px[run], -int(outcome.run_strata[run]))) {
      run_length_px[run] = mine.first;
      outcome.run_strata[run] = outcome.strata[i];
    }
  }
  outcome.runs.assign(rhos, std::vector<RunOutcome>(size_t(set.runs)));

  // Labels: found, and how far from the detection that found them.
  std::array<std::vector<DistanceStats>, kStratumCount> distances;
  Counters near_detection(detections.size(), rhos);
  std::vector<double>& scores = outcome.detection_score;
  for (size_t i = 0; i < detections.size(); ++i) {
    outcome.detection_length_px.push_back(curves[i].length());
    scores.push_back(detections[i].score.value_or(curves[i].length()));
  }
  // [rho] (detection, run) where the detection finds a label of the run.
  std::vector<std::vector<std::pair<int, int>>> finders(rhos);
  outcome.errors.resize(labels.size());
  for (size_t i = 0; i < labels.size(); ++i) {
    const double length = set.curves[i].length();
    const double trim = std::min(kLabelTrimPx, length / 4);
    sampleBetween(set.curves[i], trim, length - (DLSD_MUTANT("trim-one-end") ? 0 : trim), samples);
    for (const Vector2d& p : samples.points) {
      forCurvesNear(detection_grid, p, [&](int detection, double d2, double) {
        near_detection.add(detection, d2, rho2);
      });
    }
    for (size_t r = 0; r < rhos; ++r) {
      LabelOutcome& result = outcome.labels[r][i];
      result.detection = near_detection.best(r);
      if (result.detection < 0) {
        continue;
      }
      const size_t covered = near_detection.count(result.detection, r);
      result.coverage = double(covered) / double(samples.points.size());
      result.found = atLeastNineTenths(covered, samples.points.size());
      if (!result.found) {
        continue;
      }
      result.found_score = scores[size_t(result.detection)];
      for (const int detection : near_detection.touched()) {
        if (atLeastNineTenths(near_detection.count(detection, r), samples.points.size())) {
          result.found_score = std::max(result.found_score, scores[size_t(detection)]);
          finders[r].emplace_back(detection, set.run_of[i]);
        }
      }
      outcome.runs[r][size_t(set.run_of[i])].found = true;
    }
    near_detection.clear();
    const LabelOutcome& result = outcome.labels.back()[i];
    if (!result.found) {
      continue;
    }
    DistanceStats stats;
    LabelErrors& errors = outcome.errors[i].emplace();
    for (const Vector2d& p : samples.points) {
      const std::optional<Vector2d> foot = nearestOn(detection_grid, result.detection, p);
      if (!foot || !((p - *foot).squaredNorm() <= rho2.back())) {
        continue;
      }
      stats.add((p - *foot).norm());
      if (const std::optional<Vector3d> ray = camera.unproject(*foot)) {
        const double angle = std::asin(std::min(1.0, std::abs(labels[i].normal.dot(*ray))));
        ++errors.angle_samples;
        errors.sum_rad += angle;
        errors.sum2_rad2 += DLSD_MUTANT("angle-squares") ? angle : angle * angle;
      }
    }
    errors.samples = stats.count;
    errors.sum_px = stats.sum_px;
    errors.sum2_px2 = stats.sum2_px2;
    distances[size_t(outcome.strata[i])].push_back(std::move(stats));

    const Curve& detection = curves[size_t(result.detection)];
    const std::array<EndError, 2> ends = endErrors(set.curves[i], detection);
    const bool turned = set.curves[i].points.front() != labels[i].points.front();
    for (size_t e = 0; e < 2; ++e) {
      if (!set.goes_on[i][e]) {
        errors.ends[turned ? 1 - e : e] = ends[e];
      }
    }
    const std::optional<Vector3d> normal =
        planeOf(camera, detections[size_t(result.detection)], detection);
    if (normal) {
      errors.normal_rad = angleBetweenPlanes(labels[i].normal, *normal);
    }
    if (normal && noise && outcome.strata[i] == Stratum::kHeadline) {
      if (const auto information = normalInformation(camera, labels[i], *noise)) {
        errors.normal_sigmas = normalErrorInSigmas(*information, labels[i].normal, *normal);
      }
    }
  }
  for (size_t s = 0; s < kStratumCount; ++s) {
    // Sums of floating-point numbers depend on their order: take one that labels can't change.
    std::sort(distances[s].begin(), distances[s].end(), [](const auto& a, const auto& b) {
      return std::tie(a.sum_px, a.sum2_px2) < std::tie(b.sum_px, b.sum2_px2);
    });
    for (const DistanceStats& stats : distances[s]) {
      outcome.localisation[s] += stats;
    }
  }

  // Detections: right, merged, fragments of the runs they lie on.
  Counters near_carrier(set.carriers.size(), rhos);
  Counters near_run(size_t(set.runs), rhos);
  std::vector<Evidence> evidence;
  std::vector<Hit> run_hits;
  for (size_t i = 0; i < detections.size(); ++i) {
    sampleBetween(curves[i], 0, curves[i].length(), samples);
    hits.clear();
    run_hits.clear();
    for (size_t k = 0; k < samples.points.size(); ++k) {
      forCurvesNear(label_grid, samples.points[k], [&](int label, double d2, double beside_d2) {
        addHit(hits, {k, set.carrier_of[size_t(label)], d2, beside_d2});
        addHit(run_hits, {k, set.run_of[size_t(label)], d2, beside_d2});
      });
    }
    for (const Hit& hit : hits) {
      near_carrier.add(hit.group, hit.d2_px2, rho2);
    }
    for (const Hit& hit : run_hits) {
      near_run.add(hit.group, hit.d2_px2, rho2);
    }
    const size_t total = samples.points.size();
    for (size_t r = 0; r < rhos; ++r) {
      DetectionOutcome& result = outcome.detections[r][i];
      if (const int carrier = near_carrier.best(r); carrier >= 0) {
        const size_t covered = near_carrier.count(carrier, r);
        result.carrier = set.carriers[size_t(carrier)];
        result.coverage = double(covered) / double(total);
        result.right = atLeastNineTenths(covered, total);
        evidence.assign(total, Evidence::kNone);
        for (const Hit& hit : hits) {
          if (hit.group == carrier && hit.d2_px2 <= rho2[r]) {
            evidence[hit.sample] =
                hit.beside_d2_px2 <= rho2[r] ? Evidence::kBeside : Evidence::kCovered;
          }
        }
        result.merged =
            isMerged(camera, set.normals[size_t(carrier)], samples, evidence, options.rho_px[r]);
      }
      for (const int run : near_run.touched()) {
        if (2 * near_run.count(run, r) >= total) {
          finders[r].emplace_back(int(i), run);
        }
      }
    }
    near_carrier.clear();
    near_run.clear();
    outcome.detection_angle_rad.push_back(endAngle(camera, detections[i].points));
    const std::optional<Vector3d> middle = camera.unproject(samples.points[total / 2]);
    outcome.detection_field_angle_rad.push_back(
        middle ? std::optional(std::atan2(middle->head<2>().norm(), middle->z())) : std::nullopt);
  }
  for (size_t r = 0; r < rhos; ++r) {
    std::sort(finders[r].begin(), finders[r].end());
    const auto end = std::unique(finders[r].begin(), finders[r].end());
    for (auto it = finders[r].begin(); it != end; ++it) {
      ++outcome.runs[r][size_t(it->second)].fragments;
    }
  }
  return outcome;
}

std::vector<bool> coveredByOne(const Camera& camera,
                               const std::vector<DetectionLine>& lines,
                               const std::vector<DetectionLine>& detections,
                               double rho_px,
                               double share) {
  std::vector<Curve> asked, curves;
  std::vector<int> order;
  Bounds bounds;
  for (size_t i = 0; i < lines.size(); ++i) {
    asked.push_back(makeCurve(camera, lines[i].points, "line", i));
    for (const Vector2d& p : lines[i].points) {
      bounds.min = bounds.min.cwiseMin(p);
      bounds.max = bounds.max.cwiseMax(p);
    }
  }
  bounds.min.array() -= 1;
  bounds.max.array() += 1;
  for (size_t i = 0; i < detections.size(); ++i) {
    curves.push_back(makeCurve(camera, detections[i].points, "detection", i));
    order.push_back(int(i));
  }
  const PieceGrid grid(curves, order, bounds, rho_px);
  const std::array rho2{rho_px * rho_px};
  Counters near_detection(detections.size(), 1);
  Samples samples;
  std::vector<bool> covered;
  for (const Curve& line : asked) {
    sampleBetween(line, 0, line.length(), samples);
    for (const Vector2d& p : samples.points) {
      forCurvesNear(grid, p, [&](int detection, double d2, double) {
        near_detection.add(detection, d2, rho2);
      });
    }
    const int best = near_detection.best(0);
    covered.push_back(best >= 0 && double(near_detection.count(best, 0)) >=
                                       share * double(samples.points.size()));
    near_detection.clear();
  }
  return covered;
}

}  // namespace dlsd
