#include "synth/raycaster.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>

#include "synth/dataset/random.h"
#include "synth/random_shapes.h"
#include "synth/scene_builder.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

constexpr int kKinds = 5;  // Boxes, balls, discs, rings, cylinders.
constexpr int kPairs = 3;  // Of each kind.
constexpr int kNoKind = -1;

/// Shapes in pairs that nearly coincide: the second of each pair lies up to a few 1e-6 m inside or
/// outside the first. Without the first ones of `left_out`.
Scene pairsOfShapes(uint64_t seed, int left_out) {
  SceneBuilder builder;
  Random random(5, seed);
  const Surface surface{0.5, 0};
  for (int kind = 0; kind < kKinds; ++kind) {
    for (int pair = 0; pair < kPairs; ++pair) {
      const Vector3d centre{random.next(-1, 1), random.next(-1, 1), random.next(3, 6)};
      const Eigen::Matrix3d axes = drawRotation(&random);
      const double size = random.next(0.2, 0.8);
      const double gap = random.next(-3e-6, 3e-6);
      for (const bool is_first : {true, false}) {
        if (is_first && kind == left_out) continue;
        const double r = is_first ? size : size + gap;
        switch (kind) {
          case 0: {
            Frame3 frame;
            frame.origin = centre;
            frame.axes = axes;
            builder.addBox(frame, Vector3d::Constant(-r), Vector3d::Constant(r), surface);
            break;
          }
          case 1:
            builder.addSphere(centre, r, surface);
            break;
          case 2:
            builder.addDisc(is_first ? centre : Vector3d(centre + gap * axes.col(2)),
                            axes.col(2),
                            size,
                            surface);
            break;
          case 3: {
            Tube ring;
            ring.centre = centre;
            ring.x = size * axes.col(0);
            ring.y = size * axes.col(1);
            ring.radius = r / 4;
            builder.addTube(ring, surface);
            break;
          }
          default:
            builder.addRoundRod(
                centre - size * axes.col(0), centre + r * axes.col(0), r / 4, surface);
        }
      }
    }
  }
  return builder.scene;
}

/// Whether a hit is on the first of a pair of that kind.
bool isOnFirst(const Scene& scene, const Hit& hit, int kind) {
  switch (kind) {
    case 0:
      return hit.kind == HitKind::kFace && hit.index / 6 % 2 == 0;
    case 1:
      return hit.kind == HitKind::kSphere && hit.index % 2 == 0;
    case 2:
      return hit.kind == HitKind::kDisc && hit.index < 2 * kPairs && hit.index % 2 == 0;
    case 3:
      return hit.kind == HitKind::kTube && hit.index % 2 == 0;
    default:
      for (int rod = 0; rod < 2 * kPairs; rod += 2) {
        if (isOnRod(hit, scene, rod)) return true;
      }
      return false;
  }
}

// An edge is cut in pieces where floats come near to it.
TEST(Raycaster, CutsEdgesAtFloatsNearThem) {
  const Random random(4, 2);
  constexpr uint64_t kEdges = 2000;
  constexpr int kPieces = 7;
  double best_sum = 0, any_sum = 0;
  for (uint64_t i = 0; i < kEdges; ++i) {
    Eigen::Vector3d from, to;
    for (int k = 0; k < 3; ++k) {
      const uint64_t at = 6 * i + 2 * static_cast<uint64_t>(k);
      from[k] = random.uniform(at, -8, 8);
      to[k] = random.uniform(at + 1, -8, 8);
    }
    const int cut = 1 + static_cast<int>(i % (kPieces - 1));
    const Eigen::Vector3d axis = (to - from).normalized();
    const Eigen::Vector3d exact = from + (to - from) * (static_cast<double>(cut) / kPieces);
    const Eigen::Vector3d best = floatPointOnEdge(from, to, cut, kPieces).cast<double>();
    EXPECT_LT((best - exact).norm(), 0.01 * (to - from).norm());
    best_sum += axis.cross(best - from).norm();
    any_sum += axis.cross(roundToFloat(exact) - from).norm();
  }
  EXPECT_LT(best_sum, 0.35 * any_sum);
  EXPECT_GT(any_sum / kEdges, 1e-8);
}

// To look through things is to cast in the scene without them, bit for bit, however near behind
// them others lie.
TEST(Raycaster, LooksThroughNothingElse) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  std::array<int, kKinds> changed{}, just_behind{};
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const Scene all = pairsOfShapes(seed, kNoKind);
    const Raycaster raycaster(all);
    Random random(6, seed);
    for (int kind = 0; kind < kKinds; ++kind) {
      const Scene rest = pairsOfShapes(seed, kind);
      const Raycaster without(rest);
      for (int k = 0; k < 200; ++k) {
        const Vector3d aim{random.next(-2, 2), random.next(-2, 2), random.next(2, 6)};
        const Eigen::Vector3f direction = aim.normalized().cast<float>();
        const Eigen::Vector3f eye = Eigen::Vector3f::Zero();
        const auto isFirst = [&](const Hit& hit) { return isOnFirst(all, hit, kind); };
        const Hit past = raycaster.cast(eye, direction, 0, kFar, isFirst);
        const Hit expected = without.cast(eye, direction, 0, kFar);
        EXPECT_EQ(past.kind, expected.kind);
        EXPECT_EQ(past.distance, expected.distance);
        const Hit first = raycaster.cast(eye, direction, 0, kFar);
        const auto at = static_cast<size_t>(kind);
        changed[at] += isFirst(first) ? 1 : 0;
        just_behind[at] += isFirst(first) && past.kind != HitKind::kNothing &&
                                   past.distance <= first.distance * (1 + 1e-6F)
                               ? 1
                               : 0;
      }
    }
  }
  for (const int count : changed) EXPECT_GT(count, 50);
  for (const int count : just_behind) EXPECT_GT(count, 20);
}

}  // namespace
}  // namespace dlsd
