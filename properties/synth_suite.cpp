// Labels and pictures over random scenes and cameras: where labels are, what hides them, and what
// must not change when camera and scene are turned or mirrored together.
//
// Here cases are drawn; checks/labels.h judges them. RC_PARAMS (seed, max_success) is honoured; a
// case is a scene and a camera, which where pictures are rendered, too, is tried a tenth as often.
// The smallest case that fails is saved as a folder, which `dlsd replay` understands.

#include <gtest/gtest.h>

#include <iostream>
#include <string>

#include "properties/checks/labels.h"
#include "properties/gen_labels.h"
#include "properties/saved_cases.h"
#include "properties/worst.h"

namespace dlsd {
namespace {

/// Judges a share of RC_PARAMS' number of cases. Returns the sums of what was counted.
LabelsOutcome expectHolds(LabelProperty property, double share, Worst* worst = nullptr) {
  LabelsOutcome sums;
  const long cases = holdsOrSaves(
      share,
      [&] { return drawLabelCase(property); },
      [](const LabelCase& label_case) { return checkLabels(label_case); },
      [&](const LabelCase&, const LabelsOutcome& outcome) {
        sums.counted += outcome.counted;
        sums.at_ends += outcome.at_ends;
        sums.in_gaps += outcome.in_gaps;
        sums.on_short_edges += outcome.on_short_edges;
        sums.round += outcome.round;
        for (const double error : outcome.errors) worst->see(error);
      });
  EXPECT_GT(sums.counted, cases) << "hardly anything was judged";
  return sums;
}

TEST(SynthSuite, LabelsLieOnDiscontinuities) {
  const LabelsOutcome sums = expectHolds(LabelProperty::kOnBorders, 1);
  std::cout << "    in the gap between a shadow and what casts it: " << sums.in_gaps
            << ", at ends: " << sums.at_ends << ", elsewhere " << sums.counted << " points\n";
  EXPECT_LE(sums.in_gaps + sums.at_ends, sums.counted / 1000);
}

TEST(SynthSuite, VisibilityIsThatOfBruteForce) {
  const LabelsOutcome sums = expectHolds(LabelProperty::kVisible, 1);
  std::cout << "    on edges too short to tell: " << sums.on_short_edges << ", elsewhere "
            << sums.counted << " points\n";
  EXPECT_LE(sums.on_short_edges, sums.counted / 2000);
}

TEST(SynthSuite, LabelsAreComplete) {
  Worst worst("px, longest straight border without a label");
  const LabelsOutcome sums = expectHolds(LabelProperty::kComplete, 1, &worst);
  std::cout << "    outlines of balls and tubes: " << sums.round << " of " << sums.counted
            << " jumps\n";
  EXPECT_LE(sums.round, sums.counted / 20);
}

TEST(SynthSuite, ArcsAreThoseOfAnotherLens) {
  Worst worst("difference of span ends, rad");
  expectHolds(LabelProperty::kOtherLens, 1, &worst);
}

TEST(SynthSuite, TurningSceneAndCameraChangesNothing) {
  Worst worst("share of pixels that differ by more than 1 grey level");
  expectHolds(LabelProperty::kTurned, 0.1, &worst);
}

TEST(SynthSuite, MirroredScenesAreMirrored) {
  Worst worst("share of pixels that differ by more than 8 grey levels");
  expectHolds(LabelProperty::kMirrored, 0.1, &worst);
}

}  // namespace
}  // namespace dlsd
