#include "evaluation/bootstrap.h"

#include <algorithm>
#include <cmath>

#include "cameras/mutant.h"
#include "synth/dataset/random.h"

namespace dlsd {
namespace {

constexpr uint64_t kStream = 0xb007;

}  // namespace

double quantile(std::span<const double> sorted, double q) {
  const double rank = q * double(sorted.size() - 1);
  const auto below = size_t(rank);
  const size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (rank - double(below)) * (sorted[above] - sorted[below]);
}

Bootstrap::Bootstrap(size_t images, size_t resamples)
    : images_(images),
      resamples_(images < kMinImages ? 0 : resamples),
      weights_(images_ * resamples_) {
  for (size_t r = 0; r < resamples_; ++r) {
    const Random random(r, kStream);
    uint8_t* const weights = weights_.data() + r * images_;
    for (size_t k = 0; k < images_; ++k) {
      const auto drawn = size_t(random.uniform(k, 0, double(images_)));
      uint8_t& weight = weights[std::min(drawn, images_ - 1)];
      weight = uint8_t(std::min(weight + 1, 255));
    }
  }
}

std::optional<Interval> Bootstrap::of(
    size_t count,
    const std::function<std::optional<double>(std::span<const uint8_t>)>& figure) const {
  count = std::min(count, resamples_);
  std::vector<double> values;
  for (size_t r = 0; r < count; ++r) {
    if (const std::optional<double> value = figure(weights(r))) {
      values.push_back(*value);
    }
  }
  if (values.empty() || 2 * values.size() <= count) {
    return std::nullopt;
  }
  std::sort(values.begin(), values.end());
  return Interval{quantile(values, DLSD_MUTANT("interval-90") ? 0.05 : 0.025),
                  quantile(values, DLSD_MUTANT("interval-90") ? 0.95 : 0.975)};
}

std::optional<Interval> Bootstrap::ofRatio(std::span<const double> counted,
                                           std::span<const double> total) const {
  return of(resamples_, [&](std::span<const uint8_t> weights) -> std::optional<double> {
    double sum_counted = 0, sum_total = 0;
    for (size_t i = 0; i < images_; ++i) {
      sum_counted += weights[i] * counted[i];
      sum_total += weights[i] * total[i];
    }
    return sum_total > 0 ? std::optional(sum_counted / sum_total) : std::nullopt;
  });
}

}  // namespace dlsd
