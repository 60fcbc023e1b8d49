#include "synth/planes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "synth/generate.h"
#include "synth/labels.h"
#include "synth/scene_builder.h"
#include "synth/shading.h"
#include "synth/test_cameras.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const std::vector<PlaneKind> kAll{PlaneKind::kDepth,
                                  PlaneKind::kNormal,
                                  PlaneKind::kInstance,
                                  PlaneKind::kEdge,
                                  PlaneKind::kDistanceField};

const std::vector<float>& floats(const Plane& plane) {
  return std::get<std::vector<float>>(plane.values);
}
const std::vector<int32_t>& ints(const Plane& plane) {
  return std::get<std::vector<int32_t>>(plane.values);
}

/// Planes of a frame of a preset, with what they were made from.
struct Made {
  Camera camera;
  SceneView view;
  std::vector<LabelLine> lines;
  std::vector<Plane> planes;
};

Made make(const Camera& camera, const std::string& preset, uint64_t index) {
  Made made{camera, makeSceneView(preset, 77, index), {}, {}};
  const Raycaster raycaster(made.view.scene);
  const Shader shader(made.view.scene);
  const Pose& pose = made.view.pose;
  const auto spans = visibleSpans(made.view.scene, raycaster, camera, pose);
  made.lines =
      makeLabels(made.view.scene, raycaster, shader, camera, pose, SensorOptions{}, spans).lines;
  made.planes = renderPlanes(made.view.scene, raycaster, camera, pose, made.lines, kAll);
  return made;
}

/// Nearest crossing of a ray with any face, by the triangles' own equations; faces are seen from
/// the front only.
struct BruteHit {
  double distance = 0;
  Vector3d normal{0, 0, 0};
  int face = -1;
};
BruteHit bruteHit(const Scene& scene, const Vector3d& origin, const Vector3d& ray) {
  BruteHit best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Triangle& triangle : scene.triangles) {
    const auto corner = [&](size_t k) -> Vector3d {
      return scene.vertices[static_cast<size_t>(triangle.vertices[k])].cast<double>() - origin;
    };
    const Vector3d a = corner(0), b = corner(1), c = corner(2);
    const double u = ray.dot(b.cross(c)), v = ray.dot(c.cross(a)), w = ray.dot(a.cross(b));
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) continue;
    const Vector3d normal = (b - a).cross(c - a);
    const double t = normal.dot(a) / normal.dot(ray);
    if (t > 1e-9 && t < nearest) {
      nearest = t;
      best = {t, scene.faces[static_cast<size_t>(triangle.face)].normal, triangle.face};
    }
  }
  return best;
}

TEST(Planes, DepthAndNormalsAreThoseOfTheTriangles) {
  size_t checked = 0, off = 0;
  for (const auto& [name, camera] : testCameras(16)) {
    const Made made = make(camera, "polyhedra", 3);
    ASSERT_TRUE(made.view.scene.spheres.empty() && made.view.scene.discs.empty());
    const auto& depth = floats(made.planes[0]);
    const auto& normal = floats(made.planes[1]);
    for (int y = 0; y < camera.height(); ++y) {
      for (int x = 0; x < camera.width(); ++x) {
        const auto pixel = static_cast<size_t>(y * camera.width() + x);
        const auto ray = camera.unproject(Vector2d(x, y));
        if (!ray) {
          EXPECT_EQ(depth[pixel], 0);
          continue;
        }
        const BruteHit hit = bruteHit(made.view.scene,
                                      made.view.pose.position_in_world,
                                      made.view.pose.cam_from_world.transpose() * *ray);
        const Vector3d expected = made.view.pose.cam_from_world * hit.normal;
        const Vector3d seen =
            Eigen::Map<const Eigen::Vector3f>(normal.data() + 3 * pixel).cast<double>();
        ++checked;
        // A face's plane keeps within float rounding of its triangles.
        const double height_m =
            (static_cast<double>(depth[pixel]) - hit.distance) * expected.dot(*ray);
        const bool same = std::abs(height_m) <= 1e-6 && (seen - expected).norm() <= 1e-6;
        off += same ? 0 : 1;
      }
    }
  }
  EXPECT_GT(checked, 15000U);
  // Rays within float rounding of an edge may see either side.
  EXPECT_LE(off, 2U);
}

TEST(Planes, InstancesAreBodies) {
  SceneBuilder builder;
  Frame3 frame;
  const Surface surface{0.5, 0};
  builder.addBox(frame, {-3, -3, 4}, {-1, -1, 5}, surface);
  const SlabFaces box = builder.addBox(frame, {1, -3, 4}, {3, -1, 5}, surface);
  builder.addDecal(box.bottom, {DecalShape::kRectangle, {1, 0.5}, {0.3, 0.2}, 0, {0.9, 0}});
  builder.addSphere({-2, 2, 5}, 0.8, surface);
  builder.addDisc({2, 2, 5}, {0, 0, 1}, 0.8, surface);
  builder.addRoundRod({-0.3, 0, 5}, {0.3, 0, 6}, 0.3, surface);
  Tube ring;
  ring.centre = {0, -2, 5};
  ring.x = {0.5, 0, 0};
  ring.y = {0, 0.5, 0};
  builder.addTube(ring, surface);
  builder.finish();
  const std::array<double, 4> params{60, 60, 79.5, 79.5};
  const Camera camera = makeCamera("pinhole", params, 160, 160);
  const Raycaster raycaster(builder.scene);
  const auto planes =
      renderPlanes(builder.scene, raycaster, camera, Pose{}, {}, {PlaneKind::kInstance});
  ASSERT_EQ(planes.size(), 1U);
  const auto at = [&](const Vector3d& point) {
    const Vector2d pixel = *camera.project(point);
    return ints(
        planes[0])[static_cast<size_t>(std::lround(pixel.y()) * 160 + std::lround(pixel.x()))];
  };
  EXPECT_EQ(at({-2, -2, 4}), 0);
  EXPECT_EQ(at({2, -2, 4}), 1);
  EXPECT_EQ(at({-1.1, -1.1, 4.6}), 0);  // Another face of the first box.
  EXPECT_EQ(at({-2, 2, 5}), 2);
  EXPECT_EQ(at({2, 2, 5}), 3);
  const int cylinder = at({0, 0, 5.5});
  EXPECT_EQ(at({-0.35, 0, 5}), cylinder);  // Its cap.
  const int torus = at({0.5, -2, 5});
  EXPECT_EQ(at({-0.5, -2, 5}), torus);
  const std::set<int> numbers{0, 1, 2, 3, cylinder, torus};
  EXPECT_EQ(numbers.size(), 6U);
  EXPECT_EQ(at({0, -2, 5}), -1);
}

// Every pixel against all pieces of all labels.
TEST(Planes, DistanceFieldIsThatOfTheNearestLabel) {
  size_t checked = 0, near = 0;
  for (const auto& [name, camera] : testCameras(13)) {
    const Made made = make(camera, "room", 2);
    ASSERT_GT(made.lines.size(), 50U);
    const auto& edge = ints(made.planes[3]);
    const auto& field = floats(made.planes[4]);
    for (int y = 0; y < camera.height(); ++y) {
      for (int x = 0; x < camera.width(); ++x) {
        const auto pixel = static_cast<size_t>(y * camera.width() + x);
        const Vector2d p(x, y);
        double best = std::numeric_limits<double>::infinity(), of_edge = best;
        for (const LabelLine& line : made.lines) {
          for (size_t i = 1; i < line.points.size(); ++i) {
            const Vector2d a = line.points[i - 1], d = line.points[i] - a;
            const double t = std::clamp((p - a).dot(d) / std::max(d.squaredNorm(), 1e-300), 0., 1.);
            const double distance = (a + t * d - p).norm();
            best = std::min(best, distance);
            if (line.id == edge[pixel]) of_edge = std::min(of_edge, distance);
          }
        }
        const float* at = field.data() + 4 * pixel;
        ASSERT_NEAR(static_cast<double>(at[0]), best, 1e-4) << name << x << " " << y;
        const Vector2d closest(static_cast<double>(at[2]), static_cast<double>(at[3]));
        ASSERT_NEAR((closest - p).norm(), best, 2e-4);
        ASSERT_GE(at[1], 0);
        ASSERT_LT(at[1], static_cast<float>(M_PI));
        ++checked;
        if (best < kEdgePlanePx - 1e-6) {
          ++near;
          ASSERT_NEAR(of_edge, best, 1e-9) << name;
        } else if (best > kEdgePlanePx + 1e-6) {
          ASSERT_EQ(edge[pixel], -1);
        }
        // Away from the ends, the nearest point is at the foot of a perpendicular.
        const Vector2d along(std::cos(static_cast<double>(at[1])),
                             std::sin(static_cast<double>(at[1])));
        if (best > 0.5 && std::abs((p - closest).dot(along)) > 1e-3 * best + 1e-3) {
          bool at_end = false;
          for (const LabelLine& line : made.lines) {
            for (const Vector2d& q : line.points) at_end = at_end || (q - closest).norm() < 1e-3;
          }
          ASSERT_TRUE(at_end) << name << " " << x << " " << y;
        }
      }
    }
  }
  EXPECT_GT(checked, 25000U);
  EXPECT_GT(near, 3000U);
}

TEST(Planes, WithoutLabelsThereIsNoField) {
  const Camera camera = testCameras(64)[0].second;
  const SceneView view = makeSceneView("polyhedra", 1, 1);
  const Raycaster raycaster(view.scene);
  const auto planes = renderPlanes(
      view.scene, raycaster, camera, view.pose, {}, {PlaneKind::kDistanceField, PlaneKind::kEdge});
  ASSERT_EQ(planes.size(), 2U);
  for (size_t i = 0; i < floats(planes[0]).size(); ++i) {
    ASSERT_EQ(floats(planes[0])[i], i % 4 == 0 ? -1 : 0);
  }
  for (const int32_t id : ints(planes[1])) ASSERT_EQ(id, -1);
}

TEST(Planes, NamesAreUnique) {
  ASSERT_EQ(planeNames().size(), kAll.size());
  for (size_t i = 0; i < kAll.size(); ++i) {
    EXPECT_EQ(toString(kAll[i]), planeNames()[i]);
    EXPECT_EQ(planeFromName(planeNames()[i]), kAll[i]);
  }
  EXPECT_FALSE(planeFromName("colour"));
}

// The format's description: magic, version 1.0, header length, a Python dict, padding to 64 bytes.
TEST(Planes, NpyFilesAreWellFormed) {
  Plane plane{PlaneKind::kNormal, 5, 3, 3, std::vector<float>(45)};
  for (size_t i = 0; i < 45; ++i) {
    std::get<std::vector<float>>(plane.values)[i] = static_cast<float>(i) / 7;
  }
  const std::string bytes = encodeNpy(plane);
  ASSERT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const size_t length = static_cast<uint8_t>(bytes[8]) + 256U * static_cast<uint8_t>(bytes[9]);
  EXPECT_EQ((10 + length) % 64, 0U);
  const std::string header = bytes.substr(10, length);
  EXPECT_EQ(header.back(), '\n');
  EXPECT_EQ(header.substr(0, header.find('}') + 1),
            "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 5, 3), }");
  ASSERT_EQ(bytes.size(), 10 + length + 45 * 4);
  EXPECT_EQ(std::memcmp(bytes.data() + 10 + length, floats(plane).data(), 45 * 4), 0);

  const Plane ids{PlaneKind::kEdge, 2, 2, 1, std::vector<int32_t>{1, -1, 3, 7}};
  const std::string id_bytes = encodeNpy(ids);
  EXPECT_NE(id_bytes.find("'<i4', 'fortran_order': False, 'shape': (2, 2), }"), std::string::npos);
  int32_t last = 0;
  std::memcpy(&last, id_bytes.data() + id_bytes.size() - 4, 4);
  EXPECT_EQ(last, 7);
}

}  // namespace
}  // namespace dlsd
