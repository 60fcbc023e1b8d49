#pragma once
// Paper 4.4: does the image of the fitted plane pass through the pixels of the curve?

#include <Eigen/Core>
#include <optional>

#include "cameras/camera.h"

namespace dlsd {

/// Eq. 8: distance in px from a pixel to the reprojection of its ray's foot on the plane,
/// |u - project(x - (x . n) n)|. No value if the pixel has no ray or the foot does not project.
[[nodiscard]] std::optional<double> reprojectionErrorPx(const Camera& camera,
                                                        const Eigen::Vector2d& pixel,
                                                        const Eigen::Vector3d& plane_normal);

/// Gradient directions along a curve, counted for the a contrario score.
///
/// Under the background model gradient directions are independent and uniform. A sample within tau
/// of the curve's normal (either sign) has then probability p = 2 tau / pi. For each of kLevels
/// tolerances tau = (pi / 8) / 2^level the tail of the binomial law is bounded by Chernoff
/// (exp(-n KL(k/n || p))); the best one counts. Neighbouring gradients share pixels of the
/// smoothing kernel, so n and k are divided by kCorrelatedPx. Tests: every pixel as the one where a
/// trace starts, width * height (the gradient there gives the direction), times kLevels. In images
/// of pure noise, white or blurred, the best trace of all scores about -3.
class AlignmentCounter {
 public:
  static constexpr int kLevels = 5;
  static constexpr double kCorrelatedPx = 3;

  /// @param has_gradient  The gradient there is above the noise, so that it has a direction.
  void add(double gx, double gy, const Eigen::Vector2d& curve_normal, bool has_gradient);
  /// -log10 of the expected number of arcs at least as well aligned by chance in such an image.
  [[nodiscard]] double score(int width, int height) const;

 private:
  int count_ = 0;
  int aligned_[kLevels] = {};
};

}  // namespace dlsd
