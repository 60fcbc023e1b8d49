#pragma once
#include "cameras/camera_model.h"
#include "cameras/radtan.h"

namespace dlsd {

/// Pinhole with radial-tangential distortion, as OpenCV's `projectPoints` with five coefficients,
/// Kalibr's `pinhole` with `radtan` (k3 = 0) and ROS's `plumb_bob`:
///
///   (mx, my) = D(x / z, y / z),  (u, v) = (fx, fy) * (mx, my) + (cx, cy),  D as in radtan.h
///
/// Domain: z > 0 and sqrt(x^2 + y^2) / z < max_radius, the disc on which D is one-to-one; pixels of
/// that disc. Source: Brown, "Close-range camera calibration" (1971), as parametrised by Bouguet.
struct PinholeRadtan {
  static constexpr std::string_view kName = "pinhole_radtan";
  static constexpr std::array<ParamSpec, 9> kParams{{
      {"fx", "px", 1e-3, 1e7, 100, 2000},
      {"fy", "px", 1e-3, 1e7, 100, 2000},
      {"cx", "px", -1e6, 1e6, 50, 2000},
      {"cy", "px", -1e6, 1e6, 50, 2000},
      {"k1", "1", -1e2, 1e2, -0.4, 0.4},
      {"k2", "1", -1e4, 1e4, -0.2, 0.2},
      {"p1", "1", -10, 10, -0.01, 0.01},
      {"p2", "1", -10, 10, -0.01, 0.01},
      {"k3", "1", -1e6, 1e6, -0.05, 0.05},
  }};

  double fx = 1, fy = 1, cx = 0, cy = 0;
  Radtan radtan;

  [[nodiscard]] static PinholeRadtan fromParams(const std::array<double, 9>& p) {
    return {p[0], p[1], p[2], p[3], Radtan::make(p[4], p[5], p[6], p[7], p[8])};
  }
  [[nodiscard]] std::array<double, 9> params() const {
    return {fx, fy, cx, cy, radtan.k1, radtan.k2, radtan.p1, radtan.p2, radtan.k3};
  }
  bool operator==(const PinholeRadtan&) const = default;

  template <class T>
  [[nodiscard, gnu::always_inline]] Pixel<T> project(T x, T y, T z) const {
    const T scale = T(1) / z;
    const T nx = x * scale, ny = y * scale;
    const auto [mx, my] = radtan.distort(nx, ny);
    const T u = T(fx) * mx + T(cx);
    const T v = T(fy) * my + T(cy);
    const bool in_disc = allOf(z > T(0), std::sqrt(nx * nx + ny * ny) < T(radtan.max_radius));
    return {u, v, allOf(in_disc, norm2InRange(x * x + y * y + z * z), pixelInRange(u, v))};
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Ray<T> unproject(T u, T v) const {
    const auto& attempt = attemptUnproject(u, v);
    return attempt.settled ? static_cast<Ray<T>>(attempt) : iterateUnproject(u, v);
  }

  template <class T>
  [[nodiscard, gnu::always_inline]] Attempt<Ray<T>> attemptUnproject(T u, T v) const {
    const auto& p = radtan.attemptUndistort(
        (u - T(cx)) * (T(1) / T(fx)), (v - T(cy)) * (T(1) / T(fy)), radtan.max_radius);
    const T scale = T(1) / std::sqrt(p.x * p.x + p.y * p.y + T(1));
    return {{p.x * scale, p.y * scale, scale, allOf(p.valid, pixelInRange(u, v))}, p.settled};
  }

  [[nodiscard]] ProjectionJacobian jacobian(double x, double y, double z) const {
    const double nx = x / z, ny = y / z;
    const Eigen::Matrix2d D = radtan.jacobian(nx, ny);
    ProjectionJacobian J;
    for (int i = 0; i < 2; ++i) {
      const double f = (i == 0 ? fx : fy) / z;
      J(i, 0) = f * D(i, 0);
      J(i, 1) = f * D(i, 1);
      J(i, 2) = -(J(i, 0) * nx + J(i, 1) * ny);  // Euler: J (x, y, z) = 0.
    }
    return J;
  }

  [[nodiscard]] double maxFieldAngle() const {
    return radtan.max_radius < Radtan::kUnbounded ? std::atan(radtan.max_radius) : M_PI / 2;
  }

 private:
  template <class T>
  [[nodiscard]] Ray<T> iterateUnproject(T u, T v) const {
    using W = Wider<T>;
    const auto [x, y, valid] =
        radtan.undistort<T>((W(u) - W(cx)) / W(fx), (W(v) - W(cy)) / W(fy), radtan.max_radius);
    const auto scale = 1 / std::sqrt(x * x + y * y + 1);
    return {static_cast<T>(x * scale),
            static_cast<T>(y * scale),
            static_cast<T>(scale),
            valid && pixelInRange(u, v)};
  }
};
static_assert(CameraModel<PinholeRadtan>);

}  // namespace dlsd
