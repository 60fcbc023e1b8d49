#include "synth/shadows.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "synth/dataset/random.h"
#include "synth/labels.h"
#include "synth/random_shapes.h"
#include "synth/render.h"
#include "synth/scene_builder.h"
#include "synth/test_cameras.h"
#include "synth/visibility_oracle.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Light lamp() {
  Light light;
  light.kind = Light::Kind::kPoint;
  light.place = {2.2, 2.6, 3.3};
  light.strength = 0.6;
  light.half_distance = 3;
  light.casts_shadows = true;
  return light;
}

Light sun() {
  Light light;
  light.place = Vector3d(0.3, -0.2, 0.9).normalized();
  light.strength = 0.6;
  light.casts_shadows = true;
  return light;
}

SceneBuilder emptyRoom() {
  SceneBuilder builder;
  const std::array<Panel, 4> walls{
      Panel{{0.5, 0}, {}}, {{0.5, 0}, {}}, {{0.5, 0}, {}}, {{0.5, 0}, {}}};
  builder.addRoom({6, 6, 4}, walls, {0.5, 0}, {0.5, 0});
  return builder;
}

/// Boxes, one of them on the floor, one on top of it; a turned one; a rod, a ball, a disc, a
/// cylinder, a ring and a string.
Scene clutteredRoom(const Light& light) {
  SceneBuilder builder = emptyRoom();
  builder.addBox(Frame3(), {2, 2, 1}, {3, 4, 1.5}, {0.7, 0});
  builder.addBox(Frame3(), {3.5, 1, 0}, {4.5, 2, 1}, {0.7, 0});
  // One shadow of it falls right onto the border of the box below.
  builder.addBox(Frame3(), {3.7, 1.2, 1}, {4.1, 1.6, 1.4}, {0.7, 0});
  Frame3 turned;
  turned.origin = {1.2, 4.3, 0.9};
  turned.axes = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  builder.addBox(turned, {-0.4, -0.3, -0.2}, {0.4, 0.3, 0.2}, {0.7, 0});
  builder.addRod({3, 4.5, 0.4}, {5, 3, 2.2}, 0.02, 8, {0.2, 0});
  builder.addSphere({2.6, 2.9, 2.2}, 0.3, {0.6, 0});
  builder.addDisc({4, 3.2, 2.4}, Vector3d(0.2, 0.1, 1).normalized(), 0.3, {0.6, 0});
  builder.addDisc({2.3, 3.6, 0.5}, Vector3d(0.1, 0.2, 1).normalized(), 0.6, {0.6, 0});
  builder.addRoundRod({2.2, 4.9, 1.1}, {4.1, 5.2, 1.6}, 0.12, {0.6, 0});
  Tube ring;
  ring.centre = {2.1, 3.1, 1.9};
  ring.x = {0.3, 0, 0.1};
  ring.y = {0, std::sqrt(0.1), 0};
  ring.radius = 0.06;
  builder.addTube(ring, {0.6, 0});
  Tube string;
  string.kind = Tube::Kind::kString;
  string.centre = {2.9, 3.4, 1.7};
  string.x = {0.8, 0.5, 0.1};
  string.y = {0, 0, 0.4};
  string.radius = 0.02;
  builder.addTube(string, {0.6, 0});
  builder.finish();
  builder.scene.ambient_up = builder.scene.ambient_down = 0.2;
  builder.scene.lights = {light};
  addRodSidesFromLights(&builder.scene);
  return std::move(builder.scene);
}

/// Is the light hidden at a point of a face? By the scene's triangles that look at the light, its
/// round things, in double; nothing of Embree.
bool isDark(const Scene& scene, const Light& light, const Vector3d& point) {
  const bool is_sun = light.kind == Light::Kind::kSun;
  const Vector3d way = is_sun ? Vector3d(50 * light.place) : Vector3d(light.place - point);
  const double first = 1e-6 / way.norm(), last = 1;
  for (const Triangle& triangle : scene.triangles) {
    const auto corner = [&](size_t k) -> Vector3d {
      return scene.vertices[static_cast<size_t>(triangle.vertices[k])].cast<double>() - point;
    };
    const Vector3d a = corner(0), b = corner(1), c = corner(2);
    const double u = way.dot(b.cross(c)), v = way.dot(c.cross(a)), w = way.dot(a.cross(b));
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) continue;
    const Vector3d normal = scene.faces[static_cast<size_t>(triangle.face)].normal;
    if (normal.dot(way) <= 0) continue;
    const double t = normal.dot(a) / normal.dot(way);
    if (t > first && t < last) return true;
  }
  for (const Sphere& sphere : scene.spheres) {
    const Vector3d m = point - sphere.centre.cast<double>();
    const double a = way.squaredNorm(), b = m.dot(way);
    const double c = m.squaredNorm() - std::pow(static_cast<double>(sphere.radius), 2);
    if (b < 0 && b * b - a * c > 0) return true;
  }
  for (const Disc& disc : scene.discs) {
    const Vector3d n = disc.normal.cast<double>(), centre = disc.centre.cast<double>();
    const double t = n.dot(centre - point) / n.dot(way);
    if (t > first && t < last &&
        (point + t * way - centre).norm() < static_cast<double>(disc.radius)) {
      return true;
    }
  }
  return std::any_of(scene.rods.begin(),
                     scene.rods.end(),
                     [&](const Rod& r) { return r.isRound() && meetsCylinder(r, point, way); }) ||
         std::any_of(scene.tubes.begin(), scene.tubes.end(), [&](const Tube& t) {
           return meetsTube(t, point, way);
         });
}

bool isMiddle(const Scene& scene, const Edge& edge) {
  return scene.edges[static_cast<size_t>(edge.caster)].source == EdgeSource::kRodCentre;
}

// Where a shadow falls right onto the border of a face, that border is the only edge: beside it the
// face ends, so that the shadow parts nothing. Moved by less than rounding it is no other.
TEST(ShadowEdges, AreNotOnBordersOfFaces) {
  const double step = 1e-3;
  for (const double beside : {-1e-6, -1e-7, -1e-9, 0.0, 1e-9, 1e-7, 1e-6, -step, step}) {
    SceneBuilder builder = emptyRoom();
    builder.addBox(Frame3(), {3.5, 1, 0}, {4.5, 2, 1}, {0.7, 0});
    // The lamp stands at (2.2, 2.6, 3.3): the edge x = 4.1, z = 1.4 goes to x = 4.5 on z = 1.
    builder.addBox(Frame3(), {3.7, 1.2, 1}, {4.1, 1.6, 1.4}, {0.7, 0});
    builder.finish();
    builder.scene.lights.push_back(lamp());
    builder.scene.lights[0].place.x() -= beside;
    const std::vector<Edge> shadows = shadowEdges(builder.scene, Raycaster(builder.scene));
    int along = 0;
    for (const Edge& e : shadows) {
      const bool is_here = std::abs(e.from.x() - 4.5) < 0.1 && std::abs(e.to.x() - 4.5) < 0.1 &&
                           std::abs(e.from.z() - 1) < 1e-5 && std::abs(e.to.z() - 1) < 1e-5;
      if (is_here && std::abs(e.from.y() - e.to.y()) > 0.1) ++along;
    }
    // The shadow goes to x = 4.5 + 0.21 beside, which is on the box or beyond it.
    EXPECT_EQ(along, beside == -step ? 1 : 0) << beside;
  }
}

// On one side there is light, on the other there is none.
TEST(ShadowEdges, PartLightFromDarkness) {
  size_t all_on_discs = 0;
  for (const Light& light : {lamp(), sun()}) {
    const Scene scene = clutteredRoom(light);
    const Raycaster raycaster(scene);
    const std::vector<Edge> shadows = shadowEdges(scene, raycaster);
    size_t checked = 0, wrong = 0, of_cylinder = 0, on_discs = 0;
    for (const Edge& edge : shadows) {
      ASSERT_EQ(edge.source, EdgeSource::kShadow);
      on_discs += edge.disc >= 0 ? 1 : 0;
      const LitPlane face = litPlaneOf(scene, edge);
      const Vector3d d = edge.to - edge.from;
      for (const Vector3d& end : {edge.from, edge.to}) {
        EXPECT_NEAR(face.normal.dot(end - face.origin), 0, 1e-9);
      }
      if (isMiddle(scene, edge)) continue;
      of_cylinder += edge.rod >= 0 && scene.rods[static_cast<size_t>(edge.rod)].isRound() ? 1 : 0;
      const Vector3d across = face.normal.cross(d).normalized();
      for (int k = 0; k < 20; ++k) {
        const Vector3d point = edge.from + (k + 0.5) / 20 * d;
        if (std::min((k + 0.5) / 20, 1 - (k + 0.5) / 20) * d.norm() < 1e-3) continue;
        ++checked;
        const bool a = isDark(scene, light, point + 1e-4 * across);
        const bool b = isDark(scene, light, point - 1e-4 * across);
        wrong += a == b ? 1 : 0;
      }
    }
    EXPECT_GT(shadows.size(), 30U);
    EXPECT_GT(checked, 500U);
    EXPECT_GE(of_cylinder, 2U);
    all_on_discs += on_discs;
    EXPECT_EQ(wrong, 0U);
  }
  EXPECT_GT(all_on_discs, 0U);
}

// Where the shadow of a ring or a wire covers a border, the border ends: within 5e-6 m of its end
// it parts light from darkness on one side, and lies in the dark on the other.
TEST(ShadowEdges, EndInTheShadowsOfTubes) {
  constexpr double kAlong = 5e-6, kAcross = 2e-7;
  for (const Light& light : {lamp(), sun()}) {
    size_t ends = 0, wrong = 0;
    for (uint64_t draw = 0; draw < 12; ++draw) {
      Random random(7, draw);
      Scene scene = clutteredRoom(light);
      for (int k = 0; k < 6; ++k) {
        Tube tube = scene.tubes[static_cast<size_t>(k % 2)];
        const Eigen::Matrix3d turn = drawRotation(&random);
        tube.centre = {random.next(1.6, 3.8), random.next(1.2, 4.2), random.next(1.6, 2.6)};
        tube.x = turn * tube.x;
        tube.y = turn * tube.y;
        scene.tubes.push_back(tube);
      }
      Scene bare = scene;
      bare.tubes.clear();
      const Raycaster raycaster(scene), bare_raycaster(bare);
      const std::vector<Edge> bare_shadows = shadowEdges(bare, bare_raycaster);
      for (const Edge& edge : shadowEdges(scene, raycaster)) {
        const Vector3d d = edge.to - edge.from;
        if (isMiddle(scene, edge) || d.norm() < 1e-3) continue;
        const Vector3d along = d.normalized();
        const Vector3d across = litPlaneOf(scene, edge).normal.cross(along);
        const auto darkSides = [&](const Scene& in, const Vector3d& point) {
          return (isDark(in, light, point + kAcross * across) ? 1 : 0) +
                 (isDark(in, light, point - kAcross * across) ? 1 : 0);
        };
        for (const auto& [end, out] : {std::pair(edge.from, Vector3d(-along)), {edge.to, along}}) {
          const Vector3d inside = end - kAlong * out, outside = end + kAlong * out;
          const bool goes_on =
              std::any_of(bare_shadows.begin(), bare_shadows.end(), [&](const Edge& o) {
                const Vector3d u = o.to - o.from, w = outside - o.from;
                const double t = u.dot(w) / u.squaredNorm();
                return o.caster == edge.caster && t >= 0 && t <= 1 && (w - t * u).norm() < 1e-9;
              });
          if (!goes_on) continue;  // It ends without tubes, too.
          ++ends;
          wrong += darkSides(scene, inside) == 1 && darkSides(scene, outside) == 2 ? 0 : 1;
        }
      }
    }
    EXPECT_GT(ends, 100U);
    EXPECT_LE(wrong, ends / 50);  // Where the two borders meet under a tiny angle.
  }
}

// Along random lines on the floor, light begins and ends at the borders, or at what is round.
TEST(ShadowEdges, AreComplete) {
  for (const Light& light : {lamp(), sun()}) {
    Scene scene = clutteredRoom(light);
    scene.spheres.clear();
    scene.discs.clear();
    scene.tubes.clear();
    std::erase_if(scene.edges, [&](const Edge& e) {
      return e.rod >= 0 && scene.rods[static_cast<size_t>(e.rod)].isRound();
    });
    std::erase_if(scene.rods, [](const Rod& rod) { return rod.isRound(); });
    const Raycaster raycaster(scene);
    const std::vector<Edge> shadows = shadowEdges(scene, raycaster);
    const Random random(5, 2);
    int changes = 0, missing = 0;
    for (uint64_t i = 0; i < 150; ++i) {
      const Vector3d from(
          random.uniform(4 * i, 0.01, 5.99), random.uniform(4 * i + 1, 0.01, 5.99), 0);
      const Vector3d to(
          random.uniform(4 * i + 2, 0.01, 5.99), random.uniform(4 * i + 3, 0.01, 5.99), 0);
      // Under the box that stands on the floor it is dark, but nobody sees it.
      const auto isUnderBox = [](const Vector3d& p) {
        return p.x() > 3.499 && p.x() < 4.501 && p.y() > 0.999 && p.y() < 2.001;
      };
      constexpr int kSteps = 400;
      bool before = isDark(scene, light, from);
      for (int k = 1; k <= kSteps; ++k) {
        double lo = static_cast<double>(k - 1) / kSteps, hi = static_cast<double>(k) / kSteps;
        const bool now = isDark(scene, light, from + hi * (to - from));
        if (now != before) {
          for (int bisections = 0; bisections < 30; ++bisections) {
            const double middle = (lo + hi) / 2;
            (isDark(scene, light, from + middle * (to - from)) == before ? lo : hi) = middle;
          }
          const Vector3d point = from + lo * (to - from);
          if (!isUnderBox(point)) {
            double nearest = std::numeric_limits<double>::infinity();
            for (const Edge& edge : shadows) {
              const Vector3d d = edge.to - edge.from;
              const double s = std::clamp((point - edge.from).dot(d) / d.squaredNorm(), 0.0, 1.0);
              nearest = std::min(nearest, (edge.from + s * d - point).norm());
            }
            ++changes;
            missing += nearest < 1e-5 ? 0 : 1;
          }
        }
        before = now;
      }
    }
    EXPECT_GT(changes, 200);
    EXPECT_EQ(missing, 0);
  }
}

// A box that floats under a lamp: the shadow of its top is a rectangle on the floor.
TEST(ShadowEdges, OfAFloatingBoxAreARectangle) {
  SceneBuilder builder = emptyRoom();
  builder.addBox(Frame3(), {2, 2, 1}, {3, 4, 1.5}, {0.7, 0});
  builder.finish();
  builder.scene.lights = {lamp()};
  const Raycaster raycaster(builder.scene);
  const std::vector<Edge> shadows = shadowEdges(builder.scene, raycaster);
  // The lamp is above the box: the top's four edges are its outline.
  ASSERT_EQ(shadows.size(), 4U);
  const Vector3d l = lamp().place;
  const double scale = l.z() / (l.z() - 1.5);
  for (const Edge& edge : shadows) {
    for (const Vector3d& end : {edge.from, edge.to}) {
      const Vector3d p = l + (end - l) / scale;  // Back up to the box.
      EXPECT_NEAR(std::min(std::abs(p.x() - 2), std::abs(p.x() - 3)), 0, 1e-6);
      EXPECT_NEAR(std::min(std::abs(p.y() - 2), std::abs(p.y() - 4)), 0, 1e-6);
    }
  }
  // Without shadows there is none.
  builder.scene.lights[0].casts_shadows = false;
  EXPECT_TRUE(shadowEdges(builder.scene, raycaster).empty());
}

struct Made {
  Scene scene;
  Labels labels;
};
Made makeWithShadows(Scene scene, const Camera& camera, const Pose& pose) {
  const Raycaster raycaster(scene);
  addRodSides(pose.position_in_world, &scene);
  addShadowEdges(raycaster, &scene);
  const Shader shader(scene, &raycaster);
  const auto spans = visibleSpans(scene, raycaster, camera, pose);
  Labels labels = makeLabels(scene, raycaster, shader, camera, pose, SensorOptions{}, spans);
  return {std::move(scene), std::move(labels)};
}

// Labels of shadows lie on steps of light: of the stated contrast, and no step where they end.
TEST(ShadowLabels, HaveTheirContrast) {
  const Light light = lamp();
  const Camera camera = testCameras(2)[0].second;
  const Pose pose = lookAt({5.5, 5.4, 3}, {2.6, 2.4, 0.3}, 0.1);
  const Made made = makeWithShadows(clutteredRoom(light), camera, pose);
  int shadows = 0;
  for (const LabelLine& line : made.labels.lines) {
    if (line.kind != LineKind::kShadow) continue;
    ++shadows;
    const Edge& edge = made.scene.edges[static_cast<size_t>(line.edge)];
    // Light falls onto white with 0.5 * 0.6 / (1 + ..) at most.
    // Grazing light is faint.
    const bool of_room = edge.face0 >= 0 && edge.face0 < 6;
    EXPECT_GT(line.contrast, of_room ? 1 : 0.01) << "line " << line.id;
    EXPECT_LT(line.contrast, 0.5 * 0.6 * 255);
    EXPECT_GE(line.contrast, line.contrast_min);
    if (isMiddle(made.scene, edge)) continue;
    const Vector3d middle = (line.points_in_cam[0] + line.points_in_cam[1]) / 2;
    const Vector3d point = pose.cam_from_world.transpose() * middle + pose.position_in_world;
    const LitPlane face = litPlaneOf(made.scene, edge);
    const Vector3d to_light = light.place - point;
    const double d2 = to_light.squaredNorm();
    const double expected = 255 * 0.5 * 0.6 * face.normal.dot(to_light.normalized()) / (1 + d2 / 9);
    // The mean along the line against its middle, on surfaces of albedo 0.5.
    if (of_room) {
      EXPECT_NEAR(line.contrast, expected, 0.25 * expected + 0.5) << line.id;
    }
  }
  EXPECT_GT(shadows, 15);
}

// A rod's shadow: by its middle where it is thin, by its borders where it is not.
TEST(ShadowLabels, OfRodsFollowTheirWidth) {
  const std::array<double, 4> params{300, 300, 319.5, 239.5};
  const Camera camera = makeCamera("pinhole", params, 640, 480);
  const Pose pose = lookAt({3, 2.4, 3.5}, {3, 2.5, 0}, 0);
  for (const double radius : {0.003, 0.05}) {
    SceneBuilder builder = emptyRoom();
    builder.addRod({2.2, 3.2, 1}, {3.8, 3.2, 1}, radius, 8, {0.2, 0});
    builder.finish();
    builder.scene.ambient_up = builder.scene.ambient_down = 0.2;
    Light light = lamp();
    light.place = {3, 2.9, 3.9};
    builder.scene.lights = {light};
    const Made made = makeWithShadows(std::move(builder.scene), camera, pose);
    int middles = 0, borders = 0;
    for (const LabelLine& line : made.labels.lines) {
      if (line.kind != LineKind::kShadow) continue;
      const Edge& edge = made.scene.edges[static_cast<size_t>(line.edge)];
      (isMiddle(made.scene, edge) ? middles : borders) += 1;
      EXPECT_GT(line.contrast, 3);
    }
    EXPECT_EQ(middles, radius < 0.01 ? 1 : 0) << radius;
    EXPECT_GE(borders, radius < 0.01 ? 0 : 4) << radius;
    // Two sides and half of each cap's eight edges.
    EXPECT_LE(borders, radius < 0.01 ? 0 : 10) << radius;
  }
}

}  // namespace
}  // namespace dlsd
