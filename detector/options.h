#pragma once
// What can be set. One aggregate per step; all lengths are in pixels of the image as given, all
// grey levels on the 8-bit scale whatever the pixel type.

#include <numbers>

namespace dlsd {

/// Step 1: edge chains. Gradients are those of the smoothed image, in grey levels per pixel: a step
/// of contrast c seen through optical blur 0.7 px peaks at about 0.27 c.
struct EdgeDrawingOptions {
  double anchor_gradient = 2;  ///< A chain needs one pixel of at least this. In [0, 1000].
  double min_gradient = 1.25;  ///< Chains end below. In [0, anchor_gradient].
  /// The same two in units of the gradient's noise (standard deviation of one component), which is
  /// measured in each image; the larger bound holds. In [0, 100]; 0 switches the measurement off.
  double anchor_noise_ratio = 4;
  double min_noise_ratio = 2.2;
  int anchor_interval_px = 2;  ///< Rows and columns on which anchors are looked for. In [1, 64].
  int min_chain_px = 10;       ///< Shorter chains are dropped. In [2, 1000].
  void check() const;          ///< Throws std::invalid_argument naming field, value and range.
};

/// Step 2 of the paper (4.2): straight pieces of a chain, grouped into smooth convex polygons.
struct PolygonalChainOptions {
  double max_line_err_px = 1;  ///< A straight piece ends where a pixel is farther. In (0, 100].
  int min_line_px = 10;        ///< Pixels that start a straight piece. In [3, 1000].
  double max_turn_rad =
      std::numbers::pi / 16;  ///< theta, between consecutive pieces. In (0, pi/2].
  double min_single_px = 25;  ///< Chains of one shorter straight piece are dropped. In [0, 10000].
  void check() const;
};

/// Step 2 of the default: pieces of a chain that lie in one plane through the optical centre.
struct PlanarChainOptions {
  int seed_px = 10;       ///< Shorter pieces are dropped. In [4, 1000].
  double max_err_px = 1;  ///< A chain is split where it is farther from a plane. In (0, 100].
  void check() const;
};

/// Last step: what the image must show of the line.
struct ValidationOptions {
  double rho_px = 1;  ///< Largest reprojection error of an edge pixel (Eq. 8). In (0, 100].
  /// The default's tests, made along the curve of the fitted plane in steps of one pixel.
  double tight_rho_px = 0.5;       ///< Bound for edges of little noise. In (0, rho_px].
  double max_residual_sigmas = 3;  ///< Bound in standard deviations of the residuals. In [1, 100].
  int max_gap_px = 7;  ///< Steps without an edge that do not end the line. In [0, 1000].
  /// Edges that bend away from the plane's image with a smaller radius, by more than noise
  /// explains, are arcs of curved things. In [0, 1e9]; 0 switches the test off.
  double min_bend_radius_px = 1000;
  double min_length_px = 15;  ///< In [2, 10000].
  double min_score = 0;       ///< -log10 of the number of false alarms. In [-100, 1e6].
  void check() const;
};

struct DetectorOptions {
  /// kConvexPolygons is the paper: convex polygons from chains, each validated as a whole, kept or
  /// dropped. kPlanarPieces is the default: chains are split where the plane stops fitting, and
  /// each piece is traced along its plane's image as far as the image shows an edge.
  enum class Method { kConvexPolygons, kPlanarPieces };

  Method method = Method::kPlanarPieces;
  EdgeDrawingOptions edges;
  PolygonalChainOptions polygons;  ///< Read by kConvexPolygons.
  PlanarChainOptions planes;       ///< Read by kPlanarPieces.
  ValidationOptions validation;    ///< kConvexPolygons reads rho_px only.

  void check() const;

  /// The paper's algorithm: integer pixels, theta = pi/16, rho = 4 px, single straight pieces
  /// shorter than 25 px dropped, the ends of every straight piece validated, a chain with one bad
  /// end dropped. The paper is silent on: gradient thresholds (here fixed, no measurement of
  /// noise), line fit error (1 px, as EDLines), and on the sign of a turn of exactly 0 (it breaks
  /// no convexity).
  [[nodiscard]] static DetectorOptions paper();
};

}  // namespace dlsd
