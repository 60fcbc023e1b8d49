#pragma once
// For tests: visibility by brute force.

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include "synth/scene.h"

namespace dlsd {

/// Is the point of the edge hidden? Every triangle, sphere and disc is intersected in double;
/// nothing of the label code or of Embree is used.
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
    for (const Disc& disc : scene_.discs) {
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
