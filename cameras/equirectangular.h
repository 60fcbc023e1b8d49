#pragma once
#include "cameras/camera_model.h"
#include "cameras/mutant.h"

namespace dlsd {

/// Equirectangular panorama: longitude and latitude, pixels proportional to both.
///
///   u = fx atan2(x, z) + cx,  v = fy atan2(y, sqrt(x^2 + z^2)) + cy,  fx, fy in px / rad
///
/// Longitude 0 is the optical axis and positive to the right, latitude is positive downwards, as y.
/// A whole sphere in w x h pixels has fx = w / (2 pi), fy = h / pi, cx = (w - 1) / 2,
/// cy = (h - 1) / 2.
///
/// Domain: every ray, and pixels with longitude in [-pi, pi), |latitude| <= pi / 2. The image is
/// cut along the seam, the half plane x = 0, z < 0, whose rays have the longitude -pi. (No number
/// is pi: the largest longitude of doubles, which is below pi, is in the domain. A pixel within
/// rounding of a bound counts as on it.) The poles x = z = 0 have the longitude 0, the other pixels
/// of their rows have rays that differ from them by less than rounding.
///
/// The Jacobian is infinite at the poles and returned so; Camera::jacobian has no value there.
struct Equirectangular {
  static constexpr std::string_view kName = "equirectangular";
  static constexpr std::array<ParamSpec, 4> kParams{{
      {"fx", "px/rad", 1e-3, 1e7, 50, 2000},
      {"fy", "px/rad", 1e-3, 1e7, 50, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
  }};
  /// The largest T below pi.
  template <class T>
  static constexpr T kPi = std::is_same_v<T, float> ? T(0x1.921fb4p1) : T(M_PI);

  double fx = 1, fy = 1, cx = 0, cy = 0;

  [[nodiscard]] static Equirectangular fromParams(const std::array<double, 4>& p) {
    return {p[0], p[1], p[2], p[3]};
  }
  [[nodiscard]] std::array<double, 4> params() const { return {fx, fy, cx, cy}; }
  bool operator==(const Equirectangular&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const T h2 = x * x + z * z;
    const T norm2 = h2 + y * y;
    const T h = std::sqrt(h2);
    // polarAngle takes 0 / 0 for no number.
    const bool pole = allOf(x == T(0), z == T(0));
    const T from_axis = std::min(polarAngle(std::abs(x), select(pole, T(1), z)), kPi<T>);
    const T from_equator = polarAngle(std::abs(y), h);
    const bool right = DLSD_MUTANT("panorama-seam") ? x >= T(0) : x > T(0);
    const T longitude = select(right, from_axis, -from_axis);
    const T latitude = select(y > T(0), from_equator, -from_equator);
    const T u = T(fx) * longitude + T(cx);
    const T v = T(fy) * latitude + T(cy);
    return {u, v, allOf(norm2InRange(norm2), pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    constexpr T kRounding = T(1) + 4 * std::numeric_limits<T>::epsilon();
    const T longitude = (u - T(cx)) * (T(1) / T(fx));
    const T latitude = (v - T(cy)) * (T(1) / T(fy));
    const T from_axis = std::abs(longitude), from_equator = std::abs(latitude);
    const SinCos<T> a = sinCos(std::min(from_axis, kPi<T>));
    const SinCos<T> b = sinCos(std::min(from_equator, kPi<T> / 2));
    const T across = b.cos * a.sin;
    return {select(longitude > T(0), across, -across),
            select(latitude > T(0), b.sin, -b.sin),
            b.cos * a.cos,
            allOf(from_axis <= kPi<T> * kRounding,
                  from_equator <= kPi<T> / 2 * kRounding,
                  pixelInRange(u, v))};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double h = std::hypot(x, z), d = std::hypot(h, y);
    // Unit vectors: of the ray in the plane of the equator, and in its meridian.
    const double ex = x / h, ez = z / h, cosine = h / d, sine = y / d;
    ProjectionJacobian J;
    J << fx / h * ez, 0, -fx / h * ex,  //
        -fy / d * sine * ex, fy / d * cosine, -fy / d * sine * ez;
    return J;
  }

  [[nodiscard]] double maxFieldAngle() const { return M_PI; }
};
static_assert(CameraModel<Equirectangular>);

}  // namespace dlsd
