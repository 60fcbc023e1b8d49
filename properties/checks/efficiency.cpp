#include "properties/checks/efficiency.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "detector/detector.h"
#include "detector/test_scene.h"
#include "evaluation/normal_bound.h"
#include "synth/dataset/random.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Side {
  Arc arc;  ///< Its normal points into the polygon.
  LabelLine label;
  Vector3d middle;
  double px_per_rad = 0;  ///< Across, in the middle.
};

/// The side as a label, if the image shows all of it well.
std::optional<Side> sideOf(const Camera& camera, const Vector3d& from, const Vector3d& to) {
  constexpr double kClearPx = 15, kLeastPx = 60;
  const auto arc = arcBetween(from, to);
  if (!arc) return std::nullopt;
  Side side{*arc, {}, arc->at(0.5)};
  Vector2d previous = Vector2d::Zero();
  for (int i = 0; i <= 40; ++i) {
    const auto p = camera.project(arc->at(i / 40.0));
    if (!p) return std::nullopt;
    for (int k = 0; k < 8; ++k) {
      const Vector2d q = *p + kClearPx * Vector2d(std::cos(k * M_PI / 4), std::sin(k * M_PI / 4));
      if (!camera.inImage(q) || !camera.unproject(q)) return std::nullopt;
    }
    if (i > 0) side.label.length_px += (*p - previous).norm();
    previous = *p;
  }
  const auto J = camera.jacobian(side.middle);
  if (!J || side.label.length_px < kLeastPx) return std::nullopt;
  const Vector2d along = (*J * arc->normal.cross(side.middle)).normalized();
  const Vector2d across = *J * arc->normal;
  side.px_per_rad = std::abs(along.x() * across.y() - along.y() * across.x());
  side.label.normal = arc->normal;
  side.label.points_in_cam = {from, to};
  side.label.kind = LineKind::kCrease;
  return side;
}

/// The longest detection along the middle half of the side.
const DetectedLine* detectionOf(const Side& side, const std::vector<DetectedLine>& lines) {
  const DetectedLine* best = nullptr;
  for (const DetectedLine& line : lines) {
    if (line.length_px < 0.5 * side.label.length_px) continue;
    double off = 0;
    for (const double t : {0.25, 0.5, 0.75}) {
      off = std::max(off, std::abs(line.arc.angleToPlane(side.arc.at(t))) * side.px_per_rad);
    }
    const Vector3d middle = line.arc.at(0.5);
    if (!(off < 3) || !(middle.dot(side.middle) > std::cos(side.arc.angle() / 2))) continue;
    if (best == nullptr || line.length_px > best->length_px) best = &line;
  }
  return best;
}

}  // namespace

std::vector<SideErrors> sideErrors(const EfficiencyCase& c) {
  // A triangle to hexagon about a third of the way from the middle of the image, or in it.
  const Camera& camera = c.camera;
  const Random random(c.seed, 0);
  const double w = camera.width(), h = camera.height();
  const Vector2d centre((0.5 + random.uniform(0, -0.15, 0.15)) * w,
                        (0.5 + random.uniform(1, -0.15, 0.15)) * h);
  const double radius_px = random.uniform(2, 0.25, 0.45) * std::min(w, h);
  const int corners = 3 + static_cast<int>(random.uniform(3, 0, 4));
  const double start = random.uniform(4, 0, 2 * M_PI);
  std::vector<Vector3d> rays;
  for (int i = 0; i < corners; ++i) {
    const double angle = start + 2 * M_PI * i / corners;
    const auto ray =
        camera.unproject(centre + radius_px * Vector2d(std::cos(angle), std::sin(angle)));
    if (!ray) return {};
    rays.push_back(*ray);
  }
  // Seen from inside, corners go round so that the normals of the sides point inwards.
  if (rays[0].cross(rays[1]).dot(rays[2]) < 0) std::reverse(rays.begin(), rays.end());
  // The image of a polygon is one of great circles only if all its corners are on its sides. Then
  // they are in the hemisphere round the sum of the normals, too: round the sum of the corners a
  // polygon of wide angles is not.
  Vector3d axis = Vector3d::Zero();
  for (size_t i = 0; i < rays.size(); ++i) {
    const Vector3d normal = rays[i].cross(rays[(i + 1) % rays.size()]).normalized();
    for (const Vector3d& ray : rays) {
      if (normal.dot(ray) < -1e-12) return {};
    }
    axis += normal;
  }
  const double sign = random.uniform(5, -1, 1) < 0 ? -1 : 1;
  test::Scene scene;
  scene.background = 128 - sign * c.contrast / 2;
  test::Shape shape;
  shape.axis = axis.normalized();
  shape.grey = 128 + sign * c.contrast / 2;
  shape.vertices = rays;
  scene.shapes.push_back(shape);

  std::vector<Side> sides;
  for (size_t i = 0; i < rays.size(); ++i) {
    auto side = sideOf(camera, rays[i], rays[(i + 1) % rays.size()]);
    if (!side) continue;
    side->label.contrast = c.contrast;
    sides.push_back(*side);
  }
  std::vector<SideErrors> errors(sides.size());
  if (sides.empty()) return {};
  const std::vector<float> clean = test::render(scene, camera, c.blur_px);
  const ImageNoise noise{c.blur_px, c.noise_levels};
  Detector detector(camera);
  for (int repeat = 0; repeat < c.repeats; ++repeat) {
    const auto pixels =
        test::toU8(clean, c.noise_levels, hashCounters({c.seed, static_cast<uint64_t>(repeat)}));
    const std::vector<DetectedLine>& lines = detector.detect(test::viewOf(pixels, camera));
    for (size_t i = 0; i < sides.size(); ++i) {
      const Side& side = sides[i];
      const auto information = normalInformation(camera, side.label, noise);
      if (!information) continue;
      errors[i].length_px = side.label.length_px;
      errors[i].offset_bound_px = offsetBoundPx(noise, c.contrast, side.label.length_px);
      ++errors[i].tried;
      const DetectedLine* line = detectionOf(side, lines);
      const auto sigmas = line != nullptr
                              ? normalErrorInSigmas(*information, side.arc.normal, line->arc.normal)
                              : std::nullopt;
      if (!sigmas) continue;
      ++errors[i].found;
      errors[i].offset2 += sigmas->offset * sigmas->offset;
      errors[i].roll2 += sigmas->roll * sigmas->roll;
      // Where the detected plane is on the normal's side of the middle, it is inside.
      const double same = line->arc.normal.dot(side.arc.normal) < 0 ? -1 : 1;
      const double inside_px = -same * line->arc.angleToPlane(side.middle) * side.px_per_rad;
      errors[i].bias_px += sign * inside_px;
    }
  }
  return errors;
}

}  // namespace dlsd
