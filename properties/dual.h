#pragma once
// Numbers that carry their derivatives with respect to three inputs along: automatic
// differentiation, exact to rounding. Only what the oracles need.

#include <array>
#include <cmath>

namespace dlsd {

struct Dual {
  using Real = long double;
  Real value{};
  std::array<Real, 3> slope{};

  Dual() = default;
  Dual(Real constant) : value(constant) {}  // NOLINT: constants mix with duals.
  Dual(Real v, const std::array<Real, 3>& s) : value(v), slope(s) {}
  /// Input number `i`.
  static Dual input(Real v, size_t i) {
    Dual x(v);
    x.slope[i] = 1;
    return x;
  }

  friend Dual operator-(const Dual& a) { return chain(a, -a.value, -1); }
  friend Dual operator+(const Dual& a, const Dual& b) {
    return chain(a, 1, b, 1, a.value + b.value);
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    return chain(a, 1, b, -1, a.value - b.value);
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return chain(a, b.value, b, a.value, a.value * b.value);
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const Real q = a.value / b.value;
    return chain(a, 1 / b.value, b, -q / b.value, q);
  }
  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }

  friend Dual sqrt(const Dual& a) {
    const Real root = std::sqrt(a.value);
    return chain(a, root, 1 / (2 * root));
  }
  friend Dual hypot(const Dual& a, const Dual& b) {
    const Real h = std::hypot(a.value, b.value);
    return chain(a, a.value / h, b, b.value / h, h);
  }
  friend Dual atan(const Dual& a) {
    return chain(a, std::atan(a.value), 1 / (1 + a.value * a.value));
  }
  friend Dual atan2(const Dual& a, const Dual& b) {
    const Real n = a.value * a.value + b.value * b.value;
    return chain(a, b.value / n, b, -a.value / n, std::atan2(a.value, b.value));
  }

 private:
  static Dual chain(const Dual& a, Real value, Real by_a) {
    return {value, {by_a * a.slope[0], by_a * a.slope[1], by_a * a.slope[2]}};
  }
  static Dual chain(const Dual& a, Real by_a, const Dual& b, Real by_b, Real value) {
    return {value,
            {by_a * a.slope[0] + by_b * b.slope[0],
             by_a * a.slope[1] + by_b * b.slope[1],
             by_a * a.slope[2] + by_b * b.slope[2]}};
  }
};

}  // namespace dlsd
