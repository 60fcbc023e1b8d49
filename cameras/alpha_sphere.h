#pragma once
// The unified model in the form that EUCM and the double sphere share: a point (r, z) at the
// distance d = sqrt(r^2 + z^2) of the sphere's centre is imaged at
//
//   m = r / (alpha d + (1 - alpha) z),  0 <= alpha <= 1,
//
// which is the unified model with xi = alpha / (1 - alpha). For alpha > 1/2 it folds where
// alpha z = -(1 - alpha) d; its pixels end at m^2 = 1 / (2 alpha - 1). alpha = 1 needs no case.

#include <algorithm>
#include <cmath>

#include "cameras/fast_math.h"
#include "cameras/mutant.h"

namespace dlsd {

struct AlphaSphere {
  double alpha;

  /// m / r as a quotient; the denominator has the sign of alpha d + (1 - alpha) z. Behind the
  /// camera that sum cancels, so there it is taken for alpha >= 1/2 as
  /// (2 alpha - 1) d + (1 - alpha) r^2 / (d - z), which does not, and below as
  /// (alpha^2 r^2 + (2 alpha - 1) z^2) / (alpha d - (1 - alpha) z), which does only as much as the
  /// bound of the domain brings with it.
  template <class T>
  struct Quotient {
    T numerator, denominator;
  };
  template <class T>
  [[nodiscard, gnu::always_inline]] Quotient<T> inverseDepth(T r2, T z, T d) const {
    const T a = T(alpha), b = T(1 - alpha), c = T(2 * alpha - 1);
    const bool front = z >= T(0), above_half = alpha >= 0.5;
    const T behind = select(above_half, d - z, a * d - b * z);
    const T below = a * a * r2 + c * (z * z);
    return {select(front, T(1), behind),
            select(front, a * d + b * z, select(above_half, c * (d * behind) + b * r2, below))};
  }

  /// Whether the point is before the fold: alpha z > -(1 - alpha) d if alpha > 1/2.
  template <class T>
  [[nodiscard, gnu::always_inline]] bool beforeFold(T r2, T z) const {
    const T b = T(1 - alpha);
    const T c = T(2 * alpha - (DLSD_MUTANT("alpha-fold") ? 1 + 1e-7 : 1));
    return anyOf(alpha <= 0.5, z > T(0), b * b * r2 > c * (z * z));
  }

  /// alpha z + (1 - alpha) d, which vanishes at the fold. dm / dpsi, psi = atan2(r, z), is this
  /// times d over the square of alpha d + (1 - alpha) z.
  [[nodiscard]] double slope(double r2, double z, double d) const {
    const double b = 1 - alpha;
    return z >= 0 ? alpha * z + b * d
                  : (b * b * r2 - (2 * alpha - 1) * (z * z)) / (b * d - alpha * z);
  }

  /// The point d = 1 of a pixel: (r, z) = (m * scale, cosine).
  template <class T>
  struct Point {
    T scale, cosine;
    bool valid;
  };
  template <class T>
  [[nodiscard, gnu::always_inline]] Point<T> unproject(T m2) const {
    const T a = T(alpha), b = T(1 - alpha);
    const T disc = T(1) - T(2 * alpha - 1) * m2;
    const T root = std::sqrt(std::max(disc, T(0)));
    const T inverse = T(1) / (T(1) + b * b * m2);
    return {(a + b * root) * inverse, (root - a * b * m2) * inverse, disc >= T(0)};
  }

  /// Where the domain ends: the point d = 1 there.
  struct Bound {
    double sine, cosine;
  };
  [[nodiscard]] Bound bound() const {
    return alpha > 0.5 ? Bound{std::sqrt(2 * alpha - 1) / alpha, -(1 - alpha) / alpha}
                       : Bound{std::sqrt(1 - 2 * alpha) / (1 - alpha), -alpha / (1 - alpha)};
  }
};

}  // namespace dlsd
