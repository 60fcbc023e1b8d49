#pragma once
// The commands of `dlsd`, one file each, and what they share.

#include <signal.h>

#include <CLI/App.hpp>
#include <charconv>
#include <concepts>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "synth/dataset/dataset.h"

namespace dlsd::cli {

/// Exit codes (docs: README "Command line"). Errors become codes in main.cpp, in one place.
enum ExitCode : int { kDone = 0, kCheckFailed = 1, kBadInput = 2, kSystemFailed = 3 };

/// Runs a parsed command and returns its exit code. Throws InputError or std::invalid_argument for
/// bad input, SystemError if the system refuses.
using Run = std::function<int()>;

/// Each adds its options to `command` and returns what runs it.
Run addGenerate(CLI::App& command);
Run addDetect(CLI::App& command);
Run addEvaluate(CLI::App& command);
Run addCamera(CLI::App& command);
Run addExport(CLI::App& command);
Run addReport(CLI::App& command);
Run addReplay(CLI::App& command);

/// Writes to standard output and makes sure it arrived. Throws SystemError if it did not.
void print(std::string_view text);

/// One sentence on standard error: "dlsd: ...". Line breaks inside become spaces, other control
/// characters question marks.
void complain(std::string_view sentence);

/// Text on standard error that is no complaint.
void tell(std::string_view text);

/// From now on nothing that libraries write to standard error arrives there; tell(), complain() and
/// Progress do. Codecs comment on bad files, from any thread, and the user is told once, by us.
void hushLibraries();

/// For an option with a whole number: decimal digits (a minus first where min < 0) in [min, max],
/// nothing else. CLI11 alone reads 0x10, 010 and numbers that are too large.
template <std::integral T>
[[nodiscard]] CLI::Validator wholeNumber(T min, T max) {
  const std::string range = "[" + std::to_string(min) + ", " + std::to_string(max) + "]";
  return {[=](std::string& text) -> std::string {
            T value{};
            const char* end = text.data() + text.size();
            const auto read = std::from_chars(text.data(), end, value);
            if (read.ec != std::errc() || read.ptr != end || value < min || value > max) {
              return "is \"" + text + "\", allowed is a whole number in " + range;
            }
            text = std::to_string(value);  // no leading zeros, which CLI11 takes for octal
            return {};
          },
          "in " + range};
}

/// Whether the text can stand in JSON.
[[nodiscard]] bool isUtf8(const std::string& text);

/// SIGINT or SIGTERM came. main.cpp makes the exit code 128 + signal of it.
struct Interrupted : std::runtime_error {
  Interrupted(const std::string& message, int which) : std::runtime_error(message), signal(which) {}
  int signal;
};

/// While one lives, the first SIGINT or SIGTERM only makes check() throw, so that a command ends
/// where all its files are complete; a second one ends the program at once.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Throws Interrupted if a signal came: "interrupted: <what_now>".
  void check(std::string_view what_now) const;

 private:
  struct sigaction old_int_ {
  }, old_term_{};
};

/// The files that the manifest names, and the manifest.
[[nodiscard]] std::vector<std::string> filesOf(const Dataset& dataset);

/// The file of "file" or "file:camera".
[[nodiscard]] std::string calibrationFile(const std::string& path_and_camera);

/// Throws InputError if one of the outputs is one of the inputs, by whatever path or link, or
/// another output.
void checkOutputs(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// Throws InputError if a file can't be put at `path` since its folder is missing or a folder
/// stands there, SystemError if the system does not let us: asked before long work.
void checkPlaceForFile(const std::string& path);

/// Throws InputError if there can't be a folder at `path` since a file stands there or on the way,
/// SystemError if the system does not let us: asked before long work.
void checkPlaceForFolder(const std::string& path);

/// Progress on standard error with rate and remaining time, on one line that is cleared at the end.
/// Says nothing if standard error is not a terminal. A total of 0 is an unknown one.
class Progress {
 public:
  Progress(std::string noun, size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void done(size_t count);

 private:
  std::string noun_;
  size_t total_;
  bool terminal_;
  double start_s_, shown_s_;
};

}  // namespace dlsd::cli
