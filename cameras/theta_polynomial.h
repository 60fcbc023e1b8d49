#pragma once
#include <algorithm>

#include "cameras/camera_model.h"
#include "cameras/mutant.h"
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
/// Solved once in fromParams. The inverse is as that of KannalaBrandt: two of Newton's steps from a
/// fitted start, else a bracketed iteration, run to the last bits.
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
  FittedStart start{};       ///< Derived: of the field angle over rho.

  [[nodiscard]] static ThetaPolynomial fromParams(const std::array<double, 7>& p) {
    ThetaPolynomial m{p[0], p[1], p[2], p[3], p[4], p[5], p[6]};
    const std::array<double, 4> slope{m.k1, 2 * m.k2, 3 * m.k3, 4 * m.k4};
    const std::vector<double> turns = signChanges(slope, 0, M_PI);
    if (!turns.empty()) m.max_theta = turns.front();
    m.max_radius = m.radius(m.max_theta);
    m.start = FittedStart::fit(m.radius(std::min(m.max_theta, kStartAngle)),
                               m.max_radius,
                               [&](double rho) { return m.fieldAngle(rho); });
    return m;
  }
  [[nodiscard]] std::array<double, 7> params() const { return {k1, k2, k3, k4, aspect, cx, cy}; }
  bool operator==(const ThetaPolynomial&) const = default;

  /// rho, px.
  template <class T>
  [[nodiscard, gnu::always_inline]] T radius(T theta) const {
    return theta * ((T(k1) + theta * T(k2)) + (theta * theta) * (T(k3) + theta * T(k4)));
  }
  template <class T>
  [[nodiscard, gnu::always_inline]] T radiusSlope(T theta) const {
    const T last = T((DLSD_MUTANT("theta-slope") ? 4 - 1e-6 : 4) * k4);
    return (T(k1) + theta * T(2 * k2)) + (theta * theta) * (T(3 * k3) + theta * last);
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const T r = axisDistance(r2);
    const T theta = polarAngle(r, z);
    const T scale = radius(theta) * (T(1) / r);
    const T u = x * scale + T(cx);
    const T v = T(aspect) * (y * scale) + T(cy);
    return {u, v, allOf(theta < T(max_theta), norm2InRange(r2 + z * z), pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const auto& attempt = attemptUnproject(u, v);
    return attempt.settled ? static_cast<Ray<T>>(attempt) : iterateUnproject(u, v);
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Attempt<Ray<T>> attemptUnproject(T u, T v) const {
    const auto& m = radial(u, v);
    const auto& theta = newtonSteps(
        [&](T a) {
          return Jet<T>{(T(k1) * a - m.rho) + (a * a) * (T(k2) + a * (T(k3) + a * T(k4))),
                        radiusSlope(a),
                        T(2 * k2) + a * (T(6 * k3) + a * T(12 * k4)),
                        T(6 * k3) + a * T(24 * k4)};
        },
        start.at(m.rho));
    return {rayAt(m, theta.x), anyOf(allOf(theta.arrived, theta.x < T(max_theta)), !m.valid)};
  }

  /// theta in [0, max_theta] with rho(theta) = rho, for 0 <= rho < max_radius.
  template <class T>
  [[nodiscard]] T fieldAngle(T rho) const {
    const T hi = T(max_theta);
    const T equidistant = rho / T(k1);
    const T theta = bracketedRoot(
        [&](T x) {
          return ValueAndSlope<T>{radius(x) - rho, radiusSlope(x)};
        },
        T(0),
        hi,
        std::min(equidistant, hi / 2));
    // What the polynomial's own rounding leaves, by one more step in higher precision.
    const Wider<T> wide = theta;
    const T polished =
        static_cast<T>(wide - (radius(wide) - Wider<T>(rho)) / Wider<T>(radiusSlope(theta)));
    return std::abs(polished - theta) <= T(1e-4) * theta && polished < hi ? polished : theta;
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r = std::sqrt(x * x + y * y);  // 0 where project takes its limit, too.
    const double theta = polarAngle(r, z);
    const double slope = radiusSlope(theta) / (r * r + z * z);
    const double s = r > 0 ? radius(theta) / r : k1 / z;
    return radialJacobian(1, aspect, x, y, s, slope * z, -slope * r);
  }

  [[nodiscard]] double maxFieldAngle() const { return max_theta; }

 private:
  /// Up to here the start is fitted; few lenses see further.
  static constexpr double kStartAngle = 2.0;

  /// A pixel relative to the principal point, aspect taken out, and its distance from there, px.
  template <class T>
  struct Radial {
    T x, y, rho;
    bool valid;
  };
  template <class T>
  [[nodiscard, gnu::always_inline]] Radial<T> radial(T u, T v) const {
    const T mx = u - T(cx);
    const T my = (v - T(cy)) * (T(1) / T(aspect));
    const T rho = axisDistance(mx * mx + my * my);
    return {mx, my, rho, allOf(rho < T(max_radius), pixelInRange(u, v))};
  }
  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> rayAt(const Radial<T>& m, T theta) const {
    const auto [sine, cosine] = sinCos(theta);
    const T scale = sine * (T(1) / m.rho);
    return {m.x * scale, m.y * scale, cosine, allOf(m.valid, theta < T(max_theta))};
  }
  template <class T>
  [[nodiscard]] Ray<T> iterateUnproject(T u, T v) const {
    const Radial<T> m = radial(u, v);
    return rayAt(m, m.valid ? fieldAngle(m.rho) : T(0));
  }
};
static_assert(CameraModel<ThetaPolynomial>);

}  // namespace dlsd
