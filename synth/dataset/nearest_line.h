#pragma once
// The nearest point of any label, for whole blocks of pixels.

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <vector>

#include "synth/dataset/records.h"

namespace dlsd {

class NearestLine {
 public:
  struct Nearest {
    Eigen::Vector2d point;
    Eigen::Vector2d along;  ///< Of the straight piece of curve that the point is on.
    int label;              ///< Its id.
    double distance;        ///< px.
  };

  explicit NearestLine(const std::vector<LabelLine>& lines);

  /// Calls function(x, y, nearest) for all pixel centres with x0 <= x < x1, y0 <= y < y1; not at
  /// all if there are no lines. Of equally near ones the first in order. What a pixel gets does not
  /// depend on the block.
  template <class Function>
  void forEach(int x0, int y0, int x1, int y1, const Function& function) const {
    if (pieces_.empty() || x0 >= x1 || y0 >= y1) return;
    std::vector<int> all(pieces_.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
    split(all, x0, y0, x1, y1, function);
  }

 private:
  static constexpr int kLeaf = 8;

  struct Piece {
    Eigen::Vector2d from, along;  ///< along: to the other end.
    double length2;
    int label;

    [[nodiscard]] Eigen::Vector2d nearest(const Eigen::Vector2d& p) const {
      const double t = length2 > 0 ? std::clamp((p - from).dot(along) / length2, 0.0, 1.0) : 0.0;
      return from + t * along;
    }
  };

  /// Those of `from` that can be the nearest of a point of the block: if the centre has the nearest
  /// piece at distance d and all points are within r of the centre, the pieces within d + 2 r of
  /// it.
  [[nodiscard]] std::vector<int> candidates(
      const std::vector<int>& from, int x0, int y0, int x1, int y1) const;

  template <class Function>
  void split(const std::vector<int>& from, int x0, int y0, int x1, int y1, const Function& function)
      const {
    const std::vector<int> kept = candidates(from, x0, y0, x1, y1);
    if (x1 - x0 > kLeaf && x1 - x0 >= y1 - y0) {
      const int x = (x0 + x1) / 2;
      split(kept, x0, y0, x, y1, function);
      split(kept, x, y0, x1, y1, function);
      return;
    }
    if (y1 - y0 > kLeaf) {
      const int y = (y0 + y1) / 2;
      split(kept, x0, y0, x1, y, function);
      split(kept, x0, y, x1, y1, function);
      return;
    }
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const Eigen::Vector2d p(x, y);
        Nearest best{p, {1, 0}, -1, std::numeric_limits<double>::infinity()};
        for (const int k : kept) {
          const Piece& piece = pieces_[static_cast<size_t>(k)];
          const Eigen::Vector2d q = piece.nearest(p);
          const double distance = (q - p).norm();
          if (distance < best.distance) best = {q, piece.along, piece.label, distance};
        }
        function(x, y, best);
      }
    }
  }

  std::vector<Piece> pieces_;
};

/// Direction of a line: angle from x towards y, rad, in [0, pi), as float.
[[nodiscard]] float directionAngle(const Eigen::Vector2d& along);

}  // namespace dlsd
