#include "properties/checks/recovery.h"

#include "evaluation/detections.h"

namespace dlsd {

RecoveryOutcome checkRecovery(const FrameCase& frame_case,
                              const Frame& frame,
                              const RecoveryCriteria& criteria) {
  EvaluationOptions options;
  options.rho_px = {criteria.rho_px};
  options.headline_contrast = criteria.min_contrast;
  options.headline_angle_rad = criteria.min_angle_rad;
  options.headline_length_px = criteria.min_length_px;
  options.crowded_px = criteria.clearance_px;

  Detector detector(frame_case.camera, builtinOptions(frame_case.detector));
  RecoveryOutcome outcome;
  outcome.detections = detectLines(detector, frame.image);
  const FrameOutcome result =
      evaluateFrame(frame_case.camera, frame.labels.lines, outcome.detections, options);
  for (size_t i = 0; i < frame.labels.lines.size(); ++i) {
    const bool clear = result.strata[i] == Stratum::kHeadline;
    outcome.eligible += clear || result.strata[i] == Stratum::kCrowded ? 1 : 0;
    outcome.qualified += clear ? 1 : 0;
    if (clear && !result.labels[0][i].found) outcome.missed_ids.push_back(frame.labels.lines[i].id);
  }
  return outcome;
}

}  // namespace dlsd
