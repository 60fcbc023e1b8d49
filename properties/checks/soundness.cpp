#include "properties/checks/soundness.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "evaluation/detections.h"

namespace dlsd {

namespace {

/// Distance to a curve of straight pieces; infinite if it is clearly above `limit_px`.
double distanceToCurve(const Eigen::Vector2d& p,
                       const std::vector<Eigen::Vector2d>& curve,
                       double limit_px) {
  double least2 = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i + 1 < curve.size(); ++i) {
    const Eigen::Vector2d &a = curve[i], &b = curve[i + 1];
    if (p.x() < std::min(a.x(), b.x()) - limit_px || p.x() > std::max(a.x(), b.x()) + limit_px ||
        p.y() < std::min(a.y(), b.y()) - limit_px || p.y() > std::max(a.y(), b.y()) + limit_px) {
      continue;
    }
    const Eigen::Vector2d d = b - a;
    const double t = std::clamp((p - a).dot(d) / std::max(d.squaredNorm(), 1e-300), 0.0, 1.0);
    least2 = std::min(least2, (a + t * d - p).squaredNorm());
  }
  return std::sqrt(least2);
}

/// Whether 90 % of the curve lie within rho of labels, whichever they are.
bool isOnLabels(const std::vector<Eigen::Vector2d>& curve,
                const std::vector<LabelLine>& labels,
                double rho_px) {
  long inside = 0, samples = 0;
  for (size_t i = 0; i + 1 < curve.size(); ++i) {
    const Eigen::Vector2d d = curve[i + 1] - curve[i];
    const int steps = std::max(1, static_cast<int>(d.norm()));
    for (int k = 0; k < steps; ++k) {
      const Eigen::Vector2d p = curve[i] + d * k / steps;
      ++samples;
      inside += std::any_of(labels.begin(), labels.end(), [&](const LabelLine& label) {
        return distanceToCurve(p, label.points, rho_px) <= rho_px;
      });
    }
  }
  return static_cast<double>(inside) >= 0.9 * static_cast<double>(samples);
}

}  // namespace

SoundnessOutcome checkSoundness(const FrameCase& frame_case, const Frame& frame) {
  EvaluationOptions options;
  options.rho_px = {kSoundRhoPx};
  Detector detector(frame_case.camera, builtinOptions(frame_case.detector));
  SoundnessOutcome outcome;
  outcome.detections = detectLines(detector, frame.image);
  const FrameOutcome result =
      evaluateFrame(frame_case.camera, frame.labels.lines, outcome.detections, options);
  for (size_t i = 0; i < outcome.detections.size(); ++i) {
    if (result.detections[0][i].merged) outcome.merged.push_back(static_cast<int>(i));
    if (result.detections[0][i].right || result.detections[0][i].merged) continue;
    if (isOnLabels(outcome.detections[i].points, frame.labels.lines, kSoundRhoPx)) {
      outcome.astray.push_back(static_cast<int>(i));
      continue;
    }
    outcome.wrong.push_back(static_cast<int>(i));
    outcome.longest_wrong_px = std::max(outcome.longest_wrong_px, result.detection_length_px[i]);
  }
  return outcome;
}

ShownPicture shownOf(const Frame& frame, const SoundnessOutcome& outcome) {
  ShownPicture shown{frame.image, {}, {}, {}};
  for (const LabelLine& label : frame.labels.lines) shown.labels.push_back(label.points);
  for (size_t i = 0; i < outcome.detections.size(); ++i) {
    const bool wrong =
        std::count(outcome.wrong.begin(), outcome.wrong.end(), static_cast<int>(i)) > 0;
    (wrong ? shown.failed : shown.lines).push_back(outcome.detections[i].points);
  }
  return shown;
}

}  // namespace dlsd
