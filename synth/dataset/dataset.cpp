#include "synth/dataset/dataset.h"

#include <openssl/evp.h>

#include <filesystem>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {

Dataset::Dataset(const std::string& folder) : folder_(folder) {
  namespace fs = std::filesystem;
  const std::string path = folder + "/manifest.json";
  if (!fs::exists(path)) {
    throw InputError(folder + ": not a finished dataset: manifest.json is missing");
  }
  const nlohmann::json document = parseJson(readFile(path), path);
  const JsonField manifest(document, path);
  const JsonField format = manifest["format"];
  if (format.text() != kDatasetFormat)
    format.fail("must be \"" + std::string(kDatasetFormat) + "\"");
  for (const JsonField& camera : manifest["cameras"].array(1)) {
    const std::string name = camera["file"].insidePath();
    cameras_.emplace(name, loadCamera(folder + "/" + name));
  }
  for (const JsonField& frame : manifest["frames"].array()) {
    for (const char* key : {"image", "labels"}) {
      const std::string file = frame[key].insidePath();
      if (!fs::exists(folder + "/" + file)) {
        throw InputError(folder + ": " + file + " is named in the manifest, but missing");
      }
    }
    label_paths_.push_back(frame["labels"].text());
    image_paths_.push_back(frame["image"].text());
  }
  manifest_ = nlohmann::ordered_json::parse(readFile(path));
}

LabelRecord Dataset::labels(size_t i) const {
  const std::string path = folder_ + "/" + label_paths_.at(i);
  LabelRecord record = labelRecordFromJson(parseJson(readFile(path), path), path);
  checkRecord(record, path, image_paths_.at(i), cameras_);
  return record;
}

void checkRecord(const LabelRecord& record,
                 const std::string& path,
                 const std::string& image,
                 const std::map<std::string, Camera>& cameras) {
  const auto it = cameras.find(record.camera);
  if (it == cameras.end()) {
    throw InputError(path + ": camera = \"" + record.camera + "\" is not in the manifest");
  }
  if (record.image != image) {
    throw InputError(path + ": image = \"" + record.image + "\" must be \"" + image +
                     "\", as the manifest says");
  }
  const Camera& cam = it->second;
  if (record.width != cam.width() || record.height != cam.height()) {
    throw InputError(path + ": width and height = " + std::to_string(record.width) + "x" +
                     std::to_string(record.height) + " must be those of the camera, " +
                     std::to_string(cam.width()) + "x" + std::to_string(cam.height()));
  }
}

const Camera& Dataset::camera(const LabelRecord& record) const {
  const auto it = cameras_.find(record.camera);
  if (it == cameras_.end()) {
    throw InputError(folder_ + ": camera \"" + record.camera + "\" is not in the manifest");
  }
  return it->second;
}

Image Dataset::image(const LabelRecord& record) const {
  const std::string path = folder_ + "/" + record.image;
  Image image = readImage(path);
  if (image.width != record.width || image.height != record.height) {
    throw InputError(path + ": is " + std::to_string(image.width) + "x" +
                     std::to_string(image.height) + " px, its label record says " +
                     std::to_string(record.width) + "x" + std::to_string(record.height));
  }
  return image;
}

std::string sha256Hex(std::string_view bytes) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest, &length, EVP_sha256(), nullptr) != 1) {
    throw SystemError("sha256 is not available");
  }
  std::string hex;
  for (unsigned int i = 0; i < length; ++i) {
    constexpr char kDigits[] = "0123456789abcdef";
    hex += kDigits[digest[i] >> 4];
    hex += kDigits[digest[i] & 15];
  }
  return hex;
}

}  // namespace dlsd
