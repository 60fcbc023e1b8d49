#pragma once
#include "cameras/camera_model.h"

namespace dlsd {

/// FoV (ATAN) model of Devernay and Faugeras, "Straight lines have to be straight" (2001),
/// continued smoothly past 90 degrees:
///
///   alpha = atan2(2 tan(omega / 2) r, z),  r = sqrt(x^2 + y^2),  r_d = alpha / omega
///   (u, v) = (fx, fy) * r_d * (x, y) / r + (cx, cy)
///
/// For z > 0 this is the textbook form r_d = atan(2 tan(omega / 2) r / z) / omega. omega = 0 is the
/// pinhole, to which the model converges.
///
/// Domain: every ray but -z, and pixels with r_d omega < pi. For omega < kPinholeOmega, where the
/// two models differ by less than 1e-18 (r / z)^2 relative: z > 0, every pixel.
struct Fov {
  static constexpr std::string_view kName = "fov";
  static constexpr double kPinholeOmega = 1e-9;
  static constexpr std::array<ParamSpec, 5> kParams{{
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
      {"omega", "rad", 0, 3.1, 0.5, 1.5},
  }};

  double fx = 1, fy = 1, cx = 0, cy = 0, omega = 0;
  double two_tan_half_omega = 0;  ///< Derived.

  [[nodiscard]] static Fov fromParams(const std::array<double, 5>& p) {
    return {p[0], p[1], p[2], p[3], p[4], 2 * std::tan(p[4] / 2)};
  }
  [[nodiscard]] std::array<double, 5> params() const { return {fx, fy, cx, cy, omega}; }
  bool operator==(const Fov&) const = default;

  template <class T>
  [[nodiscard]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const bool size_ok = norm2InRange(r2 + z * z);
    if (omega < kPinholeOmega) {
      const T u = T(fx) * (x / z) + T(cx);
      const T v = T(fy) * (y / z) + T(cy);
      return {u, v, z > T(0) && size_ok && pixelInRange(u, v)};
    }
    const T r = std::sqrt(r2);
    const T alpha = std::atan2(T(two_tan_half_omega) * r, z);
    // On the axis (r = 0, z > 0): r_d / r -> 2 tan(omega / 2) / (omega z).
    const T scale = r > T(0) ? alpha / (T(omega) * r) : T(two_tan_half_omega / omega) / z;
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    // Not alpha < pi: for small omega alpha rounds to pi while the ray is still far from -z.
    return {u, v, (r > T(0) || z > T(0)) && size_ok && pixelInRange(u, v)};
  }

  template <class T>
  [[nodiscard]] Ray<T> unproject(T u, T v) const {
    const T mx = (u - T(cx)) / T(fx);
    const T my = (v - T(cy)) / T(fy);
    const T r_d = std::sqrt(mx * mx + my * my);
    if (omega < kPinholeOmega) {
      const T s = T(1) / std::sqrt(r_d * r_d + T(1));
      return {mx * s, my * s, s, pixelInRange(u, v)};
    }
    const T alpha = r_d * T(omega);
    const T sin_a = std::sin(alpha);
    const T cos_a = std::cos(alpha);
    // (r, z) is along (sin(alpha) / (2 tan(omega / 2)), cos(alpha)).
    const T radial = sin_a / T(two_tan_half_omega);
    const T inv_norm = T(1) / std::sqrt(radial * radial + cos_a * cos_a);
    const T scale = (r_d > T(0) ? radial / r_d : T(omega / two_tan_half_omega)) * inv_norm;
    return {mx * scale, my * scale, cos_a * inv_norm, alpha < T(M_PI) && pixelInRange(u, v)};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r = std::sqrt(x * x + y * y);  // 0 where project takes its limit, too.
    if (omega < kPinholeOmega) return radialJacobian(fx, fy, x, y, 1 / z, 1 / z, -r / (z * z));
    const double k = two_tan_half_omega;
    const double denom = omega * (k * k * r * r + z * z);
    const double s = r > 0 ? std::atan2(k * r, z) / (omega * r) : k / (omega * z);
    return radialJacobian(fx, fy, x, y, s, k * z / denom, -k * r / denom);
  }

  [[nodiscard]] double maxFieldAngle() const { return omega < kPinholeOmega ? M_PI / 2 : M_PI; }
};
static_assert(CameraModel<Fov>);

}  // namespace dlsd
