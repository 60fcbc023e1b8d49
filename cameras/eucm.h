#pragma once
#include "cameras/alpha_sphere.h"
#include "cameras/camera_model.h"

namespace dlsd {

/// Extended unified camera model (Khomutenko, Garcia and Martinet 2016), Kalibr's `eucm`:
///
///   d = sqrt(beta (x^2 + y^2) + z^2),
///   (u, v) = (fx, fy) * (x, y) / (alpha d + (1 - alpha) z) + (cx, cy)
///
/// It is the unified model with xi = alpha / (1 - alpha) and f = (1 - alpha) fx after x and y are
/// stretched by sqrt(beta): the sphere becomes an ellipsoid. alpha = 0 is the pinhole, alpha = 1 is
/// orthographic (for beta = 1).
///
/// Domain: for alpha <= 1/2 rays with alpha d + (1 - alpha) z > 0, and every pixel. For alpha > 1/2
/// the image folds where alpha z = -(1 - alpha) d: rays with alpha z > -(1 - alpha) d, and pixels
/// up to the fold, beta m^2 <= 1 / (2 alpha - 1) with m = ((u - cx) / fx, (v - cy) / fy).
struct Eucm {
  static constexpr std::string_view kName = "eucm";
  static constexpr std::array<ParamSpec, 6> kParams{{
      {"alpha", "1", 0, 1, 0, 0.8},
      {"beta", "1", 1e-3, 1e3, 0.5, 2},
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
  }};

  double alpha = 0, beta = 1, fx = 1, fy = 1, cx = 0, cy = 0;

  [[nodiscard]] static Eucm fromParams(const std::array<double, 6>& p) {
    return {p[0], p[1], p[2], p[3], p[4], p[5]};
  }
  [[nodiscard]] std::array<double, 6> params() const { return {alpha, beta, fx, fy, cx, cy}; }
  bool operator==(const Eucm&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const T norm2 = r2 + z * z;
    const T q = T(beta) * r2;
    const auto [numerator, denominator] = sphere().inverseDepth(q, z, std::sqrt(q + z * z));
    const T scale = numerator / denominator;
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    return {u,
            v,
            allOf(denominator > T(0),
                  sphere().beforeFold(q, z),
                  norm2InRange(norm2),
                  pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const T mx = (u - T(cx)) * (T(1) / T(fx));
    const T my = (v - T(cy)) * (T(1) / T(fy));
    const T m2 = mx * mx + my * my;
    // The point d = 1, then its direction.
    const auto& [scale, z, valid] = sphere().unproject(T(beta) * m2);
    const T inverse = T(1) / std::sqrt(m2 * (scale * scale) + z * z);
    const T across = scale * inverse;
    return {mx * across, my * across, z * inverse, allOf(valid, pixelInRange(u, v))};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r2 = x * x + y * y;
    const double q = beta * r2;
    const double d = std::sqrt(q + z * z);
    const auto [numerator, denominator] = sphere().inverseDepth(q, z, d);
    const double s = numerator / denominator;
    const double g = sphere().slope(q, z, d) / d * (s * s);
    return radialJacobian(fx, fy, x, y, s, z * g, -std::sqrt(r2) * g);
  }

  [[nodiscard]] double maxFieldAngle() const {
    const auto [sine, cosine] = sphere().bound();
    return std::atan2(sine / std::sqrt(beta), cosine);
  }

 private:
  [[nodiscard]] AlphaSphere sphere() const { return {alpha}; }
};
static_assert(CameraModel<Eucm>);

}  // namespace dlsd
