#pragma once
// Images whose edges are known exactly, made without the renderer: single straight 3D lines, noise,
// discs.

#include <cstdint>
#include <vector>

#include "cameras/camera.h"
#include "detector/image_view.h"

namespace dlsd::bench {

using Pixels = std::vector<uint8_t>;
[[nodiscard]] ImageView viewOf(const Pixels& image, const Camera& camera);

/// A step edge, alone in its image but for the corners at its ends.
struct IsolatedLine {
  double length_px, contrast, noise, blur_px;  ///< Grey levels; blur of the optics, sigma.
  bool distorted;    ///< Seen by a FoV camera, off its centre by 15 % of the image.
  bool has_corners;  ///< A side of a square; else it runs from border to border.
};

/// How detections of such lines over repeated noise stray from the truth.
struct LineErrors {
  int tried = 0, found = 0;
  double offset = 0, offset2 = 0;  ///< Sums, px, of the middle.
  double offset_in_bounds2 = 0;    ///< The same over the Cramer-Rao bound.
  double angle_in_bounds2 = 0;     ///< Of the angle in the image.
  double own_sigmas2 = 0;          ///< Of the offset over the detector's own covariance.
  LineErrors& operator+=(const LineErrors& other);
  /// Root mean squares in units of the bound, and of the detector's own standard deviation.
  [[nodiscard]] double offsetInBounds() const;
  [[nodiscard]] double angleInBounds() const;
  [[nodiscard]] double ownSigmas() const;
  [[nodiscard]] double biasPx() const { return offset / found; }
};

/// Position and direction are drawn from the seed, as is the noise. One detection.
[[nodiscard]] LineErrors detectIsolatedLine(const IsolatedLine& line, uint64_t seed);

/// Gaussian noise of this standard deviation around 127, white or blurred.
[[nodiscard]] Pixels noiseImage(const Camera& camera, double sigma, double blur_px, uint64_t seed);

/// The image of a sphere.
struct DiscImage {
  Pixels image;
  double longest_arc_px;  ///< Longest piece of its outline that a great circle fits within 0.5 px.
};
[[nodiscard]] DiscImage discImage(
    const Camera& camera, double radius_px, double noise, double blur_px, uint64_t seed);

}  // namespace dlsd::bench
