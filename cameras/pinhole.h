#pragma once
#include "cameras/camera_model.h"
#include "cameras/mutant.h"

namespace dlsd {

/// Pinhole without distortion: u = fx x / z + cx, v = fy y / z + cy.
///
/// Domain: z > 0 (field angle < 90 degrees). Every pixel has a ray.
struct Pinhole {
  static constexpr std::string_view kName = "pinhole";
  static constexpr std::array<ParamSpec, 4> kParams{{
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
  }};

  double fx = 1, fy = 1, cx = 0, cy = 0;

  [[nodiscard]] static Pinhole fromParams(const std::array<double, 4>& p) {
    return {p[0], p[1], p[2], p[3]};
  }
  [[nodiscard]] std::array<double, 4> params() const { return {fx, fy, cx, cy}; }
  bool operator==(const Pinhole&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const T scale = T(1) / z;
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    return {u,
            v,
            allOf(anyOf(z > T(0), DLSD_MUTANT("pinhole-behind")),
                  norm2InRange(x * x + y * y + z * z),
                  pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const T mx = (u - T(cx)) * (T(1) / T(fx));
    const T my = (v - T(cy)) * (T(1) / T(fy));
    const T s = T(1) / std::sqrt(mx * mx + my * my + T(1));
    return {mx * s, my * s, s, anyOf(pixelInRange(u, v), DLSD_MUTANT("pinhole-any-pixel"))};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    ProjectionJacobian J;
    J << fx / z, 0, -fx * x / (z * z), 0, fy / z, -fy * y / (z * z);
    return J;
  }

  [[nodiscard]] double maxFieldAngle() const { return M_PI / 2; }
};
static_assert(CameraModel<Pinhole>);

}  // namespace dlsd
