#include "cameras/calibration/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace dlsd {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) {
  return std::generic_category().message(error);
}

/// Closes on scope exit; release() hands the closing (and its error) to the caller.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] int release() {
    const int fd = fd_;
    fd_ = -1;
    return fd;
  }

 private:
  int fd_;
};

/// 0, or the errno of what failed.
int writeAllAndClose(FileDescriptor& file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t n = ::write(file.get(), content.data(), content.size());
    if (n < 0) {
      if (errno == EINTR) continue;
      return errno;
    }
    content.remove_prefix(static_cast<size_t>(n));
  }
  return ::close(file.release()) == 0 ? 0 : errno;
}

}  // namespace

std::string readFile(const std::string& path, size_t max_bytes) {
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) throw InputError(path + ": cannot be read: " + reason(errno));
  std::string content;
  struct stat status {};
  if (::fstat(file.get(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) throw InputError(path + ": is a folder, a file is expected");
    if (status.st_size > 0)
      content.reserve(std::min(static_cast<size_t>(status.st_size), max_bytes));
  }
  char buffer[1 << 16];
  for (;;) {
    const ssize_t n = ::read(file.get(), buffer, sizeof buffer);
    if (n < 0) {
      if (errno == EINTR) continue;
      throw InputError(path + ": cannot be read: " + reason(errno));
    }
    if (n == 0) return content;
    content.append(buffer, static_cast<size_t>(n));
    if (content.size() > max_bytes) {
      throw InputError(path + ": is larger than " + std::to_string(max_bytes) +
                       " bytes, which no file of its kind is");
    }
  }
}

void writeFileAtomically(const std::string& path, std::string_view content) {
  const auto refuse = [&](int error) {
    throw SystemError(path + ": cannot be written: " + reason(error));
  };
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (fs::is_directory(status)) refuse(EISDIR);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    // A device or pipe must be written to, never replaced by a file.
    FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (file.get() < 0) refuse(errno);
    if (const int error = writeAllAndClose(file, content)) refuse(error);
    return;
  }
  // A link stays a link: the file it points to is replaced.
  std::string target = path;
  if (fs::is_symlink(fs::symlink_status(path, ignored)) && fs::exists(status)) {
    target = fs::canonical(path, ignored).string();
  }

  static std::atomic<unsigned> counter{0};
  std::string temporary;
  int fd = -1;
  do {
    temporary =
        target + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(counter.fetch_add(1));
    fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (fd < 0 && errno == EEXIST);
  if (fd < 0) refuse(errno);
  FileDescriptor file(fd);
  int error = writeAllAndClose(file, content);
  if (error == 0 && std::rename(temporary.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    refuse(error);
  }
}

void makeFolders(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (!error && !fs::is_directory(path, error) && !error) {
    error = std::make_error_code(std::errc::not_a_directory);
  }
  if (error) throw SystemError(path + ": the folder cannot be made: " + error.message());
}

}  // namespace dlsd
