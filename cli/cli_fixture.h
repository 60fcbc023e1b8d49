#pragma once
// The program in a folder of its own, for the tests of its commands.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace dlsd::cli::test {

namespace fs = std::filesystem;

inline std::string contentOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

struct Result {
  int code = -1;
  std::string out, err;
};

struct Cli : ::testing::Test {
  fs::path folder = fs::temp_directory_path() / ("dlsd-cli-test-" + std::to_string(::getpid()));

  void SetUp() override {
    fs::remove_all(folder);
    fs::create_directories(folder);
    write("wide.yaml", kWide);
  }
  void TearDown() override { fs::remove_all(folder); }

  /// A FoV camera of 160 x 120 px: all commands together take a fraction of a second.
  static constexpr const char* kWide =
      "cam0:\n"
      "  camera_model: pinhole\n"
      "  distortion_model: fov\n"
      "  intrinsics: [56.0, 56.0, 79.5, 59.5]\n"
      "  distortion_coeffs: [0.93]\n"
      "  resolution: [160, 120]\n";

  void write(const std::string& name, const std::string& content) const {
    std::ofstream(folder / name, std::ios::binary) << content;
  }

  /// Runs dlsd in the folder, `arguments` as typed into a shell.
  [[nodiscard]] Result dlsd(const std::string& arguments) const {
    return shell("'" DLSD_BINARY "' " + arguments);
  }

  /// Runs a program in the folder, as typed into a shell.
  [[nodiscard]] Result shell(const std::string& typed) const {
    const fs::path out = folder / ".stdout";
    const fs::path err = folder / ".stderr";
    const std::string command =
        "cd '" + folder.string() + "' && " + typed + " >.stdout 2>.stderr </dev/null";
    const int status = std::system(command.c_str());
    Result result{WIFEXITED(status) ? WEXITSTATUS(status) : -1, contentOf(out), contentOf(err)};
    fs::remove(out);
    fs::remove(err);
    return result;
  }

  /// Everything in the folder, sorted.
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      names.push_back(entry.path().lexically_relative(folder).generic_string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  /// The command fails with one sentence that holds `part`, prints nothing and leaves nothing
  /// behind.
  void expectRefused(const std::string& arguments, int code, const std::string& part) const {
    SCOPED_TRACE("dlsd " + arguments);
    const auto before = files();
    const Result result = dlsd(arguments);
    EXPECT_EQ(result.code, code);
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, ::testing::StartsWith("dlsd: "));
    EXPECT_THAT(result.err, ::testing::EndsWith("\n"));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.err, ::testing::HasSubstr(part));
    EXPECT_EQ(files(), before);
  }

  void generate(const std::string& more = "") const {
    const Result result = dlsd("generate --camera wide.yaml --count 2 --seed 3 --out data " + more);
    ASSERT_EQ(result.code, 0) << result.err;
  }
};

}  // namespace dlsd::cli::test
