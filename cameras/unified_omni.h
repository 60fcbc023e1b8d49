#pragma once
#include "cameras/camera_model.h"
#include "cameras/mutant.h"

namespace dlsd {

/// Unified omnidirectional model (Geyer and Daniilidis 2000; Barreto 2001; Mei and Rives 2007
/// without their distortion), Kalibr's `omni` with `none`:
///
///   d = |(x, y, z)|,  (u, v) = (fx, fy) * (x, y) / (z + xi d) + (cx, cy)
///
/// Domain: for xi <= 1 rays with z > -xi d, and every pixel. For xi > 1 the image folds where
/// z = -d / xi: rays with z > -d / xi, and pixels up to the fold, m^2 <= 1 / (xi^2 - 1) with
/// m = ((u - cx) / fx, (v - cy) / fy). xi = 0 is the pinhole.
///
/// Behind the camera z + xi d cancels, so there it is taken as
/// (xi^2 r^2 + (xi^2 - 1) z^2) / (xi d - z), r^2 = x^2 + y^2, which for xi >= 1 has no cancellation
/// and for xi < 1 only what the domain's bound brings with it.
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
    const T norm2 = r2 + z * z;
    const auto [numerator, denominator] = inverseDepth(r2, z, std::sqrt(norm2));
    const T scale = numerator / denominator;
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    const bool before_fold =
        anyOf(DLSD_MUTANT("omni-fold"), z >= T(0), xi <= 1, r2 > T((xi - 1) * (xi + 1)) * (z * z));
    return {u, v, allOf(denominator > T(0), before_fold, norm2InRange(norm2), pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const T mx = (u - T(cx)) * (T(1) / T(fx));
    const T my = (v - T(cy)) * (T(1) / T(fy));
    const T m2 = mx * mx + my * my;
    const T disc = T(1) + T((1 - xi) * (1 + xi)) * m2;
    const T root = std::sqrt(std::max(disc, T(0)));
    const T inverse = T(DLSD_MUTANT("omni-unit") ? 1 + 1e-14 : 1) / (T(1) + m2);
    const T scale = (T(xi) + root) * inverse;
    // z = scale - xi, written without the cancellation that large xi brings.
    const T z = (root - T(xi) * m2) * inverse;
    return {mx * scale, my * scale, z, allOf(disc >= T(0), pixelInRange(u, v))};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r2 = x * x + y * y;
    const double d = std::sqrt(r2 + z * z);
    const auto [numerator, denominator] = inverseDepth(r2, z, d);
    const double s = numerator / denominator;
    // d + xi z vanishes at the fold; behind the camera without cancellation, as the denominator.
    const double slope = z >= 0 ? d + xi * z : (r2 - (xi - 1) * (xi + 1) * z * z) / (d - xi * z);
    const double g = slope / d * (s * s);
    return radialJacobian(fx,
                          fy,
                          x,
                          y,
                          s,
                          z * g,
                          (DLSD_MUTANT("omni-jacobian") ? -1 - 1e-8 : -1) * std::sqrt(r2) * g);
  }

  [[nodiscard]] double maxFieldAngle() const {
    return xi > 1 ? std::atan2(std::sqrt((xi - 1) * (xi + 1)), -1.0)
                  : std::atan2(std::sqrt((1 - xi) * (1 + xi)), -xi);
  }

 private:
  template <class T>
  struct Quotient {
    T numerator, denominator;
  };
  /// 1 / (z + xi d); the denominator has the sign of z + xi d.
  template <class T>
  [[nodiscard, gnu::always_inline]] Quotient<T> inverseDepth(T r2, T z, T d) const {
    const bool front = z >= T(0);
    const T behind = T(xi * xi) * r2 + T((xi - 1) * (xi + 1)) * (z * z);
    return {select(front, T(1), T(xi) * d - z), select(front, z + T(xi) * d, behind)};
  }
};
static_assert(CameraModel<UnifiedOmni>);

}  // namespace dlsd
