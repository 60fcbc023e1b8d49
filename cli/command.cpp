#include "cli/command.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "cameras/calibration/files.h"

// Only in builds with sanitizers, whose reports must not be hushed.
extern "C" __attribute__((weak)) void __sanitizer_set_report_fd(void* fd);

namespace dlsd::cli {
namespace {

/// Where our own words go; what libraries say goes to `stderr`.
FILE* our_stderr = stderr;

double now() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

volatile sig_atomic_t signal_that_came = 0;

extern "C" void rememberSignal(int signal) {
  signal_that_came = signal;
}

/// What a path leads to: the file if there is one, else the place. Empty for devices and pipes,
/// which nothing replaces.
std::string identityOf(const std::string& path) {
  namespace fs = std::filesystem;
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) {
    return S_ISREG(status.st_mode) ? fmt::format("{}:{}", status.st_dev, status.st_ino) : "";
  }
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  const fs::path place = fs::weakly_canonical(absolute, error);
  return (error ? absolute.lexically_normal() : place).string();
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
  // Names of files and words of other programs may hold what a terminal obeys.
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
  tell("dlsd: " + line + "\n");
}

void tell(std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), our_stderr);
  std::fflush(our_stderr);
}

void hushLibraries() {
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  const int copy = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  FILE* const stream = nowhere >= 0 && copy >= 0 ? ::fdopen(copy, "w") : nullptr;
  if (stream != nullptr && ::dup2(nowhere, STDERR_FILENO) >= 0) {
    our_stderr = stream;
    if (__sanitizer_set_report_fd != nullptr) {
      // NOLINTNEXTLINE(performance-no-int-to-ptr): that interface takes the number as a pointer.
      __sanitizer_set_report_fd(reinterpret_cast<void*>(static_cast<intptr_t>(copy)));
    }
  }
  if (nowhere > STDERR_FILENO) {
    ::close(nowhere);
  }
}

Interruption::Interruption() {
  signal_that_came = 0;
  struct sigaction action {};
  action.sa_handler = rememberSignal;
  action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &action, &old_int_);
  ::sigaction(SIGTERM, &action, &old_term_);
  // What nohup or a shell's background told to be ignored stays so.
  if (old_int_.sa_handler == SIG_IGN) ::sigaction(SIGINT, &old_int_, nullptr);
  if (old_term_.sa_handler == SIG_IGN) ::sigaction(SIGTERM, &old_term_, nullptr);
}

Interruption::~Interruption() {
  ::sigaction(SIGINT, &old_int_, nullptr);
  ::sigaction(SIGTERM, &old_term_, nullptr);
}

void Interruption::check(std::string_view what_now) const {
  if (const int signal = signal_that_came; signal != 0) {
    throw Interrupted(fmt::format("interrupted: {}", what_now), signal);
  }
}

bool isUtf8(const std::string& text) {
  try {
    (void)nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::type_error&) {
    return false;
  }
}

std::vector<std::string> filesOf(const Dataset& dataset) {
  std::vector<std::string> files{dataset.folder() + "/manifest.json"};
  const auto add = [&](const nlohmann::ordered_json& name) {
    files.push_back(dataset.folder() + "/" + name.get<std::string>());
  };
  for (const auto& camera : dataset.manifest().at("cameras")) {
    add(camera.at("file"));
  }
  for (const auto& frame : dataset.manifest().at("frames")) {
    add(frame.at("image"));
    add(frame.at("labels"));
  }
  return files;
}

std::string calibrationFile(const std::string& path_and_camera) {
  std::error_code ignored;
  return std::filesystem::exists(path_and_camera, ignored)
             ? path_and_camera
             : path_and_camera.substr(0, path_and_camera.rfind(':'));
}

void checkOutputs(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs) {
  std::map<std::string, std::string> taken;  // what a path leads to -> why nothing may go there
  for (const std::string& input : inputs) {
    taken.emplace(identityOf(input), "is the input " + input);
  }
  taken.erase("");
  for (const std::string& output : outputs) {
    const std::string identity = identityOf(output);
    if (identity.empty()) {
      continue;
    }
    const auto [it, is_new] = taken.emplace(identity, "is where " + output + " is to be written");
    if (!is_new) {
      throw InputError(output + ": will not be overwritten, it " + it->second);
    }
  }
}

void checkPlaceForFile(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path folder = fs::path(path).parent_path();
  if (folder.empty()) {
    folder = ".";
  }
  if (fs::is_directory(path, error)) {
    throw InputError(path + ": cannot be written: a folder stands there");
  }
  if (!fs::is_directory(folder, error)) {
    throw InputError(path + ": cannot be written: the folder " + folder.string() +
                     " does not exist");
  }
  const AtomicFile can_be_made(path);  // And is gone again.
}

void checkPlaceForFolder(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path at = fs::absolute(path);
  while (!fs::exists(at, error) && at.has_relative_path()) {
    at = at.parent_path();
  }
  if (!fs::is_directory(at, error)) {
    throw InputError(fmt::format("{}: {} is no folder", path, at.string()));
  }
  if (::access(at.c_str(), W_OK) != 0) {
    throw SystemError(fmt::format(
        "{}: cannot write in {}: {}", path, at.string(), std::generic_category().message(errno)));
  }
}

Progress::Progress(std::string noun, size_t total)
    : noun_(std::move(noun)),
      total_(total),
      terminal_(::isatty(::fileno(our_stderr)) == 1),
      start_s_(now()),
      shown_s_(start_s_) {}

Progress::~Progress() {
  if (terminal_) {
    tell("\r\033[K");
  }
}

void Progress::done(size_t count) {
  const double t = now();
  if (!terminal_ || count == 0 || t - shown_s_ < 0.1) {
    return;
  }
  shown_s_ = t;
  const double rate = double(count) / (t - start_s_);
  if (total_ == 0) {
    tell(fmt::format("\r\033[K{} {}, {:.1f} a second", count, noun_, rate));
    return;
  }
  tell(fmt::format("\r\033[K{}/{} {}, {:.1f} a second, {:.0f} s left",
                   count,
                   total_,
                   noun_,
                   rate,
                   double(total_ - std::min(total_, count)) / rate));
}

}  // namespace dlsd::cli
