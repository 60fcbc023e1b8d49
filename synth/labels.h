#pragma once
// Exact labels: which pieces of which edges a camera sees, computed from geometry and ray tests,
// never from pixels.
//
// An edge is an arc of a great circle of directions. Its visibility can only change where the arc
// crosses the arc of an edge that is an outline from here (one of its two faces looks at the
// camera, or it is a cylinder's side), the outline of a sphere, disc or tube, or enters a sphere.
// These directions are computed in closed form (tubes: to rounding, tubes.h); between two
// neighbours one ray test decides. So no occluder is too thin to be seen, and span ends are as
// exact as double arithmetic on the float-rounded vertices.

#include <vector>

#include "cameras/arc.h"
#include "synth/dataset/records.h"
#include "synth/raycaster.h"
#include "synth/scene.h"
#include "synth/sensor.h"
#include "synth/shading.h"

namespace dlsd {

/// Spans and gaps shorter than this (rad) are dropped and closed: 5e-4 px in a 500 px/rad camera.
/// Where two places at which something may change are that near to each other, a span may end at
/// either: rays of floats do not see what is in between.
inline constexpr double kShortestSpanRad = 1e-6;

/// Spans shorter than this (rad) have no label: they are 0.05 px in a 500 px/rad camera, half as far
/// as contrast and kind are looked at beside them, and not much more than rays of floats tell apart.
inline constexpr double kShortestLabelRad = 1e-4;

/// A rod is labelled by its centre line (`wire`) in a view in which it is nowhere thicker than
/// this.
inline constexpr double kThickRodPx = 3;

/// A piece of an edge that the camera sees.
struct EdgeSpan {
  int edge;
  Arc arc;            ///< The whole edge, camera frame; from and to as in the scene.
  double phi0, phi1;  ///< Angles from arc.from, rad.
  std::array<EndKind, 2> ends;
  std::vector<Eigen::Vector2d> curve;  ///< imageCurve of the piece, chord error <= 0.01 px.
};

/// All visible spans of all edges, in order of edges; of rods both the centre line and the edges of
/// the prism or sides of the cylinder. Edges that look away (all their faces seen from behind) have
/// none. The scene's edges hold the sides of cylinders as seen from here (addRodSides, tubes.h).
[[nodiscard]] std::vector<EdgeSpan> visibleSpans(const Scene& scene,
                                                 const Raycaster& raycaster,
                                                 const Camera& camera,
                                                 const Pose& pose);

struct Labels {
  std::vector<LabelLine> lines;
  std::vector<Junction> junctions;
};

/// Labels of the spans of at least kShortestLabelRad.
///
/// Rods: the width in px, 2 * radius seen across the centre line, is taken at 17 points of each
/// imaged piece of the centre line (hidden or not); if the largest is >= kThickRodPx, or nothing of
/// the centre line is in the image, the rod is labelled by its prism edges, else by its centre
/// line. A rod's shadow on a face likewise: by its borders or its middle; by its borders, too, if one
/// of them shows on that face for over 10 px more than the middle (which may lie on a panel before
/// it). What is labelled by its middle has no label where that is hidden, though a border may show.
///
/// Kind: decal borders are `material`, centre lines `wire`, borders of shadows `shadow` (present if
/// the scene's edges hold them, see shadows.h). An edge of two faces is `crease` if
/// both look at the camera, or where both sides of it in the image show faces that contain it (its
/// own and the surface on which the solid stands), else `silhouette`, as are sides of cylinders.
///
/// Contrast: |difference| of grey levels before noise and blur, after exposure and encoding,
/// between rays 2e-4 rad to both sides, at 11 points spread evenly over the span. For wires:
/// between the centre and the mean of both sides of the rod, times what pixel and optical blur
/// leave of it in the middle of a stripe of that width, erf(width / (2 sqrt(2) sqrt(psf_sigma^2 +
/// 1/12))); for the middles of shadows likewise.
[[nodiscard]] Labels makeLabels(const Scene& scene,
                                const Raycaster& raycaster,
                                const Shader& shader,
                                const Camera& camera,
                                const Pose& pose,
                                const SensorOptions& sensor,
                                const std::vector<EdgeSpan>& spans);

}  // namespace dlsd
