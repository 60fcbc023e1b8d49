#include "evaluation/external_command.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <memory>
#include <system_error>
#include <thread>

#include "cameras/calibration/files.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;

double nowS() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

/// A fresh folder, removed with everything in it.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (fs::temp_directory_path() / "dlsd-command-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) {
      throw SystemError(pattern + ": cannot be made: " + std::generic_category().message(errno));
    }
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

/// The last line that is not blank, shortened; empty if there is none.
std::string lastLine(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    return "";
  }
  std::string text = readFile(path);
  const size_t end = text.find_last_not_of(" \t\r\n");
  if (end == std::string::npos) {
    return "";
  }
  text.resize(end + 1);
  const size_t start = text.find_last_of("\r\n");
  text = start == std::string::npos ? text : text.substr(start + 1);
  constexpr size_t kMax = 200;
  return text.size() <= kMax ? text : text.substr(0, kMax) + "...";
}

/// How a program ended.
struct Ending {
  bool timed_out = false;
  int start_errno = 0;  ///< Of exec, if it could not be started.
  int status = 0;       ///< As waitpid gives it.
};

/// Runs words[0] and waits for it.
Ending runProgram(const std::vector<std::string>& words,
                  const std::string& stderr_path,
                  const CommandOptions& options) {
  std::vector<char*> arguments;
  for (const std::string& word : words) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  const int errors =
      ::open(stderr_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, S_IRUSR | S_IWUSR);
  // The end of this pipe that the child holds closes when it becomes the program; before that it
  // tells why it could not.
  int pipe[2] = {-1, -1};
  const auto closeAll = [&] {
    for (const int fd : {nothing, errors, pipe[0], pipe[1]}) {
      if (fd >= 0) {
        ::close(fd);
      }
    }
  };
  if (nothing < 0 || errors < 0 || ::pipe2(pipe, O_CLOEXEC) != 0) {
    const int error = errno;
    closeAll();
    throw SystemError("cannot run a program: " + std::generic_category().message(error));
  }
  const pid_t child = ::fork();
  if (child < 0) {
    const int error = errno;
    closeAll();
    throw SystemError("cannot run a program: " + std::generic_category().message(error));
  }
  if (child == 0) {  // nothing here but calls that are safe after fork
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(nothing, STDOUT_FILENO);
    ::dup2(errors, STDERR_FILENO);
    ::execvp(arguments[0], arguments.data());
    const int error = errno;
    (void)!::write(pipe[1], &error, sizeof error);
    ::_exit(127);
  }
  ::setpgid(child, child);  // whoever of the two is first
  ::close(pipe[1]);
  pipe[1] = -1;
  Ending ending;
  if (::read(pipe[0], &ending.start_errno, sizeof ending.start_errno) !=
      ssize_t{sizeof ending.start_errno}) {
    ending.start_errno = 0;
  }
  const auto killAll = [&] {
    ::kill(-child, SIGKILL);
    ::waitpid(child, &ending.status, 0);
  };
  const double start_s = nowS();
  while (::waitpid(child, &ending.status, WNOHANG) == 0) {
    const double elapsed_s = nowS() - start_s;
    if (elapsed_s > options.timeout_s) {
      ending.timed_out = true;
      killAll();
      break;
    }
    try {
      if (options.while_running) {
        options.while_running();
      }
    } catch (...) {
      killAll();
      closeAll();
      throw;
    }
    // Its time is measured to 1 %.
    std::this_thread::sleep_for(
        std::chrono::duration<double>(std::clamp(0.01 * elapsed_s, 1e-4, 5e-3)));
  }
  ::kill(-child, SIGKILL);  // what it left running
  closeAll();
  return ending;
}

}  // namespace

std::vector<std::string> splitCommand(const std::string& command) {
  std::vector<std::string> words;
  std::string word;
  bool in_word = false;
  char quote = 0;
  for (const char c : command) {
    if (quote != 0) {
      if (c == quote) {
        quote = 0;
      } else {
        word += c;
      }
    } else if (c == '\'' || c == '"') {
      quote = c;
      in_word = true;
    } else if (c == ' ' || c == '\t' || c == '\n') {
      if (in_word) {
        words.push_back(std::move(word));
        word.clear();
        in_word = false;
      }
    } else {
      word += c;
      in_word = true;
    }
  }
  if (quote != 0) {
    throw InputError(fmt::format("command \"{}\": a {} is not closed", command, quote));
  }
  if (in_word) {
    words.push_back(std::move(word));
  }
  if (words.empty()) {
    throw InputError("the command is empty");
  }
  return words;
}

DetectionSource detectionsOfCommand(const Dataset& dataset,
                                    const CommandOptions& options,
                                    bool timed) {
  const std::vector<std::string> words = splitCommand(options.command);
  for (const char* place : {"{image}", "{out}"}) {
    if (std::none_of(words.begin(), words.end(), [&](const std::string& word) {
          return word.find(place) != std::string::npos;
        })) {
      throw InputError(
          fmt::format("command \"{}\" has no {}, as in \"./mydetector {{image}} {{out}}\"",
                      options.command,
                      place));
    }
  }
  if (!(options.timeout_s > 0 && options.timeout_s <= 1e6)) {
    throw InputError(fmt::format("timeout is {} s, allowed is (0, 1e6]", options.timeout_s));
  }
  return [&dataset, words, options, timed]() -> FrameDetections {
    const auto scratch = std::make_shared<ScratchFolder>();
    return [&dataset, words, options, timed, scratch](size_t, const LabelRecord& labels) {
      const std::string out = *scratch / "out.json";
      const std::string errors = *scratch / "stderr.txt";
      const auto in_data = [&](const std::string& name) {
        return fs::absolute(dataset.folder() + "/" + name).lexically_normal().string();
      };
      const std::pair<const char*, std::string> places[] = {
          {"{image}", in_data(labels.image)}, {"{out}", out}, {"{camera}", in_data(labels.camera)}};
      std::vector<std::string> filled = words;
      for (std::string& word : filled) {
        for (size_t at = 0; at < word.size();) {
          const auto place = std::find_if(std::begin(places), std::end(places), [&](const auto& p) {
            return word.compare(at, std::string_view(p.first).size(), p.first) == 0;
          });
          if (place == std::end(places)) {
            ++at;
            continue;
          }
          word.replace(at, std::string_view(place->first).size(), place->second);
          at += place->second.size();
        }
      }
      std::error_code ignored;
      fs::remove(out, ignored);

      const double start_s = nowS();
      const Ending ending = runProgram(filled, errors, options);
      const double time_ms = 1000 * (nowS() - start_s);
      const auto fail = [&](const std::string& what) {
        throw InputError(
            fmt::format("{}/{}: {} {}", dataset.folder(), labels.image, words[0], what));
      };
      const auto withStderr = [&](std::string what) {
        const std::string said = lastLine(errors);
        return said.empty() ? what : what + ": " + said;
      };
      if (ending.start_errno != 0) {
        fail("cannot be started: " + std::generic_category().message(ending.start_errno));
      }
      if (ending.timed_out) {
        fail(fmt::format("took longer than {:g} s and was killed", options.timeout_s));
      }
      if (WIFSIGNALED(ending.status)) {
        fail(withStderr(fmt::format("was killed by signal {}", WTERMSIG(ending.status))));
      }
      if (WEXITSTATUS(ending.status) != 0) {
        fail(withStderr(fmt::format("ended with code {}", WEXITSTATUS(ending.status))));
      }
      if (!fs::is_regular_file(out, ignored)) {  // a pipe or a device may never end
        fail("ended well, but wrote no file {out}");
      }
      nlohmann::json json;
      try {
        json = nlohmann::json::parse(readFile(out));
      } catch (const nlohmann::json::exception&) {
        fail("wrote something that is not one JSON object to {out}");
      }
      if (json.is_object()) {
        json["image"] = labels.image;
      }
      const std::string source = "output of " + words[0];
      const DetectionRecord record = detectionRecordFromJson(
          json, fmt::format("{} for {}/{}", source, dataset.folder(), labels.image));
      Detections detections = detectionsOf(record, labels, source);
      detections.time_ms = timed ? std::optional(record.time_ms.value_or(time_ms)) : std::nullopt;
      return detections;
    };
  };
}

}  // namespace dlsd
