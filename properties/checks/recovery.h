#pragma once
// Recovery: what stands clear in the picture is found.

#include <string>
#include <vector>

#include "detector/detector.h"
#include "evaluation/evaluate.h"
#include "properties/checks/case.h"
#include "properties/checks/counterexample.h"

namespace dlsd {

/// Which labels must be found, and how closely. A label *qualifies* if it has the contrast and the
/// length and no other label comes nearer than clearance_px (around a shared vertex, the labels
/// that meet there do not count; evaluation/evaluate.h, kSharedEndRadiusPx).
struct RecoveryCriteria {
  double min_contrast = 30;  ///< 8-bit grey levels.
  double min_angle_rad = 5 * M_PI / 180;
  double min_length_px = 40;
  double clearance_px = 12;
  double rho_px = 1;
};

struct RecoveryOutcome {
  long eligible = 0;            ///< Labels with the contrast and the length, clear or not.
  long qualified = 0;           ///< Of these, the clear ones.
  std::vector<int> missed_ids;  ///< Ids of qualified labels that were not found.
  std::vector<DetectionLine> detections;
  [[nodiscard]] long found() const { return qualified - static_cast<long>(missed_ids.size()); }
};

/// What must be found in a case's frame: the labels above, within 1 px where the sensor adds no
/// noise, within 2 px where it does.
[[nodiscard]] RecoveryCriteria recoveryCriteria(const FrameCase& frame_case);

/// Detects lines in the frame and looks for its labels among them.
[[nodiscard]] RecoveryOutcome checkRecovery(const FrameCase& frame_case,
                                            const Frame& frame,
                                            const RecoveryCriteria& criteria);

/// The frame with labels, detections and missed labels.
[[nodiscard]] ShownPicture shownOf(const Frame& frame, const RecoveryOutcome& outcome);

}  // namespace dlsd
