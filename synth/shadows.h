#pragma once
// Borders of the shadows that straight edges cast on planes: straight edges, too.

#include <optional>
#include <vector>

#include "synth/raycaster.h"
#include "synth/scene.h"

namespace dlsd {

/// The plane of a face or disc on which a shadow falls.
struct LitPlane {
  Eigen::Vector3d origin, normal;  ///< The normal points to the light's side.
};
/// That of a shadow's border.
[[nodiscard]] LitPlane litPlaneOf(const Scene& scene, const Edge& shadow);

/// Where a place of an edge at `point` casts its shadow: the ray from the light through it meets
/// the plane. No value if the light does not fall onto the plane's front, or the plane lies before
/// the point.
[[nodiscard]] std::optional<Eigen::Vector3d> shadowOnPlane(const Light& light,
                                                           const Eigen::Vector3d& point,
                                                           const LitPlane& plane);

/// All shadow borders on faces and discs: for each light that casts shadows and each edge at which
/// a solid ends as seen from the light (one of its faces looks at the light, the other does not),
/// the pieces that the light reaches, projected onto the face behind; the sides of cylinders
/// likewise, if addRodSidesFromLights has made edges of them. Of rods the shadow of the centre line
/// besides.
///
/// A shadow's border can only begin, end or change from one face to another where the edge, as seen
/// from the light, crosses another edge or the outline of a sphere, disc or tube, or enters a
/// sphere. These places have closed forms (of tubes: see tubes.h); between two neighbours two ray
/// tests decide: is the edge lit, and what lies behind it. What falls on round things is left out
/// (no straight line, or no face), and what falls right onto an edge of the face behind.
///
/// Carriers are not numbered.
[[nodiscard]] std::vector<Edge> shadowEdges(const Scene& scene, const Raycaster& raycaster);

/// Appends the sides of cylinders as seen from the lights that cast shadows to the scene's edges;
/// they cast borders and are not seen themselves.
void addRodSidesFromLights(Scene* scene);

/// Appends all of these to the scene's edges and numbers all carriers anew; the old ones keep
/// theirs unless a shadow's border continues one of them. Does nothing to a scene without such
/// lights.
void addShadowEdges(const Raycaster& raycaster, Scene* scene);

}  // namespace dlsd
