#pragma once
// Paper 4.2: straight pieces of a chain of pixels, and their grouping into smooth convex polygons.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "detector/options.h"

namespace dlsd {

/// Points begin, ..., end - 1 of a chain, within max_line_err_px of one straight line.
struct StraightPiece {
  int begin, end;
  Eigen::Vector2d direction;  ///< Unit, along the chain.
};

/// Straight pieces of a chain in order, by growing least-squares lines (total least squares): the
/// first min_line_px points that fit start a piece; points are added while they are near the line
/// fitted to the piece so far; the rest starts the next one. Points that start no piece are
/// skipped.
void splitStraight(std::span<const Eigen::Vector2d> chain,
                   const PolygonalChainOptions& options,
                   std::vector<StraightPiece>* pieces);

/// Pieces first, ..., last - 1.
struct ConvexGroup {
  int first, last;
};

/// Maximal runs of consecutive pieces, greedily from the first: each turns by less than
/// max_turn_rad from the one before it, all in the same direction, with fewer than min_line_px
/// skipped points in between.
void groupConvex(std::span<const StraightPiece> pieces,
                 const PolygonalChainOptions& options,
                 std::vector<ConvexGroup>* groups);

}  // namespace dlsd
