#include "synth/labels.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "cameras/mutant.h"
#include "synth/dataset/statistics.h"
#include "synth/shadows.h"
#include "synth/tubes.h"

namespace dlsd {
namespace {

/// A face "contains" an edge if both ends are this near to its plane (m): float rounding of
/// vertices up to 16 m from the origin, with room. A plane that contains an edge meets a ray to it
/// nowhere else, so such a face never hides it.
constexpr double kInPlane = 5e-6;
/// Directions of the same crossing computed in two ways agree to this, rad.
constexpr double kSameDirection = 1e-9;
constexpr double kContrastOffsetRad = 2e-4;
constexpr int kContrastPoints = 11;
constexpr int kWidthPoints = 17;

/// An edge as an arc in the camera frame, ready for crossings.
struct EdgeArc {
  int edge;
  Arc arc;
  Eigen::Vector3d side;    ///< Unit, in the plane, a quarter turn from arc.from towards arc.to.
  Eigen::Vector3d normal;  ///< arc.from x side.
  Eigen::Vector3d middle;  ///< Unit direction to the middle of the arc.
  double angle, cos_half, sin_half;
  double nearest, farthest;  ///< Distances of the segment to the camera, m.

  [[nodiscard]] Eigen::Vector3d at(double phi) const {
    return std::cos(phi) * arc.from + std::sin(phi) * side;
  }
  [[nodiscard]] double phiOf(const Eigen::Vector3d& direction) const {
    return std::atan2(direction.dot(side), direction.dot(arc.from));
  }
};

/// The edges' ends in the camera frame.
struct Segment {
  Eigen::Vector3d from, to;
  [[nodiscard]] double nearestDistance() const {
    const Eigen::Vector3d d = to - from;
    const double s = std::clamp(-from.dot(d) / d.squaredNorm(), 0.0, 1.0);
    return (from + s * d).norm();
  }
};

Segment segmentOf(const Edge& edge, const Pose& pose) {
  return {pose.toCam(edge.from), pose.toCam(edge.to)};
}

std::optional<EdgeArc> edgeArc(const Scene& scene, const Pose& pose, int index) {
  const Segment s = segmentOf(scene.edges[static_cast<size_t>(index)], pose);
  const auto arc = arcBetween(s.from, s.to);
  if (!arc) return std::nullopt;  // The line goes through the camera: it is seen as a point.
  EdgeArc e;
  e.edge = index;
  e.arc = *arc;
  e.normal = s.from.cross(s.to).normalized();
  e.side = e.normal.cross(arc->from);
  e.angle = arc->angle();
  e.middle = e.at(e.angle / 2);
  e.cos_half = std::cos(e.angle / 2);
  e.sin_half = std::sin(e.angle / 2);
  e.nearest = s.nearestDistance();
  e.farthest = std::max(s.from.norm(), s.to.norm());
  return e;
}

/// Where the segment of an arc is met by the ray at angle phi, as a fraction of the segment.
double fractionAt(const EdgeArc& e, const Segment& s, double phi) {
  const Eigen::Vector2d a(s.from.dot(e.arc.from), s.from.dot(e.side));
  const Eigen::Vector2d b(s.to.dot(e.arc.from), s.to.dot(e.side));
  const Eigen::Vector2d d(std::cos(phi), std::sin(phi));
  const auto cross = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return p.x() * q.y() - p.y() * q.x();
  };
  return std::clamp(-cross(a, d) / cross(b - a, d), 0.0, 1.0);
}

/// Visibility events on one arc: angles at which it may change.
class Events {
 public:
  explicit Events(const EdgeArc& arc) : arc_(arc) {}

  void addDirection(const Eigen::Vector3d& direction) { addPhi(arc_.phiOf(direction)); }
  void addPhi(double phi) {
    if (phi > -kSameDirection && phi < arc_.angle + kSameDirection) phis_.push_back(phi);
  }

  /// Crossing with the arc of an outline.
  void addCrossing(const EdgeArc& other) {
    const double a0 = other.normal.dot(arc_.arc.from), a1 = other.normal.dot(arc_.arc.to);
    const double b0 = arc_.normal.dot(other.arc.from), b1 = arc_.normal.dot(other.arc.to);
    constexpr double kFlat = 1e-7;
    if (std::max(std::abs(a0), std::abs(a1)) < kFlat ||
        std::max(std::abs(b0), std::abs(b1)) < kFlat) {
      // Both in one plane through the camera: they overlap or not, the ends say it all.
      addDirection(other.arc.from);
      addDirection(other.arc.to);
      return;
    }
    const auto sameSide = [](double p, double q) {
      return p * q > 0 && std::min(std::abs(p), std::abs(q)) > kSameDirection;
    };
    if (sameSide(a0, a1) || sameSide(b0, b1)) return;
    Eigen::Vector3d d = arc_.normal.cross(other.normal);
    if (d.dot(arc_.middle) < 0) d = -d;
    if (d.dot(other.middle) < 0) return;  // They meet on opposite sides of the sphere.
    addDirection(d);
  }

  void addSphere(const Eigen::Vector3d& centre, double radius, const Segment& segment) {
    const double distance = centre.norm();
    if (distance > radius) {
      const Eigen::Vector3d c = centre / distance;
      const double x = arc_.arc.from.dot(c), y = arc_.side.dot(c);
      const double sine = radius / distance;
      const double ratio = std::sqrt((1 - sine) * (1 + sine)) / std::hypot(x, y);
      if (ratio <= 1) {
        const double at = std::atan2(y, x), half = std::acos(ratio);
        // Back into [-pi, pi], where the arc is [0, angle].
        addPhi(std::remainder(at - half, 2 * M_PI));
        if (!DLSD_MUTANT("label-sphere")) addPhi(std::remainder(at + half, 2 * M_PI));
      }
    }
    // Where the edge itself goes into the sphere (a rod into its node).
    const Eigen::Vector3d d = segment.to - segment.from, m = segment.from - centre;
    const double a = d.squaredNorm(), b = m.dot(d), c = m.squaredNorm() - radius * radius;
    const double disc = b * b - a * c;
    if (disc < 0) return;
    for (const double root : {std::sqrt(disc), -std::sqrt(disc)}) {
      const double s = (-b + root) / a;
      if (s > 0 && s < 1) addDirection(segment.from + s * d);
    }
  }

  void addDisc(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, double radius) {
    // The arc's plane meets the disc's plane in a line; the line meets the circle twice or never.
    const Eigen::Vector3d across = arc_.normal - normal * normal.dot(arc_.normal);
    const double across2 = across.squaredNorm();
    if (across2 < 1e-24) return;
    const Eigen::Vector3d foot = centre - across * (centre.dot(arc_.normal) / across2);
    const double rest2 = radius * radius - (foot - centre).squaredNorm();
    if (rest2 < 0) return;
    const Eigen::Vector3d along = normal.cross(across).normalized() * std::sqrt(rest2);
    addDirection(foot + along);
    if (!DLSD_MUTANT("label-disc")) addDirection(foot - along);
  }

  /// In the camera frame.
  void addTube(const Tube& tube) {
    const double middle = arc_.angle / 2;
    // Angles from the arc's middle: they jump behind the camera, where the arc is not.
    const auto covered = [&](const Eigen::Vector3d& c) -> std::array<double, 2> {
      const double x = arc_.arc.from.dot(c), y = arc_.side.dot(c);
      const double rest2 = c.squaredNorm() - tube.radius * tube.radius;
      const double ratio = std::sqrt(std::max(0.0, rest2)) / std::hypot(x, y);
      const double at = std::remainder(std::atan2(y, x) - middle, 2 * M_PI);
      const double half = std::acos(std::min(1.0, ratio));
      return {at - half, at + half};
    };
    const double shift = middle + (DLSD_MUTANT("tube-span") ? 2e-4 : 0);
    addTubeEvents(tube, arc_.normal, 0, covered, [&](double phi) { addPhi(phi + shift); });
  }

  /// Sorted angles inside (lo, hi), with both ends.
  [[nodiscard]] std::vector<double> cuts(double lo, double hi) {
    std::sort(phis_.begin(), phis_.end());
    std::vector<double> out{lo};
    for (const double phi : phis_) {
      if (phi > out.back() + kSameDirection && phi < hi - kSameDirection) out.push_back(phi);
    }
    out.push_back(hi);
    return out;
  }

 private:
  const EdgeArc& arc_;
  std::vector<double> phis_;
};

/// Answers which faces look at the camera, and whether something hides a point of an edge.
class View {
 public:
  View(const Scene& scene, const Raycaster& raycaster, const Pose& pose)
      : scene_(scene), raycaster_(raycaster), pose_(pose), height_(scene.faces.size()) {
    for (size_t f = 0; f < scene.faces.size(); ++f) {
      height_[f] = scene.faces[f].normal.dot(pose.position_in_world - scene.faces[f].origin);
    }
  }

  [[nodiscard]] bool looksAtCamera(int face) const { return height(face) > 0; }

  /// The edge may show: one of its faces looks at the camera. In the rounding of the plane both
  /// count.
  [[nodiscard]] bool mayShow(const Edge& edge) const {
    switch (edge.source) {
      case EdgeSource::kFaces:
        return height(edge.face0) > -kInPlane || height(edge.face1) > -kInPlane;
      case EdgeSource::kDecal:
        return height(edge.face0) > 0;
      case EdgeSource::kShadow: {
        const LitPlane plane = litPlaneOf(scene_, edge);
        return plane.normal.dot(pose_.position_in_world - plane.origin) > 0;
      }
      case EdgeSource::kRodCentre:
        return true;
      case EdgeSource::kRodSide:
        return edge.light < 0;
    }
    return false;
  }

  /// The edge may hide others: its two faces look different ways.
  [[nodiscard]] bool isOutline(const Edge& edge) const {
    if (edge.source == EdgeSource::kRodSide) return edge.light < 0;
    if (edge.source != EdgeSource::kFaces) return false;
    const double h0 = height(edge.face0), h1 = height(edge.face1);
    return std::min(h0, h1) < kInPlane && std::max(h0, h1) > -kInPlane;
  }

  [[nodiscard]] bool contains(int face, const Edge& edge) const {
    const Face& f = scene_.faces[static_cast<size_t>(face)];
    return std::abs(f.normal.dot(edge.from - f.origin)) < kInPlane &&
           std::abs(f.normal.dot(edge.to - f.origin)) < kInPlane;
  }

  [[nodiscard]] bool hidden(const Edge& edge, const Eigen::Vector3d& point) const {
    const Eigen::Vector3d d = point - pose_.position_in_world;
    const double distance = d.norm();
    const Eigen::Vector3f direction = (d / distance).cast<float>();
    // Contact aside, nothing is nearer to an edge than about 1 mm: 1e-5 of the distance is less.
    const auto end = static_cast<float>(distance * (DLSD_MUTANT("label-hidden") ? 0.99 : 1 - 1e-5));
    const auto looksThrough = [&](const Hit& hit) { return mayLookThrough(hit, edge); };
    const Eigen::Vector3f eye = pose_.position_in_world.cast<float>();
    return raycaster_.cast(eye, direction, 0, end, looksThrough).kind != HitKind::kNothing;
  }

 private:
  [[nodiscard]] double height(int face) const { return height_[static_cast<size_t>(face)]; }

  /// A rod does not hide its centre line, nor a cylinder its outline.
  [[nodiscard]] bool mayLookThrough(const Hit& hit, const Edge& edge) const {
    const bool of_rod =
        edge.source == EdgeSource::kRodCentre || edge.source == EdgeSource::kRodSide;
    if (of_rod && isOnRod(hit, scene_, edge.rod)) return true;
    if (hit.kind == HitKind::kDisc) return hit.index == edge.disc;
    return hit.kind == HitKind::kFace && contains(hit.index, edge);
  }

  const Scene& scene_;
  const Raycaster& raycaster_;
  const Pose& pose_;
  std::vector<double> height_;  ///< Of the camera over each face's plane, m.
};

EndKind endKind(ImageEnd end) {
  switch (end) {
    case ImageEnd::kArcEnd:
      return EndKind::kVertex;
    case ImageEnd::kBorder:
      return EndKind::kBorder;
    case ImageEnd::kRim:
      return EndKind::kRim;
    case ImageEnd::kSeam:
      return EndKind::kSeam;
  }
  return EndKind::kVertex;
}

/// To 1e-6 px, a thousandth of the labels' tolerance: files get half as long.
double roundPixel(double x) {
  const double steps = DLSD_MUTANT("label-rounding") ? 10 : 1e6;
  return std::round(x * steps) / steps;
}

/// Width in px of a rod at a fraction of its centre line; 0 outside the domain.
double rodWidthPx(const Scene& scene,
                  const Camera& camera,
                  const Edge& centre_line,
                  const EdgeArc& arc,
                  const Segment& segment,
                  double fraction) {
  const Eigen::Vector3d d = segment.to - segment.from;
  const auto J = camera.jacobian(segment.from + fraction * d);
  if (!J) return 0;
  const double radius = scene.rods[static_cast<size_t>(centre_line.rod)].radius;
  const Eigen::Vector2d along = (*J * d).normalized();
  const Eigen::Vector2d across = *J * (2 * radius * arc.normal);
  return std::abs(along.x() * across.y() - along.y() * across.x());
}

/// The middle of a rod's shadow.
bool isShadowOfCentre(const Scene& scene, const Edge& edge) {
  return edge.source == EdgeSource::kShadow &&
         scene.edges[static_cast<size_t>(edge.caster)].source == EdgeSource::kRodCentre;
}

/// Both borders of a rod's shadow, camera frame, where the given point (world) is in its middle.
std::optional<std::array<Eigen::Vector3d, 2>> shadowSides(const Scene& scene,
                                                          const Pose& pose,
                                                          const Edge& middle,
                                                          const Eigen::Vector3d& point) {
  const Light& light = scene.lights[static_cast<size_t>(middle.light)];
  const Edge& caster = scene.edges[static_cast<size_t>(middle.caster)];
  const LitPlane plane = litPlaneOf(scene, middle);
  const Eigen::Vector3d d = caster.to - caster.from;
  const Eigen::Vector3d ray =
      light.kind == Light::Kind::kSun ? light.place : Eigen::Vector3d(light.place - point);
  const Eigen::Vector3d normal = d.cross(ray).normalized();  // Of the plane that holds them all.
  const Eigen::Vector3d across = normal.cross(ray);
  const double s = std::clamp(across.dot(point - caster.from) / across.dot(d), 0.0, 1.0);
  const double radius = scene.rods[static_cast<size_t>(middle.rod)].radius;
  std::array<Eigen::Vector3d, 2> sides;
  for (size_t k = 0; k < 2; ++k) {
    const auto side =
        shadowOnPlane(light, caster.from + s * d + (k == 0 ? radius : -radius) * normal, plane);
    if (!side) return std::nullopt;
    sides[k] = pose.toCam(*side);
  }
  return sides;
}

/// Width in px of a rod's shadow at a point (world) of its middle; 0 outside the domain.
double shadowWidthPx(const Scene& scene,
                     const Camera& camera,
                     const Pose& pose,
                     const Edge& middle,
                     const Eigen::Vector3d& point) {
  const auto sides = shadowSides(scene, pose, middle, point);
  const auto J = camera.jacobian(pose.toCam(point));
  if (!sides || !J) return 0;
  const Eigen::Vector2d along =
      (*J * (pose.cam_from_world * (middle.to - middle.from))).normalized();
  const Eigen::Vector2d across = *J * ((*sides)[0] - (*sides)[1]);
  return std::abs(along.x() * across.y() - along.y() * across.x());
}

/// What a Gaussian blur and the mean over a pixel (as a Gaussian of the same variance, 1/12 px^2)
/// leave of the contrast in the middle of a stripe.
double shareLeftByBlur(double width_px, double psf_sigma_px) {
  const double sigma = std::sqrt(psf_sigma_px * psf_sigma_px + 1.0 / 12);
  return std::erf(width_px / ((DLSD_MUTANT("label-stripe-blur") ? 1 : 2) * std::sqrt(2.0) * sigma));
}

/// Calls function(fraction of the edge) at kWidthPoints points of each imaged piece of an edge,
/// hidden or not.
template <class Function>
void atWidthPoints(const Camera& camera,
                   const EdgeArc& arc,
                   const Segment& segment,
                   const Function& function) {
  for (const ImageSpan& span : imageSpans(camera, arc.arc)) {
    for (int k = 0; k < kWidthPoints; ++k) {
      const double t = span.t0 + (span.t1 - span.t0) * k / (kWidthPoints - 1);
      function(fractionAt(arc, segment, t * arc.angle));
    }
  }
}

/// Shadows of a rod, by (rod, light, face, disc), that are labelled by their middle in this view.
using StripeKey = std::array<int, 4>;
StripeKey stripeKey(const Edge& edge) {
  return {edge.rod, edge.light, edge.face0, edge.disc};
}
std::set<StripeKey> findThinShadows(const Scene& scene,
                                    const Camera& camera,
                                    const Pose& pose,
                                    const std::vector<EdgeSpan>& spans) {
  std::map<StripeKey, double> widest;
  for (size_t i = 0; i < scene.edges.size(); ++i) {
    const Edge& edge = scene.edges[i];
    if (!isShadowOfCentre(scene, edge)) continue;
    const auto arc = edgeArc(scene, pose, static_cast<int>(i));
    if (!arc) continue;
    atWidthPoints(camera, *arc, segmentOf(edge, pose), [&](double s) {
      double& width = widest.emplace(stripeKey(edge), 0).first->second;
      const Eigen::Vector3d point = edge.from + s * (edge.to - edge.from);
      width = std::max(width, shadowWidthPx(scene, camera, pose, edge, point));
    });
  }
  // A border may be on a face where the middle is on another one before it.
  constexpr double kAlonePx = 10;
  std::map<StripeKey, std::map<int, double>> seen_px;  // Per line of the stripe, by its caster.
  for (const EdgeSpan& span : spans) {
    const Edge& edge = scene.edges[static_cast<size_t>(span.edge)];
    if (edge.source != EdgeSource::kShadow || edge.rod < 0) continue;
    seen_px[stripeKey(edge)][edge.caster] += curveLength(span.curve);
  }
  std::set<StripeKey> thin;
  for (const auto& [key, width] : widest) {
    if (!(width < kThickRodPx)) continue;
    double middle_px = 0, border_px = 0;
    for (const auto& [caster, length_px] : seen_px[key]) {
      const bool is_middle =
          scene.edges[static_cast<size_t>(caster)].source == EdgeSource::kRodCentre;
      double& longest_px = is_middle ? middle_px : border_px;
      longest_px = std::max(longest_px, length_px);
    }
    if (border_px <= middle_px + kAlonePx) thin.insert(key);
  }
  return thin;
}

/// Per rod: labelled by its centre line in this view?
std::vector<char> findWires(const Scene& scene, const Camera& camera, const Pose& pose) {
  std::vector<char> wires(scene.rods.size(), 0);
  for (size_t i = 0; i < scene.edges.size(); ++i) {
    const Edge& edge = scene.edges[i];
    if (edge.source != EdgeSource::kRodCentre) continue;
    const auto arc = edgeArc(scene, pose, static_cast<int>(i));
    if (!arc) continue;
    const Segment segment = segmentOf(edge, pose);
    double widest = -1;
    atWidthPoints(camera, *arc, segment, [&](double s) {
      widest = std::max(widest, rodWidthPx(scene, camera, edge, *arc, segment, s));
    });
    wires[static_cast<size_t>(edge.rod)] = widest >= 0 && widest < kThickRodPx ? 1 : 0;
  }
  return wires;
}

}  // namespace

std::vector<EdgeSpan> visibleSpans(const Scene& scene,
                                   const Raycaster& raycaster,
                                   const Camera& camera,
                                   const Pose& pose) {
  const View view(scene, raycaster, pose);
  const double field = imageFieldAngle(camera);
  struct Candidate {
    EdgeArc arc;
    std::vector<ImageSpan> imaged;
  };
  std::vector<Candidate> candidates;
  std::vector<EdgeArc> outlines;
  for (size_t i = 0; i < scene.edges.size(); ++i) {
    const Edge& edge = scene.edges[i];
    if (!view.mayShow(edge)) continue;
    const auto arc = edgeArc(scene, pose, static_cast<int>(i));
    if (!arc) continue;
    if (fieldAngle(arc->middle) - arc->angle / 2 > field) continue;
    if (view.isOutline(edge)) outlines.push_back(*arc);
    std::vector<ImageSpan> imaged = imageSpans(camera, arc->arc);
    if (!imaged.empty()) candidates.push_back({*arc, std::move(imaged)});
  }

  // Tubes in the camera frame, in balls.
  struct SeenTube {
    Tube tube;
    Eigen::Vector3d direction;
    double angle;  ///< Radius of its ball.
  };
  std::vector<SeenTube> tubes;
  for (const Tube& tube : scene.tubes) {
    const Tube turned = transformed(tube, pose.cam_from_world, pose.position_in_world);
    const double radius = turned.x.norm() + turned.y.norm() + turned.radius;
    const double distance = turned.centre.norm();
    tubes.push_back({turned,
                     turned.centre.normalized(),
                     distance > radius ? std::asin(radius / distance) : M_PI});
  }

  std::vector<EdgeSpan> spans;
  for (const Candidate& candidate : candidates) {
    const EdgeArc& arc = candidate.arc;
    const Edge& edge = scene.edges[static_cast<size_t>(arc.edge)];
    const Segment segment = segmentOf(edge, pose);
    Events events(arc);
    for (const EdgeArc& outline : outlines) {
      if (outline.nearest > arc.farthest || outline.edge == arc.edge) continue;
      // Caps of the two arcs apart: angle between the middles > sum of the half angles.
      const double cos_sum =
          arc.cos_half * outline.cos_half - arc.sin_half * outline.sin_half - 1e-9;
      if (arc.middle.dot(outline.middle) < cos_sum && arc.angle + outline.angle < 2 * M_PI)
        continue;
      events.addCrossing(outline);
    }
    for (const Sphere& sphere : scene.spheres) {
      events.addSphere(
          pose.toCam(sphere.centre.cast<double>()), static_cast<double>(sphere.radius), segment);
    }
    for (const Disc& disc : scene.discs) {
      events.addDisc(pose.toCam(disc.centre.cast<double>()),
                     pose.cam_from_world * disc.normal.cast<double>(),
                     static_cast<double>(disc.radius));
    }
    for (const SeenTube& tube : tubes) {
      const double apart = std::acos(std::clamp(arc.middle.dot(tube.direction), -1.0, 1.0));
      if (apart <= arc.angle / 2 + tube.angle + 1e-6) events.addTube(tube.tube);
    }
    for (const ImageSpan& imaged : candidate.imaged) {
      const std::vector<double> cuts = events.cuts(imaged.t0 * arc.angle, imaged.t1 * arc.angle);
      const size_t first = spans.size();
      for (size_t k = 0; k + 1 < cuts.size(); ++k) {
        const double s = fractionAt(arc, segment, (cuts[k] + cuts[k + 1]) / 2);
        if (view.hidden(edge, edge.from + s * (edge.to - edge.from))) continue;
        if (spans.size() > first && cuts[k] - spans.back().phi1 < kShortestSpanRad) {
          spans.back().phi1 = cuts[k + 1];
        } else {
          spans.push_back({arc.edge, arc.arc, cuts[k], cuts[k + 1], {}, {}});
        }
      }
      size_t kept = first;
      for (size_t k = first; k < spans.size(); ++k) {
        EdgeSpan span = std::move(spans[k]);
        if (span.phi1 - span.phi0 < kShortestSpanRad) continue;
        span.ends[0] = span.phi0 == cuts.front() ? endKind(imaged.end0) : EndKind::kOccluder;
        span.ends[1] = span.phi1 == cuts.back() ? endKind(imaged.end1) : EndKind::kOccluder;
        span.curve =
            imageCurve(camera, arc.arc, span.phi0 / arc.angle, span.phi1 / arc.angle, 0.01);
        if (span.curve.size() >= 2) spans[kept++] = std::move(span);
      }
      spans.resize(kept);
    }
  }
  return spans;
}

Labels makeLabels(const Scene& scene,
                  const Raycaster& raycaster,
                  const Shader& shader,
                  const Camera& camera,
                  const Pose& pose,
                  const SensorOptions& sensor,
                  const std::vector<EdgeSpan>& spans) {
  const View view(scene, raycaster, pose);
  const std::vector<char> wires = findWires(scene, camera, pose);
  const std::set<StripeKey> thin_shadows = findThinShadows(scene, camera, pose, spans);
  const Eigen::Vector3f origin = pose.position_in_world.cast<float>();
  const Eigen::Matrix3d world_from_cam = pose.cam_from_world.transpose();
  struct Look {
    double grey;
    Hit hit;
  };
  const auto look = [&](const Eigen::Vector3d& ray_in_cam) -> Look {
    const Eigen::Vector3d direction = (world_from_cam * ray_in_cam).normalized();
    const Hit hit =
        raycaster.cast(origin, direction.cast<float>(), 0, std::numeric_limits<float>::infinity());
    const Seen seen = shader.shade(hit, pose.position_in_world, direction);
    return {greyLevel(sensor, static_cast<double>(seen.radiance)), hit};
  };

  Labels labels;
  struct VertexEnd {
    Eigen::Vector3d vertex;
    Eigen::Vector2d pixel;
    int line;
  };
  std::vector<VertexEnd> vertex_ends;
  for (const EdgeSpan& span : spans) {
    if (span.phi1 - span.phi0 < kShortestLabelRad) continue;
    const Edge& edge = scene.edges[static_cast<size_t>(span.edge)];
    const bool is_wire = edge.source == EdgeSource::kRodCentre;
    const bool is_shadow = edge.source == EdgeSource::kShadow;
    const bool is_middle = is_wire || isShadowOfCentre(scene, edge);
    if (edge.rod >= 0) {
      const bool is_thin = is_shadow ? thin_shadows.contains(stripeKey(edge))
                                     : wires[static_cast<size_t>(edge.rod)] != 0;
      if (is_thin != is_middle) continue;
    }
    const auto arc = edgeArc(scene, pose, span.edge);
    if (!arc) continue;
    const Segment segment = segmentOf(edge, pose);
    const auto pointAt = [&](double phi) -> Eigen::Vector3d {
      return segment.from + fractionAt(*arc, segment, phi) * (segment.to - segment.from);
    };

    LabelLine line;
    line.id = static_cast<int>(labels.lines.size());
    line.edge = span.edge;
    line.carrier = edge.carrier;
    line.points_in_cam = {pointAt(span.phi0), pointAt(span.phi1)};
    line.normal = canonicalNormal(arc->normal);
    line.ends = span.ends;
    line.angle_rad = span.phi1 - span.phi0;
    for (const Eigen::Vector2d& p : span.curve) {
      line.points.emplace_back(roundPixel(p.x()), roundPixel(p.y()));
    }
    line.length_px = curveLength(span.curve);

    int continuous = 0;
    line.contrast_min = std::numeric_limits<double>::infinity();
    for (int k = 0; k < kContrastPoints; ++k) {
      const double phi = span.phi0 + line.angle_rad *
                                         (DLSD_MUTANT("label-contrast") ? 0.5 : k + 0.5) /
                                         kContrastPoints;
      const Eigen::Vector3d ray = arc->at(phi);
      // The rays on both sides of the line, or of the stripe of which it is the middle.
      std::array<Eigen::Vector3d, 2> sides{ray, ray};
      double offset = kContrastOffsetRad, width_px = 0;
      if (is_wire) {
        const double sine = scene.rods[static_cast<size_t>(edge.rod)].radius / pointAt(phi).norm();
        offset += std::asin(std::min(1.0, sine));
        width_px = rodWidthPx(scene, camera, edge, *arc, segment, fractionAt(*arc, segment, phi));
      } else if (is_middle) {
        const Eigen::Vector3d point =
            edge.from + fractionAt(*arc, segment, phi) * (edge.to - edge.from);
        if (const auto borders = shadowSides(scene, pose, edge, point)) {
          sides = {(*borders)[0].normalized(), (*borders)[1].normalized()};
          if (sides[0].dot(arc->normal) < 0) std::swap(sides[0], sides[1]);
        }
        width_px = shadowWidthPx(scene, camera, pose, edge, point);
      }
      const Look left = look(sides[0] + std::tan(offset) * arc->normal);
      const Look right = look(sides[1] - std::tan(offset) * arc->normal);
      double contrast = std::abs(left.grey - right.grey);
      if (is_middle) {
        contrast = std::abs(look(ray).grey - (left.grey + right.grey) / 2) *
                   shareLeftByBlur(width_px, sensor.psf_sigma_px);
      }
      line.contrast += contrast / kContrastPoints;
      line.contrast_min = std::min(line.contrast_min, contrast);
      const auto containsEdge = [&](const Hit& hit) {
        return hit.kind == HitKind::kFace && view.contains(hit.index, edge);
      };
      continuous += containsEdge(left.hit) && containsEdge(right.hit) ? 1 : 0;
    }
    if (is_wire) {
      line.kind = LineKind::kWire;
    } else if (is_shadow) {
      line.kind = LineKind::kShadow;
    } else if (edge.source == EdgeSource::kDecal) {
      line.kind = LineKind::kMaterial;
    } else if (edge.source == EdgeSource::kRodSide) {
      line.kind = LineKind::kSilhouette;
    } else {
      const bool both = view.looksAtCamera(edge.face0) && view.looksAtCamera(edge.face1);
      line.kind =
          both || 2 * continuous > kContrastPoints ? LineKind::kCrease : LineKind::kSilhouette;
    }
    if (line.ends[0] == EndKind::kVertex) {
      vertex_ends.push_back({edge.from, line.points.front(), line.id});
    }
    if (line.ends[1] == EndKind::kVertex) {
      vertex_ends.push_back({edge.to, line.points.back(), line.id});
    }
    labels.lines.push_back(std::move(line));
  }

  // Ends at one point of space meet in a junction.
  constexpr double kSameVertex = 1e-5;
  std::sort(vertex_ends.begin(), vertex_ends.end(), [](const VertexEnd& a, const VertexEnd& b) {
    return a.vertex.x() != b.vertex.x() ? a.vertex.x() < b.vertex.x() : a.line < b.line;
  });
  std::vector<char> used(vertex_ends.size(), 0);
  for (size_t i = 0; i < vertex_ends.size(); ++i) {
    if (used[i] != 0) continue;
    Junction junction{vertex_ends[i].pixel, {}};
    for (size_t j = i; j < vertex_ends.size() &&
                       vertex_ends[j].vertex.x() - vertex_ends[i].vertex.x() < kSameVertex;
         ++j) {
      if (used[j] != 0 || !((vertex_ends[j].vertex - vertex_ends[i].vertex).norm() < kSameVertex)) {
        continue;
      }
      used[j] = 1;
      junction.lines.push_back(vertex_ends[j].line);
    }
    std::sort(junction.lines.begin(), junction.lines.end());
    if (junction.lines.size() >= 2) labels.junctions.push_back(std::move(junction));
  }
  std::sort(labels.junctions.begin(),
            labels.junctions.end(),
            [](const Junction& a, const Junction& b) { return a.lines < b.lines; });
  return labels;
}

}  // namespace dlsd
