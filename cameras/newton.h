#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "cameras/fast_math.h"
#include "cameras/mutant.h"
#include "cameras/polynomial.h"

namespace dlsd {

/// The next wider floating-point type, in which kernels take out what is left of their own
/// rounding.
template <class T>
using Wider = std::conditional_t<std::is_same_v<T, float>, double, long double>;

template <class T>
struct ValueAndSlope {
  T value, slope;
};

/// The zero of a function that is negative below it and positive above it, in [lo, hi], to the last
/// bits: Newton's steps as long as they stay in the bracket and shrink, else bisection. It cannot
/// end anywhere else, so no residual has to be judged.
/// @param function  T -> ValueAndSlope<T>.
/// @param start     In [lo, hi].
template <class T, class Function>
[[nodiscard]] T bracketedRoot(const Function& function, T lo, T hi, T start) {
  T x = start;
  T last_step = hi - lo;
  // Each step at least halves the bracket or the step before the last: 200 bound the worst fold.
  for (int i = 0; i < 200; ++i) {
    const auto [value, slope] = function(x);
    if (value == T(0)) break;
    (value < T(0) ? lo : hi) = x;
    T next = x - value / slope;
    if (!(next > lo && next < hi && std::abs(next - x) <= last_step / 2)) next = lo + (hi - lo) / 2;
    last_step = std::abs(next - x);
    x = next;
    if (last_step <= std::numeric_limits<T>::epsilon() / 2 * x) break;
  }
  return x;
}

/// Value and the first three derivatives of a function.
template <class T>
struct Jet {
  T value, slope, curvature, third;
};

template <class T>
struct Arrival {
  T x;
  bool arrived;
};

/// Newton's steps to a zero x > 0 at which the function rises, from a start as good as FittedStart
/// gives: two, in float one. Has arrived if what the last step leaves of the error,
/// (step^2 |curvature| / 2 + |step^3 third| / 6) / slope, is below the rounding of x. The third
/// derivative counts where the function bends the other way; after two steps its share is nothing.
/// @param function  T -> Jet<T>.
template <class T, class Function>
[[nodiscard, gnu::always_inline]] inline Arrival<T> newtonSteps(const Function& function, T start) {
  T x = start, left = 0, allowed = 0;
  for (int i = 0; i < (std::is_same_v<T, float> ? 1 : 2); ++i) {
    const Jet<T> f = function(x);
    const T step = f.value / f.slope;
    x -= step;
    left = (step * step) * std::abs(f.curvature);
    if constexpr (std::is_same_v<T, float>) {
      left +=
          (step * step) * std::abs(step * f.third) * T(DLSD_MUTANT("newton-third") ? 0.0 : 1.0 / 3);
    }
    allowed = std::numeric_limits<T>::epsilon() * x * f.slope;
  }
  return {x, allOf(anyOf(left <= allowed, DLSD_MUTANT("newton-residual")), x > T(0))};
}

/// Where Newton's method for the inverse y of a rising x(y), y(0) = 0, starts: y / x as a
/// polynomial in 1 - sqrt(1 - x / fold), which takes the root out of a fold of x(y) at `fold`.
/// Fitted when a model is made; typically right to 1e-3 ... 1e-7.
struct FittedStart {
  std::array<double, 10> c{};
  double fold = 1;

  /// @param end      Up to here the fit holds, and beyond it as far as nothing happens.
  /// @param fold     Where x(y) turns, at least `end`; infinity if it does not.
  /// @param inverse  y(x).
  template <class Inverse>
  [[nodiscard]] static FittedStart fit(double end, double fold, const Inverse& inverse) {
    FittedStart start;
    // Where a fold is far away, a root near the end does no harm.
    start.fold = std::min(fold, 1.1 * end);
    const double w_end = 1 - std::sqrt(std::max(0.0, 1 - end / start.fold));
    start.c = interpolateAtChebyshevNodes<10>(w_end, [&](double w) {
      const double x = start.fold * w * (2 - w);
      return inverse(x) / x;
    });
    return start;
  }
  bool operator==(const FittedStart&) const = default;

  /// About y(x); not a number for x > fold.
  template <class T>
  [[nodiscard, gnu::always_inline]] T at(T x) const {
    const T w = T(1) - std::sqrt(T(1) - x * T(1 / fold));
    const T w2 = w * w, w4 = w2 * w2;
    const auto pair = [&](size_t i) { return T(c[i]) + w * T(c[i + 1]); };
    return x * ((pair(0) + w2 * pair(2)) + w4 * ((pair(4) + w2 * pair(6)) + w4 * pair(8)));
  }
};

}  // namespace dlsd
