#pragma once
#include "cameras/camera_model.h"
#include "cameras/mutant.h"

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
    return {p[0],
            p[1],
            p[2],
            p[3],
            p[4],
            DLSD_MUTANT("fov-series") && p[4] < 0.01 ? p[4] - p[4] * p[4] * p[4] / 12
                                                     : 2 * std::tan(p[4] / 2)};
  }
  [[nodiscard]] std::array<double, 5> params() const { return {fx, fy, cx, cy, omega}; }
  bool operator==(const Fov&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const bool pinhole = omega < kPinholeOmega;
    const T r2 = x * x + y * y;
    const T r = axisDistance(r2);
    const T r_d = polarAngle(T(two_tan_half_omega) * r, z) * T(1 / omega);
    const T scale = select(pinhole, T(1), r_d) / select(pinhole, z, r);
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    // Not alpha < pi: for small omega alpha rounds to pi while the ray is still far from -z.
    const bool off_axis = allOf(r2 >= std::numeric_limits<T>::min(), !pinhole);
    return {u, v, allOf(anyOf(z > T(0), off_axis), norm2InRange(r2 + z * z), pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const bool pinhole = omega < kPinholeOmega;
    const T mx = (u - T(cx)) * (T(1) / T(fx));
    const T my = (v - T(cy)) * (T(1) / T(fy));
    const T r_d = axisDistance(mx * mx + my * my);
    const T alpha = r_d * T(omega);
    const auto [sin_a, cos_a] = sinCos(alpha);
    // (r, z) is along (sin(alpha) / (2 tan(omega / 2)), cos(alpha)).
    const T r = select(pinhole, r_d, sin_a * T(1 / two_tan_half_omega));
    const T z = select(pinhole, T(1), cos_a);
    const T inv_norm = T(1) / std::sqrt(r * r + z * z);
    const T scale = (r * (T(1) / r_d)) * inv_norm;
    return {mx * scale,
            my * scale,
            z * inv_norm,
            allOf(anyOf(pinhole, alpha < T(M_PI), DLSD_MUTANT("fov-wrap")), pixelInRange(u, v))};
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
