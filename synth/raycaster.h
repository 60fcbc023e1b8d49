#pragma once
// Ray casting against a Scene, in world frame. raycaster.cpp is the only file that knows Embree.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>

#include "synth/scene.h"

namespace dlsd {

enum class HitKind : uint8_t { kNothing, kFace, kSphere, kDisc, kTube, kRod };

/// What a ray meets first.
struct Hit {
  HitKind kind = HitKind::kNothing;
  int index = -1;      ///< Of the face, sphere, disc, tube or (round) rod in the scene.
  float distance = 0;  ///< Along the ray, in lengths of its direction.
};

/// Whether a hit is on this rod: one of its faces, its side or its caps.
[[nodiscard]] inline bool isOnRod(const Hit& hit, const Scene& scene, int rod_index) {
  const Rod& rod = scene.rods[static_cast<size_t>(rod_index)];
  switch (hit.kind) {
    case HitKind::kFace:
      return hit.index >= rod.first_face && hit.index < rod.first_face + rod.face_count;
    case HitKind::kDisc:
      return rod.isRound() && hit.index >= rod.first_disc && hit.index <= rod.first_disc + 1;
    case HitKind::kRod:
      return hit.index == rod_index;
    default:
      return false;
  }
}

/// Rays with origins of their own, as a structure of arrays.
struct RayPacket {
  static constexpr size_t kSize = 16;
  alignas(64) std::array<float, kSize> origin_x, origin_y, origin_z;
  alignas(64) std::array<float, kSize> direction_x, direction_y, direction_z;
  alignas(64) std::array<float, kSize> min_distance, max_distance;
};

/// A float point near i / pieces of the way from `from` to `to` and as near to that line as can be
/// had (where the caster cuts an edge in pieces): of 16 tried the one that rounding moves least off
/// the line, on average a quarter as far as any one of them.
[[nodiscard]] Eigen::Vector3f floatPointOnEdge(const Eigen::Vector3d& from,
                                               const Eigen::Vector3d& to,
                                               int i,
                                               int pieces);

/// Immutable after construction; may be used by many threads at once. The scene must outlive it.
class Raycaster {
 public:
  static constexpr size_t kPacket = RayPacket::kSize;

  /// Throws SystemError if the ray caster refuses (out of memory).
  explicit Raycaster(const Scene& scene);
  ~Raycaster();
  Raycaster(Raycaster&&) noexcept;
  Raycaster& operator=(Raycaster&&) noexcept;

  /// First hits of up to 16 coherent rays from one origin. Results are those of single rays (the
  /// caster's robust mode).
  void castPacket(const Eigen::Vector3f& origin,
                  const float* x,
                  const float* y,
                  const float* z,
                  size_t count,
                  Hit* hits) const;

  /// First hits of the first `count` rays at distances in (min_distance, max_distance).
  void castPacket(const RayPacket& packet, size_t count, Hit* hits) const;

  /// First hit of one ray at a distance in (min_distance, max_distance).
  [[nodiscard]] Hit cast(const Eigen::Vector3f& origin,
                         const Eigen::Vector3f& direction,
                         float min_distance,
                         float max_distance) const;

  /// The same, past all that `looksThrough(const Hit&)` says yes to: however near behind that
  /// something else lies, it is met. (To cast anew from just behind each hit would miss it.)
  template <class LooksThrough>
  [[nodiscard]] Hit cast(const Eigen::Vector3f& origin,
                         const Eigen::Vector3f& direction,
                         float min_distance,
                         float max_distance,
                         const LooksThrough& looksThrough) const {
    const auto test = [](const void* self, const Hit& hit) {
      return (*static_cast<const LooksThrough*>(self))(hit);
    };
    const Transparent transparent{&looksThrough, test};
    return castPast(origin, direction, min_distance, max_distance, &transparent);
  }

  /// A predicate on hits without its type.
  struct Transparent {
    const void* self;
    bool (*test)(const void* self, const Hit& hit);
  };

 private:
  struct Impl;
  [[nodiscard]] Hit castPast(const Eigen::Vector3f& origin,
                             const Eigen::Vector3f& direction,
                             float min_distance,
                             float max_distance,
                             const Transparent* transparent) const;

  std::unique_ptr<Impl> impl_;
};

}  // namespace dlsd
