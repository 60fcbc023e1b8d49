#include "evaluation/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "evaluation/hand_made.h"

namespace dlsd {
namespace {

using hand_made::detection;
using hand_made::frame;
using hand_made::label;
using hand_made::pinholeCamera;
using hand_made::shifted;

constexpr auto kHeadline = size_t(Stratum::kHeadline);
constexpr auto kFaint = size_t(Stratum::kFaint);

/// Two frames. left: a headline label found from rho = 2 on by a detection 1.5 px off, and a faint
/// one, missed; a short wrong detection. right: a headline label in two pieces; nothing else.
Summary exampleSummary() {
  const Camera camera = pinholeCamera();
  const LabelLine line = label(camera, {100, 200}, {300, 200}, 0);
  LabelLine faint = label(camera, {100, 300}, {300, 300}, 1);
  faint.contrast = 5;
  Summary summary{EvaluationOptions{}};
  summary.add(frame("right",
                    camera,
                    {line},
                    {detection({{100, 200}, {199, 200}}), detection({{201, 200}, {300, 200}})}),
              camera);
  summary.add(frame("left",
                    camera,
                    {line, faint},
                    {shifted(line, {0, 1.5}), detection({{500, 50}, {520, 50}})}),
              camera);
  return summary;
}

TEST(Summary, PoolsCountsPerCameraAndOverAll) {
  const Summary summary = exampleSummary();
  ASSERT_EQ(summary.cameras.size(), 2U);
  const GroupSummary& left = summary.cameras[0];
  const GroupSummary& right = summary.cameras[1];
  EXPECT_EQ(left.name, "left");
  EXPECT_EQ(right.name, "right");
  EXPECT_EQ(summary.all.frames, 2);
  EXPECT_EQ(summary.all.labels, 3);
  EXPECT_EQ(summary.all.detections, 4);
  EXPECT_EQ(left.labels, 2);

  EXPECT_EQ(left.at_rho[0].found[kHeadline], (Ratio{0, 1}));
  EXPECT_EQ(left.at_rho[1].found[kHeadline], (Ratio{1, 1}));
  EXPECT_EQ(left.at_rho[2].found[kFaint], (Ratio{0, 1}));
  EXPECT_EQ(right.at_rho[2].found[kHeadline], (Ratio{0, 1}));
  EXPECT_EQ(summary.all.at_rho[2].found[kHeadline], (Ratio{1, 2}));

  EXPECT_EQ(summary.all.at_rho[0].right, (Ratio{2, 4}));
  EXPECT_EQ(summary.all.at_rho[1].right, (Ratio{3, 4}));
  EXPECT_EQ(summary.all.at_rho[1].right_long, (Ratio{3, 3}));  // 20 px are 2.5 degrees
  EXPECT_EQ(summary.all.at_rho[1].merged, (Ratio{0, 4}));
  EXPECT_EQ(summary.all.at_rho[1].merged_long, (Ratio{0, 3}));
  // Only the found run counts: the one in two pieces is not found.
  EXPECT_EQ(summary.all.at_rho[2].fragments[kHeadline], (Ratio{1, 1}));

  const DistanceStats& stats = summary.all.localisation[kHeadline];
  EXPECT_EQ(stats.count, 388);
  EXPECT_NEAR(stats.mean(), 1.5, 1e-9);
  EXPECT_EQ(summary.all.localisation[kFaint].count, 0);
}

// A label found by three detections counts three fragments.
TEST(Summary, FragmentsAreCountedEach) {
  const Camera camera = pinholeCamera();
  const LabelLine line = label(camera, {100, 200}, {300, 200}, 0);
  Summary summary{EvaluationOptions{}};
  summary.add(frame("three",
                    camera,
                    {line},
                    {shifted(line, {0, 0.1}), shifted(line, {0, 0.2}), shifted(line, {0, 0.3})}),
              camera);
  EXPECT_EQ(summary.all.at_rho[0].fragments[kHeadline], (Ratio{3, 1}));
}

TEST(Summary, TableShowsCountedAndTotal) {
  const std::string text = table(exampleSummary());
  EXPECT_THAT(text, testing::HasSubstr("1/2  50.0 %"));
  EXPECT_THAT(text, testing::HasSubstr("3/4  75.0 %"));
  EXPECT_THAT(text, testing::HasSubstr("1/1  1.000"));
  EXPECT_THAT(text, testing::HasSubstr("1.500"));
  EXPECT_THAT(text, testing::Not(testing::HasSubstr("nan")));
  EXPECT_EQ(dlsd::text(Ratio{0, 0}), "0/0");
}

TEST(Summary, AShareThatIsReachedExactlyIsReached) {
  for (int total : {1, 2, 5, 10, 20, 25, 50, 100, 1000, 10000}) {
    for (int counted = 0; counted <= total; ++counted) {
      const double share = counted * (10000 / total) / 10000.0;  // as typed with four decimals
      ASSERT_TRUE(reaches({counted, total}, share)) << counted << "/" << total;
      ASSERT_FALSE(reaches({counted - 1, total}, share)) << counted << "/" << total;
    }
  }
  EXPECT_FALSE(reaches({0, 0}, 0));
}

TEST(Summary, JsonHoldsTheSameFigures) {
  const Summary summary = exampleSummary();
  const auto json = toJson(summary);
  EXPECT_EQ(json.at("cameras").size(), 2U);
  EXPECT_EQ(json["cameras"][0]["name"], "left");
  const auto& at_2 = json["all"]["at_rho"][1];
  EXPECT_EQ(at_2["rho_px"], 2);
  EXPECT_EQ(at_2["found"]["headline"]["counted"], 1);
  EXPECT_EQ(at_2["found"]["headline"]["total"], 2);
  EXPECT_EQ(at_2["found"]["faint"]["total"], 1);
  EXPECT_EQ(at_2["right_long"]["counted"], 3);
  EXPECT_EQ(json["all"]["localisation"]["headline"]["samples"], 388);
  // No samples, no figure: a zero would read as perfect.
  EXPECT_FALSE(json["all"]["localisation"]["faint"].contains("mean_px"));
}

}  // namespace
}  // namespace dlsd
