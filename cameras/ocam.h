#pragma once
#include <algorithm>
#include <array>
#include <type_traits>

#include "cameras/camera_model.h"
#include "cameras/mutant.h"
#include "cameras/newton.h"
#include "cameras/polynomial.h"

namespace dlsd {

/// OCamCalib's model (Scaramuzza, Martinelli and Siegwart, "A toolbox for easily calibrating
/// omnidirectional cameras", IROS 2006), defined by its polynomial from camera to world:
///
///   f(rho) = a0 + a1 rho + ... + a8 rho^8,  a0 < 0
///   u = x' + e y' + cx,  v = d x' + c y' + cy,  ray along (x', y', -f(rho)),  rho = |(x', y')|, px
///
/// Their camera looks along -z and their x is the row: (x, y, z) = (y', x', -z') in our frame, and
/// [c d; e 1] is their matrix from the ideal to the real sensor, for (row, column).
///
/// Domain: the field angle atan2(rho, -f(rho)) must rise: rho < max_rho, the first sign change of
/// rho f'(rho) - f(rho). If there is none the field angle rises to its limit, that of (rho, -f) at
/// infinity. Solved once in fromParams. The inverse (from ray to rho) is two of Newton's steps from
/// a fitted start, else a bracketed iteration, run to the last bits; the files' fitted inverse
/// polynomial is not used.
///
/// c, d and e are bounded so that their matrix can always be inverted (determinant >= 0.01).
struct Ocam {
  static constexpr std::string_view kName = "ocam";
  static constexpr std::array<ParamSpec, 14> kParams{{
      {"a0", "px", -1e7, -1e-3, -2000, -100},
      {"a1", "1", -1e3, 1e3, -0.01, 0.01},
      {"a2", "1/px", -10, 10, 0, 2e-3},
      {"a3", "1/px^2", -1, 1, -1e-6, 1e-6},
      {"a4", "1/px^3", -1e-3, 1e-3, -5e-10, 1e-9},
      {"a5", "1/px^4", -1e-5, 1e-5, -1e-13, 1e-13},
      {"a6", "1/px^5", -1e-7, 1e-7, -2e-16, 2e-16},
      {"a7", "1/px^6", -1e-9, 1e-9, -2e-19, 2e-19},
      {"a8", "1/px^7", -1e-12, 1e-12, -2e-22, 2e-22},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
      {"c", "1", 0.1, 10, 0.9, 1.1},
      {"d", "1", -0.3, 0.3, -0.01, 0.01},
      {"e", "1", -0.3, 0.3, -0.01, 0.01},
  }};
  /// Stands for "no bound": at this rho, pixels are beyond kMaxPixel whatever the parameters.
  static constexpr double kUnbounded = 1e13;

  std::array<double, 9> a{-1, 0, 0, 0, 0, 0, 0, 0, 0};
  double cx = 0, cy = 0, c = 1, d = 0, e = 0;
  double max_rho = kUnbounded;  ///< Derived, px.
  double max_theta = M_PI / 2;  ///< Derived: the field angle there, rad.
  FittedStart start{};          ///< Derived: of rho over the field angle.

  [[nodiscard]] static Ocam fromParams(const std::array<double, 14>& p) {
    Ocam m;
    std::copy_n(p.begin(), m.a.size(), m.a.begin());
    m.cx = p[9];
    m.cy = p[10];
    m.c = p[11];
    m.d = p[12];
    m.e = p[13];
    // rho f' - f, of which the field angle's slope is a positive multiple.
    std::array<double, 9> slope{};
    for (size_t i = 0; i < slope.size(); ++i) slope[i] = (static_cast<double>(i) - 1) * m.a[i];
    const std::vector<double> turns = signChanges(slope, 0, 1e30);
    if (!turns.empty()) {
      m.max_rho = std::min(turns.front(), kUnbounded);
      m.max_theta = std::atan2(turns.front(), m.forward(turns.front()).value);
    } else {
      // The leading coefficient beyond a1, if there is one, is positive here.
      const bool line = std::all_of(m.a.begin() + 2, m.a.end(), [](double x) { return x == 0; });
      m.max_theta = line ? std::atan2(1.0, -m.a[1]) : M_PI;
    }
    const double end = std::min(m.max_rho, -kStartShare * m.a[0]);
    m.start = FittedStart::fit(
        std::min(m.max_theta, std::atan2(end, m.forward(end).value)),
        turns.empty() ? kUnbounded : m.max_theta,
        [&](double theta) { return m.sensorRadius<double>(std::sin(theta), std::cos(theta)).rho; });
    return m;
  }
  [[nodiscard]] std::array<double, 14> params() const {
    return {a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], cx, cy, c, d, e};
  }
  bool operator==(const Ocam&) const = default;

  /// -f(rho), the component of the ray along the optical axis, and its slope.
  template <class T>
  [[nodiscard, gnu::always_inline]] Jet<T> forward(T rho) const {
    T value = T(-a[8]), slope = T(0), half_curvature = T(0), sixth_of_third = T(0);
    for (size_t i = 8; i-- > 0;) {
      sixth_of_third = sixth_of_third * rho + half_curvature;
      half_curvature = half_curvature * rho + slope;
      slope = slope * rho + value;
      value = value * rho - T(a[i]);
    }
    return {value, slope, T(2) * half_curvature, T(6) * sixth_of_third};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const auto& attempt = attemptProject(x, y, z);
    return attempt.settled ? static_cast<Pixel<T>>(attempt) : iterateProject(x, y, z);
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Attempt<Pixel<T>> attemptProject(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const T r = axisDistance(r2);
    const T theta = polarAngle(r, z);
    const auto& rho = radiusOfKernel(r, z, theta);
    const T scale = rho.x * (T(1) / r);
    const T u = sensorU(x * scale, y * scale), v = sensorV(x * scale, y * scale);
    const bool beyond = theta > T(max_theta) * (T(1) + T(8) * std::numeric_limits<T>::epsilon());
    return {{u, v, allOf(rho.arrived, norm2InRange(r2 + z * z), pixelInRange(u, v))},
            anyOf(allOf(rho.arrived, rho.x < T(max_rho)), beyond)};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const auto& attempt = attemptUnproject(u, v);
    if constexpr (std::is_same_v<T, float>) {
      if (!attempt.settled) {
        const Ray<double> ray = unproject<double>(u, v);
        return {T(ray.x), T(ray.y), T(ray.z), ray.valid};
      }
    }
    return attempt;
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Attempt<Ray<T>> attemptUnproject(T u, T v) const {
    const T inverse = T(1 / (c - d * e));
    const T du = u - T(cx), dv = v - T(cy);
    const T px = (T(c) * du - T(e) * dv) * inverse;
    const T py = (dv - T(d) * du) * inverse;
    const T rho2 = px * px + py * py;
    const T rho = std::sqrt(rho2);
    const T pz = forward(rho).value;
    const T norm2 = rho2 + pz * pz;
    const T norm = std::sqrt(norm2), scale = T(1) / norm;
    const bool valid = allOf(rho < T(max_rho), pixelInRange(u, v));
    // Far out, powers overflow a float.
    const bool in_range = norm2 <= std::numeric_limits<T>::max();
    // pz / norm is 1 on the axis, pz * scale may not be.
    return {{px * scale, py * scale, pz / norm, valid}, anyOf(in_range, !valid)};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    using W = Wider<double>;
    const W across = std::sqrt(W(x) * W(x) + W(y) * W(y));
    const double r = static_cast<double>(across);  // 0 where project takes its limit, too.
    const auto [solved, found] = sensorRadius<double>(across, z);
    // Within rounding of the domain's end only the kernel may have an answer, which is project's.
    const double rho = found ? solved : radiusOfKernel(r, z, polarAngle(r, z)).x;
    const double value = forward(rho).value;
    // value - rho slope; its terms without a1, which cancels.
    double turning = 0;
    for (size_t i = 9; i-- > 0;) turning = turning * rho + (static_cast<double>(i) - 1) * a[i];
    // d rho / d theta, from tan(theta) = rho / forward(rho).
    const double rise = (rho * rho + value * value) / turning / (r * r + z * z);
    const ProjectionJacobian plane =
        radialJacobian(1, 1, x, y, r > 0 ? rho / r : -a[0] / z, rise * z, -rise * r);
    Eigen::Matrix2d A;
    A << 1, e, d, c;
    return A * plane;
  }

  [[nodiscard]] double maxFieldAngle() const { return max_theta; }

 private:
  /// Up to here, in units of |a0|, the start is fitted.
  static constexpr double kStartShare = 4;

  template <class T>
  [[nodiscard, gnu::always_inline]] T sensorU(T px, T py) const {
    return px + T(e) * py + T(cx);
  }
  template <class T>
  [[nodiscard, gnu::always_inline]] T sensorV(T px, T py) const {
    return T(DLSD_MUTANT("ocam-affine") ? e : d) * px + T(c) * py + T(cy);
  }

  /// |(rho, forward)| sin(field angle of rho - field angle of the ray): rises through zero once.
  template <class T>
  [[nodiscard, gnu::always_inline]] Jet<T> mismatch(T rho, T across, T along) const {
    const auto [value, slope, curvature, third] = forward(rho);
    return {
        rho * along - value * across, along - slope * across, -curvature * across, -third * across};
  }

  /// rho by two steps from the fitted start.
  template <class T>
  [[nodiscard, gnu::always_inline]] Arrival<T> radiusOfKernel(T across, T along, T theta) const {
    return newtonSteps([&](T rho) { return mismatch(rho, across, along); }, start.at(theta));
  }

  template <class T>
  [[nodiscard]] Pixel<T> iterateProject(T x, T y, T z) const {
    using W = Wider<T>;
    const W r2 = W(x) * W(x) + W(y) * W(y);
    const W across = std::sqrt(r2);
    const T r = static_cast<T>(across);
    const auto [rho, found] = sensorRadius<T>(across, z);
    const T scale = r > T(0) ? rho / r : T(-a[0]) / z;
    const T u = sensorU(x * scale, y * scale), v = sensorV(x * scale, y * scale);
    return {u, v, found && norm2InRange(static_cast<T>(r2) + z * z) && pixelInRange(u, v)};
  }
  template <class T>
  struct SensorRadius {
    T rho;
    bool found;
  };

  /// rho in [0, max_rho) of a ray's parts across and along the axis.
  template <class T>
  [[nodiscard]] SensorRadius<T> sensorRadius(Wider<T> across, T along) const {
    const auto f = [&](auto rho) {
      using S = decltype(rho);
      const Jet<S> jet = mismatch(rho, static_cast<S>(across), static_cast<S>(along));
      return ValueAndSlope<S>{jet.value, jet.slope};
    };
    const T hi = static_cast<T>(max_rho);
    // At the end, powers overflow a float.
    const bool found = f(static_cast<std::common_type_t<T, double>>(max_rho)).value > 0;
    const T equidistant = T(-a[0]) * std::atan2(static_cast<T>(across), along);
    const T rho = found ? bracketedRoot(f, T(0), hi, std::min(equidistant, hi / 2)) : T(0);
    // What rounding leaves; near the end of the domain, where the field angle is flat, that is
    // much.
    Wider<T> polished = rho;
    for (int i = 0; i < 3; ++i) {
      const auto [value, slope] = f(polished);
      polished -= value / slope;
    }
    const T answer = static_cast<T>(polished);
    return {std::abs(answer - rho) <= T(1e-4) * rho && answer < hi ? answer : rho, found};
  }
};
static_assert(CameraModel<Ocam>);

}  // namespace dlsd
