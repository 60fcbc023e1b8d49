#pragma once
// Detections against exact labels: found, right, merged, fragments, localisation error.
// docs/evaluation.md defines every figure.

#include <array>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "synth/dataset/records.h"

namespace dlsd {

struct EvaluationOptions {
  std::vector<double> rho_px{1, 2, 4};    ///< Tolerances, each in (0, 100].
  double headline_contrast = 20;          ///< 8-bit grey levels.
  double headline_angle_rad = 5 * M_PI / 180;
  double headline_length_px = 40;
  double crowded_px = 6;                  ///< Labels nearer than this to another one are "crowded".
  void check() const;                     ///< Throws std::invalid_argument naming field, value, range.
};

/// counted / total, always reported as both.
struct Ratio {
  long counted = 0, total = 0;
  Ratio& operator+=(const Ratio& other) {
    counted += other.counted;
    total += other.total;
    return *this;
  }
};

/// Which row a label belongs to.
enum class Stratum { kHeadline, kCrowded, kShort, kFaint };

/// What happened to one label at one rho.
struct LabelOutcome {
  bool found = false;
  int detection = -1;   ///< The detection that covers most of it, or -1.
  double coverage = 0;  ///< Share of its (trimmed) arc length within rho of that detection.
  int fragments = 0;    ///< Detections with >= 50 % of their length on it.
};

/// What happened to one detection at one rho.
struct DetectionOutcome {
  bool right = false;
  bool merged = false;       ///< Right in position, but bridges > 5 px without label evidence.
  double coverage = 0;       ///< Share of its length within rho of the best carrier's labels.
  int carrier = -1;
};

struct FrameOutcome {
  std::vector<Stratum> strata;                            ///< One per label.
  std::vector<std::vector<LabelOutcome>> labels;          ///< [rho][label]
  std::vector<std::vector<DetectionOutcome>> detections;  ///< [rho][detection]
  std::vector<double> detection_angle_rad;                ///< [detection], angle between its end rays
  /// Distances (px) of found labels' curve samples to their detection, at the largest rho: sums.
  double sum_err2_px2 = 0;
  double sum_abs_err_px = 0;
  long err_count = 0;
};

/// Matches one frame. Deterministic; independent of the order of labels and detections up to ties.
[[nodiscard]] FrameOutcome evaluateFrame(const Camera& camera,
                                         const std::vector<LabelLine>& labels,
                                         const std::vector<DetectionLine>& detections,
                                         const EvaluationOptions& options);

}  // namespace dlsd
