#pragma once
// Where one line turns into another by a small angle, noise lets each of them run on along the
// other one for a while.

#include <vector>

#include "cameras/ray_table.h"
#include "detector/detector.h"

namespace dlsd {

/// Cuts the end of a line where it crosses another one of the same polarity if beyond the crossing
/// it stays within kSharedPx of the other line, which goes on and elsewhere departs from it. What
/// is cut is less than a third of the line. from_px, to_px and length_px must be set, and are.
void cutAtJoints(const RayTable& rays, std::vector<DetectedLine>* lines);

constexpr double kSharedPx = 1.5;

}  // namespace dlsd
