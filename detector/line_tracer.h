#pragma once
// Follows the image of a plane through the optical centre as far as the image shows an edge there.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "detector/edge_drawing.h"
#include "detector/gradient.h"
#include "detector/options.h"
#include "detector/plane_fit.h"
#include "detector/ray_table.h"
#include "detector/validation.h"

namespace dlsd {

/// What a trace needs to know of the line it starts from.
struct TraceSeed {
  Eigen::Vector3d normal;
  RayMoments moments;        ///< That gave the normal, weights in px^2 per rad^2.
  int points;                ///< Number of rays in them.
  Eigen::Vector2d start_px;  ///< Near the curve, within 1 px of a usable pixel.
  double rms_px;             ///< Residuals of the seed's edge pixels.
  double gradient;           ///< Typical magnitude on it, in units of GradientField.
};

struct TracedLine {
  PlaneFit fit;                      ///< Weights in px^-2: squared_residuals is in px^2.
  Eigen::Vector3d from_ray, to_ray;  ///< Rays of the ends (near the plane, not on it).
  Eigen::Vector3d middle_ray;        ///< Of a point between them: tells which way round.
  Eigen::Vector2d from_px, to_px;    ///< Those ends.
  double length_px;                  ///< Along the curve.
  int edge_points;
  double rms_px, max_px;  ///< Reprojection errors of the edge points.
  bool is_arc;            ///< Bends with a radius below min_bend_radius_px.
  int polarity;           ///< +1: brighter on the side fit.normal points to.
  double score;
};

class LineTracer {
 public:
  LineTracer(const RayTable& rays, const ValidationOptions& options);

  /// From the seed in both directions, in steps of one pixel along the curve. A step shows an edge
  /// if a crest of the gradient along the curve's normal lies within the bound of the residuals of
  /// the curve and its gradient is within pi / 8 of the normal, of either sign. The plane is
  /// refitted to the crests as the line grows. The line ends before max_gap_px + 1 steps without an
  /// edge; a gap is only crossed to reach at least kMinRunPx more.
  /// A line that still shows an edge where the usable part of the image ends is taken to go on to
  /// the border or rim itself, but at most max_gap_px. No value if fewer than min_length_px remain.
  [[nodiscard]] std::optional<TracedLine> trace(const GradientField& field,
                                                const EdgeThresholds& thresholds,
                                                double noise,
                                                const TraceSeed& seed);

  /// Crests of the last trace, from its first to its last point: index into the image.
  [[nodiscard]] const std::vector<uint32_t>& crestPixels() const { return crest_pixels_; }
  /// Whether the crest at each of them lies along x (its neighbours across are index -+ 1).
  [[nodiscard]] const std::vector<uint8_t>& crestAlongX() const { return crest_along_x_; }

  static constexpr int kMinRunPx = 5;

 private:
  struct Step {
    Eigen::Vector2d curve_px, crest_px;
    Eigen::Vector3d ray;   // of the crest
    double px_per_rad;     // along the curve's normal
    float gx, gy, nx, ny;  // gradient at the curve, and the curve's normal
    uint32_t pixel;        // of the crest
    bool is_edge, along_x;
    int8_t polarity;
  };
  struct Front {
    Eigen::Vector2d position, normal;  // on the curve; normal of the curve there
    bool ended = false;
    bool at_border = false;  // of the usable part of the image
  };
  struct End {
    Eigen::Vector2d px;
    Eigen::Vector3d ray;
  };

  bool evaluate(const GradientField& field,
                uint16_t min_magnitude,
                double bound_px,
                const Eigen::Vector2d& position,
                const CurveOffset& curve,
                Step* step) const;
  void extend(const GradientField& field,
              uint16_t min_magnitude,
              double bound_px,
              int direction,
              std::vector<Step>* steps,
              Front* front);
  bool refit();
  [[nodiscard]] bool isArc(const std::vector<Step>& steps, const Eigen::Vector3d& normal) const;
  [[nodiscard]] End endOf(const Step& last, int direction, bool at_border) const;
  static void cutTail(std::vector<Step>* steps);

  const RayTable& rays_;
  ValidationOptions options_;
  std::vector<Step> forward_, backward_;
  // The seed's points count until the end, so that the first few crests do not turn the plane.
  RayMoments moments_;
  Eigen::Vector3d normal_;
  int points_ = 0, points_at_fit_ = 0;
  double angle_rad_ = 0;
  std::vector<uint32_t> crest_pixels_;
  std::vector<uint8_t> crest_along_x_;
};

}  // namespace dlsd
