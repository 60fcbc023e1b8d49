#pragma once
// Crests of the gradient -> chains. In one plane of the edge map an edge crosses the rows (or the
// columns) one after the other, so a chain is one coordinate per row (or column).

#include <cstdint>
#include <vector>

#include "detector/edge_map.h"

namespace dlsd {

struct CrestChains {
  struct Chain {
    uint32_t first;  ///< Of `across`.
    uint32_t size;
    uint16_t start;     ///< First row of a chain that crosses rows, else its first column.
    bool crosses_rows;  ///< across[first + i] is the column in row start + i; else swapped.
  };
  std::vector<Chain> chains;
  std::vector<uint16_t> across;
};

class EdgeLinker {
 public:
  EdgeLinker(int width, const EdgeDrawingOptions& options);

  /// Chains of at least min_chain_px with at least one strong crest. Gaps of one pixel are crossed.
  /// Takes the crests out of the map: no crest is in two chains, and none is left.
  void link(EdgeMap* map, CrestChains* chains);

 private:
  void linkRows(const BitRows& strong, BitRows* crests, CrestChains* chains);
  void linkColumns(const BitRows& strong, BitRows* crests, CrestChains* chains);
  void keep(const BitRows& strong, uint32_t first, int start, bool crosses_rows, CrestChains* out);

  EdgeDrawingOptions options_;
  std::vector<uint16_t> rows_of_column_;
};

}  // namespace dlsd
