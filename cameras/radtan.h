#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "cameras/newton.h"
#include "cameras/polynomial.h"

namespace dlsd {

template <class T>
struct PlanePoint {
  T x{}, y{};
  bool valid = false;
};

/// Radial-tangential distortion of a plane (Brown 1971, in the form of OpenCV, Kalibr and ROS),
/// shared by the models that have one. With t = x^2 + y^2, R = 1 + k1 t + k2 t^2 + k3 t^3:
///
///   D(x, y) = (x R + 2 p1 x y + p2 (t + 2 x^2),  y R + p1 (t + 2 y^2) + 2 p2 x y)
///
/// With p = (p2, p1) this is D(n) = (R + 2 p.n) n + p |n|^2, the gradient of a potential: its
/// Jacobian is symmetric, and on a disc where it is positive definite D is one-to-one. In the polar
/// frame at radius r, with f = r R(r^2), q = 2 |p| r, and c, s the cosine and sine of the angle
/// between p and the point, it is diag(f', R) + q ((3 c, s), (s, c)). Its determinant is quadratic
/// in c and positive for all c as long as f' > 3 q (from which R > 1.5 q follows by integration)
/// and, where f' + 3 R < 8 q, (f' - R)(9 R - f') > 16 q^2: polynomials in r.
///
/// Domain: the disc r < max_radius, where the first of these fails, solved once in make.
///
/// Inverse: D(n) = m at |n| = r means that n is along m - p r^2. So n = r e with e = (m - p r^2) /
/// |m - p r^2|, and r is a zero of h(r) = f(r) - e.(m - 3 p r^2), whose slope there is det J over a
/// positive number. Since D is one-to-one, h has one zero in the disc, where it rises through 0, or
/// none: m has an inverse if and only if h(max_radius) > 0, and it is in the bracket [0,
/// max_radius].
struct Radtan {
  /// Stands for "no bound": at this radius, pixels are beyond kMaxPixel whatever the parameters.
  static constexpr double kUnbounded = 1e15;

  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  double max_radius = kUnbounded;  ///< Derived.

  [[nodiscard]] static Radtan make(double k1, double k2, double p1, double p2, double k3) {
    return {k1, k2, p1, p2, k3, findMaxRadius(k1, k2, k3, std::hypot(p1, p2))};
  }
  bool operator==(const Radtan&) const = default;

  template <class T>
  [[nodiscard]] std::array<T, 2> distort(T x, T y) const {
    const T t = x * x + y * y;
    const T factor = T(1) + t * (T(k1) + t * (T(k2) + t * T(k3))) + T(2) * (T(p2) * x + T(p1) * y);
    return {x * factor + T(p2) * t, y * factor + T(p1) * t};
  }

  /// d D / d (x, y), symmetric.
  template <class T>
  [[nodiscard]] Eigen::Matrix<T, 2, 2> jacobian(T x, T y) const {
    const T t = x * x + y * y;
    const T factor = T(1) + t * (T(k1) + t * (T(k2) + t * T(k3))) + T(2) * (T(p2) * x + T(p1) * y);
    const T slope = T(2) * (T(k1) + t * (T(2 * k2) + t * T(3 * k3)));  // dR / dt, twice.
    const T mixed = x * y * slope + T(2) * (T(p1) * x + T(p2) * y);
    Eigen::Matrix<T, 2, 2> J;
    J << factor + x * x * slope + T(4 * p2) * x, mixed,  //
        mixed, factor + y * y * slope + T(4 * p1) * y;
    return J;
  }

  /// The point of the disc r < `radius` (at most max_radius) that D maps to (u, v), to more bits
  /// than T has. Exact: valid if and only if there is one.
  template <class T>
  [[nodiscard]] PlanePoint<Wider<T>> undistort(Wider<T> u, Wider<T> v, double radius) const {
    using W = Wider<T>;
    const T mx = static_cast<T>(u), my = static_cast<T>(v);
    const T px = T(p2), py = T(p1);
    const auto h = [&](T r) -> ValueAndSlope<T> {
      const T t = r * r;
      const T ax = mx - px * t, ay = my - py * t;
      const T length = std::sqrt(ax * ax + ay * ay);
      const T inverse = length > T(0) ? T(1) / length : T(0);
      const T along = (px * ax + py * ay) * inverse;
      const T across = (py * ax - px * ay) * inverse;
      const T value =
          r * (T(1) + t * (T(k1) + t * (T(k2) + t * T(k3)))) - length + T(2) * t * along;
      const T slope = T(1) + t * (T(3 * k1) + t * (T(5 * k2) + t * T(7 * k3))) + T(6) * r * along -
                      T(4) * r * t * (across * across) * inverse;
      return {value, slope};
    };
    const bool valid = radius >= kUnbounded || h(T(radius)).value > T(0);
    const T hi = T(radius);
    const T length = std::sqrt(mx * mx + my * my);
    const T r = valid ? bracketedRoot(h, T(0), hi, length < hi / 2 ? length : hi / 2) : T(0);
    const W t = static_cast<W>(r) * r;
    W x = u - W(p2) * t, y = v - W(p1) * t;
    const W norm = std::sqrt(x * x + y * y);
    const W scale = norm > 0 ? static_cast<W>(r) / norm : W(1);
    x *= scale;
    y *= scale;
    // What is left of rounding, by one more step in both coordinates.
    const auto [back_u, back_v] = distort(x, y);
    const Eigen::Matrix<W, 2, 2> J = jacobian(x, y);
    const W determinant = J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0);
    const W ru = back_u - u, rv = back_v - v;
    const W dx = (J(1, 1) * ru - J(0, 1) * rv) / determinant;
    const W dy = (J(0, 0) * rv - J(1, 0) * ru) / determinant;
    const bool close = std::sqrt(dx * dx + dy * dy) <= W(1e-4) * static_cast<W>(r);
    return {close ? x - dx : x, close ? y - dy : y, valid};
  }

 private:
  [[nodiscard]] static double findMaxRadius(double k1, double k2, double k3, double p) {
    const std::array<double, 7> radial{1, -6 * p, 3 * k1, 0, 5 * k2, 0, 7 * k3};  // f' - 3 q
    const std::array<double, 7> skewed{
        2, -8 * p, 3 * k1, 0, 4 * k2, 0, 5 * k3};  // (f' + 3 R - 8 q) / 2
    // ((f' - R)(9 R - f') - 16 q^2) / (4 t), in t = r^2.
    const std::array<double, 6> inner{4 * k1 - 16 * p * p,
                                      3 * k1 * k1 + 8 * k2,
                                      8 * k1 * k2 + 12 * k3,
                                      10 * k1 * k3 + 4 * k2 * k2,
                                      8 * k2 * k3,
                                      3 * k3 * k3};
    const std::vector<double> ends = signChanges(radial, 0, kUnbounded);
    double radius = ends.empty() ? kUnbounded : ends.front();
    for (const double t : signChanges(inner, 0, radius * radius)) {
      if (evalPolynomial(skewed, std::sqrt(t)) < 0) radius = std::min(radius, std::sqrt(t));
    }
    return radius;
  }
};

}  // namespace dlsd
