#include "detector/visible_arc.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A pinhole of 100 x 80 px whose plane through v = 30 shows as that row.
struct VisibleArc : testing::Test {
  Camera camera = makeCamera("pinhole", std::array<double, 4>{50, 50, 49.5, 39.5}, 100, 80);
  Vector3d normal = Vector3d(0, -50, -9.5).normalized();

  [[nodiscard]] Vector3d ray(double u) const { return *camera.unproject(Vector2d(u, 30)); }
  [[nodiscard]] std::optional<Arc> shown(double from, double to, bool ends_tell) const {
    return visibleArc(camera, normal, ray(from), ray((from + to) / 2), ray(to), ends_tell);
  }
};

TEST_F(VisibleArc, StaysAsItIsInsideTheImage) {
  for (const bool ends_tell : {false, true}) {
    const auto arc = shown(10, 90, ends_tell);
    ASSERT_TRUE(arc);
    EXPECT_LE((arc->from - ray(10)).norm(), 1e-15);
    EXPECT_LE((arc->to - ray(90)).norm(), 1e-15);
  }
}

// The fit may move an end over the border, whoever says that it's inside.
TEST_F(VisibleArc, EndsAtTheBorder) {
  for (const bool ends_tell : {false, true}) {
    const auto arc = shown(-3, 102, ends_tell);
    ASSERT_TRUE(arc);
    const Vector2d from = *camera.project(arc->from), to = *camera.project(arc->to);
    EXPECT_TRUE(camera.inImage(from));
    EXPECT_TRUE(camera.inImage(to));
    EXPECT_LE((from - Vector2d(-0.5, 30)).norm(), 1e-5);
    EXPECT_LE((to - Vector2d(99.5, 30)).norm(), 1e-5);
  }
}

TEST_F(VisibleArc, IsNothingOffTheImage) {
  for (const bool ends_tell : {false, true}) EXPECT_FALSE(shown(-30, -5, ends_tell));
}

}  // namespace
}  // namespace dlsd
