#pragma once
// A dataset in the forms that other programs' loaders read: docs/dataset-format.md, "Exports".

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "synth/dataset/dataset.h"

namespace dlsd {

enum class ExportFormat { kUlsd, kLcnn, kCocoLine, kDeepLsd, kWebDataset };

struct ExportFormatInfo {
  ExportFormat format;
  std::string_view name;   ///< As in --format.
  std::string_view about;  ///< One line: who reads it.
};

/// All formats.
[[nodiscard]] std::span<const ExportFormatInfo> exportFormats();

enum class Split { kTrain, kVal, kTest };

/// Which part the i-th frame of a dataset belongs to: frac(i / golden ratio) in [0, 1) against the
/// shares of train and val. Any stretch of frames and the frames of any one camera (every n-th) are
/// parted in nearly these shares. dlsd_dataset.py has the same rule.
[[nodiscard]] Split splitOf(size_t i, const std::array<double, 3>& shares);

struct ExportOptions {
  ExportFormat format = ExportFormat::kWebDataset;
  std::string out;  ///< Must not exist, or be an empty folder.
  /// Shares of train, val and test, each >= 0; they sum to 1.
  std::array<double, 3> shares{0.8, 0.1, 0.1};
  double min_length_px = 0;   ///< Labels that are shorter are left out ...
  double min_contrast = 0;    ///< ... and those of less contrast (mean, grey levels).
  std::string name = "dlsd";  ///< Of the ULSD data set: letters, digits, '_' and '-'.
  int order = 2;              ///< Of the ULSD curves, in [1, 4]: order + 1 points a line.
  size_t shard_bytes = size_t(1) << 30;  ///< A WebDataset shard is closed when it is larger.

  /// Throws std::invalid_argument naming the field, its value and what is allowed.
  void check() const;
};

struct ExportResult {
  std::array<size_t, 3> frames{};  ///< Written, by split.
  size_t lines = 0;                ///< Written.
  std::vector<std::string> notes;  ///< What was left out or is not exact, and why: sentences.
};

/// Writes the export to `out` + ".partial" and renames it when it is complete: `out` is complete or
/// not there. What an earlier, killed run left in that folder is removed. Frames are read and
/// written one at a time, in constant memory, and the same dataset gives the same bytes.
/// Throws std::invalid_argument (check()), InputError for data that can't be read and for an `out`
/// that is not empty, SystemError if a file can't be written. `on_frame` may be empty; it gets the
/// number of frames done; what it throws ends the export and leaves nothing behind.
ExportResult exportDataset(const Dataset& dataset,
                           const ExportOptions& options,
                           const std::function<void(size_t)>& on_frame);

}  // namespace dlsd
