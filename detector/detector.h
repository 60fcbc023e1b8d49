#pragma once
// Detection of straight 3D lines in the distorted image of a calibrated camera, without
// rectification.
//
//   dlsd::Detector detector(camera);
//   for (const dlsd::DetectedLine& line : detector.detect({pixels, width, height, 1, stride})) ...
//
// Method: edge chains -> convex polygonal chains -> plane through the optical centre in closed form
// -> reprojection test within rho px (Zuniga-Noel et al., "D-LSD", CAIP 2021).
// DetectorOptions::paper() is the paper's algorithm; the default goes beyond it where measurement
// showed a gain.

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "cameras/arc.h"
#include "cameras/camera.h"
#include "detector/image_view.h"

namespace dlsd {

struct DetectorOptions;  // detector/options.h

/// A straight 3D line seen in the image. A wire, or another bar of at most about 2 px (2.5 px on even
/// ground), is one line in its middle; its residuals, score and polarity are those of the longer of
/// its two sides. The sides of wider bars are lines where they are, not where blur makes them seem.
struct DetectedLine {
  /// Fitted plane and end rays, camera frame. Less than half a turn, its image curve inside the
  /// image and the domain.
  Arc arc;
  Eigen::Vector2d from_px, to_px;  ///< Projections of arc.from and arc.to.
  Eigen::Matrix3d normal_cov;      ///< Covariance of arc.normal (rank 2), from the residuals.
  double rms_px = 0, max_px = 0;   ///< Reprojection residuals (paper's Eq. 8) of the edge pixels.
  double length_px = 0;            ///< Length along the image curve.
  double score = 0;                ///< -log10 of the number of false alarms; larger is better.
  double contrast = 0;  ///< Mean step across the line, grey levels: that of an edge which
                        ///< stands alone, less beside another one. 0 for paper().
  int polarity = 1;     ///< +1: brighter on the side arc.normal points to, else -1.
};

/// Seconds spent in each step of the last detect() call.
struct StageTimes {
  double gradient = 0, anchors = 0, linking = 0, chains = 0, planes = 0, validation = 0, total = 0;
};

/// Builds its tables once; detect() then reuses its buffers. Not for use by two threads at once:
/// take one detector per thread.
class Detector {
 public:
  explicit Detector(const Camera& camera);
  /// Throws std::invalid_argument naming an option that is out of range.
  Detector(const Camera& camera, const DetectorOptions& options);
  ~Detector();
  Detector(Detector&&) noexcept;
  Detector& operator=(Detector&&) noexcept;

  /// Lines in descending score, ties by position: the same output for the same image, always.
  /// The reference is valid until the next call. Throws std::invalid_argument if the view's size is
  /// not the camera's, or the view is malformed (null data, channels not 1, 3, 4, stride too
  /// small).
  [[nodiscard]] const std::vector<DetectedLine>& detect(const ImageView& image);

  /// The same, of edges where the mask is not 0: a line ends where it is. The mask has one channel
  /// of 8 bits and the image's size, else std::invalid_argument.
  [[nodiscard]] const std::vector<DetectedLine>& detect(const ImageView& image,
                                                        const ImageView& mask);

  [[nodiscard]] const StageTimes& times() const;
  [[nodiscard]] const Camera& camera() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dlsd
