#pragma once
#include "cameras/camera_model.h"

namespace dlsd {

/// Unified omnidirectional model (Geyer and Daniilidis 2000; Barreto 2001; Mei and Rives 2007 without
/// their distortion), Kalibr's `omni` with `none`:
///
///   d = |(x, y, z)|,  (u, v) = (fx, fy) * (x, y) / (z + xi d) + (cx, cy)
///
/// Domain (w = min(xi, 1 / xi)): rays with z > -w d. For xi <= 1 every pixel has a ray; for xi > 1 the
/// image folds at m^2 = 1 / (xi^2 - 1), m = ((u - cx) / fx, (v - cy) / fy), and pixels up to there,
/// m^2 <= 1 / (xi^2 - 1), have one.
struct UnifiedOmni {
  static constexpr std::string_view kName = "omni";
  static constexpr std::array<ParamSpec, 5> kParams{{
      {"xi", "1", 0, 1e3, 0, 3},
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
  }};

  double xi = 0, fx = 1, fy = 1, cx = 0, cy = 0;

  [[nodiscard]] static UnifiedOmni fromParams(const std::array<double, 5>& p) {
    return {p[0], p[1], p[2], p[3], p[4]};
  }
  [[nodiscard]] std::array<double, 5> params() const { return {xi, fx, fy, cx, cy}; }
  bool operator==(const UnifiedOmni&) const = default;

  template <class T>
  [[nodiscard]] Pixel<T> project(T x, T y, T z) const {
    const T norm2 = x * x + y * y + z * z;
    const T d = std::sqrt(norm2);
    const T w = T(xi > 1 ? 1 / xi : xi);
    const T denom = z + T(xi) * d;
    const T u = T(fx) * (x / denom) + T(cx);
    const T v = T(fy) * (y / denom) + T(cy);
    return {u, v, z > -w * d && norm2InRange(norm2) && pixelInRange(u, v)};
  }

  template <class T>
  [[nodiscard]] Ray<T> unproject(T u, T v) const {
    const T mx = (u - T(cx)) / T(fx);
    const T my = (v - T(cy)) / T(fy);
    const T m2 = mx * mx + my * my;
    const T disc = T(1) + T((1 - xi) * (1 + xi)) * m2;
    const T root = std::sqrt(disc > T(0) ? disc : T(0));
    const T scale = (T(xi) + root) / (T(1) + m2);
    // z = scale - xi, written without the cancellation that large xi brings.
    const T z = (root - T(xi) * m2) / (T(1) + m2);
    return {mx * scale, my * scale, z, disc >= T(0) && pixelInRange(u, v)};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r = std::hypot(x, y);
    const double d = std::hypot(r, z);
    const double denom = z + xi * d;
    const double g = (1 + xi * z / d) / (denom * denom);
    return radialJacobian(fx, fy, x, y, 1 / denom, z * g, -r * g);
  }

  [[nodiscard]] double maxFieldAngle() const { return std::acos(-(xi > 1 ? 1 / xi : xi)); }
};
static_assert(CameraModel<UnifiedOmni>);

}  // namespace dlsd
