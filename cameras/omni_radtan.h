#pragma once
#include "cameras/camera_model.h"
#include "cameras/radtan.h"
#include "cameras/unified_sphere.h"

namespace dlsd {

/// Unified omnidirectional model with radial-tangential distortion (Mei and Rives, "Single view
/// point omnidirectional camera calibration from planar grids", 2007), as OpenCV's `omnidir` and
/// Kalibr's `omni` with `radtan` (skew = 0):
///
///   d = |(x, y, z)|,  (mx, my) = D((x, y) / (z + xi d)),  D as in radtan.h with k3 = 0
///   u = fx mx + skew my + cx,  v = fy my + cy
///
/// Domain: that of UnifiedSphere and, in the plane of m, the disc of radius max_radius on which D
/// is one-to-one and which ends at the fold of the sphere, 1 / sqrt(xi^2 - 1), for xi > 1. Pixels:
/// the image of that disc.
struct OmniRadtan {
  static constexpr std::string_view kName = "omni_radtan";
  static constexpr std::array<ParamSpec, 10> kParams{{
      {"xi", "1", 0, 1e3, 0, 3},
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
      {"k1", "1", -1e2, 1e2, -0.4, 0.4},
      {"k2", "1", -1e4, 1e4, -0.2, 0.2},
      {"p1", "1", -10, 10, -0.01, 0.01},
      {"p2", "1", -10, 10, -0.01, 0.01},
      {"skew", "px", -1e7, 1e7, -10, 10},
  }};

  double xi = 0, fx = 1, fy = 1, cx = 0, cy = 0;
  Radtan radtan;
  double skew = 0;
  double max_radius = Radtan::kUnbounded;  ///< Derived: the smaller of both bounds.
  double max_theta = M_PI / 2;             ///< Derived: field angle there, rad.

  [[nodiscard]] static OmniRadtan fromParams(const std::array<double, 10>& p) {
    OmniRadtan m{p[0], p[1], p[2], p[3], p[4], Radtan::make(p[5], p[6], p[7], p[8], 0), p[9]};
    const double fold = m.xi > 1 ? 1 / std::sqrt((m.xi - 1) * (m.xi + 1)) : Radtan::kUnbounded;
    if (fold <= m.radtan.max_radius) {
      m.max_radius = fold;
      m.max_theta = m.sphere().maxFieldAngle();
    } else {
      m.max_radius = m.radtan.max_radius;
      const auto ray = m.sphere().toRay(m.max_radius, 0.0);
      m.max_theta = std::atan2(ray.x, ray.z);
    }
    return m;
  }
  [[nodiscard]] std::array<double, 10> params() const {
    return {xi, fx, fy, cx, cy, radtan.k1, radtan.k2, radtan.p1, radtan.p2, skew};
  }
  bool operator==(const OmniRadtan&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const auto& attempt = attemptProject(x, y, z);
    return attempt.settled ? static_cast<Pixel<T>>(attempt) : projectWide(x, y, z);
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Attempt<Pixel<T>> attemptProject(T x, T y, T z) const {
    const auto& plane = toPlane(x, y, z);
    const auto [mx, my] = radtan.distort(plane.x, plane.y);
    const T u = T(fx) * mx + T(skew) * my + T(cx);
    const T v = T(fy) * my + T(cy);
    const bool valid = allOf(plane.valid, norm2InRange(x * x + y * y + z * z), pixelInRange(u, v));
    // The distortion multiplies relative errors of the plane's point by f' / R, and at the fold of
    // the sphere the ray's own resolution does not excuse them.
    const T t = plane.x * plane.x + plane.y * plane.y;
    const T slope = T(1) + t * (T(3 * radtan.k1) + t * T(5 * radtan.k2));
    const T ratio = T(1) + t * (T(radtan.k1) + t * T(radtan.k2));
    return {{u, v, valid}, anyOf(slope <= T(2) * ratio, !valid)};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const auto& attempt = attemptUnproject(u, v);
    return attempt.settled ? static_cast<Ray<T>>(attempt) : iterateUnproject(u, v);
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Attempt<Ray<T>> attemptUnproject(T u, T v) const {
    const T my = (v - T(cy)) * (T(1) / T(fy));
    const T mx = (u - T(cx) - T(skew) * my) * (T(1) / T(fx));
    const auto& p = radtan.attemptUndistort(mx, my, max_radius);
    const auto& ray = sphere().toRay(p.x, p.y);
    return {{ray.x, ray.y, ray.z, allOf(p.valid, pixelInRange(u, v))}, p.settled};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const auto [plane, s] = sphere().derivative(1, 1, x, y, z);
    Eigen::Matrix2d A;
    A << fx, skew, 0, fy;
    const ProjectionJacobian J = A * (radtan.jacobian(x * s, y * s) * plane);
    // Euler: J ray = 0, which the product keeps only to rounding of its largest factor.
    const Eigen::RowVector3d ray(x, y, z);
    return J - (J * ray.transpose()) * (ray / ray.squaredNorm());
  }

  [[nodiscard]] double maxFieldAngle() const { return max_theta; }

 private:
  [[nodiscard, gnu::always_inline]] UnifiedSphere sphere() const { return {xi}; }

  /// (x, y) / (z + xi d).
  template <class T>
  [[nodiscard, gnu::always_inline]] PlanePoint<T> toPlane(T x, T y, T z) const {
    const auto [scale, valid] = sphere().toPlane(x * x + y * y, z);
    const T nx = x * scale, ny = y * scale;
    return {nx, ny, allOf(valid, std::sqrt(nx * nx + ny * ny) < T(radtan.max_radius))};
  }

  template <class T>
  [[nodiscard]] Pixel<T> projectWide(T x, T y, T z) const {
    using W = Wider<T>;
    const PlanePoint<W> plane = toPlane(W(x), W(y), W(z));
    const auto [mx, my] = radtan.distort(plane.x, plane.y);
    const T u = static_cast<T>(W(fx) * mx + W(skew) * my + W(cx));
    const T v = static_cast<T>(W(fy) * my + W(cy));
    return {u, v, plane.valid && norm2InRange(x * x + y * y + z * z) && pixelInRange(u, v)};
  }

  template <class T>
  [[nodiscard]] Ray<T> iterateUnproject(T u, T v) const {
    using W = Wider<T>;
    const W my = (W(v) - W(cy)) / W(fy);
    const W mx = (W(u) - W(cx) - W(skew) * my) / W(fx);
    const auto [x, y, valid] = radtan.undistort<T>(mx, my, max_radius);
    const auto ray = sphere().toRay(x, y);
    return {static_cast<T>(ray.x),
            static_cast<T>(ray.y),
            static_cast<T>(ray.z),
            valid && pixelInRange(u, v)};
  }
};
static_assert(CameraModel<OmniRadtan>);

}  // namespace dlsd
