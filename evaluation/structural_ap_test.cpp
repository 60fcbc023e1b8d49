#include "evaluation/structural_ap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>

namespace dlsd {
namespace {

using Eigen::Vector2d;

using Points = std::vector<Vector2d>;

/// At 128 x 128 in the first place.
StructuralCurve line(const Vector2d& from, const Vector2d& to) {
  return structuralCurve({from, to}, 128, 128);
}

double ap(const std::vector<StructuralOutcome>& images, size_t threshold) {
  return StructuralAp(images).averagePrecision(threshold);
}

StructuralOutcome match(const std::vector<StructuralCurve>& labels,
                        const std::vector<StructuralCurve>& detections,
                        const std::vector<double>& scores,
                        bool chord = false) {
  return matchStructure(labels, std::vector<bool>(labels.size(), true), detections, scores, chord);
}

TEST(StructuralCurve, PointsAtEqualArcLengthScaledTo128) {
  // An L of 60 + 60 px in an image of 256 x 64: x is halved, y doubled.
  const StructuralCurve curve = structuralCurve({{10, 0}, {70, 0}, {70, 60}}, 256, 64);
  const Points expected{{5, 0}, {15, 0}, {25, 0}, {35, 0}, {35, 40}, {35, 80}, {35, 120}};
  for (size_t k = 0; k < kStructuralPoints; ++k) {
    EXPECT_LE((curve[k] - expected[k]).norm(), 1e-12) << k;
  }
}

TEST(StructuralCurve, BezierOfOrderOneIsTheChordAndOthersPassThroughTheirPoints) {
  const Points chord{{3, 4}, {63, 34}};
  for (size_t k = 0; k < kStructuralPoints; ++k) {
    EXPECT_LE((structuralCurveOfBezier(chord, 128, 128)[k] - line(chord[0], chord[1])[k]).norm(),
              1e-12);
  }
  // Order 2 through (0, 0), (1, 1), (2, 0) at t = 0, 1/2, 1 is y = 4 t (1 - t), x = 2 t.
  const Points arch{{0, 0}, {1, 1}, {2, 0}};
  for (const double t : {0.0, 0.25, 0.5, 0.8, 1.0}) {
    EXPECT_LE((interpolatingBezier(arch, t) - Vector2d(2 * t, 4 * t * (1 - t))).norm(), 1e-12);
  }
}

TEST(StructuralDistance, AsInFieldNotes) {
  const StructuralCurve a = line({10, 20}, {70, 20});
  // Shifted by 1 px: mean of the squares times two, for curve and chord alike.
  EXPECT_NEAR(structuralDistance(a, line({10, 21}, {70, 21}), false), 2, 1e-12);
  EXPECT_NEAR(structuralDistance(a, line({10, 21}, {70, 21}), true), 2, 1e-12);
  EXPECT_NEAR(structuralDistance(a, line({70, 21}, {10, 21}), false), 2, 1e-12);
  EXPECT_NEAR(structuralDistance(a, line({70, 21}, {10, 21}), true), 2, 1e-12);
  // One end off by (3, 4): L-CNN's sum is 25. Of 7 points, k / 6 of it: 2/7 * 25 * 91/36.
  const StructuralCurve b = line({10, 20}, {73, 24});
  EXPECT_NEAR(structuralDistance(a, b, true), 25, 1e-12);
  EXPECT_NEAR(structuralDistance(a, b, false), 2.0 / 7 * 25 * 91 / 36, 1e-12);
  // A bend between the same ends: nothing for the chord.
  const StructuralCurve bent = structuralCurve({{10, 20}, {40, 30}, {70, 20}}, 128, 128);
  EXPECT_NEAR(structuralDistance(a, bent, true), 0, 1e-12);
  EXPECT_GT(structuralDistance(a, bent, false), 10);
  // T = 5, 10, 15 are RMS point errors of 1.58, 2.24, 2.74 px: 6.3, 8.9, 11.0 px at 512.
  for (size_t t = 0; t < kStructuralThresholds.size(); ++t) {
    const double shift = std::array{6.3, 8.9, 10.9}[t];
    const auto at512 = [](double y) { return structuralCurve({{40, y}, {300, y}}, 512, 512); };
    EXPECT_LT(structuralDistance(at512(80), at512(80 + shift), false), kStructuralThresholds[t]);
    EXPECT_GT(structuralDistance(at512(80), at512(80 + shift + 0.1), false),
              kStructuralThresholds[t]);
  }
}

TEST(StructuralAp, PerfectEmptyAndMissing) {
  const StructuralCurve a = line({10, 20}, {70, 20}), b = line({10, 50}, {70, 80});
  EXPECT_EQ(ap({match({a, b}, {a, b}, {1, 2})}, 0), 1);
  EXPECT_EQ(ap({match({a, b}, {a}, {1})}, 0), 0.5);
  EXPECT_EQ(ap({match({a, b}, {}, {})}, 0), 0);
  EXPECT_EQ(ap({match({}, {a}, {1})}, 0), 0);
  EXPECT_EQ(ap({}, 0), 0);
}

TEST(StructuralAp, DuplicatesAreFalseAndThresholdsDecide) {
  const StructuralCurve a = line({10, 20}, {70, 20});
  const StructuralCurve off = line({10, 22}, {70, 22});  // distance 8
  const StructuralOutcome outcome = match({a}, {off, a, a}, {1, 3, 2});
  ASSERT_EQ(outcome.detections.size(), 3U);
  using enum StructuralMatch;
  EXPECT_EQ(outcome.detections[0].score, 3);
  EXPECT_THAT(outcome.detections[0].matches, testing::ElementsAre(kTrue, kTrue, kTrue));
  EXPECT_THAT(outcome.detections[1].matches, testing::ElementsAre(kFalse, kFalse, kFalse));
  EXPECT_THAT(outcome.detections[2].matches, testing::ElementsAre(kFalse, kFalse, kFalse));
  EXPECT_THAT(match({a}, {off}, {1}).detections[0].matches,
              testing::ElementsAre(kFalse, kTrue, kTrue));
}

TEST(StructuralAp, NearestLabelIsTakenEvenIfUsed) {
  // L-CNN's rule: the argmin alone is asked. The second detection is within the threshold of both
  // labels, but nearer to the one that is taken.
  const StructuralCurve a = line({10, 20}, {70, 20}), b = line({10, 22}, {70, 22});
  const StructuralOutcome outcome = match({a, b}, {a, line({10, 20.5}, {70, 20.5})}, {2, 1});
  EXPECT_EQ(outcome.detections[1].matches[2], StructuralMatch::kFalse);
}

TEST(StructuralAp, EnvelopeOfAKnownSequence) {
  // Over two images with 4 labels in all: true, false, true, true, false in descending score.
  // Precision at the true ones: 1, 2/3, 3/4; envelope 1, 3/4, 3/4 at a quarter of recall each.
  const StructuralCurve a = line({10, 20}, {70, 20}), b = line({10, 50}, {70, 80}),
                        nowhere = line({100, 100}, {120, 120});
  const std::vector<StructuralOutcome> images{match({a, b}, {a, nowhere, b}, {0.9, 0.8, 0.7}),
                                              match({a, b}, {nowhere, a}, {0.5, 0.6})};
  EXPECT_NEAR(ap(images, 0), (1 + 0.75 + 0.75) / 4, 1e-12);
  // The first image three times, the second not at all: 6 labels; 3 true at precision 1, 3 false,
  // 3 true at precision 6/9.
  const std::vector<uint8_t> weights{3, 0};
  EXPECT_NEAR(StructuralAp(images).averagePrecision(0, weights), (1 + 2.0 / 3) / 2, 1e-12);
}

TEST(StructuralAp, DetectionsOfOneScoreComeInTogether) {
  const StructuralCurve a = line({10, 20}, {70, 20}), b = line({10, 50}, {70, 80}),
                        nowhere = line({100, 100}, {120, 120});
  const std::vector<std::vector<StructuralCurve>> orders{{a, nowhere, b}, {nowhere, b, a}};
  for (const auto& detections : orders) {
    EXPECT_NEAR(ap({match({a, b}, detections, {1, 1, 1})}, 0), 2.0 / 3, 1e-12);
  }
  // Over images, too.
  const StructuralOutcome all_false = match({a}, {nowhere, nowhere}, {1, 1});
  const StructuralOutcome all_true = match({a}, {a}, {1});
  EXPECT_NEAR(ap({all_true, all_false}, 0), 0.5 / 3, 1e-12);
  EXPECT_NEAR(ap({all_false, all_true}, 0), 0.5 / 3, 1e-12);
}

TEST(StructuralAp, LabelsThatDoNotCountTakeTheirDetectionsAway) {
  const StructuralCurve a = line({10, 20}, {70, 20}), faint = line({10, 50}, {70, 80});
  const StructuralOutcome outcome =
      matchStructure({a, faint}, {true, false}, {faint, a}, {2, 1}, false);
  EXPECT_EQ(outcome.labels, 1);
  EXPECT_EQ(outcome.detections[0].matches[0], StructuralMatch::kIgnored);
  EXPECT_EQ(ap({outcome}, 0), 1);
}

/// The definition as field-notes gives it, one sentence after the other, without any of the
/// shortcuts of the other one.
double bruteForceAp(const std::vector<std::vector<StructuralCurve>>& labels,
                    const std::vector<std::vector<StructuralCurve>>& detections,
                    const std::vector<std::vector<double>>& scores,
                    double threshold) {
  struct Hit {
    double score;
    bool is_true;
  };
  std::vector<Hit> hits;
  double total = 0;
  for (size_t i = 0; i < labels.size(); ++i) {
    total += double(labels[i].size());
    std::vector<size_t> order(detections[i].size());
    for (size_t d = 0; d < order.size(); ++d) {
      order[d] = d;
    }
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
      return scores[i][a] > scores[i][b];
    });
    std::vector<bool> used(labels[i].size());
    for (const size_t d : order) {
      double least = std::numeric_limits<double>::infinity();
      size_t at = 0;
      for (size_t l = 0; l < labels[i].size(); ++l) {
        double forward = 0, reversed = 0;
        for (size_t k = 0; k < 7; ++k) {
          forward += (detections[i][d][k] - labels[i][l][k]).squaredNorm() * 2 / 7;
          reversed += (detections[i][d][k] - labels[i][l][6 - k]).squaredNorm() * 2 / 7;
        }
        if (std::min(forward, reversed) < least) {
          least = std::min(forward, reversed);
          at = l;
        }
      }
      const bool is_true = least < threshold && !used[at];
      if (is_true) {
        used[at] = true;
      }
      hits.push_back({scores[i][d], is_true});
    }
  }
  if (total == 0) {
    return 0;
  }
  std::stable_sort(
      hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.score > b.score; });
  std::vector<double> recall{0}, precision{0};
  double tp = 0, fp = 0;
  for (size_t i = 0; i < hits.size(); ++i) {
    (hits[i].is_true ? tp : fp) += 1;
    if (i + 1 == hits.size() || hits[i + 1].score < hits[i].score) {
      recall.push_back(tp / total);
      precision.push_back(tp / (tp + fp));
    }
  }
  recall.push_back(1);
  precision.push_back(0);
  for (size_t i = precision.size() - 1; i > 0; --i) {
    precision[i - 1] = std::max(precision[i - 1], precision[i]);
  }
  double area = 0;
  for (size_t i = 0; i + 1 < recall.size(); ++i) {
    area += (recall[i + 1] - recall[i]) * precision[i + 1];
  }
  return area;
}

RC_GTEST_PROP(StructuralApProperty, AgreesWithTheDefinition, ()) {
  const auto point = [] { return Vector2d{*rc::gen::inRange(0, 40), *rc::gen::inRange(0, 40)}; };
  std::vector<std::vector<StructuralCurve>> labels, detections;
  std::vector<std::vector<double>> scores;
  std::vector<StructuralOutcome> outcomes;
  const int images = *rc::gen::inRange(1, 4);
  size_t count = 0;
  for (int i = 0; i < images; ++i) {
    auto& l = labels.emplace_back();
    auto& d = detections.emplace_back();
    auto& s = scores.emplace_back();
    for (int n = *rc::gen::inRange(0, 6); n > 0; --n) {
      const Vector2d from = point();
      const Vector2d to = from + Vector2d{*rc::gen::inRange(10, 60), *rc::gen::inRange(-30, 30)};
      l.push_back(structuralCurve({from, (from + to) / 2 + point() / 8, to}, 128, 128));
      for (int copies = *rc::gen::inRange(0, 3); copies > 0; --copies) {
        const Vector2d shift = (point() - Vector2d(20, 20)) / 6;
        const bool turned = *rc::gen::arbitrary<bool>();
        d.push_back(turned ? line(to + shift, from) : line(from, to + shift));
        s.push_back(*rc::gen::inRange(0, 4));  // ties
      }
    }
    count += l.size();
    outcomes.push_back(match(l, d, s));
  }
  RC_PRE(count > 0U);
  for (size_t t = 0; t < kStructuralThresholds.size(); ++t) {
    RC_ASSERT(std::abs(ap(outcomes, t) -
                       bruteForceAp(labels, detections, scores, kStructuralThresholds[t])) <=
              1e-12);
  }
}

}  // namespace
}  // namespace dlsd
