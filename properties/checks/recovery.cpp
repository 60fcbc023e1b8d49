#include "properties/checks/recovery.h"

#include <algorithm>
#include <cmath>

#include "evaluation/detections.h"

namespace dlsd {
namespace {

/// Whether a pixel of the image without a ray lies within clearance_px of the point, looked for on
/// circles of up to that radius.
bool nearRim(const Camera& camera, const Eigen::Vector2d& point, double clearance_px) {
  constexpr int kRadii = 3, kDirections = 16;
  for (int r = 1; r <= kRadii; ++r) {
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2 * M_PI * k / kDirections;
      const Eigen::Vector2d p =
          point + clearance_px * r / kRadii * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      if (camera.inImage(p) && !camera.unproject(p)) return true;
    }
  }
  return false;
}

/// Where the image circle ends is an edge of the picture, too. Around an end at the rim it does not
/// count, as the labels that meet at a shared end do not.
bool runsAlongRim(const Camera& camera, const LabelLine& label, double clearance_px) {
  constexpr double kStepPx = 2;
  const auto atRimEnd = [&](const Eigen::Vector2d& p) {
    return (label.ends[0] == EndKind::kRim &&
            (p - label.points.front()).norm() <= kSharedEndRadiusPx) ||
           (label.ends[1] == EndKind::kRim &&
            (p - label.points.back()).norm() <= kSharedEndRadiusPx);
  };
  for (size_t i = 0; i + 1 < label.points.size(); ++i) {
    const Eigen::Vector2d d = label.points[i + 1] - label.points[i];
    const int steps = std::max(1, static_cast<int>(std::ceil(d.norm() / kStepPx)));
    for (int k = 0; k <= steps; ++k) {
      const Eigen::Vector2d p = label.points[i] + d * (static_cast<double>(k) / steps);
      if (!atRimEnd(p) && nearRim(camera, p, clearance_px)) return true;
    }
  }
  return false;
}

}  // namespace

RecoveryCriteria recoveryCriteria(const FrameCase& frame_case) {
  RecoveryCriteria criteria;
  criteria.rho_px = frame_case.sensor.read_noise_levels > 0 ? 2 : 1;
  return criteria;
}

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
    const bool apart = result.strata[i] == Stratum::kHeadline;
    outcome.eligible += apart || result.strata[i] == Stratum::kCrowded ? 1 : 0;
    const bool clear =
        apart && !runsAlongRim(frame_case.camera, frame.labels.lines[i], criteria.clearance_px);
    outcome.qualified += clear ? 1 : 0;
    if (clear && !result.labels[0][i].found) outcome.missed_ids.push_back(frame.labels.lines[i].id);
  }
  return outcome;
}

ShownPicture shownOf(const Frame& frame, const RecoveryOutcome& outcome) {
  ShownPicture shown{frame.image, {}, {}, {}};
  for (const LabelLine& label : frame.labels.lines) {
    const bool missed =
        std::count(outcome.missed_ids.begin(), outcome.missed_ids.end(), label.id) > 0;
    (missed ? shown.failed : shown.labels).push_back(label.points);
  }
  for (const DetectionLine& line : outcome.detections) shown.lines.push_back(line.points);
  return shown;
}

}  // namespace dlsd
