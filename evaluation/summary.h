#pragma once
// Outcomes of many frames, pooled: per camera and over all, as a table and as JSON.

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "evaluation/evaluate.h"

namespace dlsd {

/// Sums over the frames of one camera, or over all. Every ratio is counted/total.
struct GroupSummary {
  std::string name;
  long frames = 0, labels = 0, detections = 0;

  struct AtRho {
    std::array<Ratio, kStratumCount> found;  ///< Labels found / labels, by stratum.
    /// Fragments of the found labels / found labels, by stratum: 1 is best, duplicates raise it.
    std::array<Ratio, kStratumCount> fragments;
    Ratio right, right_long;    ///< Right / detections: all, and those of at least long_angle_rad.
    Ratio merged, merged_long;  ///< Merged / detections, likewise.
  };
  std::vector<AtRho> at_rho;
  std::array<DistanceStats, kStratumCount> localisation;  ///< At the largest rho.

  void add(const FrameOutcome& outcome, const EvaluationOptions& options);
};

struct Summary {
  EvaluationOptions options;
  std::vector<GroupSummary> cameras;  ///< Sorted by name.
  GroupSummary all;

  explicit Summary(EvaluationOptions evaluation_options);
  /// Sums of distances are floating-point: add frames in a fixed order for the same last bits.
  void add(const std::string& camera_name, const FrameOutcome& outcome);
};

/// "123/140  87.9 %"; "0/0" has no share.
[[nodiscard]] std::string text(const Ratio& ratio);

/// The table that `dlsd evaluate` prints, ending in a newline.
[[nodiscard]] std::string table(const Summary& summary);

/// The same figures, and those of the strata that the table leaves out (docs/evaluation.md).
[[nodiscard]] nlohmann::ordered_json toJson(const Summary& summary);

}  // namespace dlsd
