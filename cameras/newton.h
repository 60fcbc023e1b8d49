#pragma once
#include <cmath>
#include <limits>
#include <type_traits>

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

}  // namespace dlsd
