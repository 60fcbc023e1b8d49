#pragma once
// Pieces of an edge chain that lie in one plane through the optical centre: straight in space,
// whatever the lens makes of them. The generalisation of the straight pieces of 4.2.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "cameras/ray_table.h"
#include "detector/edge_linking.h"
#include "detector/options.h"

namespace dlsd {

/// A piece of a chain: what a trace starts from.
struct PlanarPiece {
  Eigen::Vector3d normal;      ///< Of the plane through its ends.
  Eigen::Vector2d start_px;    ///< On the chain, about the middle of the piece.
  int length_px;               ///< Rows (columns) that it crosses.
  uint32_t first_node, nodes;  ///< Its points among PlanarSplitter::nodes().
  float farthest_px;           ///< Of its points from the plane ...
  uint32_t farthest_node;      ///< ... and which one that is.
};

class PlanarSplitter {
 public:
  PlanarSplitter(const RayTable& rays, const PlanarChainOptions& options)
      : rays_(rays), options_(options) {}

  /// Points of about kNodePx crests each are joined by planes; where a chain strays from the plane
  /// through its ends by more than max_err_px, it is split at the farthest point, again and again.
  void split(const CrestChains& chains, std::vector<PlanarPiece>* pieces);

  /// A part of a piece: the nodes first ... last, joined by a plane of their own. No value if they
  /// are fewer than two, shorter than seed_px or have no plane.
  [[nodiscard]] std::optional<PlanarPiece> part(const PlanarPiece& of,
                                                uint32_t first,
                                                uint32_t last) const;

  /// Means of about kNodePx consecutive crests, chain by chain.
  [[nodiscard]] const std::vector<Eigen::Vector2f>& nodes() const { return nodes_; }

  static constexpr int kNodePx = 6;

 private:
  struct NodeRay {
    Eigen::Vector3f ray;
    float px_per_rad;
  };
  void splitInterval(uint32_t first,
                     uint32_t last,
                     float px_per_node,
                     std::vector<PlanarPiece>* pieces);
  [[nodiscard]] std::optional<PlanarPiece> pieceOf(uint32_t first,
                                                   uint32_t last,
                                                   float px_per_node) const;

  const RayTable& rays_;
  PlanarChainOptions options_;
  std::vector<Eigen::Vector2f> nodes_;
  std::vector<NodeRay> node_rays_;
  std::vector<std::pair<uint32_t, uint32_t>> stack_;
};

}  // namespace dlsd
