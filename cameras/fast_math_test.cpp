#include "cameras/fast_math.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <iostream>
#include <limits>

namespace dlsd {
namespace {

template <class T>
class FastMath : public ::testing::Test {};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(FastMath, Scalars);

/// Spacing of T just above |x|.
template <class T>
long double ulp(long double x) {
  const T rounded = static_cast<T>(std::abs(x));
  return static_cast<long double>(std::nextafter(rounded, std::numeric_limits<T>::infinity())) -
         static_cast<long double>(rounded);
}

/// Worst deviation seen, in ulp of the exact value, and where.
struct Worst {
  long double ulps = 0, at = 0;
  long count = 0;
  void see(long double deviation, long double unit, long double where) {
    ++count;
    if (!(std::abs(deviation) / unit <= ulps)) {
      ulps = std::abs(deviation) / unit;
      at = where;
    }
  }
  void print(const char* what) const {
    std::cout << "    " << what << ": worst " << static_cast<double>(ulps) << " ulp at "
              << static_cast<double>(at) << " (of " << count << ")\n";
  }
};

/// In (0, 1): the fractional parts of the multiples of the golden ratio, which spread evenly.
double spread(long i) {
  const double x = static_cast<double>(i) * 0.61803398874989484820;
  return x - std::floor(x);
}

/// x and its neighbours within 20 steps of T.
template <class T, class Visit>
void around(T x, const Visit& visit) {
  T up = x, down = x;
  visit(x);
  for (int i = 0; i < 20; ++i) {
    up = std::nextafter(up, std::numeric_limits<T>::infinity());
    down = std::nextafter(down, -std::numeric_limits<T>::infinity());
    visit(up);
    visit(down);
  }
}

TYPED_TEST(FastMath, PolarAngleIsTheArcTangentOfTwo) {
  using T = TypeParam;
  Worst worst;
  const auto check = [&](T r, T z) {
    const long double exact = std::atan2(static_cast<long double>(r), static_cast<long double>(z));
    const T ours = polarAngle(r, z);
    worst.see(static_cast<long double>(ours) - exact, ulp<T>(exact), exact);
    ASSERT_TRUE(std::isfinite(ours));
  };
  // All directions, and lengths over the whole range that cameras accept.
  const double most = std::is_same_v<T, float> ? 10 : 100;
  for (long i = 0; i < 1000000; ++i) {
    const double angle = M_PI * spread(i);
    const double length = i % 2 == 0 ? 1 : std::pow(10.0, most * (2 * spread(i / 7) - 1));
    check(static_cast<T>(length * std::sin(angle)), static_cast<T>(length * std::cos(angle)));
  }
  // Small angles to either end, and the seams of the reduction.
  for (long i = 0; i < 100000; ++i) {
    const T r = static_cast<T>(std::pow(10.0, -30 * spread(i)));
    check(r, T(1));
    check(r, T(-1));
    check(T(1), r);
    check(T(1), -r);
  }
  for (const double slope : {0.41421356237309504880, 1.0, 2.41421356237309504880}) {
    around(static_cast<T>(slope), [&](T r) {
      check(r, T(1));
      check(r, T(-1));
    });
  }
  worst.print("polarAngle");
  EXPECT_LE(worst.ulps, 2.5L);
  EXPECT_GT(worst.count, 1400000);
}

TYPED_TEST(FastMath, PolarAngleIsExactOnTheAxes) {
  using T = TypeParam;
  EXPECT_EQ(polarAngle(T(0), T(3)), T(0));
  EXPECT_EQ(polarAngle(T(3), T(0)), static_cast<T>(M_PI / 2));
  EXPECT_EQ(polarAngle(T(0), T(-3)), static_cast<T>(M_PI));
  EXPECT_EQ(polarAngle(T(2), T(2)), static_cast<T>(M_PI / 4));
  EXPECT_EQ(polarAngle(T(2), T(-2)), static_cast<T>(3 * M_PI / 4));
  // The least of r over z, without loss.
  const T least = std::numeric_limits<T>::min();
  EXPECT_EQ(polarAngle(least, T(1)), least);
}

TYPED_TEST(FastMath, SinCosIsThatOfTheLibrary) {
  using T = TypeParam;
  Worst sine, cosine;
  const auto check = [&](T angle) {
    ASSERT_TRUE(angle >= T(0) && angle <= static_cast<T>(M_PI)) << angle;
    const auto exact = static_cast<long double>(angle);
    const SinCos<T> ours = sinCos(angle);
    sine.see(static_cast<long double>(ours.sin) - std::sin(exact), ulp<T>(std::sin(exact)), exact);
    cosine.see(
        static_cast<long double>(ours.cos) - std::cos(exact), ulp<T>(std::cos(exact)), exact);
  };
  constexpr long kMany = 1000000;
  for (long i = 0; i < kMany; ++i) check(static_cast<T>(M_PI * spread(i)));
  for (long i = 0; i < kMany / 10; ++i) {
    const double small = std::pow(10.0, -30 * spread(i));
    check(static_cast<T>(small));
    check(std::min(static_cast<T>(M_PI), static_cast<T>(M_PI - small)));
    check(static_cast<T>(M_PI / 2 - small));
    check(static_cast<T>(M_PI / 2 + small));
  }
  for (const double seam : {M_PI / 4, M_PI / 2, 3 * M_PI / 4}) around(static_cast<T>(seam), check);
  T below_pi = static_cast<T>(M_PI);
  for (int i = 0; i < 20; ++i, below_pi = std::nextafter(below_pi, T(0))) check(below_pi);
  check(T(0));
  sine.print("sine");
  cosine.print("cosine");
  EXPECT_LE(sine.ulps, 1.6L);
  EXPECT_LE(cosine.ulps, 1.6L);
  EXPECT_GT(sine.count, kMany * 14 / 10);
}

}  // namespace
}  // namespace dlsd
