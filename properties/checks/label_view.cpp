#include "properties/checks/label_view.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "synth/render.h"
#include "synth/sensor.h"
#include "synth/shadows.h"
#include "synth/tubes.h"

namespace dlsd {

using Eigen::Vector2d;
using Eigen::Vector3d;

Viewed::Viewed(Scene s, const Pose& p, const Camera& camera)
    : scene(std::move(s)), pose(p), raycaster(scene) {
  addRodSides(pose.position_in_world, &scene);
  addShadowEdges(raycaster, &scene);
  spans = visibleSpans(scene, raycaster, camera, pose);
  const Shader shader(scene, &raycaster);
  labels = makeLabels(scene, raycaster, shader, camera, pose, SensorOptions(), spans);
}

std::vector<float> Viewed::render(const Camera& camera) const {
  const Shader shader(scene, &raycaster);
  return renderRadiance(
             scene, raycaster, shader, CameraRays(camera), pose, spans, 1, PixelResponse(0.7, 0))
      .radiance;
}

ShownPicture Viewed::shown(const Camera& camera) const {
  ShownPicture shown;
  shown.image.width = camera.width();
  shown.image.height = camera.height();
  for (const float radiance : render(camera)) {
    const double grey = greyLevel(SensorOptions(), static_cast<double>(radiance));
    shown.image.bytes.push_back(static_cast<uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0))));
  }
  for (const LabelLine& line : labels.lines) shown.labels.push_back(line.points);
  return shown;
}

bool isMiddle(const Scene& scene, const LabelLine& line) {
  const Edge& edge = scene.edges[static_cast<size_t>(line.edge)];
  return edge.source == EdgeSource::kRodCentre ||
         (edge.source == EdgeSource::kShadow &&
          scene.edges[static_cast<size_t>(edge.caster)].source == EdgeSource::kRodCentre);
}

Eye::Eye(const Viewed& seen, const Camera& camera)
    : seen_(seen),
      camera_(camera),
      shader_(seen.scene, &seen.raycaster),
      world_from_cam_(seen.pose.cam_from_world.transpose()) {}

Eye::Look Eye::along(const Vector3d& ray) const {
  const Vector3d direction = world_from_cam_ * ray.normalized();
  const Eigen::Vector3f d = direction.cast<float>();
  const Vector3d& origin = seen_.pose.position_in_world;
  const Hit hit =
      seen_.raycaster.cast(origin.cast<float>(), d, 0, std::numeric_limits<float>::infinity());
  Sight sight = shader_.surfaceAt(hit, origin, direction);
  shader_.addShadows(&hit, origin, &d.x(), &d.y(), &d.z(), 1, &sight);
  return {hit, sight, direction};
}

double Eye::grey(const Look& look) const {
  return greyLevel(SensorOptions(),
                   static_cast<double>(shader_.radiance(
                       look.hit, seen_.pose.position_in_world, look.direction, look.sight)));
}

void Eye::at(const std::vector<Vector2d>& pixels, std::vector<std::optional<Look>>* looks) const {
  constexpr size_t kPacket = Raycaster::kPacket;
  looks->assign(pixels.size(), std::nullopt);
  std::array<size_t, kPacket> slots{};
  std::array<Vector3d, kPacket> directions;
  alignas(64) std::array<float, kPacket> x{}, y{}, z{};
  const Vector3d& origin = seen_.pose.position_in_world;
  size_t rays = 0;
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (const auto ray = camera_.unproject(pixels[i])) {
      slots[rays] = i;
      directions[rays] = world_from_cam_ * ray->normalized();
      const Eigen::Vector3f d = directions[rays].cast<float>();
      x[rays] = d.x(), y[rays] = d.y(), z[rays] = d.z();
      ++rays;
    }
    if (rays == 0 || (rays < kPacket && i + 1 < pixels.size())) continue;
    std::array<Hit, kPacket> hits;
    std::array<Sight, kPacket> sights{};
    seen_.raycaster.castPacket(
        origin.cast<float>(), x.data(), y.data(), z.data(), rays, hits.data());
    for (size_t k = 0; k < rays; ++k) {
      sights[k] = shader_.surfaceAt(hits[k], origin, directions[k]);
    }
    shader_.addShadows(hits.data(), origin, x.data(), y.data(), z.data(), rays, sights.data());
    for (size_t k = 0; k < rays; ++k) (*looks)[slots[k]] = {hits[k], sights[k], directions[k]};
    rays = 0;
  }
}

double distanceTo(const Vector2d& from, const Vector2d& to, const Vector2d& p) {
  const Vector2d d = to - from;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - from).dot(d) / length2, 0.0, 1.0) : 0;
  return (from + t * d - p).norm();
}

std::string textOf(const Vector2d& pixel) {
  return fmt::format("({:.6g}, {:.6g})", pixel.x(), pixel.y());
}

void addCross(const Vector2d& pixel, ShownPicture* shown) {
  constexpr double kArmPx = 4;
  for (const Vector2d& arm : {Vector2d(kArmPx, kArmPx), Vector2d(kArmPx, -kArmPx)}) {
    shown->failed.push_back({pixel - arm, pixel + arm});
  }
}

}  // namespace dlsd
