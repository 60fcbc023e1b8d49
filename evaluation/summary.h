#pragma once
// Outcomes of many frames: pooled per camera and over all, and a row for each image, label and
// detection, from which every other figure is made (figures.h).

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/dataset_evaluation.h"
#include "evaluation/evaluate.h"

namespace dlsd {

/// Sums over the frames of one camera, or over all. Every ratio is counted/total.
struct GroupSummary {
  std::string name;
  long frames = 0, labels = 0, detections = 0;

  struct AtRho {
    std::array<Ratio, kStratumCount> found;  ///< Labels found / labels, by stratum.
    /// Fragments of the found runs / found runs, by stratum of the run: 1 is best.
    std::array<Ratio, kStratumCount> fragments;
    Ratio right, right_long;    ///< Right / detections: all, and those of at least long_angle_rad.
    Ratio merged, merged_long;  ///< Merged / detections, likewise.
  };
  std::vector<AtRho> at_rho;
  std::array<DistanceStats, kStratumCount> localisation;  ///< At the largest rho.

  void add(const FrameOutcome& outcome, const EvaluationOptions& options);
};

struct ImageRow {
  std::string image;  ///< As the labels name it.
  std::string camera, model;
  std::optional<double> noise_levels;  ///< Read noise, if the labels tell it.
  std::optional<double> time_ms, rectification_ms;
};

struct LabelRow {
  size_t image = 0;  ///< Index into Summary::images.
  LineKind kind{};
  LabelConditions conditions;
  double contrast = 0, length_px = 0, angle_rad = 0;
  double field_angle_rad = 0;                        ///< Of the middle of its arc.
  unsigned found = 0;                                ///< Bit r: at the r-th rho.
  std::array<double, kMaxTolerances> found_score{};  ///< [rho], where found.
  std::optional<LabelErrors> errors;
};

struct DetectionRow {
  size_t image = 0;
  double score = 0, length_px = 0, angle_rad = 0;
  std::optional<double> field_angle_rad;  ///< Of the middle of its curve.
  unsigned right = 0, merged = 0;         ///< Bit r: at the r-th rho.
};

struct Summary {
  EvaluationOptions options;
  std::vector<GroupSummary> cameras;  ///< Sorted by name.
  GroupSummary all;
  std::vector<ImageRow> images;
  std::vector<LabelRow> labels;
  std::vector<DetectionRow> detections;
  /// [StructuralKind][image]
  std::array<std::vector<StructuralOutcome>, kStructuralKinds> structure;

  explicit Summary(EvaluationOptions evaluation_options);
  /// Sums of distances are floating-point: add frames in a fixed order for the same last bits.
  /// @param camera  The frame's.
  void add(const FrameEvaluation& frame, const Camera& camera);
};

/// "123/140  87.9 %"; "0/0" has no share.
[[nodiscard]] std::string text(const Ratio& ratio);

/// Whether counted / total >= share; 0/0 is not. 11/20 reaches 0.55, whose nearest double is a bit
/// above it.
[[nodiscard]] bool reaches(const Ratio& ratio, double share);

/// The counts and distances of each camera and all, ending in a newline.
[[nodiscard]] std::string table(const Summary& summary);

/// The same figures, and those of the strata that the table leaves out (docs/evaluation.md).
[[nodiscard]] nlohmann::ordered_json toJson(const Summary& summary);

}  // namespace dlsd
