#pragma once
// The image of a plane through the optical centre, near a pixel.

#include <Eigen/Core>
#include <cmath>

#include "cameras/mutant.h"
#include "cameras/ray_table.h"

namespace dlsd {

/// Where a pixel lies relative to the image of a plane.
struct CurveOffset {
  double offset_px;        ///< Signed distance to the image curve of the plane, first order.
  Eigen::Vector2d normal;  ///< Unit normal of that curve in the image, towards the plane's normal.
  double rad_per_px;       ///< Change of the ray's angle to the plane along `normal`; > 0.
};

/// rad_per_px is 0 (and the rest unspecified) where the camera does not resolve the plane.
[[nodiscard]] inline CurveOffset curveOffset(const RaySample& sample,
                                             const Eigen::Vector3d& plane_normal) {
  const Eigen::Vector2d g(sample.du.dot(plane_normal), sample.dv.dot(plane_normal));
  const double norm = std::sqrt(g.squaredNorm());
  if (!(norm > 1e-9)) return {0, {1, 0}, 0};
  return {sample.ray.dot(plane_normal) / norm, g / norm, norm};
}

/// Reprojection error of Eq. 8 to first order: the pixel moves by J (x . n) n, where J is the
/// projection's Jacobian, here the pseudo-inverse of (du dv).
[[nodiscard]] inline double reprojectionErrorFirstOrder(const RaySample& sample,
                                                        const Eigen::Vector3d& plane_normal) {
  const double f = sample.ray.dot(plane_normal);
  const double gu = sample.du.dot(plane_normal), gv = sample.dv.dot(plane_normal);
  const double uu = sample.du.squaredNorm(), uv = sample.du.dot(sample.dv);
  const double vv = sample.dv.squaredNorm();
  const double determinant = uu * vv - (DLSD_MUTANT("curve-shear") ? 0 : uv * uv);
  if (!(determinant > 0)) return 0;
  const double du = vv * gu - uv * gv, dv = uu * gv - uv * gu;
  return std::abs(f) * std::sqrt(du * du + dv * dv) / determinant;
}

}  // namespace dlsd
