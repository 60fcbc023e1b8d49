#include "synth/dataset/statistics.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace dlsd {
namespace {

constexpr double kNearPx = 10;
constexpr double kNearEndPx = 15;
constexpr double kStepPx = 1;

struct Sample {
  Eigen::Vector2d point;
  size_t line;
  bool near_end;  ///< Within kNearEndPx along the curve of an end.
};

double share(size_t counted, size_t total) {
  return total == 0 ? 0 : static_cast<double>(counted) / static_cast<double>(total);
}

/// Linear interpolation between order statistics; 0 for an empty set.
double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double position = q * static_cast<double>(values.size() - 1);
  const auto i = static_cast<size_t>(position);
  const size_t j = std::min(i + 1, values.size() - 1);
  return values[i] + (position - static_cast<double>(i)) * (values[j] - values[i]);
}

std::vector<Sample> sampleLines(const LabelRecord& record) {
  std::vector<Sample> samples;
  for (size_t l = 0; l < record.lines.size(); ++l) {
    const auto& points = record.lines[l].points;
    const double total = curveLength(points);
    double before = 0;
    for (size_t i = 1; i < points.size(); ++i) {
      const double length = (points[i] - points[i - 1]).norm();
      const int steps = std::max(1, static_cast<int>(std::ceil(length / kStepPx)));
      for (int k = i == 1 ? 0 : 1; k <= steps; ++k) {
        const double t = static_cast<double>(k) / steps;
        const double s = before + t * length;
        samples.push_back({points[i - 1] + t * (points[i] - points[i - 1]),
                           l,
                           s < kNearEndPx || total - s < kNearEndPx});
      }
      before += length;
    }
  }
  return samples;
}

struct Cell {
  static int64_t of(double x) { return static_cast<int64_t>(std::floor(x / kNearPx)); }
  static uint64_t key(int64_t x, int64_t y) {
    return (static_cast<uint64_t>(x) << 32) ^ (static_cast<uint64_t>(y) & 0xffffffffU);
  }
};

/// Counts the lines of one frame that come near another one.
void countNeighbours(const LabelRecord& record, LabelStatistics* statistics) {
  const std::vector<Sample> samples = sampleLines(record);
  std::unordered_map<uint64_t, std::vector<size_t>> grid;
  for (size_t i = 0; i < samples.size(); ++i) {
    grid[Cell::key(Cell::of(samples[i].point.x()), Cell::of(samples[i].point.y()))].push_back(i);
  }
  std::vector<char> touching(record.lines.size(), 0), crowded(record.lines.size(), 0);
  for (const Sample& a : samples) {
    if (crowded[a.line] != 0) continue;
    const int64_t cx = Cell::of(a.point.x()), cy = Cell::of(a.point.y());
    for (int64_t y = cy - 1; y <= cy + 1; ++y) {
      for (int64_t x = cx - 1; x <= cx + 1; ++x) {
        const auto it = grid.find(Cell::key(x, y));
        if (it == grid.end()) continue;
        for (const size_t k : it->second) {
          const Sample& b = samples[k];
          if (b.line == a.line || !((a.point - b.point).squaredNorm() < kNearPx * kNearPx))
            continue;
          touching[a.line] = 1;
          if (!a.near_end && !b.near_end) crowded[a.line] = 1;
        }
      }
    }
  }
  for (size_t l = 0; l < record.lines.size(); ++l) {
    statistics->touching_lines += touching[l] != 0 ? 1U : 0U;
    statistics->crowded_lines += crowded[l] != 0 ? 1U : 0U;
  }
}

}  // namespace

double curveLength(const std::vector<Eigen::Vector2d>& points) {
  double length = 0;
  for (size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

std::vector<Eigen::Vector2d> equalArcPoints(const std::vector<Eigen::Vector2d>& points,
                                            size_t count) {
  const double total = curveLength(points);
  std::vector<Eigen::Vector2d> out{points.front()};
  size_t i = 1;
  double before = 0, piece = (points[1] - points[0]).norm();
  for (size_t k = 1; k + 1 < count; ++k) {
    const double s = total * static_cast<double>(k) / static_cast<double>(count - 1);
    while (i + 1 < points.size() && before + piece < s) {
      before += piece;
      ++i;
      piece = (points[i] - points[i - 1]).norm();
    }
    const double t = piece > 0 ? std::min(1.0, (s - before) / piece) : 0;
    out.emplace_back((1 - t) * points[i - 1] + t * points[i]);
  }
  out.push_back(points.back());
  return out;
}

double LabelStatistics::crowdedShare() const {
  return share(crowded_lines, lines);
}
double LabelStatistics::touchingShare() const {
  return share(touching_lines, lines);
}
double LabelStatistics::cutEndShare() const {
  const auto count = [&](EndKind kind) { return ends[static_cast<size_t>(kind)]; };
  return share(count(EndKind::kOccluder) + count(EndKind::kBorder) + count(EndKind::kRim) +
                   count(EndKind::kSeam),
               2 * lines);
}

LabelStatistics labelStatistics(const std::vector<LabelRecord>& records) {
  LabelStatistics statistics;
  std::vector<double> per_frame, contrasts, lengths, angles;
  for (const LabelRecord& record : records) {
    ++statistics.frames;
    statistics.lines += record.lines.size();
    per_frame.push_back(static_cast<double>(record.lines.size()));
    for (const LabelLine& line : record.lines) {
      ++statistics.kinds[static_cast<size_t>(line.kind)];
      for (const EndKind end : line.ends) ++statistics.ends[static_cast<size_t>(end)];
      contrasts.push_back(line.contrast);
      lengths.push_back(line.length_px);
      angles.push_back(line.angle_rad);
    }
    countNeighbours(record, &statistics);
  }
  if (!per_frame.empty()) {
    const auto [least, most] = std::minmax_element(per_frame.begin(), per_frame.end());
    statistics.min_lines_per_frame = static_cast<size_t>(*least);
    statistics.max_lines_per_frame = static_cast<size_t>(*most);
  }
  statistics.median_lines_per_frame = quantile(per_frame, 0.5);
  statistics.quarter_contrast = quantile(contrasts, 0.25);
  statistics.median_contrast = quantile(contrasts, 0.5);
  statistics.three_quarter_contrast = quantile(contrasts, 0.75);
  statistics.median_length_px = quantile(lengths, 0.5);
  statistics.median_angle_rad = quantile(angles, 0.5);
  return statistics;
}

}  // namespace dlsd
