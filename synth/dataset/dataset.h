#pragma once
// A dataset folder: images/NNNNNN.png, labels/NNNNNN.json, cameras/NAME.yaml, manifest.json.

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "cameras/camera.h"
#include "synth/dataset/image.h"
#include "synth/dataset/records.h"

namespace dlsd {

/// "format" of manifest.json.
inline constexpr std::string_view kDatasetFormat = "dlsd-dataset/1";

/// Read access to a finished dataset folder. Frames are loaded one at a time.
class Dataset {
 public:
  /// Reads manifest.json and the cameras. Throws InputError if the folder is not a dataset or a
  /// file named in the manifest is missing.
  explicit Dataset(const std::string& folder);

  [[nodiscard]] const std::string& folder() const { return folder_; }
  [[nodiscard]] size_t size() const { return label_paths_.size(); }
  [[nodiscard]] const nlohmann::ordered_json& manifest() const { return manifest_; }

  /// Labels of frame i, in manifest order. Throws InputError if the record is of another image than
  /// the manifest says, or does not fit its camera.
  [[nodiscard]] LabelRecord labels(size_t i) const;
  /// Camera of a record (record.camera names it).
  [[nodiscard]] const Camera& camera(const LabelRecord& record) const;
  /// Image of a record.
  [[nodiscard]] Image image(const LabelRecord& record) const;

 private:
  std::string folder_;
  nlohmann::ordered_json manifest_;
  std::vector<std::string> label_paths_, image_paths_;
  std::map<std::string, Camera> cameras_;
};

/// Throws InputError if a record, read from `path`, is of another image than the manifest says or
/// does not fit its camera, or its camera is not among `cameras` (by file).
void checkRecord(const LabelRecord& record,
                 const std::string& path,
                 const std::string& image,
                 const std::map<std::string, Camera>& cameras);

/// sha256 of bytes, as 64 lower-case hexadecimal digits.
[[nodiscard]] std::string sha256Hex(std::string_view bytes);

}  // namespace dlsd
