#pragma once
// Rays of all pixels of a camera, computed once: after that every camera model costs the same.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// The ray at a sub-pixel position and its derivatives.
struct RaySample {
  Eigen::Vector3d ray;     ///< Unit, camera frame.
  Eigen::Vector3d du, dv;  ///< d(ray) / d(pixel), rad per px, to first order in the cell.

  /// Mean over directions: 1 / sqrt(|du x dv|); 0 where the camera does not resolve directions.
  [[nodiscard]] double pxPerRad() const {
    const double uv = du.dot(dv);
    const double area2 = du.squaredNorm() * dv.squaredNorm() - uv * uv;
    return area2 > 1e-36 ? 1 / std::sqrt(std::sqrt(area2)) : 0;
  }
};

/// Where a pixel lies relative to the image of a plane.
struct CurveOffset {
  double offset_px;        ///< Signed distance to the image curve of the plane, first order.
  Eigen::Vector2d normal;  ///< Unit normal of that curve in the image, towards the plane's normal.
  double rad_per_px;       ///< Change of the ray's angle to the plane along `normal`; > 0.
};

/// Rays at pixel centres from Camera::unproject, in float (6e-8 rad), interpolated bilinearly and
/// brought back to unit length. Interpolation error: at most 1/8 of the second difference of the
/// rays, 0.001 px for any lens with 100 px / rad or more; near a fold of the model (5 px from the
/// rim of an omni camera with xi > 1) up to 0.02 px.
class RayTable {
 public:
  explicit RayTable(const Camera& camera);

  /// width * height entries: 0xffff where an edge may be, 0 on the border of the image
  /// (kBorderPx wide) and within kRimPx of a pixel without a ray, where smoothing and gradient see
  /// the border or the rim.
  [[nodiscard]] const std::vector<uint16_t>& usable() const { return usable_; }
  [[nodiscard]] bool isUsable(int x, int y) const {
    return x >= 0 && y >= 0 && x < width_ && y < height_ && usable_[index(x, y)] != 0;
  }

  /// The position must be covered; all within 1 px of a usable pixel are.
  [[nodiscard]] RaySample at(double u, double v) const {
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    const auto a = static_cast<float>(u - x), b = static_cast<float>(v - y);
    const Entry& r00 = entries_[index(x, y)];
    const Entry& r10 = entries_[index(x + 1, y)];
    const Entry& r01 = entries_[index(x, y + 1)];
    const Entry& r11 = entries_[index(x + 1, y + 1)];
    RaySample s;
    for (int i = 0; i < 3; ++i) {
      const float top = r10.ray[i] - r00.ray[i], bottom = r11.ray[i] - r01.ray[i];
      const float left = r01.ray[i] - r00.ray[i], right = r11.ray[i] - r10.ray[i];
      const float du = top + b * (bottom - top);
      s.du[i] = static_cast<double>(du);
      s.dv[i] = static_cast<double>(left + a * (right - left));
      s.ray[i] = static_cast<double>(r00.ray[i]) + static_cast<double>(a * du + b * left);
    }
    s.ray /= std::sqrt(s.ray.squaredNorm());
    return s;
  }

  /// Whether at(u, v) may be asked: the four pixels around are in the image and have rays.
  [[nodiscard]] bool covers(double u, double v) const {
    if (!(u >= 0 && v >= 0 && u < width_ - 1 && v < height_ - 1)) return false;
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    return hasRay(x, y) && hasRay(x + 1, y) && hasRay(x, y + 1) && hasRay(x + 1, y + 1);
  }

  /// Ray of a usable pixel's centre.
  [[nodiscard]] Eigen::Vector3d at(int x, int y) const {
    const Entry& e = entries_[index(x, y)];
    return {static_cast<double>(e.ray[0]),
            static_cast<double>(e.ray[1]),
            static_cast<double>(e.ray[2])};
  }

  static constexpr int kBorderPx = 2;
  static constexpr int kRimPx = 5;

 private:
  struct Entry {
    float ray[3];
    float has_ray;
  };
  [[nodiscard]] bool hasRay(int x, int y) const { return entries_[index(x, y)].has_ray != 0; }
  [[nodiscard]] size_t index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }

  int width_, height_;
  std::vector<Entry> entries_;
  std::vector<uint16_t> usable_;
};

/// rad_per_px is 0 (and the rest unspecified) where the camera does not resolve the plane.
[[nodiscard]] inline CurveOffset curveOffset(const RaySample& sample,
                                             const Eigen::Vector3d& plane_normal) {
  const Eigen::Vector2d g(sample.du.dot(plane_normal), sample.dv.dot(plane_normal));
  const double norm = std::sqrt(g.squaredNorm());
  if (!(norm > 1e-9)) return {0, {1, 0}, 0};
  return {sample.ray.dot(plane_normal) / norm, g / norm, norm};
}

/// Reprojection error of Eq. 8 to first order: the pixel moves by J (x . n) n, where J is the
/// projection's Jacobian, here the pseudo-inverse of (du dv).
[[nodiscard]] inline double reprojectionErrorFirstOrder(const RaySample& sample,
                                                        const Eigen::Vector3d& plane_normal) {
  const double f = sample.ray.dot(plane_normal);
  const double gu = sample.du.dot(plane_normal), gv = sample.dv.dot(plane_normal);
  const double uu = sample.du.squaredNorm(), uv = sample.du.dot(sample.dv);
  const double vv = sample.dv.squaredNorm();
  const double determinant = uu * vv - uv * uv;
  if (!(determinant > 0)) return 0;
  const double du = vv * gu - uv * gv, dv = uu * gv - uv * gu;
  return std::abs(f) * std::sqrt(du * du + dv * dv) / determinant;
}

}  // namespace dlsd
