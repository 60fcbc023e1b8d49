#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "cameras/camera_model.h"
#include "cameras/mutant.h"
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
  FittedStart start{};             ///< Derived: of r over f(r), without tangential distortion.

  [[nodiscard]] static Radtan make(double k1, double k2, double p1, double p2, double k3) {
    Radtan m{k1, k2, p1, p2, k3, findMaxRadius(k1, k2, k3, std::hypot(p1, p2)), {}};
    const std::vector<double> turns =
        signChanges(std::array<double, 4>{1, 3 * k1, 5 * k2, 7 * k3}, 0, kUnbounded);
    const double fold = turns.empty() ? kUnbounded : std::sqrt(turns.front());
    const auto radial = [&](double r) -> ValueAndSlope<double> {
      const double t = r * r;
      return {r + r * t * (k1 + t * (k2 + t * k3)), 1 + t * (3 * k1 + t * (5 * k2 + t * 7 * k3))};
    };
    m.start = FittedStart::fit(
        radial(std::min(fold, kStartRadius)).value, radial(fold).value, [&](double f) {
          const auto above = [&](double r) -> ValueAndSlope<double> {
            const auto [value, slope] = radial(r);
            return {value - f, slope};
          };
          const double hi = std::min(fold, kStartRadius);
          return bracketedRoot(above, 0.0, hi, hi / 2);
        });
    return m;
  }
  bool operator==(const Radtan&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] std::array<T, 2> distort(T x, T y) const {
    const T t = x * x + y * y;
    const T factor = T(1) + t * (T(k1) + t * (T(k2) + t * T(k3))) +
                     T(2) * (T(DLSD_MUTANT("radtan-tangential") ? p1 : p2) * x + T(p1) * y);
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

  /// As undistort in a fixed number of Newton's steps, in both coordinates from the fitted start.
  template <class T>
  [[nodiscard, gnu::always_inline]] Attempt<PlanePoint<T>> attemptUndistort(T u,
                                                                            T v,
                                                                            double radius) const {
    const T p_size = T(std::abs(p1) + std::abs(p2));
    const T m = axisDistance(u * u + v * v);
    const T scale = start.at(m) * (T(1) / m);
    // The start lacks the tangential part: 1e-2, 1e-4, 1e-8, 1e-16 where that is strong.
    Step<T> q{u * scale, v * scale, 0, 0};
    q = newtonStep(q, u, v);
    q = newtonStep(q, u, v);
    if constexpr (!std::is_same_v<T, float>) q = newtonStep(q, u, v);
    q = newtonStep(q, u, v);
    // What the last step leaves is at most step^2 |J'| / (2 smallest singular value of J), and that
    // singular value at least determinant / |J|. The bend is more than |J| and r |J'|.
    const T r2 = q.x * q.x + q.y * q.y;
    const T bend =
        T(1) + T(6) * p_size * (T(1) + r2) +
        r2 * (T(6 * std::abs(k1)) + r2 * (T(20 * std::abs(k2)) + r2 * T(42 * std::abs(k3))));
    const T t_end = T(radius) * T(radius);
    const bool arrived =
        allOf(q.step2 * (bend * bend) <= std::numeric_limits<T>::epsilon() * q.determinant * r2,
              r2 < t_end);
    // |D| is at most f + 3 |p| r^2.
    const T furthest = T(radius) * (T(1) + t_end * (T(k1) + t_end * (T(k2) + t_end * T(k3)))) +
                       T(3) * p_size * t_end;
    const bool outside = m > furthest * (T(1) + T(8) * std::numeric_limits<T>::epsilon());
    return {{q.x, q.y, arrived}, anyOf(arrived, outside)};
  }

  /// The point of the disc r < `radius` (at most max_radius) that D maps to (u, v), to more bits
  /// than T has. Exact: valid if and only if there is one.
  template <class T>
  [[nodiscard]] PlanePoint<Wider<T>> undistort(Wider<T> u, Wider<T> v, double radius) const {
    using W = Wider<T>;
    const T mx = static_cast<T>(u), my = static_cast<T>(v);
    const auto h = [&](auto r) {
      using S = decltype(r);
      const S px = S(p2), py = S(p1), t = r * r;
      const S ax = S(mx) - px * t, ay = S(my) - py * t;
      const S length = std::sqrt(ax * ax + ay * ay);
      const S inverse = length > S(0) ? S(1) / length : S(0);
      const S along = (px * ax + py * ay) * inverse;
      const S across = (py * ax - px * ay) * inverse;
      const S value =
          r * (S(1) + t * (S(k1) + t * (S(k2) + t * S(k3)))) - length + S(2) * t * along;
      const S slope = S(1) + t * (S(3 * k1) + t * (S(5 * k2) + t * S(7 * k3))) + S(6) * r * along -
                      S(4) * r * t * (across * across) * inverse;
      return ValueAndSlope<S>{value, slope};
    };
    // At the end, powers overflow a float.
    const bool valid =
        radius >= kUnbounded || h(static_cast<std::common_type_t<T, double>>(radius)).value > 0;
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
  /// Up to here the start is fitted.
  static constexpr double kStartRadius = 1.5;

  /// A point, the squared length of the step that led to it, and det J where that step began.
  template <class T>
  struct Step {
    T x, y, step2, determinant;
  };
  /// Newton's step towards D(x, y) = (u, v).
  template <class T>
  [[nodiscard, gnu::always_inline]] Step<T> newtonStep(const Step<T>& q, T u, T v) const {
    const T t = q.x * q.x + q.y * q.y;
    const T radial = t * (T(k1) + t * (T(k2) + t * T(k3))) + T(2) * (T(p2) * q.x + T(p1) * q.y);
    const T slope = T(2) * (T(k1) + t * (T(2 * k2) + t * T(3 * k3)));
    const T xx = T(1) + (radial + q.x * q.x * slope + T(4 * p2) * q.x);
    const T yy = T(1) + (radial + q.y * q.y * slope + T(4 * p1) * q.y);
    const T xy = q.x * q.y * slope + T(2) * (T(p1) * q.x + T(p2) * q.y);
    // x - u is exact near the solution, so the error is the distortion's alone.
    const T off_u = (q.x - u) + (q.x * radial + T(p2) * t);
    const T off_v = (q.y - v) + (q.y * radial + T(p1) * t);
    const T determinant = xx * yy - xy * xy;
    const T inverse = T(1) / determinant;
    const T dx = (yy * off_u - xy * off_v) * inverse;
    const T dy = (xx * off_v - xy * off_u) * inverse;
    return {q.x - dx, q.y - dy, dx * dx + dy * dy, determinant};
  }

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
    return DLSD_MUTANT("radtan-domain") ? radius * (1 + 1e-6) : radius;
  }
};

}  // namespace dlsd
