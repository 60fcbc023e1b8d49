#pragma once
// The part of a fitted plane that the image shows.

#include <Eigen/Core>
#include <optional>

#include "cameras/arc.h"
#include "cameras/camera.h"

namespace dlsd {

/// What the image shows of a plane from ray to ray by way of a third between them. No value if that
/// is nothing, or a half turn or more: no 3D line.
/// @param ends_tell  If both ends are in image and domain, all in between is known to be, too.
[[nodiscard]] std::optional<Arc> visibleArc(const Camera& camera,
                                            const Eigen::Vector3d& plane_normal,
                                            const Eigen::Vector3d& from_ray,
                                            const Eigen::Vector3d& middle_ray,
                                            const Eigen::Vector3d& to_ray,
                                            bool ends_tell);

/// Whether the ray's projection onto the arc's plane is on the arc itself, ends included, not on
/// the rest of the great circle.
[[nodiscard]] bool isBesideArc(const Arc& arc, const Eigen::Vector3d& ray);

/// Length of the arc's image, to 1 %.
[[nodiscard]] double curveLengthPx(const Camera& camera, const Arc& arc);

}  // namespace dlsd
