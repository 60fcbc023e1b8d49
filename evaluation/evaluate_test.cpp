#include "evaluation/evaluate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <numeric>

#include "evaluation/hand_made.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using hand_made::detection;
using hand_made::label;
using hand_made::pinholeCamera;
using hand_made::reversed;
using hand_made::shifted;

const EvaluationOptions kOptions;  // rho = 1, 2, 4

std::vector<bool> foundAt(const FrameOutcome& outcome, size_t label_index) {
  std::vector<bool> found;
  for (const auto& at_rho : outcome.labels) {
    found.push_back(at_rho.at(label_index).found);
  }
  return found;
}

std::vector<bool> rightAt(const FrameOutcome& outcome, size_t detection_index) {
  std::vector<bool> right;
  for (const auto& at_rho : outcome.detections) {
    right.push_back(at_rho.at(detection_index).right);
  }
  return right;
}

std::vector<bool> mergedAt(const FrameOutcome& outcome, size_t detection_index) {
  std::vector<bool> merged;
  for (const auto& at_rho : outcome.detections) {
    merged.push_back(at_rho.at(detection_index).merged);
  }
  return merged;
}

/// Fragments of the run of a label, by rho.
std::vector<int> fragmentsOf(const FrameOutcome& outcome, size_t label_index) {
  std::vector<int> fragments;
  for (const auto& at_rho : outcome.runs) {
    fragments.push_back(at_rho.at(size_t(outcome.run_of.at(label_index))).fragments);
  }
  return fragments;
}

const std::vector<bool> kAlways{true, true, true};
const std::vector<bool> kNever{false, false, false};

/// A horizontal label from (100, 200) to (300, 200) and what else a test needs.
struct Evaluate : testing::Test {
  Camera camera = pinholeCamera();
  LabelLine line = label(camera, {100, 200}, {300, 200}, 0);

  [[nodiscard]] FrameOutcome run(const std::vector<LabelLine>& labels,
                                 const std::vector<DetectionLine>& detections) const {
    return evaluateFrame(camera, labels, detections, kOptions);
  }
};

TEST_F(Evaluate, PerfectDetectionFindsItsLabelAndIsRight) {
  const FrameOutcome outcome = run({line}, {shifted(line, {0, 0})});
  EXPECT_THAT(outcome.strata, testing::ElementsAre(Stratum::kHeadline));
  EXPECT_EQ(foundAt(outcome, 0), kAlways);
  EXPECT_EQ(rightAt(outcome, 0), kAlways);
  EXPECT_EQ(mergedAt(outcome, 0), kNever);
  for (const auto& at_rho : outcome.labels) {
    EXPECT_EQ(at_rho[0].detection, 0);
    EXPECT_EQ(at_rho[0].coverage, 1);
  }
  EXPECT_EQ(fragmentsOf(outcome, 0), (std::vector<int>{1, 1, 1}));
  for (const auto& at_rho : outcome.detections) {
    EXPECT_EQ(at_rho[0].coverage, 1);
    EXPECT_EQ(at_rho[0].carrier, 0);
  }
  const DistanceStats& stats = outcome.localisation[size_t(Stratum::kHeadline)];
  EXPECT_EQ(stats.count, 388);  // 194 px at two samples a pixel
  EXPECT_LE(stats.rms(), 1e-9);
  EXPECT_NEAR(outcome.detection_angle_rad.at(0), line.angle_rad, 1e-12);
}

TEST_F(Evaluate, ShiftAcrossIsTheLocalisationErrorAndDecidesAtWhichRho) {
  struct Case {
    double shift_px;
    std::vector<bool> expected;
  };
  for (const Case& c : {Case{0.5, {true, true, true}},
                        Case{1.5, {false, true, true}},
                        Case{3, {false, false, true}},
                        Case{5, {false, false, false}}}) {
    SCOPED_TRACE(c.shift_px);
    const FrameOutcome outcome = run({line}, {shifted(line, {0, c.shift_px})});
    EXPECT_EQ(foundAt(outcome, 0), c.expected);
    EXPECT_EQ(rightAt(outcome, 0), c.expected);
    const DistanceStats& stats = outcome.localisation[size_t(Stratum::kHeadline)];
    if (c.expected.back()) {
      EXPECT_EQ(stats.count, 388);
      EXPECT_NEAR(stats.mean(), c.shift_px, 1e-9);
      EXPECT_NEAR(stats.rms(), c.shift_px, 1e-9);
      EXPECT_NEAR(stats.quantile(0.95), c.shift_px, DistanceStats::kBinPx);
    } else {
      EXPECT_EQ(stats.count, 0);
    }
  }
}

TEST_F(Evaluate, DistanceIsToThePolylineNotToItsVertices) {
  // Two vertices 200 px apart: every sample but those at the ends is far from both.
  const FrameOutcome outcome = run({line}, {detection({{100, 200.5}, {300, 200.5}})});
  EXPECT_EQ(foundAt(outcome, 0), kAlways);
  EXPECT_EQ(rightAt(outcome, 0), kAlways);
}

TEST_F(Evaluate, NineTenthsOfALabelAreEnough) {
  // 194 px count, from 103 to 297. A detection from 100 to x reaches x + rho.
  const auto foundWhenItEndsAt = [&](double x) {
    return foundAt(run({line}, {detection({{100, 200}, {x, 200}})}), 0);
  };
  EXPECT_EQ(foundWhenItEndsAt(277), (std::vector<bool>{true, true, true}));
  EXPECT_EQ(foundWhenItEndsAt(276), (std::vector<bool>{false, true, true}));
  EXPECT_EQ(foundWhenItEndsAt(275), (std::vector<bool>{false, false, true}));
  EXPECT_EQ(foundWhenItEndsAt(273), kNever);
}

TEST_F(Evaluate, TwoHalvesAreRightButDoNotFindTheLabel) {
  const FrameOutcome outcome =
      run({line}, {detection({{100, 200}, {199, 200}}), detection({{201, 200}, {300, 200}})});
  EXPECT_EQ(foundAt(outcome, 0), kNever);
  EXPECT_EQ(rightAt(outcome, 0), kAlways);
  EXPECT_EQ(rightAt(outcome, 1), kAlways);
  EXPECT_EQ(fragmentsOf(outcome, 0), (std::vector<int>{2, 2, 2}));
  for (const auto& at_rho : outcome.labels) {
    EXPECT_NEAR(at_rho[0].coverage, 0.5, 0.03);
  }
}

TEST_F(Evaluate, DuplicatesAreAllRightAndCountAsFragments) {
  const DetectionLine same = shifted(line, {0, 0});
  const FrameOutcome outcome = run({line}, {same, same, same});
  for (const auto& at_rho : outcome.labels) {
    EXPECT_TRUE(at_rho[0].found);
    EXPECT_EQ(at_rho[0].detection, 0);
  }
  EXPECT_EQ(fragmentsOf(outcome, 0), (std::vector<int>{3, 3, 3}));
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(rightAt(outcome, i), kAlways);
  }
}

TEST_F(Evaluate, DetectionHalfBesideItsLabelIsWrongButStillAFragment) {
  // 200 px, the first 110 on the label.
  const FrameOutcome outcome = run({line}, {detection({{190, 200}, {390, 200}})});
  EXPECT_EQ(rightAt(outcome, 0), kNever);
  EXPECT_EQ(fragmentsOf(outcome, 0), (std::vector<int>{1, 1, 1}));
  const FrameOutcome less = run({line}, {detection({{210, 200}, {410, 200}})});
  EXPECT_EQ(fragmentsOf(less, 0), (std::vector<int>{0, 0, 0}));
}

TEST_F(Evaluate, DetectionOverTwoSpansOfOneCarrierIsRight) {
  const LabelLine next = label(camera, {304, 200}, {500, 200}, 0);
  const FrameOutcome outcome = run({line, next}, {detection({{100, 200}, {500, 200}})});
  EXPECT_EQ(rightAt(outcome, 0), kAlways);
  EXPECT_EQ(mergedAt(outcome, 0), kNever);  // bridges 4 px
  EXPECT_EQ(foundAt(outcome, 0), kAlways);
  EXPECT_EQ(foundAt(outcome, 1), kAlways);
}

TEST_F(Evaluate, LabelsOfACarrierThatFollowEachOtherAreOneRun) {
  // Three labels of one carrier, gaps of 4 and 20 px; one of another carrier in line with them.
  const LabelLine next = label(camera, {304, 200}, {400, 200}, 0);
  const LabelLine far = label(camera, {420, 200}, {500, 200}, 0);
  const LabelLine stranger = label(camera, {502, 200}, {600, 200}, 1);
  const std::vector<LabelLine> labels{far, line, stranger, next};
  const FrameOutcome one_each =
      run(labels, {detection({{100, 200}, {400, 200}}), detection({{420, 200}, {500, 200}})});
  EXPECT_EQ(one_each.run_of[1], one_each.run_of[3]);
  EXPECT_NE(one_each.run_of[1], one_each.run_of[0]);
  EXPECT_NE(one_each.run_of[2], one_each.run_of[0]);
  EXPECT_EQ(one_each.runs[0].size(), 3U);
  EXPECT_EQ(fragmentsOf(one_each, 1), (std::vector<int>{1, 1, 1}));
  EXPECT_EQ(fragmentsOf(one_each, 0), (std::vector<int>{1, 1, 1}));
  EXPECT_EQ(fragmentsOf(one_each, 2), (std::vector<int>{0, 0, 0}));
  // A detection over all of a carrier is a fragment of each run that it finds, however small its
  // part.
  const FrameOutcome merged = run(labels, {detection({{100, 200}, {500, 200}})});
  EXPECT_EQ(fragmentsOf(merged, 1), (std::vector<int>{1, 1, 1}));
  EXPECT_EQ(fragmentsOf(merged, 0), (std::vector<int>{1, 1, 1}));
  // Two detections where the labels meet are two fragments of one run.
  const FrameOutcome split =
      run(labels, {detection({{100, 200}, {300, 200}}), detection({{304, 200}, {400, 200}})});
  EXPECT_EQ(fragmentsOf(split, 1), (std::vector<int>{2, 2, 2}));
  // The run's stratum is that of its longest label.
  EXPECT_EQ(split.run_strata[size_t(split.run_of[3])], split.strata[1]);
}

TEST_F(Evaluate, EndErrorsAlongAndAcross) {
  struct Case {
    DetectionLine detection;
    EndError start, end;
  };
  // y = 200, from x = 100 to 300.
  for (const Case& c : {Case{detection({{100, 200}, {300, 200}}), {0, 0}, {0, 0}},
                        Case{detection({{103, 200.5}, {298, 200.5}}), {-3, 0.5}, {-2, 0.5}},
                        Case{detection({{95, 200}, {310, 200}}), {5, 0}, {10, 0}},
                        Case{detection({{95, 201}, {200, 199}, {298, 201}}), {5, 0.9}, {-2, 1}}}) {
    for (const DetectionLine& d : {c.detection, reversed(c.detection)}) {
      const FrameOutcome outcome = run({line}, {d});
      ASSERT_TRUE(outcome.errors.at(0));
      const auto& ends = outcome.errors[0]->ends;
      ASSERT_TRUE(ends[0] && ends[1]);
      EXPECT_NEAR(ends[0]->along_px, c.start.along_px, 0.11);
      EXPECT_NEAR(ends[0]->across_px, c.start.across_px, 0.01);
      EXPECT_NEAR(ends[1]->along_px, c.end.along_px, 0.11);
      EXPECT_NEAR(ends[1]->across_px, c.end.across_px, 0.01);
    }
  }
  // The label's own direction decides which end is which.
  LabelLine other = line;
  std::reverse(other.points.begin(), other.points.end());
  const FrameOutcome turned = run({other}, {detection({{103, 200}, {298, 200}})});
  EXPECT_NEAR(turned.errors.at(0)->ends[0]->along_px, -2, 1e-9);
  EXPECT_NEAR(turned.errors.at(0)->ends[1]->along_px, -3, 1e-9);
  // No error where the run goes on, none at all if the label is not found.
  const LabelLine next = label(camera, {304, 200}, {400, 200}, 0);
  const FrameOutcome run_on = run({line, next}, {detection({{103, 200}, {402, 200}})});
  EXPECT_NEAR(run_on.errors.at(0)->ends[0]->along_px, -3, 1e-9);
  EXPECT_FALSE(run_on.errors.at(0)->ends[1]);
  EXPECT_FALSE(run_on.errors.at(1)->ends[0]);
  EXPECT_NEAR(run_on.errors.at(1)->ends[1]->along_px, 2, 1e-9);
  EXPECT_FALSE(run({line}, {detection({{100, 200}, {200, 200}})}).errors.at(0));
}

TEST_F(Evaluate, EndErrorsFollowTheCurve) {
  // On a strongly curved label, 12 px of the detection are missing and 20 px too many: what is
  // measured is the length along the curve.
  const Camera fisheye{Fov::fromParams({220, 220, 320, 240, 0.93}), 640, 480};
  const Arc arc = arcBetween(*fisheye.unproject({60, 60}), *fisheye.unproject({580, 60})).value();
  const LabelLine whole = label(fisheye, {60, 60}, {580, 60}, 0);
  const auto lengthOf = [&](double t0, double t1) {
    double length = 0;
    const auto points = imageCurve(fisheye, arc, t0, t1, 1e-4);
    for (size_t i = 1; i < points.size(); ++i) {
      length += (points[i] - points[i - 1]).norm();
    }
    return length;
  };
  LabelLine inner = whole;
  inner.points = imageCurve(fisheye, arc, 0.03, 0.94);
  const FrameOutcome outcome =
      evaluateFrame(fisheye, {inner}, {detection(imageCurve(fisheye, arc, 0, 0.92))}, kOptions);
  ASSERT_TRUE(outcome.errors.at(0));
  EXPECT_NEAR(outcome.errors[0]->ends[0]->along_px, lengthOf(0, 0.03), 0.05);
  EXPECT_NEAR(outcome.errors[0]->ends[1]->along_px, -lengthOf(0.92, 0.94), 0.05);
  EXPECT_LE(outcome.errors[0]->ends[0]->across_px, 0.02);
  EXPECT_LE(outcome.errors[0]->ends[1]->across_px, 0.02);
}

TEST_F(Evaluate, AnglesAndNormalsOfAKnownShift) {
  // A line through the image's middle, moved up by half a pixel: the plane turns by atan(0.5 / f).
  const LabelLine middle = label(camera, {100, 240}, {540, 240}, 0);
  const FrameOutcome outcome = run({middle}, {shifted(middle, {0, 0.5})});
  ASSERT_TRUE(outcome.errors.at(0));
  const LabelErrors& errors = *outcome.errors[0];
  EXPECT_EQ(errors.angle_samples, errors.samples);
  ASSERT_TRUE(errors.normal_rad);
  EXPECT_NEAR(*errors.normal_rad, std::atan(0.5 / 400), 1e-9);
  // Towards the sides the ray is longer: 0.5 / f cos(field angle) on the average.
  EXPECT_LE(errors.sum_rad / double(errors.angle_samples), 0.5 / 400);
  EXPECT_GE(errors.sum_rad / double(errors.angle_samples), 0.9 * 0.5 / 400);
  const double squared_mean = errors.sum_rad * errors.sum_rad / double(errors.angle_samples);
  EXPECT_GE(errors.sum2_rad2, squared_mean);
  EXPECT_LE(errors.sum2_rad2, 1.1 * squared_mean);
  EXPECT_FALSE(errors.normal_sigmas);  // nothing is known of the noise
  // A detection's own normal is taken at its word, whatever its sign.
  DetectionLine with_normal = shifted(middle, {0, 0.5});
  with_normal.normal = -middle.normal;
  EXPECT_LE(*run({middle}, {with_normal}).errors.at(0)->normal_rad, 1e-9);
}

TEST_F(Evaluate, FoundScoreIsTheBestOfTheFinders) {
  DetectionLine low = shifted(line, {0, 0}), high = shifted(line, {0, 1.5});
  low.score = 3;
  high.score = 8;
  const FrameOutcome outcome = run({line}, {low, high});
  EXPECT_EQ(outcome.labels[0][0].found_score, 3);  // at 1 px only the first finds it
  EXPECT_EQ(outcome.labels[1][0].found_score, 8);
  EXPECT_EQ(outcome.labels[1][0].detection, 0);
  // Without a score: its length.
  EXPECT_NEAR(run({line}, {shifted(line, {0, 0})}).detection_score.at(0), 200, 1e-9);
}

TEST_F(Evaluate, CoveredByOneAsksForTheShareOfTheWholeLine) {
  const std::vector<DetectionLine> lines{detection({{100, 200}, {300, 200}}),
                                         detection({{100, 300}, {300, 300}})};
  const auto covered = [&](double from, double to, double y) {
    return coveredByOne(camera, lines, {detection({{from, y}, {to, y}})}, 4, 0.9);
  };
  using Covered = std::vector<bool>;
  EXPECT_EQ(covered(100, 300, 200), (Covered{true, false}));
  EXPECT_EQ(covered(100, 300, 203.9), (Covered{true, false}));
  EXPECT_EQ(covered(100, 300, 204.1), (Covered{false, false}));
  EXPECT_EQ(covered(0, 300, 300), (Covered{false, true}));
  EXPECT_EQ(covered(100, 277, 200), (Covered{true, false}));   // 181 of 200 px with the 4 px beyond
  EXPECT_EQ(covered(100, 274, 200), (Covered{false, false}));  // 178 of 200 px
  // Two halves are not one.
  EXPECT_EQ(coveredByOne(camera,
                         lines,
                         {detection({{100, 200}, {200, 200}}), detection({{200, 200}, {300, 200}})},
                         4,
                         0.9),
            (Covered{false, false}));
  EXPECT_EQ(coveredByOne(camera, {}, lines, 4, 0.9), Covered{});
  EXPECT_EQ(coveredByOne(camera, lines, {}, 4, 0.9), (Covered{false, false}));
}

TEST_F(Evaluate, TwoCarriersInOneLineAreNotOne) {
  const LabelLine next = label(camera, {304, 200}, {500, 200}, 1);
  const FrameOutcome outcome = run({line, next}, {detection({{100, 200}, {500, 200}})});
  EXPECT_EQ(rightAt(outcome, 0), kNever);
  EXPECT_EQ(mergedAt(outcome, 0), kNever);
  EXPECT_EQ(foundAt(outcome, 0), kAlways);
  EXPECT_EQ(foundAt(outcome, 1), kAlways);
}

TEST_F(Evaluate, BridgeOfMoreThanFivePixelsIsAMergeAtEveryRho) {
  for (const auto& [gap_px, merged] : {std::pair{5.0, kNever}, {6.0, kAlways}, {20.0, kAlways}}) {
    SCOPED_TRACE(gap_px);
    const LabelLine next = label(camera, {300 + gap_px, 200}, {500, 200}, 0);
    const FrameOutcome outcome = run({line, next}, {detection({{100, 200}, {500, 200}})});
    EXPECT_EQ(rightAt(outcome, 0), kAlways);
    EXPECT_EQ(mergedAt(outcome, 0), merged);
  }
}

TEST_F(Evaluate, LongBridgeIsAMergeThatIsNotRight) {
  const LabelLine next = label(camera, {400, 200}, {500, 200}, 0);
  const FrameOutcome outcome = run({line, next}, {detection({{100, 200}, {500, 200}})});
  EXPECT_EQ(rightAt(outcome, 0), kNever);  // 300 of 400 px
  EXPECT_EQ(mergedAt(outcome, 0), kAlways);
}

TEST_F(Evaluate, ABridgesDistanceToItsCarrierIsThatInTheImage) {
  // Near the corner of a wide image, where the ray of the carrier's plane that is nearest to a
  // pixel's ray arrives 1.7 times as far away as the carrier's image is.
  const Camera wide(Pinhole::fromParams({100, 100, 320, 240}), 640, 480);
  const Vector2d middle(560, 420), along(std::cos(0.96), std::sin(0.96)),
      across(-along.y(), along.x());
  const auto at = [&](double s, double d) -> Vector2d { return middle + s * along + d * across; };
  const std::vector<LabelLine> labels{label(wide, at(-60, 0), at(-20, 0), 0),
                                      label(wide, at(20, 0), at(60, 0), 0)};
  for (const double side : {-1.0, 1.0}) {
    for (const auto& [share, merged] : {std::pair{0.9, kAlways}, {1.1, kNever}}) {
      for (size_t r = 0; r < kOptions.rho_px.size(); ++r) {
        const double d = side * share * kOptions.rho_px[r];
        // On the labels it lies exactly; only the bridge is aside.
        const FrameOutcome outcome = evaluateFrame(
            wide,
            labels,
            {detection({at(-60, 0), at(-20, 0), at(-19.9, d), at(19.9, d), at(20, 0), at(60, 0)})},
            kOptions);
        EXPECT_EQ(mergedAt(outcome, 0)[r], merged[r]) << d;
      }
    }
  }
}

TEST_F(Evaluate, DetourBetweenTwoSpansIsNoMerge) {
  const LabelLine next = label(camera, {400, 200}, {500, 200}, 0);
  const FrameOutcome outcome =
      run({line, next}, {detection({{100, 200}, {300, 200}, {350, 240}, {400, 200}, {500, 200}})});
  EXPECT_EQ(rightAt(outcome, 0), kNever);
  EXPECT_EQ(mergedAt(outcome, 0), kNever);
}

TEST_F(Evaluate, OverhangAtAnEndIsNoBridge) {
  const FrameOutcome outcome = run({line}, {detection({{100, 200}, {318, 200}})});
  EXPECT_EQ(rightAt(outcome, 0), kAlways);
  EXPECT_EQ(mergedAt(outcome, 0), kNever);
}

TEST_F(Evaluate, EmptyOnEitherSide) {
  const FrameOutcome no_detections = run({line}, {});
  EXPECT_EQ(foundAt(no_detections, 0), kNever);
  for (const auto& at_rho : no_detections.labels) {
    EXPECT_EQ(at_rho[0].detection, -1);
    EXPECT_EQ(at_rho[0].coverage, 0);
  }
  EXPECT_EQ(fragmentsOf(no_detections, 0), (std::vector<int>{0, 0, 0}));
  const FrameOutcome no_labels = run({}, {shifted(line, {0, 0})});
  EXPECT_EQ(rightAt(no_labels, 0), kNever);
  EXPECT_EQ(no_labels.detections[0][0].carrier, -1);
  const FrameOutcome nothing = run({}, {});
  EXPECT_EQ(nothing.labels.size(), 3U);
  EXPECT_EQ(nothing.detections.size(), 3U);
  EXPECT_TRUE(nothing.strata.empty());
}

TEST_F(Evaluate, ShortLabelsAreTrimmedByAQuarter) {
  // 8 px: 2 px are left out at each end, so 4 px from (102, 200) on must be covered.
  const LabelLine tiny = label(camera, {100, 200}, {108, 200}, 0);
  EvaluationOptions options;
  options.rho_px = {0.01};
  const auto found = [&](double from, double to) {
    return evaluateFrame(camera, {tiny}, {detection({{from, 200}, {to, 200}})}, options)
        .labels[0][0]
        .found;
  };
  EXPECT_TRUE(found(102, 106));
  EXPECT_FALSE(found(103, 106));
}

TEST_F(Evaluate, EveryLabelHasExactlyOneStratum) {
  LabelLine faint = label(camera, {100, 300}, {300, 300}, 1);
  faint.contrast = 19.9;
  const LabelLine few_px = label(camera, {100, 400}, {139, 400}, 2);
  LabelLine few_degrees = label(camera, {400, 400}, {445, 400}, 3);
  few_degrees.angle_rad = 4.9 * M_PI / 180;
  LabelLine faint_and_short = label(camera, {500, 20}, {520, 20}, 4);
  faint_and_short.contrast = 3;
  const LabelLine near_faint = label(camera, {100, 305}, {300, 305}, 5);
  const FrameOutcome outcome =
      run({line, faint, few_px, few_degrees, faint_and_short, near_faint}, {});
  EXPECT_THAT(outcome.strata,
              testing::ElementsAre(Stratum::kHeadline,
                                   Stratum::kFaint,
                                   Stratum::kShort,
                                   Stratum::kShort,
                                   Stratum::kFaint,
                                   Stratum::kCrowded));
}

TEST_F(Evaluate, CrowdedMeansNearerThanSixPixelsAnywhere) {
  const auto strataWith = [&](const LabelLine& other) { return run({line, other}, {}).strata; };
  const auto both = [](Stratum s) { return testing::ElementsAre(s, s); };
  EXPECT_THAT(strataWith(label(camera, {100, 205.9}, {300, 205.9}, 1)), both(Stratum::kCrowded));
  EXPECT_THAT(strataWith(label(camera, {100, 206.1}, {300, 206.1}, 1)), both(Stratum::kHeadline));
  EXPECT_THAT(strataWith(label(camera, {200, 100}, {200, 300}, 1)), both(Stratum::kCrowded));
  EXPECT_THAT(strataWith(label(camera, {305, 200}, {500, 200}, 1)), both(Stratum::kCrowded));
  EXPECT_THAT(strataWith(label(camera, {307, 200}, {500, 200}, 1)), both(Stratum::kHeadline));
}

TEST_F(Evaluate, LabelsThatMeetAtASharedEndAreNotCrowdedThere) {
  const auto strataWith = [&](const LabelLine& other) { return run({line, other}, {}).strata; };
  const auto both = [](Stratum s) { return testing::ElementsAre(s, s); };
  // A right angle, and one of 25 degrees: 15 px from the corner they are 6.3 px apart.
  EXPECT_THAT(strataWith(label(camera, {300, 200}, {300, 400}, 1)), both(Stratum::kHeadline));
  EXPECT_THAT(
      strataWith(label(camera, {300, 200}, {150, 200 + 150 * std::tan(25 * M_PI / 180)}, 1)),
      both(Stratum::kHeadline));
  // At 20 degrees they are still 5.1 px apart there.
  EXPECT_THAT(
      strataWith(label(camera, {300, 200}, {150, 200 + 150 * std::tan(20 * M_PI / 180)}, 1)),
      both(Stratum::kCrowded));
  // The ends a pixel apart are not shared.
  EXPECT_THAT(strataWith(label(camera, {300, 201}, {300, 400}, 1)), both(Stratum::kCrowded));
}

TEST_F(Evaluate, RefusesDegenerateCurvesByName) {
  const auto message = [&](const DetectionLine& bad) -> std::string {
    try {
      (void)run({line}, {shifted(line, {0, 0}), bad});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message(detection({{1, 2}})), "detection 1 has 1 points, at least 2 are needed");
  EXPECT_EQ(message(detection({})), "detection 1 has 0 points, at least 2 are needed");
  EXPECT_EQ(message(detection({{1, 2}, {1, 2}})), "detection 1 has no length");
  EXPECT_THAT(message(detection({{1, 2}, {1e9, 2}})),
              testing::HasSubstr("allowed are [-640, 1280]"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message(detection({{1, 2}, {nan, 2}})), testing::HasSubstr("the point (nan, 2)"));
}

TEST_F(Evaluate, RefusesOptionsOutOfRange) {
  const auto refuses = [](auto&& change) {
    EvaluationOptions options;
    change(options);
    try {
      options.check();
    } catch (const std::invalid_argument&) {
      return true;
    }
    return false;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(refuses([](auto&) {}));
  EXPECT_TRUE(refuses([](auto& o) { o.rho_px = {}; }));
  EXPECT_TRUE(refuses([](auto& o) { o.rho_px = {0}; }));
  EXPECT_TRUE(refuses([](auto& o) { o.rho_px = {101}; }));
  EXPECT_TRUE(refuses([](auto& o) { o.rho_px = {2, 1}; }));
  EXPECT_TRUE(refuses([&](auto& o) { o.rho_px = {nan}; }));
  EXPECT_TRUE(refuses([&](auto& o) { o.headline_contrast = nan; }));
  EXPECT_TRUE(refuses([](auto& o) { o.headline_angle_rad = -1; }));
  EXPECT_TRUE(refuses([](auto& o) { o.headline_length_px = -1; }));
  EXPECT_TRUE(refuses([](auto& o) { o.crowded_px = 200; }));
}

TEST(DistanceStats, QuantilesOfAKnownDistribution) {
  DistanceStats stats;
  for (int i = 0; i < 1000; ++i) {
    stats.add(double(i) / 1000);
  }
  DistanceStats twice;
  twice += stats;
  twice += stats;
  EXPECT_EQ(twice.count, 2000);
  EXPECT_NEAR(twice.mean(), 0.4995, 1e-12);
  for (const double q : {0.0, 0.05, 0.5, 0.95, 1.0}) {
    EXPECT_NEAR(twice.quantile(q), q, 2 * DistanceStats::kBinPx);
  }
  EXPECT_EQ(DistanceStats{}.quantile(0.5), 0);
}

// --- properties
// -------------------------------------------------------------------------------------

double genBetween(double lo, double hi) {
  return lo + (hi - lo) * (*rc::gen::inRange(0, 1000001)) * 1e-6;
}

Vector2d genPixel(const Camera& camera) {
  return {genBetween(20, camera.width() - 20), genBetween(20, camera.height() - 20)};
}

/// A strongly distorting camera whose every pixel near the centre has a ray.
Camera fisheyeCamera() {
  return {Fov::fromParams({220, 220, 320, 240, 0.93}), 640, 480};
}

LabelLine genLabel(const Camera& camera, int carrier) {
  const Vector2d from = genPixel(camera);
  const Vector2d to = genPixel(camera);
  RC_PRE((to - from).norm() > 20);
  return label(camera, from, to, carrier);
}

/// What is the same for a label or detection in whatever order they come.
auto essence(const LabelOutcome& o) {
  return std::tuple(o.found, o.coverage, o.found_score);
}
auto essence(const DetectionOutcome& o) {
  return std::tuple(o.right, o.merged, o.coverage, o.carrier);
}

/// Of the run of a label.
auto essence(const FrameOutcome& outcome, size_t rho, size_t label_index) {
  const auto run = size_t(outcome.run_of[label_index]);
  return std::tuple(
      outcome.runs[rho][run].found, outcome.runs[rho][run].fragments, outcome.run_strata[run]);
}

struct RandomFrame {
  std::vector<LabelLine> labels;
  std::vector<DetectionLine> detections;
};

RandomFrame genFrame(const Camera& camera) {
  RandomFrame frame;
  const int n = *rc::gen::inRange(1, 8);
  for (int i = 0; i < n; ++i) {
    frame.labels.push_back(genLabel(camera, i / 2));
    const int copies = *rc::gen::inRange(0, 3);
    for (int k = 0; k < copies; ++k) {
      const Vector2d shift(genBetween(-5, 5), genBetween(-5, 5));
      frame.detections.push_back(shifted(frame.labels.back(), shift));
    }
  }
  return frame;
}

RC_GTEST_PROP(EvaluateProperty, ShiftAcrossByLessThanRhoKeepsFoundByMoreLosesIt, ()) {
  const Camera camera = pinholeCamera();
  const LabelLine line = genLabel(camera, 0);
  const Vector2d along = (line.points.back() - line.points.front()).normalized();
  const Vector2d across(-along.y(), along.x());
  EvaluationOptions options;
  const double rho = genBetween(0.5, 8);
  options.rho_px = {rho};
  const double sign = *rc::gen::element(-1.0, 1.0);
  const auto outcomeAt = [&](double d) {
    return evaluateFrame(camera, {line}, {shifted(line, sign * d * across)}, options);
  };
  const double inside = rho * genBetween(0, 0.999999);
  const double outside = rho * genBetween(1.000001, 1.5);
  RC_ASSERT(outcomeAt(inside).labels[0][0].found);
  RC_ASSERT(outcomeAt(inside).detections[0][0].right);
  RC_ASSERT(!outcomeAt(outside).labels[0][0].found);
  RC_ASSERT(!outcomeAt(outside).detections[0][0].right);
  const auto stratum = size_t(outcomeAt(inside).strata[0]);
  RC_ASSERT(std::abs(outcomeAt(inside).localisation[stratum].mean() - inside) <= 1e-9);
}

RC_GTEST_PROP(EvaluateProperty, OrderAndDirectionDoNotMatter, ()) {
  const Camera camera = fisheyeCamera();
  const RandomFrame frame = genFrame(camera);
  std::vector<size_t> labels(frame.labels.size());
  std::vector<size_t> detections(frame.detections.size());
  std::iota(labels.begin(), labels.end(), size_t{0});
  std::iota(detections.begin(), detections.end(), size_t{0});
  for (auto* order : {&labels, &detections}) {
    for (size_t i = order->size(); i > 1; --i) {
      std::swap((*order)[i - 1], (*order)[*rc::gen::inRange(size_t{0}, i)]);
    }
  }
  RandomFrame other;
  for (const size_t i : labels) {
    other.labels.push_back(frame.labels[i]);
    if (*rc::gen::arbitrary<bool>()) {
      std::reverse(other.labels.back().points.begin(), other.labels.back().points.end());
    }
  }
  for (const size_t i : detections) {
    other.detections.push_back(*rc::gen::arbitrary<bool>() ? reversed(frame.detections[i])
                                                           : frame.detections[i]);
  }
  const FrameOutcome a = evaluateFrame(camera, frame.labels, frame.detections, kOptions);
  const FrameOutcome b = evaluateFrame(camera, other.labels, other.detections, kOptions);
  for (size_t r = 0; r < kOptions.rho_px.size(); ++r) {
    for (size_t i = 0; i < labels.size(); ++i) {
      RC_ASSERT(essence(b.labels[r][i]) == essence(a.labels[r][labels[i]]));
      RC_ASSERT(essence(b, r, i) == essence(a, r, labels[i]));
    }
    for (size_t i = 0; i < detections.size(); ++i) {
      RC_ASSERT(essence(b.detections[r][i]) == essence(a.detections[r][detections[i]]));
    }
  }
  for (size_t i = 0; i < labels.size(); ++i) {
    RC_ASSERT(b.strata[i] == a.strata[labels[i]]);
  }
  for (size_t s = 0; s < kStratumCount; ++s) {
    RC_ASSERT(b.localisation[s].sum_px == a.localisation[s].sum_px);
    RC_ASSERT(b.localisation[s].sum2_px2 == a.localisation[s].sum2_px2);
    RC_ASSERT(b.localisation[s].bins == a.localisation[s].bins);
  }
}

RC_GTEST_PROP(EvaluateProperty, LargerRhoNeverLosesALabelOrADetection, ()) {
  const Camera camera = fisheyeCamera();
  const RandomFrame frame = genFrame(camera);
  const FrameOutcome outcome = evaluateFrame(camera, frame.labels, frame.detections, kOptions);
  for (size_t r = 1; r < kOptions.rho_px.size(); ++r) {
    for (size_t i = 0; i < frame.labels.size(); ++i) {
      RC_ASSERT(outcome.labels[r][i].coverage >= outcome.labels[r - 1][i].coverage);
      RC_ASSERT(outcome.labels[r][i].found || !outcome.labels[r - 1][i].found);
    }
    for (size_t i = 0; i < frame.detections.size(); ++i) {
      RC_ASSERT(outcome.detections[r][i].coverage >= outcome.detections[r - 1][i].coverage);
    }
  }
}

/// Least distance of a point to a polyline, over all its pieces.
double bruteDistance(const std::vector<Vector2d>& points, const Vector2d& p) {
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < points.size(); ++i) {
    const Vector2d ab = points[i] - points[i - 1];
    const double t = std::clamp((p - points[i - 1]).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - points[i - 1] - t * ab).norm());
  }
  return least;
}

/// Points every 0.1 px along a polyline between two lengths.
std::vector<Vector2d> dense(const std::vector<Vector2d>& points, double trim_px) {
  std::vector<Vector2d> all;
  std::vector<double> at;
  double length = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    const Vector2d ab = points[i] - points[i - 1];
    for (double s = 0; s < ab.norm(); s += 0.1) {
      all.emplace_back(points[i - 1] + ab.normalized() * s);
      at.push_back(length + s);
    }
    length += ab.norm();
  }
  std::vector<Vector2d> kept;
  for (size_t i = 0; i < all.size(); ++i) {
    if (at[i] >= trim_px && at[i] <= length - trim_px) {
      kept.push_back(all[i]);
    }
  }
  return kept;
}

RC_GTEST_PROP(EvaluateProperty, CoverageAgreesWithBruteForce, ()) {
  const Camera camera = fisheyeCamera();
  const LabelLine line = genLabel(camera, 0);
  RC_PRE(line.length_px > 30);
  const Vector2d shift(genBetween(-3, 3), genBetween(-3, 3));
  std::vector<Vector2d> points = shifted(line, shift).points;
  points.back() += Vector2d(genBetween(-6, 6), genBetween(-6, 6));
  const FrameOutcome outcome = evaluateFrame(camera, {line}, {detection(points)}, kOptions);
  for (size_t r = 0; r < kOptions.rho_px.size(); ++r) {
    const auto share = [&](const std::vector<Vector2d>& samples,
                           const std::vector<Vector2d>& curve) {
      const auto near = std::count_if(samples.begin(), samples.end(), [&](const Vector2d& p) {
        return bruteDistance(curve, p) <= kOptions.rho_px[r];
      });
      return double(near) / double(samples.size());
    };
    const double step = 3 * kSampleStepPx / (line.length_px - 6);
    RC_ASSERT(std::abs(outcome.labels[r][0].coverage - share(dense(line.points, 3), points)) <=
              step);
    RC_ASSERT(std::abs(outcome.detections[r][0].coverage - share(dense(points, 0), line.points)) <=
              step);
  }
}

RC_GTEST_PROP(EvaluateProperty, CrowdedAgreesWithBruteForce, ()) {
  const Camera camera = fisheyeCamera();
  const LabelLine a = genLabel(camera, 0);
  const LabelLine b = genLabel(camera, 1);
  // Around a shared end, which has a test of its own, nothing is crowded.
  for (const Vector2d& end : {b.points.front(), b.points.back()}) {
    RC_PRE((end - a.points.front()).norm() > kSharedEndPx);
    RC_PRE((end - a.points.back()).norm() > kSharedEndPx);
  }
  double least = std::numeric_limits<double>::infinity();
  for (const Vector2d& p : dense(a.points, 0)) {
    least = std::min(least, bruteDistance(b.points, p));
  }
  EvaluationOptions options;
  options.headline_length_px = options.headline_angle_rad = 0;
  // Sampled at 0.5 px, so the least distance is seen to within 0.25 px; here to within 0.05 px.
  options.crowded_px = std::clamp(least + 0.3, 0.0, 100.0);
  RC_PRE(least < 99);
  RC_ASSERT(evaluateFrame(camera, {a, b}, {}, options).strata[0] == Stratum::kCrowded);
  options.crowded_px = std::max(0.0, least - 0.1);
  RC_ASSERT(evaluateFrame(camera, {a, b}, {}, options).strata[0] == Stratum::kHeadline);
}

}  // namespace
}  // namespace dlsd
