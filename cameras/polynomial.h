#pragma once
#include <array>
#include <cmath>
#include <cstddef>
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

/// Coefficients, lowest first, of the polynomial of degree N - 1 through `function` at the
/// Chebyshev nodes of [0, end]: within a small factor of the best approximation there. For N up to
/// about 12; beyond that, powers of x lose digits.
template <size_t N, class Function>
[[nodiscard]] std::array<double, N> interpolateAtChebyshevNodes(double end,
                                                                const Function& function) {
  std::array<double, N> x{}, difference{}, c{};
  for (size_t i = 0; i < N; ++i) {
    x[i] = end *
           (0.5 + 0.5 * std::cos(M_PI * (static_cast<double>(i) + 0.5) / static_cast<double>(N)));
    difference[i] = function(x[i]);
  }
  // Newton's divided differences, then his form multiplied out.
  for (size_t order = 1; order < N; ++order) {
    for (size_t i = N; i-- > order;) {
      difference[i] = (difference[i] - difference[i - 1]) / (x[i] - x[i - order]);
    }
  }
  for (size_t i = N; i-- > 0;) {
    for (size_t k = N; k-- > 0;) c[k] = (k > 0 ? c[k - 1] : difference[i]) - x[i] * c[k];
  }
  return c;
}

}  // namespace dlsd
