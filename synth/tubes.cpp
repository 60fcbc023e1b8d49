#include "synth/tubes.h"

#include <limits>

#include "cameras/mutant.h"
#include "synth/scene_builder.h"

namespace dlsd {

using Eigen::Vector3d;

namespace {

/// Real roots of a t^2 + b t + c.
void addQuadraticRoots(double a, double b, double c, std::vector<double>* roots) {
  const double disc = b * b - 4 * a * c;
  if (!(disc >= 0)) return;
  // Neither of the two loses digits.
  const double q = -0.5 * (b + std::copysign(std::sqrt(disc), b));
  if (a != 0) roots->push_back(q / a);
  if (q != 0) roots->push_back(c / q);
}

/// Real roots of a t^3 + b t^2 + c t + d, a > 0: F. Viete's trigonometric form, or G. Cardano's.
struct CubicRoots {
  std::array<double, 3> t;
  size_t count;
};
CubicRoots cubicRoots(double a, double b, double c, double d) {
  const double shift = -b / (3 * a);
  const double p = (c - b * b / (3 * a)) / a;
  const double q = (2 * b * b * b / (27 * a * a) - b * c / (3 * a) + d) / a;
  const double disc = q * q / 4 + p * p * p / 27;
  if (disc > 0) {
    const double u = std::cbrt(-q / 2 - std::copysign(std::sqrt(disc), q));
    return {{u - (u != 0 ? p / (3 * u) : 0) + shift, 0, 0}, 1};
  }
  const double r = std::sqrt(-p / 3);
  const double cosine = r > 0 ? std::clamp(-q / (2 * r * r * r), -1.0, 1.0) : 1;
  const double angle = std::acos(cosine) / 3;
  CubicRoots roots{{}, 3};
  for (size_t k = 0; k < 3; ++k) {
    roots.t[k] = 2 * r * std::cos(angle - 2 * M_PI * static_cast<double>(k) / 3) + shift;
  }
  return roots;
}

}  // namespace

std::array<double, 2> spineRange(const Tube& tube) {
  return tube.kind == Tube::Kind::kRing ? std::array{-M_PI, M_PI} : std::array{-1.0, 1.0};
}

Vector3d spineAt(const Tube& tube, double t) {
  return tube.kind == Tube::Kind::kRing
             ? Vector3d(tube.centre + std::cos(t) * tube.x + std::sin(t) * tube.y)
             : Vector3d(tube.centre + t * tube.x + t * t * tube.y);
}

Vector3d spineTangent(const Tube& tube, double t) {
  return tube.kind == Tube::Kind::kRing ? Vector3d(-std::sin(t) * tube.x + std::cos(t) * tube.y)
                                        : Vector3d(tube.x + 2 * t * tube.y);
}

double nearestOnSpine(const Tube& tube, const Vector3d& p) {
  const Vector3d d = p - tube.centre;
  if (tube.kind == Tube::Kind::kRing) return std::atan2(d.dot(tube.y), d.dot(tube.x));
  // (d - t x - t^2 y) . (x + 2 t y) = 0
  const double xx = tube.x.squaredNorm(), xy = tube.x.dot(tube.y), yy = tube.y.squaredNorm();
  const double dx = d.dot(tube.x), dy = d.dot(tube.y);
  const CubicRoots roots = cubicRoots(2 * yy, 3 * xy, xx - 2 * dy, -dx);
  double best = -1, best_distance2 = std::numeric_limits<double>::infinity();
  const auto consider = [&](double t) {
    const double distance2 = (d - t * tube.x - t * t * tube.y).squaredNorm();
    if (!(distance2 < best_distance2)) return;
    best = t;
    best_distance2 = distance2;
  };
  consider(-1);
  consider(1);
  for (size_t k = 0; k < roots.count; ++k) consider(std::clamp(roots.t[k], -1.0, 1.0));
  return best;
}

namespace {

/// The nearest point of the spine.
Vector3d spineBeside(const Tube& tube, const Vector3d& p) {
  if (tube.kind != Tube::Kind::kRing) return spineAt(tube, nearestOnSpine(tube, p));
  // Without the angle, which would cost most of a ray's time.
  const Vector3d d = p - tube.centre;
  const double x = d.dot(tube.x), y = d.dot(tube.y), r = std::sqrt(x * x + y * y);
  return r > 0 ? Vector3d(tube.centre + x / r * tube.x + y / r * tube.y)
               : Vector3d(tube.centre + tube.x);
}

}  // namespace

Tube transformed(const Tube& tube, const Eigen::Matrix3d& rotation, const Vector3d& origin) {
  Tube out = tube;
  out.centre = rotation * (tube.centre - origin);
  out.x = rotation * tube.x;
  out.y = rotation * tube.y;
  return out;
}

std::vector<Eigen::AlignedBox3d> boxesOf(const Tube& tube, int pieces) {
  const auto [t0, t1] = spineRange(tube);
  std::vector<Eigen::AlignedBox3d> boxes;
  const double step = (t1 - t0) / pieces;
  // A curve is at most step^2 / 8 times its second derivative off its chord.
  const double bend = (tube.kind == Tube::Kind::kRing ? tube.x.norm() : 2 * tube.y.norm());
  const double sagitta = DLSD_MUTANT("tube-boxes") ? 0 : bend * step * step / 8;
  const Vector3d margin = Vector3d::Constant(tube.radius + sagitta + 1e-5);
  for (int k = 0; k < pieces; ++k) {
    Eigen::AlignedBox3d box(spineAt(tube, t0 + k * step));
    box.extend(spineAt(tube, t0 + (k + 1) * step));
    boxes.emplace_back(box.min() - margin, box.max() + margin);
  }
  return boxes;
}

std::optional<double> enterTube(
    const Tube& tube, const Vector3d& origin, const Vector3d& direction, double near, double far) {
  constexpr double kTouch = 1e-7;
  constexpr int kMaxSteps = 2000;  // Rays that pass within 1e-6 radii take some hundred.
  const double length = direction.norm();
  double s = near;
  for (int k = 0; k < kMaxSteps && s < far; ++k) {
    const Vector3d p = origin + s * direction;
    const double radius = tube.radius * (DLSD_MUTANT("tube-entry") ? 0.999 : 1);
    const double distance = (p - spineBeside(tube, p)).norm() - radius;
    if (distance < kTouch) return s > near ? std::optional(s) : std::nullopt;
    s += distance / length;
  }
  return std::nullopt;
}

std::vector<std::vector<Vector3d>> outlineOf(const Tube& tube, const Vector3d& eye, int pieces) {
  std::vector<std::vector<Vector3d>> curves;
  const auto [t0, t1] = spineRange(tube);
  for (const double side : {-1.0, 1.0}) {
    curves.emplace_back();
    for (int k = 0; k <= pieces; ++k) {
      const double t = t0 + (t1 - t0) * k / pieces;
      const Vector3d centre = spineAt(tube, t), tangent = spineTangent(tube, t).normalized();
      const Vector3d to_eye = eye - centre, square = to_eye - tangent * tangent.dot(to_eye);
      const double cosine = tube.radius / square.norm();
      if (!(cosine < 1)) {
        // Seen along the tube: no line of sight touches it here.
        if (!curves.back().empty()) curves.emplace_back();
        continue;
      }
      const Vector3d u = square.normalized(), v = tangent.cross(u);
      curves.back().push_back(
          centre + tube.radius * (cosine * u + side * std::sqrt(1 - cosine * cosine) * v));
    }
  }
  if (tube.kind == Tube::Kind::kString) {
    for (const double t : {t0, t1}) {
      const Vector3d centre = spineAt(tube, t), to_eye = eye - centre;
      const double cosine = tube.radius / to_eye.norm();
      if (!(cosine < 1)) continue;
      const Vector3d u = to_eye.normalized(), v = u.unitOrthogonal(), w = u.cross(v);
      const double radius = tube.radius * std::sqrt(1 - cosine * cosine);
      curves.emplace_back();
      for (int k = 0; k <= pieces; ++k) {
        const double phi = 2 * M_PI * k / pieces;
        curves.back().push_back(centre + tube.radius * cosine * u +
                                radius * (std::cos(phi) * v + std::sin(phi) * w));
      }
    }
  }
  return curves;
}

std::vector<std::array<double, 2>> spineNearPlane(const Tube& tube,
                                                  const Vector3d& normal,
                                                  double height) {
  const double h = normal.dot(tube.centre) - height;
  const double nx = normal.dot(tube.x), ny = normal.dot(tube.y), r = tube.radius;
  std::vector<std::array<double, 2>> ranges;
  if (tube.kind == Tube::Kind::kRing) {
    // |h + swing cos(t - turn)| <= r
    const double swing = std::hypot(nx, ny), turn = std::atan2(ny, nx);
    if (std::abs(h) > swing + r) return ranges;
    const double a = std::acos(std::clamp((r - h) / swing, -1.0, 1.0));
    const double b = std::acos(std::clamp((-r - h) / swing, -1.0, 1.0));
    if (a == 0) return {{turn - b, turn + b}};
    if (b == M_PI) return {{turn + a, turn + 2 * M_PI - a}};
    return {{turn + a, turn + b}, {turn - b, turn - a}};
  }
  std::vector<double> cuts;
  addQuadraticRoots(ny, nx, h - r, &cuts);
  addQuadraticRoots(ny, nx, h + r, &cuts);
  std::erase_if(cuts, [](double t) { return !(t > -1 && t < 1); });
  cuts.push_back(-1);
  cuts.push_back(1);
  std::sort(cuts.begin(), cuts.end());
  for (size_t k = 0; k + 1 < cuts.size(); ++k) {
    const double t = (cuts[k] + cuts[k + 1]) / 2;
    if (std::abs(h + nx * t + ny * t * t) <= r) ranges.push_back({cuts[k], cuts[k + 1]});
  }
  return ranges;
}

std::optional<double> enterCylinder(
    const Rod& rod, const Vector3d& origin, const Vector3d& direction, double near, double far) {
  const Vector3d axis = (rod.to - rod.from).normalized(), m = origin - rod.from;
  const double along_m = axis.dot(m), along_d = axis.dot(direction);
  const Vector3d mp = m - axis * along_m, dp = direction - axis * along_d;
  const double a = dp.squaredNorm(), b = dp.dot(mp), c = mp.squaredNorm() - rod.radius * rod.radius;
  const double disc = b * b - a * c;
  if (!(disc > 0) || !(a > 0)) return std::nullopt;
  const double s = (-b - std::sqrt(disc)) / a, along = along_m + s * along_d;
  if (!(s > near && s < far) || along < 0 || along > (rod.to - rod.from).norm()) {
    return std::nullopt;
  }
  return s;
}

Eigen::AlignedBox3d boxOf(const Rod& rod) {
  const Vector3d margin = Vector3d::Constant(rod.radius + 1e-5);
  Eigen::AlignedBox3d box(rod.from);
  box.extend(rod.to);
  return {box.min() - margin, box.max() + margin};
}

namespace {

/// Lines along the rod's surface, moved by u + v and u - v; the upper one first, which neither
/// turning about the vertical nor mirroring changes.
std::vector<std::array<Vector3d, 2>> sidesAt(const Rod& rod, const Vector3d& u, const Vector3d& v) {
  const Vector3d up = v.z() < 0 ? Vector3d(-v) : v;
  return {{rod.from + u + up, rod.to + u + up}, {rod.from + u - up, rod.to + u - up}};
}

}  // namespace

std::vector<std::array<Vector3d, 2>> sidesFrom(const Rod& rod, const Vector3d& eye) {
  const Vector3d axis = (rod.to - rod.from).normalized(), m = eye - rod.from;
  const Vector3d square = m - axis * axis.dot(m);
  const double cosine = rod.radius / square.norm();
  if (!(cosine < 1)) return {};
  const Vector3d u = square.normalized() * (rod.radius * cosine);
  const Vector3d v =
      axis.cross(square.normalized()) * (rod.radius * std::sqrt(1 - cosine * cosine));
  return sidesAt(rod, u, v);
}

std::vector<std::array<Vector3d, 2>> sidesFromSun(const Rod& rod, const Vector3d& direction) {
  const Vector3d across = (rod.to - rod.from).normalized().cross(direction);
  if (!(across.norm() > 1e-9)) return {};
  const Vector3d v = across.normalized() * rod.radius;
  return sidesAt(rod, Vector3d::Zero(), v);
}

void addRodSides(const Vector3d& eye, Scene* scene) {
  const size_t before = scene->edges.size();
  for (size_t k = 0; k < scene->rods.size(); ++k) {
    if (!scene->rods[k].isRound()) continue;
    for (const auto& [from, to] : sidesFrom(scene->rods[k], eye)) {
      Edge edge;
      edge.from = from;
      edge.to = to;
      edge.source = EdgeSource::kRodSide;
      edge.rod = static_cast<int>(k);
      scene->edges.push_back(edge);
    }
  }
  if (scene->edges.size() > before) numberCarriers(&scene->edges);
}

}  // namespace dlsd
