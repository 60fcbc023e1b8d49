#include "synth/tubes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "synth/dataset/random.h"
#include "synth/random_shapes.h"
#include "synth/raycaster.h"
#include "synth/visibility_oracle.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

Tube drawTube(Random* random) {
  const Eigen::Matrix3d axes = drawRotation(random);
  Tube tube;
  tube.centre = {random->next(-1, 1), random->next(-1, 1), random->next(4, 6)};
  tube.surface = 0;
  if (random->nextBool(0.5)) {
    const double ring = random->next(0.3, 1);
    tube.x = ring * axes.col(0);
    tube.y = ring * axes.col(1);
    tube.radius = ring * random->next(0.03, 0.8);
  } else {
    tube.kind = Tube::Kind::kString;
    tube.x = random->next(0.5, 1) * axes.col(0);
    tube.y = random->next(0.05, 0.6) * (axes.col(1) + random->next(-0.4, 0.4) * axes.col(0));
    tube.radius = random->next(0.005, 0.1);
  }
  return tube;
}

Rod drawRoundRod(Random* random) {
  const Vector3d middle{random->next(-1, 1), random->next(-1, 1), random->next(3, 6)};
  const Vector3d half = random->next(0.2, 1) * drawDirection(random);
  Rod rod;
  rod.from = middle - half;
  rod.to = middle + half;
  rod.radius = random->next(0.01, 0.4);
  rod.surface = 0;
  return rod;
}

double distanceToSpine(const Tube& tube, const Vector3d& p) {
  const auto [t0, t1] = spineRange(tube);
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= 3000; ++k) {
    nearest = std::min(nearest, (spineAt(tube, t0 + (t1 - t0) * k / 3000) - p).norm());
  }
  return nearest;
}

TEST(Tubes, NearestPointOfTheSpineIsTheNearest) {
  Random random(1, 1);
  for (int k = 0; k < 500; ++k) {
    const Tube tube = drawTube(&random);
    const Vector3d p = tube.centre + random.next(0, 2) * drawDirection(&random);
    const double found = (spineAt(tube, nearestOnSpine(tube, p)) - p).norm();
    const double least = distanceToSpine(tube, p);
    EXPECT_LE(found, least + 1e-12);
    EXPECT_GE(found, least - 2e-5);  // 3000 samples.
  }
}

// Hits lie on the tube with nothing before them, and rays that miss stay clear of it.
TEST(Tubes, RaysEnterWhereTheTubeBegins) {
  Random random(1, 2);
  int hits = 0, misses = 0;
  for (int k = 0; k < 400; ++k) {
    const Tube tube = drawTube(&random);
    const Vector3d aim = tube.centre + random.next(0, 1.3) * drawDirection(&random);
    const Vector3d direction = aim.normalized();
    const auto s = enterTube(tube, Vector3d::Zero(), direction, 0, 50);
    const double end = s ? *s : 12.0;
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 400; ++i) {
      const Vector3d p = (end * i / 400) * direction;
      nearest = std::min(nearest, (spineAt(tube, nearestOnSpine(tube, p)) - p).norm());
    }
    EXPECT_GE(nearest, tube.radius);
    EXPECT_EQ(meetsTube(tube, Vector3d::Zero(), 12 * direction), s.has_value());
    (s ? hits : misses) += 1;
    if (!s) continue;
    const Vector3d p = *s * direction;
    EXPECT_NEAR((spineAt(tube, nearestOnSpine(tube, p)) - p).norm(), tube.radius, 2e-7);
  }
  EXPECT_GT(hits, 50);
  EXPECT_GT(misses, 50);
}

// Through Embree, single and in packets: the same tube or cylinder at the same distance.
TEST(Tubes, RaycasterMeetsThemAsTheyAre) {
  Random random(1, 3);
  int hits = 0;
  for (int k = 0; k < 60; ++k) {
    SceneBuilder builder;
    builder.addTube(drawTube(&random), {0.5, 0});
    const Rod drawn = drawRoundRod(&random);
    builder.addRoundRod(drawn.from, drawn.to, drawn.radius, {0.5, 0});
    const Scene& scene = builder.scene;
    const Raycaster raycaster(scene);
    std::array<float, Raycaster::kPacket> x, y, z;
    std::array<Hit, Raycaster::kPacket> packet;
    for (size_t i = 0; i < x.size(); ++i) {
      const Vector3d d =
          (scene.tubes[0].centre + random.next(0, 1) * drawDirection(&random)).normalized();
      x[i] = static_cast<float>(d.x());
      y[i] = static_cast<float>(d.y());
      z[i] = static_cast<float>(d.z());
    }
    raycaster.castPacket(
        Eigen::Vector3f::Zero(), x.data(), y.data(), z.data(), x.size(), packet.data());
    for (size_t i = 0; i < x.size(); ++i) {
      const Eigen::Vector3f d(x[i], y[i], z[i]);
      const Hit hit = raycaster.cast(Eigen::Vector3f::Zero(), d, 0, 100);
      EXPECT_EQ(hit.kind, packet[i].kind);
      EXPECT_EQ(hit.distance, packet[i].distance);
      const auto tube = enterTube(scene.tubes[0], Vector3d::Zero(), d.cast<double>(), 0, 100);
      const auto side = enterCylinder(scene.rods[0], Vector3d::Zero(), d.cast<double>(), 0, 100);
      if (hit.kind == HitKind::kDisc) continue;  // A cap before them.
      double nearest = std::numeric_limits<double>::infinity();
      if (tube) nearest = *tube;
      if (side) nearest = std::min(nearest, *side);
      ASSERT_EQ(hit.kind != HitKind::kNothing, tube || side);
      if (hit.kind == HitKind::kNothing) continue;
      ++hits;
      EXPECT_NEAR(static_cast<double>(hit.distance), nearest, 1e-6);
      EXPECT_EQ(hit.kind, tube && *tube == nearest ? HitKind::kTube : HitKind::kRod);
    }
  }
  EXPECT_GT(hits, 200);
}

// Lines of sight touch the tube at its outline: a little outwards they pass it, inwards they don't.
TEST(Tubes, OutlinesAreTouchedByLinesOfSight) {
  Random random(1, 4);
  size_t points = 0;
  for (int k = 0; k < 60; ++k) {
    const Tube tube = drawTube(&random);
    for (const auto& curve : outlineOf(tube, Vector3d::Zero(), 40)) {
      for (const Vector3d& p : curve) {
        ++points;
        const Vector3d spine = spineAt(tube, nearestOnSpine(tube, p));
        // A string's end circles and a ring's inner side may lie inside of the tube elsewhere.
        if ((spine - p).norm() < tube.radius * (1 - 1e-9)) continue;
        EXPECT_NEAR((spine - p).norm(), tube.radius, 1e-9);
        EXPECT_NEAR((p - spine).normalized().dot(p.normalized()), 0, 1e-6);
      }
    }
  }
  EXPECT_GT(points, 3000U);
}

// The sides of a cylinder are where its outline is: tangent to lines of sight, on its surface.
TEST(Cylinders, SidesAreTouchedByLinesOfSight) {
  Random random(1, 5);
  int found = 0, none = 0;
  for (int k = 0; k < 2000; ++k) {
    const Rod rod = drawRoundRod(&random);
    const Vector3d axis = (rod.to - rod.from).normalized();
    const Vector3d sun = drawDirection(&random);
    for (const bool is_sun : {false, true}) {
      const auto sides = is_sun ? sidesFromSun(rod, sun) : sidesFrom(rod, Vector3d::Zero());
      if (sides.empty()) {
        ++none;
        EXPECT_LE(axis.cross(rod.from).norm(), rod.radius);
        continue;
      }
      ASSERT_EQ(sides.size(), 2U);
      ++found;
      for (const auto& [from, to] : sides) {
        EXPECT_NEAR((to - from - (rod.to - rod.from)).norm(), 0, 1e-12);
        const Vector3d normal = from - rod.from;
        EXPECT_NEAR(normal.norm(), rod.radius, 1e-12);
        EXPECT_NEAR(normal.dot(axis), 0, 1e-12);
        EXPECT_NEAR(normal.dot(is_sun ? sun : Vector3d(from.normalized())), 0, 1e-9);
      }
      EXPECT_GE(sides[0][0].z(), sides[1][0].z());
    }
  }
  EXPECT_GT(found, 3000);
  EXPECT_GT(none, 0);
}

}  // namespace
}  // namespace dlsd
