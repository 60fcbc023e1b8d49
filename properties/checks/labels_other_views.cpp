// What must not change where the same scene is seen otherwise: through another lens, turned,
// mirrored.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "properties/checks/label_view.h"
#include "properties/checks/test_image.h"
#include "synth/shadows.h"
#include "synth/tubes.h"
#include "synth/visibility_oracle.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A map of the world that floats survive.
struct WorldMap {
  Eigen::Matrix3d linear;
  [[nodiscard]] Vector3d operator()(const Vector3d& p) const { return linear * p; }
  [[nodiscard]] Eigen::Vector3f operator()(const Eigen::Vector3f& p) const {
    return linear.cast<float>() * p;
  }

  [[nodiscard]] Scene of(Scene scene) const {
    for (auto& v : scene.vertices) v = (*this)(v);
    if (linear.determinant() < 0) turnRound(&scene);
    for (Face& f : scene.faces) {
      for (Vector3d* v : {&f.origin, &f.e1, &f.e2, &f.normal}) *v = (*this)(*v);
    }
    for (Sphere& s : scene.spheres) s.centre = (*this)(s.centre);
    for (Disc& d : scene.discs) {
      d.centre = (*this)(d.centre);
      d.normal = (*this)(d.normal);
    }
    for (Tube& tube : scene.tubes) {
      for (Vector3d* v : {&tube.centre, &tube.x, &tube.y}) *v = (*this)(*v);
    }
    for (Rod& r : scene.rods) {
      r.from = (*this)(r.from);
      r.to = (*this)(r.to);
    }
    for (Edge& e : scene.edges) {
      e.from = (*this)(e.from);
      e.to = (*this)(e.to);
    }
    for (Light& l : scene.lights) l.place = (*this)(l.place);
    return scene;
  }

  /// Corners of triangles in the other order, as mirrored normals want.
  static void turnRound(Scene* scene) {
    std::vector<char> is_rod_side(scene->faces.size(), 0);
    for (const Rod& rod : scene->rods) {
      std::fill_n(is_rod_side.begin() + rod.first_face, rod.face_count - 2, 1);
    }
    for (size_t t = 0; t < scene->triangles.size(); ++t) {
      auto& first = scene->triangles[t].vertices;
      if (is_rod_side[static_cast<size_t>(scene->triangles[t].face)] == 0) {
        std::swap(first[1], first[2]);
        continue;
      }
      // The ray caster cuts the sides of rods, pairs (a, b, c), (a, c, d), between a, b and c, d.
      auto& second = scene->triangles[++t].vertices;
      const auto [a, b, c] = first;
      const int d = second[2];
      first = {b, a, d};
      second = {b, d, c};
    }
  }
};

bool isInner(EndKind kind) {
  return kind == EndKind::kVertex || kind == EndKind::kOccluder;
}

/// The same scene seen twice.
struct TwoViews {
  const Viewed& a;
  const Viewed& b;
  const Camera& camera_a;
  const Camera& camera_b;
  std::function<Vector3d(const Vector3d&)> map;       ///< From the camera frame of a to that of b.
  std::function<Vector2d(const Vector2d&)> mapPixel;  ///< Pixels likewise.
};

/// What may be otherwise in few labels.
struct Differences {
  size_t contrast = 0, ends = 0;
};

/// How a label is another one in the second view, one line. Empty: it is the same.
std::string differenceOf(const TwoViews& views,
                         const LabelLine& p,
                         const LabelLine& q,
                         Differences* differences) {
  if (p.edge != q.edge) return "of another edge";
  if (p.kind != q.kind) return fmt::format("{} and {}", toString(p.kind), toString(q.kind));
  if (p.ends != q.ends) return "with ends of other kinds";
  // Where something begins 2e-4 rad from the line, one of its places depends on the last bit.
  const double step = std::abs(p.contrast - q.contrast);
  if (!(step <= 0.5 + 255.0 / kContrastPlaces)) {
    return fmt::format("contrast {:.4g} and {:.4g}", p.contrast, q.contrast);
  }
  differences->contrast += step <= 0.5 + 0.1 * p.contrast ? 0 : 1;
  for (size_t end = 0; end < 2; ++end) {
    const Vector3d& at = p.points_in_cam[end];
    const double off_rad = angleTo(views.map(at), q.points_in_cam[end]);
    // Of two places at which a line may end that are nearer to each other than floats resolve, a
    // ray test between them chooses by its last bit.
    if (!(off_rad <= kShortestSpanRad)) return fmt::format("an end {:.3g} rad elsewhere", off_rad);
    differences->ends += off_rad <= 1e-9 ? 0 : 1;
    const auto J = views.camera_a.jacobian(at);
    const double off_px = J ? J->norm() * at.norm() * off_rad : 0;
    const auto& from = end == 0 ? p.points.front() : p.points.back();
    const auto& to = end == 0 ? q.points.front() : q.points.back();
    const double apart_px = (views.mapPixel(from) - to).norm();
    if (!(apart_px <= 1e-5 + off_px)) return fmt::format("an end {:.3g} px elsewhere", apart_px);
  }
  return "";
}

void compareLabels(const TwoViews& views, LabelsOutcome* outcome) {
  const std::vector<LabelLine>&lines = views.a.labels.lines, &others = views.b.labels.lines;
  outcome->counted = static_cast<long>(lines.size());
  Differences differences;
  if (lines.size() != others.size()) {
    outcome->failure = fmt::format("{} labels, {} in the other view", lines.size(), others.size());
    if (outcome->shown.empty()) return;
    // The first that has no counterpart, if it is not another kind of difference.
    size_t i = 0;
    while (i < std::min(lines.size(), others.size()) &&
           differenceOf(views, lines[i], others[i], &differences).empty()) {
      ++i;
    }
    if (i < lines.size()) outcome->shown[0].failed = {lines[i].points};
    if (i < others.size()) outcome->shown[1].failed = {others[i].points};
    return;
  }
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string what = differenceOf(views, lines[i], others[i], &differences);
    if (what.empty()) continue;
    outcome->failure = fmt::format("label {}, {} to {}, is another in the other view: {}",
                                   lines[i].id,
                                   textOf(lines[i].points.front()),
                                   textOf(lines[i].points.back()),
                                   what);
    if (!outcome->shown.empty()) {
      outcome->shown[0].failed = {lines[i].points};
      outcome->shown[1].failed = {others[i].points};
    }
    return;
  }
  const size_t most = 1 + lines.size() / 200;
  if (differences.contrast > most || differences.ends > most) {
    outcome->failure = fmt::format("of {} labels {} have another contrast, {} ends are elsewhere",
                                   lines.size(),
                                   differences.contrast,
                                   differences.ends);
  } else if (views.a.labels.junctions.size() != views.b.labels.junctions.size()) {
    outcome->failure = "another number of junctions in the other view";
  }
}

/// Pixels that differ by more than `levels`: at most `most`.
void comparePictures(const TwoViews& views, double levels, size_t most, LabelsOutcome* outcome) {
  const Camera& camera = views.camera_a;
  const std::vector<float> image = views.a.render(camera), other = views.b.render(views.camera_b);
  const auto at = [&](const Vector2d& pixel) {
    return static_cast<size_t>(pixel.y()) * static_cast<size_t>(camera.width()) +
           static_cast<size_t>(pixel.x());
  };
  std::vector<Vector2d> differ;
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) {
      const Vector2d pixel(x, y);
      const float step = std::abs(image[at(pixel)] - other[at(views.mapPixel(pixel))]) * 255;
      if (!(static_cast<double>(step) <= levels)) differ.push_back(pixel);
    }
  }
  outcome->errors = {static_cast<double>(differ.size()) / static_cast<double>(image.size())};
  if (differ.size() <= most) return;
  outcome->failure = fmt::format(
      "{} of {} pixels differ by more than {} grey levels", differ.size(), image.size(), levels);
  if (outcome->shown.empty()) return;
  constexpr size_t kMostShown = 1000;  // Viewers of SVG don't open any number.
  differ.resize(std::min(differ.size(), kMostShown));
  for (const Vector2d& pixel : differ) addCross(pixel, &outcome->shown[0]);
}

LabelsOutcome compare(const TwoViews& views, double levels, size_t most_pixels, bool with_shown) {
  LabelsOutcome outcome;
  if (with_shown) outcome.shown = {views.a.shown(views.camera_a), views.b.shown(views.camera_b)};
  compareLabels(views, &outcome);
  if (outcome.failure.empty()) comparePictures(views, levels, most_pixels, &outcome);
  return outcome;
}

size_t pixelsOf(const Camera& camera) {
  return static_cast<size_t>(camera.width()) * static_cast<size_t>(camera.height());
}

}  // namespace

// What two cameras of one pose both see entirely are the same arcs.
LabelsOutcome checkOtherLens(const LabelCase& c, bool with_shown) {
  const Camera &one = c.camera, &other = *c.other;
  const SceneView view = viewOf(c);
  Scene scene = view.scene;
  const Raycaster raycaster(scene);
  addRodSides(view.pose.position_in_world, &scene);
  addShadowEdges(raycaster, &scene);
  LabelsOutcome outcome;
  if (with_shown) {
    for (const Camera* camera : {&one, &other}) {
      outcome.shown.push_back(Viewed(view.scene, view.pose, *camera).shown(*camera));
    }
  }
  std::multimap<int, const EdgeSpan*> by_edge;
  const auto spans = visibleSpans(scene, raycaster, one, view.pose);
  const auto others = visibleSpans(scene, raycaster, other, view.pose);
  for (const EdgeSpan& s : others) by_edge.emplace(s.edge, &s);
  for (const EdgeSpan& s : spans) {
    const auto [first, last] = by_edge.equal_range(s.edge);
    for (auto it = first; it != last; ++it) {
      const EdgeSpan& o = *it->second;
      if (o.phi0 > s.phi1 || o.phi1 < s.phi0) continue;
      for (size_t end = 0; end < 2; ++end) {
        if (!isInner(s.ends[end]) || !isInner(o.ends[end])) continue;
        ++outcome.counted;
        const double a = end == 0 ? s.phi0 : s.phi1, b = end == 0 ? o.phi0 : o.phi1;
        outcome.errors.push_back(std::abs(a - b));
        if (s.ends[end] == o.ends[end] && std::abs(a - b) <= 1e-9) continue;
        const auto at = [&](const EdgeSpan& span) {
          return end == 0 ? span.curve.front() : span.curve.back();
        };
        outcome.details.push_back(
            fmt::format("edge {}: {} at {}, {} at {} of the other camera, {:.3g} rad apart",
                        s.edge,
                        toString(s.ends[end]),
                        textOf(at(s)),
                        toString(o.ends[end]),
                        textOf(at(o)),
                        std::abs(a - b)));
        if (!with_shown) continue;
        addCross(at(s), &outcome.shown[0]);
        addCross(at(o), &outcome.shown[1]);
      }
    }
  }
  outcome.applies = outcome.counted > 0;
  if (!outcome.details.empty()) {
    outcome.failure = fmt::format(
        "{} of {} ends differ; {}", outcome.details.size(), outcome.counted, outcome.details[0]);
  }
  return outcome;
}

// Camera and scene turned together by a quarter about the vertical (exact in floats): the same
// labels, the same picture.
LabelsOutcome checkTurned(const LabelCase& c, bool with_shown) {
  const SceneView view = viewOf(c);
  WorldMap turn;
  turn.linear << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  Pose turned_pose;
  turned_pose.cam_from_world = view.pose.cam_from_world * turn.linear.transpose();
  turned_pose.position_in_world = turn(view.pose.position_in_world);
  const Viewed seen(view.scene, view.pose, c.camera),
      turned(turn.of(view.scene), turned_pose, c.camera);
  return compare({seen,
                  turned,
                  c.camera,
                  c.camera,
                  [](const Vector3d& p) { return p; },
                  [](const Vector2d& p) { return p; }},
                 1,
                 2 + pixelsOf(c.camera) / 5000,
                 with_shown);
}

LabelsOutcome checkMirrored(const LabelCase& c, bool with_shown) {
  const SceneView view = viewOf(c);
  const Eigen::Matrix3d flip = Vector3d(-1, 1, 1).asDiagonal();
  const WorldMap mirror{flip};
  Pose pose;
  pose.cam_from_world = flip * view.pose.cam_from_world * flip;
  pose.position_in_world = mirror(view.pose.position_in_world);
  const Camera other = mirroredCamera(c.camera);
  const Viewed seen(view.scene, view.pose, c.camera), flipped(mirror.of(view.scene), pose, other);
  // Samples are not mirrored: pixels agree as well as 64 samples answer.
  return compare({seen,
                  flipped,
                  c.camera,
                  other,
                  [&](const Vector3d& p) -> Vector3d { return flip * p; },
                  [&](const Vector2d& p) -> Vector2d {
                    return {c.camera.width() - 1 - p.x(), p.y()};
                  }},
                 8,
                 2 + pixelsOf(c.camera) / 1000,
                 with_shown);
}

}  // namespace dlsd
