// `dlsd detect` on video files and folders.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>

#include "cli/cli_fixture.h"

namespace {

namespace fs = std::filesystem;
using dlsd::cli::test::Cli;
using dlsd::cli::test::contentOf;
using dlsd::cli::test::Result;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

/// Four generated images, and videos of them.
struct Video : Cli {
  static constexpr int kImages = 4;
  static constexpr double kRate = 20;
  std::vector<cv::Mat> images;

  void SetUp() override {
    Cli::SetUp();
    const Result result = dlsd("generate --camera wide.yaml --count 4 --seed 3 --out data");
    ASSERT_EQ(result.code, 0) << result.err;
    for (int i = 0; i < kImages; ++i) {
      images.push_back(cv::imread((folder / fmt::format("data/images/{:06}.png", i)).string()));
      ASSERT_FALSE(images.back().empty());
    }
    if (!makeVideo("v.avi", "MJPG", kImages)) {
      GTEST_SKIP() << "this OpenCV cannot write a Motion JPEG video";
    }
  }

  /// The images round and round.
  [[nodiscard]] bool makeVideo(const std::string& name, const std::string& codec, int n) const {
    cv::VideoWriter writer;
    if (!writer.open((folder / name).string(),
                     cv::CAP_FFMPEG,
                     cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]),
                     kRate,
                     images[0].size())) {
      return false;
    }
    for (int i = 0; i < n; ++i) {
      writer.write(images[size_t(i) % images.size()]);
    }
    return true;
  }

  /// What OpenCV decodes.
  [[nodiscard]] std::vector<cv::Mat> decoded(const std::string& name) const {
    std::vector<cv::Mat> frames;
    cv::VideoCapture capture((folder / name).string(), cv::CAP_FFMPEG);
    for (cv::Mat frame; capture.read(frame);) {
      frames.push_back(frame.clone());
    }
    return frames;
  }

  [[nodiscard]] static std::vector<nlohmann::json> records(const std::string& text) {
    std::vector<nlohmann::json> all;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
      all.push_back(nlohmann::json::parse(line));
    }
    return all;
  }
};

TEST_F(Video, FramesAreDetectedAsTheSameImagesAre) {
  ASSERT_TRUE(makeVideo("w.MP4", "mp4v", kImages));
  for (const std::string name : {"v.avi", "w.MP4"}) {
    SCOPED_TRACE(name);
    const std::vector<cv::Mat> frames = decoded(name);
    ASSERT_EQ(frames.size(), size_t(kImages));
    std::string pictures;
    for (size_t i = 0; i < frames.size(); ++i) {
      const std::string picture = fmt::format("frame{}.png", i);
      ASSERT_TRUE(cv::imwrite((folder / picture).string(), frames[i]));
      pictures += " " + picture;
    }
    Result result = dlsd("detect --camera wide.yaml --out p.jsonl --overlay p" + pictures);
    ASSERT_EQ(result.code, 0) << result.err;
    result = dlsd("detect --camera wide.yaml -o v.jsonl --overlay o " + name);
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_EQ(result.out, "");
    const auto expected = records(contentOf(folder / "p.jsonl"));
    const auto found = records(contentOf(folder / "v.jsonl"));
    ASSERT_EQ(found.size(), size_t(kImages));
    size_t lines = 0;
    for (size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].at("image"), fmt::format("{}#{:06}", name, i));
      EXPECT_EQ(found[i].at("frame"), i);
      EXPECT_NEAR(found[i].at("stamp_s").get<double>(), double(i) / kRate, 1e-6);
      EXPECT_EQ(found[i].at("lines"), expected[i].at("lines"));
      EXPECT_EQ(found[i].at("width"), 160);
      EXPECT_EQ(found[i].at("camera"), "wide.yaml");
      lines += found[i].at("lines").size();
      EXPECT_EQ(contentOf(folder / "o" / fs::path(name).stem() / fmt::format("{:06}.png", i)),
                contentOf(folder / "p" / fmt::format("frame{}.png", i)));
    }
    EXPECT_GT(lines, 10U);
    EXPECT_EQ(result.err, fmt::format("4 frames, {} lines: v.jsonl, o\n", lines));
    EXPECT_EQ(dlsd("detect --camera wide.yaml " + name).out, contentOf(folder / "v.jsonl"));
  }
}

TEST_F(Video, EveryNthFrame) {
  const auto all = records(dlsd("detect --camera wide.yaml v.avi").out);
  const auto third = records(dlsd("detect --camera wide.yaml v.avi --every 3").out);
  ASSERT_EQ(all.size(), 4U);
  ASSERT_EQ(third.size(), 2U);
  EXPECT_EQ(third[0], all[0]);
  EXPECT_EQ(third[1], all[3]);
  expectRefused("detect --camera wide.yaml v.avi --every 0", 2, "--every");
  expectRefused("detect --camera wide.yaml data/images/000000.png --every 2", 2, "--every is for");
  expectRefused("detect --data data --every 2", 2, "--every");
}

TEST_F(Video, OverlaysMayBeAVideo) {
  for (const std::string overlay : {"o.avi", "o.mp4"}) {
    SCOPED_TRACE(overlay);
    const auto before = files();
    Result result =
        dlsd("detect --camera wide.yaml v.avi --every 2 -o d.jsonl --overlay " + overlay);
    ASSERT_EQ(result.code, 0) << result.err;
    cv::VideoCapture capture((folder / overlay).string(), cv::CAP_FFMPEG);
    EXPECT_DOUBLE_EQ(capture.get(cv::CAP_PROP_FPS), kRate / 2);
    const std::vector<cv::Mat> frames = decoded(overlay);
    ASSERT_EQ(frames.size(), 2U);
    // The frame with something drawn on it.
    const cv::Mat original = decoded("v.avi")[2];
    ASSERT_EQ(frames[1].size(), original.size());
    EXPECT_GE(cv::norm(frames[1], original, cv::NORM_INF), 100);
    EXPECT_LE(cv::norm(frames[1], original, cv::NORM_L1) / double(original.total() * 3), 30);
    const std::string once = contentOf(folder / overlay);
    ASSERT_EQ(dlsd("detect --camera wide.yaml v.avi --every 2 --overlay " + overlay).code, 0);
    EXPECT_EQ(contentOf(folder / overlay), once);
    fs::remove(folder / "d.jsonl");
    fs::remove(folder / overlay);
    EXPECT_EQ(files(), before);
  }
  // Of images, too.
  const Result result = dlsd("detect --data data --overlay images.avi --out d.jsonl");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(decoded("images.avi").size(), 4U);
}

TEST_F(Video, FoldersAreTheImagesAndVideosInThem) {
  fs::create_directories(folder / "in/deeper.png");
  for (const char* name : {"b.png", "A.PNG", "c.png"}) {
    fs::copy_file(folder / "data/images/000000.png", folder / "in" / name);
  }
  fs::copy_file(folder / "v.avi", folder / "in/bb.avi");
  write("in/notes.txt", "no image");
  write("in/.hidden.png", "no image");
  const Result result = dlsd("detect --camera wide.yaml in/ -o d.jsonl");
  EXPECT_EQ(result.code, 0) << result.err;
  std::vector<std::string> names;
  for (const auto& record : records(contentOf(folder / "d.jsonl"))) {
    names.push_back(record.at("image"));
  }
  EXPECT_THAT(names,
              testing::ElementsAre("in/A.PNG",
                                   "in/b.png",
                                   "in/bb.avi#000000",
                                   "in/bb.avi#000001",
                                   "in/bb.avi#000002",
                                   "in/bb.avi#000003",
                                   "in/c.png"));
  fs::create_directories(folder / "empty");
  expectRefused("detect --camera wide.yaml empty", 2, "empty: the folder holds no image");
}

TEST_F(Video, BadVideosAreTwo) {
  write("text.mp4", "no video");
  write("empty.avi", "");
  fs::create_directories(folder / "folder.avi");
  ASSERT_TRUE(makeVideo("long.avi", "MJPG", 100));
  const std::string whole = contentOf(folder / "long.avi");
  write("head.avi", whole.substr(0, 4000));
  ASSERT_TRUE(makeVideo("whole.mp4", "mp4v", 100));
  const std::string mp4 = contentOf(folder / "whole.mp4");
  write("half.mp4", mp4.substr(0, mp4.size() / 2));
  std::string other = kWide;
  write("other.yaml", other.replace(other.find("120"), 3, "121"));
  const std::string detect = "detect --camera wide.yaml --out d.jsonl --overlay o.avi ";
  expectRefused(detect + "missing.mp4", 2, "missing.mp4: cannot be read");
  expectRefused(detect + "text.mp4", 2, "text.mp4: not a video that can be decoded");
  expectRefused(detect + "empty.avi", 2, "empty.avi: not a video");
  expectRefused(detect + "half.mp4", 2, "half.mp4: not a video");
  expectRefused(detect + "head.avi", 2, "head.avi: no");
  expectRefused(detect + "folder.avi", 2, "folder.avi: the folder holds no image");
  expectRefused("detect --camera other.yaml --out d.jsonl --overlay o.avi v.avi",
                2,
                "v.avi: is 160x120 px, its camera other.yaml is 160x121 px; d.jsonl was not");

  // The frames before the tear are done.
  write("torn.avi", whole.substr(0, whole.size() * 6 / 10));
  const size_t frames = decoded("torn.avi").size();
  ASSERT_GT(frames, 40U);
  ASSERT_LT(frames, 70U);
  const Result result = dlsd("detect --camera wide.yaml torn.avi v.avi --out d.jsonl");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(
      result.err,
      StartsWith(fmt::format("dlsd: torn.avi: truncated or damaged video: only {} of 100 frames "
                             "could be decoded\n",
                             frames)));
  EXPECT_THAT(result.err, HasSubstr(fmt::format("\n{} frames, ", frames + 4)));
  EXPECT_EQ(records(contentOf(folder / "d.jsonl")).size(), frames + 4);
}

TEST_F(Video, NoInputAndNoOtherOutputIsOverwritten) {
  fs::create_directories(folder / "o/v");
  fs::create_directories(folder / "in");
  fs::copy_file(folder / "data/images/000000.png", folder / "o/v/000002.png");
  fs::copy_file(folder / "v.avi", folder / "in/v.avi");
  fs::copy_file(folder / "v.avi", folder / "in/v.mpg");
  std::map<std::string, std::string> before;
  for (const std::string& name : files()) {
    before[name] = contentOf(folder / name);
  }
  const std::string detect = "detect --camera wide.yaml ";
  expectRefused(detect + "v.avi --overlay v.avi", 2, "is the input v.avi");
  expectRefused(detect + "v.avi --overlay in/../v.avi", 2, "is the input v.avi");
  expectRefused(detect + "v.avi --out v.avi", 2, "is the input v.avi");
  expectRefused(detect + "v.avi --out x.avi --overlay x.avi", 2, "x.avi");
  expectRefused(detect + "v.avi in/v.avi --overlay p", 2, "p/v/000000.png");
  expectRefused(detect + "in --overlay p", 2, "p/v/000000.png");
  expectRefused(detect + "v.avi --overlay o.webm", 2, "o.webm: videos are written as .avi or .mp4");
  expectRefused(detect + "v.avi --overlay nowhere/o.avi", 2, "the folder nowhere does not exist");
  write("small.yaml", std::string(kWide).replace(std::string(kWide).find("120"), 3, "100"));
  ASSERT_EQ(dlsd("generate --camera wide.yaml --camera small.yaml --count 2 --out two").code, 0);
  expectRefused("detect --data two --overlay o.avi", 2, "o.avi: a video needs images of one size");
  const Result result = dlsd(detect + "o/v/000002.png v.avi --overlay o --out d.jsonl");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, HasSubstr("o/v/000002.png: will not be overwritten"));
  for (const auto& [name, content] : before) {
    EXPECT_EQ(contentOf(folder / name), content) << name;
  }
}

TEST_F(Video, AnInterruptedRunLeavesNothingHalfWritten) {
  std::string many;
  for (int i = 0; i < 2000; ++i) {
    many += " v.avi";
  }
  const auto before = files();
  write("run.sh",
        "'" DLSD_BINARY "' detect --camera wide.yaml --out d.jsonl --overlay o.avi" + many +
            " &\npid=$!\n"
            "until [ \"$(find . -name 'd.jsonl.tmp-*' -size +0)\" ]; do sleep 0.05; done\n"
            "kill -TERM $pid\nwait $pid\n");
  const Result result = shell("sh run.sh");
  fs::remove(folder / "run.sh");
  EXPECT_EQ(result.code, 143);
  EXPECT_THAT(result.err, StartsWith("dlsd: interrupted: "));
  EXPECT_THAT(result.err, EndsWith(" frames done, d.jsonl was not written\n"));
  EXPECT_EQ(files(), before);
}

TEST_F(Video, AVideoThatDoesNotFitIsThree) {
  ASSERT_TRUE(makeVideo("long.avi", "MJPG", 100));
  const auto before = files();
  for (const char* overlay : {"o.avi", "o.mp4"}) {
    write("run.sh",
          std::string("ulimit -f 20\ntrap '' XFSZ\nexec '" DLSD_BINARY
                      "' detect --camera wide.yaml long.avi --overlay ") +
              overlay + " >/dev/null\n");
    const Result result = shell("sh run.sh");
    fs::remove(folder / "run.sh");
    EXPECT_EQ(result.code, 3);
    EXPECT_THAT(result.err, StartsWith(std::string("dlsd: ") + overlay + ": cannot be written"));
    EXPECT_EQ(files(), before);
  }
}

}  // namespace
