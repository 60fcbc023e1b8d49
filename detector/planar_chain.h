#pragma once
// Pieces of an edge chain that lie in one plane through the optical centre: straight in space,
// whatever the lens makes of them. The generalisation of the straight pieces of 4.2.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "detector/options.h"
#include "detector/plane_fit.h"

namespace dlsd {

/// Points of one chain: unit rays and the local scale, which turns angles to a plane into pixels.
struct ChainRays {
  std::vector<Eigen::Vector3d> rays;
  std::vector<double> px_per_rad;
  PrefixMoments moments;  ///< Weights px_per_rad^2: sums of squares are in px^2.

  void clear() {
    rays.clear();
    px_per_rad.clear();
    moments.clear();
  }
  void add(const Eigen::Vector3d& ray, double scale_px_per_rad) {
    rays.push_back(ray);
    px_per_rad.push_back(scale_px_per_rad);
    moments.add(ray, scale_px_per_rad * scale_px_per_rad);
  }
  [[nodiscard]] int size() const { return static_cast<int>(rays.size()); }
  [[nodiscard]] double errPx(int i, const Eigen::Vector3d& normal) const {
    const size_t k = static_cast<size_t>(i);
    return std::abs(rays[k].dot(normal)) * px_per_rad[k];
  }
};

/// Points begin, ..., end - 1 of a chain.
struct PlanarPiece {
  int begin, end;
  Eigen::Vector3d normal;
  double rms_px;
};

/// Pieces in the order of the chain, disjoint. Each starts from seed_px points within max_err_px of
/// their plane and grows, refitting in O(1), until more than max_outliers consecutive points are
/// farther from it.
void splitPlanar(const ChainRays& chain,
                 const PlanarChainOptions& options,
                 std::vector<PlanarPiece>* pieces);

}  // namespace dlsd
