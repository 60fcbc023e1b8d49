#pragma once
// Where one line turns into another by a small angle, noise lets each of them run on along the
// other one for a while.

#include <array>
#include <vector>

#include "cameras/ray_table.h"
#include "detector/detector.h"
#include "detector/usable_mask.h"

namespace dlsd {

class JointCutter {
 public:
  /// No line becomes shorter than min_length_px.
  JointCutter(const RayTable& rays, double min_length_px)
      : rays_(rays), min_length_px_(min_length_px) {}

  /// Cuts the end of a line where it crosses another one of the same polarity if beyond the
  /// crossing it stays within kSharedPx of the other line, which goes on and elsewhere departs from
  /// it. What is cut is less than a third of the line at each end. from_px, to_px and length_px
  /// must be set, and are.
  void cut(std::vector<DetectedLine>* lines);

  static constexpr double kSharedPx = 1.9;

  /// Near a corner neither of its edges looks like one: of two lines that both end within kCornerPx
  /// of where they cross, by 15 degrees or more, with brightness between them on the same side,
  /// both end there (of several such crossings each at its nearest). The same must be set.
  /// @param usable  Where edges may be: beyond it lines go on, so what ends there is left.
  void meetAtCorners(const BitRows& usable, std::vector<DetectedLine>* lines);

  static constexpr double kCornerPx = 12;

 private:
  struct Tip {
    size_t line;
    bool at_from;
    Eigen::Vector2d px;
    Eigen::Vector2d corner_px;  // the nearest so far ...
    Eigen::Vector3d corner_ray;
    double nearest_px;  // ... which is so far away
  };
  void offerCorner(const std::vector<DetectedLine>& lines, Tip* a, Tip* b) const;
  [[nodiscard]] bool crossingBefore(const DetectedLine& line,
                                    const Eigen::Vector3d& end_ray,
                                    double px_per_rad,
                                    const DetectedLine& other,
                                    Eigen::Vector3d* crossing) const;

  const RayTable& rays_;
  double min_length_px_;
  std::array<std::vector<float>, 3> normals_;  // by axis
  std::vector<Tip> tips_;
};

}  // namespace dlsd
