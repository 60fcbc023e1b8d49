#pragma once
// How straight the lines of photographs are under a calibration: `dlsd camera check --image`.

#include <memory>
#include <optional>
#include <vector>

#include "cameras/camera.h"
#include "synth/dataset/image.h"

namespace dlsd::cli {

/// What is left of curvature: by how much the middle of 100 px of an edge that runs around the axis
/// stands out from the straight line, away from the axis where positive. Mean over lines by how
/// much they tell, those that do not fit the others (curved things) counting less; standard error
/// from their scatter.
struct Bulge {
  double mean_px = 0, sigma_px = 0;
};

/// Lines whose middle has a field angle in [from, to).
struct StraightnessBand {
  double from_rad = 0, to_rad = 0;
  size_t lines = 0;
  double length_px = 0;  ///< Of all together.
  /// Distances of the edge's points from the image of the plane that fits them best. Edges are
  /// looked for in a wider band (3 px) than the detector allows.
  double rms_px = 0, median_px = 0;
  Bulge bulge;
};

/// Detection again with the radial curve changed: the image of a ray with field angle theta and
/// distance r from the image of the axis moved outwards in proportion to r theta^2, by radius_px at
/// the reference angle.
struct StraightnessTrial {
  double radius_px = 0;
  /// Length of the line that a point on a line lies on, geometric mean over the points. Only the
  /// part of the image that is seen in every trial counts.
  double mean_length_px = 0;
  /// Log of mean_length_px over that of the calibration as it is, and its standard error (from
  /// leaving out one sixteenth of the images' area after the other).
  double gain = 0, gain_sigma = 0;
};

struct Straightness {
  enum class Verdict {
    kUndecided,   ///< The lines do not tell.
    kConsistent,  ///< Neither bulges nor longer lines, and both would have been seen.
    kOff,         ///< Lines bulge, or get longer by a change.
  };
  size_t images = 0, lines = 0;
  double length_px = 0, longest_px = 0;
  std::vector<StraightnessBand> bands;  ///< Of 10 degrees, from 0.
  double reference_rad = 0;             ///< Field angle that 95 % of the lines' points are within.
  std::vector<StraightnessTrial> trials;  ///< By radius_px; the one with 0 is the calibration's.
  Verdict verdict = Verdict::kUndecided;
  /// Set where lines would say that the calibration is off, but only those beyond this angle, the
  /// outermost band: there the image circle or the end of a lens looks like bowed edges.
  std::optional<double> only_beyond_rad;
  Bulge bulge;         ///< Of all lines more than 10 degrees from the axis.
  double best_px = 0;  ///< radius_px that makes lines longer beyond doubt, most; else 0.
  /// Changes that make lines shorter beyond doubt, the nearest to 0 on either side.
  std::optional<double> shows_below_px, shows_above_px;
};

/// The true calibration makes straight edges straight; a wrong one leaves them bowed, and the
/// detector breaks what is bowed into shorter lines. Two witnesses: the bulge that is left in the
/// pieces, all to the same side; and how much longer or shorter lines get when the radial curve is
/// changed, which does not mind curved things, trees and noise, the same in every trial. What
/// straight lines cannot show (the focal length of a pinhole) neither shows, and the principal
/// point is not looked at. The rim of the image circle, an edge of constant field angle with black
/// outside, is left out.
class StraightnessCheck {
 public:
  explicit StraightnessCheck(const Camera& camera);
  ~StraightnessCheck();

  /// Throws std::invalid_argument if the image's size is not the camera's.
  void add(const Image& image);
  [[nodiscard]] Straightness result();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dlsd::cli
