#pragma once
#include <algorithm>

#include "cameras/camera_model.h"
#include "cameras/newton.h"
#include "cameras/polynomial.h"

namespace dlsd {

/// Polynomial of the field angle in pixels, as WoodScape's `radial_poly`:
///
///   theta = atan2(sqrt(x^2 + y^2), z),  rho(theta) = k1 theta + k2 theta^2 + k3 theta^3 + k4
///   theta^4 (u, v) = (rho, aspect rho) * (x, y) / sqrt(x^2 + y^2) + (cx, cy)
///
/// Domain: theta < max_theta, where max_theta is the smallest positive sign change of rho'(theta),
/// or pi if there is none below pi; pixels with |(u - cx, (v - cy) / aspect)| < rho(max_theta).
/// Solved once in fromParams. The inverse is a bracketed Newton iteration, run to the last bits.
/// k2 = k3 = k4 = 0 is the equidistant projection. Source: Yogamani et al., "WoodScape" (ICCV
/// 2019).
struct ThetaPolynomial {
  static constexpr std::string_view kName = "theta_polynomial";
  static constexpr std::array<ParamSpec, 7> kParams{{
      {"k1", "px/rad", 1e-3, 1e7, 100, 2000},
      {"k2", "px/rad^2", -1e5, 1e5, -60, 60},
      {"k3", "px/rad^3", -1e5, 1e5, -80, 80},
      {"k4", "px/rad^4", -1e5, 1e5, -20, 20},
      {"aspect", "1", 0.1, 10, 0.9, 1.1},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
  }};

  double k1 = 1, k2 = 0, k3 = 0, k4 = 0, aspect = 1, cx = 0, cy = 0;
  double max_theta = M_PI;   ///< Derived, rad.
  double max_radius = M_PI;  ///< Derived: rho(max_theta), px.

  [[nodiscard]] static ThetaPolynomial fromParams(const std::array<double, 7>& p) {
    ThetaPolynomial m{p[0], p[1], p[2], p[3], p[4], p[5], p[6]};
    const std::array<double, 4> slope{m.k1, 2 * m.k2, 3 * m.k3, 4 * m.k4};
    const std::vector<double> turns = signChanges(slope, 0, M_PI);
    if (!turns.empty()) m.max_theta = turns.front();
    m.max_radius = m.radius(m.max_theta);
    return m;
  }
  [[nodiscard]] std::array<double, 7> params() const { return {k1, k2, k3, k4, aspect, cx, cy}; }
  bool operator==(const ThetaPolynomial&) const = default;

  /// rho, px.
  template <class T>
  [[nodiscard]] T radius(T theta) const {
    return theta * (T(k1) + theta * (T(k2) + theta * (T(k3) + theta * T(k4))));
  }
  template <class T>
  [[nodiscard]] T radiusSlope(T theta) const {
    return T(k1) + theta * (T(2 * k2) + theta * (T(3 * k3) + theta * T(4 * k4)));
  }

  template <class T>
  [[nodiscard]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const T r = std::sqrt(r2);
    const T theta = std::atan2(r, z);
    const T scale = r > T(0) ? radius(theta) / r : T(k1) / z;
    const T u = x * scale + T(cx);
    const T v = T(aspect) * (y * scale) + T(cy);
    return {u, v, theta < T(max_theta) && norm2InRange(r2 + z * z) && pixelInRange(u, v)};
  }

  template <class T>
  [[nodiscard]] Ray<T> unproject(T u, T v) const {
    const T mx = u - T(cx);
    const T my = (v - T(cy)) / T(aspect);
    const T rho = std::sqrt(mx * mx + my * my);
    if (!(rho < T(max_radius)) || !pixelInRange(u, v)) return {T(0), T(0), T(1), false};
    const T theta = fieldAngle(rho);
    const T scale = rho > T(0) ? std::sin(theta) / rho : T(1 / k1);
    return {mx * scale, my * scale, std::cos(theta), theta < T(max_theta)};
  }

  /// theta in [0, max_theta] with rho(theta) = rho, for 0 <= rho < max_radius.
  template <class T>
  [[nodiscard]] T fieldAngle(T rho) const {
    const T hi = T(max_theta);
    const T start = rho / T(k1);
    const T theta = bracketedRoot(
        [&](T x) {
          return ValueAndSlope<T>{radius(x) - rho, radiusSlope(x)};
        },
        T(0),
        hi,
        start < hi / 2 ? start : hi / 2);
    // What the polynomial's own rounding leaves, by one more step in higher precision.
    const Wider<T> wide = theta;
    const T polished =
        static_cast<T>(wide - (radius(wide) - Wider<T>(rho)) / Wider<T>(radiusSlope(theta)));
    return std::abs(polished - theta) <= T(1e-4) * theta && polished < hi ? polished : theta;
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r = std::sqrt(x * x + y * y);  // 0 where project takes its limit, too.
    const double theta = std::atan2(r, z);
    const double slope = radiusSlope(theta) / (r * r + z * z);
    const double s = r > 0 ? radius(theta) / r : k1 / z;
    return radialJacobian(1, aspect, x, y, s, slope * z, -slope * r);
  }

  [[nodiscard]] double maxFieldAngle() const { return max_theta; }
};
static_assert(CameraModel<ThetaPolynomial>);

}  // namespace dlsd
