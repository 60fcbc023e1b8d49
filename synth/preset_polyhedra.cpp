// Preset "polyhedra": random solids in the open, inside a hall so large that its walls are a plain
// background.

#include <array>
#include <cmath>
#include <vector>

#include "synth/dataset/random.h"
#include "synth/presets.h"
#include "synth/random_shapes.h"
#include "synth/scene_builder.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

constexpr uint64_t kStream = 0x901a;

struct Shape {
  std::vector<Vector3d> vertices;
  std::vector<std::vector<int>> loops;

  /// Moves and scales it so that its bounding box fits the unit sphere.
  void fitUnitSphere() {
    Vector3d lo = vertices.front(), hi = lo;
    for (const Vector3d& v : vertices) {
      lo = lo.cwiseMin(v);
      hi = hi.cwiseMax(v);
    }
    for (Vector3d& v : vertices) v = (2 * v - lo - hi) / (hi - lo).norm();
  }
};

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

Shape drawShape(Random* random) {
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

/// What a solid covers of the view.
struct Cone {
  Vector3d direction;
  double angle_rad;
  double near_m, far_m;
};

}  // namespace

SceneView makePolyhedra(uint64_t seed, uint64_t index) {
  Random random(hashCounters({seed, index}), kStream);
  SceneBuilder builder;
  const Vector3d hall(16, 16, 16);
  std::array<Panel, 4> walls;
  const double sky = random.next(0.15, 0.9);
  for (Panel& wall : walls) wall.surface = {sky * random.next(0.8, 1.2), 0};
  builder.addRoom(hall, walls, {random.next(0.1, 0.6), 0}, {sky * random.next(0.8, 1.2), 0});

  const Vector3d eye = drawEyeNear(hall / 2, &random);
  std::vector<Cone> cones;
  constexpr int kTries = 60;
  for (int k = 0; k < kTries; ++k) {
    // Every try takes the same number of draws up to here, whether it finds a place or not.
    Random own(random.bits(static_cast<uint64_t>(1000 + k)), kStream);
    Cone cone{drawDirection(&own), own.next(4, 18) * M_PI / 180, 0, 0};
    const double distance = own.next(1, 5.5);
    const double radius = distance * std::sin(cone.angle_rad);
    cone.near_m = distance - radius;
    cone.far_m = distance + radius;
    const bool may_overlap = own.nextBool(0.15);
    bool free = true;
    for (const Cone& other : cones) {
      const double gap_rad = std::acos(std::clamp(cone.direction.dot(other.direction), -1.0, 1.0)) -
                             cone.angle_rad - other.angle_rad;
      // Behind one another is apart in space, too.
      const bool behind = cone.near_m > other.far_m || other.near_m > cone.far_m;
      if (gap_rad < 0.04 && !(may_overlap && behind)) free = false;
    }
    if (!free) continue;
    cones.push_back(cone);

    Shape shape = drawShape(&own);
    shape.fitUnitSphere();
    for (Vector3d& v : shape.vertices) v *= radius;
    const Frame3 frame{eye + cone.direction * distance, drawRotation(&own)};
    const double albedo = own.next(0.15, 0.85);
    std::vector<Surface> surfaces;
    for (size_t i = 0; i < shape.loops.size(); ++i) {
      surfaces.push_back({std::clamp(albedo * own.next(0.5, 1.5), 0.03, 0.95), 0});
    }
    builder.addSolid(frame, shape.vertices, shape.loops, surfaces);
  }
  return viewUnderSun(&builder, eye, {0.35, 0.55}, {0.4, 0.8}, &random);
}

}  // namespace dlsd
