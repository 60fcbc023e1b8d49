#pragma once
#include <algorithm>

#include "cameras/camera_model.h"
#include "cameras/polynomial.h"

namespace dlsd {

/// Kannala-Brandt fisheye with four coefficients, as OpenCV's `fisheye` and Kalibr's `equidistant`:
///
///   theta = atan2(sqrt(x^2 + y^2), z),  d(theta) = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6
///   + k4 theta^8) (u, v) = (fx, fy) * d(theta) * (x, y) / sqrt(x^2 + y^2) + (cx, cy)
///
/// Domain: theta < max_theta, where max_theta is the smallest positive sign change of d'(theta), or
/// pi if there is none below pi; pixels of radius r_d < d(max_theta). Solved once in fromParams.
/// The inverse is a Newton iteration inside a bracket that always holds the solution, run to the
/// last bits: it cannot end anywhere else, so no residual has to be judged. Source: Kannala and
/// Brandt, "A generic camera model ..." (PAMI 2006), radial part only.
struct KannalaBrandt {
  static constexpr std::string_view kName = "kannala_brandt";
  static constexpr std::array<ParamSpec, 8> kParams{{
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
      {"k1", "1", -100, 100, -0.1, 0.1},
      {"k2", "1", -100, 100, -0.05, 0.05},
      {"k3", "1", -100, 100, -0.02, 0.02},
      {"k4", "1", -100, 100, -0.005, 0.005},
  }};

  double fx = 1, fy = 1, cx = 0, cy = 0, k1 = 0, k2 = 0, k3 = 0, k4 = 0;
  double max_theta = M_PI;   ///< Derived, rad.
  double max_radius = M_PI;  ///< Derived: d(max_theta).

  [[nodiscard]] static KannalaBrandt fromParams(const std::array<double, 8>& p) {
    KannalaBrandt m{p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]};
    // d' as a polynomial in t = theta^2.
    const std::array<double, 5> slope{1, 3 * m.k1, 5 * m.k2, 7 * m.k3, 9 * m.k4};
    const std::vector<double> turns = signChanges(slope, 0, M_PI * M_PI);
    if (!turns.empty()) m.max_theta = std::min(std::sqrt(turns.front()), M_PI);
    m.max_radius = m.distort(m.max_theta);
    return m;
  }
  [[nodiscard]] std::array<double, 8> params() const { return {fx, fy, cx, cy, k1, k2, k3, k4}; }
  bool operator==(const KannalaBrandt&) const = default;

  template <class T>
  [[nodiscard]] T distort(T theta) const {
    const T t = theta * theta;
    return theta * (T(1) + t * (T(k1) + t * (T(k2) + t * (T(k3) + t * T(k4)))));
  }
  template <class T>
  [[nodiscard]] T distortSlope(T theta) const {
    const T t = theta * theta;
    return T(1) + t * (T(3 * k1) + t * (T(5 * k2) + t * (T(7 * k3) + t * T(9 * k4))));
  }

  template <class T>
  [[nodiscard]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const T r = std::sqrt(r2);
    const T theta = std::atan2(r, z);
    const T scale = r > T(0) ? distort(theta) / r : T(1) / z;
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    return {u, v, theta < T(max_theta) && norm2InRange(r2 + z * z) && pixelInRange(u, v)};
  }

  template <class T>
  [[nodiscard]] Ray<T> unproject(T u, T v) const {
    const T mx = (u - T(cx)) / T(fx);
    const T my = (v - T(cy)) / T(fy);
    const T r_d = std::sqrt(mx * mx + my * my);
    if (!(r_d < T(max_radius)) || !pixelInRange(u, v)) return {T(0), T(0), T(1), false};
    const T theta = undistort(r_d);
    const T scale = r_d > T(0) ? std::sin(theta) / r_d : T(1);
    return {mx * scale, my * scale, std::cos(theta), theta < T(max_theta)};
  }

  /// theta in [0, max_theta] with d(theta) = r_d, for 0 <= r_d < max_radius.
  template <class T>
  [[nodiscard]] T undistort(T r_d) const {
    T lo = 0, hi = T(max_theta);
    T theta = r_d < hi / 2 ? r_d : hi / 2;
    T last_step = hi;
    // Each step at least halves the bracket or the step before the last: 200 bound the worst fold.
    for (int i = 0; i < 200; ++i) {
      const T f = distort(theta) - r_d;
      if (f == T(0)) break;
      (f < T(0) ? lo : hi) = theta;
      T next = theta - f / distortSlope(theta);
      if (!(next > lo && next < hi && std::abs(next - theta) <= last_step / 2)) {
        next = lo + (hi - lo) / 2;
      }
      last_step = std::abs(next - theta);
      theta = next;
      if (last_step <= std::numeric_limits<T>::epsilon() / 2 * theta) break;
    }
    // What the polynomial's own rounding leaves, by one more step in higher precision.
    const auto slope = static_cast<long double>(distortSlope(theta));
    const long double correction =
        (distort(static_cast<long double>(theta)) - static_cast<long double>(r_d)) / slope;
    const T polished = static_cast<T>(static_cast<long double>(theta) - correction);
    return polished >= lo && polished <= hi ? polished : theta;
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r = std::sqrt(x * x + y * y);  // 0 where project takes its limit, too.
    const double theta = std::atan2(r, z);
    const double slope = distortSlope(theta) / (r * r + z * z);
    const double s = r > 0 ? distort(theta) / r : 1 / z;
    return radialJacobian(fx, fy, x, y, s, slope * z, -slope * r);
  }

  [[nodiscard]] double maxFieldAngle() const { return max_theta; }
};
static_assert(CameraModel<KannalaBrandt>);

}  // namespace dlsd
