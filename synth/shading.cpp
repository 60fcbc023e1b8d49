#include "synth/shading.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "cameras/mutant.h"
#include "synth/dataset/random.h"
#include "synth/tubes.h"

namespace dlsd {

namespace {

double ambientIrradiance(const Scene& scene, const Eigen::Vector3d& normal) {
  const double up = (1 + normal.z()) / 2;
  return up * scene.ambient_up + (1 - up) * scene.ambient_down;
}

double lightIrradiance(const Light& light,
                       const Eigen::Vector3d& point,
                       const Eigen::Vector3d& normal) {
  if (light.kind == Light::Kind::kSun) {
    return light.strength * std::max(0.0, normal.dot(light.place));
  }
  const Eigen::Vector3d to_light = light.place - point;
  const double d2 = to_light.squaredNorm();
  const double cosine = normal.dot(to_light) / std::sqrt(d2 + 1e-12);
  return light.strength * std::max(0.0, cosine) /
         (1 +
          d2 / (light.half_distance * (DLSD_MUTANT("lamp-distance") ? 2 : light.half_distance)));
}

/// Value noise in [-1, 1]: random values at the points with whole coordinates, between them the
/// quintic that has no first and second derivative at its ends.
double valueNoise(const Eigen::Vector3d& p, uint64_t seed) {
  std::array<int64_t, 3> cell;
  std::array<double, 3> w;
  for (int i = 0; i < 3; ++i) {
    const double floor = std::floor(p[i]), t = p[i] - floor;
    cell[static_cast<size_t>(i)] = static_cast<int64_t>(floor);
    w[static_cast<size_t>(i)] = t * t * t * (t * (6 * t - 15) + 10);
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const double weight =
        (i != 0 ? w[0] : 1 - w[0]) * (j != 0 ? w[1] : 1 - w[1]) * (k != 0 ? w[2] : 1 - w[2]);
    const uint64_t bits = hashCounters({seed,
                                        static_cast<uint64_t>(cell[0] + i),
                                        static_cast<uint64_t>(cell[1] + j),
                                        static_cast<uint64_t>(cell[2] + k)});
    sum += weight * (2 * unitFromBits(bits) - 1);
  }
  return sum;
}

}  // namespace

double textureFactor(const Texture& texture, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = texture.axes * point / texture.size_m;
  if (texture.kind == Texture::Kind::kNoise) {
    const double sum = 4 * valueNoise(p, texture.seed) + 2 * valueNoise(2 * p, texture.seed + 1) +
                       valueNoise(4 * p, texture.seed + 2);
    return 1 + texture.amplitude * sum / 7;
  }
  constexpr double kAlong = 0.05, kUneven = 0.8;
  const Eigen::Vector3d q(p.x(), p.y(), kAlong * p.z());
  // Rounded off at the axis, where the distance from it has a kink.
  const double radius = std::sqrt(p.x() * p.x() + p.y() * p.y() + 0.01);
  const double ring = radius + kUneven * valueNoise(q, texture.seed);
  return 1 + texture.amplitude * std::sin(2 * M_PI * ring);
}

double irradiance(const Scene& scene, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  double sum = ambientIrradiance(scene, normal);
  for (const Light& light : scene.lights) sum += lightIrradiance(light, point, normal);
  return sum;
}

Shader::Shader(const Scene& scene, const Raycaster* raycaster)
    : scene_(&scene),
      has_textures_(!scene.textures.empty()),
      raycaster_(raycaster),
      grids_(scene.faces.size()) {
  for (const Light& light : scene.lights) {
    if (light.casts_shadows && raycaster != nullptr) {
      shadow_lights_.push_back(light);
    } else {
      (light.kind == Light::Kind::kSun ? plain_suns_ : point_lights_).push_back(light);
    }
  }
  if (shadow_lights_.size() > 7) {
    throw std::invalid_argument(
        "lights that cast shadows = " + std::to_string(shadow_lights_.size()) +
        " is out of range: allowed is [0, 7]");
  }
  if (scene.surfaces.size() >= 1U << kSurfaceBits) {
    throw std::invalid_argument("a scene has more surfaces than 2^24");
  }
  faces_.reserve(scene.faces.size());
  for (const Face& face : scene.faces) {
    double distant = ambientIrradiance(scene, face.normal);
    for (const Light& sun : plain_suns_) distant += lightIrradiance(sun, face.origin, face.normal);
    faces_.push_back(
        {face.normal, face.normal.dot(face.origin), distant, face.surface, !face.decals.empty()});
  }
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
  const FaceLook& face = faces_[static_cast<size_t>(hit.index)];
  // Seen at 1e-9 rad or less to the plane, the caster's distance is as good as any.
  const double cosine = face.normal.dot(direction);
  const double t = std::abs(cosine) > 1e-9 ? (face.offset - face.normal.dot(origin)) / cosine
                                           : static_cast<double>(hit.distance);
  return origin + t * direction;
}

int Shader::surfaceOfRound(const Hit& hit) const {
  const auto index = static_cast<size_t>(hit.index);
  switch (hit.kind) {
    case HitKind::kSphere:
      return scene_->spheres[index].surface;
    case HitKind::kDisc:
      return scene_->discs[index].surface;
    case HitKind::kTube:
      return scene_->tubes[index].surface;
    default:
      return scene_->rods[index].surface;
  }
}

Shader::Place Shader::placeOf(const Hit& hit,
                              const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction) const {
  const auto index = static_cast<size_t>(hit.index);
  if (hit.kind == HitKind::kFace) {
    return {pointOnFace(hit, origin, direction), faces_[index].normal};
  }
  const Eigen::Vector3d point = origin + static_cast<double>(hit.distance) * direction;
  if (hit.kind == HitKind::kSphere) {
    return {point, (point - scene_->spheres[index].centre.cast<double>()).normalized()};
  }
  if (hit.kind == HitKind::kTube) {
    const Tube& tube = scene_->tubes[index];
    return {point, (point - spineAt(tube, nearestOnSpine(tube, point))).normalized()};
  }
  if (hit.kind == HitKind::kRod) {
    const Rod& rod = scene_->rods[index];
    const Eigen::Vector3d axis = (rod.to - rod.from).normalized(), m = point - rod.from;
    return {point, (m - axis * axis.dot(m)).normalized()};
  }
  const Eigen::Vector3d normal = scene_->discs[index].normal.cast<double>();
  const Eigen::Vector3d centre = scene_->discs[index].centre.cast<double>();
  const double cosine = normal.dot(direction);
  return {cosine != 0 ? Eigen::Vector3d(origin + normal.dot(centre - origin) / cosine * direction)
                      : point,
          cosine > 0 ? Eigen::Vector3d(-normal) : normal};
}

void Shader::castShadow(
    const Light& light, Sight bit, const Place* places, size_t count, Sight* sights) const {
  // From the light to the place, so that a place never hides itself.
  RayPacket packet{};
  std::array<size_t, RayPacket::kSize> slots{};
  size_t rays = 0;
  for (size_t i = 0; i < count; ++i) {
    if (sights[i] < 0) continue;
    const bool sun = light.kind == Light::Kind::kSun;
    const Eigen::Vector3d from =
        sun ? Eigen::Vector3d(places[i].point + kSunDistance * light.place) : light.place;
    const Eigen::Vector3f start = from.cast<float>();
    const Eigen::Vector3d way = places[i].point - start.cast<double>();
    const double distance = way.norm(), cosine = -places[i].normal.dot(way) / distance;
    if (!(cosine > 1e-4)) continue;  // It gets no light from there anyway.
    const double margin = shadowGap(distance, cosine);
    if (!(distance > margin)) continue;
    packet.origin_x[rays] = start.x();
    packet.origin_y[rays] = start.y();
    packet.origin_z[rays] = start.z();
    packet.direction_x[rays] = static_cast<float>(way.x() / distance);
    packet.direction_y[rays] = static_cast<float>(way.y() / distance);
    packet.direction_z[rays] = static_cast<float>(way.z() / distance);
    packet.min_distance[rays] = 0;
    packet.max_distance[rays] = static_cast<float>(distance - margin);
    slots[rays++] = i;
  }
  while (rays > 0) {
    std::array<Hit, RayPacket::kSize> hits;
    raycaster_->castPacket(packet, rays, hits.data());
    // Faces met from behind let the light through: those rays go on.
    size_t left = 0;
    for (size_t k = 0; k < rays; ++k) {
      if (hits[k].kind == HitKind::kNothing) continue;
      const bool from_behind =
          hits[k].kind == HitKind::kFace &&
          faces_[static_cast<size_t>(hits[k].index)].normal.dot(
              Eigen::Vector3f(packet.direction_x[k], packet.direction_y[k], packet.direction_z[k])
                  .cast<double>()) > 0;
      if (!from_behind) {
        sights[slots[k]] |= bit;
        continue;
      }
      const float next =
          std::nextafter(hits[k].distance * (1 + 1e-6F), std::numeric_limits<float>::infinity());
      if (!(next < packet.max_distance[k])) continue;
      for (auto* values : {&packet.origin_x,
                           &packet.origin_y,
                           &packet.origin_z,
                           &packet.direction_x,
                           &packet.direction_y,
                           &packet.direction_z,
                           &packet.max_distance}) {
        (*values)[left] = (*values)[k];
      }
      packet.min_distance[left] = next;
      slots[left++] = slots[k];
    }
    rays = left;
  }
}

void Shader::addShadows(const Hit* hits,
                        const Eigen::Vector3d& origin,
                        const float* x,
                        const float* y,
                        const float* z,
                        size_t count,
                        Sight* sights) const {
  std::array<Place, RayPacket::kSize> places;
  for (size_t i = 0; i < count; ++i) {
    if (sights[i] < 0) continue;
    places[i] = placeOf(hits[i], origin, Eigen::Vector3f(x[i], y[i], z[i]).cast<double>());
  }
  for (size_t k = 0; k < shadow_lights_.size(); ++k) {
    castShadow(
        shadow_lights_[k], 1 << (kSurfaceBits + static_cast<int>(k)), places.data(), count, sights);
  }
}

float Shader::radiance(const Hit& hit,
                       const Eigen::Vector3d& origin,
                       const Eigen::Vector3d& direction,
                       Sight sight) const {
  if (sight < 0) return 0;
  const Surface& s = surfaceOf(sight);
  double albedo = s.albedo;
  const bool is_face = hit.kind == HitKind::kFace;
  double sum = is_face ? faces_[static_cast<size_t>(hit.index)].irradiance : 0;
  if (!is_face || !point_lights_.empty() || !shadow_lights_.empty() || s.texture >= 0) {
    const Place place = placeOf(hit, origin, direction);
    if (s.texture >= 0) {
      albedo *= textureFactor(scene_->textures[static_cast<size_t>(s.texture)], place.point);
    }
    if (!is_face) {
      sum = ambientIrradiance(*scene_, place.normal);
      for (const Light& sun : plain_suns_) sum += lightIrradiance(sun, place.point, place.normal);
    }
    for (const Light& light : point_lights_) {
      sum += lightIrradiance(light, place.point, place.normal);
    }
    for (size_t k = 0; k < shadow_lights_.size(); ++k) {
      if ((sight >> (kSurfaceBits + static_cast<int>(k)) & 1) != 0) continue;
      sum += lightIrradiance(shadow_lights_[k], place.point, place.normal);
    }
  }
  return static_cast<float>(albedo * sum + s.emission);
}

Seen Shader::shade(const Hit& hit,
                   const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& direction) const {
  const int surface = surfaceAt(hit, origin, direction);
  Sight sight = surface;
  if (hasShadows()) {
    const Eigen::Vector3f d = direction.cast<float>();
    addShadows(&hit, origin, &d.x(), &d.y(), &d.z(), 1, &sight);
  }
  return {surface, radiance(hit, origin, direction, sight)};
}

}  // namespace dlsd
