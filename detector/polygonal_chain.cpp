#include "detector/polygonal_chain.h"

#include <algorithm>
#include <cmath>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

/// Line of total least squares from running sums, relative to the first point.
class LineFit {
 public:
  explicit LineFit(const Eigen::Vector2d& origin) : origin_(origin) {}

  void add(const Eigen::Vector2d& point) {
    const Eigen::Vector2d p = point - origin_;
    ++count_;
    sum_ += p;
    xx_ += p.x() * p.x();
    xy_ += p.x() * p.y();
    yy_ += p.y() * p.y();
  }

  void fit() {
    mean_ = sum_ / count_;
    const double sxx = xx_ - sum_.x() * mean_.x();
    const double sxy = xy_ - sum_.x() * mean_.y();
    const double syy = yy_ - sum_.y() * mean_.y();
    const double half_difference = (sxx - syy) / 2;
    const double radius = std::hypot(half_difference, sxy);
    // Eigenvector of the larger eigenvalue, from the row that does not cancel.
    direction_ = half_difference >= 0 ? Eigen::Vector2d(half_difference + radius, sxy)
                                      : Eigen::Vector2d(sxy, radius - half_difference);
    const double length = direction_.norm();
    direction_ = length > 0 ? Eigen::Vector2d(direction_ / length) : Eigen::Vector2d::UnitX();
  }

  [[nodiscard]] double distance(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d p = point - origin_ - mean_;
    return std::abs(p.x() * direction_.y() - p.y() * direction_.x());
  }
  [[nodiscard]] const Eigen::Vector2d& direction() const { return direction_; }

 private:
  Eigen::Vector2d origin_, sum_{0, 0}, mean_{0, 0}, direction_{1, 0};
  double count_ = 0, xx_ = 0, xy_ = 0, yy_ = 0;
};

}  // namespace

void splitStraight(std::span<const Eigen::Vector2d> chain,
                   const PolygonalChainOptions& options,
                   std::vector<StraightPiece>* pieces) {
  pieces->clear();
  const int size = static_cast<int>(chain.size());
  const auto point = [&](int i) -> const Eigen::Vector2d& { return chain[static_cast<size_t>(i)]; };
  int begin = 0;
  while (begin + options.min_line_px <= size) {
    int end = begin + options.min_line_px;
    LineFit line(point(begin));
    for (int i = begin; i < end; ++i) line.add(point(i));
    line.fit();
    bool straight = true;
    for (int i = begin; i < end; ++i) {
      straight = straight && line.distance(point(i)) <= options.max_line_err_px;
    }
    if (!straight) {
      ++begin;
      continue;
    }
    while (end < size && line.distance(point(end)) <= options.max_line_err_px) {
      line.add(point(end));
      line.fit();
      ++end;
    }
    Eigen::Vector2d direction = line.direction();
    if (direction.dot(point(end - 1) - point(begin)) < 0) direction = -direction;
    pieces->push_back({begin, end, direction});
    begin = end;
  }
}

void groupConvex(std::span<const StraightPiece> pieces,
                 const PolygonalChainOptions& options,
                 std::vector<ConvexGroup>* groups) {
  groups->clear();
  const int size = static_cast<int>(pieces.size());
  for (int first = 0; first < size;) {
    int last = first + 1;
    int turn = 0;
    for (; last < size; ++last) {
      const StraightPiece& a = pieces[static_cast<size_t>(last - 1)];
      const StraightPiece& b = pieces[static_cast<size_t>(last)];
      if (b.begin - a.end >= options.min_line_px) break;
      const double sine = a.direction.x() * b.direction.y() - a.direction.y() * b.direction.x();
      const double angle = std::atan2(sine, a.direction.dot(b.direction));
      if (!(std::abs(angle) < options.max_turn_rad)) break;
      const int sign = (angle > 0) - (angle < 0);
      if (sign * turn < 0 && !DLSD_MUTANT("convex-turn")) break;
      if (sign != 0) turn = sign;
    }
    groups->push_back({first, last});
    first = last;
  }
}

}  // namespace dlsd
