#pragma once
// How far the sides of thin bars are from where they seem to be.

#include <array>
#include <optional>

#include "detector/edge_profile.h"

namespace dlsd {

/// Through any blur, the sides of a bar (a step and, at a distance of some pixels, one of the
/// opposite sign) push each other apart: those of a bar of width 0 seem 2.5 px apart at optical
/// blur 0.7 px. Where one of them seems to be, the four responses tell how far.
class BarProfiles {
 public:
  /// Tables from the filters' responses to steps: some milliseconds.
  explicit BarProfiles(const EdgeProfiler& profiler);

  /// How far the side that seems to be here (even_narrow is 0) is away, px along the row, >= 0,
  /// towards the other side of the bar. That one is on the side of positive positions if
  /// even_wide / odd_narrow is negative. Of the bars that look alike the mean, of which wide ones
  /// and those of equal contrasts count most: good to 0.05 px for widths from 2 px, contrasts from
  /// 0.6 to 1.7 and variances from 0.3 to 1.1; to 0.12 px (0.17 at 2.5 px^2) for contrasts from 0.4
  /// to 2.5; to 0.6 px below 2 px. No value if no bar looks similar, as wide ones at a variance
  /// above 2 px^2, which seem to be where they are to 0.4 px (0.7 px at 3).
  /// @param blur_variance  Along the row, px^2; beyond the tables the nearest counts.
  /// @param odd_ratio  odd_wide / odd_narrow there.
  /// @param even_ratio  |even_wide / odd_narrow| there.
  [[nodiscard]] std::optional<double> shiftPx(double blur_variance,
                                              double odd_ratio,
                                              double even_ratio) const;

 private:
  static constexpr std::array kVariances{0.15, 0.3, 0.45, 0.6, 0.8, 1.1, 1.5, 2.1, 3.0};
  static constexpr double kLeastOdd = -2, kStep = 0.04;
  static constexpr size_t kOdds = 77, kEvens = 130;
  struct Node {
    float shift_px, weight;
  };
  using Table = std::array<std::array<Node, kEvens>, kOdds>;

  [[nodiscard]] std::optional<double> lookUp(const Table& table, double odd, double even) const;

  std::array<Table, kVariances.size()> tables_{};
};

}  // namespace dlsd
