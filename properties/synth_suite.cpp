// Labels and pictures over random scenes and cameras: where labels are, what hides them, and what
// must not change when camera and scene are turned or mirrored together.
//
// RC_PARAMS (seed, max_success) is honoured; a case is a scene and a camera, which where pictures
// are rendered, too, is tried a tenth as often.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "properties/gen.h"
#include "properties/holds.h"
#include "properties/worst.h"
#include "synth/dataset/random.h"
#include "synth/labels.h"
#include "synth/render.h"
#include "synth/shadows.h"
#include "synth/tubes.h"
#include "synth/variety.h"
#include "synth/visibility_oracle.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// --- Cases ---

struct Case {
  std::string preset;
  uint64_t seed, index;
  bool distractors;
};
void showValue(const Case& c, std::ostream& out) {
  out << c.preset << " seed " << c.seed << " index " << c.index
      << (c.distractors ? " with things on top" : "");
}

rc::Gen<Case> genCase() {
  return rc::gen::map(rc::gen::tuple(rc::gen::elementOf(scenePresets()),
                                     genInt(0, 1000),
                                     genInt(0, 1000),
                                     rc::gen::arbitrary<bool>()),
                      [](const auto& t) {
                        return Case{std::get<0>(t),
                                    static_cast<uint64_t>(std::get<1>(t)),
                                    static_cast<uint64_t>(std::get<2>(t)),
                                    std::get<3>(t)};
                      });
}

SceneView makeView(const Case& c) {
  SceneView view = makeSceneView(c.preset, c.seed, c.index);
  if (c.distractors) {
    SceneVariety variety;
    variety.distractors = {3, 8};
    variety.clutter = {0, 5};
    addVariety(variety, c.seed, c.index, &view);
  }
  return view;
}

/// A realistic camera of any model, by default of at most 0.3 megapixels.
rc::Gen<Camera> genSmallCamera(VarietyRange width_px = {320, 560}) {
  CameraVariety variety;
  variety.width_px = width_px;
  return rc::gen::map(rc::gen::tuple(rc::gen::elementOf(randomCameraModels()), genInt(0, 100000)),
                      [variety](const auto& t) {
                        return drawCamera(
                            std::get<0>(t), variety, 1, static_cast<uint64_t>(std::get<1>(t)));
                      });
}

/// A scene with its shadows, and what a camera sees of it.
struct Viewed {
  Scene scene;
  Pose pose;
  Raycaster raycaster;
  std::vector<EdgeSpan> spans;
  Labels labels;

  Viewed(Scene s, const Pose& p, const Camera& camera)
      : scene(std::move(s)), pose(p), raycaster(scene) {
    addRodSides(pose.position_in_world, &scene);
    addShadowEdges(raycaster, &scene);
    spans = visibleSpans(scene, raycaster, camera, pose);
    const Shader shader(scene, &raycaster);
    labels = makeLabels(scene, raycaster, shader, camera, pose, SensorOptions(), spans);
  }
  Viewed(const Viewed&) = delete;

  [[nodiscard]] std::vector<float> render(const Camera& camera) const {
    const Shader shader(scene, &raycaster);
    return renderRadiance(
               scene, raycaster, shader, CameraRays(camera), pose, spans, 1, PixelResponse(0.7, 0))
        .radiance;
  }
};

/// Whether the label is the middle of a bar or of its shadow.
bool isMiddle(const Scene& scene, const LabelLine& line) {
  const Edge& edge = scene.edges[static_cast<size_t>(line.edge)];
  return edge.source == EdgeSource::kRodCentre ||
         (edge.source == EdgeSource::kShadow &&
          scene.edges[static_cast<size_t>(edge.caster)].source == EdgeSource::kRodCentre);
}

bool isInner(EndKind kind) {
  return kind == EndKind::kVertex || kind == EndKind::kOccluder;
}

constexpr double kNearbyRad = 2e-5;
/// Nearer to a border, rays of floats may be on either side.
constexpr double kRoundingRad = 3e-7;
/// Before what is no longer than this, rays of floats need not see what hides it.
constexpr double kShortEdgeRad = 2e-5;
/// Where the contrast is stated.
constexpr double kBesideRad = 2e-4;
/// Contrast is stated from this many places spread evenly over a label's angle.
constexpr int kContrastPlaces = 11;

double distanceTo(const Vector2d& from, const Vector2d& to, const Vector2d& p) {
  const Vector2d d = to - from;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - from).dot(d) / length2, 0.0, 1.0) : 0;
  return (from + t * d - p).norm();
}

double distanceTo(const std::vector<Vector2d>& curve, const Vector2d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < curve.size(); ++i) {
    nearest = std::min(nearest, distanceTo(curve[i - 1], curve[i], p));
  }
  return nearest;
}

/// What the picture shows at a place, by rays alone.
class Eye {
 public:
  Eye(const Viewed& seen, const Camera& camera)
      : seen_(seen),
        camera_(camera),
        shader_(seen.scene, &seen.raycaster),
        world_from_cam_(seen.pose.cam_from_world.transpose()) {}

  struct Look {
    Hit hit;
    Sight sight = -1;
    Vector3d direction{0, 0, 0};  ///< In world.
    [[nodiscard]] bool isSame(const Look& o) const {
      return hit.kind == o.hit.kind && hit.index == o.hit.index && sight == o.sight;
    }
  };
  [[nodiscard]] Look along(const Vector3d& ray) const {
    const Vector3d direction = world_from_cam_ * ray.normalized();
    const Eigen::Vector3f d = direction.cast<float>();
    const Vector3d& origin = seen_.pose.position_in_world;
    const Hit hit =
        seen_.raycaster.cast(origin.cast<float>(), d, 0, std::numeric_limits<float>::infinity());
    Sight sight = shader_.surfaceAt(hit, origin, direction);
    shader_.addShadows(&hit, origin, &d.x(), &d.y(), &d.z(), 1, &sight);
    return {hit, sight, direction};
  }
  [[nodiscard]] double grey(const Look& look) const {
    return greyLevel(SensorOptions(),
                     static_cast<double>(shader_.radiance(
                         look.hit, seen_.pose.position_in_world, look.direction, look.sight)));
  }

  /// Looks at pixels, a packet of rays at a time; none where the camera has no ray.
  void at(const std::vector<Vector2d>& pixels, std::vector<std::optional<Look>>* looks) const {
    constexpr size_t kPacket = Raycaster::kPacket;
    looks->assign(pixels.size(), std::nullopt);
    std::array<size_t, kPacket> slots{};
    std::array<Vector3d, kPacket> directions;
    alignas(64) std::array<float, kPacket> x{}, y{}, z{};
    const Vector3d& origin = seen_.pose.position_in_world;
    size_t rays = 0;
    for (size_t i = 0; i < pixels.size(); ++i) {
      if (const auto ray = camera_.unproject(pixels[i])) {
        slots[rays] = i;
        directions[rays] = world_from_cam_ * ray->normalized();
        const Eigen::Vector3f d = directions[rays].cast<float>();
        x[rays] = d.x(), y[rays] = d.y(), z[rays] = d.z();
        ++rays;
      }
      if (rays == 0 || (rays < kPacket && i + 1 < pixels.size())) continue;
      std::array<Hit, kPacket> hits;
      std::array<Sight, kPacket> sights{};
      seen_.raycaster.castPacket(
          origin.cast<float>(), x.data(), y.data(), z.data(), rays, hits.data());
      for (size_t k = 0; k < rays; ++k) {
        sights[k] = shader_.surfaceAt(hits[k], origin, directions[k]);
      }
      shader_.addShadows(hits.data(), origin, x.data(), y.data(), z.data(), rays, sights.data());
      for (size_t k = 0; k < rays; ++k) (*looks)[slots[k]] = {hits[k], sights[k], directions[k]};
      rays = 0;
    }
  }

 private:
  const Viewed& seen_;
  const Camera& camera_;
  Shader shader_;
  Eigen::Matrix3d world_from_cam_;
};

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

// --- Properties ---

// To both sides of a label's curve there are different surfaces, or light and shadow, 2e-5 rad off
// or, where the next border is nearer than that, less; 2e-4 rad off, grey levels differ by its
// least contrast.
TEST(SynthSuite, LabelsLieOnDiscontinuities) {
  long points_seen = 0, gaps_seen = 0, ends_seen = 0;
  holds(1, [&] {
    const Case c = *genCase();
    const Camera camera = *genSmallCamera();
    SceneView view = makeView(c);
    const Viewed seen(std::move(view.scene), view.pose, camera);
    const Eye eye(seen, camera);
    int checked = 0, flat = 0, in_gap = 0;
    for (const LabelLine& line : seen.labels.lines) {
      if (isMiddle(seen.scene, line) || line.contrast_min < 3) continue;
      // One of the places at which contrast is stated, through the image.
      const double phi = line.angle_rad * (line.id % kContrastPlaces + 0.5) / kContrastPlaces;
      // At an end, what is beyond it may be there, too.
      if (std::min(phi, line.angle_rad - phi) < 2 * kShortestSpanRad) {
        ++ends_seen;
        continue;
      }
      const Vector3d point = pointAt(line, phi);
      if (isInShadowGap(seen, line, point)) {
        ++in_gap;
        continue;
      }
      const auto p = camera.project(point);
      RC_ASSERT(p.has_value());
      RC_ASSERT(distanceTo(line.points, *p) <= 0.0101);
      const auto ray = camera.unproject(*p);
      RC_ASSERT(ray.has_value());
      ++checked;
      const auto look = [&](double beside_rad) {
        return eye.along(*ray + beside_rad * line.normal);
      };
      // Where the next border is nearer than that, this one is seen from nearer still.
      bool is_border = false;
      for (double off = kNearbyRad; !is_border && off > kRoundingRad; off /= 2) {
        is_border = !look(off).isSame(look(-off));
      }
      const double step = std::abs(eye.grey(look(kBesideRad)) - eye.grey(look(-kBesideRad)));
      if (is_border && step >= 0.95 * line.contrast_min - 0.5) continue;
      ++flat;
      RC_LOG() << "line " << line.id << " " << toString(line.kind) << " at " << p->transpose()
               << ": is a border " << is_border << ", step " << step << ", least contrast "
               << line.contrast_min << "\n";
    }
    RC_PRE(checked > 0);
    RC_LOG() << flat << " of " << checked << " points";
    points_seen += checked;
    gaps_seen += in_gap;
    RC_TAG(c.preset);
    RC_ASSERT(flat == 0);
  });
  std::cout << "    in the gap between a shadow and what casts it: " << gaps_seen
            << ", at ends: " << ends_seen << ", elsewhere " << points_seen << " points\n";
  EXPECT_LE(gaps_seen + ends_seen, points_seen / 1000);
}

// A point of an edge is in a span if and only if brute force over all triangles and round things
// finds nothing before it.
TEST(SynthSuite, VisibilityIsThatOfBruteForce) {
  size_t too_short = 0, points_seen = 0;
  holds(1, [&] {
    const Case c = *genCase();
    const Camera camera = *genSmallCamera();
    SceneView view = makeView(c);
    const Viewed seen(std::move(view.scene), view.pose, camera);
    const Vector3d eye = seen.pose.position_in_world;
    const VisibilityOracle oracle(seen.scene, eye);
    std::vector<std::vector<const EdgeSpan*>> by_edge(seen.scene.edges.size());
    for (const EdgeSpan& s : seen.spans) by_edge[static_cast<size_t>(s.edge)].push_back(&s);
    Random random(c.seed, c.index);
    int tested = 0;
    for (int k = 0; k < 300; ++k) {
      const int e = random.nextInt(0, static_cast<int>(seen.scene.edges.size()) - 1);
      const double t = random.next(0, 1);
      const Edge& edge = seen.scene.edges[static_cast<size_t>(e)];
      if (angleTo(seen.pose.toCam(edge.from), seen.pose.toCam(edge.to)) < kShortEdgeRad) {
        ++too_short;
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
      ++tested;
      if (found != expected) {
        RC_LOG() << "edge " << e << " t " << t << ": span " << found << ", brute force "
                 << expected;
      }
      RC_ASSERT(found == expected);
    }
    points_seen += static_cast<size_t>(tested);
    RC_ASSERT(tested > 200);
  });
  std::cout << "    on edges too short to tell: " << too_short << ", elsewhere " << points_seen
            << " points\n";
  EXPECT_LE(too_short, points_seen / 2000);
}

// --- Completeness ---

/// Things by square cells of the image.
template <class T>
class ImageGrid {
 public:
  ImageGrid(const Camera& camera, int cell)
      : cell_(cell),
        columns_(camera.width() / cell + 1),
        rows_(camera.height() / cell + 1),
        cells_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_)) {}

  /// Calls function(list) for all cells within `reach` of the box.
  template <class Function>
  void forEachCell(const Vector2d& lo, const Vector2d& hi, double reach, const Function& function) {
    const auto clamped = [&](double x, int count) {
      return std::clamp(static_cast<int>(std::floor((x + 0.5) / cell_)), 0, count - 1);
    };
    for (int j = clamped(lo.y() - reach, rows_); j <= clamped(hi.y() + reach, rows_); ++j) {
      for (int i = clamped(lo.x() - reach, columns_); i <= clamped(hi.x() + reach, columns_); ++i) {
        function(cells_[static_cast<size_t>(j * columns_ + i)]);
      }
    }
  }

 private:
  int cell_, columns_, rows_;
  std::vector<std::vector<T>> cells_;
};

/// Of two hits of rays from one place.
bool isBefore(const Hit& a, const Hit& b) {
  return a.kind != HitKind::kNothing && (b.kind == HitKind::kNothing || a.distance < b.distance);
}

/// A place where the picture jumps.
struct Jump {
  Vector2d pixel;
  Vector3d ray;
};

struct Jumps {
  std::vector<Jump> unexplained;
  size_t count = 0;  ///< With those that are explained.
  size_t round = 0;  ///< Outlines of balls and tubes, which are not among the unexplained.
};

/// Places on the lines between neighbouring pixels' centres where what is seen changes by more
/// than `least_step` grey levels, to 1e-5 px. Where explained(a, b) holds, all places between a and
/// b are known and not looked for any closer.
///
/// Outlines of balls and tubes are no lines, however little they bend: where that of a ring turns
/// from convex to concave it has no curvature over tens of pixels.
Jumps findJumps(const Eye& eye, const Camera& camera, double least_step, const auto& explained) {
  /// Between lo and hi, shares of the way between two pixels' centres.
  struct Search {
    Vector2d from, to;
    double lo, hi;
    Eye::Look here, there;
    /// What is neither here nor there has been seen in between: only the end of here is sought.
    bool one_sided;
    [[nodiscard]] Vector2d at(double share) const { return from + share * (to - from); }
  };
  std::vector<Search> searches;
  std::vector<Vector2d> pixels(static_cast<size_t>(camera.width()));
  std::vector<std::optional<Eye::Look>> above(pixels.size()), row;
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) pixels[static_cast<size_t>(x)] = {x, y};
    eye.at(pixels, &row);
    for (size_t x = 0; x < row.size(); ++x) {
      const auto add = [&](const std::optional<Eye::Look>& other, const Vector2d& step) {
        if (!row[x] || !other || row[x]->isSame(*other)) return;
        searches.push_back({pixels[x] - step, pixels[x], 0, 1, *other, *row[x], false});
      };
      if (x > 0) add(row[x - 1], {1, 0});
      add(above[x], {0, 1});
    }
    above.swap(row);
  }

  Jumps jumps;
  std::vector<Search> left;
  std::vector<std::optional<Eye::Look>> looks;
  const auto isStep = [&](const Search& s) {
    return std::abs(eye.grey(s.here) - eye.grey(s.there)) > least_step;
  };
  for (int k = 0; k < 17; ++k) {
    pixels.clear();
    for (const Search& s : searches) pixels.push_back(s.at((s.lo + s.hi) / 2));
    eye.at(pixels, &looks);
    left.clear();
    const auto keep = [&](const Search& s) {
      if (explained(s.at(s.lo), s.at(s.hi))) {
        jumps.count += isStep(s) ? 1 : 0;
      } else {
        left.push_back(s);
      }
    };
    for (size_t i = 0; i < searches.size(); ++i) {
      if (!looks[i]) continue;
      Search s = searches[i];
      const double middle = (s.lo + s.hi) / 2;
      if (looks[i]->isSame(s.here)) {
        s.lo = middle;
        s.here = *looks[i];
      } else {
        if (!s.one_sided && !looks[i]->isSame(s.there)) {
          // Something thin is in between: from now on from each side.
          keep({s.to, s.from, 1 - s.hi, 1 - middle, s.there, *looks[i], true});
          s.one_sided = true;
        }
        s.hi = middle;
        s.there = *looks[i];
      }
      keep(s);
    }
    searches.swap(left);
  }
  for (const Search& s : searches) {
    if (!isStep(s)) continue;
    const Vector2d pixel = s.at(s.lo);
    const auto ray = camera.unproject(pixel);
    if (!ray) continue;
    ++jumps.count;
    const Hit& front = isBefore(s.here.hit, s.there.hit) ? s.here.hit : s.there.hit;
    if (front.kind == HitKind::kSphere || front.kind == HitKind::kTube) {
      ++jumps.round;
      continue;
    }
    jumps.unexplained.push_back({pixel, *ray});
  }
  return jumps;
}

/// Straight in space, that is: in one plane through the camera, to kStraightPx.
constexpr double kStraightPx = 1e-3;
constexpr double kLongPx = 20;

/// The longest straight run of jumps, its length and its ends.
struct StraightRun {
  double length_px = 0;
  Vector2d from{0, 0}, to{0, 0};
};
StraightRun longestStraightRun(const Camera& camera, const std::vector<Jump>& jumps) {
  ImageGrid<size_t> grid(camera, 16);
  for (size_t k = 0; k < jumps.size(); ++k) {
    grid.forEachCell(jumps[k].pixel, jumps[k].pixel, 0, [&](auto& list) { list.push_back(k); });
  }
  StraightRun longest;
  std::vector<std::pair<double, size_t>> along;
  for (const Jump& a : jumps) {
    const auto J = camera.jacobian(a.ray);
    if (!J) continue;
    const double straight_rad = kStraightPx / J->norm();
    std::vector<size_t> near;
    grid.forEachCell(a.pixel, a.pixel, 24, [&](auto& list) {
      near.insert(near.end(), list.begin(), list.end());
    });
    for (const size_t k : near) {
      const double apart = (jumps[k].pixel - a.pixel).norm();
      if (!(apart > 9 && apart < 10.5)) continue;
      const Vector3d normal = a.ray.cross(jumps[k].ray).normalized();
      const Vector3d across = normal.cross(a.ray);
      along.clear();
      for (const size_t i : near) {
        const Vector3d& ray = jumps[i].ray;
        if (std::abs(normal.dot(ray)) > straight_rad) continue;
        along.emplace_back(std::atan2(ray.dot(across), ray.dot(a.ray)), i);
      }
      std::sort(along.begin(), along.end());
      for (size_t first = 0; first < along.size();) {
        size_t last = first;
        while (last + 1 < along.size() &&
               (jumps[along[last + 1].second].pixel - jumps[along[last].second].pixel).norm() <
                   1.5) {
          ++last;
        }
        const Vector2d &from = jumps[along[first].second].pixel,
                       &to = jumps[along[last].second].pixel;
        if ((to - from).norm() > longest.length_px) longest = {(to - from).norm(), from, to};
        first = last + 1;
      }
    }
  }
  return longest;
}

/// Calls function(from, to) with pieces of the middles of thin bars and of bars' shadows, in the
/// image, that something stands before (of a bar: other than itself). There, one of their borders
/// may show, which has no label.
void forHiddenMiddles(const Viewed& seen, const Camera& camera, const auto& function) {
  constexpr int kPieces = 400;
  const Vector3d& eye = seen.pose.position_in_world;
  std::vector<char> is_thick(seen.scene.rods.size(), 0);  // Labelled by their sides.
  for (const LabelLine& line : seen.labels.lines) {
    const Edge& edge = seen.scene.edges[static_cast<size_t>(line.edge)];
    if (edge.rod < 0 || edge.source == EdgeSource::kShadow || isMiddle(seen.scene, line)) continue;
    is_thick[static_cast<size_t>(edge.rod)] = 1;
  }
  const auto isHidden = [&](const Edge& edge, const Vector3d& point) {
    const double distance = (point - eye).norm();
    const Eigen::Vector3f direction = ((point - eye) / distance).cast<float>();
    const auto end = static_cast<float>(distance * (1 - 1e-4));
    const auto isOwn = [&](const Hit& hit) {
      return edge.source == EdgeSource::kRodCentre && isOnRod(hit, seen.scene, edge.rod);
    };
    return seen.raycaster.cast(eye.cast<float>(), direction, 0, end, isOwn).kind !=
           HitKind::kNothing;
  };
  for (const Edge& edge : seen.scene.edges) {
    const bool is_bar =
        edge.source == EdgeSource::kRodCentre && is_thick[static_cast<size_t>(edge.rod)] == 0;
    const bool is_shadow =
        edge.source == EdgeSource::kShadow &&
        seen.scene.edges[static_cast<size_t>(edge.caster)].source == EdgeSource::kRodCentre;
    if (!is_bar && !is_shadow) continue;
    std::optional<Vector2d> before;
    for (int k = 0; k <= kPieces; ++k) {
      const Vector3d point = edge.from + (edge.to - edge.from) * k / kPieces;
      std::optional<Vector2d> pixel;
      if (isHidden(edge, point)) pixel = camera.project(seen.pose.toCam(point));
      if (pixel && before) function(*before, *pixel);
      before = pixel;
    }
  }
}

// Every straight border in the picture of more than 5 grey levels and 20 px belongs to a label.
// Borders are found by rays between neighbouring pixels, without the scene's edges.
TEST(SynthSuite, LabelsAreComplete) {
  Worst worst("px, longest straight border without a label");
  size_t jumps_seen = 0, round_seen = 0;
  holds(1, [&] {
    const Case c = *genCase();
    const Camera camera = *genSmallCamera({160, 240});
    SceneView view = makeView(c);
    const Viewed seen(std::move(view.scene), view.pose, camera);
    const Eye eye(seen, camera);
    // Labels' pieces, each with how far from it its borders may be: thin bars have theirs in their
    // middle.
    struct Piece {
      Vector2d from, to;
      double reach;
    };
    constexpr double kOnLabelPx = 0.02, kInBarPx = kThickRodPx / 2 + 0.1;
    ImageGrid<Piece> pieces(camera, 8);
    for (const LabelLine& line : seen.labels.lines) {
      const bool is_bar = isMiddle(seen.scene, line);
      for (size_t i = 1; i < line.points.size(); ++i) {
        const Vector2d &a = line.points[i - 1], &b = line.points[i];
        pieces.forEachCell(a.cwiseMin(b), a.cwiseMax(b), 2, [&](auto& list) {
          list.push_back({a, b, is_bar ? kInBarPx : kOnLabelPx});
        });
      }
    }
    const auto explained = [&](const Vector2d& a, const Vector2d& b) {
      bool is_explained = false;
      pieces.forEachCell(a, a, 0, [&](const auto& list) {
        for (const Piece& piece : list) {
          is_explained = is_explained || (distanceTo(piece.from, piece.to, a) <= piece.reach &&
                                          distanceTo(piece.from, piece.to, b) <= piece.reach);
        }
      });
      return is_explained;
    };
    Jumps jumps = findJumps(eye, camera, 5, explained);
    StraightRun run = longestStraightRun(camera, jumps.unexplained);
    if (!(run.length_px < kLongPx)) {
      forHiddenMiddles(seen, camera, [&](const Vector2d& a, const Vector2d& b) {
        if (!((a - b).norm() < 8)) return;
        pieces.forEachCell(a.cwiseMin(b), a.cwiseMax(b), 2, [&](auto& list) {
          list.push_back({a, b, kInBarPx});
        });
      });
      std::erase_if(jumps.unexplained,
                    [&](const Jump& jump) { return explained(jump.pixel, jump.pixel); });
      run = longestStraightRun(camera, jumps.unexplained);
    }
    RC_LOG() << jumps.count << " jumps, " << jumps.round << " of balls and tubes, "
             << jumps.unexplained.size() << " without a label; longest run " << run.length_px
             << " px from " << run.from.transpose() << " to " << run.to.transpose();
    RC_TAG(c.preset);
    RC_PRE(jumps.count > 0);
    jumps_seen += jumps.count;
    round_seen += jumps.round;
    worst.see(run.length_px);
    RC_ASSERT(run.length_px < kLongPx);
  });
  std::cout << "    outlines of balls and tubes: " << round_seen << " of " << jumps_seen
            << " jumps\n";
  EXPECT_LE(round_seen, jumps_seen / 20);
}

// What two cameras of one pose both see entirely are the same arcs.
TEST(SynthSuite, ArcsAreThoseOfAnotherLens) {
  Worst worst("difference of span ends, rad");
  holds(1, [&] {
    const Case c = *genCase();
    const Camera one = *genSmallCamera(), other = *genSmallCamera();
    SceneView view = makeView(c);
    const Raycaster raycaster(view.scene);
    addRodSides(view.pose.position_in_world, &view.scene);
    addShadowEdges(raycaster, &view.scene);
    std::multimap<int, const EdgeSpan*> by_edge;
    const auto spans = visibleSpans(view.scene, raycaster, one, view.pose);
    const auto others = visibleSpans(view.scene, raycaster, other, view.pose);
    for (const EdgeSpan& s : others) by_edge.emplace(s.edge, &s);
    int compared = 0;
    for (const EdgeSpan& s : spans) {
      const auto [first, last] = by_edge.equal_range(s.edge);
      for (auto it = first; it != last; ++it) {
        const EdgeSpan& o = *it->second;
        if (o.phi0 > s.phi1 || o.phi1 < s.phi0) continue;
        for (size_t end = 0; end < 2; ++end) {
          if (!isInner(s.ends[end]) || !isInner(o.ends[end])) continue;
          ++compared;
          RC_ASSERT(s.ends[end] == o.ends[end]);
          const double a = end == 0 ? s.phi0 : s.phi1, b = end == 0 ? o.phi0 : o.phi1;
          worst.see(std::abs(a - b));
          RC_ASSERT(std::abs(a - b) <= 1e-9);
        }
      }
    }
    RC_PRE(compared > 0);
  });
}

// --- Turned and mirrored ---

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

/// `map` takes places in the camera frame of `a` to that of `b`.
void expectSameLabels(
    const Labels& a, const Labels& b, const Camera& camera, const auto& map, const auto& mapPixel) {
  RC_ASSERT(a.lines.size() == b.lines.size());
  size_t other_contrast = 0, other_end = 0;
  for (size_t i = 0; i < a.lines.size(); ++i) {
    const LabelLine &p = a.lines[i], &q = b.lines[i];
    RC_ASSERT(p.edge == q.edge);
    RC_ASSERT(p.kind == q.kind);
    RC_ASSERT(p.ends == q.ends);
    // Where something begins 2e-4 rad from the line, one of its places depends on the last bit.
    const double difference = std::abs(p.contrast - q.contrast);
    RC_ASSERT(difference <= 0.5 + 255.0 / kContrastPlaces);
    other_contrast += difference <= 0.5 + 0.1 * p.contrast ? 0 : 1;
    for (size_t end = 0; end < 2; ++end) {
      const Vector3d& place = p.points_in_cam[end];
      const double off_rad = angleTo(map(place), q.points_in_cam[end]);
      // Of two places at which a line may end that are nearer to each other than floats resolve, a
      // ray test between them chooses by its last bit.
      RC_ASSERT(off_rad <= kShortestSpanRad);
      other_end += off_rad <= 1e-9 ? 0 : 1;
      const auto J = camera.jacobian(place);
      const double off_px = J ? J->norm() * place.norm() * off_rad : 0;
      const auto& from = end == 0 ? p.points.front() : p.points.back();
      const auto& to = end == 0 ? q.points.front() : q.points.back();
      RC_ASSERT((mapPixel(from) - to).norm() <= 1e-5 + off_px);
    }
  }
  RC_LOG() << other_contrast << " of " << a.lines.size() << " labels have another contrast, "
           << other_end << " ends are elsewhere\n";
  RC_ASSERT(other_contrast <= 1 + a.lines.size() / 200);
  RC_ASSERT(other_end <= 1 + a.lines.size() / 200);
  RC_ASSERT(a.junctions.size() == b.junctions.size());
}

// Camera and scene turned together by a quarter about the vertical (exact in floats): the same
// labels, the same picture.
TEST(SynthSuite, TurningSceneAndCameraChangesNothing) {
  Worst worst("share of pixels that differ by more than 1 grey level");
  holds(0.1, [&] {
    const Case c = *genCase();
    const Camera camera = *genSmallCamera();
    const SceneView view = makeView(c);
    WorldMap turn;
    turn.linear << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    Pose turned_pose;
    turned_pose.cam_from_world = view.pose.cam_from_world * turn.linear.transpose();
    turned_pose.position_in_world = turn(view.pose.position_in_world);
    const Viewed seen(view.scene, view.pose, camera),
        turned(turn.of(view.scene), turned_pose, camera);
    const auto same = [](const auto& p) { return p; };
    expectSameLabels(seen.labels, turned.labels, camera, same, same);
    const std::vector<float> image = seen.render(camera), turned_image = turned.render(camera);
    size_t differ = 0;
    for (size_t i = 0; i < image.size(); ++i) {
      differ += std::abs(image[i] - turned_image[i]) * 255 <= 1 ? 0 : 1;
    }
    RC_LOG() << differ << " pixels differ";
    worst.see(static_cast<double>(differ) / static_cast<double>(image.size()));
    RC_ASSERT(differ <= 2 + image.size() / 5000);
  });
}

/// The camera that sees what this one sees in a mirror.
Camera mirrored(const Camera& camera) {
  auto params = camera.params();
  const auto specs = camera.paramSpecs();
  for (size_t i = 0; i < params.size(); ++i) {
    if (specs[i].name == "cx") params[i] = camera.width() - 1 - params[i];
  }
  return makeCamera(
      camera.modelName(), params, camera.width(), camera.height(), camera.maxFieldAngleLimit());
}

// A mirrored scene has the mirrored picture and the mirrored labels.
TEST(SynthSuite, MirroredScenesAreMirrored) {
  Worst worst("share of pixels that differ by more than 8 grey levels");
  holds(0.1, [&] {
    const Case c = *genCase();
    const Camera camera = *genSmallCamera();
    const SceneView view = makeView(c);
    const Eigen::Matrix3d flip = Vector3d(-1, 1, 1).asDiagonal();
    const WorldMap mirror{flip};
    Pose pose;
    pose.cam_from_world = flip * view.pose.cam_from_world * flip;
    pose.position_in_world = mirror(view.pose.position_in_world);
    const Camera other = mirrored(camera);
    const Viewed seen(view.scene, view.pose, camera), flipped(mirror.of(view.scene), pose, other);
    const int width = camera.width();
    expectSameLabels(
        seen.labels,
        flipped.labels,
        camera,
        [&](const Vector3d& p) -> Vector3d { return flip * p; },
        [&](const Vector2d& p) -> Vector2d {
          return {width - 1 - p.x(), p.y()};
        });
    // Samples are not mirrored: pixels agree as well as 64 samples answer.
    const std::vector<float> image = seen.render(camera), flipped_image = flipped.render(other);
    size_t differ = 0;
    for (int y = 0; y < camera.height(); ++y) {
      for (int x = 0; x < width; ++x) {
        const size_t row = static_cast<size_t>(y) * static_cast<size_t>(width);
        const float a = image[row + static_cast<size_t>(x)];
        const float b = flipped_image[row + static_cast<size_t>(width - 1 - x)];
        differ += std::abs(a - b) * 255 <= 8 ? 0 : 1;
      }
    }
    RC_LOG() << differ << " pixels differ";
    worst.see(static_cast<double>(differ) / static_cast<double>(image.size()));
    RC_ASSERT(differ <= 2 + image.size() / 1000);
  });
}

}  // namespace
}  // namespace dlsd
