#pragma once
// Is a dataset folder whole? The files against what the manifests say.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace dlsd {

struct DatasetCheck {
  size_t whole = 0;         ///< Frames of which every file is there, unchanged and readable.
  size_t named = 0;         ///< Frames that the manifests name.
  bool unfinished = false;  ///< manifest.json is missing.
  /// One sentence each, in the order of the manifests: file first, what is wrong with it.
  std::vector<std::string> problems;
};

/// Checks that manifest.json is there and names every frame of its configuration, that every file
/// it names is there with the sha256 it says, and that cameras and labels can be read and fit each
/// other. Manifests of shards are checked in the same way; where manifest.json is missing, the
/// result says which shards, too. Reads every file once, one at a time.
/// Throws InputError if the folder holds neither manifest nor journal. `on_frame` may be empty; it
/// is called with the number of frames looked at and of all; what it throws ends the check.
[[nodiscard]] DatasetCheck verifyDataset(const std::string& folder,
                                         const std::function<void(size_t, size_t)>& on_frame);

}  // namespace dlsd
