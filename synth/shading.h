#pragma once
// Lambert shading of a Scene in linear light; decals are resolved here.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "synth/raycaster.h"
#include "synth/scene.h"

namespace dlsd {

/// What a texture multiplies the albedo by at a point (world): 1 - amplitude to 1 + amplitude,
/// twice differentiable.
[[nodiscard]] double textureFactor(const Texture& texture, const Eigen::Vector3d& point);

/// What is seen at a point, as a number that tells pixels apart: the index of the surface in
/// Scene::surfaces in the low kSurfaceBits bits; above them one bit for each light that casts
/// shadows, set where it is hidden. -1: nothing (black).
using Sight = int;
inline constexpr int kSurfaceBits = 24;

/// What a ray sees.
struct Seen {
  int surface = -1;    ///< Index in Scene::surfaces; -1: nothing (black).
  float radiance = 0;  ///< Linear light; 1 is white at exposure 1.
};

/// Irradiance over pi at a point of a surface with this unit normal (world frame), as if nothing
/// cast shadows: a white surface's radiance.
[[nodiscard]] double irradiance(const Scene& scene,
                                const Eigen::Vector3d& point,
                                const Eigen::Vector3d& normal);

/// Suns shine from this far, m; scenes are smaller.
inline constexpr double kSunDistance = 64;

/// What stands nearer than this before a place, m along the light, casts no shadow on it: for the
/// ray caster's float rounding, which counts the more the flatter the light falls. At grazing light
/// the shadows of what stands on a face begin up to a few mm beside it. `distance`: to the light;
/// `cosine`: of the light's angle to the normal.
[[nodiscard]] inline double shadowGap(double distance, double cosine) {
  return 1e-5 + 1e-6 * distance / cosine;
}

/// Immutable; may be used by many threads. The scene must outlive it.
class Shader {
 public:
  /// Without a raycaster nothing casts shadows; it must outlive the shader. Throws
  /// std::invalid_argument if more than 7 lights cast shadows, or a scene has 2^24 surfaces.
  explicit Shader(const Scene& scene, const Raycaster* raycaster = nullptr);

  [[nodiscard]] bool hasShadows() const { return !shadow_lights_.empty(); }
  /// Whether the radiance of a sight has a pattern.
  [[nodiscard]] bool isTextured(Sight sight) const {
    return has_textures_ && sight >= 0 && surfaceOf(sight).texture >= 0;
  }

  /// What the ray from `origin` (world) along `direction` sees at its hit, without regard to
  /// shadows. On faces the point is computed in double from the face's plane, so decal borders are
  /// as exact as polygon edges.
  [[nodiscard]] Sight surfaceAt(const Hit& hit,
                                const Eigen::Vector3d& origin,
                                const Eigen::Vector3d& direction) const {
    if (hit.kind == HitKind::kNothing) return -1;
    if (hit.kind != HitKind::kFace) return surfaceOfRound(hit);
    const auto face = static_cast<size_t>(hit.index);
    if (!faces_[face].has_decals) return faces_[face].surface;
    return surfaceOfFace(hit.index, pointOnFace(hit, origin, direction));
  }
  /// Adds the shadows on up to RayPacket::kSize places that rays from `origin` along (x, y, z) hit.
  void addShadows(const Hit* hits,
                  const Eigen::Vector3d& origin,
                  const float* x,
                  const float* y,
                  const float* z,
                  size_t count,
                  Sight* sights) const;
  /// Radiance of the hit, given its sight. Discs and faces are met in `direction`, wherever on
  /// their plane that is.
  [[nodiscard]] float radiance(const Hit& hit,
                               const Eigen::Vector3d& origin,
                               const Eigen::Vector3d& direction,
                               Sight sight) const;
  /// Surface and radiance with shadows, of one ray.
  [[nodiscard]] Seen shade(const Hit& hit,
                           const Eigen::Vector3d& origin,
                           const Eigen::Vector3d& direction) const;

 private:
  [[nodiscard]] const Surface& surfaceOf(Sight sight) const {
    return scene_->surfaces[static_cast<size_t>(sight & ((1 << kSurfaceBits) - 1))];
  }

  /// Decals of a face by cells of its plane; a cell lists what touches it, in face order.
  struct DecalGrid {
    Eigen::Vector2d lo{0, 0}, cells_per_metre{0, 0};
    int columns = 0, rows = 0;
    std::vector<std::vector<int>> cells;
  };

  /// Where a ray meets a surface, and its unit normal there, towards the ray's origin.
  struct Place {
    Eigen::Vector3d point, normal;
  };

  [[nodiscard]] Eigen::Vector3d pointOnFace(const Hit& hit,
                                            const Eigen::Vector3d& origin,
                                            const Eigen::Vector3d& direction) const;
  [[nodiscard]] Place placeOf(const Hit& hit,
                              const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction) const;
  [[nodiscard]] int surfaceOfRound(const Hit& hit) const;
  [[nodiscard]] int surfaceOfFace(int face, const Eigen::Vector3d& point) const;
  /// Sets `bit` in the sights whose places the light does not reach.
  void castShadow(
      const Light& light, Sight bit, const Place* places, size_t count, Sight* sights) const;

  /// What shading asks of a face, side by side in memory.
  struct FaceLook {
    Eigen::Vector3d normal;
    double offset;      ///< normal . point, for points of the plane.
    double irradiance;  ///< Of ambient light and suns without shadows: the same everywhere.
    int surface;
    bool has_decals;
  };

  const Scene* scene_;
  bool has_textures_;
  std::vector<FaceLook> faces_;
  std::vector<Light> plain_suns_;
  std::vector<Light> point_lights_;   ///< Those without shadows: their light depends on the place.
  std::vector<Light> shadow_lights_;  ///< Suns and point lights.
  const Raycaster* raycaster_;
  std::vector<DecalGrid> grids_;  ///< One per face; empty for faces without decals.
};

}  // namespace dlsd
