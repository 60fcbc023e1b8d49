#include "evaluation/external_command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "evaluation/hand_made.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;
using hand_made::label;
using hand_made::pinholeCamera;
using hand_made::TemporaryFolder;
using hand_made::writeDataset;
using testing::HasSubstr;

TEST(SplitCommand, BlanksSeparateAndQuotesHoldTogether) {
  using Words = std::vector<std::string>;
  EXPECT_EQ(splitCommand("./a {image}  {out}\t-x"), (Words{"./a", "{image}", "{out}", "-x"}));
  EXPECT_EQ(splitCommand("sh -c 'a \"b\" $c' \"d e\"f ''"),
            (Words{"sh", "-c", "a \"b\" $c", "d ef", ""}));
  for (const char* bad : {"", "  ", "a 'b", "a \"b'"}) {
    EXPECT_THROW((void)splitCommand(bad), InputError) << bad;
  }
}

struct ExternalCommand : testing::Test {
  TemporaryFolder folder{"dlsd command test"};  // paths with blanks
  LabelLine line = label(pinholeCamera(), {100, 199.5}, {300, 199.5}, 0);

  void SetUp() override { writeDataset(folder / "data", {{line}, {line}, {line}}); }

  /// Runs a shell program on all images: detections and error.
  struct Result {
    std::vector<Detections> frames;
    std::string error;
  };
  [[nodiscard]] Result run(const std::string& command,
                           double timeout_s = 20,
                           bool timed = false) const {
    const Dataset dataset(folder / "data");
    Result result;
    try {
      evaluateFrames(
          dataset,
          detectionsOfCommand(dataset, {command, timeout_s}, timed),
          {},
          2,
          [&](FrameEvaluation&& frame) { result.frames.push_back(std::move(frame.detections)); });
    } catch (const InputError& error) {
      result.error = error.what();
    }
    return result;
  }
  [[nodiscard]] static std::string sh(const std::string& script) {
    return "sh -c '" + script + "' name {image} {out} {camera}";
  }
};

TEST_F(ExternalCommand, ReadsWhatTheProgramWrites) {
  // The program sees an image and a camera, by absolute paths.
  const Result result = run(
      sh("test -s \"$1\" && grep -q cam0 \"$3\" && case \"$1$2$3\" in /*) "
         "echo \"{\\\"lines\\\": [{\\\"points\\\": [[100, 199.5], [300, 199.5]]}]}\" > \"$2\";; "
         "esac"));
  EXPECT_EQ(result.error, "");
  ASSERT_EQ(result.frames.size(), 3U);
  for (const Detections& frame : result.frames) {
    ASSERT_EQ(frame.lines.size(), 1U);
    EXPECT_EQ(frame.lines[0].points.back(), Eigen::Vector2d(300, 199.5));
    EXPECT_FALSE(frame.time_ms);
  }
}

TEST_F(ExternalCommand, TimeIsTheRecordsElseTheProgramsOwn) {
  const Result own = run(sh("echo \"{\\\"lines\\\": []}\" > \"$2\""), 20, true);
  ASSERT_EQ(own.frames.size(), 3U);
  EXPECT_GT(own.frames[0].time_ms.value_or(0), 0);
  const Result told =
      run(sh("echo \"{\\\"lines\\\": [], \\\"time_ms\\\": 0.5}\" > \"$2\""), 20, true);
  ASSERT_EQ(told.frames.size(), 3U);
  EXPECT_EQ(told.frames[0].time_ms, 0.5);
}

TEST_F(ExternalCommand, OldOutputIsNotReadAgain) {
  // Writes for the first image only.
  const Result result =
      run(sh("case \"$1\" in *000000.png) echo \"{\\\"lines\\\": []}\" > \"$2\";; esac"));
  EXPECT_EQ(result.error,
            folder / "data/images/000001.png: sh ended well, but wrote no file {out}");
}

TEST_F(ExternalCommand, FailuresSayWhatHappened) {
  EXPECT_EQ(run("./no-such-detector {image} {out}").error,
            folder /
                "data/images/000000.png: ./no-such-detector cannot be started: No such file or "
                "directory");
  EXPECT_EQ(run(sh("echo first >&2; echo out of luck >&2; exit 3")).error,
            folder / "data/images/000000.png: sh ended with code 3: out of luck");
  EXPECT_EQ(run(sh("exit 4")).error, folder / "data/images/000000.png: sh ended with code 4");
  EXPECT_EQ(run(sh("kill -SEGV $$")).error,
            folder / "data/images/000000.png: sh was killed by signal 11");
  EXPECT_EQ(
      run(sh("echo hello > \"$2\"")).error,
      folder / "data/images/000000.png: sh wrote something that is not one JSON object to {out}");
  EXPECT_THAT(run(sh("echo 3 > \"$2\"")).error,
              HasSubstr("output of sh for " + folder / "data/images/000000.png"));
  EXPECT_THAT(run(sh("echo \"{}\" > \"$2\"")).error, HasSubstr("lines"));
  EXPECT_THAT(run(sh("echo \"{\\\"width\\\": 320, \\\"lines\\\": []}\" > \"$2\"")).error,
              HasSubstr("is 320x0 there, 640x480 in the data folder"));
  EXPECT_THAT(
      run(sh("echo \"{\\\"lines\\\": [{\\\"points\\\": [[1, 2], [1, 2]]}]}\" > \"$2\"")).error,
      HasSubstr("detection 0 has no length"));
}

TEST_F(ExternalCommand, AProgramThatHangsIsKilledWithWhatItStarted) {
  const auto start = std::chrono::steady_clock::now();
  const std::string pid_file = folder / "pid";
  const Result result =
      run("sh -c 'sleep 60 & echo $! > \"$3\"; wait' name {image} {out} '" + pid_file + "'", 0.5);
  EXPECT_EQ(result.error,
            folder / "data/images/000000.png: sh took longer than 0.5 s and was killed");
  EXPECT_LE(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  std::string pid;
  std::ifstream(pid_file) >> pid;
  ASSERT_FALSE(pid.empty());
  // Gone, or a zombie until init reaps it: soon, on a busy machine not at once.
  std::string state = "R";
  for (int i = 0; i < 100 && state != "" && state != "Z" && state != "X"; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    std::ifstream stat("/proc/" + pid + "/stat");
    std::string number, name;
    state.clear();
    stat >> number >> name >> state;
  }
  EXPECT_THAT(state, testing::AnyOf("", "Z", "X"));
}

TEST_F(ExternalCommand, AnOutputThatNeverEndsIsNone) {
  for (const char* script : {"mkfifo \"$2\"", "ln -s /dev/zero \"$2\"", "mkdir \"$2\""}) {
    EXPECT_EQ(run(sh(script)).error,
              folder / "data/images/000000.png: sh ended well, but wrote no file {out}")
        << script;
  }
}

TEST_F(ExternalCommand, WhoeverWaitsCanEndIt) {
  const Dataset dataset(folder / "data");
  const std::string seen = folder / "seen";
  CommandOptions options{sh("dirname \"$2\" > \"" + seen + "\"; sleep 60"), 60};
  options.while_running = [&] {
    if (fs::exists(seen)) {
      throw std::runtime_error("enough");
    }
  };
  const auto start = std::chrono::steady_clock::now();
  const auto evaluate = [&] {
    evaluateFrames(dataset, detectionsOfCommand(dataset, options), {}, 1, [](FrameEvaluation&&) {});
  };
  EXPECT_THAT(evaluate, testing::ThrowsMessage<std::runtime_error>("enough"));
  EXPECT_LE(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
  std::string scratch;
  std::getline(std::ifstream(seen) >> std::ws, scratch);
  EXPECT_FALSE(fs::exists(scratch)) << scratch;
}

TEST_F(ExternalCommand, NothingIsLeftBehind) {
  const std::string seen = folder / "seen";
  const Result result =
      run("sh -c 'dirname \"$2\" >> \"$3\"; echo \"{\\\"lines\\\": []}\" > \"$2\"' "
          "name {image} {out} '" +
          seen + "'");
  EXPECT_EQ(result.error, "");
  std::ifstream file(seen);
  size_t folders = 0;
  for (std::string path; std::getline(file, path); ++folders) {
    EXPECT_FALSE(fs::exists(path)) << path;
  }
  EXPECT_EQ(folders, 3U);
}

TEST_F(ExternalCommand, BadCommandsAreRefusedAtOnce) {
  const Dataset dataset(folder / "data");
  for (const char* bad : {"", "./a {image}", "./a {out}", "./a {image} '{out}"}) {
    EXPECT_THROW((void)detectionsOfCommand(dataset, {bad, 1}), InputError) << bad;
  }
  for (const double timeout_s : {0.0, -1.0, 2e6, std::nan("")}) {
    EXPECT_THROW((void)detectionsOfCommand(dataset, {"./a {image} {out}", timeout_s}), InputError);
  }
}

}  // namespace
}  // namespace dlsd
