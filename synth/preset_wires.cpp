// Preset "wires": free-standing wireframes of random polyhedra inside a hall so large that its
// walls are a plain background.

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

constexpr uint64_t kStream = 0x317e;

struct Wireframe {
  std::vector<Vector3d> nodes;
  std::vector<std::array<size_t, 2>> links;
};

/// Corners and edges of a prism, a pyramid or a double pyramid in the unit sphere.
Wireframe drawWireframe(Random* random) {
  Wireframe frame;
  const auto n = static_cast<size_t>(random->nextInt(3, 6));
  const double half_height = random->next(0.35, 0.8);
  const double radius = std::sqrt(1 - half_height * half_height);
  const auto addRing = [&](double z, double r) {
    const size_t first = frame.nodes.size();
    for (size_t i = 0; i < n; ++i) {
      const double a = 2 * M_PI * static_cast<double>(i) / static_cast<double>(n);
      frame.nodes.emplace_back(r * std::cos(a), r * std::sin(a), z);
      frame.links.push_back({first + i, first + (i + 1) % n});
    }
  };
  const auto addApex = [&](double z) {
    frame.nodes.emplace_back(0, 0, z);
    for (size_t i = 0; i < n; ++i) frame.links.push_back({i, frame.nodes.size() - 1});
  };
  const double kind = random->next(0, 1);
  if (kind < 0.5) {
    addRing(-half_height, radius);
    addRing(half_height, radius * random->next(0.5, 1));
    for (size_t i = 0; i < n; ++i) frame.links.push_back({i, n + i});
  } else if (kind < 0.75) {
    addRing(-half_height, radius);
    addApex(half_height);
  } else {
    addRing(0, radius);
    addApex(half_height);
    addApex(-half_height);
  }
  return frame;
}

struct Ball {
  Vector3d centre;
  double radius;
};

}  // namespace

SceneView makeWires(uint64_t seed, uint64_t index) {
  Random random(hashCounters({seed, index}), kStream);
  SceneBuilder builder;
  const Vector3d hall(16, 16, 16);
  // Dark wires before a bright hall, or the other way round.
  const bool dark_hall = random.nextBool(0.4);
  const double wall = dark_hall ? random.next(0.05, 0.2) : random.next(0.5, 0.9);
  std::array<Panel, 4> walls;
  for (Panel& panel : walls) panel.surface = {wall * random.next(0.8, 1.1), 0};
  const Surface ceiling{wall * random.next(0.8, 1.1), 0};
  builder.addRoom(hall, walls, {wall * random.next(0.6, 1), 0}, ceiling);

  const Vector3d eye = drawEyeNear(hall / 2, &random);
  std::vector<Ball> balls;
  constexpr int kTries = 40;
  for (int k = 0; k < kTries; ++k) {
    // Every try takes the same number of draws from `random`, whether it finds a place or not.
    Random own(random.bits(static_cast<uint64_t>(1000 + k)), kStream);
    const double distance = own.next(0.8, 5);
    const Ball ball{eye + distance * drawDirection(&own), distance * std::sin(own.next(0.1, 0.4))};
    bool free = distance - ball.radius > 0.4;
    for (const Ball& other : balls) {
      free = free && (ball.centre - other.centre).norm() > ball.radius + other.radius + 0.02;
    }
    if (!free) continue;
    balls.push_back(ball);
    const double radius = distance * own.next(0.0006, 0.004);
    const Frame3 frame{ball.centre, drawRotation(&own)};
    Wireframe wires = drawWireframe(&own);
    for (Vector3d& node : wires.nodes) {
      node = frame.at(
          node.x() * 0.9 * ball.radius, node.y() * 0.9 * ball.radius, node.z() * 0.9 * ball.radius);
    }
    const double albedo = dark_hall ? own.next(0.4, 0.95) : own.next(0.02, 0.25);
    builder.addJointedRods(wires.nodes, wires.links, radius, {albedo, 0});
  }
  return viewUnderSun(&builder, eye, {0.4, 0.6}, {0.3, 0.6}, &random);
}

}  // namespace dlsd
