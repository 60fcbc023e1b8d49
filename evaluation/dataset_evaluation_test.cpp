#include "evaluation/dataset_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <system_error>
#include <thread>

#include "evaluation/detections.h"
#include "evaluation/figures.h"
#include "evaluation/hand_made.h"
#include "evaluation/summary.h"

namespace dlsd {
namespace {

using hand_made::label;
using hand_made::pinholeCamera;
using hand_made::shifted;
using hand_made::TemporaryFolder;
using hand_made::writeDataset;

std::vector<std::vector<LabelLine>> exampleLabels(size_t frames) {
  const Camera camera = pinholeCamera();
  std::vector<std::vector<LabelLine>> labels;
  for (size_t i = 0; i < frames; ++i) {
    const double x = 20 + 7.0 * double(i);
    labels.push_back({label(camera, {x, 199.5}, {600, 199.5}, 0),
                      label(camera, {x, 300}, {x + 200, 350 - double(i)}, 1)});
  }
  return labels;
}

DetectionRecord record(const std::string& image, const std::vector<DetectionLine>& lines = {}) {
  DetectionRecord result;
  result.image = image;
  result.lines = lines;
  return result;
}

std::string message(const std::function<void()>& run) {
  try {
    run();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(MatchToImages, ByRelativePathThenByStem) {
  const std::vector<std::string> images{"images/a.png", "images/b.png", "images/c.png"};
  const auto ordered = matchToImages(
      {record("c.jpg"), record("./images/../images/a.png"), record("/data/images/b.png")},
      images,
      "/data",
      "det.jsonl");
  ASSERT_EQ(ordered.size(), 3U);
  EXPECT_EQ(ordered[0].image, "./images/../images/a.png");
  EXPECT_EQ(ordered[1].image, "/data/images/b.png");
  EXPECT_EQ(ordered[2].image, "c.jpg");
}

TEST(MatchToImages, PathDecidesWhereStemsRepeat) {
  const std::vector<std::string> images{"left/a.png", "right/a.png"};
  const auto ordered = matchToImages(
      {record("right/a.png"), record("/data/left/a.png")}, images, "/data", "det.jsonl");
  ASSERT_EQ(ordered.size(), 2U);
  EXPECT_EQ(ordered[0].image, "/data/left/a.png");
  EXPECT_EQ(
      message([&] {
        (void)matchToImages({record("a.png"), record("left/a.png")}, images, "/data", "det.jsonl");
      }),
      "det.jsonl: image \"a.png\" may be left/a.png or right/a.png of the data folder /data");
}

TEST(MatchToImages, RefusesStrangersMissingAndRepeatedImages) {
  const std::vector<std::string> images{"images/a.png", "images/b.png"};
  const auto run = [&](const std::vector<std::string>& given) {
    return message([&] {
      std::vector<DetectionRecord> records;
      for (const std::string& image : given) {
        records.push_back(record(image));
      }
      (void)matchToImages(records, images, "/data", "det.jsonl");
    });
  };
  EXPECT_EQ(run({"images/a.png", "b.png"}), "accepted");
  EXPECT_EQ(run({"images/a.png", "b.png", "z.png"}),
            "det.jsonl: image \"z.png\" is not in the data folder /data");
  EXPECT_EQ(
      run({"images/a.png"}),
      "det.jsonl: has no record for images/b.png (an image without detections has a record with "
      "\"lines\": [])");
  EXPECT_EQ(
      run({"images/a.png", "b.png", "a.png"}),
      "det.jsonl: images \"images/a.png\" and \"a.png\" are the same image of the data folder");
}

struct DatasetEvaluation : testing::Test {
  TemporaryFolder folder{"dlsd-dataset-evaluation-test"};
  std::string data = folder / "data";

  [[nodiscard]] std::string write(const std::vector<DetectionRecord>& records) const {
    std::string text;
    for (const DetectionRecord& r : records) {
      text += toJson(r).dump() + "\n";
    }
    const std::string path = folder / "det.jsonl";
    writeFileAtomically(path, text);
    return path;
  }
};

TEST_F(DatasetEvaluation, EveryFrameOnceInOrderWhateverTheThreads) {
  const auto labels = exampleLabels(23);
  writeDataset(data, labels);
  std::vector<DetectionRecord> records;
  for (size_t i = labels.size(); i-- > 0;) {  // backwards
    records.push_back(
        record("images/" + std::string(5, '0') + std::to_string(i) + ".png",
               {shifted(labels[i][0], {0, 0.1 * double(i)}), shifted(labels[i][1], {0, 0.3})}));
  }
  const Dataset dataset(data);
  const DetectionSource source = detectionsOfFile(dataset, write(records));
  std::vector<std::string> texts;
  for (const int jobs : {1, 2, 7, 64}) {
    Summary summary{EvaluationOptions{}};
    size_t frames = 0;
    evaluateFrames(dataset, source, summary.options, jobs, [&](FrameEvaluation&& frame) {
      EXPECT_EQ(frame.labels.index, frames);
      EXPECT_EQ(frame.detections.lines.size(), 2U);
      ++frames;
      summary.add(frame, dataset.camera(frame.labels));
    });
    EXPECT_EQ(frames, labels.size());
    texts.push_back(toJson(summary).dump() + toJson(makeFigures(summary)).dump());
  }
  for (const std::string& text : texts) {
    EXPECT_EQ(text, texts.front());
  }
  EXPECT_THAT(texts.front(), testing::HasSubstr(R"("name":"right","frames":11)"));
}

#ifdef __GLIBC__
TEST_F(DatasetEvaluation, GoesOnWithFewerThreadsThanAskedFor) {
  writeDataset(data, exampleLabels(5));
  const Dataset dataset(data);
  const DetectionSource none = [] {
    return [](size_t, const LabelRecord&) { return Detections{}; };
  };
  // Stacks larger than the address space: no thread can be made.
  pthread_attr_t usual, huge;
  ASSERT_EQ(pthread_getattr_default_np(&usual), 0);
  ASSERT_EQ(pthread_attr_init(&huge), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&huge, size_t{1} << 50), 0);
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  EXPECT_THROW(std::thread([] {}).detach(), std::system_error);
  size_t frames = 0;
  evaluateFrames(dataset, none, {}, 4, [&](FrameEvaluation&&) { ++frames; });
  EXPECT_EQ(pthread_setattr_default_np(&usual), 0);
  EXPECT_EQ(frames, 5U);
}
#endif

TEST_F(DatasetEvaluation, BuiltInDetectorFindsAStep) {
  writeDataset(data, exampleLabels(2));
  const Dataset dataset(data);
  for (const std::string& name : builtinDetectors()) {
    SCOPED_TRACE(name);
    EvaluationOptions options;
    size_t frames = 0;
    evaluateFrames(
        dataset, detectionsOfDetector(dataset, name), options, 1, [&](FrameEvaluation&& frame) {
          ++frames;
          // The step lies between the rows 199 and 200; the second label has no edge in the image.
          EXPECT_TRUE(frame.outcome.labels[0][0].found);
          EXPECT_FALSE(frame.outcome.labels.back()[1].found);
          ASSERT_FALSE(frame.detections.lines.empty());
          const DetectionLine& line = frame.detections.lines[0];
          EXPECT_TRUE(line.normal && line.end_rays_in_cam && line.normal_cov && line.rms_px &&
                      line.max_px && line.angle_rad && line.score && line.polarity);
        });
    EXPECT_EQ(frames, 2U);
  }
  EXPECT_EQ(message([&] { (void)detectionsOfDetector(dataset, "lsd"); }),
            "detector \"lsd\" is unknown, there are dlsd, dlsd-paper");
}

TEST_F(DatasetEvaluation, BezierPointsAreJoinedByTheirCurve) {
  // A parabola, and three points on it: the chords between them are up to 2.5 px off.
  LabelLine parabola = label(pinholeCamera(), {100, 200}, {300, 200}, 0);
  parabola.points.clear();
  for (int k = 0; k <= 100; ++k) {
    parabola.points.emplace_back(100 + 2 * k, 200 + 40 * 0.01 * k * (1 - 0.01 * k));
  }
  writeDataset(data, {{parabola}});
  const Dataset dataset(data);
  std::vector<Eigen::Vector2d> points{{100, 200}, {200, 210}, {300, 200}};
  const auto run = [&](bool bezier) {
    EvaluationOptions options;
    options.bezier = bezier;
    std::optional<FrameEvaluation> result;
    evaluateFrames(
        dataset,
        detectionsOfFile(dataset, write({record("000000.png", {hand_made::detection(points)})})),
        options,
        1,
        [&](FrameEvaluation&& frame) { result = std::move(frame); });
    return *result;
  };
  const FrameEvaluation polyline = run(false), bezier = run(true);
  EXPECT_FALSE(polyline.outcome.labels[0][0].found);
  EXPECT_TRUE(bezier.outcome.labels[0][0].found);
  EXPECT_LE(bezier.outcome.errors.at(0)->sum_px / double(bezier.outcome.errors[0]->samples), 0.02);
  EXPECT_EQ(bezier.structure[kCurveAll].detections.at(0).matches[0], StructuralMatch::kTrue);
  points.resize(9, {10, 10});
  EXPECT_EQ(
      message([&] { (void)run(true); }),
      folder / "det.jsonl: " + data +
          "/images/000000.png: detection 0 has 9 points, a Bezier curve passes through 2 to 8");
}

TEST_F(DatasetEvaluation, StructureCountsClearLabelsApart) {
  auto labels = exampleLabels(1);
  labels[0][1].contrast = 3;
  writeDataset(data, labels);
  const Dataset dataset(data);
  const std::string path =
      write({record("000000.png", {shifted(labels[0][0], {0, 1}), shifted(labels[0][1], {0, 1})})});
  evaluateFrames(dataset, detectionsOfFile(dataset, path), {}, 1, [&](FrameEvaluation&& frame) {
    for (const auto& [kind, counting] :
         {std::pair(kCurveAll, 2L), {kCurveClear, 1L}, {kChordAll, 2L}, {kChordClear, 1L}}) {
      const StructuralOutcome& outcome = frame.structure[kind];
      EXPECT_EQ(outcome.labels, counting);
      ASSERT_EQ(outcome.detections.size(), 2U);
      // The longer line comes first, there being no scores.
      EXPECT_EQ(outcome.detections[0].matches[0], StructuralMatch::kTrue);
      EXPECT_EQ(outcome.detections[1].matches[0],
                counting == 2 ? StructuralMatch::kTrue : StructuralMatch::kIgnored);
    }
  });
}

TEST_F(DatasetEvaluation, ErrorsNameTheFirstBadFrame) {
  const auto labels = exampleLabels(6);
  writeDataset(data, labels);
  std::vector<DetectionRecord> records;
  for (size_t i = 0; i < labels.size(); ++i) {
    records.push_back(
        record("00000" + std::to_string(i) + ".png", {shifted(labels[i][0], {0, 0})}));
  }
  const Dataset dataset(data);
  const auto run = [&](int jobs) {
    return message([&] {
      evaluateFrames(
          dataset, detectionsOfFile(dataset, write(records)), {}, jobs, [](FrameEvaluation&&) {});
    });
  };
  EXPECT_EQ(run(1), "accepted");
  for (const size_t bad : {4U, 2U}) {
    records[bad].lines.push_back(hand_made::detection({{5, 5}, {5, 5}}));
    for (const int jobs : {1, 3}) {
      EXPECT_EQ(run(jobs),
                folder / "det.jsonl: " + data + "/images/00000" + std::to_string(bad) +
                    ".png: detection 1 has no length");
    }
  }
  records[0].width = 1280;
  EXPECT_THAT(
      run(2),
      testing::EndsWith("image \"000000.png\" is 1280x0 there, 640x480 in the data folder"));
}

}  // namespace
}  // namespace dlsd
