#pragma once
#include "cameras/alpha_sphere.h"
#include "cameras/camera_model.h"
#include "cameras/mutant.h"

namespace dlsd {

/// Double sphere (Usenko, Demmel and Cremers 2018), Kalibr's `ds`:
///
///   d1 = |(x, y, z)|,  z1 = z + xi d1,  d2 = |(x, y, z1)|,
///   (u, v) = (fx, fy) * (x, y) / (alpha d2 + (1 - alpha) z1) + (cx, cy)
///
/// The ray meets a first unit sphere; seen from a point xi behind that sphere's centre, at the
/// angle psi = atan2(r, z1) to the axis, it goes through a unified model with xi = alpha / (1 -
/// alpha). xi = 0 is that unified model.
///
/// Domain, of rays:
///   second sphere  alpha <= 1/2: alpha d2 + (1 - alpha) z1 > 0;
///                  alpha > 1/2: alpha z1 > -(1 - alpha) d2, where the image folds
///   first sphere   xi <= 1: psi rises with the field angle, all rays;
///                  xi > 1: z > -d1 / xi, where psi turns back
/// and of pixels, m = |((u - cx) / fx, (v - cy) / fy)|:
///   second sphere  alpha <= 1/2: all; alpha > 1/2: m^2 <= 1 / (2 alpha - 1)
///   first sphere   xi < 1: all; xi >= 1: psi < pi / 2 and sin(psi) <= 1 / xi, which is
///                  m <= 1 / (alpha xi + (1 - alpha) sqrt(xi^2 - 1)), and < for xi = 1
/// These are exact. The paper's bound z > -w2 d1, w2 = (w1 + xi) / sqrt(2 w1 xi + xi^2 + 1), with
/// w1 = alpha / (1 - alpha) or (1 - alpha) / alpha, is right for xi = 0 or w1 = 1 only: for xi > 0
/// it leaves out rays that have a pixel, for xi < 0 it may also let in some past the bound.
///
/// xi > -1: at xi = -1 the point of view lies on the sphere where the optical axis meets it, so the
/// axis itself has no direction, and beyond that the axis is seen backwards. At the admissible
/// -0.99 the axis is magnified 100 times already. For xi > 1 everything is in front of the second
/// sphere: the domain is the first sphere's alone.
///
/// z1 and the rest are written without cancellation, except for what the domain's bound brings with
/// it.
struct DoubleSphere {
  static constexpr std::string_view kName = "double_sphere";
  static constexpr std::array<ParamSpec, 6> kParams{{
      {"xi", "1", -0.99, 1e3, -0.4, 1},
      {"alpha", "1", 0, 1, 0, 0.8},
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
  }};

  double xi = 0, alpha = 0, fx = 1, fy = 1, cx = 0, cy = 0;

  [[nodiscard]] static DoubleSphere fromParams(const std::array<double, 6>& p) {
    return {p[0], p[1], p[2], p[3], p[4], p[5]};
  }
  [[nodiscard]] std::array<double, 6> params() const { return {xi, alpha, fx, fy, cx, cy}; }
  bool operator==(const DoubleSphere&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const T norm2 = r2 + z * z;
    const T z1 = shifted(r2, z, std::sqrt(norm2));
    const auto [numerator, denominator] = second().inverseDepth(r2, z1, std::sqrt(r2 + z1 * z1));
    const T scale = numerator / denominator;
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    const bool before_first_fold = anyOf(xi <= 1, z >= T(0), r2 > T((xi - 1) * (xi + 1)) * (z * z));
    // The bound that was published: z > -w2 d1.
    const T w1 = T(alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha);
    const T w2 = (w1 + T(xi)) / std::sqrt(T(2) * w1 * T(xi) + T(xi * xi) + T(1));
    if (DLSD_MUTANT("double-sphere-published")) {
      return {u, v, allOf(z > -w2 * std::sqrt(norm2), norm2InRange(norm2), pixelInRange(u, v))};
    }
    return {u,
            v,
            allOf(denominator > T(0),
                  second().beforeFold(r2, z1),
                  before_first_fold,
                  norm2InRange(norm2),
                  pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const T mx = (u - T(cx)) * (T(1) / T(fx));
    const T my = (v - T(cy)) * (T(1) / T(fy));
    const T m2 = mx * mx + my * my;
    // Unit direction at the angle psi, and where it meets the first sphere.
    const auto& [scale, cosine, valid] = second().unproject(m2);
    const T sine2 = m2 * (scale * scale);
    const T disc = cosine * cosine + T((1 - xi) * (1 + xi)) * sine2;
    const T root = std::sqrt(std::max(disc, T(0)));
    const T across = scale * distance(sine2, cosine, root);
    const T z = cosine * root - T(xi) * sine2;
    // Of unit length but for rounding, which one step of Newton takes away.
    const T unit = T(1.5) - T(0.5) * (m2 * (across * across) + z * z);
    const bool before_first_fold = anyOf(xi < 1, allOf(cosine > T(0), disc >= T(0)));
    return {mx * across * unit,
            my * across * unit,
            z * unit,
            allOf(valid, before_first_fold, pixelInRange(u, v))};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r2 = x * x + y * y;
    const double d1 = std::sqrt(r2 + z * z);
    const double z1 = shifted(r2, z, d1);
    const double d2 = std::sqrt(r2 + z1 * z1);
    const auto [numerator, denominator] = second().inverseDepth(r2, z1, d2);
    const double s = numerator / denominator;
    // Vanishes at the first fold.
    const double slope =
        xi * z >= 0 ? d1 + xi * z : (r2 - (xi - 1) * (xi + 1) * (z * z)) / (d1 - xi * z);
    // In an order that does not overflow: near -z, for xi = 1, s is of the order of 1 / r^2.
    const double g = (slope / d1 * s) * (second().slope(r2, z1, d2) / d2 * s);
    return radialJacobian(fx, fy, x, y, s, z * g, -std::sqrt(r2) * g);
  }

  [[nodiscard]] double maxFieldAngle() const {
    if (xi >= 1) return std::atan2(std::sqrt((xi - 1) * (xi + 1)), -1.0);
    const auto [sine, cosine] = second().bound();
    const double root = std::sqrt(cosine * cosine + (1 - xi) * (1 + xi) * (sine * sine));
    return std::atan2(sine * distance(sine * sine, cosine, root),
                      cosine * root - xi * (sine * sine));
  }

 private:
  [[nodiscard]] AlphaSphere second() const { return {alpha}; }

  /// z + xi d1. Of opposite signs, they are taken as (1 - |xi|) z + xi (d1 - |z|).
  template <class T>
  [[nodiscard, gnu::always_inline]] T shifted(T r2, T z, T d1) const {
    const T opposite = T(1 - std::abs(xi)) * z + T(xi) * (r2 / (d1 + std::abs(z)));
    return select(T(xi) * z >= T(0), z + T(xi) * d1, opposite);
  }
  /// From the point of view to the first sphere in the direction (sine, cosine): xi cosine + root,
  /// root^2 = 1 - xi^2 sine^2. Of opposite signs (|xi| < 1 then), they are taken as
  /// (1 - |xi|) |cosine| + (root - |cosine|).
  template <class T>
  [[nodiscard, gnu::always_inline]] T distance(T sine2, T cosine, T root) const {
    const T length = std::abs(cosine);
    const T opposite =
        T(1 - std::abs(xi)) * length + T((1 - xi) * (1 + xi)) * (sine2 / (root + length));
    return select(T(xi) * cosine >= T(0), T(xi) * cosine + root, opposite);
  }
};
static_assert(CameraModel<DoubleSphere>);

}  // namespace dlsd
