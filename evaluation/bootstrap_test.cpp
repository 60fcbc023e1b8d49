#include "evaluation/bootstrap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "synth/dataset/random.h"

namespace dlsd {
namespace {

TEST(Bootstrap, ResamplesHaveTheSizeOfTheSetAndAreTheSameEachTime) {
  const Bootstrap a(57), b(57);
  std::vector<long> drawn(57);
  for (size_t r = 0; r < a.resamples(); ++r) {
    const auto weights = a.weights(r);
    EXPECT_EQ(std::accumulate(weights.begin(), weights.end(), 0), 57);
    EXPECT_TRUE(std::equal(weights.begin(), weights.end(), b.weights(r).begin()));
    for (size_t i = 0; i < drawn.size(); ++i) {
      drawn[i] += weights[i];
    }
  }
  ASSERT_EQ(a.resamples(), 1000U);
  for (const long n : drawn) {  // 1000 +- 31.3
    EXPECT_GE(n, 1000 - 130);
    EXPECT_LE(n, 1000 + 130);
  }
}

TEST(Bootstrap, IntervalOfAShareIsThatOfTheBinomial) {
  // 400 images with one label each, 100 found: the standard error is sqrt(p q / n).
  std::vector<double> counted(400), total(400, 1);
  std::fill_n(counted.begin(), 100, 1.0);
  const auto interval = Bootstrap(400).ofRatio(counted, total);
  ASSERT_TRUE(interval);
  const double sigma = std::sqrt(0.25 * 0.75 / 400);
  EXPECT_NEAR(interval->low, 0.25 - 1.96 * sigma, 0.15 * sigma);
  EXPECT_NEAR(interval->high, 0.25 + 1.96 * sigma, 0.15 * sigma);
}

TEST(Bootstrap, CoversTheTruthAsOftenAsItSays) {
  // 200 sets of 60 images, each with 1 to 8 labels of which 70 % are found.
  int covered = 0;
  for (uint64_t set = 0; set < 200; ++set) {
    const Random random(set, 1);
    std::vector<double> counted(60), total(60);
    for (size_t i = 0; i < 60; ++i) {
      total[i] = std::floor(random.uniform(100 * i, 1, 9));
      for (size_t k = 1; double(k) <= total[i]; ++k) {
        counted[i] += random.uniform(100 * i + k, 0, 1) < 0.7 ? 1 : 0;
      }
    }
    const auto interval = Bootstrap(60, 300).ofRatio(counted, total);
    ASSERT_TRUE(interval);
    covered += interval->low <= 0.7 && 0.7 <= interval->high ? 1 : 0;
  }
  EXPECT_GE(covered, 176);  // 190 +- 3.1, and the percentile method covers a little less
  EXPECT_LE(covered, 199);
}

TEST(Bootstrap, NoIntervalWithoutEnoughImagesOrTotals) {
  EXPECT_FALSE(Bootstrap(9).ofRatio(std::vector<double>(9, 1), std::vector<double>(9, 1)));
  EXPECT_TRUE(Bootstrap(10).ofRatio(std::vector<double>(10, 1), std::vector<double>(10, 1)));
  EXPECT_FALSE(Bootstrap(50).ofRatio(std::vector<double>(50), std::vector<double>(50)));
  // A single image of 50 has any: it is missing from 36 % of the resamples.
  std::vector<double> one(50);
  one[3] = 4;
  EXPECT_EQ(Bootstrap(50).ofRatio(one, one), (Interval{1, 1}));
}

}  // namespace
}  // namespace dlsd
