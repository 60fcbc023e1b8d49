#pragma once
// Other people's line detectors for undistorted images, run as the paper runs them: the image is
// rectified in `crop` mode to its own size, lines are found there with the detector's default
// parameters, and mapped back as curves of the original image.

#include <memory>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "cameras/rectification.h"
#include "evaluation/dataset_evaluation.h"
#include "synth/dataset/image.h"

namespace dlsd {

/// "lsd" (OpenCV's LineSegmentDetector), "edlines" (ximgproc's EdgeDrawing, EDLines) and "fld"
/// (ximgproc's FastLineDetector).
[[nodiscard]] const std::vector<std::string>& peerDetectors();

/// Widest view that images are rectified to: beyond it the middle gets too few pixels, and at 180
/// degrees there is no pinhole image at all. The paper gives 130 degrees as the limit in practice.
inline constexpr double kPeerMaxFieldRad = 130 * M_PI / 180;

/// One detector for the images of one camera. Not for use by two threads at once. From now on
/// OpenCV uses one thread in the whole program: frames go in parallel, and times are of one thread.
class PeerDetector {
 public:
  /// Throws InputError if there is no detector of that name, or the camera does not look along its
  /// axis, so that there is no crop around it.
  PeerDetector(const Camera& camera, const std::string& name);
  ~PeerDetector();
  PeerDetector(PeerDetector&&) noexcept;
  PeerDetector& operator=(PeerDetector&&) noexcept;

  /// Lines without score: none of the three gives one by default. Times are always there. Throws
  /// std::invalid_argument if the image's size is not the camera's.
  [[nodiscard]] Detections detect(const Image& image);

  /// What the detector sees.
  [[nodiscard]] const VirtualView& view() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A peer run on the images of a dataset, each with its own camera.
/// @param timed  Keep the times, which makes no two runs the same.
[[nodiscard]] DetectionSource detectionsOfPeer(const Dataset& dataset,
                                               const std::string& name,
                                               bool timed = false);

}  // namespace dlsd
