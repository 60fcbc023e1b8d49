#include "synth/shading.h"

#include <algorithm>
#include <cmath>

namespace dlsd {

double irradiance(const Scene& scene, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  const double up = (1 + normal.z()) / 2;
  double sum = up * scene.ambient_up + (1 - up) * scene.ambient_down;
  for (const Light& light : scene.lights) {
    if (light.kind == Light::Kind::kSun) {
      sum += light.strength * std::max(0.0, normal.dot(light.place));
    } else {
      const Eigen::Vector3d to_light = light.place - point;
      const double d2 = to_light.squaredNorm();
      const double cosine = normal.dot(to_light) / std::sqrt(d2 + 1e-12);
      sum += light.strength * std::max(0.0, cosine) /
             (1 + d2 / (light.half_distance * light.half_distance));
    }
  }
  return sum;
}

Shader::Shader(const Scene& scene) : scene_(&scene), grids_(scene.faces.size()) {
  for (size_t f = 0; f < scene.faces.size(); ++f) {
    const std::vector<Decal>& decals = scene.faces[f].decals;
    if (decals.empty()) continue;
    DecalGrid& grid = grids_[f];
    // Half extent of a decal's bounding rectangle along the face's axes.
    const auto extent = [](const Decal& d) {
      const Eigen::Vector2d a = d.axis.cwiseAbs();
      return Eigen::Vector2d(a.x() * d.half.x() + a.y() * d.half.y(),
                             a.y() * d.half.x() + a.x() * d.half.y());
    };
    Eigen::Vector2d lo = decals[0].centre, hi = lo;
    for (const Decal& d : decals) {
      lo = lo.cwiseMin(d.centre - extent(d));
      hi = hi.cwiseMax(d.centre + extent(d));
    }
    const int side =
        std::clamp(static_cast<int>(std::sqrt(static_cast<double>(decals.size()))) * 2, 1, 64);
    grid.columns = grid.rows = side;
    grid.lo = lo;
    grid.cells_per_metre = (hi - lo).cwiseInverse() * side;
    grid.cells.resize(static_cast<size_t>(side) * static_cast<size_t>(side));
    for (size_t k = 0; k < decals.size(); ++k) {
      const Eigen::Vector2d e = extent(decals[k]);
      const auto cell = [&](const Eigen::Vector2d& p) -> Eigen::Vector2i {
        // One part in 1e9 wider, so that rounding never leaves a border out.
        return (p - lo).cwiseProduct(grid.cells_per_metre).array().floor().cast<int>();
      };
      const Eigen::Vector2i c0 = cell(decals[k].centre - e * (1 + 1e-9));
      const Eigen::Vector2i c1 = cell(decals[k].centre + e * (1 + 1e-9));
      for (int y = std::max(0, c0.y()); y <= std::min(side - 1, c1.y()); ++y) {
        for (int x = std::max(0, c0.x()); x <= std::min(side - 1, c1.x()); ++x) {
          grid.cells[static_cast<size_t>(y * side + x)].push_back(static_cast<int>(k));
        }
      }
    }
  }
}

int Shader::surfaceOfFace(int face, const Eigen::Vector3d& point) const {
  const Face& f = scene_->faces[static_cast<size_t>(face)];
  if (f.decals.empty()) return f.surface;
  const Eigen::Vector3d d = point - f.origin;
  const Eigen::Vector2d p(f.e1.dot(d), f.e2.dot(d));
  const DecalGrid& grid = grids_[static_cast<size_t>(face)];
  const Eigen::Vector2d cell = (p - grid.lo).cwiseProduct(grid.cells_per_metre);
  if (!(cell.x() >= 0 && cell.y() >= 0 && cell.x() < grid.columns && cell.y() < grid.rows)) {
    return f.surface;
  }
  const auto& list = grid.cells[static_cast<size_t>(static_cast<int>(cell.y()) * grid.columns +
                                                    static_cast<int>(cell.x()))];
  for (auto it = list.rbegin(); it != list.rend(); ++it) {
    const Decal& decal = f.decals[static_cast<size_t>(*it)];
    if (decal.contains(p)) return decal.surface;
  }
  return f.surface;
}

Eigen::Vector3d Shader::pointOnFace(const Hit& hit,
                                    const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction) const {
  const Face& face = scene_->faces[static_cast<size_t>(hit.index)];
  // Seen at 1e-9 rad or less to the plane, the caster's distance is as good as any.
  const double cosine = face.normal.dot(direction);
  const double t = std::abs(cosine) > 1e-9 ? face.normal.dot(face.origin - origin) / cosine
                                           : static_cast<double>(hit.distance);
  return origin + t * direction;
}

int Shader::surfaceAt(const Hit& hit,
                      const Eigen::Vector3d& origin,
                      const Eigen::Vector3d& direction) const {
  const auto index = static_cast<size_t>(hit.index);
  switch (hit.kind) {
    case HitKind::kNothing:
      return -1;
    case HitKind::kFace:
      if (scene_->faces[index].decals.empty()) return scene_->faces[index].surface;
      return surfaceOfFace(hit.index, pointOnFace(hit, origin, direction));
    case HitKind::kSphere:
      return scene_->spheres[index].surface;
    case HitKind::kDisc:
      return scene_->discs[index].surface;
  }
  return -1;
}

float Shader::radiance(const Hit& hit,
                       const Eigen::Vector3d& origin,
                       const Eigen::Vector3d& direction,
                       int surface) const {
  if (surface < 0) return 0;
  const auto index = static_cast<size_t>(hit.index);
  Eigen::Vector3d point = origin + static_cast<double>(hit.distance) * direction;
  Eigen::Vector3d normal;
  if (hit.kind == HitKind::kFace) {
    point = pointOnFace(hit, origin, direction);
    normal = scene_->faces[index].normal;
  } else if (hit.kind == HitKind::kSphere) {
    normal = (point - scene_->spheres[index].centre.cast<double>()).normalized();
  } else {
    normal = scene_->discs[index].normal.cast<double>();
    if (normal.dot(direction) > 0) normal = -normal;
  }
  const Surface& s = scene_->surfaces[static_cast<size_t>(surface)];
  return static_cast<float>(s.albedo * irradiance(*scene_, point, normal) + s.emission);
}

}  // namespace dlsd
