#include "evaluation/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "evaluation/hand_made.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;
using hand_made::label;
using hand_made::pinholeCamera;
using hand_made::shifted;
using hand_made::TemporaryFolder;
using hand_made::writeDataset;
using testing::HasSubstr;
using testing::Not;

struct ReportTest : testing::Test {
  TemporaryFolder folder{"dlsd-report-test"};
  std::string data = folder / "a <b> & 'c'";  // what a page must escape
  LabelLine line = label(pinholeCamera(), {100, 199.5}, {300, 199.5}, 0);

  void SetUp() override { writeDataset(data, {{line}, {line}, {}}); }

  /// The first frame's label is found, the second frame's is not.
  [[nodiscard]] Report write(const std::string& out) const {
    const Dataset dataset(data);
    const DetectionSource source = [this]() -> FrameDetections {
      return [this](size_t i, const LabelRecord&) {
        return Detections{{shifted(line, {0, i == 0 ? 0.5 : 30})}, {}, {}};
      };
    };
    return writeReport(
        dataset, source, {.out = out, .detections_title = "<x>.jsonl", .evaluation = {}});
  }
};

TEST_F(ReportTest, PageHasAFrameEachAndTheSummary) {
  const Report report = write(data + "/gallery");
  const std::string page = readFile(report.index_path);
  for (const char* frame : {"#frame-0", "#frame-1", "#frame-2"}) {
    EXPECT_THAT(page, HasSubstr(frame));
  }
  EXPECT_THAT(page, Not(HasSubstr("#frame-3")));
  EXPECT_THAT(page, HasSubstr("1/2<small>50.0 %</small>"));
  ASSERT_TRUE(report.summary);
  EXPECT_EQ(report.summary->all.frames, 3);
  EXPECT_EQ(report.statistics.lines, 2U);
  EXPECT_THAT(readFile(data + "/gallery/frames/000000.js"), HasSubstr(R"("found":7)"));
  EXPECT_THAT(readFile(data + "/gallery/frames/000001.js"), HasSubstr(R"("found":0)"));
  EXPECT_TRUE(fs::exists(data + "/gallery/thumbs/000002.png"));
}

// The viewer filters by these numbers.
TEST_F(ReportTest, CurvesHaveLengthContrastAndFieldAngle) {
  (void)write(data + "/gallery");
  std::string script = readFile(data + "/gallery/frames/000000.js");
  script = script.substr(script.find('(') + 1);
  const auto frame = nlohmann::json::parse(script.substr(0, script.rfind(')')));
  // From (100, 199.5) to (300, 199.5), focal length 400 px, principal point (320, 240).
  const double field = std::atan(std::hypot(120, 40.5) / 400) * 180 / M_PI;
  for (const char* key : {"labels", "detections"}) {
    SCOPED_TRACE(key);
    ASSERT_EQ(frame.at(key).size(), 1U);
    const auto& curve = frame.at(key).at(0);
    EXPECT_EQ(curve.at("length"), "200.0");
    EXPECT_NEAR(std::stod(curve.at("field").get<std::string>()), field, 0.11);
  }
  EXPECT_EQ(frame.at("labels").at(0).at("contrast"), "50");
  EXPECT_FALSE(frame.at("detections").at(0).contains("contrast"));
}

TEST_F(ReportTest, TextIsEscapedAndNothingComesFromElsewhere) {
  const std::string page = readFile(write(data + "/gallery").index_path);
  EXPECT_THAT(page, HasSubstr("<h1>a &lt;b&gt; &amp; &#39;c&#39;, 3 frames</h1>"));
  EXPECT_THAT(page, HasSubstr("&lt;x&gt;.jsonl"));
  EXPECT_THAT(page, Not(HasSubstr("<b> &")));
  EXPECT_THAT(page, Not(HasSubstr("https:")));
  EXPECT_THAT(page, Not(HasSubstr("src=\"/")));
}

TEST_F(ReportTest, TitleTellsTheSceneAndTheNumberOfFrames) {
  auto manifest = nlohmann::ordered_json::parse(readFile(data + "/manifest.json"));
  manifest["config"] = {{"scene", "r<oo>m/1"}};
  writeFileAtomically(data + "/manifest.json", manifest.dump());
  const std::string page = readFile(write(data + "/gallery").index_path);
  EXPECT_THAT(page, HasSubstr("<title>r&lt;oo&gt;m, 3 frames - dlsd report</title>"));
  EXPECT_THAT(
      page,
      HasSubstr("<h1>r&lt;oo&gt;m, 3 frames<small>a &lt;b&gt; &amp; &#39;c&#39;</small></h1>"));
}

TEST_F(ReportTest, ImagesAreReferredToWhenNearAndCopiedWhenFar) {
  struct Case {
    std::string out, image;
    bool copied;
  };
  for (const Case& c :
       {Case{data + "/gallery", "../images/000000.png", false},
        Case{folder / "beside", "../a%20%3Cb%3E%20%26%20%27c%27/images/000000.png", false},
        Case{folder / "far/away", "images/000000.png", true}}) {
    SCOPED_TRACE(c.out);
    const std::string page = readFile(write(c.out).index_path);
    EXPECT_THAT(page, HasSubstr("\"image\":\"" + c.image + "\""));
    EXPECT_EQ(fs::exists(c.out + "/images/000000.png"), c.copied);
  }
  EXPECT_EQ(readFile(folder / "far/away/images/000001.png"), readFile(data + "/images/000001.png"));
}

TEST_F(ReportTest, LabelsAloneMakeAReport) {
  const Dataset dataset(data);
  const Report report = writeReport(
      dataset, std::nullopt, {.out = folder / "far/out", .detections_title = "", .evaluation = {}});
  EXPECT_FALSE(report.summary);
  const std::string page = readFile(report.index_path);
  EXPECT_THAT(page, HasSubstr("Labels only"));
  EXPECT_THAT(page, HasSubstr("\"hasDetections\":false"));
  EXPECT_THAT(table(report.statistics), HasSubstr("labels a frame, median"));
}

TEST_F(ReportTest, NothingIsWrittenWhenADetectionIsBad) {
  const Dataset dataset(data);
  const DetectionSource source = []() -> FrameDetections {
    return [](size_t i, const LabelRecord&) {
      return i < 2 ? Detections{} : Detections{{hand_made::detection({{1, 1}, {1, 1}})}, {}, {}};
    };
  };
  EXPECT_THROW(
      writeReport(
          dataset, source, {.out = folder / "far/out", .detections_title = "", .evaluation = {}}),
      InputError);
  EXPECT_FALSE(fs::exists(folder / "far"));
  EXPECT_THROW(
      writeReport(
          dataset, std::nullopt, {.out = data + "/", .detections_title = "", .evaluation = {}}),
      InputError);
}

}  // namespace
}  // namespace dlsd
