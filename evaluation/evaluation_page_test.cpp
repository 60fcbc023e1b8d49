#include "evaluation/evaluation_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "evaluation/hand_made.h"
#include "evaluation/picture.h"

namespace dlsd {
namespace {

using hand_made::label;
using hand_made::pinholeCamera;
using hand_made::shifted;
using hand_made::TemporaryFolder;
using hand_made::writeDataset;

struct EvaluationPageTest : testing::Test {
  TemporaryFolder folder{"dlsd-evaluation-page-test"};

  void SetUp() override {
    const LabelLine line = label(pinholeCamera(), {100, 199.5}, {300, 199.5}, 0);
    writeDataset(folder / "data", std::vector<std::vector<LabelLine>>(12, {line}));
  }

  /// Finds the label in the first 9 frames; elsewhere it is on nothing.
  void write(const std::string& out, int jobs) const {
    const Dataset dataset(folder / "data");
    const DetectionSource source = []() -> FrameDetections {
      return [](size_t i, const LabelRecord& labels) {
        return Detections{{shifted(labels.lines[0], {0, i < 9 ? 0.25 : 40.0})}, 3.0, {}};
      };
    };
    std::vector<EvaluatedDetections> all;
    for (const char* name : {"<a>", "b"}) {
      EvaluatedDetections& one =
          all.emplace_back(EvaluatedDetections{name, Summary{{}}, {}, WorstCases{{}}});
      evaluateFrames(dataset, source, {}, jobs, [&](FrameEvaluation&& frame) {
        one.summary.add(frame, dataset.camera(frame.labels));
        one.worst.add(frame, dataset);
      });
      one.figures = makeFigures(one.summary);
    }
    writeEvaluationPage(all, "On <data>", out);
  }
};

TEST_F(EvaluationPageTest, SameBytesForAnyNumberOfThreads) {
  write(folder / "one", 1);
  write(folder / "many", 5);
  for (const char* name : {"index.html", "figures.csv", "evaluation.json"}) {
    EXPECT_EQ(readFile(folder / "one/" + name), readFile(folder / "many/" + name)) << name;
  }
}

TEST_F(EvaluationPageTest, ShowsFiguresPlotsAndWorstCases) {
  write(folder / "out", 2);
  const std::string page = readFile(folder / "out/index.html");
  EXPECT_THAT(page, testing::HasSubstr("On &lt;data&gt;"));
  EXPECT_THAT(page, testing::HasSubstr("&lt;a&gt;"));
  EXPECT_THAT(page, testing::Not(testing::HasSubstr("<a>")));
  EXPECT_THAT(page, testing::HasSubstr("9/12"));
  const auto count = [&](const std::string& part) {
    size_t n = 0;
    for (size_t at = page.find(part); at != std::string::npos; at = page.find(part, at + 1)) {
      ++n;
    }
    return n;
  };
  EXPECT_EQ(count("<figure>"), 12U);  // 3 misses and 3 false alarms, twice
  EXPECT_EQ(count("data:image/png;base64,"), 12U);
  EXPECT_GE(count("<svg class=\"plot\""), 13U);
  EXPECT_THAT(page, testing::HasSubstr("Time per image"));
  // Nothing comes from elsewhere.
  for (const char* part : {"http", "src=\"", "<link", "<script"}) {
    EXPECT_EQ(count(part), 0U) << part;
  }
  EXPECT_EQ(count(">nan") + count("\"nan") + count(" nan"), 0U);
  const auto json = nlohmann::json::parse(readFile(folder / "out/evaluation.json"));
  EXPECT_EQ(json.at("results").size(), 2U);
  EXPECT_EQ(json["results"][0].at("detections"), "<a>");
  EXPECT_THAT(readFile(folder / "out/figures.csv"), testing::StartsWith(kFiguresCsvHeader));
}

TEST(Picture, Base64OfKnownTexts) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(Picture, CropsAndShrinks) {
  Image image;
  image.width = 4;
  image.height = 4;
  for (int i = 0; i < 16; ++i) {
    image.bytes.push_back(uint8_t(10 * i));
  }
  const Image part = cropped(image, 1, 2, 2, 2);
  EXPECT_THAT(part.bytes, testing::ElementsAre(90, 100, 130, 140));
  const Image small = shrunk(image, 2);
  EXPECT_EQ(small.width, 2);
  EXPECT_THAT(small.bytes, testing::ElementsAre(25, 45, 105, 125));
  EXPECT_EQ(shrunk(image, 4).bytes, image.bytes);
}

}  // namespace
}  // namespace dlsd
