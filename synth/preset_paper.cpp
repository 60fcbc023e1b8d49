// Preset "paper": the paper's test sequence (TUM mono `wide_whitePaper`) as a scene: two white
// sheets on a dark table, a camera that moves around and tilts, 10 frames a second.

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "synth/dataset/random.h"
#include "synth/presets.h"
#include "synth/scene_builder.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr uint64_t kSceneStream = 0x9a9e5;
constexpr uint64_t kPathStream = 0x9a7;
constexpr double kFramesPerSecond = 10;

struct Table {
  Vector3d lo, hi;                 ///< Of its top board.
  std::array<Vector3d, 2> sheets;  ///< Centres.
};

Table addScene(uint64_t seed, SceneBuilder* builder) {
  Random random(seed, kSceneStream);
  const auto dark = [&] { return Surface{random.next(0.05, 0.12), 0}; };
  const Vector3d room(6, 5, 2.8);
  std::array<Panel, 4> walls;
  for (Panel& wall : walls) wall.surface = {random.next(0.14, 0.28), 0};
  builder->addRoom(room, walls, {random.next(0.08, 0.16), 0}, {0.3, 0});

  Table table;
  const double width = random.next(1.6, 2.2), depth = random.next(0.9, 1.2), height = 0.74;
  table.lo = {room.x() / 2 - width / 2, room.y() / 2 - depth / 2, height - 0.03};
  table.hi = {room.x() / 2 + width / 2, room.y() / 2 + depth / 2, height};
  const Frame3 world;
  const Surface wood = dark();
  const SlabFaces board = builder->addBox(world, table.lo, table.hi, wood);
  for (const double x : {table.lo.x() + 0.03, table.hi.x() - 0.09}) {
    for (const double y : {table.lo.y() + 0.03, table.hi.y() - 0.09}) {
      builder->addBox(world, {x, y, 0}, {x + 0.06, y + 0.06, height - 0.03}, dark());
    }
  }

  // A4 sheets side by side, each a little turned. The top's 2D frame: x to the right, y to the
  // back.
  const Vector2d middle(width / 2, depth / 2);
  for (size_t k = 0; k < 2; ++k) {
    const double side = k == 0 ? -1 : 1;
    const Vector2d centre =
        middle + Vector2d{side * random.next(0.17, 0.21), random.next(-0.06, 0.06)};
    builder->addDecal(board.top,
                      {DecalShape::kRectangle,
                       centre,
                       {0.105, 0.1485},
                       random.next(-0.25, 0.25),
                       {random.next(0.84, 0.9), 0}});
    table.sheets[k] = table.lo + Vector3d(centre.x(), centre.y(), 0.03);
  }

  // Faint clutter near the table's ends.
  const auto clutter = [&](double x0, double x1, double y0, double y1, double h) {
    const Surface s{wood.albedo * random.next(1.1, 1.7), 0};
    builder->addBox(world,
                    {table.lo.x() + x0, table.lo.y() + y0, height},
                    {table.lo.x() + x1, table.lo.y() + y1, height + h},
                    s);
  };
  clutter(0.08, 0.3, 0.1, 0.25, random.next(0.03, 0.12));
  clutter(0.1, 0.24, depth - 0.3, depth - 0.1, random.next(0.02, 0.2));
  clutter(width - 0.32, width - 0.06, depth - 0.25, depth - 0.08, random.next(0.02, 0.06));
  // And around it.
  for (int k = 0; k < 4; ++k) {
    const double w = random.next(0.5, 1.2), h = random.next(0.5, 1.9);
    const double x = k % 2 == 0 ? 0.1 : room.x() - w - 0.1;
    const double y = k / 2 == 0 ? 0.1 : room.y() - 0.5;
    builder->addBox(world, {x, y, 0}, {x + w, y + 0.4, h}, {random.next(0.08, 0.25), 0});
  }

  Scene& scene = builder->scene;
  scene.ambient_up = random.next(0.5, 0.6);
  scene.ambient_down = 0.3;
  Light lamp;
  lamp.kind = Light::Kind::kPoint;
  lamp.place = {room.x() / 2 + random.next(-1, 1), room.y() / 2 + random.next(-1, 1), 2.6};
  lamp.strength = random.next(0.45, 0.55);
  lamp.half_distance = 4;
  scene.lights.push_back(lamp);
  return table;
}

/// Smooth in time: sums of two slow waves with random phases, in [-1, 1].
class Waves {
 public:
  explicit Waves(uint64_t seed) : random_(seed, kPathStream) {}
  double at(double seconds, double slowest_period_s) {
    const double p1 = slowest_period_s * random_.next(0.8, 1.2);
    const double p2 = slowest_period_s * random_.next(0.3, 0.5);
    const double a = random_.next(0, 2 * M_PI), b = random_.next(0, 2 * M_PI);
    return 0.7 * std::sin(2 * M_PI * seconds / p1 + a) +
           0.3 * std::sin(2 * M_PI * seconds / p2 + b);
  }

 private:
  Random random_;
};

}  // namespace

SceneView makePaper(uint64_t seed, uint64_t index) {
  SceneBuilder builder;
  const Table table = addScene(seed, &builder);
  builder.finish();

  const double t = static_cast<double>(index) / kFramesPerSecond;
  Waves waves(seed);
  const Vector3d middle = (table.sheets[0] + table.sheets[1]) / 2;
  // Around the sheets, nearer and further, from straight above to a flat view.
  const double around = 1.1 * M_PI * waves.at(t, 31);
  const double tilt = 0.5 + 0.45 * waves.at(t, 17);
  const double distance = 0.34 + 0.14 * waves.at(t, 23);
  const Vector3d aim = middle + Vector3d{0.14 * waves.at(t, 13), 0.1 * waves.at(t, 11), 0.0};
  const double roll = 0.5 * waves.at(t, 19);
  const Vector3d offset(
      std::sin(tilt) * std::sin(around), -std::sin(tilt) * std::cos(around), std::cos(tilt));

  // The image's level is that of the circle around the table, also straight above it.
  SceneView view;
  view.pose.position_in_world = roundToFloat(aim + distance * offset);
  const Vector3d x(std::cos(around), std::sin(around), 0);
  const Vector3d z = -offset;
  Eigen::Matrix3d level;
  level.row(0) = x;
  level.row(1) = z.cross(x);
  level.row(2) = z;
  view.pose.cam_from_world = Eigen::AngleAxisd(roll, Vector3d::UnitZ()).toRotationMatrix() * level;
  view.scene = std::move(builder.scene);
  return view;
}

}  // namespace dlsd
