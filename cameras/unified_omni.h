#pragma once
#include "cameras/camera_model.h"
#include "cameras/unified_sphere.h"

namespace dlsd {

/// Unified omnidirectional model (unified_sphere.h), Kalibr's `omni` with `none`:
///
///   (u, v) = (fx, fy) * (x, y) / (z + xi |(x, y, z)|) + (cx, cy)
///
/// Domain: that of UnifiedSphere, with m = ((u - cx) / fx, (v - cy) / fy). xi = 0 is the pinhole.
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
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const auto [scale, valid] = sphere().toPlane(r2, z);
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    return {u, v, allOf(valid, norm2InRange(r2 + z * z), pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    Ray<T> ray = sphere().toRay((u - T(cx)) * (T(1) / T(fx)), (v - T(cy)) * (T(1) / T(fy)));
    ray.valid = allOf(ray.valid, pixelInRange(u, v));
    return ray;
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    return sphere().derivative(fx, fy, x, y, z).jacobian;
  }

  [[nodiscard]] double maxFieldAngle() const { return sphere().maxFieldAngle(); }

 private:
  [[nodiscard, gnu::always_inline]] UnifiedSphere sphere() const { return {xi}; }
};
static_assert(CameraModel<UnifiedOmni>);

}  // namespace dlsd
