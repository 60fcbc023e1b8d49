#pragma once
// The plane through the optical centre that fits rays best (paper 4.3): the unit n that minimises
// n' M n, M = sum of w x x', which is the eigenvector of M's smallest eigenvalue.

#include <Eigen/Core>
#include <optional>
#include <span>

namespace dlsd {

/// M (six numbers) and the sum of the weights. Sums of disjoint sets of rays add.
struct RayMoments {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, weight = 0;

  void add(const Eigen::Vector3d& ray, double w) {
    const double wx = w * ray.x(), wy = w * ray.y(), wz = w * ray.z();
    xx += wx * ray.x();
    xy += wx * ray.y();
    xz += wx * ray.z();
    yy += wy * ray.y();
    yz += wy * ray.z();
    zz += wz * ray.z();
    weight += w;
  }
  [[nodiscard]] Eigen::Matrix3d matrix() const {
    Eigen::Matrix3d m;
    m << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    return m;
  }
};

struct PlaneFit {
  Eigen::Vector3d normal;        ///< Unit, first non-zero entry positive.
  double squared_residuals = 0;  ///< Sum of w (x . n)^2: the smallest eigenvalue, >= 0.
  /// Inverse of M on the plane, 0 along the normal: with weights 1 / variance of x . n, the
  /// covariance of the normal to first order.
  Eigen::Matrix3d inverse_in_plane;
};

/// From sums in any frame. No value if the rays span fewer than two directions (second singular
/// value of the rays <= 3e-7 of the first) or their weight is not positive and finite. |n - exact|
/// <= 1e-14 / s^2 for exact input, s^2 = second over first eigenvalue of M, about arc^2 / 12 for an
/// arc (rad).
/// Arcs of 10 px at 450 px / rad: 3e-10 rad.
[[nodiscard]] std::optional<PlaneFit> fitPlane(const RayMoments& moments);

/// From unit rays, in any order, N >= 2. Sums are taken about the rays' mean, which leaves no
/// cancellation: |n - exact| <= 1e-12 / sin(arc) for exact input. No value if the rays span fewer
/// than two directions (second singular value <= 1e-9 of the first).
[[nodiscard]] std::optional<PlaneFit> fitPlane(std::span<const Eigen::Vector3d> rays);

/// One Gauss-Newton step from a normal near the best: for rays within an angle e of a plane near
/// `normal` what is left of the error is of order e^2. No value if the rays span fewer than two
/// directions.
[[nodiscard]] std::optional<Eigen::Vector3d> refinePlane(const RayMoments& moments,
                                                         const Eigen::Vector3d& normal);

}  // namespace dlsd
