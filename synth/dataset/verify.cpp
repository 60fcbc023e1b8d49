#include "synth/dataset/verify.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "cameras/mutant.h"
#include "synth/dataset/dataset.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;

struct Shard {
  int index = 0, count = 1;
  auto operator<=>(const Shard&) const = default;
};

/// Of "manifest.json" or "manifest-i-of-n.json".
std::optional<Shard> shardOfManifest(std::string_view name) {
  if (name == "manifest.json") return Shard{};
  constexpr std::string_view kHead = "manifest-", kMiddle = "-of-", kTail = ".json";
  if (!name.starts_with(kHead) || !name.ends_with(kTail)) return std::nullopt;
  name = name.substr(kHead.size(), name.size() - kHead.size() - kTail.size());
  const size_t middle = name.find(kMiddle);
  if (middle == std::string_view::npos) return std::nullopt;
  const auto number = [](std::string_view text) -> std::optional<int> {
    int value = 0;
    const char* end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, value);
    return read.ec == std::errc() && read.ptr == end ? std::optional(value) : std::nullopt;
  };
  const auto index = number(name.substr(0, middle));
  const auto count = number(name.substr(middle + kMiddle.size()));
  if (!index || !count || *count < 2 || *index < 0 || *index >= *count) return std::nullopt;
  return Shard{*index, *count};
}

/// "shards 1, 2 of 4".
std::string shardList(const std::vector<int>& indices, int count) {
  std::string text = indices.size() == 1 ? "shard " : "shards ";
  for (size_t i = 0; i < indices.size(); ++i) {
    text += (i == 0 ? "" : ", ") + std::to_string(indices[i]);
  }
  return text + " of " + std::to_string(count);
}

class Verifier {
 public:
  Verifier(std::string folder, const std::function<void(size_t, size_t)>& on_frame)
      : folder_(std::move(folder)), on_frame_(on_frame) {}

  DatasetCheck run() {
    std::map<Shard, std::string> manifests;  // manifest.json comes first
    std::set<std::string> journals;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder_, error)) {
      const std::string name = entry.path().filename().string();
      if (const auto shard = shardOfManifest(name)) manifests.emplace(*shard, name);
      if (name.starts_with("journal") && name.ends_with(".txt")) journals.insert(name);
    }
    std::map<int, std::vector<int>> shards;
    for (const auto& [shard, name] : manifests) shards[shard.count].push_back(shard.index);
    if (manifests.empty() && journals.empty()) {
      throw InputError(folder_ + ": not a dataset: manifest.json is missing");
    }
    if (!shards.contains(1)) reportUnfinished(shards, journals);

    std::vector<std::pair<Shard, nlohmann::json>> documents;
    size_t total = 0;
    for (const auto& [shard, name] : manifests) {
      attempt([&, shard = shard, name = name] {
        const std::string path = folder_ + "/" + name;
        nlohmann::json document = parseJson(readFile(path), path);
        total += JsonField(document, path)["frames"].array().size();
        documents.emplace_back(shard, std::move(document));
      });
    }
    for (const auto& [shard, document] : documents) {
      attempt([&, shard = shard, &document = document] {
        checkManifest(shard, document, folder_ + "/" + manifests.at(shard), total);
      });
    }
    check_.named = frames_.size();
    check_.whole =
        size_t(std::count_if(frames_.begin(), frames_.end(), [](auto& f) { return f.second; }));
    return std::move(check_);
  }

 private:
  template <class Function>
  bool attempt(const Function& function) {
    try {
      function();
      return true;
    } catch (const InputError& problem) {
      // A manifest names what another one named already.
      if (told_.insert(problem.what()).second) check_.problems.emplace_back(problem.what());
      return false;
    }
  }

  void reportUnfinished(const std::map<int, std::vector<int>>& shards,
                        const std::set<std::string>& journals) {
    std::string why = "the run is not finished (" +
                      (journals.empty() ? "no journal" : *journals.begin()) +
                      "): the same dlsd generate goes on";
    for (const auto& [count, indices] : shards) {
      std::vector<int> missing;
      for (int i = 0; i < count; ++i) {
        if (std::find(indices.begin(), indices.end(), i) == indices.end()) missing.push_back(i);
      }
      why = missing.empty() ? "all shards are there: run any of them again to join them"
                            : shardList(missing, count) + " not finished or not in this folder";
    }
    check_.unfinished = true;
    check_.problems.push_back(folder_ + "/manifest.json: missing, " + why);
  }

  /// Throws InputError if the file is missing or its sha256 is another one. `content` may be null.
  void checkFile(const std::string& file, const JsonField& sha256, std::string* content) {
    const std::string path = folder_ + "/" + file;
    std::string bytes = readFile(path);
    if (const std::string hash = sha256Hex(bytes);
        hash != sha256.text() && !DLSD_MUTANT("verify-hash")) {
      throw InputError(path + ": changed, its sha256 is " + hash + ", the manifest says " +
                       sha256.text());
    }
    if (content != nullptr) *content = std::move(bytes);
  }

  void checkManifest(const Shard& shard,
                     const nlohmann::json& document,
                     const std::string& path,
                     size_t total) {
    const JsonField manifest(document, path);
    if (const JsonField format = manifest["format"]; format.text() != kDatasetFormat) {
      format.fail("must be \"" + std::string(kDatasetFormat) + "\"");
    }
    checkConfig(shard, manifest, path);
    std::map<std::string, Camera> cameras;
    bool all_cameras = true;
    for (const JsonField& camera : manifest["cameras"].array(1)) {
      const bool good = attempt([&] {
        const std::string file = camera["file"].insidePath();
        checkFile(file, camera["sha256"], nullptr);
        cameras.emplace(file, loadCamera(folder_ + "/" + file));
      });
      all_cameras = all_cameras && good;
    }
    for (const JsonField& frame : manifest["frames"].array()) {
      attempt([&] {
        const uint64_t index = frame["index"].counter();
        // Manifests of shards name frames that manifest.json names too.
        if (const auto known = frames_.find(index); known == frames_.end()) {
          hashes_.emplace(index, frame.raw());
          bool& whole = frames_[index];
          whole = checkFrame(frame, index, all_cameras ? &cameras : nullptr);
        } else if (hashes_.at(index) != frame.raw()) {
          frame.fail("is not what another manifest says of this frame");
        }
      });
      if (on_frame_) on_frame_(++looked_at_, total);
    }
  }

  /// All files of a frame; without `cameras` (some can't be read) labels are not checked with them.
  bool checkFrame(const JsonField& frame,
                  uint64_t index,
                  const std::map<std::string, Camera>* cameras) {
    const std::string image = frame["image"].insidePath();
    const std::string labels = frame["labels"].insidePath();
    bool whole = attempt([&] { checkFile(image, frame["image_sha256"], nullptr); });
    whole &= attempt([&] {
      const std::string path = folder_ + "/" + labels;
      std::string text;
      checkFile(labels, frame["labels_sha256"], &text);
      const LabelRecord record = labelRecordFromJson(parseJson(text, path), path);
      if (record.index != index) {
        throw InputError(path + ": index = " + std::to_string(record.index) + " must be " +
                         std::to_string(index) + ", as the manifest says");
      }
      if (cameras != nullptr) checkRecord(record, path, image, *cameras);
    });
    if (frame.has("planes")) {
      for (const JsonField& plane : frame["planes"].array()) {
        whole &= attempt([&] { checkFile(plane["file"].insidePath(), plane["sha256"], nullptr); });
      }
    }
    return whole;
  }

  /// All manifests are of one configuration, and each names exactly its frames.
  void checkConfig(const Shard& shard, const JsonField& manifest, const std::string& path) {
    const JsonField config = manifest["config"];
    if (!config_) config_ = config.raw();
    if (*config_ != config.raw()) {
      throw InputError(folder_ + ": holds manifests of different configurations");
    }
    if (!config.has("count")) return;  // Of another program: its frames are what it says.
    attempt([&] {
      std::set<uint64_t> indices;
      for (const JsonField& frame : manifest["frames"].array()) {
        const JsonField index = frame["index"];
        if (index.counter() % uint64_t(shard.count) != uint64_t(shard.index) ||
            index.counter() >= config["count"].counter() ||
            !indices.insert(index.counter()).second) {
          index.fail("must be below count, there once, and of this shard");
        }
      }
      const auto count = uint64_t(config["count"].integer(1, 10000000));
      const uint64_t expected =
          (count + uint64_t(shard.count - 1 - shard.index)) / uint64_t(shard.count);
      if (indices.size() != expected) {
        throw InputError(path + ": names " + std::to_string(indices.size()) + " of " +
                         std::to_string(expected) + " frames");
      }
    });
  }

  std::string folder_;
  const std::function<void(size_t, size_t)>& on_frame_;
  DatasetCheck check_;
  std::set<std::string> told_;
  std::map<uint64_t, bool> frames_;  // index -> whole
  std::map<uint64_t, nlohmann::json> hashes_;
  std::optional<nlohmann::json> config_;
  size_t looked_at_ = 0;
};

}  // namespace

DatasetCheck verifyDataset(const std::string& folder,
                           const std::function<void(size_t, size_t)>& on_frame) {
  return Verifier(folder, on_frame).run();
}

}  // namespace dlsd
