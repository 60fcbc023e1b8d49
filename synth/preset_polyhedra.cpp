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
  const Surface ceiling{sky * random.next(0.8, 1.2), 0};
  builder.addRoom(hall, walls, {random.next(0.1, 0.6), 0}, ceiling);

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

    addRandomSolid(drawShape(&own), eye + cone.direction * distance, radius, &own, &builder);
  }
  return viewUnderSun(&builder, eye, {0.35, 0.55}, {0.4, 0.8}, &random);
}

}  // namespace dlsd
