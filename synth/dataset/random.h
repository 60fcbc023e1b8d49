#pragma once
// Counter-based random numbers: every value is a function of (seed, stream, index), so results do
// not depend on the order of calls, on threads or on the standard library.

#include <cmath>
#include <cstdint>
#include <initializer_list>

namespace dlsd {

/// 64-bit finaliser (a bijection with full avalanche; constants of SplitMix64, Steele et al. 2014).
[[nodiscard]] constexpr uint64_t mixBits(uint64_t x) {
  x ^= x >> 30;
  x *= 0xbf58476d1ce4e5b9ULL;
  x ^= x >> 27;
  x *= 0x94d049bb133111ebULL;
  x ^= x >> 31;
  return x;
}

/// Hash of a tuple of counters. Different tuples give independent-looking values, and the length
/// counts: (1, 0) differs from (1).
[[nodiscard]] constexpr uint64_t hashCounters(std::initializer_list<uint64_t> counters) {
  uint64_t h = 0x9e3779b97f4a7c15ULL;
  for (const uint64_t c : counters)
    h = mixBits(h + 0x9e3779b97f4a7c15ULL + mixBits(c + 0x632be59bd9b4e019ULL));
  return h;
}

/// Uniform in [0, 1): the top 53 bits.
[[nodiscard]] constexpr double unitFromBits(uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

/// A stream of random values addressed by index: at(i) is a pure function. next*() walks the stream
/// with a private counter, for code in which the order of draws is part of the definition (scenes).
class Random {
 public:
  Random(uint64_t seed, uint64_t stream) : key_(hashCounters({seed, stream})) {}

  /// Value number `index` of the stream.
  [[nodiscard]] uint64_t bits(uint64_t index) const { return hashCounters({key_, index}); }
  /// In [lo, hi), or lo if the range is empty.
  [[nodiscard]] double uniform(uint64_t index, double lo, double hi) const {
    return lo + (hi - lo) * unitFromBits(bits(index));
  }
  /// Standard normal by Box and Muller from two hashed uniforms; |value| <= 8.6.
  [[nodiscard]] double normal(uint64_t index) const {
    const uint64_t b = bits(index);
    const double u = 1 - unitFromBits(b);  // In (0, 1].
    const double v = unitFromBits(mixBits(b ^ 0xd1b54a32d192ed03ULL));
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * M_PI * v);
  }

  [[nodiscard]] double next(double lo, double hi) { return uniform(counter_++, lo, hi); }
  /// Integer in [lo, hi], both included.
  [[nodiscard]] int nextInt(int lo, int hi) {
    const auto n = static_cast<uint64_t>(hi - lo + 1);
    // Multiply-shift on the top 32 bits: the bias is below n / 2^32.
    return lo + static_cast<int>(((bits(counter_++) >> 32) * n) >> 32);
  }
  [[nodiscard]] bool nextBool(double probability) { return next(0, 1) < probability; }

 private:
  uint64_t key_;
  uint64_t counter_ = 0;
};

}  // namespace dlsd
