#pragma once
#include "cameras/camera_model.h"
#include "cameras/mutant.h"

namespace dlsd {

/// The geometry that the unified omnidirectional models share (Geyer and Daniilidis 2000; Barreto
/// 2001; Mei and Rives 2007): a ray is projected onto the unit sphere and from a point xi above its
/// centre onto the normalised plane,
///
///   d = |(x, y, z)|,  (mx, my) = (x, y) / (z + xi d)
///
/// Domain: for xi <= 1 rays with z > -xi d, and the whole plane. For xi > 1 the image folds where
/// z = -d / xi: rays with z > -d / xi, and points up to the fold, m^2 <= 1 / (xi^2 - 1).
///
/// Behind the camera z + xi d cancels, so there it is taken as
/// (xi^2 r^2 + (xi^2 - 1) z^2) / (xi d - z), r^2 = x^2 + y^2, which for xi >= 1 has no cancellation
/// and for xi < 1 only what the domain's bound brings with it.
struct UnifiedSphere {
  double xi = 0;

  /// (mx, my) = (x, y) scale.
  template <class T>
  struct PlaneScale {
    T scale;
    bool valid;
  };
  template <class T>
  [[nodiscard, gnu::always_inline]] PlaneScale<T> toPlane(T r2, T z) const {
    const auto [numerator, denominator] = inverseDepth(r2, z, std::sqrt(r2 + z * z));
    const bool before_fold =
        anyOf(DLSD_MUTANT("omni-fold"), z >= T(0), xi <= 1, r2 > T((xi - 1) * (xi + 1)) * (z * z));
    return {numerator / denominator, allOf(denominator > T(0), before_fold)};
  }

  /// The unit ray of a point of the plane.
  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> toRay(T mx, T my) const {
    const T m2 = mx * mx + my * my;
    const T disc = T(1) + T((1 - xi) * (1 + xi)) * m2;
    const T root = std::sqrt(std::max(disc, T(0)));
    const T inverse = T(DLSD_MUTANT("omni-unit") ? 1 + 1e-14 : 1) / (T(1) + m2);
    const T scale = (T(xi) + root) * inverse;
    // z = scale - xi, written without the cancellation that large xi brings.
    return {mx * scale, my * scale, (root - T(xi) * m2) * inverse, disc >= T(0)};
  }

  /// The derivative of (fx mx, fy my), and the scale there.
  struct Derivative {
    ProjectionJacobian jacobian;
    double scale;
  };
  [[nodiscard]] Derivative derivative(double fx, double fy, double x, double y, double z) const {
    const double r2 = x * x + y * y;
    const double d = std::sqrt(r2 + z * z);
    const auto [numerator, denominator] = inverseDepth(r2, z, d);
    const double s = numerator / denominator;
    // d + xi z vanishes at the fold; behind the camera without cancellation, as the denominator.
    const double slope = z >= 0 ? d + xi * z : (r2 - (xi - 1) * (xi + 1) * z * z) / (d - xi * z);
    const double g = slope / d * (s * s);
    const double across = (DLSD_MUTANT("omni-jacobian") ? -1 - 1e-8 : -1) * std::sqrt(r2) * g;
    return {radialJacobian(fx, fy, x, y, s, z * g, across), s};
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

}  // namespace dlsd
