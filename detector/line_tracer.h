#pragma once
// Follows the image of a plane through the optical centre as far as the image shows an edge there,
// and fits the plane to that edge, all on the pixels as given.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "cameras/ray_table.h"
#include "detector/bar_profiles.h"
#include "detector/edge_profile.h"
#include "detector/options.h"
#include "detector/planar_chain.h"
#include "detector/plane_fit.h"
#include "detector/usable_mask.h"

namespace dlsd {

struct TracedLine {
  PlaneFit fit;            ///< Weights 1 / variance of the points: inverse_in_plane is the
                           ///< covariance if the noise is as measured.
  double variance_factor;  ///< By which it is larger, from the residuals.
  Eigen::Vector3d from_ray, to_ray;  ///< Rays of the ends (near the plane, not on it).
  Eigen::Vector3d middle_ray;        ///< Of a point between them: tells which way round.
  double length_px;                  ///< Along the curve.
  double rms_px, max_px;             ///< Distances of the edge points from the curve.
  bool is_inside;   ///< All of it is well inside the image: neither end is at the border or rim.
  bool is_arc;      ///< Bends with a radius below min_bend_radius_px.
  double contrast;  ///< Mean of the narrow filter's response, grey levels.
  int polarity;     ///< +1: brighter on the side fit.normal points to.
  double score;
};

/// Standard deviations over the parts of an image without edges of the means of four rows of the
/// four responses.
struct ResponseNoise {
  float odd_narrow = 0, even_narrow = 0, odd_wide = 0, even_wide = 0;
};

class LineTracer {
 public:
  LineTracer(const RayTable& rays, const ValidationOptions& options);

  /// Takes the image for the traces that follow, and measures its noise.
  /// @param usable  Where edges may be.
  /// @param seen  Not set near the border of the image or the rim.
  /// @param min_contrast  What an edge must have, in grey levels.
  void setImage(const GreyPixels& pixels,
                const BitRows& usable,
                const BitRows& seen,
                double min_contrast);
  /// Measures the image's blur where its pieces show edges that stand alone; before the traces of
  /// an image, or they assume what they knew before.
  void measureBlur(const std::vector<PlanarPiece>& pieces,
                   const std::vector<Eigen::Vector2f>& nodes);
  [[nodiscard]] const ResponseNoise& noise() const { return noise_; }

  /// From the middle of the piece in both directions, four rows (columns) at a time. Four rows show
  /// an edge if the mean response is that of a step of either sign above the noise, within the
  /// bound of the residuals of the curve. The plane is refitted as the line grows. The line ends
  /// where more than max_gap_px show no edge; a gap is only crossed to reach at least kMinRunPx
  /// more. A line that still shows an edge where the camera's image ends is taken to go
  /// on to the border or rim itself, but at most max_gap_px. No value if fewer than min_length_px
  /// remain.
  [[nodiscard]] std::optional<TracedLine> trace(const PlanarPiece& piece,
                                                const std::vector<Eigen::Vector2f>& nodes);

  /// Four rows of the last trace, from its first to its last point.
  struct Quad {
    Eigen::Vector3d ray;     // of the curve in the middle
    Eigen::Vector3d across;  // change of the ray per px across the rows
    float x, y;              // of the curve in the middle
    float slope;             // px across per row
    float perpendicular;     // px of distance per px across
    EdgeResponse mean;
    float turn;                     // change of the even response from row to row
    std::array<float, 4> odd;       // by row, in the order of the walk
    float offset_px, variance_px2;  // of the edge from the curve, across; of its noise
    float drift_px;                 // what the edges before it were off by
    bool crosses_rows, is_edge;
    int8_t way;  // of the walk along the rows, +1 or -1
  };
  [[nodiscard]] const std::vector<Quad>& quads() const { return quads_; }

  static constexpr int kMinRunPx = 8;
  static constexpr int kQuadPx = 4;
  static constexpr size_t kMinQuads = 3;

 private:
  struct Front {
    Eigen::Vector2d position;  // on the curve, at the border between two rows
    bool crosses_rows = true;
    bool has_slope = false;  // of the eight rows before, which crossed the same way
    double slope = 0, bend = 0;
    bool ended = false;
    bool at_border = false;  // where the camera ends
    bool at_limit = false;   // of what a line subtends
  };
  struct End {
    Eigen::Vector2d px;
    Eigen::Vector3d ray;
  };

  void measureNoise();
  bool orient(Front* front) const;
  bool evaluate(Front* front, int direction, std::array<Quad, 2>* quads) const;
  bool evaluateAround(const Eigen::Vector2f& px, std::array<Quad, 2>* quads) const;
  void judge(Quad* quad) const;
  [[nodiscard]] float sideOf(const Quad& quad) const;
  void add(const Quad& quad);
  void extend(int direction, Front* front);
  bool refit();
  void refine();
  void forgetEdge();
  void moveBarSides();
  [[nodiscard]] bool isArc(const Eigen::Vector3d& normal) const;
  [[nodiscard]] double scoreOf() const;
  [[nodiscard]] double levelAt(size_t first, size_t last, bool wide) const;
  [[nodiscard]] int rowsOfEnd(size_t first, size_t last) const;
  [[nodiscard]] double greyAt(const Eigen::Vector2d& px) const;
  [[nodiscard]] End endOf(size_t first, size_t last, bool at_border) const;
  template <class Iterator>
  [[nodiscard]] ptrdiff_t looseQuads(Iterator tip, Iterator other_end) const;
  bool cutEnds(Front* front, Front* back);

  const RayTable& rays_;
  const BitRows *usable_ = nullptr, *seen_ = nullptr;
  ValidationOptions options_;
  EdgeProfiler profiler_;
  GreyPixels pixels_;
  ResponseNoise noise_;
  const BarProfiles& bars_;
  double blur_px2_;  // variance across an edge that stands alone, optics and pixel
  float min_odd_narrow_ = 0, min_odd_wide_ = 0;

  std::vector<Quad> quads_;
  RayMoments moments_;
  Eigen::Vector3d normal_;
  bool wide_ = false;   // which filters judge
  float bound_px_ = 1;  // of the distance of an edge from ...
  float drift_px_ = 0;  // ... what the edges before it showed (calibrations are off by that) ...
  float drift_rate_ = 0;
  float widest_px_ = 1;    // ... and from the curve
  float offset_gain_ = 1;  // of narrow offsets, by this line's sharpness
  int points_ = 0, points_at_fit_ = 0;
  double angle_rad_ = 0;
};

}  // namespace dlsd
