#include "synth/generate.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "synth/dataset/dataset.h"
#include "synth/dataset/json_fields.h"
#include "synth/dataset/random.h"
#include "synth/labels.h"
#include "synth/planes.h"
#include "synth/raycaster.h"
#include "synth/render.h"
#include "synth/scene.h"
#include "synth/shading.h"
#include "synth/shadows.h"
#include "synth/tubes.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kMaxCount = 10000000;
constexpr int kMaxJobs = 1024;
constexpr uint64_t kSamplingStream = 0x5a3b;
constexpr std::string_view kVersion = "dlsd " DLSD_VERSION;

[[noreturn]] void refuse(const std::string& field,
                         const std::string& value,
                         const std::string& allowed) {
  throw std::invalid_argument(field + " = " + value + " is out of range: allowed is " + allowed);
}

void requireInt(const char* field, int value, int lo, int hi) {
  if (value >= lo && value <= hi) return;
  std::ostringstream allowed;
  allowed << '[' << lo << ", " << hi << ']';
  refuse(field, std::to_string(value), allowed.str());
}

std::string frameName(uint64_t index) {
  char name[24];
  std::snprintf(name, sizeof name, "%06llu", static_cast<unsigned long long>(index));
  return name;
}
std::string imagePath(uint64_t index) {
  return "images/" + frameName(index) + ".png";
}
std::string labelPath(uint64_t index) {
  return "labels/" + frameName(index) + ".json";
}
std::string planeFolder(PlaneKind kind) {
  return "planes/" + std::string(toString(kind));
}
std::string planePath(PlaneKind kind, uint64_t index) {
  return planeFolder(kind) + "/" + frameName(index) + ".npy";
}
std::string cameraPath(const std::string& name) {
  return "cameras/" + name + ".yaml";
}

/// Ray tables of the cameras used last: a few, so that memory does not grow with their number.
class RayTables {
 public:
  explicit RayTables(const GenerateOptions& options) : options_(options) {}

  std::shared_ptr<const CameraRays> get(size_t camera) {
    {
      const std::lock_guard lock(mutex_);
      for (const Entry& entry : entries_) {
        if (entry.camera == camera) return entry.rays;
      }
    }
    auto rays = std::make_shared<const CameraRays>(options_.cameras[camera].second);
    const std::lock_guard lock(mutex_);
    entries_.push_back({camera, rays});
    if (entries_.size() > kKept) entries_.pop_front();
    return rays;
  }

 private:
  static constexpr size_t kKept = 8;
  struct Entry {
    size_t camera;
    std::shared_ptr<const CameraRays> rays;
  };
  const GenerateOptions& options_;
  std::mutex mutex_;
  std::deque<Entry> entries_;
};

PixelResponse responseOf(const SensorOptions& sensor) {
  return {sensor.psf_sigma_px, sensor.defocus_radius_px};
}

Frame makeFrame(const GenerateOptions& options,
                uint64_t index,
                const CameraRays& rays,
                const PixelResponse& response,
                const std::function<void(Scene*)>& change = {}) {
  const auto& [name, camera] = options.cameras[index % options.cameras.size()];
  SceneView view = makeSceneView(options.scene, options.seed, index);
  addVariety(options.variety, options.seed, index, &view);
  if (change) change(&view.scene);
  const Raycaster raycaster(view.scene);
  addRodSides(view.pose.position_in_world, &view.scene);
  addShadowEdges(raycaster, &view.scene);
  const Shader shader(view.scene, &raycaster);
  const std::vector<EdgeSpan> spans = visibleSpans(view.scene, raycaster, camera, view.pose);
  Labels labels =
      makeLabels(view.scene, raycaster, shader, camera, view.pose, options.sensor, spans);

  Frame frame;
  frame.radiance = renderRadiance(view.scene,
                                  raycaster,
                                  shader,
                                  rays,
                                  view.pose,
                                  spans,
                                  hashCounters({options.seed, index, kSamplingStream}),
                                  response)
                       .radiance;
  frame.image = exposeImage(
      options.sensor, camera.width(), camera.height(), frame.radiance, options.seed, index);
  frame.planes =
      renderPlanes(view.scene, raycaster, camera, view.pose, labels.lines, options.planes);
  LabelRecord& record = frame.labels;
  record.image = imagePath(index);
  record.camera = cameraPath(name);
  record.width = camera.width();
  record.height = camera.height();
  record.seed = options.seed;
  record.index = index;
  record.cam_from_world = view.pose.matrix();
  record.sensor = toJson(options.sensor);
  record.lines = std::move(labels.lines);
  record.junctions = std::move(labels.junctions);
  return frame;
}

ordered_json configJson(const GenerateOptions& options) {
  ordered_json cameras = ordered_json::array();
  for (const auto& [name, camera] : options.cameras) {
    ordered_json params;
    const auto values = camera.params();
    const auto specs = camera.paramSpecs();
    for (size_t i = 0; i < values.size(); ++i) params[std::string(specs[i].name)] = values[i];
    cameras.push_back({{"name", name},
                       {"model", camera.modelName()},
                       {"params", std::move(params)},
                       {"width", camera.width()},
                       {"height", camera.height()},
                       {"max_field_angle", camera.maxFieldAngleLimit()}});
  }
  ordered_json config{{"scene", presetVersion(options.scene)},
                      {"seed", options.seed},
                      {"count", options.count},
                      {"sensor", toJson(options.sensor)},
                      {"cameras", std::move(cameras)}};
  if (options.variety != SceneVariety()) config["variety"] = toJson(options.variety);
  for (const PlaneKind kind : options.planes) config["planes"].push_back(toString(kind));
  return config;
}

struct FrameHashes {
  std::string image, labels;
  std::vector<std::string> planes;  ///< In the order of the options.
};

/// Frames' hashes by frame index, and what makes a manifest of them.
struct Manifest {
  ordered_json config;
  std::vector<PlaneKind> planes;
  std::vector<std::pair<std::string, std::string>> cameras;  ///< File and sha256.
  std::vector<std::pair<uint64_t, FrameHashes>> frames;      ///< By index.

  [[nodiscard]] std::string text() const {
    ordered_json json{{"format", kDatasetFormat}, {"generator", kVersion}, {"config", config}};
    json["cameras"] = ordered_json::array();
    for (const auto& [file, hash] : cameras)
      json["cameras"].push_back({{"file", file}, {"sha256", hash}});
    json["frames"] = ordered_json::array();
    for (const auto& [index, hashes] : frames) {
      json["frames"].push_back({{"index", index},
                                {"image", imagePath(index)},
                                {"image_sha256", hashes.image},
                                {"labels", labelPath(index)},
                                {"labels_sha256", hashes.labels}});
      for (size_t k = 0; k < planes.size(); ++k) {
        json["frames"].back()["planes"].push_back({{"kind", toString(planes[k])},
                                                   {"file", planePath(planes[k], index)},
                                                   {"sha256", hashes.planes[k]}});
      }
    }
    return json.dump(1) + "\n";
  }
};

std::string manifestName(int shard_index, int shard_count) {
  if (shard_count == 1) return "manifest.json";
  return "manifest-" + std::to_string(shard_index) + "-of-" + std::to_string(shard_count) + ".json";
}

/// The first difference between two configurations, for the refusal.
std::string difference(const ordered_json& there, const ordered_json& here) {
  for (const auto& [key, value] : here.items()) {
    if (!there.contains(key)) return "it has no " + key;
    if (there[key] != value) {
      const bool is_short = value.is_primitive();
      return is_short ? key + " is " + there[key].dump() + " there, " + value.dump() + " here"
                      : "another " + key;
    }
  }
  return "another configuration";
}

/// Manifests in the folder; throws InputError if one of them is of another dataset.
std::map<std::string, Manifest> readManifests(const std::string& folder,
                                              const ordered_json& config,
                                              const std::vector<PlaneKind>& planes) {
  std::map<std::string, Manifest> manifests;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("manifest") || !name.ends_with(".json")) continue;
    const std::string path = folder + "/" + name;
    const std::string content = readFile(path);
    const nlohmann::json document = parseJson(content, path);
    const JsonField json(document, path);
    const auto refuseFolder = [&](const std::string& why) {
      throw InputError(folder + " holds another dataset (" + why +
                       "): choose another folder or delete it");
    };
    if (json["format"].text() != kDatasetFormat) refuseFolder("of another format");
    if (json["generator"].text() != kVersion) {
      refuseFolder("made by " + json["generator"].text() + ", this is " + std::string(kVersion));
    }
    const ordered_json there = json["config"].raw();
    // Compared as unordered objects: the order of keys means nothing.
    if (nlohmann::json(there) != nlohmann::json(config)) refuseFolder(difference(there, config));
    Manifest manifest{config, planes, {}, {}};
    for (const JsonField& frame : json["frames"].array()) {
      FrameHashes hashes{frame["image_sha256"].text(), frame["labels_sha256"].text(), {}};
      if (!planes.empty()) {
        for (const JsonField& plane : frame["planes"].array(planes.size(), planes.size())) {
          hashes.planes.push_back(plane["sha256"].text());
        }
      }
      manifest.frames.push_back({frame["index"].counter(), std::move(hashes)});
    }
    manifests.emplace(name, std::move(manifest));
  }
  return manifests;
}

bool fileHas(const std::string& path, const std::string& sha256) {
  std::error_code error;
  return fs::is_regular_file(path, error) && sha256Hex(readFile(path)) == sha256;
}

constexpr std::string_view kJournalFormat = "dlsd-journal/1";

std::string journalName(int shard_index, int shard_count) {
  if (shard_count == 1) return "journal.txt";
  return "journal-" + std::to_string(shard_index) + "-of-" + std::to_string(shard_count) + ".txt";
}

bool isJournal(const std::string& name) {
  return name.starts_with("journal") && name.ends_with(".txt");
}

std::string journalLine(uint64_t index, const FrameHashes& hashes) {
  std::string line = std::to_string(index) + ' ' + hashes.image + ' ' + hashes.labels;
  for (const std::string& plane : hashes.planes) line += ' ' + plane;
  return line + '\n';
}

/// What unfinished runs have made: one line per frame whose files are in place.
class Journal {
 public:
  /// Reads all journals of the folder; throws InputError if one is of another configuration.
  Journal(const std::string& folder,
          const std::string& own_name,
          const ordered_json& config,
          size_t plane_count)
      : plane_count_(plane_count),
        path_(folder + "/" + own_name),
        head_(std::string(kJournalFormat) + ' ' + sha256Hex(std::string(kVersion) + config.dump()) +
              '\n') {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      const std::string name = entry.path().filename().string();
      if (!isJournal(name)) continue;
      std::string text;
      try {
        text = readFile(folder + "/" + name);
      } catch (const InputError&) {
        if (!fs::exists(entry.path(), error)) continue;  // That shard has just finished.
        throw;
      }
      if (!text.starts_with(head_)) {
        throw InputError(folder + " holds an unfinished dataset of another configuration (" + name +
                         "): choose another folder or delete it");
      }
      std::map<uint64_t, FrameHashes> frames = framesIn(text.substr(head_.size()));
      if (name == own_name) own_ = frames;
      known_.merge(frames);
    }
  }

  [[nodiscard]] const std::map<uint64_t, FrameHashes>& known() const { return known_; }

  /// Call when both files of the frame are in place.
  void add(uint64_t index, const FrameHashes& hashes) {
    if (!file_.is_open()) {
      // Written anew from what could be read, so that a torn line does not stay in the middle.
      std::string text = head_;
      for (const auto& [i, h] : own_) text += journalLine(i, h);
      writeFileAtomically(path_, text);
      file_.open(path_, std::ios::binary | std::ios::app);
    }
    file_ << journalLine(index, hashes) << std::flush;
    if (!file_) {
      throw SystemError(path_ + ": cannot be written: " + std::generic_category().message(errno));
    }
  }

  void remove() {
    file_.close();
    std::error_code error;
    fs::remove(path_, error);
  }

 private:
  /// Lines that are complete; the last one may be torn.
  [[nodiscard]] std::map<uint64_t, FrameHashes> framesIn(const std::string& text) const {
    std::map<uint64_t, FrameHashes> frames;
    for (size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos;
         begin = end + 1) {
      std::istringstream line(text.substr(begin, end - begin));
      uint64_t index = 0;
      FrameHashes hashes;
      hashes.planes.resize(plane_count_);
      bool complete = line >> index >> hashes.image >> hashes.labels && hashes.image.size() == 64 &&
                      hashes.labels.size() == 64;
      for (std::string& plane : hashes.planes) {
        complete = complete && line >> plane && plane.size() == 64;
      }
      if (complete) frames[index] = std::move(hashes);
    }
    return frames;
  }

  size_t plane_count_;
  std::string path_, head_;
  std::map<uint64_t, FrameHashes> known_, own_;
  std::ofstream file_;
};

/// The folders of the frames' files.
std::vector<std::string> frameFolders(const GenerateOptions& options) {
  std::vector<std::string> folders{"images", "labels"};
  for (const PlaneKind kind : options.planes) folders.push_back(planeFolder(kind));
  return folders;
}

/// Removes the temporary files that killed runs left in a folder of files with such names.
template <typename IsOurs>
void removeTemporaryFiles(const fs::path& folder, const IsOurs& is_ours) {
  std::error_code error;
  std::vector<fs::path> leftovers;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const size_t end = name.find(".tmp-");
    if (end != std::string::npos && is_ours(name.substr(0, end))) leftovers.push_back(entry.path());
  }
  for (const fs::path& path : leftovers) fs::remove(path, error);
}

/// Of this shard only: others may be running.
void removeTemporaryFilesOfShard(const GenerateOptions& options) {
  for (const std::string& folder : frameFolders(options)) {
    removeTemporaryFiles(fs::path(options.out) / folder, [&](const std::string& name) {
      const size_t digits = name.find_first_not_of("0123456789");
      return digits > 0 && digits <= 9 &&
             std::stoi(name.substr(0, digits)) % options.shard_count == options.shard_index;
    });
  }
  removeTemporaryFiles(options.out, [&](const std::string& name) {
    return name == manifestName(options.shard_index, options.shard_count) ||
           name == journalName(options.shard_index, options.shard_count);
  });
}

/// The dataset is complete: no journal is needed any more, whoever wrote it, nor does any run
/// write a camera's file.
void removeLeftovers(const std::string& folder) {
  std::error_code error;
  std::vector<fs::path> journals;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (isJournal(entry.path().filename().string())) journals.push_back(entry.path());
  }
  for (const fs::path& path : journals) fs::remove(path, error);
  removeTemporaryFiles(folder, isJournal);
  removeTemporaryFiles(fs::path(folder) / "cameras", [](const std::string&) { return true; });
}

}  // namespace

void GenerateOptions::check() const {
  if (cameras.empty()) throw std::invalid_argument("cameras: at least one is needed");
  std::set<std::string> names;
  for (const auto& [name, camera] : cameras) {
    const bool ok = !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
             c == '_' || c == '-';
    });
    if (!ok) refuse("camera name", "\"" + name + "\"", "letters, digits, '_' and '-'");
    if (!names.insert(name).second) {
      throw std::invalid_argument("camera name = \"" + name + "\" is given twice");
    }
  }
  (void)presetVersion(scene);  // Throws for an unknown one.
  requireInt("count", count, 1, kMaxCount);
  requireInt("jobs", jobs, 0, kMaxJobs);
  requireInt("shard_count", shard_count, 1, kMaxCount);
  requireInt("shard_index", shard_index, 0, shard_count - 1);
  variety.check();
  sensor.check();
  for (size_t k = 0; k < planes.size(); ++k) {
    if (std::count(planes.begin(), planes.end(), planes[k]) > 1) {
      throw std::invalid_argument("planes: \"" + std::string(toString(planes[k])) +
                                  "\" is given twice");
    }
  }
}

Frame renderFrame(const GenerateOptions& options,
                  uint64_t index,
                  const std::function<void(Scene*)>& change) {
  options.check();
  const CameraRays rays(options.cameras[index % options.cameras.size()].second);
  return makeFrame(options, index, rays, responseOf(options.sensor), change);
}

GenerateResult generateDataset(const GenerateOptions& options,
                               const std::function<void(const GenerateProgress&)>& on_progress) {
  options.check();
  if (options.out.empty()) throw std::invalid_argument("out: a folder is needed");
  const ordered_json config = configJson(options);
  const std::string own_name = manifestName(options.shard_index, options.shard_count);
  std::map<std::string, Manifest> earlier = readManifests(options.out, config, options.planes);
  Journal journal(options.out,
                  journalName(options.shard_index, options.shard_count),
                  config,
                  options.planes.size());

  Manifest manifest{config, options.planes, {}, {}};
  makeFolders(options.out + "/cameras");
  for (const std::string& folder : frameFolders(options)) makeFolders(options.out + "/" + folder);
  removeTemporaryFilesOfShard(options);
  for (const auto& [name, camera] : options.cameras) {
    const std::string text = kalibrYaml({{"cam0", camera}});
    const std::string path = options.out + "/" + cameraPath(name);
    const std::string hash = sha256Hex(text);
    if (!fileHas(path, hash)) writeFileAtomically(path, text);
    manifest.cameras.emplace_back(cameraPath(name), hash);
  }
  for (int i = options.shard_index; i < options.count; i += options.shard_count) {
    manifest.frames.push_back({static_cast<uint64_t>(i), {}});
  }
  std::map<uint64_t, FrameHashes> known = journal.known();
  for (const auto& [name, old] : earlier) known.insert(old.frames.begin(), old.frames.end());

  RayTables tables(options);
  const PixelResponse response = responseOf(options.sensor);
  std::mutex mutex;
  GenerateProgress progress{0, static_cast<int>(manifest.frames.size())};
  GenerateResult result{0, 0};
  const auto doFrame = [&](std::pair<uint64_t, FrameHashes>* entry) {
    auto& [index, hashes] = *entry;
    const std::string image_path = options.out + "/" + imagePath(index);
    const std::string label_path = options.out + "/" + labelPath(index);
    const auto old = known.find(index);
    bool keep = old != known.end() && fileHas(image_path, old->second.image) &&
                fileHas(label_path, old->second.labels);
    for (size_t k = 0; keep && k < options.planes.size(); ++k) {
      keep =
          fileHas(options.out + "/" + planePath(options.planes[k], index), old->second.planes[k]);
    }
    if (keep) {
      hashes = old->second;
    } else {
      const auto rays = tables.get(index % options.cameras.size());
      const Frame frame = makeFrame(options, index, *rays, response);
      const std::string png = encodePng(frame.image);
      const std::string labels = toJson(frame.labels).dump() + "\n";
      writeFileAtomically(image_path, png);
      writeFileAtomically(label_path, labels);
      hashes = {sha256Hex(png), sha256Hex(labels), {}};
      for (const Plane& plane : frame.planes) {
        const std::string npy = encodeNpy(plane);
        writeFileAtomically(options.out + "/" + planePath(plane.kind, index), npy);
        hashes.planes.push_back(sha256Hex(npy));
      }
    }
    const std::lock_guard lock(mutex);
    if (!keep) journal.add(index, hashes);
    ++(keep ? result.kept : result.written);
    ++progress.done;
    if (on_progress) on_progress(progress);
  };
  tbb::task_arena arena(options.jobs == 0 ? tbb::task_arena::automatic : options.jobs);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, manifest.frames.size(), 1),
        [&](const tbb::blocked_range<size_t>& range) {
          for (size_t k = range.begin(); k < range.end(); ++k) doFrame(&manifest.frames[k]);
        },
        tbb::simple_partitioner());
  });

  const std::string own_text = manifest.text();
  const std::string own_path = options.out + "/" + own_name;
  if (!fileHas(own_path, sha256Hex(own_text))) writeFileAtomically(own_path, own_text);
  journal.remove();
  if (options.shard_count == 1) {
    removeLeftovers(options.out);
    return result;
  }

  // The last shard to finish finds all manifests and merges them; the bytes are those of one run.
  earlier = readManifests(options.out, config, options.planes);
  Manifest merged{config, options.planes, manifest.cameras, {}};
  for (int i = 0; i < options.shard_count; ++i) {
    const auto it = earlier.find(manifestName(i, options.shard_count));
    if (it == earlier.end()) return result;
    merged.frames.insert(merged.frames.end(), it->second.frames.begin(), it->second.frames.end());
  }
  std::sort(merged.frames.begin(), merged.frames.end(), [](const auto& a, const auto& b) {
    return a.first < b.first;
  });
  writeFileAtomically(options.out + "/manifest.json", merged.text());
  removeLeftovers(options.out);
  return result;
}

}  // namespace dlsd
