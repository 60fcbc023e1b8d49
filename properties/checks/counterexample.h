#pragma once
// A failing case on disk: what makes it again, and what a person wants to look at.

#include <string>

#include "properties/checks/recovery.h"

namespace dlsd {

/// Writes the folder `parent`/counterexample-<hash of the case>/ with
///   case.json    the case; `dlsd replay` makes it again
///   image.png    the frame
///   overlay.svg  the frame with labels (thin), detections (green) and missed labels (red)
/// and returns its path. The same case gives the same folder. Throws SystemError.
std::string saveCounterexample(const std::string& parent,
                               const FrameCase& frame_case,
                               const Frame& frame,
                               const RecoveryOutcome& outcome);

}  // namespace dlsd
