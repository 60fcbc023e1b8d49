#pragma once
// For tests: visibility by brute force.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "synth/scene.h"
#include "synth/tubes.h"

namespace dlsd {

/// Whether the segment from a point along d comes nearer to a round rod's axis than its radius,
/// between the caps.
[[nodiscard]] inline bool meetsCylinder(const Rod& rod,
                                        const Eigen::Vector3d& from,
                                        const Eigen::Vector3d& d) {
  const Eigen::Vector3d axis = (rod.to - rod.from).normalized(), m = from - rod.from;
  const double length = (rod.to - rod.from).norm();
  // Distance from the axis along the segment is convex: its least value by ternary search within
  // the slab between the caps.
  double lo = 0, hi = 1;
  const double a0 = axis.dot(m), slope = axis.dot(d);
  if (slope != 0) {
    const double s0 = -a0 / slope, s1 = (length - a0) / slope;
    lo = std::max(lo, std::min(s0, s1));
    hi = std::min(hi, std::max(s0, s1));
  } else if (a0 < 0 || a0 > length) {
    return false;
  }
  const auto distance = [&](double s) { return axis.cross(m + s * d).norm(); };
  for (int k = 0; k < 100 && lo < hi; ++k) {
    const double p = lo + (hi - lo) / 3, q = hi - (hi - lo) / 3;
    if (distance(p) < distance(q)) {
      hi = q;
    } else {
      lo = p;
    }
  }
  return lo <= hi && distance((lo + hi) / 2) < rod.radius;
}

/// Whether the segment from a point along d meets any of a tube's balls: least distance of 600
/// spine points, refined.
[[nodiscard]] inline bool meetsTube(const Tube& tube,
                                    const Eigen::Vector3d& from,
                                    const Eigen::Vector3d& d) {
  const auto distance = [&](double t) {
    const Eigen::Vector3d m = spineAt(tube, t) - from;
    const double s = std::clamp(m.dot(d) / d.squaredNorm(), 0.0, 1.0);
    return (m - s * d).norm();
  };
  const auto [t0, t1] = spineRange(tube);
  constexpr int kSteps = 600;
  const double step = (t1 - t0) / kSteps;
  const double reach = step * (tube.x.norm() + 2 * tube.y.norm());
  for (int k = 0; k <= kSteps; ++k) {
    if (distance(t0 + k * step) > tube.radius + reach) continue;
    double lo = std::max(t0, t0 + (k - 1) * step), hi = std::min(t1, t0 + (k + 1) * step);
    for (int i = 0; i < 60; ++i) {
      const double p = lo + (hi - lo) / 3, q = hi - (hi - lo) / 3;
      if (distance(p) < distance(q)) {
        hi = q;
      } else {
        lo = p;
      }
    }
    if (distance((lo + hi) / 2) < tube.radius) return true;
  }
  return false;
}

/// Is the point of the edge hidden? Every triangle, sphere, disc, tube and cylinder is intersected
/// in double; nothing of the label code or of Embree is used, of tubes.h only the spine.
class VisibilityOracle {
 public:
  VisibilityOracle(const Scene& scene, const Eigen::Vector3d& eye) : scene_(scene), eye_(eye) {
    for (const Triangle& t : scene.triangles) {
      Corners c;
      for (size_t k = 0; k < 3; ++k) {
        c.p[k] = scene.vertices[static_cast<size_t>(t.vertices[k])].cast<double>();
      }
      c.face = t.face;
      triangles_.push_back(c);
    }
  }

  [[nodiscard]] bool hidden(const Edge& edge, const Eigen::Vector3d& point) const {
    const Eigen::Vector3d d = point - eye_;
    constexpr double kBefore = 1 - 1e-8;
    for (const Corners& t : triangles_) {
      if (edge.source == EdgeSource::kRodCentre) {
        const Rod& rod = scene_.rods[static_cast<size_t>(edge.rod)];
        if (t.face >= rod.first_face && t.face < rod.first_face + rod.face_count) continue;
      }
      // Signed volumes: the segment goes through the triangle iff all three have one sign.
      const Eigen::Vector3d a = t.p[0] - eye_, b = t.p[1] - eye_, c = t.p[2] - eye_;
      const double u = d.dot(a.cross(b)), v = d.dot(b.cross(c)), w = d.dot(c.cross(a));
      if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0))) continue;
      const double s = a.dot(b.cross(c)) / (u + v + w);
      if (!(s > 0 && s < kBefore)) continue;
      const Eigen::Vector3d n = (t.p[1] - t.p[0]).cross(t.p[2] - t.p[0]).normalized();
      const bool in_plane =
          std::abs(n.dot(edge.from - t.p[0])) < 5e-6 && std::abs(n.dot(edge.to - t.p[0])) < 5e-6;
      if (!in_plane) return true;
    }
    for (const Sphere& sphere : scene_.spheres) {
      const Eigen::Vector3d m = eye_ - sphere.centre.cast<double>();
      const double r = static_cast<double>(sphere.radius);
      const double a = d.squaredNorm(), b = m.dot(d), c = m.squaredNorm() - r * r;
      const double disc = b * b - a * c;
      if (disc <= 0) continue;
      const double s = (-b - std::sqrt(disc)) / a;
      if (s > 0 && s < kBefore) return true;
    }
    for (size_t k = 0; k < scene_.rods.size(); ++k) {
      const Rod& rod = scene_.rods[k];
      if (!rod.isRound()) continue;
      // Nor does a cylinder hide the side of its cap that looks at the eye. The cap is of floats,
      // which may put it into the cylinder.
      const bool on_cap = edge.disc == rod.first_disc || edge.disc == rod.first_disc + 1;
      const bool own = isOwnRound(edge, static_cast<int>(k)) || on_cap;
      if (!own && meetsCylinder(rod, eye_, d * kBefore)) return true;
    }
    for (const Tube& tube : scene_.tubes) {
      if (meetsTube(tube, eye_, d * kBefore)) return true;
    }
    for (size_t k = 0; k < scene_.discs.size(); ++k) {
      const Disc& disc = scene_.discs[k];
      if (isOwnCap(edge, static_cast<int>(k)) || static_cast<int>(k) == edge.disc) continue;
      const Eigen::Vector3d n = disc.normal.cast<double>(), centre = disc.centre.cast<double>();
      const double s = n.dot(centre - eye_) / n.dot(d);
      if (s > 0 && s < kBefore &&
          (eye_ + s * d - centre).norm() < static_cast<double>(disc.radius)) {
        return true;
      }
    }
    return false;
  }

 private:
  [[nodiscard]] static bool isOwnRound(const Edge& edge, int rod) {
    return edge.rod == rod &&
           (edge.source == EdgeSource::kRodCentre || edge.source == EdgeSource::kRodSide);
  }
  [[nodiscard]] bool isOwnCap(const Edge& edge, int disc) const {
    if (!isOwnRound(edge, edge.rod) || edge.rod < 0) return false;
    const Rod& rod = scene_.rods[static_cast<size_t>(edge.rod)];
    return rod.isRound() && (disc == rod.first_disc || disc == rod.first_disc + 1);
  }

  struct Corners {
    std::array<Eigen::Vector3d, 3> p;
    int face = 0;
  };
  const Scene& scene_;
  Eigen::Vector3d eye_;
  std::vector<Corners> triangles_;
};

inline bool looksAway(const Scene& scene, const Edge& edge, const Eigen::Vector3d& eye) {
  if (edge.source == EdgeSource::kRodCentre) return false;
  if (edge.source == EdgeSource::kRodSide) return edge.light >= 0;
  if (edge.disc >= 0) {
    const Disc& disc = scene.discs[static_cast<size_t>(edge.disc)];
    const Light& light = scene.lights[static_cast<size_t>(edge.light)];
    const Eigen::Vector3d normal = disc.normal.cast<double>(), centre = disc.centre.cast<double>();
    const Eigen::Vector3d to_light =
        light.kind == Light::Kind::kSun ? light.place : Eigen::Vector3d(light.place - centre);
    return normal.dot(eye - centre) * normal.dot(to_light) <= 0;
  }
  bool away = true;
  for (const int f : {edge.face0, edge.face1}) {
    if (f < 0) continue;
    const Face& face = scene.faces[static_cast<size_t>(f)];
    away = away && face.normal.dot(eye - face.origin) <= 0;
  }
  return away;
}

/// Angle from `a` to `b`, accurate for small ones.
inline double angleTo(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace dlsd
