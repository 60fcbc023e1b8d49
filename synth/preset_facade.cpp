// Preset "facade": a house front of repeated windows under a sun.

#include <algorithm>
#include <array>
#include <cmath>

#include "synth/dataset/random.h"
#include "synth/presets.h"
#include "synth/scene_builder.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

constexpr uint64_t kStream = 0xfaca;

}  // namespace

SceneView makeFacade(uint64_t seed, uint64_t index) {
  Random random(hashCounters({seed, index}), kStream);
  SceneBuilder builder;
  // The front is one wall of a hall; the others are the sky, which lets the sun in from behind.
  const Vector3d size(16, 14, random.next(9, 14));
  const double sky = random.next(0.5, 1), wall = random.next(0.3, 0.75);
  std::array<Panel, 4> walls;
  for (Panel& panel : walls) panel.surface = {0, sky};
  walls[0].surface = {wall, 0};

  const int columns = random.nextInt(4, 9);
  const double storey = random.next(2.6, 3.3), pitch = (size.x() - 1) / columns;
  const double width = pitch * random.next(0.4, 0.65), height = storey * random.next(0.45, 0.65);
  const double depth = random.next(0.1, 0.3), sill = random.next(0.4, 0.7);
  const int panes_x = random.nextInt(1, 3), panes_y = random.nextInt(1, 3);
  const double bar = random.next(0.04, 0.08);
  const Surface frame{random.nextBool(0.6) ? random.next(0.6, 0.9) : random.next(0.1, 0.3), 0};
  const bool has_balconies = random.nextBool(0.6);
  struct Balcony {
    double x0, x1, z;
  };
  std::vector<Balcony> balconies;
  for (int row = 0; (row + 1) * storey < size.z() - 0.3; ++row) {
    for (int column = 0; column < columns; ++column) {
      // Every window takes the same number of draws.
      const bool is_there = !random.nextBool(0.06), has_balcony = random.nextBool(0.5);
      const double glass = random.next(0.05, 0.35);
      if (!is_there) continue;
      const double x = 0.5 + (column + 0.5) * pitch - width / 2, y = row * storey + sill;
      Pocket window{x, x + width, y, y + height, depth, {wall * 0.9, 0}, {frame, {}}};
      const double pane_w = (width - bar * (panes_x + 1)) / panes_x;
      const double pane_h = (height - bar * (panes_y + 1)) / panes_y;
      for (int i = 0; i < panes_x; ++i) {
        for (int j = 0; j < panes_y; ++j) {
          const double px = x + bar + i * (pane_w + bar), py = y + bar + j * (pane_h + bar);
          window.bottom.pockets.push_back(
              {px, px + pane_w, py, py + pane_h, 0.03, frame, {{glass, 0}, {}}});
        }
      }
      walls[0].pockets.push_back(std::move(window));
      if (has_balconies && row > 0 && has_balcony) {
        // The wall's frame runs along -x of the world.
        const double margin = std::min(0.3, (pitch - width) / 2 - 0.1);
        balconies.push_back({size.x() - x - width - margin, size.x() - x + margin, y - 0.15});
      }
    }
  }
  const Surface ground{random.next(0.2, 0.5), 0};
  const auto faces = builder.addRoom(size, walls, ground, {0, sky});

  const double slab_depth = random.next(0.5, 1.1);
  const Surface concrete{random.next(0.3, 0.8), 0};
  for (const Balcony& b : balconies) {
    builder.addBox(Frame3(), {b.x0, 0.004, b.z - 0.12}, {b.x1, slab_depth, b.z}, concrete);
  }
  // Paving, and things that stand on it.
  const double slab = random.next(0.8, 2), seam = random.next(0.01, 0.04);
  const Surface dark{ground.albedo * random.next(0.4, 0.7), 0};
  for (double y = slab; y < size.y() - 0.2; y += slab) {
    builder.addDecal(
        faces[4].front,
        {DecalShape::kRectangle, {size.x() / 2, y}, {size.x() / 2 - 0.1, seam / 2}, 0, dark});
  }
  const double eye_height = random.next(1.2, 5), eye_distance = random.next(5, 11);
  const Vector3d eye(random.next(4, 12), eye_distance, eye_height);
  for (int k = 0; k < 5; ++k) {
    const double x = 0.8 + 3 * k + random.next(0, 1), y = random.next(1.6, 3.5);
    const double height_k = random.next(0.4, 2.2), w = random.next(0.3, 1.2);
    if (random.nextBool(0.4)) {
      builder.addRod({x, y, 0.002}, {x, y, 2 + height_k}, random.next(0.03, 0.06), 8, {0.1, 0});
    } else {
      builder.addBox(Frame3(), {x, y, 0}, {x + w, y + 0.4, height_k}, {random.next(0.1, 0.8), 0});
    }
  }
  builder.finish();

  Scene& scene = builder.scene;
  scene.ambient_up = random.next(0.35, 0.5);
  scene.ambient_down = random.next(0.25, 0.35);
  Light sun;
  const double sun_z = random.next(0.4, 1.5), sun_y = random.next(0.4, 1.2);
  sun.place = Vector3d(random.next(-1, 1), sun_y, sun_z).normalized();
  sun.strength = random.next(0.5, 0.8);
  sun.casts_shadows = random.nextBool(0.8);
  scene.lights.push_back(sun);

  const double target_height = random.next(2, 7);
  const Vector3d target(random.next(4, 12), 0, target_height);
  SceneView view;
  view.pose = lookAt(eye, target, random.next(-0.15, 0.15));
  view.scene = std::move(scene);
  return view;
}

}  // namespace dlsd
