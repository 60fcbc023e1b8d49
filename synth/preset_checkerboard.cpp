// Preset "checkerboard": calibration boards around the camera.

#include <algorithm>
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

constexpr uint64_t kStream = 0xc4ec;

/// A board in its frame: x right, y up, the pattern looks to z.
void addBoard(const Frame3& frame,
              int columns,
              int rows,
              double square_m,
              Random* random,
              SceneBuilder* builder) {
  const double margin = square_m * random->next(0.5, 1);
  const double width = columns * square_m + 2 * margin, height = rows * square_m + 2 * margin;
  Frame3 corner = frame;
  corner.origin = frame.at(-width / 2, -height / 2, 0);
  const double white = random->next(0.7, 0.9), black = random->next(0.03, 0.1);
  const SlabFaces slab =
      builder->addSlab(corner, width, height, 0.01, {{white, 0}, {}}, {random->next(0.2, 0.6), 0});
  // The face's 2D frame starts in the same corner and has the same axes.
  for (int j = 0; j < rows; ++j) {
    for (int i = j % 2; i < columns; i += 2) {
      builder->addDecal(slab.front.front,
                        {DecalShape::kRectangle,
                         {margin + (i + 0.5) * square_m, margin + (j + 0.5) * square_m},
                         {square_m / 2, square_m / 2},
                         0,
                         {black, 0}});
    }
  }
}

}  // namespace

SceneView makeCheckerboard(uint64_t seed, uint64_t index) {
  Random random(hashCounters({seed, index}), kStream);
  SceneBuilder builder;
  const Vector3d hall(8, 8, 4);
  std::array<Panel, 4> walls;
  for (Panel& wall : walls) wall.surface = {random.next(0.25, 0.7), 0};
  const Surface ceiling{random.next(0.4, 0.8), 0};
  builder.addRoom(hall, walls, {random.next(0.15, 0.5), 0}, ceiling);

  const Vector3d eye = roundToFloat(
      hall / 2 + Vector3d{random.next(-0.5, 0.5), random.next(-0.5, 0.5), random.next(-0.3, 0.3)});
  // The first board is ahead of the camera, the others anywhere around it.
  const double yaw = random.next(0, 2 * M_PI), pitch = random.next(-0.2, 0.2);
  const Vector3d ahead(
      std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
  struct Ball {
    Vector3d centre;
    double radius;
  };
  std::vector<Ball> balls;
  const int boards = random.nextInt(2, 5);
  for (int k = 0; k < 12 && static_cast<int>(balls.size()) < boards; ++k) {
    Random own(random.bits(static_cast<uint64_t>(1000 + k)), kStream);
    const int columns = own.nextInt(6, 12), rows = own.nextInt(5, 9);
    const double distance = own.next(0.5, 1.4);
    const double square = distance * own.next(0.05, 0.11);
    const double radius = square * std::hypot(columns + 2, rows + 2) / 2;
    Vector3d direction = balls.empty() ? ahead : drawDirection(&own);
    direction.z() *= 0.6;
    direction.normalize();
    const Ball ball{eye + (distance + 0.3 * radius) * direction, radius};
    const double tilt = own.next(0, 0.8), turn = own.next(0, 2 * M_PI);
    // The pattern looks at the camera, tilted by up to 46 degrees: nothing of it comes nearer than
    // 0.2 m.
    bool free = (ball.centre - eye).norm() > std::sin(tilt) * radius + 0.25 &&
                (ball.centre - hall / 2).cwiseAbs().x() + radius < hall.x() / 2 &&
                (ball.centre - hall / 2).cwiseAbs().y() + radius < hall.y() / 2 &&
                ball.centre.z() > radius + 0.02 && ball.centre.z() + radius < hall.z() - 0.5;
    for (const Ball& other : balls) {
      free = free && (ball.centre - other.centre).norm() > ball.radius + other.radius + 0.02;
    }
    if (!free) continue;
    balls.push_back(ball);
    Frame3 frame{ball.centre, {}};
    const Vector3d x = direction.unitOrthogonal();
    frame.axes << x, -direction.cross(x), -direction;
    frame.axes = frame.axes * Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix() *
                 Eigen::AngleAxisd(tilt, Vector3d::UnitX()).toRotationMatrix();
    addBoard(frame, columns, rows, square, &own, &builder);
  }
  // Something stands behind them.
  for (int k = 0; k < 4; ++k) {
    const double width = random.next(0.4, 1), height = random.next(0.4, 1.9);
    const double x = k % 2 == 0 ? 0.05 : hall.x() - width - 0.05;
    const double y = k / 2 == 0 ? 0.05 : hall.y() - 0.55;
    builder.addBox(Frame3(), {x, y, 0}, {x + width, y + 0.5, height}, {random.next(0.1, 0.8), 0});
  }
  builder.finish();

  Scene& scene = builder.scene;
  scene.ambient_up = random.next(0.45, 0.6);
  scene.ambient_down = random.next(0.3, 0.45);
  Light lamp;
  lamp.kind = Light::Kind::kPoint;
  lamp.place = {eye.x() + random.next(-1.5, 1.5), eye.y() + random.next(-1.5, 1.5), hall.z() - 0.3};
  lamp.strength = random.next(0.4, 0.7);
  lamp.half_distance = random.next(2, 4);
  lamp.casts_shadows = true;
  scene.lights.push_back(lamp);

  SceneView view;
  view.pose = lookAt(eye, eye + ahead, random.next(-0.4, 0.4));
  view.scene = std::move(scene);
  return view;
}

}  // namespace dlsd
