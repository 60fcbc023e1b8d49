#pragma once
// Rays at every sub-pixel position of a camera's image from a small table: after its construction
// every camera model costs the same.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// The ray at a sub-pixel position and its derivatives.
struct RaySample {
  Eigen::Vector3d ray;     ///< Unit, camera frame.
  Eigen::Vector3d du, dv;  ///< d(ray) / d(pixel), rad per px.

  /// Mean over directions: 1 / sqrt(|du x dv|); 0 where the camera does not resolve directions.
  [[nodiscard]] double pxPerRad() const {
    const double uv = du.dot(dv);
    const double area2 = du.squaredNorm() * dv.squaredNorm() - uv * uv;
    return area2 > 1e-36 ? 1 / std::sqrt(std::sqrt(area2)) : 0;
  }
};

/// Rays from Camera::unproject on a grid of kStepPx, in float, interpolated by the polynomial of
/// third degree in each direction and brought back to unit length. Grid cells in which that is not
/// good enough (measured at construction), or whose neighbourhood reaches beyond the domain, are
/// answered by the camera itself: exact, but slower.
///
/// Error of a ray, for every camera model: at most kMaxErrPx, times the local rad per px (and 2e-7
/// rad from float). Error of the derivatives, as d(pixel) / d(pixel): at most 1e-3.
/// Memory: 16 bytes per kStepPx^2 pixels, 0.3 MB for 1280 x 1024.
class RayTable {
 public:
  static constexpr int kStepPx = 8;
  static constexpr double kMaxErrPx = 1e-3;

  explicit RayTable(const Camera& camera);

  [[nodiscard]] const Camera& camera() const { return camera_; }

  /// Whether the position lies in the image and has a ray.
  [[nodiscard]] bool covers(double u, double v) const {
    if (!camera_.inImage({u, v})) return false;
    return smooth_[cellAt(u, v).index] != 0 || camera_.unproject({u, v}).has_value();
  }

  /// The position must be covered.
  [[nodiscard]] RaySample at(double u, double v) const {
    const Cell cell = cellAt(u, v);
    return smooth_[cell.index] != 0 ? interpolate(cell) : exactSample(u, v);
  }

 private:
  struct Cell {
    size_t index;        ///< Of smooth_.
    size_t node;         ///< First of the 4 x 4 nodes around.
    float a = 0, b = 0;  ///< Position in the cell, in [0, 1].
  };
  [[nodiscard]] Cell cellAt(double u, double v) const {
    const auto su = static_cast<float>((u + 0.5) * (1.0 / kStepPx));
    const auto sv = static_cast<float>((v + 0.5) * (1.0 / kStepPx));
    const int x = std::min(static_cast<int>(su), columns_ - 1);
    const int y = std::min(static_cast<int>(sv), rows_ - 1);
    return {static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x),
            static_cast<size_t>(y) * nodes_per_row_ + static_cast<size_t>(x),
            su - static_cast<float>(x),
            sv - static_cast<float>(y)};
  }
  [[nodiscard]] RaySample interpolate(const Cell& cell) const;
  [[nodiscard]] RaySample exactSample(double u, double v) const;

  Camera camera_;
  int columns_, rows_;  // of cells
  size_t nodes_per_row_;
  std::vector<Eigen::Vector4f> nodes_;  // ray and 0; node (i, j) is pixel 8 (i - 1) - 0.5, ...
  std::vector<uint8_t> smooth_;         // one per cell
};

inline RaySample RayTable::interpolate(const Cell& cell) const {
  // Lagrange polynomials for nodes at -1, 0, 1, 2 and their derivatives.
  const Eigen::Array4f c0(0, 1, 0, 0), c1(-1.0F / 3, -0.5F, 1, -1.0F / 6), c2(0.5F, -1, 0.5F, 0),
      c3(-1.0F / 6, 0.5F, -0.5F, 1.0F / 6);
  const auto weights = [&](float t) -> Eigen::Array4f { return c0 + t * (c1 + t * (c2 + t * c3)); };
  const auto slopes = [&](float t) -> Eigen::Array4f { return c1 + t * (2 * c2 + (3 * t) * c3); };
  const Eigen::Array4f wu = weights(cell.a), wv = weights(cell.b);
  const Eigen::Array4f du = slopes(cell.a), dv = slopes(cell.b);
  Eigen::Vector4f value = Eigen::Vector4f::Zero(), along_u = value, along_v = value;
  const Eigen::Vector4f* row = &nodes_[cell.node];
  for (int j = 0; j < 4; ++j, row += nodes_per_row_) {
    const Eigen::Vector4f p = wu[0] * row[0] + wu[1] * row[1] + wu[2] * row[2] + wu[3] * row[3];
    const Eigen::Vector4f d = du[0] * row[0] + du[1] * row[1] + du[2] * row[2] + du[3] * row[3];
    value += wv[j] * p;
    along_u += wv[j] * d;
    along_v += dv[j] * p;
  }
  RaySample sample;
  constexpr double kPerPx = 1.0 / kStepPx;
  sample.ray = value.head<3>().cast<double>();
  sample.ray /= std::sqrt(sample.ray.squaredNorm());
  sample.du = along_u.head<3>().cast<double>() * kPerPx;
  sample.dv = along_v.head<3>().cast<double>() * kPerPx;
  return sample;
}

}  // namespace dlsd
