#include "detector/planar_chain.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "cameras/mutant.h"

namespace dlsd {

std::optional<PlanarPiece> PlanarSplitter::pieceOf(uint32_t first,
                                                   uint32_t last,
                                                   float px_per_node) const {
  const int length_px = static_cast<int>(static_cast<float>(last - first + 1) * px_per_node + 0.5F);
  if (last == first || length_px < options_.seed_px) return std::nullopt;
  const Eigen::Vector3d normal =
      node_rays_[first].ray.cast<double>().cross(node_rays_[last].ray.cast<double>());
  const double norm = normal.norm();
  if (!(norm > 0)) return std::nullopt;
  PlanarPiece piece{normal / norm,
                    nodes_[(first + last) / 2].cast<double>(),
                    length_px,
                    first,
                    last - first + 1,
                    0,
                    first};
  const Eigen::Vector3f rounded = piece.normal.cast<float>();
  for (uint32_t i = first + 1; i < last; ++i) {
    const float err_px = std::abs(node_rays_[i].ray.dot(rounded)) * node_rays_[i].px_per_rad;
    if (err_px > piece.farthest_px) {
      piece.farthest_px = err_px;
      piece.farthest_node = i;
    }
  }
  return piece;
}

std::optional<PlanarPiece> PlanarSplitter::part(const PlanarPiece& of,
                                                uint32_t first,
                                                uint32_t last) const {
  return pieceOf(first, last, static_cast<float>(of.length_px) / static_cast<float>(of.nodes));
}

/// Nodes first ... last.
void PlanarSplitter::splitInterval(uint32_t first,
                                   uint32_t last,
                                   float px_per_node,
                                   std::vector<PlanarPiece>* pieces) {
  stack_.clear();
  stack_.emplace_back(first, last);
  while (!stack_.empty()) {
    const auto [a, b] = stack_.back();
    stack_.pop_back();
    const auto piece = pieceOf(a, b, px_per_node);
    if (!piece) continue;
    if (static_cast<double>(piece->farthest_px) >
        (DLSD_MUTANT("split-error") ? 2 : 1) * options_.max_err_px) {
      // The later half first onto the stack: pieces come out in the order of the chain.
      stack_.emplace_back(piece->farthest_node, b);
      stack_.emplace_back(a, piece->farthest_node);
      continue;
    }
    pieces->push_back(*piece);
  }
}

void PlanarSplitter::split(const CrestChains& chains, std::vector<PlanarPiece>* pieces) {
  pieces->clear();
  nodes_.clear();
  node_rays_.clear();
  for (const CrestChains::Chain& chain : chains.chains) {
    const auto first = static_cast<uint32_t>(nodes_.size());
    const uint32_t count = std::max(2U, chain.size / kNodePx);
    for (uint32_t i = 0; i < count; ++i) {
      const uint32_t begin = i * chain.size / count, end = (i + 1) * chain.size / count;
      uint32_t sum = 0;
      for (uint32_t k = begin; k < end; ++k) sum += chains.across[chain.first + k];
      const auto size = static_cast<float>(end - begin);
      const float across = static_cast<float>(sum) / size;
      const float along = static_cast<float>(chain.start) + static_cast<float>(begin + end - 1) / 2;
      const Eigen::Vector2f p =
          chain.crosses_rows ? Eigen::Vector2f(across, along) : Eigen::Vector2f(along, across);
      const auto u = static_cast<double>(p.x()), v = static_cast<double>(p.y());
      if (!rays_.covers(u, v)) continue;
      const RaySample sample = rays_.at(u, v);
      nodes_.push_back(p);
      node_rays_.push_back({sample.ray.cast<float>(), static_cast<float>(sample.pxPerRad())});
    }
    const auto last = static_cast<uint32_t>(nodes_.size());
    if (last < first + 2) continue;
    splitInterval(
        first, last - 1, static_cast<float>(chain.size) / static_cast<float>(last - first), pieces);
  }
}

}  // namespace dlsd
