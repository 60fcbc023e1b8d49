#pragma once
#include <cmath>
#include <optional>
#include <span>
#include <vector>

namespace dlsd {

/// c[0] + c[1] x + c[2] x^2 + ... (Horner).
[[nodiscard]] inline double evalPolynomial(std::span<const double> c, double x) {
  double y = 0;
  for (size_t i = c.size(); i-- > 0;) y = y * x + c[i];
  return y;
}

/// All x in (lo, hi) at which the polynomial changes sign, ascending. Roots are isolated by those
/// of the derivative, recursively, and bisected to the last bit, so none is missed and vanishing
/// leading or inner coefficients need no special case. Roots of even order are not sign changes.
[[nodiscard]] inline std::vector<double> signChanges(std::span<const double> c,
                                                     double lo,
                                                     double hi) {
  if (c.size() < 2) return {};
  std::vector<double> derivative(c.size() - 1);
  for (size_t i = 1; i < c.size(); ++i) derivative[i - 1] = c[i] * static_cast<double>(i);
  std::vector<double> knots = signChanges(derivative, lo, hi);
  knots.insert(knots.begin(), lo);
  knots.push_back(hi);
  std::vector<double> roots;
  for (size_t i = 0; i + 1 < knots.size(); ++i) {
    double a = knots[i], b = knots[i + 1];
    const double fa = evalPolynomial(c, a), fb = evalPolynomial(c, b);
    if (!((fa < 0 && fb > 0) || (fa > 0 && fb < 0))) continue;
    for (;;) {
      const double m = a + (b - a) / 2;
      if (!(m > a && m < b)) break;
      const double fm = evalPolynomial(c, m);
      if ((fm < 0) == (fa < 0) && fm != 0) {
        a = m;
      } else {
        b = m;
      }
    }
    roots.push_back(b);
  }
  return roots;
}

}  // namespace dlsd
