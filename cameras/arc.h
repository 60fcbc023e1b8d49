#pragma once
// A 3D line segment as a central camera sees it: an arc of a great circle of the unit sphere.
// Labels and detections are both arcs; metrics and drawing work on their image curves.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// The short arc from `from` to `to` on the great circle with normal `normal` (camera frame).
/// Normal and both ends are unit vectors; the ends are perpendicular to the normal to rounding.
/// normal and -normal mean the same line; canonicalNormal fixes the sign where files need one.
struct Arc {
  Eigen::Vector3d normal;
  Eigen::Vector3d from;
  Eigen::Vector3d to;

  /// Angle between the end rays, rad, in [0, pi]; accurate to rounding at 0 and pi.
  [[nodiscard]] double angle() const;
  /// Unit ray at fraction t of the angle from `from` (t = 0) to `to` (t = 1).
  [[nodiscard]] Eigen::Vector3d at(double t) const;
  /// Signed angle of a unit ray to the arc's plane, rad.
  [[nodiscard]] double angleToPlane(const Eigen::Vector3d& unit_ray) const;
};

/// Arc between two rays of any positive length. No value if they are parallel or opposite
/// (sine of the angle <= 1e-12), where the plane is not defined.
[[nodiscard]] std::optional<Arc> arcBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Arc with a given plane (a fitted one): the ends are the rays projected onto the plane.
/// No value if a ray is (anti)parallel to the normal, or the normal is zero.
[[nodiscard]] std::optional<Arc> arcOnPlane(const Eigen::Vector3d& normal,
                                            const Eigen::Vector3d& from,
                                            const Eigen::Vector3d& to);

/// The normal with the sign that makes its first non-zero entry positive.
[[nodiscard]] Eigen::Vector3d canonicalNormal(const Eigen::Vector3d& normal);

/// Angle between the planes of two arcs, rad, in [0, pi / 2] (n and -n are the same plane).
[[nodiscard]] double angleBetweenPlanes(const Eigen::Vector3d& n1, const Eigen::Vector3d& n2);

/// Why a piece of an arc's image ends: with the arc, at the image border, at the bound of the
/// camera's domain, or at a seam, behind which the image goes on elsewhere.
enum class ImageEnd { kArcEnd, kBorder, kRim, kSeam };

/// A piece [t0, t1] of an arc (fractions of its angle) that is inside image and domain.
struct ImageSpan {
  double t0, t1;
  ImageEnd end0, end1;
};

/// The pieces of an arc that the camera images, in order. Cut at the image border (kBorder) and at
/// the bound of the camera's domain (kRim), each located to 1e-12 of the arc.
///
/// Where the camera has a seam (equirectangular), arcs are cut there too (kSeam): at the half plane
/// x = 0, z < 0 and, if they pass within 1e-14 rad of one, at the poles +-y. The pieces on both
/// sides of a cut share its t; their images end on different sides. An end at the image border
/// within 1e-9 rad of a cut counts as a seam, so that the image of a whole sphere has seams where
/// it has borders.
///
/// Guarantee: every piece, and every gap between pieces, that is longer than 0.1 degrees on the arc
/// or 2 px in the image is found. Shorter ones may be missed; then the neighbours are reported as
/// if it were not there. A stretch of the arc is passed over only where nothing can happen: outside
/// the cone of all image rays, or if its ends are further from the domain's bound (on the sphere,
/// exactly) and from the image border than the stretch is long. In the image the length is taken
/// with 1.5 times the larger scale (px per rad, largest singular value of the projection's
/// Jacobian) at its ends, so it takes a camera whose scale does not rise and fall again by more
/// than half within 4 degrees, as is true of real lenses and mirrors; counter-examples are FoV with
/// omega < 0.05 at 90 degrees and the last degrees before -z.
/// It looks at 65,536 places and no more, which only cameras reach whose pixels differ in size by
/// many powers of ten; there, longer pieces may be missed, too.
/// The pieces of a panorama are exact: where a great circle meets longitudes and latitudes has a
/// closed form.
[[nodiscard]] std::vector<ImageSpan> imageSpans(const Camera& camera, const Arc& arc);

/// Points on the image of the piece [t0, t1] of an arc, first and last included, joined by straight
/// pieces that keep within max_chord_err_px of the true curve: measured at the middle and the
/// quarters of each piece, with room for what a cubic does in between. The piece must be imaged
/// throughout (a span of imageSpans); a point that falls out of the domain by rounding is left out. An end on a seam is
/// drawn on the piece's own side of it; at a pole the curve ends 1e-8 rad before. Nothing is drawn
/// across a seam: of a piece that goes on behind one, only the longest part is drawn.
[[nodiscard]] std::vector<Eigen::Vector2d> imageCurve(
    const Camera& camera, const Arc& arc, double t0, double t1, double max_chord_err_px = 0.01);

}  // namespace dlsd
