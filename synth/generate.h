#pragma once
// generate: (cameras, scene preset, seed, count) -> a dataset folder.

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "cameras/camera.h"
#include "synth/dataset/image.h"
#include "synth/dataset/records.h"
#include "synth/planes.h"
#include "synth/sensor.h"
#include "synth/variety.h"

namespace dlsd {

struct GenerateOptions {
  /// Name (file stem: letters, digits, '_', '-') and camera. Frame i is seen by camera i mod n.
  std::vector<std::pair<std::string, Camera>> cameras;
  std::string scene = "room";  ///< A preset: one of scenePresets() (scene.h).
  uint64_t seed = 0;
  int count = 1;         ///< Frames, in [1, 10000000].
  std::string out;       ///< Dataset folder; created if absent.
  SceneVariety variety;  ///< On top of the preset.
  SensorOptions sensor;
  std::vector<PlaneKind> planes;  ///< Written besides images and labels; none twice.
  int jobs = 0;                   ///< Threads; 0 = all cores.
  int shard_index = 0;  ///< This run makes the frames i with i mod shard_count == shard_index ...
  int shard_count = 1;  ///< ... and, if > 1, manifest-i-of-n.json in place of manifest.json.

  /// Throws std::invalid_argument naming the field, its value and what is allowed.
  void check() const;
};

struct GenerateProgress {
  int done, total;  ///< Frames of this shard.
};

struct GenerateResult {
  int written, kept;  ///< Frames.
};

/// Writes images/NNNNNN.png, labels/NNNNNN.json, planes/KIND/NNNNNN.npy, cameras/NAME.yaml and,
/// last, the manifest. Every file is written atomically; its bytes depend on the options but not on
/// jobs, shards or earlier runs. Until then journal.txt (of a shard: journal-i-of-n.txt) names the
/// frames that are finished, with their sha256, so that an interrupted or killed run goes on where
/// it was. Frames that a manifest or journal of the same configuration names are verified by sha256
/// and kept; those that are missing or differ are made again. Throws std::invalid_argument
/// (check()), InputError if the folder holds another dataset or an unfinished one of another
/// configuration, SystemError if a file can't be written. on_progress may be empty; it is called by
/// one thread at a time; what it throws ends the run.
GenerateResult generateDataset(const GenerateOptions& options,
                               const std::function<void(const GenerateProgress&)>& on_progress);

/// One frame in memory.
struct Frame {
  LabelRecord labels;
  Image image;                  ///< Grey.
  std::vector<float> radiance;  ///< Linear light after optical blur, before the sensor; row-major.
  std::vector<Plane> planes;    ///< In the order of the options.
};

/// Frame `index` as generateDataset would write it; `out`, `count` and jobs are not looked at.
/// @param change  Applied to the scene before anything is made of it, if not empty.
[[nodiscard]] Frame renderFrame(const GenerateOptions& options,
                                uint64_t index,
                                const std::function<void(Scene*)>& change = {});

}  // namespace dlsd
