#include "cli/command.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include "cameras/calibration/files.h"

namespace dlsd::cli {
namespace {

double now() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

}  // namespace

void print(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw SystemError("standard output: cannot be written: " +
                      std::generic_category().message(errno));
  }
}

void complain(std::string_view sentence) {
  std::string line(sentence);
  std::replace(line.begin(), line.end(), '\n', ' ');
  fmt::print(stderr, "dlsd: {}\n", line);
}

void checkPlaceForFile(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path folder = fs::path(path).parent_path();
  if (folder.empty()) {
    folder = ".";
  }
  if (fs::is_directory(path, error)) {
    throw SystemError(path + ": cannot be written: a folder stands there");
  }
  if (!fs::is_directory(folder, error)) {
    throw SystemError(path + ": cannot be written: the folder " + folder.string() +
                      " does not exist");
  }
}

QuietLibraries::QuietLibraries() : stderr_copy_(::dup(STDERR_FILENO)) {
  if (const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0) {
    ::dup2(nowhere, STDERR_FILENO);
    ::close(nowhere);
  }
}

QuietLibraries::~QuietLibraries() {
  if (stderr_copy_ >= 0) {
    ::dup2(stderr_copy_, STDERR_FILENO);
    ::close(stderr_copy_);
  }
}

Progress::Progress(std::string noun, size_t total)
    : noun_(std::move(noun)),
      total_(total),
      terminal_(::isatty(STDERR_FILENO) == 1),
      start_s_(now()),
      shown_s_(start_s_) {}

Progress::~Progress() {
  if (terminal_) {
    fmt::print(stderr, "\r\033[K");
  }
}

void Progress::done(size_t count) {
  const double t = now();
  if (!terminal_ || count == 0 || t - shown_s_ < 0.1) {
    return;
  }
  shown_s_ = t;
  const double rate = double(count) / (t - start_s_);
  fmt::print(stderr,
             "\r\033[K{}/{} {}, {:.1f} a second, {:.0f} s left",
             count,
             total_,
             noun_,
             rate,
             double(total_ - std::min(total_, count)) / rate);
  std::fflush(stderr);
}

}  // namespace dlsd::cli
