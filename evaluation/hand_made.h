#pragma once
// Hand-made labels and detections with known answers, for the tests of this folder.

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "cameras/arc.h"
#include "cameras/camera.h"
#include "synth/dataset/records.h"

namespace dlsd::hand_made {

/// 640 x 480 without distortion: straight 3D lines are straight in the image.
inline Camera pinholeCamera() {
  return {Pinhole::fromParams({400, 400, 320, 240}), 640, 480};
}

/// A label between two pixels of the image of `camera`, on the exact curve of the 3D line through
/// them. Strong and long enough for the headline if it is 40 px and 5 degrees.
inline LabelLine label(const Camera& camera,
                       const Eigen::Vector2d& from,
                       const Eigen::Vector2d& to,
                       int carrier) {
  const auto ray0 = camera.unproject(from);
  const auto ray1 = camera.unproject(to);
  if (!ray0 || !ray1) {
    throw std::logic_error("a hand-made label needs pixels that have rays");
  }
  const Arc arc = arcBetween(*ray0, *ray1).value();
  LabelLine line;
  line.id = line.edge = line.carrier = carrier;
  line.points_in_cam = {*ray0, *ray1};
  line.normal = canonicalNormal(arc.normal);
  line.points = imageCurve(camera, arc, 0, 1);
  for (size_t i = 1; i < line.points.size(); ++i) {
    line.length_px += (line.points[i] - line.points[i - 1]).norm();
  }
  line.angle_rad = arc.angle();
  line.contrast = line.contrast_min = 50;
  return line;
}

inline DetectionLine detection(std::vector<Eigen::Vector2d> points) {
  DetectionLine line;
  line.points = std::move(points);
  return line;
}

/// The label's own curve, every point moved by `shift`.
inline DetectionLine shifted(const LabelLine& label, const Eigen::Vector2d& shift) {
  DetectionLine line;
  for (const Eigen::Vector2d& p : label.points) {
    line.points.emplace_back(p + shift);
  }
  return line;
}

inline DetectionLine reversed(DetectionLine line) {
  std::reverse(line.points.begin(), line.points.end());
  return line;
}

}  // namespace dlsd::hand_made
