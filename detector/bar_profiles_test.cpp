#include "detector/bar_profiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace dlsd {
namespace {

constexpr int kColumns = 96, kRows = 8;
constexpr double kContrast = 100, kPositionPx = 44;

const BarProfiles& profiles() {
  static const BarProfiles tables{EdgeProfiler()};
  return tables;
}

/// A step of kContrast at `position_px` and, `width_px` behind it, one of -other times that.
struct Bar {
  double position_px, width_px, other;
  double variance_px2;  ///< Of the Gaussian blur, the pixel included.
};

std::vector<uint16_t> imageOf(const Bar& bar) {
  std::vector<uint16_t> image(size_t{kColumns} * kRows);
  const auto step = [&](double x) { return 0.5 * std::erfc(-x / std::sqrt(2 * bar.variance_px2)); };
  for (size_t i = 0; i < image.size(); ++i) {
    const double x = static_cast<double>(i % kColumns) - bar.position_px;
    // Ground that stays within 0 ... 255 for other in 0 ... 2.5.
    const double grey = 152 + kContrast * (step(x) - bar.other * step(x - bar.width_px));
    image[i] = static_cast<uint16_t>(std::lround(grey * kGreyUnit));
  }
  return image;
}

/// One side of a bar as the narrow filter sees it.
struct Seen {
  double away_px;  ///< How far the true side is away, towards the other side.
  double odd_ratio, even_ratio;
};

/// Searches for the zero of the narrow even response around the first or the second side.
std::optional<Seen> lookAt(EdgeProfiler* profiler, const Bar& bar, bool second) {
  const auto image = imageOf(bar);
  profiler->setPixels({.u8 = nullptr,
                       .fixed = image.data(),
                       .stride = kColumns,
                       .width = kColumns,
                       .height = kRows});
  const auto at = [&](double position) {
    std::array<EdgeResponse, EdgeProfiler::kRows> rows;
    profiler->measure({true, 0, position, 0}, &rows);
    return rows[3];
  };
  const double sign = second ? -1 : 1;  // of the step
  const double truth = bar.position_px + (second ? bar.width_px : 0);
  // From the bar outwards: even / odd is the way to the step, hence changes its sign there.
  for (double inside = 0.5; inside > -3; inside -= 0.25) {
    double a = truth + sign * inside, b = a - sign * 0.25;
    const EdgeResponse begin = at(a), end = at(b);
    if (!(begin.even_narrow < 0 && end.even_narrow >= 0) || !(sign * begin.odd_narrow > 8)) {
      continue;
    }
    for (int i = 0; i < 30; ++i) {
      const double middle = (a + b) / 2;
      (at(middle).even_narrow < 0 ? a : b) = middle;
    }
    const EdgeResponse r = at((a + b) / 2);
    const auto narrow = static_cast<double>(r.odd_narrow);
    return Seen{sign * (truth - (a + b) / 2),
                static_cast<double>(r.odd_wide) / narrow,
                static_cast<double>(r.even_wide) / narrow};
  }
  return std::nullopt;
}

/// What is answered for both sides of bars.
struct Answers {
  int seen = 0, answered = 0;
  double worst_px = 0;
};

Answers answersFor(const std::vector<double>& variances,
                   const std::vector<double>& others,
                   const std::vector<double>& widths) {
  EdgeProfiler profiler;
  Answers answers;
  for (const double variance : variances) {
    for (const double other : others) {
      for (const double width : widths) {
        for (const double phase : {0.0, 0.37}) {
          for (const bool second : {false, true}) {
            // Seen from the second side, the first one is the other.
            const Bar bar{kPositionPx + phase, width, second ? 1 / other : other, variance};
            const auto seen = lookAt(&profiler, bar, second);
            if (!seen) continue;
            ++answers.seen;
            const auto shift =
                profiles().shiftPx(variance, seen->odd_ratio, std::abs(seen->even_ratio));
            if (!shift) continue;
            ++answers.answered;
            const double err_px = std::abs(*shift - seen->away_px);
            EXPECT_TRUE(std::isfinite(err_px) && *shift >= 0);
            // The sign tells where the other side is.
            if (*shift > 0.05) {
              EXPECT_EQ(seen->even_ratio < 0, !second)
                  << variance << " " << other << " " << width << " " << phase;
            }
            answers.worst_px = std::max(answers.worst_px, err_px);
          }
        }
      }
    }
  }
  return answers;
}

/// Contrasts of the other side.
const std::vector<double> kAlike{0.6, 0.8, 1, 1.25, 1.7}, kAny{0.4, 0.6, 0.8, 1, 1.25, 1.7, 2.5};
const std::vector<double> kWidths{2, 2.3, 2.6, 3, 3.5, 4.2, 5};
/// Optics of 0.5, 0.7 and 1 px, with the pixel.
const std::vector<double> kSharp{0.333, 0.573, 1.083};

// Pixels of bars, looked at by the filters: what is answered is where the sides are.
TEST(BarProfiles, SidesAreFoundThroughKnownBlur) {
  const Answers wide = answersFor(kSharp, kAlike, kWidths);
  EXPECT_EQ(wide.seen, 3 * 5 * 7 * 2 * 2);
  EXPECT_GE(wide.answered, 0.98 * wide.seen);
  EXPECT_LE(wide.worst_px, 0.05);
  const Answers thin = answersFor(kSharp, kAlike, {1, 1.2, 1.4, 1.7});
  EXPECT_GE(thin.seen, 0.95 * (3 * 5 * 4 * 2 * 2));
  EXPECT_GE(thin.answered, 0.98 * thin.seen);
  EXPECT_LE(thin.worst_px, 0.35);
}

// Steps that stand alone are where they seem to be.
TEST(BarProfiles, StepsAloneStay) {
  const Answers alone = answersFor(kSharp, kAny, {8, 12});
  EXPECT_EQ(alone.seen, 3 * 7 * 2 * 2 * 2);
  EXPECT_LE(alone.worst_px, 0.02);
}

// Of even bars, the thinner one pushes its sides farther apart.
TEST(BarProfiles, ThinnerBarsSeemWider) {
  EdgeProfiler profiler;
  int steps = 0;
  for (const double variance : kSharp) {
    double before_px = 10;
    for (double width = 1; width <= 5; width += 0.25) {
      const auto seen = lookAt(&profiler, {kPositionPx, width, 1, variance}, false);
      ASSERT_TRUE(seen);
      const auto shift = profiles().shiftPx(variance, seen->odd_ratio, std::abs(seen->even_ratio));
      ASSERT_TRUE(shift) << variance << " " << width;
      EXPECT_LE(*shift, before_px + 0.005) << variance << " " << width;
      // Both sides are moved, but never past each other.
      EXPECT_LE(2 * *shift, width + 2 * seen->away_px);
      before_px = *shift;
      ++steps;
    }
    EXPECT_LE(before_px, 0.05);
  }
  EXPECT_EQ(steps, 3 * 17);
}

TEST(BarProfiles, BeyondTheTables) {
  // The nearest blur counts.
  int answered = 0;
  for (const double odd : {-0.4, 0.1, 0.5, 0.8}) {
    for (const double even : {0.2, 0.6, 1.0}) {
      EXPECT_EQ(profiles().shiftPx(0.01, odd, even), profiles().shiftPx(0.15, odd, even));
      EXPECT_EQ(profiles().shiftPx(9, odd, even), profiles().shiftPx(3, odd, even));
      answered += profiles().shiftPx(9, odd, even).has_value();
    }
  }
  EXPECT_GE(answered, 4);
  // What no bar looks like.
  for (const auto& [odd, even] : {std::pair(1.5, 0.1), {-2.5, 0.5}, {0.5, 6.0}, {0.9, 4.0}}) {
    EXPECT_FALSE(profiles().shiftPx(0.6, odd, even)) << odd << " " << even;
  }
  const double nan = std::nan("");
  EXPECT_FALSE(profiles().shiftPx(0.6, nan, 0.2));
  EXPECT_FALSE(profiles().shiftPx(0.6, 0.5, nan));
}

}  // namespace
}  // namespace dlsd
