#pragma once
// A dataset and, if given, its detections as one static page: no server, nothing from elsewhere.

#include <optional>
#include <string>

#include "evaluation/dataset_evaluation.h"
#include "evaluation/summary.h"
#include "synth/dataset/dataset.h"
#include "synth/dataset/statistics.h"

namespace dlsd {

struct ReportOptions {
  std::string out;               ///< Folder to write to; created if absent. Not the data folder.
  std::string detections_title;  ///< What the page calls the detections ("det.jsonl", "dlsd").
  EvaluationOptions evaluation;
  int jobs = 0;  ///< Threads; 0: one per core.
};

struct Report {
  std::string index_path;  ///< The page: out/index.html.
  LabelStatistics statistics;
  std::optional<Summary> summary;  ///< If there are detections.
};

/// Writes index.html, frames/NNNNNN.js (curves, loaded when a frame is opened) and
/// thumbs/NNNNNN.png. If `out` lies in the data folder or beside it, images are referred to by
/// relative path, else copied to out/images. Nothing is written before every frame has been
/// evaluated, and index.html comes last. Throws InputError for data and detections, SystemError if
/// a file can't be written.
Report writeReport(const Dataset& dataset,
                   const std::optional<DetectionSource>& detections,
                   const ReportOptions& options);

/// The numbers of the dataset, as `dlsd report` prints them: one per line, ending in a newline.
[[nodiscard]] std::string table(const LabelStatistics& statistics);

}  // namespace dlsd
