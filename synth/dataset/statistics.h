#pragma once
// What a set of labels is like: how many lines, how crowded, how often cut off.

#include <array>
#include <cstddef>
#include <vector>

#include "synth/dataset/records.h"

namespace dlsd {

/// Length of a polyline, px.
[[nodiscard]] double curveLength(const std::vector<Eigen::Vector2d>& points);

/// `count` >= 2 points of a polyline of two or more, at equal arc length, its ends included.
[[nodiscard]] std::vector<Eigen::Vector2d> equalArcPoints(
    const std::vector<Eigen::Vector2d>& points, size_t count);

struct LabelStatistics {
  size_t frames = 0, lines = 0;
  double median_lines_per_frame = 0;
  size_t min_lines_per_frame = 0, max_lines_per_frame = 0;
  /// Lines with a point nearer than 10 px to another line of the frame, not counting the parts
  /// within 15 px of an end of either line (so that a shared corner alone does not make lines
  /// neighbours).
  size_t crowded_lines = 0;
  /// Lines of which any point, ends included, is nearer than 10 px to another line.
  size_t touching_lines = 0;
  std::array<size_t, 5> ends{};   ///< Counts of span ends by EndKind; they sum to 2 * lines.
  std::array<size_t, 5> kinds{};  ///< Counts of lines by LineKind.
  double median_contrast = 0, quarter_contrast = 0, three_quarter_contrast = 0;  ///< Grey levels.
  double median_length_px = 0, median_angle_rad = 0;

  /// Shares, 0 for an empty set.
  [[nodiscard]] double crowdedShare() const;
  [[nodiscard]] double touchingShare() const;
  /// Span ends at an occluder, the image border, the field-of-view rim or a seam.
  [[nodiscard]] double cutEndShare() const;
};

[[nodiscard]] LabelStatistics labelStatistics(const std::vector<LabelRecord>& records);

}  // namespace dlsd
