// The program as a user meets it: exit codes, one sentence per error, nothing half-written.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cameras/calibration/files.h"
#include "cli/cli_fixture.h"

namespace {

namespace fs = std::filesystem;
using dlsd::cli::test::Cli;
using dlsd::cli::test::contentOf;
using dlsd::cli::test::Result;
using testing::AnyOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

TEST_F(Cli, HelpShowsExamples) {
  for (const char* command :
       {"generate", "detect", "evaluate", "camera", "camera show", "export", "report", "replay"}) {
    SCOPED_TRACE(command);
    const Result result = dlsd(std::string(command) + " --help");
    EXPECT_EQ(result.code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_THAT(result.out, HasSubstr(std::string("\n  dlsd ") + command));
    EXPECT_THAT(result.out, testing::Not(HasSubstr(" /")));  // an example runs anywhere
  }
  const Result result = dlsd("--help");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.out, HasSubstr("evaluate"));
  EXPECT_THAT(dlsd("--version").out, testing::MatchesRegex("dlsd [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST_F(Cli, UsageErrorsAreTwo) {
  expectRefused("", 2, "generate, detect, evaluate, camera, export, report, replay");
  for (const char* seed : {"18446744073709551616", "0x10", "+1", "1.0", "1e3", "\"''\""}) {
    expectRefused(std::string("generate --camera wide.yaml --out data --seed ") + seed, 2, "seed");
  }
  expectRefused("generate --camera wide.yaml --out data --count 0x1", 2, "0x1");
  expectRefused("generate --camera wide.yaml --out data --jobs 0x1", 2, "0x1");
  expectRefused("evaluate --data data --jobs 0x1", 2, "0x1");
  expectRefused("report --data data --out o --jobs 1025", 2, "1025");
  expectRefused("paint", 2, "paint");
  expectRefused("generate --out data", 2, "--camera");
  expectRefused("generate --camera wide.yaml --out data --colour red", 2, "--colour\n");
  expectRefused("generate --camera wide.yaml --oout data", 2, "--oout, did you mean --out?");
  expectRefused("detect --camera wide.yaml --fromat=x a.png", 2, ", did you mean --format?");
  expectRefused("generate --camera wide.yaml --out data --count many", 2, "many");
  expectRefused("generate --camera wide.yaml --out data --count 0", 2, "count");
  expectRefused("generate --camera wide.yaml --out data --count 99999999999999999999", 2, "count");
  expectRefused("generate --camera wide.yaml --out data --seed -1", 2, "seed");
  expectRefused("generate --camera wide.yaml --out data --noise nan", 2, "noise");
  expectRefused("generate --camera wide.yaml --out data --noise -1", 2, "noise");
  expectRefused("generate --camera wide.yaml --out data --psf x", 2, "psf");
  expectRefused("generate --camera wide.yaml --out data --scene moon", 2, "moon");
  expectRefused("generate --camera wide.yaml --out data --encoding rot13", 2, "rot13");
  expectRefused("generate --camera wide.yaml --out data --shard 4/4", 2, "shard");
  expectRefused("generate --camera wide.yaml --out data --shard 1of4", 2, "1of4");
  expectRefused("generate --camera wide.yaml --camera wide.yaml --out data", 2, "wide");
  expectRefused("detect --camera wide.yaml", 2, "images");
  expectRefused("detect --camera wide.yaml --data data", 2, "--data");
  expectRefused("camera", 2, "show");
  expectRefused("camera mend wide.yaml", 2, "mend");
  expectRefused("camera show", 2, "file");
}

// A saved case is judged again; that its scene is another one by now, is said.
TEST_F(Cli, ReplayTellsAnotherScene) {
  const std::string path = DLSD_SOURCE_DIR "/fixtures/counterexamples/recovery-room.json";
  Result result = dlsd("replay " + path);
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, testing::StartsWith("passed: "));
  // What it writes is a folder, which it takes, too.
  ASSERT_EQ(dlsd("replay " + path + " --out look").code, 0);
  result = dlsd("replay look/counterexample-*");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, testing::StartsWith("passed: "));
  expectRefused("replay look", 2, "look/case.json");
  std::string text = dlsd::readFile(path);
  const size_t at = text.rfind("room/");
  ASSERT_NE(at, std::string::npos);
  write("old.json", text.replace(at, 6, "room/0"));
  result = dlsd("replay old.json");
  EXPECT_THAT(result.out, HasSubstr("warning: the case was saved of room/0, the scene is room/"));
  text.replace(text.rfind("versions"), 8, "Versions");
  write("older.json", text);
  EXPECT_THAT(dlsd("replay older.json").out, HasSubstr("saved of an unknown version"));
  write("detector.json", text.replace(text.find("\"dlsd\""), 6, "\"lsd\""));
  expectRefused("replay detector.json", 2, "detector.json: detector = \"lsd\" is unknown");
}

// Cases of labels are judged as those of the detector are: passed, failed, refused.
TEST_F(Cli, ReplayJudgesLabels) {
  const std::string saved = DLSD_SOURCE_DIR "/fixtures/counterexamples/";
  const Result passed = dlsd("replay " + saved + "labels-complete-shadow-of-a-bar.json --out look");
  EXPECT_EQ(passed.code, 0) << passed.err;
  EXPECT_THAT(passed.out, HasSubstr("\npassed: labels-complete, "));
  const std::string look = passed.out.substr(0, passed.out.find('\n'));
  EXPECT_THAT(contentOf(folder / look / "overlay.svg"), HasSubstr("<polyline"));
  EXPECT_EQ(look + "\n" + dlsd("replay " + look + "/case.json").out, passed.out);
  // There is no camera behind the mirror: its principal point would be out of range.
  auto json =
      nlohmann::json::parse(dlsd::readFile(saved + "labels-mirrored-ball-behind-a-bar.json"));
  json["camera"]["params"]["cx"] = -1e6;
  write("failing.json", json.dump());
  const Result failed = dlsd("replay failing.json");
  EXPECT_EQ(failed.code, 1);
  EXPECT_THAT(failed.out, testing::StartsWith("failed: an exception: "));
  json["scene"] = "moon";
  write("moon.json", json.dump());
  expectRefused("replay moon.json", 2, "moon.json: scene = \"moon\" is unknown: allowed is ");
}

TEST_F(Cli, BadCameraFilesAreTwo) {
  write("truncated.yaml", std::string(kWide).substr(0, 70));
  write("not.yaml", "cam0: [1, 2\n");
  std::string text = kWide;
  write("range.yaml", text.replace(text.find("0.93"), 4, "9.93"));
  text = kWide;
  write("size.yaml", text.replace(text.find("160"), 3, "0"));
  text = kWide;
  write("model.yaml", text.replace(text.find("fov"), 3, "fob"));
  write("empty.yaml", "");
  const struct {
    const char *file, *part;
  } cases[] = {{"missing.yaml", "missing.yaml"},
               {"truncated.yaml", "truncated.yaml"},
               {"not.yaml", "not.yaml"},
               {"range.yaml", "9.93"},
               {"size.yaml", "size.yaml"},
               {"model.yaml", "fob"},
               {"empty.yaml", "empty.yaml"},
               {"wide.yaml:cam7", "cam7"},
               {".", "."}};
  for (const auto& c : cases) {
    expectRefused(std::string("camera show ") + c.file, 2, c.part);
  }
  expectRefused("generate --out data --camera wide.yaml --camera range.yaml", 2, "9.93");
  expectRefused("detect x.png --camera range.yaml", 2, "9.93");
}

TEST_F(Cli, CameraShowTellsModelViewDomainAndConventions) {
  const Result result = dlsd("camera show wide.yaml:cam0");
  EXPECT_EQ(result.code, 0) << result.err;
  for (const char* part : {"fov",
                           "160 x 120 px",
                           "0.93 rad",
                           "56 px",
                           "(79.5, 59.5) if (0, 0) is the centre",
                           "(80, 60) if (0, 0) is its corner",
                           "horizontal view",
                           "vertical view",
                           "diagonal view",
                           "180.0000 deg",
                           "19200/19200 100.00 %"}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
}

TEST_F(Cli, FromGenerateToReport) {
  generate();
  Result result = dlsd("detect --data data --time --out det.jsonl --overlay overlays");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  // No progress where there is no terminal; what --time adds.
  EXPECT_THAT(result.err, StartsWith("stage       median ms\ngradient  "));
  for (const char* stage : {"anchors", "linking", "chains", "planes", "validation", "total"}) {
    EXPECT_THAT(result.err, HasSubstr(std::string("\n") + stage + " "));
  }
  EXPECT_THAT(result.err,
              testing::ContainsRegex("\nimages              2\n2 images, [1-9][0-9]* lines: "
                                     "det.jsonl, overlays\n$"));
  EXPECT_THAT(dlsd("detect --data data --out other.jsonl").err,
              testing::MatchesRegex("2 images, [1-9][0-9]* lines: other.jsonl\n"));
  EXPECT_EQ(dlsd("detect --data data").err, "");
  EXPECT_TRUE(fs::exists(folder / "overlays/000001.png"));
  std::istringstream lines(contentOf(folder / "det.jsonl"));
  size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    const auto json = nlohmann::json::parse(line);
    EXPECT_EQ(json.at("format"), "dlsd-detections/1");
    EXPECT_EQ(json.at("image"), "images/00000" + std::to_string(count) + ".png");
    EXPECT_GE(json.at("time_ms"), 0);
  }
  EXPECT_EQ(count, 2U);

  result = dlsd("evaluate --data data --detections det.jsonl --json from_file.json --jobs 1");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("headline"));
  // The same detector run inside gives the same figures, to the last digit.
  ASSERT_EQ(dlsd("evaluate --data data --json inside.json --jobs 2").code, 0);
  auto from_file = nlohmann::json::parse(contentOf(folder / "from_file.json")).at("results").at(0);
  auto inside = nlohmann::json::parse(contentOf(folder / "inside.json")).at("results").at(0);
  EXPECT_EQ(from_file.at("detections"), "det.jsonl");
  EXPECT_EQ(inside.at("detections"), "dlsd");
  EXPECT_EQ(from_file.at("all"), inside.at("all"));
  EXPECT_EQ(from_file.at("all").at("frames"), 2);

  result = dlsd("evaluate --data data --detector dlsd,dlsd-paper --rho 4,2");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("== dlsd ==\n"));
  EXPECT_THAT(result.out, HasSubstr("== dlsd-paper ==\n"));

  result = dlsd("report --data data --detections det.jsonl --out gallery");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, EndsWith("\ngallery/index.html\n"));
  EXPECT_THAT(result.out, HasSubstr("labels a frame, median"));
  EXPECT_TRUE(fs::exists(folder / "gallery/index.html"));
  EXPECT_TRUE(fs::exists(folder / "gallery/frames/000001.js"));
}

TEST_F(Cli, DetectionIsTheSameToStdoutAndFileAndForEachWayToNameTheImages) {
  generate();
  const Result to_stdout = dlsd("detect --camera wide.yaml data/images/000000.png --out -");
  EXPECT_EQ(to_stdout.code, 0) << to_stdout.err;
  ASSERT_EQ(dlsd("detect --camera wide.yaml data/images/000000.png --out det.jsonl").code, 0);
  EXPECT_EQ(to_stdout.out, contentOf(folder / "det.jsonl"));
  const auto by_camera = nlohmann::json::parse(to_stdout.out);
  const Result by_data = dlsd("detect --data data");
  const auto first = nlohmann::json::parse(by_data.out.substr(0, by_data.out.find('\n')));
  EXPECT_EQ(by_camera.at("lines"), first.at("lines"));
  EXPECT_EQ(by_camera.at("image"), "data/images/000000.png");
  EXPECT_FALSE(by_camera.contains("time_ms"));
}

TEST_F(Cli, NoInputIsOverwritten) {
  generate();
  fs::create_directories(folder / "in");
  for (const char* name : {"a.png", "b.png"}) {
    fs::copy_file(folder / "data/images/000000.png", folder / "in" / name);
  }
  fs::create_directory_symlink("in", folder / "link");
  fs::create_symlink("in/a.png", folder / "a.jsonl");
  fs::create_hard_link(folder / "in/b.png", folder / "b.jsonl");
  ASSERT_EQ(dlsd("detect --data data --out det.jsonl").code, 0);
  std::map<std::string, std::string> before;
  for (const std::string& name : files()) {
    before[name] = contentOf(folder / name);
  }
  const std::string detect = "detect --camera wide.yaml ";
  const struct {
    std::string arguments, part;
  } cases[] = {
      {"detect --data data --overlay data/images", "is the input data/images/000000.png"},
      {"detect --data data --out data/images/000001.png", "is the input data/images/000001.png"},
      {"detect --data data --out ./data/../data/manifest.json", "manifest.json"},
      {"detect --data data --out data/labels/000000.json", "labels/000000.json"},
      {"detect --data data --out data/cameras/wide.yaml", "cameras/wide.yaml"},
      {detect + "in/a.png --out in/a.png", "in/a.png: will not be overwritten"},
      {detect + "in/a.png in/b.png --out $PWD/in/b.png", "is the input in/b.png"},
      {detect + "in/a.png --out link/a.png", "is the input in/a.png"},
      {detect + "in/a.png --out a.jsonl", "is the input in/a.png"},
      {detect + "in/b.png --out b.jsonl", "is the input in/b.png"},
      {detect + "in/a.png --overlay in", "is the input in/a.png"},
      {detect + "link/a.png --overlay ./in/", "is the input link/a.png"},
      {detect + "in/a.png --out wide.yaml", "is the input wide.yaml"},
      {"detect --camera wide.yaml:cam0 in/a.png --out wide.yaml", "is the input wide.yaml"},
      {detect + "in/a.png data/../in/a.png --overlay o", "o/a.png"},
      {detect + "in/a.png elsewhere/a.png --overlay o", "o/a.png"},
      {detect + "x.jpg x.png --overlay o", "o/x.png"},
      {detect + "in/a.png --overlay o --out o/a.png", "o/a.png"},
      {"evaluate --data data --detections det.jsonl --json det.jsonl", "is the input det.jsonl"},
      {"evaluate --data data --json data/manifest.json", "is the input data/manifest.json"}};
  for (const auto& c : cases) {
    expectRefused(c.arguments, 2, c.part);
  }
  for (const auto& [name, content] : before) {
    EXPECT_EQ(contentOf(folder / name), content) << name;
  }
  // The output of an earlier run is no input.
  EXPECT_EQ(dlsd(detect + "in/a.png in/b.png --overlay o --out d.jsonl").code, 0);
  EXPECT_EQ(dlsd(detect + "in/a.png in/b.png --overlay o --out d.jsonl").code, 0);
}

TEST_F(Cli, ANameThatJsonCannotHoldIsABadImageAmongMany) {
  generate();
  const std::string name = "caf\xe9.png";
  fs::copy_file(folder / "data/images/000000.png", folder / name);
  fs::copy_file(folder / "wide.yaml", folder / "w\xef.yaml");
  const Result result = dlsd("detect --camera wide.yaml '" + name +
                             "' data/images/000001.png --out d.jsonl --overlay o");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, StartsWith("dlsd: " + name + ": the name is not UTF-8"));
  EXPECT_THAT(result.err, HasSubstr("\n1 image, "));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 2);
  const std::string text = contentOf(folder / "d.jsonl");
  EXPECT_EQ(nlohmann::json::parse(text).at("image"), "data/images/000001.png");
  expectRefused("detect --camera 'w\xef.yaml' data/images/000001.png", 2, "not UTF-8");
  ASSERT_EQ(dlsd("detect --data data --out 'd\xe9.jsonl'").code, 0);
  expectRefused("evaluate --data data --detections 'd\xe9.jsonl' --json e.json", 2, "not UTF-8");
  EXPECT_EQ(dlsd("evaluate --data data --detections 'd\xe9.jsonl'").code, 0);
}

TEST_F(Cli, OutIsWrittenUnlessAllImagesFailed) {
  generate();
  write("bad.png", "no image");
  write("d.jsonl", "old\n");
  const std::string detect = "detect --camera wide.yaml bad.png --out ";
  expectRefused(detect + "new.jsonl", 2, "; new.jsonl was not written\n");
  expectRefused(detect + "d.jsonl", 2, "; d.jsonl was not written and is as before\n");
  EXPECT_EQ(contentOf(folder / "d.jsonl"), "old\n");

  auto manifest = nlohmann::json::parse(contentOf(folder / "data/manifest.json"));
  manifest["frames"] = nlohmann::json::array();
  write("data/manifest.json", manifest.dump());
  for (const char* name : {"d.jsonl", "e.jsonl"}) {
    EXPECT_EQ(dlsd(std::string("detect --data data --time --out ") + name).code, 0);
    EXPECT_TRUE(fs::exists(folder / name));
    EXPECT_EQ(contentOf(folder / name), "");
  }
}

TEST_F(Cli, CodecsSayNothing) {
  generate();
  ASSERT_EQ(dlsd("detect --data data --out det.jsonl").code, 0);
  const fs::path image = folder / "data/images/000000.png";
  const std::string png = contentOf(image);
  std::string flipped = png;
  flipped[flipped.size() / 2] = char(~flipped[flipped.size() / 2]);
  // A TIFF file whose directory lies behind its end.
  const std::string tiff("II*\0\xf0\xff\0\0 some bytes that are no directory", 42);
  for (const std::string& content : {png.substr(0, png.size() / 2), flipped, tiff}) {
    write("data/images/000000.png", content);
    expectRefused("evaluate --data data", 2, "images/000000.png");
    expectRefused("report --data data --out gallery", 2, "images/000000.png");
    expectRefused(
        "report --data data --detections det.jsonl --out gallery", 2, "images/000000.png");
    expectRefused("detect --camera wide.yaml data/images/000000.png", 2, "images/000000.png");
  }
}

TEST_F(Cli, SeedsAreDecimalNumbersUpTo64Bit) {
  for (const char* seed : {"18446744073709551615", "010"}) {
    ASSERT_EQ(
        dlsd(std::string("generate --camera wide.yaml --out data-") + seed + " --seed " + seed)
            .code,
        0);
  }
  const auto seedOf = [&](const std::string& data) {
    return nlohmann::json::parse(contentOf(folder / data / "manifest.json"))
        .at("config")
        .at("seed")
        .get<uint64_t>();
  };
  EXPECT_EQ(seedOf("data-18446744073709551615"), UINT64_MAX);
  EXPECT_EQ(seedOf("data-010"), 10U);
}

TEST_F(Cli, OneBadImageAmongManyIsNamedAndTheOthersAreDone) {
  generate();
  write("bad.png", "no image");
  const Result result = dlsd(
      "detect --camera wide.yaml data/images/000000.png bad.png data/images/000001.png --out "
      "d.jsonl");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, HasSubstr("bad.png"));
  EXPECT_THAT(result.err, HasSubstr("\n2 images, "));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 2);
  const std::string text = contentOf(folder / "d.jsonl");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
}

TEST_F(Cli, BadImagesAreTwo) {
  generate();
  write("bad.png", "no image");
  const std::string png = contentOf(folder / "data/images/000000.png");
  write("half.png", png.substr(0, png.size() / 2));
  std::string other = kWide;
  write("other.yaml", other.replace(other.find("120"), 3, "121"));
  expectRefused("detect --camera wide.yaml missing.png", 2, "missing.png");
  expectRefused("detect --camera wide.yaml bad.png --out d.jsonl", 2, "bad.png");
  expectRefused("detect --camera wide.yaml half.png --out d.jsonl", 2, "half.png");
  expectRefused("detect --camera wide.yaml data --out d.jsonl", 2, "data");
  expectRefused("detect --camera other.yaml data/images/000000.png --out d.jsonl",
                2,
                "data/images/000000.png: is 160x120 px, its camera other.yaml is 160x121 px");
}

TEST_F(Cli, UnwritableOutputsAreThree) {
  generate();
  ASSERT_EQ(dlsd("detect --data data --out det.jsonl").code, 0);
  write("file", "stands here");
  const std::string detect = "detect --camera wide.yaml data/images/000000.png --out ";
  expectRefused("generate --camera wide.yaml --count 1 --out /proc/dlsd", 3, "/proc/dlsd");
  expectRefused(detect + "/dev/full", 3, "/dev/full");
  expectRefused("evaluate --data data --json /dev/full", 3, "/dev/full");
  expectRefused("report --data data --detections det.jsonl --out /proc/dlsd", 3, "/proc/dlsd");
  EXPECT_EQ(contentOf(folder / "file"), "stands here");
  for (const char* command :
       {"camera show wide.yaml", "detect --data data", "evaluate --data data"}) {
    SCOPED_TRACE(command);
    const std::string full =
        "cd '" + folder.string() + "' && '" DLSD_BINARY "' " + command + " >/dev/full 2>.stderr";
    const int status = std::system(full.c_str());
    EXPECT_EQ(WEXITSTATUS(status), 3);
    EXPECT_THAT(contentOf(folder / ".stderr"),
                StartsWith("dlsd: standard output: cannot be written"));
  }
}

TEST_F(Cli, OutputsWhereNoFileCanBeAreTwo) {
  generate();
  write("file", "stands here");
  const std::string detect = "detect --camera wide.yaml data/images/000000.png --out ";
  expectRefused(detect + "nowhere/d.jsonl", 2, "the folder nowhere does not exist");
  expectRefused(detect + "file/d.jsonl", 2, "file/d.jsonl");
  expectRefused(detect + "data", 2, "data: cannot be written: a folder stands there");
  expectRefused("evaluate --data data --json nowhere/e.json", 2, "the folder nowhere");
  expectRefused("generate --camera wide.yaml --out file", 2, "file is no folder");
  expectRefused("generate --camera wide.yaml --out file/data", 2, "file is no folder");
  expectRefused(detect + "d.jsonl --overlay file", 2, "file is no folder");
  expectRefused("report --data data --out file", 2, "file is no folder");
  expectRefused("export --format ulsd --data data --out file/u", 2, "file is no folder");
  EXPECT_EQ(contentOf(folder / "file"), "stands here");
}

TEST_F(Cli, UnknownCommandsAreTwoWhateverFollows) {
  expectRefused("detct --help", 2, "did you mean detect?");
  expectRefused("detcet", 2, "did you mean detect?");
  expectRefused("camera shw wide.yaml --help", 2, "dlsd camera has no command \"shw\"");
  expectRefused("camera shw", 2, "did you mean show?");
  expectRefused("xylophone --help", 2, "generate, detect, evaluate");
  EXPECT_EQ(dlsd("--help detct").code, 0);
}

TEST_F(Cli, BadDataAndDetectionsAreTwo) {
  generate();
  fs::create_directories(folder / "empty");
  expectRefused("evaluate --data missing", 2, "missing");
  expectRefused("evaluate --data empty", 2, "manifest.json");
  expectRefused("report --data empty --out gallery", 2, "manifest.json");
  expectRefused("report --data data --out data", 2, "data");
  expectRefused("detect --data empty", 2, "manifest.json");
  expectRefused("evaluate --data data --detections missing.jsonl", 2, "missing.jsonl");
  expectRefused("evaluate --data data --detector elsed", 2, "lsd, edlines, fld");
  expectRefused("evaluate", 2, "--data is needed");
  expectRefused("evaluate --data data --command './a {image}'", 2, "has no {out}");
  expectRefused("evaluate --data data --command './a {image} {out}' --timeout 0", 2, "timeout");
  expectRefused("evaluate --data data --command './a {image} {out}' --json e.json",
                2,
                "./a cannot be started");
  expectRefused("evaluate --data data --timeout 5", 2, "--command");
  expectRefused("evaluate --data data --command ''", 2, "--command");
  expectRefused("evaluate --data data --data ./data/", 2, "data/: is given twice");
  expectRefused("evaluate --data data --detector lsd,dlsd,lsd", 2, "lsd twice");
  expectRefused("evaluate --data data --out x", 2, "--experiment");
  expectRefused("evaluate --data data --frames 7", 2, "--");
  expectRefused("evaluate --experiment dlsd-paper --out x --data data --frames 7", 2, "--data");
  expectRefused("evaluate --experiment dlsd-paper --out x --min-recall 0.5@1", 2, "--min-recall");
  expectRefused("evaluate --experiment dlsd-paper --out x --report r", 2, "--report");
  expectRefused("evaluate --data data --curve spline", 2, "spline");
  expectRefused("evaluate --data data --experiment lsd", 2, "lsd");
  expectRefused("evaluate --data data --experiment dlsd-paper", 2, "--out");
  expectRefused("evaluate --data data --min-right 0.9@3", 2, "one of 1, 2, 4");
  expectRefused("evaluate --data data --min-right 0.9@3 --report r", 2, "--min-right");
  expectRefused("evaluate --data data --max-rms-px -1", 2, "[0, 100]");
  expectRefused("evaluate --data data --rho 0", 2, "rho");
  expectRefused("evaluate --data data --rho nan", 2, "rho");
  expectRefused("evaluate --data data --rho 1,x", 2, "x");
  expectRefused("evaluate --data data --rho 1,2,3,4,5,6,7,8,9", 2, "at most 8");
  expectRefused("report --data data --out gallery --rho 1,2,3,4,5,6,7,8,9", 2, "at most 8");
  expectRefused("evaluate --data data --jobs -1", 2, "-1");
  expectRefused("evaluate --data data --min-recall 0.9", 2, "0.9");
  expectRefused("evaluate --data data --min-recall 98@1", 2, "98@1");
  expectRefused("evaluate --data data --min-recall nan@1", 2, "nan@1");
  expectRefused("evaluate --data data --min-recall 0.9@3", 2, "one of 1, 2, 4");

  const std::string empty = R"({"image": "images/000000.png", "lines": []})"
                            "\n";
  const auto detections = [&](const std::string& points) {
    return empty + R"({"image": "images/000001.png", "lines": [{"points": )" + points + "}]}\n";
  };
  const struct {
    std::string content, part;
  } cases[] = {
      {"{", "d.jsonl line 1"},
      {empty, "images/000001.png"},
      {empty + empty, "the same image"},
      {detections("[[1, 2]]"), "d.jsonl line 2"},
      {detections("[[1, 2], [3, 1e999]]"), "d.jsonl line 2"},
      {detections("[[1, 2], [3, null]]"), "d.jsonl line 2"},
      {detections("[[1, 2], [1, 2]]"), "has no length"},
      {detections("[[1, 2], [1e7, 2]]"), "images/000001.png: detection 0"},
      {detections("[[1, 2], [9, 2]]") + R"({"image": "zebra.png", "lines": []})", "zebra.png"}};
  for (const auto& c : cases) {
    write("d.jsonl", c.content);
    expectRefused("evaluate --data data --detections d.jsonl --json e.json", 2, c.part);
    expectRefused("report --data data --detections d.jsonl --out gallery", 2, c.part);
  }
  write("d.jsonl", detections("[[1, 2], [9, 2]]"));
  EXPECT_EQ(dlsd("evaluate --data data --detections d.jsonl").code, 0);
}

TEST_F(Cli, MinRecallIsAGate) {
  generate("--scene paper");
  const std::string nothing = R"({"image": "images/000000.png", "lines": []})"
                              "\n"
                              R"({"image": "images/000001.png", "lines": []})"
                              "\n";
  write("nothing.jsonl", nothing);
  Result result = dlsd("evaluate --data data --detections nothing.jsonl --min-recall 0.5@4");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(
      result.err,
      StartsWith("dlsd: --min-recall 0.5@4 is not reached by nothing.jsonl: headline labels "
                 "found at rho = 4 px: 0/"));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
  EXPECT_THAT(result.out,
              HasSubstr("\nfailed: nothing.jsonl: headline labels found at rho = 4 px: 0/"));

  // The labels themselves as detections find every label.
  std::string perfect;
  for (const char* number : {"000000", "000001"}) {
    const auto label =
        nlohmann::json::parse(contentOf(folder / "data/labels" / (std::string(number) + ".json")));
    nlohmann::json record{{"image", label.at("image")}, {"lines", nlohmann::json::array()}};
    for (const auto& line : label.at("lines")) {
      record["lines"].push_back({{"points", line.at("points")}});
    }
    perfect += record.dump() + "\n";
  }
  write("perfect.jsonl", perfect);
  result = dlsd(
      "evaluate --data data --detections perfect.jsonl --rho 0.02 --json e.json --min-recall "
      "1@0.02");
  EXPECT_EQ(result.code, 0) << result.out << result.err;
  const auto all =
      nlohmann::json::parse(contentOf(folder / "e.json")).at("results").at(0).at("all");
  for (const auto& [stratum, found] : all.at("at_rho").at(0).at("found").items()) {
    EXPECT_EQ(found.at("counted"), found.at("total")) << stratum;
  }
  const auto& right = all.at("at_rho").at(0).at("right");
  EXPECT_EQ(right.at("counted"), right.at("total"));
  EXPECT_GT(right.at("total"), 0);
}

TEST_F(Cli, GatesOnPrecisionAndError) {
  generate("--scene paper");
  std::string shifted;
  for (const char* number : {"000000", "000001"}) {
    const auto label =
        nlohmann::json::parse(contentOf(folder / "data/labels" / (std::string(number) + ".json")));
    nlohmann::json record{{"image", label.at("image")}, {"lines", nlohmann::json::array()}};
    for (const auto& line : label.at("lines")) {
      record["lines"].push_back({{"points", line.at("points")}});
      for (auto& point : record["lines"].back()["points"]) {
        point[0] = point[0].get<double>() + 0.3;
      }
    }
    // As many lines again on nothing, 6 degrees long.
    for (size_t i = 0; i < label.at("lines").size(); ++i) {
      record["lines"].push_back({{"points", {{2, 2 + 0.1 * double(i)}, {2, 30}}}});
    }
    shifted += record.dump() + "\n";
  }
  write("d.jsonl", shifted);
  const std::string evaluate = "evaluate --data data --detections d.jsonl ";
  EXPECT_EQ(dlsd(evaluate + "--min-recall 0.9@1,1@4 --min-right 0.1@1 --max-rms-px 0.31").code, 0);
  Result result = dlsd(evaluate + "--min-recall 0.9@1 --min-precision 0.9@1 --max-rms-px 0.01");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.err,
              HasSubstr("--min-right 0.9@1 is not reached by d.jsonl: detections >= 5 deg"));
  EXPECT_THAT(result.err, HasSubstr("; --max-rms-px 0.01 is not reached by d.jsonl: rms distance"));
  EXPECT_THAT(result.err, testing::Not(HasSubstr("min-recall")));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
  EXPECT_THAT(result.out, HasSubstr("\npassed: d.jsonl: headline labels found"));
}

TEST_F(Cli, ReportIsTheSameForAnyNumberOfThreads) {
  generate();
  ASSERT_EQ(dlsd("generate --camera wide.yaml --count 2 --seed 4 --noise 8 --out more").code, 0);
  for (const char* jobs : {"1", "3"}) {
    const Result result = dlsd(std::string("evaluate --data data --data more --detector "
                                           "dlsd,dlsd-paper --json e.json --report r") +
                               jobs + " --jobs " + jobs);
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.out, EndsWith(std::string("\nr") + jobs + "/index.html\n"));
  }
  for (const char* name : {"index.html", "figures.csv", "evaluation.json"}) {
    EXPECT_EQ(contentOf(folder / "r1" / name), contentOf(folder / "r3" / name)) << name;
    EXPECT_NE(contentOf(folder / "r1" / name), "") << name;
  }
  EXPECT_EQ(contentOf(folder / "e.json"), contentOf(folder / "r1/evaluation.json"));
  const auto json = nlohmann::json::parse(contentOf(folder / "e.json"));
  EXPECT_EQ(json.at("results").at(1).at("all").at("frames"), 4);
  const std::string page = contentOf(folder / "r1/index.html");
  EXPECT_THAT(page, HasSubstr("Line detection on data, more"));
  EXPECT_THAT(page, testing::Not(HasSubstr("http")));
  expectRefused("evaluate --data data --data more --detections d.jsonl", 2, "once for each");
  expectRefused("evaluate --data data --report wide.yaml", 2, "wide.yaml is no folder");
  expectRefused("evaluate --data data --report wide.yaml/a/b", 2, "wide.yaml is no folder");
  expectRefused("evaluate --experiment dlsd-paper --data data --out wide.yaml", 2, "no folder");
}

TEST_F(Cli, AnyonesProgramIsEvaluated) {
  generate();
  write("detector.sh",
        "#!/bin/sh\ncase \"$1\" in *000001.png) exit $3;; esac\n"
        "echo '{\"lines\": [{\"points\": [[10, 10], [90, 60]]}]}' > \"$2\"\n");
  Result result =
      dlsd("evaluate --data data --command 'sh detector.sh {image} {out} 5' --json e.json");
  EXPECT_EQ(result.code, 2);
  EXPECT_EQ(result.err, "dlsd: data/images/000001.png: sh ended with code 5\n");
  EXPECT_FALSE(fs::exists(folder / "e.json"));
  write("detector.sh",
        "#!/bin/sh\necho '{\"lines\": [{\"points\": [[10, 10], [90, 60]]}]}' > \"$2\"\n");
  result = dlsd(
      "evaluate --data data --command 'sh detector.sh {image} {out} {camera}' --time --json "
      "e.json");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto all = nlohmann::json::parse(contentOf(folder / "e.json")).at("results").at(0);
  EXPECT_EQ(all.at("detections"), "sh");
  EXPECT_EQ(all.at("all").at("detections"), 2);
  EXPECT_THAT(result.out, HasSubstr("\ntime ms "));
}

TEST_F(Cli, AnInterruptedEvaluationLeavesNothing) {
  generate();
  fs::create_directories(folder / "tmp");
  const auto before = files();
  for (const auto& [signal, code] : {std::pair{"INT", 130}, {"TERM", 143}}) {
    for (const char* then : {"sleep 60", "echo {\\\"lines\\\": []} > {out}"}) {
      // The program's parent is dlsd.
      const std::string command =
          std::string("sh -c 'kill -") + signal + " $PPID; " + then + "; exit; {image} {out}'";
      std::string quoted;
      for (const char c : command) {
        quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
      }
      SCOPED_TRACE(quoted);
      write("run.sh",
            "TMPDIR=\"$PWD/tmp\" exec '" DLSD_BINARY
            "' evaluate --data data --json e.json --report r --jobs 1 --command '" +
                quoted + "'\n");
      const auto start = std::chrono::steady_clock::now();
      const Result result = shell("sh run.sh");
      EXPECT_LE(std::chrono::steady_clock::now() - start, std::chrono::seconds(40));
      fs::remove(folder / "run.sh");
      EXPECT_EQ(result.code, code);
      EXPECT_EQ(result.out, "");
      EXPECT_EQ(result.err, "dlsd: interrupted: nothing is written\n");
      EXPECT_EQ(files(), before);
    }
  }
}

TEST_F(Cli, WordsOfOtherProgramsDoNotSteerTheTerminal) {
  generate();
  expectRefused(
      "evaluate --data data --command \"sh -c 'printf \\\"a\\\\033[31mred\\\\007\\\" >&2; exit 3; "
      "{image} "
      "{out}'\"",
      2,
      "code 3: a?[31mred?");
}

TEST_F(Cli, FilesProgramsAndDetectorsAreEvaluatedSideBySide) {
  generate();
  // The three points of ULSD's order 2, in a program and in a file; a built-in detector is not
  // asked for Bezier points.
  const std::string lines = "\"lines\": [{\"points\": [[10, 10], [50, 30], [90, 60]]}]";
  write("my dlsd",
        "#!/bin/sh\nprintf '%s' \"$1\" > \"last image\"\n"
        "echo '{" +
            lines + "}' > \"$2\"\n");
  fs::permissions(folder / "my dlsd", fs::perms::owner_all);
  write("dlsd",
        "{\"image\": \"000000.png\", " + lines + "}\n{\"image\": \"000001.png\", " + lines + "}\n");
  fs::rename(folder / "data", folder / "my 'data'");
  const Result result = dlsd(
      "evaluate --data \"my 'data'\" --detections dlsd --command \"'./my dlsd' {image} {out}\" "
      "--detector dlsd --curve bezier --jobs 1 --json e.json --report r");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto json = nlohmann::json::parse(contentOf(folder / "e.json")).at("results");
  ASSERT_EQ(json.size(), 3U);
  EXPECT_EQ(json[0].at("detections"), "dlsd");
  EXPECT_EQ(json[1].at("detections"), "my dlsd");
  EXPECT_EQ(json[2].at("detections"), "dlsd (2)");
  EXPECT_EQ(json[0].at("all"), json[1].at("all"));
  EXPECT_EQ(json[0].at("figures"), json[1].at("figures"));
  EXPECT_THAT(contentOf(folder / "last image"), EndsWith("/my 'data'/images/000001.png"));
  EXPECT_THAT(contentOf(folder / "r/index.html"), HasSubstr("Line detection on my &#39;data&#39;"));
}

TEST_F(Cli, PaperExperimentRuns) {
  generate("--scene paper");
  Result result =
      dlsd("evaluate --experiment dlsd-paper --data data --detector dlsd,dlsd-paper --out exp");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, StartsWith("Table 1 on 2 frames\n"));
  EXPECT_THAT(result.out, HasSubstr("\nFig. 4: recall of dlsd in %"));
  EXPECT_THAT(result.out, EndsWith("\nexp/index.html\n"));
  for (const char* name : {"index.html", "experiment.csv", "experiment.json"}) {
    EXPECT_TRUE(fs::exists(folder / "exp" / name)) << name;
  }
  EXPECT_FALSE(fs::exists(folder / "exp/data"));
  // Without data it makes the sequence.
  write("mine.sh", "echo '{\"lines\": [{\"points\": [[10, 10], [90, 60]]}]}' > $2\n");
  result = dlsd(
      "evaluate --experiment dlsd-paper --frames 1 --detector dlsd --command 'sh mine.sh {image} "
      "{out}' --out made");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\nFig. 4: recall of sh in %"));
  EXPECT_TRUE(fs::exists(folder / "made/data/images/000000.png"));
  EXPECT_THAT(contentOf(folder / "made/data/cameras/tum_mono_wide.yaml"), HasSubstr("0.933271"));
}

}  // namespace
