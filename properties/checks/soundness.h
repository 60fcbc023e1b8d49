#pragma once
// Soundness: what is found is there.

#include <string>
#include <vector>

#include "detector/detector.h"
#include "evaluation/evaluate.h"
#include "properties/checks/case.h"
#include "properties/checks/counterexample.h"

namespace dlsd {

struct SoundnessOutcome {
  std::vector<DetectionLine> detections;
  std::vector<int> wrong;  ///< Indices of detections that lie on no labels within rho.
  std::vector<int>
      astray;  ///< Those that lie on labels, but of several 3D lines one after another.
  std::vector<int> merged;  ///< Those that lie on one, but bridge more than 5 px without a label.
  double longest_wrong_px = 0;
};

/// A detection lies on a labelled 3D line (on labels) if 90 % of it are within this many px of the
/// labels of one carrier (evaluation/evaluate.h), or of any.
inline constexpr double kSoundRhoPx = 2;
/// A single wrong detection of this length or more fails a case, whatever the others are.
inline constexpr double kLongWrongPx = 150;

/// Detects lines in the frame and looks for each among its labels, faint and short ones included.
[[nodiscard]] SoundnessOutcome checkSoundness(const FrameCase& frame_case, const Frame& frame);

/// The frame with labels, detections and wrong detections.
[[nodiscard]] ShownPicture shownOf(const Frame& frame, const SoundnessOutcome& outcome);

}  // namespace dlsd
