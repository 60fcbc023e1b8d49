#include "evaluation/paper_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "evaluation/hand_made.h"

namespace dlsd {
namespace {

using hand_made::label;
using hand_made::pinholeCamera;
using hand_made::shifted;
using hand_made::TemporaryFolder;
using hand_made::writeDataset;

TEST(PaperCamera, IsTheFixture) {
  EXPECT_EQ(paperCamera(), loadCamera(DLSD_SOURCE_DIR "/fixtures/calibrations/tum_mono_wide.yaml"));
}

struct PaperExperimentTest : testing::Test {
  TemporaryFolder folder{"dlsd-experiment-test"};
  Camera camera = pinholeCamera();
  /// 66.6 and 14.1 degrees.
  LabelLine wide = label(camera, {60, 240}, {585, 240}, 0);
  LabelLine narrow = label(camera, {270, 100}, {375, 100}, 1);

  /// A detector with the same lines in every frame, and how long it takes.
  [[nodiscard]] static ExperimentDetector detector(const std::string& name,
                                                   bool ours,
                                                   const std::vector<DetectionLine>& lines,
                                                   double ms) {
    return {name,
            [=]() -> FrameDetections {
              return [=](size_t i, const LabelRecord&) {
                Detections detections{lines, ms + double(i), std::nullopt};
                if (!ours) {
                  detections.rectification_ms = 7;
                }
                return detections;
              };
            },
            ours};
  }

  [[nodiscard]] Experiment run(const std::optional<VirtualView>& view = std::nullopt) const {
    writeDataset(folder / "data", {{wide, narrow}, {wide, narrow}, {wide, narrow}});
    const Dataset dataset(folder / "data");
    // Ours has the wide line 2 px off, the peer both exactly and one on nothing.
    const DetectionLine nothing = hand_made::detection({{100, 400}, {400, 400}});
    return runPaperExperiment(
        dataset,
        {detector("ours", true, {shifted(wide, {0, 2})}, 10),
         detector("peer", false, {shifted(wide, {0, 0}), shifted(narrow, {0, 0}), nothing}, 20)},
        view,
        {});
  }
};

TEST_F(PaperExperimentTest, CountsByLeastLength) {
  const Experiment experiment = run();
  EXPECT_EQ(experiment.frames, 3U);
  ASSERT_EQ(experiment.rows.size(), 22U);
  const ExperimentRow& all = experiment.row(122, 1);
  EXPECT_NEAR(all.min_angle_rad, 1.22 * M_PI / 180, 1e-12);
  EXPECT_EQ(all.detectors[0].lines, 3);
  EXPECT_EQ(all.detectors[1].lines, 9);
  EXPECT_EQ(all.detectors[0].found[0], (Ratio{0, 6}));  // 2 px off at 1 px
  EXPECT_EQ(all.detectors[0].found[1], (Ratio{3, 6}));
  EXPECT_EQ(all.detectors[1].found[0], (Ratio{6, 6}));
  EXPECT_EQ(all.detectors[1].right[1], (Ratio{6, 9}));
  // Of the peer's nine lines ours is near three.
  EXPECT_EQ(all.detectors[1].recovered_by[0], (Ratio{3, 9}));
  EXPECT_NEAR(all.detectors[1].mean_recovered_by[0].value(), 1.0 / 3, 1e-12);
  // The paper's reading: at least 61 degrees. The other: 30.5, where the line on nothing counts.
  const ExperimentRow& long_ones = experiment.row(244, 25);
  EXPECT_NEAR(long_ones.min_angle_rad, 61 * M_PI / 180, 1e-12);
  EXPECT_EQ(long_ones.detectors[1].lines, 3);
  EXPECT_EQ(long_ones.detectors[1].recovered_by[0], (Ratio{3, 3}));
  EXPECT_EQ(long_ones.detectors[0].found[1], (Ratio{3, 3}));
  EXPECT_EQ(experiment.row(122, 25).detectors[1].lines, 6);
  // Nothing is longer than 122 degrees.
  EXPECT_EQ(experiment.row(244, 50).detectors[1].lines, 0);
  EXPECT_FALSE(experiment.row(244, 50).detectors[1].mean_recovered_by[0]);
}

TEST_F(PaperExperimentTest, Times) {
  const Experiment experiment = run();
  EXPECT_EQ(experiment.detection_ms[0].count, 3);
  EXPECT_NEAR(experiment.detection_ms[0].mean, 11, 1e-12);
  EXPECT_NEAR(experiment.detection_ms[0].deviation, 1, 1e-12);
  EXPECT_EQ(experiment.rectification_ms[0].count, 0);
  EXPECT_NEAR(experiment.rectification_ms[1].mean, 7, 1e-12);
}

TEST_F(PaperExperimentTest, LabelsOutsideTheRectifiedViewAreToldApart) {
  // A view of 60 degrees does not show the whole of the wide line.
  const VirtualView view = centredView(
      {.kind = ViewKind::kPinhole, .width = 640, .height = 480, .fov_rad = 60 * M_PI / 180});
  const Experiment experiment = run(view);
  const ExperimentRow& all = experiment.row(122, 1);
  EXPECT_EQ(all.detectors[1].found[1], (Ratio{6, 6}));
  EXPECT_EQ(all.detectors[1].found_in_view[1], (Ratio{3, 3}));
  EXPECT_EQ(all.detectors[0].found_in_view[1], (Ratio{0, 3}));
}

TEST_F(PaperExperimentTest, LinesThatAreNoneNameDetectorAndImage) {
  writeDataset(folder / "data", {{wide}});
  const Dataset dataset(folder / "data");
  const DetectionLine point = hand_made::detection({{100, 400}, {100, 400}});
  const auto run_both = [&] {
    (void)runPaperExperiment(dataset,
                             {detector("ours", true, {}, 1), detector("peer", false, {point}, 1)},
                             std::nullopt,
                             {});
  };
  EXPECT_THAT(run_both,
              testing::ThrowsMessage<InputError>(
                  "peer: " + (folder / "data/images/000000.png: detection 0 has no length")));
}

TEST_F(PaperExperimentTest, TextAndFiles) {
  const Experiment experiment = run();
  const std::string text = table(experiment);
  EXPECT_THAT(text, testing::HasSubstr("Table 1 on 3 frames"));
  EXPECT_THAT(text, testing::ContainsRegex("lines >= 61 deg +- +3 +3\n"));
  EXPECT_THAT(text, testing::ContainsRegex("lines >= 30.5 deg +- +3 +6\n"));
  EXPECT_THAT(
      text,
      testing::ContainsRegex("rectification +ours +peer\n[^\n]*\n[^\n]*\ntime, ms: mean "
                             "\\(sd\\) +7.00 \\(0.00\\) +11.00 \\(1.00\\) +21.00 \\(1.00\\)"));
  EXPECT_THAT(text, testing::Not(testing::HasSubstr("nan")));
  writeExperiment(experiment, "T", folder / "out");
  const std::string page = readFile(folder / "out/index.html");
  EXPECT_THAT(page, testing::HasSubstr("Fig. 4: recall of ours"));
  EXPECT_THAT(page, testing::Not(testing::HasSubstr("http")));
  const auto json = nlohmann::json::parse(readFile(folder / "out/experiment.json"));
  EXPECT_EQ(json.at("rows").size(), 44U);
  EXPECT_EQ(json["rows"][1].at("recovered_by_ours").at("counted"), 3);
  const std::string csv = readFile(folder / "out/experiment.csv");
  EXPECT_THAT(csv, testing::HasSubstr("122,25,30.5,peer,lines recovered by ours,3,6\n"));
}

}  // namespace
}  // namespace dlsd
