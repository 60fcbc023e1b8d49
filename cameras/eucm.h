#pragma once
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
///
/// Behind the camera alpha d + (1 - alpha) z cancels, so there it is taken as
/// (alpha^2 beta r^2 + (2 alpha - 1) z^2) / (alpha d - (1 - alpha) z), r^2 = x^2 + y^2, which for
/// alpha >= 1/2 has no cancellation and below only what the domain's bound brings with it.
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
  [[nodiscard]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const T norm2 = r2 + z * z;
    const T q = T(beta) * r2;
    const T denom = denominator(q, z, std::sqrt(q + z * z));
    const T u = T(fx) * (x / denom) + T(cx);
    const T v = T(fy) * (y / denom) + T(cy);
    const bool before_fold =
        alpha <= 0.5 || z > T(0) || T((1 - alpha) * (1 - alpha)) * q > T(2 * alpha - 1) * (z * z);
    return {u, v, denom > T(0) && before_fold && norm2InRange(norm2) && pixelInRange(u, v)};
  }

  template <class T>
  [[nodiscard]] Ray<T> unproject(T u, T v) const {
    const T mx = (u - T(cx)) / T(fx);
    const T my = (v - T(cy)) / T(fy);
    const T m2 = mx * mx + my * my;
    const T q = T(beta) * m2;
    const T disc = T(1) - T(2 * alpha - 1) * q;
    const T root = std::sqrt(disc > T(0) ? disc : T(0));
    // The point of the ellipsoid d = 1, then its direction.
    const T ellipsoid = T(1) + T((1 - alpha) * (1 - alpha)) * q;
    const T scale = (T(alpha) + T(1 - alpha) * root) / ellipsoid;
    const T z = (root - T(alpha * (1 - alpha)) * q) / ellipsoid;
    const T norm = std::sqrt(m2 * (scale * scale) + z * z);
    return {mx * scale / norm, my * scale / norm, z / norm, disc >= T(0) && pixelInRange(u, v)};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r2 = x * x + y * y;
    const double q = beta * r2;
    const double d = std::sqrt(q + z * z);
    const double denom = denominator(q, z, d);
    // alpha z + (1 - alpha) d vanishes at the fold; behind the camera without cancellation.
    const double slope = z >= 0 ? alpha * z + (1 - alpha) * d
                                : ((1 - alpha) * (1 - alpha) * q - (2 * alpha - 1) * (z * z)) /
                                      ((1 - alpha) * d - alpha * z);
    const double g = slope / (d * denom * denom);
    return radialJacobian(fx, fy, x, y, 1 / denom, z * g, -std::sqrt(r2) * g);
  }

  [[nodiscard]] double maxFieldAngle() const {
    return alpha > 0.5 ? std::atan2(std::sqrt((2 * alpha - 1) / beta), -(1 - alpha))
                       : std::atan2(std::sqrt((1 - 2 * alpha) / beta), -alpha);
  }

 private:
  /// alpha d + (1 - alpha) z, for q = beta r^2.
  template <class T>
  [[nodiscard]] T denominator(T q, T z, T d) const {
    const T a = T(alpha), b = T(1 - alpha);
    return z >= T(0) ? a * d + b * z
                     : (T(alpha * alpha) * q + T(2 * alpha - 1) * (z * z)) / (a * d - b * z);
  }
};
static_assert(CameraModel<Eucm>);

}  // namespace dlsd
