#pragma once
// atan2, sine and cosine without branches or library calls, so that loops over them vectorise. Only
// additions, multiplications, divisions and selections, each rounded to nearest: the results do not
// depend on the instruction set as long as the compiler fuses nothing (-ffp-contract=off).
//
// The polynomials are our own minimax fits (Remez); their relative errors are far below the
// rounding of the type. Largest error over the whole range, against long double libm, in ulp of the
// result (fast_math_test.cpp measures and asserts it):
//
//   function    range                           float  double
//   polarAngle  r >= 0, not both 0, finite       2.5    2.5
//   sinCos      angle in [0, pi], each of both   1.6    1.6

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "cameras/mutant.h"

namespace dlsd {

/// condition ? a : b with both evaluated: what compilers turn into a blend.
template <class T>
[[nodiscard, gnu::always_inline]] constexpr T select(bool condition, T a, T b) {
  return condition ? a : b;
}

/// Conjunction and disjunction with every condition evaluated: what compilers turn into masks.
template <class... Conditions>
[[nodiscard, gnu::always_inline]] constexpr bool allOf(Conditions... conditions) {
  return static_cast<bool>((conditions & ...));
}
template <class... Conditions>
[[nodiscard, gnu::always_inline]] constexpr bool anyOf(Conditions... conditions) {
  return static_cast<bool>((conditions | ...));
}

namespace fast_math {

/// pi / 4 as a sum; `high` has trailing zero bits, so that its multiples by 0 ... 4 are exact.
template <class T>
inline constexpr T kQuarterPiHigh = T(0x1.921fb54442cp-1);
template <>
inline constexpr float kQuarterPiHigh<float> = 0x1.921fp-1F;
template <class T>
inline constexpr T kQuarterPiLow = T(0x1.18469898cc517p-45);
template <>
inline constexpr float kQuarterPiLow<float> = 0x1.6a8886p-18F;

/// pi / 2 as a sum: the nearest T, and the T nearest to what is left.
template <class T>
inline constexpr T kHalfPiHigh = T(0x1.921fb54442d18p0);
template <class T>
inline constexpr T kHalfPiLow = T(0x1.1a62633145c07p-54);
template <>
inline constexpr float kHalfPiLow<float> = -0x1.777a5cp-25F;

/// (atan(q) / q - 1) / w with w = q^2, |q| <= tan(pi / 8).
template <class T>
[[nodiscard, gnu::always_inline]] inline T atanTail(T w) {
  const T w2 = w * w;
  if constexpr (std::is_same_v<T, float>) {
    return (-0.333333155048F + w * 0.199984894448F) +
           w2 * ((-0.142438490951F + w * 0.105960041618F) + w2 * -0.0608345843691F);
  } else {
    const T w4 = w2 * w2;
    const T a = (-0.33333333333333327588 + w * 0.19999999999997693375) +
                w2 * (-0.14285714285391062856 + w * 0.11111111088368736471);
    const T b = (-0.090909081514336384598 + w * 0.076922829150930291504) +
                w2 * (-0.066662290712999844342 + w * 0.058770444923136422102);
    const T c = (-0.052185506979205859484 +
                 w * (DLSD_MUTANT("atan-coefficient") ? 0.045 : 0.045041452498199846082)) +
                w2 * (-0.033488349562296842627 + w * 0.015209285088557111772);
    return a + w4 * (b + w4 * c);
  }
}

/// (sin(a) / a - 1) / w with w = a^2, |a| <= pi / 4.
template <class T>
[[nodiscard, gnu::always_inline]] inline T sinTail(T w) {
  const T w2 = w * w;
  if constexpr (std::is_same_v<T, float>) {
    return (-0.166666549436F + w * 0.00833217814009F) + w2 * -0.000195172982972F;
  } else {
    return (-0.1666666666666663207 + w * 0.0083333333333224246467) +
           w2 * ((-0.0001984126982981690401 + w * 2.7557313694706760619e-6) +
                 w2 * (-2.5050758644338942967e-8 + w * 1.5896827316770322353e-10));
  }
}

/// (cos(a) - 1 + w / 2) / w^2 with w = a^2, |a| <= pi / 4.
template <class T>
[[nodiscard, gnu::always_inline]] inline T cosTail(T w) {
  const T w2 = w * w;
  if constexpr (std::is_same_v<T, float>) {
    return (0.0416666468685F + w * -0.00138873676101F) + w2 * 2.44384613246e-5F;
  } else {
    return (0.041666666666666599557 + w * -0.001388888888887413876) +
           w2 * ((0.000024801587289491885931 + w * -2.7557314355251412308e-7) +
                 w2 * (2.087572368469178603e-9 + w * -1.1359669830340764026e-11));
  }
}

}  // namespace fast_math

/// atan2(r, z) for r >= 0: the angle in [0, pi] between (r, z) and +z. (0, 0) gives NaN.
template <class T>
[[nodiscard, gnu::always_inline]] inline T polarAngle(T r, T z) {
  constexpr T kTanEighthPi = T(0.41421356237309504880);
  const T a = std::abs(z);
  const T most = std::max(a, r), least = std::min(a, r);
  // Measured from the nearest multiple of pi / 4, the angle is at most pi / 8.
  const bool diagonal = least > kTanEighthPi * most;
  const bool steep = r > a, behind = z < T(0);
  const T q0 = select(diagonal, least - most, least) / select(diagonal, least + most, most);
  const T w = q0 * q0;
  const T q1 = select(steep, -q0, q0);
  const T q = select(behind, -q1, q1);
  const T k0 = select(diagonal, T(1), T(0));
  const T k1 = select(steep, T(2) - k0, k0);
  const T k = select(behind, T(4) - k1, k1);
  const T rest = q + (q * w) * fast_math::atanTail(w);
  return k * fast_math::kQuarterPiHigh<T> + (rest + k * fast_math::kQuarterPiLow<T>);
}

template <class T>
struct SinCos {
  T sin, cos;
};

/// Sine and cosine of an angle in [0, pi].
template <class T>
[[nodiscard, gnu::always_inline]] inline SinCos<T> sinCos(T angle) {
  const bool beyond_45 = angle > T(M_PI / 4), beyond_135 = angle > T(3 * M_PI / 4);
  const T k0 = select(beyond_45, T(1), T(0));
  const T k = select(beyond_135, T(2), k0);
  const T a = (angle - k * fast_math::kHalfPiHigh<T>)-k * fast_math::kHalfPiLow<T>;
  const T w = a * a;
  const T s = a + (a * w) * fast_math::sinTail(w);
  const T c = (T(1) - T(0.5) * w) + (w * w) * fast_math::cosTail(w);
  const T sin_low = select(beyond_45, c, s), cos_low = select(beyond_45, -s, c);
  return {select(beyond_135, -s, sin_low), select(beyond_135, -c, cos_low)};
}

}  // namespace dlsd
