#include "synth/random_shapes.h"

#include <algorithm>

namespace dlsd {

using Eigen::Vector3d;

void Shape::fitUnitSphere() {
  Vector3d lo = vertices.front(), hi = lo;
  for (const Vector3d& v : vertices) {
    lo = lo.cwiseMin(v);
    hi = hi.cwiseMax(v);
  }
  for (Vector3d& v : vertices) v = (2 * v - lo - hi) / (hi - lo).norm();
}

double Shape::longestEdge() const {
  double longest = 0;
  for (const std::vector<int>& loop : loops) {
    for (size_t i = 0; i < loop.size(); ++i) {
      const Vector3d& a = vertices[static_cast<size_t>(loop[i])];
      const Vector3d& b = vertices[static_cast<size_t>(loop[(i + 1) % loop.size()])];
      longest = std::max(longest, (a - b).norm());
    }
  }
  return longest;
}

namespace {

/// Prism over a polygon (counter-clockwise from +z), which is seen whole from its first corner.
Shape prism(const std::vector<Eigen::Vector2d>& base, double half_height) {
  Shape shape;
  const int n = static_cast<int>(base.size());
  std::vector<int> top, bottom;
  for (const double z : {-half_height, half_height}) {
    for (const Eigen::Vector2d& p : base) shape.vertices.emplace_back(p.x(), p.y(), z);
  }
  for (int i = 0; i < n; ++i) {
    const int next = (i + 1) % n;
    top.push_back(n + i);
    bottom.push_back((n - i) % n);  // The other way round, from the same corner.
    shape.loops.push_back({i, next, n + next, n + i});
  }
  shape.loops.push_back(top);
  shape.loops.push_back(bottom);
  return shape;
}

/// Pyramid over a regular polygon.
Shape pyramid(int n, double half_height) {
  Shape shape;
  std::vector<int> bottom;
  const double radius = std::sqrt(1 - half_height * half_height);
  for (int i = 0; i < n; ++i) {
    const double a = 2 * M_PI * i / n;
    shape.vertices.emplace_back(radius * std::cos(a), radius * std::sin(a), -half_height);
    shape.loops.push_back({i, (i + 1) % n, n});
    bottom.push_back((n - i) % n);
  }
  shape.vertices.emplace_back(0, 0, half_height);
  shape.loops.push_back(bottom);
  return shape;
}

Shape drawAnyShape(Random* random) {
  const double kind = random->next(0, 1);
  if (kind < 0.55) {  // Box.
    Vector3d half{random->next(0.35, 1), random->next(0.35, 1), random->next(0.35, 1)};
    half.normalize();
    const double x = half.x(), y = half.y();
    return prism({{-x, -y}, {x, -y}, {x, y}, {-x, y}}, half.z());
  }
  if (kind < 0.7) {  // L-shaped block; its first corner is the inner one.
    const double x = random->next(0.1, 0.3), y = random->next(0.1, 0.3);
    const double outer = 0.6, z = random->next(0.2, 0.5);
    return prism(
        {{-x, -y}, {outer, -y}, {outer, outer}, {-outer, outer}, {-outer, -outer}, {-x, -outer}},
        z);
  }
  const double z = random->next(0.4, 0.75);
  if (kind < 0.85) {
    const int n = random->nextInt(0, 2) == 0 ? 3 : random->nextInt(5, 6);
    const double radius = std::sqrt(1 - z * z);
    std::vector<Eigen::Vector2d> base;
    for (int i = 0; i < n; ++i) {
      base.emplace_back(radius * std::cos(2 * M_PI * i / n), radius * std::sin(2 * M_PI * i / n));
    }
    return prism(base, z);
  }
  return pyramid(random->nextInt(3, 5), z);
}

}  // namespace

Shape drawShape(Random* random) {
  Shape shape = drawAnyShape(random);
  shape.fitUnitSphere();
  return shape;
}

void addRandomSolid(
    Shape shape, const Vector3d& centre, double radius, Random* random, SceneBuilder* builder) {
  for (Vector3d& v : shape.vertices) v *= radius;
  const Frame3 frame{centre, drawRotation(random)};
  const double albedo = random->next(0.15, 0.85);
  std::vector<Surface> surfaces;
  for (size_t i = 0; i < shape.loops.size(); ++i) {
    surfaces.push_back({std::clamp(albedo * random->next(0.5, 1.5), 0.03, 0.95), 0});
  }
  builder->addSolid(frame, shape.vertices, shape.loops, surfaces);
}

}  // namespace dlsd
