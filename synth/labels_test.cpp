#include "synth/labels.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "synth/dataset/random.h"
#include "synth/pixel_response.h"
#include "synth/render.h"
#include "synth/scene_builder.h"
#include "synth/test_cameras.h"
#include "synth/tubes.h"
#include "synth/variety.h"
#include "synth/visibility_oracle.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Visibility by events and one ray test each agrees with brute force at random points of random
// edges.
TEST(VisibleSpans, AgreeWithBruteForce) {
  size_t tested = 0, visible = 0, differ = 0;
  for (const auto& [name, camera] : testCameras()) {
    for (uint64_t index = 0; index < 3; ++index) {
      const SceneView view = makeSceneView("room", 100, index);
      const Raycaster raycaster(view.scene);
      const auto spans = visibleSpans(view.scene, raycaster, camera, view.pose);
      const Vector3d eye = view.pose.position_in_world;
      const VisibilityOracle oracle(view.scene, eye);
      std::vector<std::vector<const EdgeSpan*>> by_edge(view.scene.edges.size());
      for (const EdgeSpan& s : spans) by_edge[static_cast<size_t>(s.edge)].push_back(&s);
      Random random(11, index);
      for (int k = 0; k < 4000; ++k) {
        const int e = random.nextInt(0, static_cast<int>(view.scene.edges.size()) - 1);
        const double t = random.next(0, 1);
        const Edge& edge = view.scene.edges[static_cast<size_t>(e)];
        const Vector3d point = edge.from + t * (edge.to - edge.from);
        const Vector3d ray = view.pose.toCam(point);
        const auto pixel = camera.project(ray);
        const bool imaged = pixel && camera.inImage(*pixel);
        const bool expected =
            imaged && !looksAway(view.scene, edge, eye) && !oracle.hidden(edge, point);
        double phi = 0, nearest_end = 1;
        bool found = false;
        for (const EdgeSpan* s : by_edge[static_cast<size_t>(e)]) {
          phi = angleTo(s->arc.from, ray);
          found = found || (phi >= s->phi0 && phi <= s->phi1);
          nearest_end = std::min({nearest_end, std::abs(phi - s->phi0), std::abs(phi - s->phi1)});
        }
        if (nearest_end < 2 * kShortestSpanRad) continue;  // At an end both answers are right.
        ++tested;
        visible += expected ? 1U : 0U;
        if (found != expected) {
          ++differ;
          ADD_FAILURE() << name << " room " << index << " edge " << e << " t " << t << ": span "
                        << found << ", brute force " << expected;
        }
      }
    }
  }
  std::printf("visibility: %zu points, %zu visible, %zu differ\n", tested, visible, differ);
  EXPECT_GT(tested, 40000U);
  EXPECT_GT(visible, 4000U);
  EXPECT_LT(visible, tested / 2);
}

// Just inside an occluded end the edge is seen, just outside it is hidden.
TEST(VisibleSpans, EndWhereBruteForceSaysSo) {
  size_t ends = 0, exact = 0;
  constexpr double kStep = 3e-6;
  for (const auto& [name, camera] : testCameras()) {
    const SceneView view = makeSceneView("room", 101, 2);
    const Raycaster raycaster(view.scene);
    const auto spans = visibleSpans(view.scene, raycaster, camera, view.pose);
    const VisibilityOracle oracle(view.scene, view.pose.position_in_world);
    for (size_t k = 0; k < spans.size(); k += 3) {
      const EdgeSpan& span = spans[k];
      if (span.phi1 - span.phi0 < 20 * kStep) continue;
      const Edge& edge = view.scene.edges[static_cast<size_t>(span.edge)];
      const double angle = span.arc.angle();
      const auto hiddenAt = [&](double phi) {
        // The point of the edge's line that the direction meets.
        const Vector3d d = view.pose.cam_from_world.transpose() * span.arc.at(phi / angle);
        const Vector3d u = edge.to - edge.from, w = edge.from - view.pose.position_in_world;
        const Vector3d n = u.cross(d);
        const double s = d.cross(w).dot(n) / n.squaredNorm();
        return oracle.hidden(edge, edge.from + s * u);
      };
      for (size_t end = 0; end < 2; ++end) {
        if (span.ends[end] != EndKind::kOccluder) continue;
        const double phi = end == 0 ? span.phi0 : span.phi1, out = end == 0 ? -1 : 1;
        if (phi + out * kStep < 0 || phi + out * kStep > angle) continue;
        ++ends;
        // Where a rod enters a ball, the ball's surface is only phi * distance before it.
        const double step = edge.rod >= 0 ? 10 * kStep : kStep;
        if (!hiddenAt(phi - out * step) && hiddenAt(phi + out * step)) ++exact;
      }
    }
  }
  std::printf("occluded ends: %zu of %zu within 3e-6 rad\n", exact, ends);
  EXPECT_GT(ends, 300U);
  // Where an outline meets the edge under a tiny angle, or two occluders hand over, 3e-6 rad along
  // the edge is nothing across it.
  EXPECT_GE(static_cast<double>(exact), 0.99 * static_cast<double>(ends));
}

// The same for scenes full of rings, strings and cylinders.
TEST(VisibleSpans, EndBehindTubesAndCylinders) {
  size_t ends = 0, round_ends = 0, wrong = 0, sides = 0;
  constexpr double kStep = 1e-7;
  SceneVariety variety;
  variety.distractors = {30, 30};
  variety.distractor_kinds = {"ring", "string", "cylinder"};
  for (const auto& [name, camera] : testCameras()) {
    SceneView view = makeSceneView("polyhedra", 7, ends);
    addVariety(variety, 7, ends, &view);
    addRodSides(view.pose.position_in_world, &view.scene);
    const Raycaster raycaster(view.scene);
    const VisibilityOracle oracle(view.scene, view.pose.position_in_world);
    Scene bare = view.scene;
    bare.tubes.clear();
    for (Rod& rod : bare.rods) rod.surface = -1;
    bare.discs.clear();
    const VisibilityOracle without(bare, view.pose.position_in_world);
    for (const EdgeSpan& span : visibleSpans(view.scene, raycaster, camera, view.pose)) {
      const Edge& edge = view.scene.edges[static_cast<size_t>(span.edge)];
      sides += edge.source == EdgeSource::kRodSide ? 1 : 0;
      if (span.phi1 - span.phi0 < 20 * kStep) continue;
      const auto pointAt = [&](double phi) -> Vector3d {
        const Vector3d d =
            view.pose.cam_from_world.transpose() * span.arc.at(phi / span.arc.angle());
        const Vector3d u = edge.to - edge.from, w = edge.from - view.pose.position_in_world;
        const Vector3d n = u.cross(d);
        return edge.from + d.cross(w).dot(n) / n.squaredNorm() * u;
      };
      for (size_t end = 0; end < 2; ++end) {
        if (span.ends[end] != EndKind::kOccluder) continue;
        const double phi = end == 0 ? span.phi0 : span.phi1, out = end == 0 ? -1 : 1;
        const Vector3d outside = pointAt(phi + out * kStep), inside = pointAt(phi - out * kStep);
        ++ends;
        if (without.hidden(edge, outside)) continue;  // Not by something round.
        ++round_ends;
        wrong += !oracle.hidden(edge, inside) && oracle.hidden(edge, outside) ? 0 : 1;
      }
    }
  }
  std::printf("ends behind round things: %zu of %zu, wrong by 1e-7 rad: %zu; sides: %zu\n",
              round_ends,
              ends,
              wrong,
              sides);
  EXPECT_GT(round_ends, 60U);
  EXPECT_GT(sides, 20U);
  EXPECT_LE(wrong, round_ends / 50);  // Where an outline meets the edge under a tiny angle.
}

// A rod all across the view, almost a half circle, behind a ball near one of its far ends: one of
// the ball's two outline angles is beyond -180 degrees.
TEST(VisibleSpans, EndBehindBallsNearTheFarEndOfLongArcs) {
  const std::array<double, 8> params{100, 100, 319.5, 319.5, 0, 0, 0, 0};
  const Camera camera = makeCamera("kannala_brandt", params, 640, 640);
  size_t tested = 0, hidden = 0;
  for (const double side : {-1.0, 1.0}) {
    for (const double height : {0.25, 0.05, -0.1, -0.25}) {
      SceneBuilder builder;
      builder.addRod({-20, 0, 1}, {20, 0, 1}, 0.001, 4, {0, 0.2});
      builder.addSphere({side, 0, height}, 0.3, {0.5, 0});
      builder.finish();
      const Scene scene = std::move(builder.scene);
      const Raycaster raycaster(scene);
      const VisibilityOracle oracle(scene, Vector3d::Zero());
      const auto spans = visibleSpans(scene, raycaster, camera, Pose{});
      for (size_t e = 0; e < scene.edges.size(); ++e) {
        const Edge& edge = scene.edges[e];
        if (edge.source != EdgeSource::kRodCentre) continue;
        const double angle = angleTo(edge.from, edge.to);
        ASSERT_GT(angle, 174 * M_PI / 180);
        constexpr int kPoints = 2000;
        for (int k = 1; k < kPoints; ++k) {
          // Evenly in angle: the rod is 1 m ahead.
          const double phi = angle * k / kPoints;
          const Vector3d point(std::tan(phi - angle / 2), 0, 1);
          bool found = false, at_end = false;
          for (const EdgeSpan& s : spans) {
            if (s.edge != static_cast<int>(e)) continue;
            found = found || (phi >= s.phi0 && phi <= s.phi1);
            at_end = at_end || std::min(std::abs(phi - s.phi0), std::abs(phi - s.phi1)) < 1e-6;
          }
          if (at_end) continue;
          ++tested;
          const bool expected = !oracle.hidden(edge, point);
          hidden += expected ? 0U : 1U;
          ASSERT_EQ(found, expected) << "ball at " << side << ", " << height << "; "
                                     << phi * 180 / M_PI << " of " << angle * 180 / M_PI << " deg";
        }
      }
    }
  }
  EXPECT_GT(tested, 15000U);
  EXPECT_GT(hidden, 500U);
}

struct Made {
  SceneView view;
  Labels labels;
  std::vector<EdgeSpan> spans;
};

Made make(const Camera& camera, uint64_t seed, uint64_t index) {
  Made m{makeSceneView("room", seed, index), {}, {}};
  const Raycaster raycaster(m.view.scene);
  const Shader shader(m.view.scene);
  m.spans = visibleSpans(m.view.scene, raycaster, camera, m.view.pose);
  m.labels =
      makeLabels(m.view.scene, raycaster, shader, camera, m.view.pose, SensorOptions{}, m.spans);
  return m;
}

TEST(Labels, PointsLieOnTheProjectionOfTheirEdge) {
  size_t points = 0, behind = 0;
  for (const auto& [name, camera] : testCameras()) {
    const Made m = make(camera, 102, 0);
    ASSERT_GT(m.labels.lines.size(), 50U) << name;
    for (const LabelLine& line : m.labels.lines) {
      EXPECT_NEAR(line.normal.norm(), 1, 1e-12);
      for (size_t end = 0; end < 2; ++end) {
        const Vector3d& p = line.points_in_cam[end];
        EXPECT_LT(std::abs(line.normal.dot(p.normalized())), 1e-12);
        const auto pixel = camera.project(p);
        ASSERT_TRUE(pixel) << name;
        // Points are rounded to 1e-6 px. An end at the rim is as good as the domain's bound allows.
        const double tolerance = line.ends[end] == EndKind::kRim ? 1e-3 : 2e-6;
        EXPECT_LT((*pixel - (end == 0 ? line.points.front() : line.points.back())).norm(),
                  tolerance)
            << name << " line " << line.id;
        const Edge& edge = m.view.scene.edges[static_cast<size_t>(line.edge)];
        const Vector3d u = (edge.to - edge.from).normalized();
        const Vector3d world =
            m.view.pose.cam_from_world.transpose() * p + m.view.pose.position_in_world;
        EXPECT_LT(u.cross(world - edge.from).norm(), 1e-9);
        behind += p.z() < 0 ? 1U : 0U;
      }
      EXPECT_NEAR(angleTo(line.points_in_cam[0], line.points_in_cam[1]), line.angle_rad, 1e-9);
      for (const Vector2d& p : line.points) {
        const auto ray = camera.unproject(p);
        if (!ray) continue;  // At the rim, by rounding.
        const auto back = camera.project(*ray - line.normal * line.normal.dot(*ray));
        if (!back) continue;  // At the rim, by rounding.
        ++points;
        EXPECT_LT((*back - p).norm(), 3e-6) << name << " line " << line.id;
        EXPECT_TRUE(camera.inImage(p));
      }
      double length = 0;
      for (size_t i = 1; i < line.points.size(); ++i) {
        length += (line.points[i] - line.points[i - 1]).norm();
      }
      EXPECT_NEAR(line.length_px, length, 1e-5 * static_cast<double>(line.points.size()));
      EXPECT_TRUE(line.contrast >= line.contrast_min - 1e-9 && line.contrast_min >= 0 &&
                  line.contrast <= 255);
    }
  }
  EXPECT_GT(points, 3000U);
  EXPECT_GT(behind, 20U);  // Cameras past 90 degrees see lines behind the image plane.
}

TEST(Labels, JunctionsAreWhereLabelsMeet) {
  const auto cameras = testCameras();
  const Made m = make(cameras[0].second, 103, 1);
  ASSERT_GT(m.labels.junctions.size(), 20U);
  for (const Junction& junction : m.labels.junctions) {
    EXPECT_GE(junction.lines.size(), 2U);
    for (const int id : junction.lines) {
      const LabelLine& line = m.labels.lines[static_cast<size_t>(id)];
      ASSERT_EQ(line.id, id);
      const bool first =
          line.ends[0] == EndKind::kVertex && (line.points.front() - junction.point).norm() < 0.05;
      const bool last =
          line.ends[1] == EndKind::kVertex && (line.points.back() - junction.point).norm() < 0.05;
      EXPECT_TRUE(first || last);
    }
  }
}

/// EUCM, double sphere, and a panorama of the whole sphere.
std::vector<std::pair<std::string, Camera>> moreCameras() {
  const std::array<double, 6> eucm{0.63, 1.1, 260, 261, 318, 242};
  const std::array<double, 6> double_sphere{-0.2, 0.59, 190, 191, 318, 242};
  const std::array<double, 4> panorama{512 / M_PI, 512 / M_PI, 511.5, 255.5};
  return {{"eucm", makeCamera("eucm", eucm, 640, 480)},
          {"double_sphere", makeCamera("double_sphere", double_sphere, 640, 480)},
          {"equirectangular", makeCamera("equirectangular", panorama, 1024, 512)}};
}

// The spans are arcs in space: another lens at the same place sees the same ones.
TEST(Labels, AgreeBetweenCameraModels) {
  auto cameras = testCameras();
  for (const auto& camera : moreCameras()) cameras.push_back(camera);
  size_t compared = 0;
  for (size_t a = 0; a < cameras.size(); ++a) {
    const size_t b = (a + 1) % cameras.size();
    const SceneView view = makeSceneView("room", 104, a);
    const Raycaster raycaster(view.scene);
    const Camera& other = cameras[b].second;
    const auto spans_a = visibleSpans(view.scene, raycaster, cameras[a].second, view.pose);
    const auto spans_b = visibleSpans(view.scene, raycaster, other, view.pose);
    for (const EdgeSpan& s : spans_a) {
      // All of it well inside the other image.
      bool inside = true;
      for (size_t end = 0; end < 2; ++end) {
        inside = inside && (s.ends[end] == EndKind::kVertex || s.ends[end] == EndKind::kOccluder);
      }
      const double angle = s.arc.angle();
      for (int k = 0; k <= 16; ++k) {
        const auto p = other.project(s.arc.at((s.phi0 + (s.phi1 - s.phi0) * k / 16) / angle));
        inside =
            inside && p && other.inImage(*p + Vector2d(1, 1)) && other.inImage(*p - Vector2d(1, 1));
      }
      if (!inside) continue;
      ++compared;
      const bool same = std::any_of(spans_b.begin(), spans_b.end(), [&](const EdgeSpan& t) {
        return t.edge == s.edge && std::abs(t.phi0 - s.phi0) <= 1e-9 &&
               std::abs(t.phi1 - s.phi1) <= 1e-9 && t.arc.normal == s.arc.normal;
      });
      EXPECT_TRUE(same) << cameras[a].first << " against " << cameras[b].first << " edge "
                        << s.edge;
    }
  }
  EXPECT_GT(compared, 500U);
}

// What leaves a panorama on the right comes in on the left, at the same height; nothing is drawn
// across.
TEST(Labels, OfAPanoramaGoOnBehindTheSeam) {
  const Camera camera = moreCameras().back().second;
  size_t seams = 0, points = 0;
  for (uint64_t index = 0; index < 3; ++index) {
    const Made m = make(camera, 102, index);
    ASSERT_GT(m.labels.lines.size(), 100U);
    for (const LabelLine& line : m.labels.lines) {
      for (size_t end = 0; end < 2; ++end) {
        const Vector2d& p = end == 0 ? line.points.front() : line.points.back();
        // A panorama has no border and no rim.
        EXPECT_TRUE(line.ends[end] != EndKind::kBorder && line.ends[end] != EndKind::kRim);
        if (line.ends[end] != EndKind::kSeam) continue;
        ++seams;
        EXPECT_NEAR(std::abs(p.x() - 511.5), 512, 1e-5);
        const auto goesOn = [&](const LabelLine& other) {
          for (size_t k = 0; k < 2; ++k) {
            const Vector2d& q = k == 0 ? other.points.front() : other.points.back();
            if (other.edge == line.edge && other.ends[k] == EndKind::kSeam &&
                std::abs(q.y() - p.y()) < 1e-5 && std::abs(std::abs(q.x() - p.x()) - 1024) < 1e-5) {
              return true;
            }
          }
          return false;
        };
        EXPECT_EQ(std::count_if(m.labels.lines.begin(), m.labels.lines.end(), goesOn), 1)
            << index << " line " << line.id;
      }
      for (size_t i = 0; i < line.points.size(); ++i) {
        ++points;
        const auto ray = camera.unproject(line.points[i]);
        ASSERT_TRUE(ray);
        EXPECT_LT(std::abs(line.normal.dot(*ray)), 2e-8);
        if (i == 0) continue;
        // The drawn line, too: half way between two points it is as near as they are asked to be.
        const auto middle = camera.unproject((line.points[i - 1] + line.points[i]) / 2);
        ASSERT_TRUE(middle);
        EXPECT_LT(std::abs(line.normal.dot(*middle)) * 512 / M_PI, 0.0101) << "line " << line.id;
      }
    }
  }
  EXPECT_GT(seams, 30U);
  EXPECT_GT(points, 5000U);
}

/// A bright wall at z = 2 m ahead of a camera at the origin that looks along +z of the world,
/// behind a dark rod of the given radius at 1 m.
Scene wallAndRod(double radius, double x) {
  SceneBuilder builder;
  Frame3 wall;
  wall.origin = {-4, 4, 2};
  wall.axes.col(0) = Vector3d(1, 0, 0);
  wall.axes.col(1) = Vector3d(0, -1, 0);
  wall.axes.col(2) = Vector3d(0, 0, -1);
  builder.addPanel(wall, 0, 8, 8, Panel{{0, 0.8}, {}});
  builder.addRod({x, -0.25, 1}, {x, 0.25, 1}, radius, 4, {0, 0.2});
  builder.finish();
  return std::move(builder.scene);
}

// A rod far thinner than a pixel takes its share of every pixel on its way.
TEST(Render, SubPixelRodsCoverTheirShare) {
  const std::array<double, 4> params{500, 500, 159.5, 127.5};
  const Camera camera = makeCamera("pinhole", params, 320, 256);
  const CameraRays rays(camera);
  for (const double radius : {5e-5, 2e-4, 1e-3}) {
    const Scene scene = wallAndRod(radius, 0.0371);
    const Raycaster raycaster(scene);
    const Shader shader(scene);
    const Pose pose;
    const auto spans = visibleSpans(scene, raycaster, camera, pose);
    const auto image = renderRadiance(scene, raycaster, shader, rays, pose, spans, 1).radiance;
    // Square section, corners to x and y or sides: the width seen is between 2 r / sqrt(2) and 2 r.
    double missing = 0;
    constexpr int kFirst = 60, kLast = 200;
    for (int y = kFirst; y < kLast; ++y) {
      double row = 0;
      for (int x = 0; x < 320; ++x) {
        row += 0.8 - static_cast<double>(image[static_cast<size_t>(y * 320 + x)]);
      }
      missing += row / 0.6 / (kLast - kFirst);
    }
    EXPECT_GT(missing, 0.97 * std::sqrt(2.0) * radius * 500) << radius;
    EXPECT_LT(missing, 1.03 * 2 * radius * 500) << radius;
    const Labels labels =
        makeLabels(scene, raycaster, shader, camera, pose, SensorOptions{}, spans);
    ASSERT_EQ(labels.lines.size(), 1U);
    EXPECT_EQ(labels.lines[0].kind, LineKind::kWire);
    EXPECT_NEAR(labels.lines[0].points.front().x(), 500 * 0.0371 + 159.5, 1e-5);
    EXPECT_NEAR(labels.lines[0].length_px, 250, 1e-5);
    // Its contrast is what a blurred picture shows in the column 0.05 px beside its middle, of a
    // rod 2 r wide: a square section is between that and 2 r / sqrt(2).
    const PixelResponse response(SensorOptions{}.psf_sigma_px, 0);
    const auto blurred =
        renderRadiance(scene, raycaster, shader, rays, pose, spans, 1, response).radiance;
    double dip = 0;
    for (int y = kFirst; y < kLast; ++y) {
      dip += 255 * (0.8 - static_cast<double>(blurred[static_cast<size_t>(y * 320 + 178)])) /
             (kLast - kFirst);
    }
    EXPECT_GT(labels.lines[0].contrast, 0.97 * dip) << radius;
    EXPECT_LT(labels.lines[0].contrast, 1.03 * std::sqrt(2.0) * dip) << radius;
  }
}

TEST(Labels, ThickRodsAreLabelledByTheirSides) {
  const std::array<double, 4> params{500, 500, 159.5, 127.5};
  const Camera camera = makeCamera("pinhole", params, 320, 256);
  const Scene scene = wallAndRod(0.01, 0.02);
  const Raycaster raycaster(scene);
  const Shader shader(scene);
  const Labels labels = makeLabels(scene,
                                   raycaster,
                                   shader,
                                   camera,
                                   Pose{},
                                   SensorOptions{},
                                   visibleSpans(scene, raycaster, camera, Pose{}));
  EXPECT_GE(labels.lines.size(), 4U);
  for (const LabelLine& line : labels.lines) {
    EXPECT_NE(line.kind, LineKind::kWire);
  }
  const auto longest = std::count_if(labels.lines.begin(), labels.lines.end(), [](const auto& l) {
    return l.kind == LineKind::kSilhouette && l.length_px > 200 && std::abs(l.contrast - 153) < 1;
  });
  EXPECT_EQ(longest, 2);
}

}  // namespace
}  // namespace dlsd
