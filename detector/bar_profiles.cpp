#include "detector/bar_profiles.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

constexpr int kPerPx = 16;
constexpr double kReachPx = 10;
constexpr size_t kSamples = static_cast<size_t>(2 * kReachPx * kPerPx) + 1;

/// Responses of the four filters to a rising step of one grey level, by its position.
class StepResponses {
 public:
  StepResponses(const EdgeProfiler& profiler, double variance) : samples_(kSamples) {
    for (size_t i = 0; i < kSamples; ++i) {
      samples_[i] = profiler.stepResponse(static_cast<double>(i) / kPerPx - kReachPx, variance);
    }
  }
  [[nodiscard]] EdgeResponse at(double position_px) const {
    const double at = std::clamp(
        (position_px + kReachPx) * kPerPx, 0.0, static_cast<double>(kSamples - 1) - 1e-9);
    const auto i = static_cast<size_t>(at);
    const auto t = static_cast<float>(at - static_cast<double>(i));
    const EdgeResponse &a = samples_[i], &b = samples_[i + 1];
    return {a.odd_narrow + t * (b.odd_narrow - a.odd_narrow),
            a.even_narrow + t * (b.even_narrow - a.even_narrow),
            a.odd_wide + t * (b.odd_wide - a.odd_wide),
            a.even_wide + t * (b.even_wide - a.even_wide)};
  }
  /// To a step and, `width_px` behind it, another one of so many grey levels.
  [[nodiscard]] EdgeResponse ofBar(double position_px, double width_px, float other) const {
    const EdgeResponse a = at(position_px), b = at(position_px + width_px);
    return {a.odd_narrow + other * b.odd_narrow,
            a.even_narrow + other * b.even_narrow,
            a.odd_wide + other * b.odd_wide,
            a.even_wide + other * b.even_wide};
  }

 private:
  std::vector<EdgeResponse> samples_;
};

/// Where the first side of a bar is if it seems to be at 0; no value if it can't be seen.
std::optional<double> positionOf(const StepResponses& steps, double width_px, float other) {
  constexpr float kLeastLevel = 0.1F;
  constexpr int kSteps = 3 * kPerPx;
  EdgeResponse before = steps.ofBar(-0.5, width_px, other);
  for (int i = 1; i <= kSteps; ++i) {
    const double position = -0.5 + static_cast<double>(i) / kPerPx;
    const EdgeResponse here = steps.ofBar(position, width_px, other);
    if (before.even_narrow < 0 && here.even_narrow >= 0 && here.odd_narrow > kLeastLevel) {
      const auto t =
          static_cast<double>(before.even_narrow / (before.even_narrow - here.even_narrow));
      return position - (1 - t) / kPerPx;
    }
    before = here;
  }
  return std::nullopt;
}

}  // namespace

BarProfiles::BarProfiles(const EdgeProfiler& profiler) {
  constexpr double kWidthStepPx = 0.1, kMaxWidthPx = 6;
  // Ratios of contrasts, from 1/8 to 8; bars of even ground are believed first.
  constexpr int kRatios = 41;
  for (size_t level = 0; level < kVariances.size(); ++level) {
    Table& table = tables_[level];
    const StepResponses steps(profiler, kVariances[level]);
    for (double width = kWidthStepPx; width <= kMaxWidthPx; width += kWidthStepPx) {
      for (int k = 0; k < kRatios; ++k) {
        const double log2_ratio = -3 + 6.0 * k / (kRatios - 1);
        const auto other = static_cast<float>(-std::exp2(log2_ratio));
        const auto position = positionOf(steps, width, other);
        if (!position) continue;
        const EdgeResponse r = steps.ofBar(*position, width, other);
        const double odd = static_cast<double>(r.odd_wide / r.odd_narrow);
        const double even = static_cast<double>(-r.even_wide / r.odd_narrow);
        const double at_odd = (odd - kLeastOdd) / kStep, at_even = even / kStep;
        if (!(at_odd >= 0 && at_odd < kOdds - 1 && at_even >= 0 && at_even < kEvens - 1)) continue;
        const auto i = static_cast<size_t>(at_odd), j = static_cast<size_t>(at_even);
        const double u = at_odd - static_cast<double>(i), v = at_even - static_cast<double>(j);
        const double prior = width * width * std::exp(-0.5 * log2_ratio * log2_ratio);
        for (const auto& [di, dj, w] : {std::tuple(0, 0, (1 - u) * (1 - v)),
                                        std::tuple(0, 1, (1 - u) * v),
                                        std::tuple(1, 0, u * (1 - v)),
                                        std::tuple(1, 1, u * v)}) {
          Node& node = table[i + static_cast<size_t>(di)][j + static_cast<size_t>(dj)];
          const auto weight = static_cast<float>(w * prior);
          node.shift_px += weight * static_cast<float>(*position);
          node.weight += weight;
        }
      }
    }
    for (auto& row : table) {
      for (Node& node : row) {
        if (node.weight > 0) node.shift_px /= node.weight;
      }
    }
    // What noise moves out of the band of true bars counts as the nearest of them.
    for (int pass = 0; pass < 8; ++pass) {
      const Table before = table;
      for (size_t i = 0; i < kOdds; ++i) {
        for (size_t j = 0; j < kEvens; ++j) {
          if (before[i][j].weight > 0) continue;
          float sum = 0, count = 0;
          for (size_t a = i - (i > 0); a <= std::min(i + 1, kOdds - 1); ++a) {
            for (size_t b = j - (j > 0); b <= std::min(j + 1, kEvens - 1); ++b) {
              if (!(before[a][b].weight > 0)) continue;
              sum += before[a][b].shift_px;
              count += 1;
            }
          }
          if (count > 0) table[i][j] = {sum / count, 1};
        }
      }
    }
  }
}

std::optional<double> BarProfiles::lookUp(const Table& table, double odd, double even) const {
  const double at_odd = (odd - kLeastOdd) / kStep, at_even = even / kStep;
  if (!(at_odd >= 0 && at_odd < kOdds - 1 && at_even >= 0 && at_even < kEvens - 1)) {
    return std::nullopt;
  }
  const auto i = static_cast<size_t>(at_odd), j = static_cast<size_t>(at_even);
  const double u = at_odd - static_cast<double>(i), v = at_even - static_cast<double>(j);
  double sum = 0, weights = 0;
  for (const auto& [node, w] : {std::pair(&table[i][j], (1 - u) * (1 - v)),
                                std::pair(&table[i][j + 1], (1 - u) * v),
                                std::pair(&table[i + 1][j], u * (1 - v)),
                                std::pair(&table[i + 1][j + 1], u * v)}) {
    if (!(node->weight > 0)) continue;
    sum += w * static_cast<double>(node->shift_px);
    weights += w;
  }
  if (!(weights > 1e-6)) return std::nullopt;
  return sum / weights;
}

std::optional<double> BarProfiles::shiftPx(double blur_variance,
                                           double odd_ratio,
                                           double even_ratio) const {
  const double variance = std::clamp(blur_variance, kVariances.front(), kVariances.back());
  size_t i = 0;
  while (i + 2 < kVariances.size() && kVariances[i + 1] < variance) ++i;
  const double t = (variance - kVariances[i]) / (kVariances[i + 1] - kVariances[i]);
  const auto a = lookUp(tables_[i], odd_ratio, even_ratio);
  const auto b = lookUp(tables_[i + 1], odd_ratio, even_ratio);
  if (!a || !b) return a ? a : b;
  return (DLSD_MUTANT("bar-shift") ? 0.5 : 1) * (*a + t * (*b - *a));
}

}  // namespace dlsd
