#include "synth/dataset/nearest_line.h"

#include <cmath>

namespace dlsd {

NearestLine::NearestLine(const std::vector<LabelLine>& lines) {
  for (const LabelLine& line : lines) {
    for (size_t i = 1; i < line.points.size(); ++i) {
      const Eigen::Vector2d d = line.points[i] - line.points[i - 1];
      pieces_.push_back({line.points[i - 1], d, d.squaredNorm(), line.id});
    }
  }
}

std::vector<int> NearestLine::candidates(
    const std::vector<int>& from, int x0, int y0, int x1, int y1) const {
  const Eigen::Vector2d centre((x0 + x1 - 1) / 2.0, (y0 + y1 - 1) / 2.0);
  std::vector<double> distances;
  distances.reserve(from.size());
  for (const int k : from) {
    distances.push_back((pieces_[static_cast<size_t>(k)].nearest(centre) - centre).norm());
  }
  const double limit = *std::min_element(distances.begin(), distances.end()) +
                       std::hypot(x1 - 1 - x0, y1 - 1 - y0) + 1e-9;
  std::vector<int> kept;
  for (size_t i = 0; i < from.size(); ++i) {
    if (distances[i] <= limit) kept.push_back(from[i]);
  }
  return kept;
}

float directionAngle(const Eigen::Vector2d& along) {
  double angle = std::atan2(along.y(), along.x());
  if (angle < 0) angle += M_PI;
  const auto rounded = static_cast<float>(angle);
  return rounded < static_cast<float>(M_PI) ? rounded : 0.0F;
}

}  // namespace dlsd
