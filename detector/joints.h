#pragma once
// Where one line turns into another by a small angle, noise lets each of them run on along the
// other one for a while.

#include <array>
#include <vector>

#include "cameras/ray_table.h"
#include "detector/detector.h"

namespace dlsd {

class JointCutter {
 public:
  explicit JointCutter(const RayTable& rays) : rays_(rays) {}

  /// Cuts the end of a line where it crosses another one of the same polarity if beyond the
  /// crossing it stays within kSharedPx of the other line, which goes on and elsewhere departs from
  /// it. What is cut is less than a third of the line. from_px, to_px and length_px must be set,
  /// and are.
  void cut(std::vector<DetectedLine>* lines);

  static constexpr double kSharedPx = 1.5;

 private:
  [[nodiscard]] bool crossingBefore(const DetectedLine& line,
                                    const Eigen::Vector3d& end_ray,
                                    double px_per_rad,
                                    const DetectedLine& other,
                                    Eigen::Vector3d* crossing) const;

  const RayTable& rays_;
  std::array<std::vector<float>, 3> normals_;  // by axis
};

}  // namespace dlsd
