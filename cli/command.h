#pragma once
// The commands of `dlsd`, one file each, and what they share.

#include <CLI/App.hpp>
#include <functional>
#include <string>
#include <string_view>

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
Run addReport(CLI::App& command);
Run addReplay(CLI::App& command);

/// Writes to standard output and makes sure it arrived. Throws SystemError if it did not.
void print(std::string_view text);

/// One sentence on standard error: "dlsd: ...". Line breaks inside become spaces.
void complain(std::string_view sentence);

/// Throws SystemError if a file can't be put at `path` since its folder is missing or a folder
/// stands there: asked before long work.
void checkPlaceForFile(const std::string& path);

/// While it lives, nothing that libraries say reaches standard error: codecs comment on bad files
/// there, and the user is told once, by us. For one thread at a time.
class QuietLibraries {
 public:
  QuietLibraries();
  ~QuietLibraries();
  QuietLibraries(const QuietLibraries&) = delete;
  QuietLibraries& operator=(const QuietLibraries&) = delete;

 private:
  int stderr_copy_;
};

/// Progress on standard error with rate and remaining time, on one line that is cleared at the end.
/// Says nothing if standard error is not a terminal.
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
