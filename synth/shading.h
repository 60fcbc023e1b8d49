#pragma once
// Lambert shading of a Scene in linear light; decals are resolved here.

#include <Eigen/Core>
#include <vector>

#include "synth/raycaster.h"
#include "synth/scene.h"

namespace dlsd {

/// What a ray sees.
struct Seen {
  int surface = -1;    ///< Index in Scene::surfaces; -1: nothing (black).
  float radiance = 0;  ///< Linear light; 1 is white at exposure 1.
};

/// Irradiance over pi at a point of a surface with this unit normal (world frame): a white
/// surface's radiance.
[[nodiscard]] double irradiance(const Scene& scene,
                                const Eigen::Vector3d& point,
                                const Eigen::Vector3d& normal);

/// Immutable; may be used by many threads. The scene must outlive it.
class Shader {
 public:
  explicit Shader(const Scene& scene);

  /// Index in Scene::surfaces of what the ray from `origin` (world) along `direction` sees at its
  /// hit; -1 for nothing. On faces the point is computed in double from the face's plane, so decal
  /// borders are as exact as polygon edges.
  [[nodiscard]] int surfaceAt(const Hit& hit,
                              const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction) const;
  /// Radiance of the hit, given its surface.
  [[nodiscard]] float radiance(const Hit& hit,
                               const Eigen::Vector3d& origin,
                               const Eigen::Vector3d& direction,
                               int surface) const;
  [[nodiscard]] Seen shade(const Hit& hit,
                           const Eigen::Vector3d& origin,
                           const Eigen::Vector3d& direction) const {
    const int surface = surfaceAt(hit, origin, direction);
    return {surface, radiance(hit, origin, direction, surface)};
  }

 private:
  /// Decals of a face by cells of its plane; a cell lists what touches it, in face order.
  struct DecalGrid {
    Eigen::Vector2d lo{0, 0}, cells_per_metre{0, 0};
    int columns = 0, rows = 0;
    std::vector<std::vector<int>> cells;
  };

  [[nodiscard]] Eigen::Vector3d pointOnFace(const Hit& hit,
                                            const Eigen::Vector3d& origin,
                                            const Eigen::Vector3d& direction) const;
  [[nodiscard]] int surfaceOfFace(int face, const Eigen::Vector3d& point) const;

  const Scene* scene_;
  std::vector<DecalGrid> grids_;  ///< One per face; empty for faces without decals.
};

}  // namespace dlsd
