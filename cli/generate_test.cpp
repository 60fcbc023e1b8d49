// dlsd generate as a program among other programs: killed, interrupted, out of disk, verified.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/cli_fixture.h"
#include "synth/dataset/dataset.h"
#include "synth/dataset/random.h"

namespace {

namespace fs = std::filesystem;
using dlsd::cli::test::Cli;
using dlsd::cli::test::contentOf;
using dlsd::cli::test::Result;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

struct GenerateCli : Cli {
  static constexpr const char* kGenerate = "generate --camera wide.yaml --count 12 --seed 5 --out ";

  /// Path in a data folder -> bytes.
  [[nodiscard]] std::map<std::string, std::string> data(const std::string& name) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder / name)) {
      if (entry.is_regular_file()) {
        files[entry.path().lexically_relative(folder / name).generic_string()] =
            contentOf(entry.path());
      }
    }
    return files;
  }

  /// Runs dlsd in the folder under `wrapper` (env, timeout, setpriv ...); code as the shell says.
  [[nodiscard]] Result under(const std::string& wrapper, const std::string& arguments) const {
    const std::string command = "cd '" + folder.string() + "' && " + wrapper +
                                " '" DLSD_BINARY "' " + arguments +
                                " >.stdout 2>.stderr </dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1,
            contentOf(folder / ".stdout"),
            contentOf(folder / ".stderr")};
  }

  /// Starts dlsd in the folder, its messages in .stderr; the process, or -1.
  [[nodiscard]] pid_t start(std::vector<std::string> arguments) const {
    std::string program = DLSD_BINARY;
    std::vector<char*> argv{program.data()};
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
      if (::chdir(folder.c_str()) == 0 && std::freopen(".stderr", "w", stderr) != nullptr) {
        ::execv(program.c_str(), argv.data());
      }
      ::_exit(99);
    }
    return child;
  }

  /// Every file that is there under its own name is byte for byte that of the whole dataset.
  static void expectNothingHalf(const std::map<std::string, std::string>& files,
                                const std::map<std::string, std::string>& whole) {
    for (const auto& [name, content] : files) {
      if (name.starts_with("journal") || name.starts_with("manifest-") ||
          name.find(".tmp-") != std::string::npos) {
        continue;
      }
      ASSERT_TRUE(whole.contains(name)) << name;
      EXPECT_TRUE(content == whole.at(name)) << name << " is half written";
    }
  }

  /// The same files with the same bytes; pictures are not printed.
  static void expectSame(const std::map<std::string, std::string>& files,
                         const std::map<std::string, std::string>& whole) {
    std::vector<std::string> names, whole_names;
    for (const auto& [name, content] : files) names.push_back(name);
    for (const auto& [name, content] : whole) whole_names.push_back(name);
    ASSERT_EQ(names, whole_names);
    for (const auto& [name, content] : whole) EXPECT_TRUE(files.at(name) == content) << name;
  }

  /// What a run that nobody disturbs makes.
  [[nodiscard]] std::map<std::string, std::string> undisturbed() const {
    const Result result = dlsd(std::string(kGenerate) + "whole --jobs 1");
    EXPECT_EQ(result.code, 0) << result.err;
    return data("whole");
  }
};

// The real program, killed at random moments (from before its first file to after its last one),
// with another number of threads each time. Moments are numbers of files that are there, not
// times: a machine may be as fast or as busy as it likes.
TEST_F(GenerateCli, KilledAtRandomMomentsItGoesOnToTheSameBytes) {
  const auto whole = undisturbed();
  ASSERT_EQ(whole.size(), 12U + 12U + 1U + 1U);
  const auto filesIn = [&](const std::string& name) {
    size_t count = 0;
    std::error_code gone;  // a temporary file may get its name while we look
    for (fs::recursive_directory_iterator entry(folder / name, gone), end; !gone && entry != end;
         entry.increment(gone)) {
      ++count;
    }
    return count;
  };
  dlsd::Random random(20, 1);
  size_t kills = 0, kills_with_frames = 0;
  for (int run = 0; run < 20 && (kills < 8 || kills_with_frames < 2); ++run) {
    const std::string out = "killed" + std::to_string(run);
    for (int attempt = 0;; ++attempt) {
      const size_t files_at_kill = filesIn(out) + size_t(random.next(0, 9));
      const pid_t child = start({"generate",
                                 "--camera",
                                 "wide.yaml",
                                 "--count",
                                 "12",
                                 "--seed",
                                 "5",
                                 "--out",
                                 out,
                                 "--jobs",
                                 std::to_string(attempt % 3 + 1)});
      ASSERT_GE(child, 0);
      int status = 0;
      pid_t ended = 0;
      while (filesIn(out) < files_at_kill && ended == 0) {
        ::usleep(500);
        ended = ::waitpid(child, &status, WNOHANG);
      }
      if (ended == 0) {
        ::kill(child, SIGKILL);
        ended = ::waitpid(child, &status, 0);
      }
      ASSERT_EQ(ended, child);
      if (fs::exists(folder / out)) expectNothingHalf(data(out), whole);
      if (WIFEXITED(status)) {
        ASSERT_EQ(WEXITSTATUS(status), 0) << contentOf(folder / ".stderr");
        break;
      }
      ASSERT_EQ(WTERMSIG(status), SIGKILL);
      ++kills;
      kills_with_frames += fs::exists(folder / out / "images/000000.png") ? 1 : 0;
    }
    expectSame(data(out), whole);
  }
  EXPECT_GE(kills, 8U);
  EXPECT_GE(kills_with_frames, 2U) << "killed before the first frame only: the test tests little";
}

TEST_F(GenerateCli, KilledShardsSideBySideGiveTheBytesOfOneRun) {
  const auto whole = undisturbed();
  dlsd::Random random(21, 1);
  // All shards at the same time in one folder, each killed and started again until it is done.
  std::string script;
  for (int shard = 0; shard < 3; ++shard) {
    script += "(for s in";
    for (int attempt = 0; attempt < 6; ++attempt) {
      script += ' ';
      script += std::to_string(random.next(0.05, 0.2 + 0.1 * attempt));
    }
    script += " 300; do timeout -s KILL $s '" DLSD_BINARY "' " +
              (kGenerate + std::string("sharded")) + " --shard " + std::to_string(shard) +
              "/3 && exit 0; done; exit 1) & p" + std::to_string(shard) + "=$!; ";
  }
  const std::string command = "cd '" + folder.string() + "' && { " + script +
                              "wait $p0 && wait $p1 && wait $p2; } >.stdout 2>.stderr";
  ASSERT_EQ(std::system(command.c_str()), 0) << contentOf(folder / ".stderr");
  auto sharded = data("sharded");
  for (int shard = 0; shard < 3; ++shard) {
    EXPECT_EQ(sharded.erase("manifest-" + std::to_string(shard) + "-of-3.json"), 1U);
  }
  expectSame(sharded, whole);
  EXPECT_EQ(dlsd("generate --verify sharded").out, "sharded: 12 of 12 frames are whole\n");
}

TEST_F(GenerateCli, InterruptedItSaysSoAndGoesOn) {
  const struct { int signal, code; } cases[] = {{SIGINT, 130}, {SIGTERM, 143}};
  for (const auto& [signal, code] : cases) {
    SCOPED_TRACE(code);
    const std::string out = "data-" + std::to_string(code);
    const pid_t child = start(
        {"generate", "--camera", "wide.yaml", "--seed", "5", "--count", "1000000", "--out", out});
    ASSERT_GE(child, 0);
    // When the first frame is finished.
    for (int i = 0;
         i < 6000 && contentOf(folder / out / "journal.txt").find(' ', 20) == std::string::npos;
         ++i) {
      ::usleep(10000);
    }
    ::kill(child, signal);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), code);
    const std::string err = contentOf(folder / ".stderr");
    EXPECT_THAT(err, StartsWith("dlsd: interrupted: "));
    EXPECT_THAT(
        err, HasSubstr(" of 1000000 frames are finished, the same command goes on from there\n"));
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    EXPECT_FALSE(fs::exists(folder / out / "manifest.json"));
    size_t images = 0;
    for (const auto& [file, content] : data(out)) {
      EXPECT_THAT(file, testing::Not(HasSubstr(".tmp-")));
      if (file.ends_with(".json")) {
        EXPECT_TRUE(nlohmann::json::accept(content)) << file;
      }
      if (file.ends_with(".png")) {
        EXPECT_THAT(content, EndsWith("IEND\xae\x42\x60\x82")) << file;
        ++images;
      }
    }
    // Every image that is there is in the journal: nothing is made twice.
    const std::string journal = contentOf(folder / out / "journal.txt");
    EXPECT_EQ(std::count(journal.begin(), journal.end(), '\n'), long(images) + 1);
    EXPECT_GE(images, 1U);
    const Result verified = dlsd("generate --verify " + out);
    EXPECT_EQ(verified.code, 1);
    EXPECT_EQ(verified.out,
              out +
                  "/manifest.json: missing, the run is not finished (journal.txt): the same dlsd "
                  "generate goes on\n");
    EXPECT_EQ(verified.err,
              "dlsd: " + out +
                  ": not finished yet, the dlsd generate that began it goes on from there\n");
  }
}

TEST_F(GenerateCli, OutOfDiskItSaysSoAndGoesOn) {
  const auto whole = undisturbed();
  // A device without room in place of a file: the true error of the system.
  for (const std::string file : {"images/000011.png", "labels/000007.json"}) {
    SCOPED_TRACE(file);
    const std::string out = "full-" + file.substr(0, file.find('/'));
    fs::create_directories((folder / out / file).parent_path());
    fs::create_symlink("/dev/full", folder / out / file);
    const Result result = dlsd(kGenerate + out);
    EXPECT_EQ(result.code, 3);
    EXPECT_EQ(result.err,
              "dlsd: " + out + "/" + file + ": cannot be written: No space left on device\n");
    EXPECT_FALSE(fs::exists(folder / out / "manifest.json"));
    fs::remove(folder / out / file);
    expectNothingHalf(data(out), whole);
    EXPECT_EQ(dlsd(kGenerate + out).code, 0);
    expectSame(data(out), whole);
  }
  // A limit that all files share: the first one that is larger is named.
  const Result result = under("trap '' XFSZ; ulimit -f 4;", std::string(kGenerate) + "limited");
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.err, HasSubstr(": cannot be written: File too large\n"));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  expectNothingHalf(data("limited"), whole);
  EXPECT_EQ(dlsd(std::string(kGenerate) + "limited").code, 0);
  expectSame(data("limited"), whole);
}

TEST_F(GenerateCli, AReadOnlyFolderIsThree) {
  fs::create_directories(folder / "closed");
  fs::permissions(folder, fs::perms::owner_all | fs::perms::group_all | fs::perms::others_all);
  fs::permissions(folder / "closed",
                  fs::perms::owner_read | fs::perms::owner_exec | fs::perms::others_read |
                      fs::perms::others_exec);
  // Nothing is closed to root.
  const std::string as_nobody =
      ::geteuid() == 0 ? "setpriv --reuid 65534 --regid 65534 --clear-groups" : "";
  if (under(as_nobody, "--version").code != 0) GTEST_SKIP() << "the program can't run as nobody";
  for (const char* out : {"closed", "closed/data"}) {
    const Result result = under(as_nobody, std::string(kGenerate) + out);
    EXPECT_EQ(result.code, 3);
    EXPECT_THAT(result.err, StartsWith(std::string("dlsd: ") + out));
    EXPECT_THAT(result.err, EndsWith(": Permission denied\n"));
  }
}

/// sha256 of what is in the folder now, into the manifest.
void rehash(const fs::path& data) {
  auto manifest = nlohmann::ordered_json::parse(contentOf(data / "manifest.json"));
  for (auto& frame : manifest["frames"]) {
    for (const char* key : {"image", "labels"}) {
      frame[std::string(key) + "_sha256"] =
          dlsd::sha256Hex(contentOf(data / frame[key].get<std::string>()));
    }
  }
  std::ofstream(data / "manifest.json") << manifest.dump(1) << "\n";
}

TEST_F(GenerateCli, VerifyFindsWhatIsWrong) {
  ASSERT_EQ(dlsd("generate --camera wide.yaml --count 3 --seed 3 --planes depth --out data").code,
            0);
  const Result good = dlsd("generate --verify data");
  EXPECT_EQ(good.code, 0) << good.err;
  EXPECT_EQ(good.out, "data: 3 of 3 frames are whole\n");
  EXPECT_EQ(good.err, "");

  const std::string label = contentOf(folder / "data/labels/000001.json");
  const auto changedLabel = [&](const std::string& from, const std::string& to) {
    std::string text = label;
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  const auto changedManifest = [&](const std::function<void(nlohmann::ordered_json&)>& change) {
    return [=](const fs::path& data) {
      auto manifest = nlohmann::ordered_json::parse(contentOf(data / "manifest.json"));
      change(manifest);
      std::ofstream(data / "manifest.json") << manifest.dump();
    };
  };
  const auto flipped = [](const char* file) {
    return [=](const fs::path& data) {
      std::string bytes = contentOf(data / file);
      bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
      std::ofstream(data / file, std::ios::binary) << bytes;
    };
  };
  const auto labelOf = [](const std::string& text) {
    return [=](const fs::path& data) {
      std::ofstream(data / "labels/000001.json") << text;
      rehash(data);
    };
  };
  const struct {
    std::string says;
    size_t whole, named;
    std::function<void(const fs::path&)> damage;
  } cases[] = {
      {"data/images/000001.png: cannot be read: No such file",
       2,
       3,
       [](const fs::path& data) { fs::remove(data / "images/000001.png"); }},
      {"data/labels/000002.json: cannot be read: No such file",
       2,
       3,
       [](const fs::path& data) { fs::remove(data / "labels/000002.json"); }},
      {"data/images/000000.png: changed, its sha256 is ", 2, 3, flipped("images/000000.png")},
      {"data/labels/000000.json: changed", 2, 3, flipped("labels/000000.json")},
      {"data/planes/depth/000002.npy: changed", 2, 3, flipped("planes/depth/000002.npy")},
      {"data/cameras/wide.yaml: changed", 3, 3, flipped("cameras/wide.yaml")},
      {"data/cameras/wide.yaml: cannot be read",
       3,
       3,
       [](const fs::path& data) { fs::remove(data / "cameras/wide.yaml"); }},
      {"data/images/000001.png: changed",
       2,
       3,
       [](const fs::path& data) { fs::resize_file(data / "images/000001.png", 100); }},
      {"data/labels/000001.json: not valid JSON", 2, 3, labelOf(label.substr(0, 500))},
      {"lines[0].kind", 2, 3, labelOf(changedLabel("\"kind\":\"", "\"kind\":\"x"))},
      {"index = 2 must be 1", 2, 3, labelOf(changedLabel("\"index\":1", "\"index\":2"))},
      {"width and height = 161x120 must be those of the camera",
       2,
       3,
       labelOf(changedLabel("\"width\":160", "\"width\":161"))},
      {"data/manifest.json: names 2 of 3 frames", 2, 2, changedManifest([](auto& m) {
         m["frames"].erase(1);
       })},
      {"frames[1].index = 0", 2, 2, changedManifest([](auto& m) { m["frames"][1]["index"] = 0; })},
      {"must be a path inside the data folder", 2, 3, changedManifest([](auto& m) {
         m["frames"][2]["image"] = "../wide.yaml";
       })},
      {"data/manifest.json: format", 0, 0, changedManifest([](auto& m) {
         m["format"] = "dlsd-dataset/7";
       })},
      {"data/manifest.json: not valid JSON", 0, 0, [](const fs::path& data) {
         fs::resize_file(data / "manifest.json", 300);
       }}};
  fs::copy(folder / "data", folder / "good", fs::copy_options::recursive);
  for (const auto& c : cases) {
    SCOPED_TRACE(c.says);
    fs::remove_all(folder / "data");
    fs::copy(folder / "good", folder / "data", fs::copy_options::recursive);
    c.damage(folder / "data");
    const Result result = dlsd("generate --verify data");
    EXPECT_EQ(result.code, 1);
    EXPECT_THAT(result.out, HasSubstr(c.says));
    EXPECT_THAT(result.out,
                EndsWith("\ndata: " + std::to_string(c.whole) + " of " + std::to_string(c.named) +
                         " frames are whole\n"));
    EXPECT_THAT(result.err, StartsWith("dlsd: data: "));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  expectRefused("generate --verify nowhere", 2, "nowhere");
  expectRefused("generate --verify good --out other", 2, "--verify");
}

TEST_F(GenerateCli, VerifyUnderstandsShards) {
  const auto shard = [&](const std::string& which) {
    const Result result = dlsd(kGenerate + std::string("data --shard ") + which);
    ASSERT_EQ(result.code, 0) << result.err;
  };
  shard("2/4");
  shard("0/4");
  Result result = dlsd("generate --verify data");
  EXPECT_EQ(result.code, 1);
  EXPECT_EQ(result.out,
            "data/manifest.json: missing, shards 1, 3 of 4 not finished or not in this folder\n"
            "data: 6 of 6 frames are whole\n");
  shard("1/4");
  shard("3/4");
  EXPECT_EQ(dlsd("generate --verify data").out, "data: 12 of 12 frames are whole\n");
  fs::remove(folder / "data/manifest.json");
  result = dlsd("generate --verify data");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.out, HasSubstr("run any of them again to join them"));
  shard("1/4");
  EXPECT_EQ(dlsd("generate --verify data").code, 0);
  // A manifest of a shard that says otherwise than manifest.json.
  auto manifest = nlohmann::ordered_json::parse(contentOf(folder / "data/manifest-1-of-4.json"));
  manifest["frames"][0]["image_sha256"] = std::string(64, '0');
  write("data/manifest-1-of-4.json", manifest.dump());
  result = dlsd("generate --verify data");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.out, HasSubstr("is not what another manifest says of this frame"));
}

TEST_F(Cli, CamerasAreNamedAfterAnyFile) {
  write("wide.kalibr.yaml", kWide);
  write("my caf\xc3\xa9.yaml", kWide);
  const Result result = dlsd(
      "generate --camera wide.kalibr.yaml:cam0 --camera 'my caf\xc3\xa9.yaml' --count 1 --out d");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_TRUE(fs::exists(folder / "d/cameras/wide_kalibr-cam0.yaml"));
  EXPECT_TRUE(fs::exists(folder / "d/cameras/my_caf__.yaml"));
  expectRefused(
      "generate --camera wide.kalibr.yaml --camera 'wide kalibr.yaml' --out e", 2, "wide");
}

}  // namespace
