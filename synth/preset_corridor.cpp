// Preset "corridor": long lines that converge ahead and pass the camera to behind it.

#include <algorithm>
#include <array>
#include <cmath>

#include "synth/dataset/random.h"
#include "synth/presets.h"
#include "synth/scene_builder.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

constexpr uint64_t kStream = 0xc0aa;

/// A door in a frame that stands back: two nested pockets, with one to three fields in the leaf.
Pocket drawDoor(double x, double width, double height, Random* random) {
  const Surface frame{random->next(0.2, 0.8), 0}, leaf{random->next(0.15, 0.85), 0};
  Pocket door{x, x + width, 0.03, height, random->next(0.06, 0.15), frame, {leaf, {}}};
  const int fields = random->nextInt(0, 3);
  for (int k = 0; k < fields; ++k) {
    const double step = (height - 0.2) / fields, y = 0.1 + k * step;
    const Surface field{leaf.albedo * random->next(0.75, 1.1), 0};
    door.bottom.pockets.push_back(
        {x + 0.14, x + width - 0.14, y + 0.06, y + step - 0.06, 0.012, leaf, {field, {}}});
  }
  return door;
}

}  // namespace

SceneView makeCorridor(uint64_t seed, uint64_t index) {
  Random random(hashCounters({seed, index}), kStream);
  SceneBuilder builder;
  const double room_height = random.next(2.4, 3.2), room_width = random.next(1.8, 3.2);
  const Vector3d size(random.next(11, 15.5), room_width, room_height);
  std::array<Panel, 4> walls;
  const double paint = random.next(0.4, 0.8);
  const double door_height = random.next(2, 2.15), door_width = random.next(0.8, 1.1);
  for (const size_t k : {size_t{0}, size_t{2}}) {
    walls[k].surface = {paint * random.next(0.9, 1.1), 0};
    const double pitch = door_width + random.next(0.7, 2);
    for (double x = random.next(0.4, 1.5); x + door_width + 0.3 < size.x(); x += pitch) {
      walls[k].pockets.push_back(drawDoor(x, door_width, door_height, &random));
    }
  }
  // A window at one end, a door at the other.
  for (const size_t k : {size_t{1}, size_t{3}}) walls[k].surface = {paint, 0};
  const double middle = size.y() / 2;
  Pocket window{
      middle - 0.6, middle + 0.6, 0.9, 2.1, 0.2, {0.8, 0}, {{0.3, random.next(0.3, 0.6)}, {}}};
  walls[1].pockets.push_back(window);
  walls[3].pockets.push_back(drawDoor(middle - 0.45, 0.9, door_height, &random));
  const Surface floor{random.next(0.2, 0.6), 0};
  const auto faces = builder.addRoom(size, walls, floor, {random.next(0.6, 0.85), 0});

  // Floor: stripes along the walls, and seams across. The face's frame starts in the corner (0, 0).
  const double stripe = random.next(0.03, 0.1), inset = random.next(0.1, 0.3);
  const Surface dark{floor.albedo * random.next(0.3, 0.6), 0};
  for (const double y : {inset, size.y() - inset}) {
    builder.addDecal(
        faces[4].front,
        {DecalShape::kRectangle, {size.x() / 2, y}, {size.x() / 2 - 0.1, stripe / 2}, 0, dark});
  }
  const double tile = random.next(0.4, 0.9), seam = random.next(0.004, 0.012);
  const double half = middle - inset - stripe - 0.02;
  for (double x = tile; x < size.x() - 0.2; x += tile) {
    builder.addDecal(faces[4].front,
                     {DecalShape::kRectangle, {x, middle}, {seam / 2, half}, 0, dark});
  }
  // Lamps in the ceiling; its frame runs along y first.
  const double lamp_pitch = random.next(1.5, 3), lamp_half = random.next(0.2, 0.6);
  for (double x = lamp_pitch; x < size.x() - 1; x += lamp_pitch) {
    builder.addDecal(faces[5].front,
                     {DecalShape::kRectangle, {middle, x}, {0.12, lamp_half}, 0, {0.7, 0.5}});
  }
  // Handrails.
  const Surface metal{random.nextBool(0.5) ? random.next(0.05, 0.2) : random.next(0.6, 0.9), 0};
  const double rail = random.next(0.85, 1), rail_radius = random.next(0.01, 0.025);
  for (const double y : {0.06, size.y() - 0.06}) {
    builder.addRod({0.3, y, rail}, {size.x() - 0.3, y, rail}, rail_radius, 8, metal);
  }

  const double at = size.x() * random.next(0.3, 0.7);
  const int boxes = random.nextInt(3, 8);
  const double slot = (size.x() - 1) / boxes;
  for (int k = 0; k < boxes; ++k) {
    const double length = random.next(0.3, std::min(1.0, slot - 0.1));
    const double x = 0.5 + k * slot, depth = random.next(0.2, 0.45), height = random.next(0.3, 1.8);
    const bool right = random.nextBool(0.5);
    const Surface surface{random.next(0.06, 0.85), 0};
    if (x < at + 0.9 && x + length > at - 0.9) continue;
    const double y = right ? size.y() - 0.12 - depth : 0.12;
    builder.addBox(Frame3(), {x, y, 0}, {x + length, y + depth, height}, surface);
  }
  builder.finish();

  Scene& scene = builder.scene;
  scene.ambient_up = random.next(0.4, 0.6);
  scene.ambient_down = random.next(0.3, 0.45);
  const bool shadows = random.nextBool(0.7);
  for (const double share : {0.28, 0.76}) {
    Light lamp;
    lamp.kind = Light::Kind::kPoint;
    lamp.place = {
        size.x() * share, middle + random.next(-0.2, 0.2), size.z() - random.next(0.1, 0.3)};
    lamp.strength = random.next(0.3, 0.6);
    lamp.half_distance = random.next(1.5, 4);
    lamp.casts_shadows = shadows;
    scene.lights.push_back(lamp);
  }

  const double eye_height = random.next(1.2, 1.8);
  const Vector3d eye(at, size.y() * random.next(0.35, 0.65), eye_height);
  const double turn = random.next(-0.45, 0.45);
  const double yaw = turn + (random.nextBool(0.5) ? M_PI : 0), pitch = random.next(-0.3, 0.2);
  const Vector3d ahead(
      std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
  SceneView view;
  view.pose = lookAt(eye, eye + ahead, random.next(-0.15, 0.15));
  view.scene = std::move(scene);
  return view;
}

}  // namespace dlsd
