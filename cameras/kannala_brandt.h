#pragma once
#include <algorithm>

#include "cameras/camera_model.h"
#include "cameras/mutant.h"
#include "cameras/newton.h"
#include "cameras/polynomial.h"

namespace dlsd {

/// Kannala-Brandt fisheye with four coefficients, as OpenCV's `fisheye` and Kalibr's `equidistant`:
///
///   theta = atan2(sqrt(x^2 + y^2), z),  d(theta) = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6
///   + k4 theta^8) (u, v) = (fx, fy) * d(theta) * (x, y) / sqrt(x^2 + y^2) + (cx, cy)
///
/// Domain: theta < max_theta, where max_theta is the smallest positive sign change of d'(theta), or
/// pi if there is none below pi; pixels of radius r_d < d(max_theta). Solved once in fromParams.
///
/// Inverse: two of Newton's steps from a start fitted when the camera is made. Where these have not
/// arrived (near folds and inflections, or beyond kStartAngle), his iteration inside a bracket that
/// always holds the solution. Source: Kannala and Brandt, "A generic camera model ..." (PAMI 2006),
/// radial part only.
struct KannalaBrandt {
  static constexpr std::string_view kName = "kannala_brandt";
  static constexpr std::array<ParamSpec, 8> kParams{{
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
      {"k1", "1", -100, 100, -0.1, 0.1},
      {"k2", "1", -100, 100, -0.05, 0.05},
      {"k3", "1", -100, 100, -0.02, 0.02},
      {"k4", "1", -100, 100, -0.005, 0.005},
  }};

  double fx = 1, fy = 1, cx = 0, cy = 0, k1 = 0, k2 = 0, k3 = 0, k4 = 0;
  double max_theta = M_PI;   ///< Derived, rad.
  double max_radius = M_PI;  ///< Derived: d(max_theta).
  FittedStart start{};       ///< Derived: of the angle over the radius.

  [[nodiscard]] static KannalaBrandt fromParams(const std::array<double, 8>& p) {
    KannalaBrandt m{p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]};
    // d' as a polynomial in t = theta^2.
    const std::array<double, 5> slope{1, 3 * m.k1, 5 * m.k2, 7 * m.k3, 9 * m.k4};
    const std::vector<double> turns = signChanges(slope, 0, M_PI * M_PI);
    if (!turns.empty()) m.max_theta = std::min(std::sqrt(turns.front()), M_PI);
    if (DLSD_MUTANT("kb-domain")) m.max_theta = std::min(m.max_theta * (1 + 1e-6), M_PI);
    m.max_radius = m.distort(m.max_theta);
    m.start = FittedStart::fit(m.distort(std::min(m.max_theta, kStartAngle)),
                               m.max_radius,
                               [&](double r_d) { return m.undistort(r_d); });
    return m;
  }
  [[nodiscard]] std::array<double, 8> params() const { return {fx, fy, cx, cy, k1, k2, k3, k4}; }
  bool operator==(const KannalaBrandt&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] T distort(T theta) const {
    const T t = theta * theta;
    return theta + (theta * t) * distortion(t);
  }
  template <class T>
  [[nodiscard, gnu::always_inline]] T distortSlope(T theta) const {
    const T t = theta * theta;
    return T(1) + t * ((T(3 * k1) + t * T(5 * k2)) + (t * t) * (T(7 * k3) + t * T(9 * k4)));
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const T r2 = x * x + y * y;
    const T r = axisDistance(r2);
    const T theta = polarAngle(r, z);
    const T scale = distort(theta) * (T(1) / r);
    const T u = T(fx) * (x * scale) + T(cx);
    const T v = T(fy) * (y * scale) + T(cy);
    return {u, v, allOf(theta < T(max_theta), norm2InRange(r2 + z * z), pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const auto& attempt = attemptUnproject(u, v);
    return attempt.settled ? static_cast<Ray<T>>(attempt) : iterateUnproject(u, v);
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Attempt<Ray<T>> attemptUnproject(T u, T v) const {
    const auto& m = radial(u, v);
    const auto& theta = newtonSteps([&](T a) { return mismatch(a, m.r_d); }, start.at(m.r_d));
    return {rayAt(m, theta.x), anyOf(allOf(theta.arrived, theta.x < T(max_theta)), !m.valid)};
  }

  /// theta in [0, max_theta] with d(theta) = r_d, for 0 <= r_d < max_radius.
  template <class T>
  [[nodiscard]] T undistort(T r_d) const {
    const T hi = T(max_theta);
    return bracketedRoot(
        [&](T theta) -> ValueAndSlope<T> {
          const Jet<T> f = mismatch(theta, r_d);
          return {f.value, f.slope};
        },
        T(0),
        hi,
        std::min(r_d, hi / 2));
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double r = std::sqrt(x * x + y * y);  // 0 where project takes its limit, too.
    const double theta = polarAngle(r, z);
    const double slope =
        (distortSlope(theta) * (DLSD_MUTANT("kb-jacobian") ? 1 + 1e-9 : 1)) / (r * r + z * z);
    const double s = r > 0 ? distort(theta) / r : 1 / z;
    return radialJacobian(fx, fy, x, y, s, slope * z, -slope * r);
  }

  [[nodiscard]] double maxFieldAngle() const { return max_theta; }

 private:
  /// Up to here the start is fitted; few lenses see further.
  static constexpr double kStartAngle = 2.0;

  /// A pixel in units of the focal lengths, and its distance from the principal point.
  template <class T>
  struct Radial {
    T x, y, r_d;
    bool valid;
  };
  template <class T>
  [[nodiscard, gnu::always_inline]] Radial<T> radial(T u, T v) const {
    const T mx = (u - T(cx)) * (T(1) / T(fx));
    const T my = (v - T(cy)) * (T(1) / T(fy));
    const T r_d = axisDistance(mx * mx + my * my);
    return {mx, my, r_d, allOf(r_d < T(max_radius), pixelInRange(u, v))};
  }
  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> rayAt(const Radial<T>& m, T theta) const {
    const auto [sine, cosine] = sinCos(theta);
    const T scale = sine * (T(1) / m.r_d);
    return {m.x * scale, m.y * scale, cosine, allOf(m.valid, theta < T(max_theta))};
  }

  template <class T>
  [[nodiscard]] Ray<T> iterateUnproject(T u, T v) const {
    const Radial<T> m = radial(u, v);
    return rayAt(m, m.valid ? undistort(m.r_d) : T(0));
  }

  /// d(theta) - r_d. theta - r_d is exact near the zero, so the error is the distortion's alone.
  template <class T>
  [[nodiscard, gnu::always_inline]] Jet<T> mismatch(T theta, T r_d) const {
    const T t = theta * theta;
    return {(theta - r_d) + (theta * t) * distortion(t),
            distortSlope(theta),
            theta * (T(6 * k1) + t * ((T(20 * k2) + t * T(42 * k3)) + (t * t) * T(72 * k4))),
            T(6 * k1) + t * ((T(60 * k2) + t * T(210 * k3)) + (t * t) * T(504 * k4))};
  }

  /// d(theta) = theta + theta t distortion(t), t = theta^2.
  template <class T>
  [[nodiscard, gnu::always_inline]] T distortion(T t) const {
    return (T(k1) + t * T(k2)) + (t * t) * (T(k3) + t * T(k4));
  }
};
static_assert(CameraModel<KannalaBrandt>);

}  // namespace dlsd
