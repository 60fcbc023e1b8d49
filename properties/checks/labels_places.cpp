// Single places: on labels the picture jumps, and what is visible is what brute force finds.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "properties/checks/label_view.h"
#include "synth/dataset/random.h"
#include "synth/shadows.h"
#include "synth/visibility_oracle.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNearbyRad = 2e-5;
/// Nearer to a border, rays of floats may be on either side.
constexpr double kRoundingRad = 3e-7;
/// Before what is no longer than this, rays of floats need not see what hides it.
constexpr double kShortEdgeRad = 2e-5;
/// Where the contrast is stated.
constexpr double kBesideRad = 2e-4;

double distanceToCurve(const std::vector<Vector2d>& curve, const Vector2d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < curve.size(); ++i) {
    nearest = std::min(nearest, distanceTo(curve[i - 1], curve[i], p));
  }
  return nearest;
}

/// The point of a label (camera frame) at this angle from its first end.
Vector3d pointAt(const LabelLine& line, double phi) {
  const auto& [a, b] = line.points_in_cam;
  const Vector3d normal = a.cross(b).normalized();
  const Vector3d from = a.normalized(), side = normal.cross(from);
  const Vector3d across = normal.cross(std::cos(phi) * from + std::sin(phi) * side);
  return a + (b - a) * (across.dot(a) / across.dot(a - b));
}

/// Whether what casts this border stands so near to a point of it (camera frame) that pictures show
/// no shadow there.
bool isInShadowGap(const Viewed& seen, const LabelLine& line, const Vector3d& point_in_cam) {
  const Edge& border = seen.scene.edges[static_cast<size_t>(line.edge)];
  if (border.source != EdgeSource::kShadow) return false;
  const Vector3d point =
      seen.pose.cam_from_world.transpose() * point_in_cam + seen.pose.position_in_world;
  const Edge& caster = seen.scene.edges[static_cast<size_t>(border.caster)];
  const Light& light = seen.scene.lights[static_cast<size_t>(border.light)];
  const bool is_sun = light.kind == Light::Kind::kSun;
  const Vector3d way = is_sun ? Vector3d(kSunDistance * light.place) : light.place - point;
  const Vector3d to_light = way.normalized(), d = caster.to - caster.from;
  const double cosine = litPlaneOf(seen.scene, border).normal.dot(to_light);
  const Vector3d across = d.cross(to_light).cross(to_light);  // In the caster's plane.
  const Vector3d place = caster.from + d * (across.dot(point - caster.from) / across.dot(d));
  return to_light.dot(place - point) <= shadowGap(way.norm(), cosine);
}

}  // namespace

// To both sides of a label's curve there are different surfaces, or light and shadow, 2e-5 rad off
// or, where the next border is nearer than that, less; 2e-4 rad off, grey levels differ by its
// least contrast.
LabelsOutcome checkOnBorders(const LabelCase& c, bool with_shown) {
  const Camera& camera = c.camera;
  SceneView view = viewOf(c);
  const Viewed seen(std::move(view.scene), view.pose, camera);
  const Eye eye(seen, camera);
  LabelsOutcome outcome;
  if (with_shown) outcome.shown = {seen.shown(camera)};
  const auto fail = [&](const LabelLine& line, const Vector2d& at, const std::string& what) {
    outcome.details.push_back(
        fmt::format("label {}, {}, at {}: {}", line.id, toString(line.kind), textOf(at), what));
    if (with_shown) addCross(at, &outcome.shown[0]);
  };
  for (const LabelLine& line : seen.labels.lines) {
    if (isMiddle(seen.scene, line) || line.contrast_min < 3) continue;
    // One of the places at which contrast is stated, through the image.
    const double phi = line.angle_rad * (line.id % kContrastPlaces + 0.5) / kContrastPlaces;
    // At an end, what is beyond it may be there, too.
    if (std::min(phi, line.angle_rad - phi) < 2 * kShortestSpanRad) {
      ++outcome.at_ends;
      continue;
    }
    const Vector3d point = pointAt(line, phi);
    if (isInShadowGap(seen, line, point)) {
      ++outcome.in_gaps;
      continue;
    }
    ++outcome.counted;
    const auto p = camera.project(point);
    const auto ray = p ? camera.unproject(*p) : std::nullopt;
    if (!ray) {
      fail(line, line.points.front(), "a place on it is not in the picture");
      continue;
    }
    if (!(distanceToCurve(line.points, *p) <= 0.0101)) {
      fail(line, *p, fmt::format("{:.3g} px from its curve", distanceToCurve(line.points, *p)));
      continue;
    }
    const auto look = [&](double beside_rad) { return eye.along(*ray + beside_rad * line.normal); };
    // Where the next border is nearer than that, this one is seen from nearer still.
    bool is_border = false;
    for (double off = kNearbyRad; !is_border && off > kRoundingRad; off /= 2) {
      is_border = !look(off).isSame(look(-off));
    }
    const double step = std::abs(eye.grey(look(kBesideRad)) - eye.grey(look(-kBesideRad)));
    if (is_border && step >= 0.95 * line.contrast_min - 0.5) continue;
    fail(line,
         *p,
         fmt::format("{}, a step of {:.4g} grey levels, least contrast {:.4g}",
                     is_border ? "a border" : "no border",
                     step,
                     line.contrast_min));
  }
  outcome.applies = outcome.counted > 0;
  if (!outcome.details.empty()) {
    outcome.failure = fmt::format("{} of {} places on labels are wrong; {}",
                                  outcome.details.size(),
                                  outcome.counted,
                                  outcome.details[0]);
  }
  return outcome;
}

// A place on an edge is in a span if and only if brute force over all triangles and round things
// finds nothing before it.
LabelsOutcome checkVisible(const LabelCase& c, bool with_shown) {
  constexpr int kPlaces = 300, kLeastTested = 200;
  const Camera& camera = c.camera;
  SceneView view = viewOf(c);
  const Viewed seen(std::move(view.scene), view.pose, camera);
  const Vector3d eye = seen.pose.position_in_world;
  const VisibilityOracle oracle(seen.scene, eye);
  std::vector<std::vector<const EdgeSpan*>> by_edge(seen.scene.edges.size());
  for (const EdgeSpan& s : seen.spans) by_edge[static_cast<size_t>(s.edge)].push_back(&s);
  LabelsOutcome outcome;
  if (with_shown) outcome.shown = {seen.shown(camera)};
  Random random(c.seed, c.index);
  for (int k = 0; k < kPlaces && !seen.scene.edges.empty(); ++k) {
    const int e = random.nextInt(0, static_cast<int>(seen.scene.edges.size()) - 1);
    const double t = random.next(0, 1);
    const Edge& edge = seen.scene.edges[static_cast<size_t>(e)];
    if (angleTo(seen.pose.toCam(edge.from), seen.pose.toCam(edge.to)) < kShortEdgeRad) {
      ++outcome.on_short_edges;
      continue;
    }
    const Vector3d point = edge.from + t * (edge.to - edge.from);
    const Vector3d ray = seen.pose.toCam(point);
    const auto pixel = camera.project(ray);
    const bool expected = pixel && camera.inImage(*pixel) && !looksAway(seen.scene, edge, eye) &&
                          !oracle.hidden(edge, point);
    bool found = false;
    double nearest_end = 1;
    for (const EdgeSpan* s : by_edge[static_cast<size_t>(e)]) {
      const double phi = angleTo(s->arc.from, ray);
      found = found || (phi >= s->phi0 && phi <= s->phi1);
      nearest_end = std::min({nearest_end, std::abs(phi - s->phi0), std::abs(phi - s->phi1)});
    }
    if (nearest_end < 2 * kShortestSpanRad) continue;  // At an end both answers are right.
    ++outcome.counted;
    if (found == expected) continue;
    outcome.details.push_back(fmt::format(
        "edge {} at {:.6g} of its length, {}: {}",
        e,
        t,
        pixel ? textOf(*pixel) : "not in the picture",
        found ? "in a span, hidden by brute force" : "in no span, visible by brute force"));
    if (with_shown && pixel) addCross(*pixel, &outcome.shown[0]);
  }
  if (!outcome.details.empty()) {
    outcome.failure = fmt::format("{} of {} places on edges are wrong; {}",
                                  outcome.details.size(),
                                  outcome.counted,
                                  outcome.details[0]);
  } else if (c.parts) {
    outcome.applies = outcome.counted > 0;  // What is left of a scene may be little.
  } else if (!(outcome.counted > kLeastTested)) {
    outcome.failure =
        fmt::format("only {} of {} places on edges could be told", outcome.counted, kPlaces);
  }
  return outcome;
}

}  // namespace dlsd
