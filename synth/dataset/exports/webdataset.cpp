// WebDataset: tar shards of <number>.png, .json and planes. The members of a frame are adjacent,
// every frame has the same suffixes.

#include <archive.h>
#include <archive_entry.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "cameras/calibration/files.h"
#include "synth/dataset/exports/exporter.h"

namespace dlsd {
namespace {

using nlohmann::ordered_json;

/// One tar file that grows on disk.
class TarFile {
 public:
  explicit TarFile(const std::string& path) : path_(path), handle_(archive_write_new()) {
    require(archive_write_set_format_ustar(handle_));
    require(archive_write_open_filename(handle_, path.c_str()));
  }
  ~TarFile() { archive_write_free(handle_); }
  TarFile(const TarFile&) = delete;
  TarFile& operator=(const TarFile&) = delete;

  void add(const std::string& name, const std::string& content) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name.c_str());
    archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_mtime(entry, 0, 0);  // The same bytes whenever they are made.
    const int status = archive_write_header(handle_, entry);
    archive_entry_free(entry);
    require(status);
    if (archive_write_data(handle_, content.data(), content.size()) < 0) require(ARCHIVE_FATAL);
    bytes_ += content.size() + 1024;
  }
  [[nodiscard]] size_t bytes() const { return bytes_; }
  void close() { require(archive_write_close(handle_)); }

 private:
  void require(int status) const {
    if (status == ARCHIVE_OK) return;
    const int error = archive_errno(handle_);
    throw SystemError(
        path_ + ": cannot be written: " +
        (error > 0 ? std::generic_category().message(error) : archive_error_string(handle_)));
  }

  std::string path_;
  archive* handle_;
  size_t bytes_ = 0;
};

ordered_json calibrationOf(const Camera& camera) {
  ordered_json params;
  const auto values = camera.params();
  const auto specs = camera.paramSpecs();
  for (size_t i = 0; i < values.size(); ++i) params[std::string(specs[i].name)] = values[i];
  return {{"model", camera.modelName()},
          {"params", std::move(params)},
          {"max_field_angle", camera.maxFieldAngleLimit()}};
}

class WebDatasetExporter : public Exporter {
 public:
  WebDatasetExporter(const std::string& out, const ExportOptions& options)
      : out_(out), shard_bytes_(options.shard_bytes) {}

  bool add(const ExportFrame& frame) override {
    Shards& shards = shards_[static_cast<size_t>(frame.split)];
    if (shards.tar && shards.tar->bytes() >= shard_bytes_) closeShard(&shards);
    if (!shards.tar) {
      char number[24];
      std::snprintf(number, sizeof number, "-%06zu", shards.count++);
      shards.tar = std::make_unique<TarFile>(out_ + "/" + kNames[static_cast<size_t>(frame.split)] +
                                             number + ".tar");
    }
    ordered_json json = toJson(frame.record);
    json["calibration"] = calibrationOf(*frame.camera);
    shards.tar->add(frame.name + ".json", json.dump());
    shards.tar->add(frame.name + ".png", pngOf(frame));
    for (const auto& [kind, path] : frame.planes) {
      shards.tar->add(frame.name + "." + kind + ".npy", readFile(path));
    }
    return true;
  }

  void finish() override {
    for (Shards& shards : shards_) closeShard(&shards);
  }

  [[nodiscard]] std::vector<std::string> notes() const override {
    std::vector<std::string> notes;
    for (size_t k = 0; k < kNames.size(); ++k) {
      if (shards_[k].count == 0) continue;
      char range[40];
      std::snprintf(range, sizeof range, "-{000000..%06zu}.tar", shards_[k].count - 1);
      notes.push_back(std::string("url: ") + kNames[k] + range);
    }
    return notes;
  }

 private:
  static constexpr std::array<const char*, 3> kNames{"train", "val", "test"};
  struct Shards {
    size_t count = 0;
    std::unique_ptr<TarFile> tar;
  };

  static void closeShard(Shards* shards) {
    if (shards->tar) shards->tar->close();
    shards->tar.reset();
  }

  std::string out_;
  size_t shard_bytes_;
  std::array<Shards, 3> shards_;
};

}  // namespace

std::unique_ptr<Exporter> makeWebDatasetExporter(const std::string& out,
                                                 const ExportOptions& options) {
  return std::make_unique<WebDatasetExporter>(out, options);
}

}  // namespace dlsd
