#include "detector/joints.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "detector/plane_curve.h"
#include "detector/test_scene.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDeg = M_PI / 180;

double lengthOf(const Camera& camera, const DetectedLine& line) {
  double length = 0;
  const auto curve = test::curveOf(camera, line);
  for (size_t i = 1; i < curve.size(); ++i) length += (curve[i] - curve[i - 1]).norm();
  return length;
}

/// A line on the plane of two rays, from the first to so many px beyond the second; brighter on the
/// side of `bright`. If turned, it begins there.
DetectedLine lineThrough(const Camera& camera,
                         const Vector3d& first,
                         const Vector3d& second,
                         double beyond_px,
                         const Vector3d& bright,
                         bool turned) {
  const Arc arc = *arcBetween(first, second);
  // Image curves are nearly straight for so short a way.
  double t = 1;
  const Vector2d second_px = *camera.project(second);
  for (int i = 0; i < 20; ++i) {
    constexpr double kStep = 1e-3;
    const Vector2d here = *camera.project(arc.at(t));
    const double px_per_step = (*camera.project(arc.at(t + kStep)) - here).norm();
    const double now_px = (t < 1 ? -1 : 1) * (here - second_px).norm();
    t += (beyond_px - now_px) * kStep / px_per_step;
  }
  DetectedLine line;
  line.arc = arc;
  line.arc.to = arc.at(t);
  if (turned) std::swap(line.arc.from, line.arc.to);
  line.arc.normal = canonicalNormal(line.arc.normal);
  line.from_px = *camera.project(line.arc.from);
  line.to_px = *camera.project(line.arc.to);
  line.length_px = lengthOf(camera, line);
  line.normal_cov = Eigen::Matrix3d::Identity();
  line.polarity = line.arc.normal.dot(bright) > 0 ? 1 : -1;
  return line;
}

/// Two lines that meet at `vertex` at an angle and go on beyond it (or end before).
struct Kink {
  Vector2d vertex_px;
  Vector3d vertex, ends[2], bright;
  double beyond_px[2];

  /// lengths_px: of both, up to the vertex.
  Kink(const Camera& camera,
       const Vector2d& at,
       double direction_rad,
       double turn_rad,
       const std::array<double, 2>& beyond,
       const std::array<double, 2>& lengths_px = {120, 120})
      : vertex_px(at), vertex(*camera.unproject(at)), beyond_px{beyond[0], beyond[1]} {
    const Vector2d along(std::cos(direction_rad), std::sin(direction_rad));
    ends[0] = *camera.unproject(at - lengths_px[0] * along);
    const Vector3d normal = ends[0].cross(vertex).normalized();
    const Vector3d ahead = Eigen::AngleAxisd(turn_rad, vertex) * normal.cross(vertex);
    double angle = 0.05;
    for (int i = 0; i < 30; ++i) {
      ends[1] = std::cos(angle) * vertex + std::sin(angle) * ahead;
      angle *= lengths_px[1] / (*camera.project(ends[1]) - at).norm();
    }
    bright = *camera.unproject(at + 40 * Vector2d(-along.y(), along.x()));
  }
  [[nodiscard]] DetectedLine line(const Camera& camera, size_t which, bool turned) const {
    return lineThrough(camera, ends[which], vertex, beyond_px[which], bright, turned);
  }
};

Vector2d endAt(const DetectedLine& line, bool turned) {
  return turned ? line.from_px : line.to_px;
}

void expectUnchanged(const DetectedLine& line, const DetectedLine& before) {
  EXPECT_EQ(line.arc.from, before.arc.from);
  EXPECT_EQ(line.arc.to, before.arc.to);
  EXPECT_EQ(line.arc.normal, before.arc.normal);
  EXPECT_EQ(line.from_px, before.from_px);
  EXPECT_EQ(line.to_px, before.to_px);
  EXPECT_EQ(line.length_px, before.length_px);
}

/// Where lines meet: in the middle of the image, and off it.
std::vector<Vector2d> places(const Camera& camera) {
  return {{camera.width() * 0.5, camera.height() * 0.5},
          {camera.width() * 0.7, camera.height() * 0.38},
          {camera.width() * 0.36, camera.height() * 0.62}};
}

// Every camera, kink, order of the lines and of their ends: what overshoots and stays within
// kSharedPx of the other line is cut at the vertex, to which each line is shortened.
TEST(Joints, LinesAreCutWhereTheyCross) {
  int cut = 0, kept = 0;
  for (const auto& [name, camera] : test::testCameras()) {
    const RayTable rays(camera);
    // One that has nothing to do with the others.
    const DetectedLine far_line =
        Kink(camera, {500, 420}, 0.3, 0, {0, 0}, {60, 60}).line(camera, 0, false);
    int variant = 0;
    for (const Vector2d& at : places(camera)) {
      for (const double kink_deg : {-10.0, -6.0, -3.0, 3.0, 4.5, 6.0, 8.0, 10.0}) {
        for (const auto& [a_px, b_px] :
             {std::pair(5.0, 5.0), {8.0, 14.0}, {14.0, 8.0}, {20.0, 6.0}, {25.0, 25.0}}) {
          ++variant;
          const Kink kink(camera, at, 0.7 * variant, kink_deg * kDeg, {a_px, b_px});
          const bool turned[2] = {variant % 2 == 0, variant / 2 % 2 == 0};
          const DetectedLine before[2] = {kink.line(camera, 0, turned[0]),
                                          kink.line(camera, 1, turned[1])};
          const bool swapped = variant % 3 == 0;
          std::vector<DetectedLine> lines{before[swapped ? 1 : 0], before[swapped ? 0 : 1]};
          lines.insert(lines.begin() + variant % 3, far_line);
          JointCutter(rays, 5).cut(&lines);
          ASSERT_EQ(lines.size(), 3U);
          SCOPED_TRACE(testing::Message() << name << " " << at.transpose() << " " << kink_deg << " "
                                          << a_px << " " << b_px << " variant " << variant);
          expectUnchanged(lines[static_cast<size_t>(variant % 3)], far_line);
          lines.erase(lines.begin() + variant % 3);
          for (const size_t which : {0U, 1U}) {
            const DetectedLine& line = lines[swapped ? 1 - which : which];
            const DetectedLine& other = before[1 - which];
            const Vector2d end = endAt(before[which], turned[which]);
            const double off_px =
                std::abs(curveOffset(rays.at(end.x(), end.y()), other.arc.normal).offset_px);
            if (std::abs(off_px - JointCutter::kSharedPx) < 0.15) continue;
            if (off_px > JointCutter::kSharedPx) {
              expectUnchanged(line, before[which]);
              ++kept;
              continue;
            }
            ++cut;
            EXPECT_LE((endAt(line, turned[which]) - kink.vertex_px).norm(), 0.5);
            EXPECT_EQ(endAt(line, !turned[which]), endAt(before[which], !turned[which]));
            EXPECT_EQ(line.arc.normal, before[which].arc.normal);
            EXPECT_LE(std::abs(line.arc.normal.dot(line.arc.from)), 1e-12);
            EXPECT_LE(std::abs(line.arc.normal.dot(line.arc.to)), 1e-12);
            EXPECT_NEAR(line.arc.to.norm(), 1, 1e-12);
            EXPECT_EQ(camera.project(line.arc.from), line.from_px);
            EXPECT_EQ(camera.project(line.arc.to), line.to_px);
            EXPECT_NEAR(line.length_px, lengthOf(camera, line), 0.5);
          }
        }
      }
    }
  }
  EXPECT_GE(cut, 500);
  EXPECT_GE(kept, 200);
}

TEST(Joints, OtherLinesAreLeftAsTheyAre) {
  for (const auto& [name, camera] : test::testCameras()) {
    const RayTable rays(camera);
    int variant = 0, pairs = 0;
    const auto expectLeft = [&](const DetectedLine& a, const DetectedLine& b) {
      for (const bool swapped : {false, true}) {
        std::vector<DetectedLine> lines{swapped ? b : a, swapped ? a : b};
        JointCutter(rays, 5).cut(&lines);
        ASSERT_EQ(lines.size(), 2U);
        expectUnchanged(lines[swapped ? 1 : 0], a);
        expectUnchanged(lines[swapped ? 0 : 1], b);
        ++pairs;
      }
    };
    for (const Vector2d& at : places(camera)) {
      for (const double kink_deg : {-8.0, -3.0, 3.0, 5.0, 10.0}) {
        ++variant;
        SCOPED_TRACE(testing::Message() << name << " " << at.transpose() << " " << kink_deg);
        const double direction = 0.9 * variant;
        const bool turned = variant % 2 == 0;
        const double angle = kink_deg * kDeg;
        {
          // Lines that cross each other: both go on.
          const Kink kink(camera, at, direction, angle, {40, 40});
          expectLeft(kink.line(camera, 0, turned), kink.line(camera, 1, !turned));
        }
        {
          // The border of something bright and that of something dark.
          const Kink kink(camera, at, direction, angle, {8, 6});
          DetectedLine other = kink.line(camera, 1, turned);
          other.polarity = -other.polarity;
          expectLeft(kink.line(camera, 0, turned), other);
        }
        {
          // The same edge found twice.
          const Kink kink(camera, at, direction, 0.08 * kDeg, {60, 60});
          expectLeft(kink.line(camera, 0, turned), kink.line(camera, 1, turned));
        }
        {
          // More than a third of it: which of the two it belongs to is open.
          const Kink kink(
              camera, at, direction, std::copysign(3 * kDeg, angle), {22, -3}, {36, 120});
          expectLeft(kink.line(camera, 0, turned), kink.line(camera, 1, turned));
        }
        {
          // The other one hardly goes on where this one ends.
          const Kink kink(
              camera, at, direction, std::copysign(5 * kDeg, angle), {12, -3}, {120, 17});
          expectLeft(kink.line(camera, 0, turned), kink.line(camera, 1, turned));
        }
        {
          // The other one begins far behind the crossing.
          const Kink kink(camera, at, direction, std::copysign(3 * kDeg, angle), {22, -16});
          expectLeft(kink.line(camera, 0, turned), kink.line(camera, 1, turned));
        }
      }
    }
    EXPECT_EQ(pairs, 3 * 5 * 6 * 2);
  }
}

// Two edges of a corner that are seen up to a few px before it, or beyond, end in it; lines that
// run past each other, end far from where they cross, or have their bright sides on different sides
// of the corner are left as they are.
TEST(Joints, EdgesOfACornerEndInIt) {
  int met = 0, left = 0;
  for (const auto& [name, camera] : test::testCameras()) {
    const RayTable rays(camera);
    int variant = 0;
    for (const Vector2d& at : places(camera)) {
      for (const double turn_deg : {-120.0, -70.0, -25.0, 25.0, 70.0, 120.0}) {
        for (const auto& [a_px, b_px] :
             {std::pair(-5.0, -5.0), {-11.5, 0.0}, {-6.5, 3.0}, {-12.5, -2.0}, {-20.0, -4.0}}) {
          for (const bool is_corner : {true, false}) {
            ++variant;
            const Kink kink(camera, at, 0.7 * variant, turn_deg * kDeg, {a_px, b_px});
            const bool turned[2] = {variant % 2 == 0, variant / 2 % 2 == 0};
            DetectedLine before[2] = {kink.line(camera, 0, turned[0]),
                                      kink.line(camera, 1, turned[1])};
            // Of both, the bright side is that of the other one, or of both it is not.
            for (const size_t which : {0U, 1U}) {
              DetectedLine& line = before[which];
              const double side = line.arc.normal.dot(kink.ends[1 - which]);
              const bool bright_inside = (variant % 3 == 0) != (which == 1 && !is_corner);
              line.polarity = (side > 0) == bright_inside ? 1 : -1;
            }
            std::vector<DetectedLine> lines{before[0], before[1]};
            JointCutter(rays, 5).meetAtCorners(UsableMask(camera).bits(), &lines);
            SCOPED_TRACE(testing::Message() << name << " " << at.transpose() << " " << turn_deg
                                            << " " << a_px << " " << b_px << " " << variant);
            const double farthest = std::max(std::abs(a_px), std::abs(b_px));
            if (!is_corner || farthest > JointCutter::kCornerPx) {
              expectUnchanged(lines[0], before[0]);
              expectUnchanged(lines[1], before[1]);
              ++left;
              continue;
            }
            ++met;
            for (const size_t which : {0U, 1U}) {
              const DetectedLine& line = lines[which];
              EXPECT_LE((endAt(line, turned[which]) - kink.vertex_px).norm(), 1e-6);
              EXPECT_EQ(endAt(line, !turned[which]), endAt(before[which], !turned[which]));
              EXPECT_EQ(line.arc.normal, before[which].arc.normal);
              EXPECT_LE(std::abs(line.arc.normal.dot(line.arc.from)), 1e-12);
              EXPECT_LE(std::abs(line.arc.normal.dot(line.arc.to)), 1e-12);
              EXPECT_NEAR(line.length_px, lengthOf(camera, line), 0.5);
            }
          }
        }
      }
    }
  }
  EXPECT_EQ(met, 4 * 3 * 6 * 3);
  EXPECT_EQ(left, 4 * 3 * 6 * (5 + 2));
}

// Of short lines it is often chance that they meet: both must be long against what is added.
TEST(Joints, ShortEdgesDoNotEndInACornerThatIsFarAway) {
  int met = 0, left = 0;
  for (const auto& [name, camera] : test::testCameras()) {
    const RayTable rays(camera);
    int variant = 0;
    for (const Vector2d& at : places(camera)) {
      for (const double short_px : {30.0, 60.0}) {
        for (const double gap_px : {0.1 * short_px, 0.16 * short_px}) {
          const bool first_is_short = ++variant % 2 == 0;
          const std::array<double, 2> lengths{first_is_short ? short_px : 120.0,
                                              first_is_short ? 120.0 : short_px};
          const Kink kink(camera,
                          at,
                          0.7 * variant,
                          90 * kDeg,
                          {first_is_short ? -gap_px : 0.0, first_is_short ? 0.0 : -gap_px},
                          lengths);
          DetectedLine before[2] = {kink.line(camera, 0, false), kink.line(camera, 1, false)};
          for (const size_t which : {0U, 1U}) {
            const double side = before[which].arc.normal.dot(kink.ends[1 - which]);
            before[which].polarity = side > 0 ? 1 : -1;
          }
          std::vector<DetectedLine> lines{before[0], before[1]};
          JointCutter(rays, 5).meetAtCorners(UsableMask(camera).bits(), &lines);
          SCOPED_TRACE(testing::Message()
                       << name << " " << at.transpose() << " " << short_px << " " << gap_px);
          const size_t which = first_is_short ? 0 : 1;
          if (gap_px > 0.12 * short_px) {
            expectUnchanged(lines[which], before[which]);
            ++left;
          } else {
            EXPECT_LE((lines[which].to_px - kink.vertex_px).norm(), 1e-6);
            ++met;
          }
        }
      }
    }
  }
  EXPECT_EQ(met, 4 * 3 * 2);
  EXPECT_EQ(left, 4 * 3 * 2);
}

}  // namespace
}  // namespace dlsd
