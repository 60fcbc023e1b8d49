#pragma once
// Per-pixel ground truth besides the image: depth, normals, instances, labels as maps.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "cameras/camera.h"
#include "synth/dataset/records.h"
#include "synth/raycaster.h"
#include "synth/scene.h"

namespace dlsd {

/// Each is taken at the pixel's centre. "Nothing" is where the ray hits nothing or there is no ray.
enum class PlaneKind {
  /// 1 x float: distance from the camera along the ray, m; z is this times the z of the unit ray.
  /// Nothing: 0.
  kDepth,
  /// 3 x float: unit normal of what is seen, camera frame, towards the camera. Nothing: 0, 0, 0.
  kNormal,
  /// 1 x int32: number of the connected body, from 0 (faces that share vertices or edges are
  /// one, prints belong to their face, spheres and discs are bodies of their own). Nothing: -1.
  kInstance,
  /// 1 x int32: id of the nearest label within kEdgePlanePx. None: -1.
  kEdge,
  /// 4 x float, of the nearest point of any label, however far: distance (px), direction of the
  /// label there (angle from x towards y, rad, in [0, pi)), that point (x, y; px). Without labels:
  /// -1, 0, 0, 0.
  kDistanceField,
};

/// px.
inline constexpr double kEdgePlanePx = 2;

/// "depth", "normal", "instance", "edge", "df": names in files and on the command line.
[[nodiscard]] std::string_view toString(PlaneKind kind);
[[nodiscard]] std::optional<PlaneKind> planeFromName(std::string_view name);
/// All names, in the order of PlaneKind.
[[nodiscard]] const std::vector<std::string>& planeNames();

struct Plane {
  PlaneKind kind;
  int width, height, channels;
  /// Row-major, channels interleaved.
  std::variant<std::vector<float>, std::vector<int32_t>> values;
};

/// The planes that are asked for, in that order. `lines` are the frame's labels; their image curves
/// are as exact as the labels' points (0.01 px). Uses the threads of the caller's task arena.
[[nodiscard]] std::vector<Plane> renderPlanes(const Scene& scene,
                                              const Raycaster& raycaster,
                                              const Camera& camera,
                                              const Pose& pose,
                                              const std::vector<LabelLine>& lines,
                                              const std::vector<PlaneKind>& kinds);

/// A NumPy file (format 1.0, little endian): shape (height, width), or (height, width, channels) if
/// there are several.
[[nodiscard]] std::string encodeNpy(const Plane& plane);

}  // namespace dlsd
