#include "synth/shading.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "synth/dataset/random.h"
#include "synth/labels.h"
#include "synth/render.h"
#include "synth/scene_builder.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

constexpr double kFloorAlbedo = 0.5, kAmbient = 0.2, kStrength = 0.6;

/// A room of 6 x 6 x 4 m with a box that floats in it, and one light.
Scene floatingBox(const Light& light) {
  SceneBuilder builder;
  const std::array<Panel, 4> walls{
      Panel{{0.5, 0}, {}}, {{0.5, 0}, {}}, {{0.5, 0}, {}}, {{0.5, 0}, {}}};
  builder.addRoom({6, 6, 4}, walls, {kFloorAlbedo, 0}, {0.5, 0});
  builder.addBox(Frame3(), {2, 2, 1}, {3, 4, 1.5}, {0.7, 0});
  builder.finish();
  builder.scene.ambient_up = builder.scene.ambient_down = kAmbient;
  builder.scene.lights = {light};
  return std::move(builder.scene);
}

/// Whether the segment meets the box, by its slabs.
bool meetsBox(const Vector3d& from, const Vector3d& to) {
  const Vector3d lo(2, 2, 1), hi(3, 4, 1.5), d = to - from;
  double begin = 0, end = 1;
  for (int k = 0; k < 3; ++k) {
    if (d[k] == 0) {
      if (from[k] < lo[k] || from[k] > hi[k]) return false;
      continue;
    }
    const double a = (lo[k] - from[k]) / d[k], b = (hi[k] - from[k]) / d[k];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  return begin < end;
}

Light lamp(bool casts_shadows) {
  Light light;
  light.kind = Light::Kind::kPoint;
  light.place = {2.2, 2.6, 3.3};
  light.strength = kStrength;
  light.half_distance = 3;
  light.casts_shadows = casts_shadows;
  return light;
}

Light sun(bool casts_shadows) {
  Light light;
  light.place = Vector3d(0.3, -0.2, 0.9).normalized();
  light.strength = kStrength;
  light.casts_shadows = casts_shadows;
  return light;
}

/// Where the light is, as seen from a point.
Vector3d lightSeenFrom(const Light& light, const Vector3d& point) {
  return light.kind == Light::Kind::kSun ? Vector3d(point + 100 * light.place) : light.place;
}

// Points of the floor, seen from a corner of the room: light or not, against the box's slabs. A
// lamp in the room, and a sun that shines through the ceiling's back.
TEST(Shadows, FallWhereTheLightIsHidden) {
  for (const Light& light : {lamp(true), sun(true)}) {
    const Scene scene = floatingBox(light);
    const Raycaster raycaster(scene);
    const Shader shader(scene, &raycaster), plain(scene);
    EXPECT_TRUE(shader.hasShadows());
    EXPECT_FALSE(plain.hasShadows());
    const Vector3d eye(5.5, 5.5, 3);
    const Random random(3, 1);
    int dark = 0, lit = 0;
    for (uint64_t i = 0; i < 4000; ++i) {
      const Vector3d point(random.uniform(2 * i, 0.1, 5.9), random.uniform(2 * i + 1, 0.1, 5.9), 0);
      if (meetsBox(eye, point)) continue;
      const Vector3d direction = (point - eye).normalized();
      const Hit hit = raycaster.cast(
          eye.cast<float>(), direction.cast<float>(), 0, std::numeric_limits<float>::infinity());
      const Seen seen = shader.shade(hit, eye, direction);
      const Vector3d to_light = lightSeenFrom(light, point) - point;
      const bool hidden = meetsBox(point, point + to_light);
      (hidden ? dark : lit) += 1;
      const float expected = hidden ? static_cast<float>(kFloorAlbedo * kAmbient)
                                    : plain.shade(hit, eye, direction).radiance;
      ASSERT_NEAR(seen.radiance, expected, 1e-5) << point.transpose();
      EXPECT_EQ(seen.surface, plain.shade(hit, eye, direction).surface);
    }
    EXPECT_GT(dark, 200);
    EXPECT_GT(lit, 1000);
  }
}

TEST(Shadows, NeedALightThatCastsThem) {
  const Scene scene = floatingBox(lamp(false));
  const Raycaster raycaster(scene);
  EXPECT_FALSE(Shader(scene, &raycaster).hasShadows());
  Scene many = floatingBox(lamp(true));
  many.lights.assign(8, lamp(true));
  EXPECT_THROW(Shader(many, &raycaster), std::invalid_argument);
}

// A shadow's border in the picture: the box hides the light up to a known line on the floor.
TEST(Shadows, BordersAreSampledFinely) {
  const Light light = lamp(true);
  const Scene scene = floatingBox(light);
  const Raycaster raycaster(scene);
  const Shader shader(scene, &raycaster);
  const std::array<double, 4> params{200, 200, 159.5, 119.5};
  const Camera camera = makeCamera("pinhole", params, 320, 240);
  const Pose pose = lookAt({4.6, 3, 2.8}, {4.6, 3.01, 0}, 0.3);
  const auto spans = visibleSpans(scene, raycaster, camera, pose);
  const std::vector<float> image =
      renderRadiance(scene, raycaster, shader, CameraRays(camera), pose, spans, 1).radiance;
  // The shadow of the box's edge x = 3, z = 1.5 on the floor is the line x = b.
  const double b =
      light.place.x() + (3 - light.place.x()) * light.place.z() / (light.place.z() - 1.5);
  // Along a row of floor points across it, light is missing up to b.
  int checked = 0;
  for (double y = 2.7; y < 3.3; y += 0.05) {
    const auto pixelAt = [&](double x) { return *camera.project(pose.toCam({x, y, 0})); };
    const Eigen::Vector2d border = pixelAt(b);
    const int row = static_cast<int>(std::lround(border.y()));
    if (row < 5 || row > 234 || border.x() < 12 || border.x() > 307) continue;
    // Where the border crosses this row, on a straight line between two of its points.
    const Eigen::Vector2d p = *camera.project(pose.toCam({b, 2.2, 0}));
    const Eigen::Vector2d q = *camera.project(pose.toCam({b, 3.8, 0}));
    const double x = p.x() + (row - p.y()) * (q.x() - p.x()) / (q.y() - p.y());
    const auto at = [&](int column) {
      return static_cast<double>(image[static_cast<size_t>(row * 320 + column)]);
    };
    const int middle = static_cast<int>(std::lround(x));
    const double left = at(middle - 4), right = at(middle + 4);
    ASSERT_GT(std::abs(left - right), 0.05);
    double share = 0;
    for (int column = middle - 4; column <= middle + 4; ++column) {
      share += (at(column) - right) / (left - right);
    }
    // The light on the floor changes a little over the 9 px.
    EXPECT_NEAR(share, x - (middle - 4.5), 0.1);
    ++checked;
  }
  EXPECT_GT(checked, 5);
}

}  // namespace
}  // namespace dlsd
