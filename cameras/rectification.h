#pragma once
// Virtual views: the image that an ideal camera at the same place would have taken. In a pinhole
// view straight lines are straight.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// With a unit ray (x, y, z) of the view's frame and plane coordinates (s, t):
///   kPinhole          s = x / z,         t = y / z                  rays with z > 0
///   kCylindrical      s = atan2(x, z),   t = y / sqrt(x^2 + z^2)    rays off the axis of the
///   cylinder kEquirectangular  s = atan2(x, z),   t = asin(y)                all rays
enum class ViewKind { kPinhole, kCylindrical, kEquirectangular };

/// A virtual view: pixel = (fx s + cx, fy t + cy). fx and fy are px per unit of s and t, which for
/// angles is px per rad.
struct VirtualView {
  ViewKind kind = ViewKind::kPinhole;
  int width = 0, height = 0;
  double fx = 1, fy = 1, cx = 0, cy = 0;
  Eigen::Matrix3d cam_from_view = Eigen::Matrix3d::Identity();  ///< Rotation.

  /// Unit ray in the frame of the real camera. No value where a longitude is beyond +-pi, or a
  /// latitude beyond +-pi/2.
  [[nodiscard]] std::optional<Eigen::Vector3d> rayInCam(const Eigen::Vector2d& pixel) const;
  /// The inverse, inside the image or not. No value for rays that the view's equations leave out,
  /// and beyond +-1e9 px.
  [[nodiscard]] std::optional<Eigen::Vector2d> pixelOf(const Eigen::Vector3d& ray_in_cam) const;
  /// The view as a camera in its own frame (turned by cam_from_view^T against the real one). No
  /// value for a cylindrical one, which is no camera model of ours.
  [[nodiscard]] std::optional<Camera> camera() const;
};

/// How a view is cut out.
struct ViewRequest {
  ViewKind kind = ViewKind::kPinhole;
  int width = 0, height = 0;  ///< In [1, 65535].
  /// Horizontal field of view, in (0, pi) for kPinhole, (0, 2 pi] else. For a crop the most that
  /// the rectangle may span in either direction.
  std::optional<double> fov_rad;
  Eigen::Matrix3d cam_from_view = Eigen::Matrix3d::Identity();
};

/// The view centred on its axis with this horizontal field of view, from the left edge of the first
/// pixel to the right edge of the last; fx = fy. fov_rad is needed.
/// Throws std::invalid_argument naming the field, value and allowed range.
[[nodiscard]] VirtualView centredView(const ViewRequest& request);

/// The most that a pinhole crop spans without a fov_rad: past it the middle of the view shrinks to
/// nothing, and a source that sees 180 degrees has no largest rectangle.
inline constexpr double kPinholeCropFovRad = 160 * M_PI / 180;

/// The rectangle of the view around its axis that shows the most pixels of the source and nothing
/// but the source, scaled to the size asked for (so fx and fy differ in general): every pixel of it
/// is interpolated from pixels of the source that have a ray. "Most" is to the resolution of the
/// search, 1/360 of the field in either direction; the sides are then moved out as far as they go.
/// What the TUM monocular data set's tools call `crop`.
struct Crop {
  std::optional<VirtualView> view;  ///< No value if the axis itself is not in the source's image.
  /// A side of the rectangle ends where fov_rad does (or without it kPinholeCropFovRad, the whole
  /// circle and the poles), and not where the source's image does.
  bool cut_by_fov = false;
};
/// Throws std::invalid_argument as centredView, but fov_rad may be missing.
[[nodiscard]] Crop cropView(const Camera& source, const ViewRequest& request);

/// Whether the source is a panorama whose left and right borders are the seam (within 0.05 px):
/// what lies between its last column and its first is interpolated from both, and within half a
/// pixel of a pole the row next to it is shown.
[[nodiscard]] bool goesAround(const Camera& source);

/// For each pixel of the view, row by row, where to look in the source's image. If that goesAround,
/// u may be up to half a pixel beyond the first or last column.
struct ViewMaps {
  int width = 0, height = 0;
  std::vector<float> u, v;     ///< Source pixel, rounded to float: by at most 1/65536 px below 512.
  std::vector<uint8_t> valid;  ///< 1 where the pixels around (u, v) are in the image and have rays.
};
[[nodiscard]] ViewMaps viewMaps(const Camera& source, const VirtualView& view);

}  // namespace dlsd
