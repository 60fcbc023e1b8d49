#pragma once
// The contract that every camera model keeps.
//
// A model is a small value: its parameters, plus what its constructor derives from them (for
// example the angle at which a distortion polynomial stops rising). It maps rays to pixels and
// back:
//
//   project   (x, y, z) in the camera frame, any positive scale  ->  pixel
//   unproject (u, v)                                             ->  unit ray in the camera frame
//
// Both are kernels without branches or library calls (fast_math.h) and always inlined, so that one
// point and a vectorised loop over many (batch.h) run the same operations and give the same bits.
// A model that needs an iteration, or wider numbers somewhere, has `attemptUnproject` (or
// `attemptProject`) besides: a kernel that answers nearly every point and says so; unproject takes
// that or goes the long way.
//
// Camera frame: x right, y down, z forward. Pixel: integer coordinates are pixel centres.
// Outside its domain a model answers `valid == false`; the values are then unspecified and must not
// be read. valid implies finite. Whether a pixel lies inside the image is a separate question
// (camera.h).

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <limits>
#include <string_view>

#include "cameras/fast_math.h"
#include "cameras/mutant.h"

namespace dlsd {

template <class T>
struct Pixel {
  T u{}, v{};
  bool valid = false;
};

template <class T>
struct Ray {
  T x{}, y{}, z{};
  bool valid = false;
};

/// d(u, v) / d(x, y, z) of a projection, in pixels per unit of the ray as given.
using ProjectionJacobian = Eigen::Matrix<double, 2, 3>;

/// One intrinsic parameter: name in files, unit, the closed range in which the model is defined
/// (admissible) and the range met in real cameras (realistic). Files, range checks, documentation
/// and test generators all read this table.
struct ParamSpec {
  std::string_view name;
  std::string_view unit;
  double min, max;
  double realistic_min, realistic_max;
};

/// Squared length of a ray must lie inside (kMinNorm2, kMaxNorm2), so that no product in a kernel
/// under- or overflows. Rays outside are answered as invalid, never with a wrong pixel.
inline constexpr double kMinNorm2 = 1e-200;
inline constexpr double kMaxNorm2 = 1e+200;
inline constexpr float kMinNorm2f = 1e-20F;
inline constexpr float kMaxNorm2f = 1e+20F;

template <class T>
[[nodiscard, gnu::always_inline]] constexpr bool norm2InRange(T norm2) {
  constexpr T kMin = std::is_same_v<T, float> ? T(kMinNorm2f) : T(kMinNorm2);
  constexpr T kMax = std::is_same_v<T, float> ? T(kMaxNorm2f) : T(kMaxNorm2);
  return allOf(norm2 > kMin, norm2 < kMax);
}

/// sqrt(r2), but never 0: below the least normal number its root, where every model is linear in r.
/// So a quotient by it needs no case for the optical axis.
template <class T>
[[nodiscard, gnu::always_inline]] inline T axisDistance(T r2) {
  return std::sqrt(std::max(r2, std::numeric_limits<T>::min()));
}

/// Pixel coordinates beyond this are answered as invalid: 1e9 px is far outside any image, and
/// keeps everything after a valid projection finite (float has still a resolution of 64 px there).
inline constexpr double kMaxPixel = 1e9;

template <class T>
[[nodiscard, gnu::always_inline]] inline bool pixelInRange(T u, T v) {
  return allOf(std::abs(u) <= T(kMaxPixel), std::abs(v) <= T(kMaxPixel));
}

/// Whether the angle of a ray to +z is at most a limit in (0, pi): sin(limit - angle) >= 0.
struct FieldAngleLimit {
  double sine, cosine;  ///< Of the limit.

  [[nodiscard]] static FieldAngleLimit of(double limit_rad) {
    return {std::sin(limit_rad), std::cos(limit_rad)};
  }
  bool operator==(const FieldAngleLimit&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] bool admits(T x, T y, T z) const {
    const T r = std::sqrt(x * x + y * y) * T(DLSD_MUTANT("field-angle-limit") ? 1 - 1e-9 : 1);
    return z * T(sine) >= r * T(cosine);
  }
};

/// Answer of a kernel without branches that cannot answer every case.
template <class Answer>
struct Attempt : Answer {
  bool settled;  ///< If not, the answer says nothing.
};

template <class M>
concept CameraModel = std::regular<M> &&
    requires(const M& m, double d, const std::array<double, M::kParams.size()>& p) {
  { M::kName } -> std::convertible_to<std::string_view>;
  { M::kParams[0] } -> std::convertible_to<ParamSpec>;
  /// Builds the model. Parameters must lie in the admissible range of kParams (Camera checks it).
  { M::fromParams(p) } -> std::same_as<M>;
  { m.params() } -> std::same_as<std::array<double, M::kParams.size()>>;
  { m.project(d, d, d) } -> std::same_as<Pixel<double>>;
  { m.unproject(d, d) } -> std::same_as<Ray<double>>;
  /// Derivative of project at a valid ray; not finite where there is none.
  { m.jacobian(d, d, d) } -> std::same_as<ProjectionJacobian>;
  /// Supremum of the field angle (angle to +z, rad) of rays that project; the bound of the domain.
  { m.maxFieldAngle() } -> std::same_as<double>;
};

/// Jacobian of (fx x s + cx, fy y s + cy), s = rho / r, for a rotationally symmetric rho(r, z) with
/// r = sqrt(x^2 + y^2). On the axis drho_dr equals s and the direction does not matter.
[[nodiscard]] inline ProjectionJacobian radialJacobian(
    double fx, double fy, double x, double y, double s, double drho_dr, double drho_dz) {
  const double r = std::hypot(x, y);
  const double ex = r > 0 ? x / r : 1.0;
  const double ey = r > 0 ? y / r : 0.0;
  const double mixed = (drho_dr - s) * ex * ey;
  ProjectionJacobian J;
  J << fx * (drho_dr * ex * ex + s * ey * ey), fx * mixed, fx * drho_dz * ex,  //
      fy * mixed, fy * (drho_dr * ey * ey + s * ex * ex), fy * drho_dz * ey;
  return J;
}

}  // namespace dlsd
