#pragma once
// How far figures would move had other images been drawn: the bootstrap over images.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace dlsd {

/// Quantile q in [0, 1] of values that are sorted and not empty, linear between neighbours.
[[nodiscard]] double quantile(std::span<const double> sorted, double q);

struct Interval {
  double low = 0, high = 0;
  bool operator==(const Interval&) const = default;
};

/// Resamples of a set of images, each as large as the set, drawn with replacement. Counter-based:
/// the same images give the same resamples, always.
class Bootstrap {
 public:
  /// Below this number of images there are no intervals.
  static constexpr size_t kMinImages = 10;

  explicit Bootstrap(size_t images, size_t resamples = 1000);

  [[nodiscard]] size_t resamples() const { return resamples_; }
  /// How often each image is in a resample, at most 255.
  [[nodiscard]] std::span<const uint8_t> weights(size_t resample) const {
    return {weights_.data() + resample * images_, images_};
  }

  /// 2.5 % and 97.5 % quantiles of sum(counted) / sum(total) over the resamples; one value of each
  /// per image. Resamples without any total are left out; none if half of them are, or if there are
  /// fewer than kMinImages images.
  [[nodiscard]] std::optional<Interval> ofRatio(std::span<const double> counted,
                                                std::span<const double> total) const;

  /// The same of any figure of the first `count` resamples.
  [[nodiscard]] std::optional<Interval> of(
      size_t count,
      const std::function<std::optional<double>(std::span<const uint8_t>)>& figure) const;

 private:
  size_t images_, resamples_;
  std::vector<uint8_t> weights_;  ///< [resample][image]
};

}  // namespace dlsd
