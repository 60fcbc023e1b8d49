#pragma once
// Files and their errors, for every module that reads or writes one. The command line turns
// InputError and std::invalid_argument into exit code 2, SystemError into 3.

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace dlsd {

/// The user gave something that can't be used: the message is one sentence that names the file,
/// key, value and what is allowed.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The system refused: disk full, no permission.
struct SystemError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Whole content of a file. Throws InputError if it does not exist, is a folder, can't be read or
/// holds more than max_bytes.
[[nodiscard]] std::string readFile(const std::string& path, size_t max_bytes = SIZE_MAX);

/// Writes to a temporary file in the same folder and renames it, so that `path` is either absent,
/// old or complete. Parent folders must exist. Throws SystemError naming the path and the reason.
void writeFileAtomically(const std::string& path, std::string_view content);

/// A file that grows piece by piece beside its place, so that `path` is either absent, old or
/// complete whatever happens before commit(). Devices and pipes are written to at once.
class AtomicFile {
 public:
  /// Parent folders must exist. Throws SystemError naming the path and the reason, as all here.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();  ///< Without commit() nothing of it remains.
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  void append(std::string_view content);
  void commit();

 private:
  [[noreturn]] void refuse(int error) const;

  std::string path_, target_, temporary_;  ///< As given; behind links; empty if there is none.
  int fd_ = -1;
};

/// Creates a folder and its parents. Throws SystemError if that fails (a file stands there, no
/// permission).
void makeFolders(const std::string& path);

}  // namespace dlsd
