#include "cameras/arc.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector3d rayAt(double theta, double azimuth) {
  return {
      std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth), std::cos(theta)};
}

TEST(Arc, IsRunThroughAtEvenSpeed) {
  const auto arc = arcBetween({2, 0, 0}, {0, 3, 0});
  ASSERT_TRUE(arc);
  EXPECT_EQ(arc->from, Vector3d(1, 0, 0));
  EXPECT_EQ(arc->to, Vector3d(0, 1, 0));
  EXPECT_EQ(arc->normal, Vector3d(0, 0, 1));
  EXPECT_DOUBLE_EQ(arc->angle(), M_PI / 2);
  for (const double t : {0.0, 0.25, 0.5, 1.0}) {
    const Vector3d expected(std::cos(t * M_PI / 2), std::sin(t * M_PI / 2), 0);
    EXPECT_LE((arc->at(t) - expected).norm(), 3e-16);
    // The same arc with the other sign of its normal.
    EXPECT_LE((Arc{-arc->normal, arc->from, arc->to}.at(t) - expected).norm(), 3e-16);
  }
  EXPECT_NEAR(arc->angleToPlane(rayAt(M_PI / 2 - 0.1, 2)), 0.1, 1e-15);
}

TEST(Arc, ShortOnesHaveAnExactNormal) {
  const Vector3d a = Vector3d(0.3, -0.5, 0.9).normalized();
  for (const double angle : {1e-2, 1e-5, 1e-8, 1e-11, M_PI - 1e-8}) {
    const Vector3d side = a.unitOrthogonal();
    const auto arc = arcBetween(a, std::cos(angle) * a + std::sin(angle) * side);
    ASSERT_TRUE(arc) << angle;
    EXPECT_LE(std::abs(arc->normal.dot(arc->from)), 3e-16) << angle;
    EXPECT_LE(std::abs(arc->normal.dot(arc->to)), 3e-16) << angle;
    EXPECT_NEAR(arc->angle(), angle, 3e-16);
    EXPECT_NEAR(arc->normal.norm(), 1, 3e-16);
  }
}

TEST(Arc, ParallelRaysHaveNoPlane) {
  EXPECT_FALSE(arcBetween({0, 0, 1}, {0, 0, 5}));
  EXPECT_FALSE(arcBetween({0, 1, 1}, {0, -1, -1}));
  EXPECT_FALSE(arcBetween({0, 0, 1}, {0, 0, 0}));
  EXPECT_FALSE(arcBetween({0, 0, 1}, {std::nan(""), 0, 1}));
}

TEST(Arc, OnAGivenPlaneTheEndsAreProjected) {
  const auto arc = arcOnPlane({0, 0, 2}, {3, 0, 1}, {0, 1, -7});
  ASSERT_TRUE(arc);
  EXPECT_EQ(arc->normal, Vector3d(0, 0, 1));
  EXPECT_EQ(arc->from, Vector3d(1, 0, 0));
  EXPECT_EQ(arc->to, Vector3d(0, 1, 0));
  EXPECT_FALSE(arcOnPlane({0, 0, 1}, {0, 0, 3}, {0, 1, 0}));
  EXPECT_FALSE(arcOnPlane({0, 0, 1}, {1, 0, 3}, {0, 0, -1}));
  EXPECT_FALSE(arcOnPlane({0, 0, 0}, {1, 0, 3}, {0, 0, -1}));
}

TEST(Arc, NormalsHaveACanonicalSign) {
  EXPECT_EQ(canonicalNormal({-1, 2, 3}), Vector3d(1, -2, -3));
  EXPECT_EQ(canonicalNormal({0, -2, 3}), Vector3d(0, 2, -3));
  EXPECT_EQ(canonicalNormal({0, 0, 3}), Vector3d(0, 0, 3));
  EXPECT_DOUBLE_EQ(angleBetweenPlanes({1, 0, 0}, {-1, 0, 0}), 0);
  EXPECT_DOUBLE_EQ(angleBetweenPlanes({1, 0, 0}, {0, 0, 1}), M_PI / 2);
  EXPECT_NEAR(angleBetweenPlanes({1, 0, 0}, {-1, 1e-9, 0}), 1e-9, 1e-24);
}

/// 101 x 101 px, focal length 50 px: the border is at x / z = +-1.01.
Camera square() {
  return makeCamera("pinhole", std::vector<double>{50, 50, 50, 50}, 101, 101);
}

TEST(ImageSpans, AreCutAtTheImageBorder) {
  const auto arc = arcBetween({-10, 0, 1}, {10, 0, 1});
  ASSERT_TRUE(arc);
  const auto spans = imageSpans(square(), *arc);
  ASSERT_EQ(spans.size(), 1U);
  EXPECT_EQ(spans[0].end0, ImageEnd::kBorder);
  EXPECT_EQ(spans[0].end1, ImageEnd::kBorder);
  const double t0 = (std::atan(10) - std::atan(1.01)) / (2 * std::atan(10));
  EXPECT_NEAR(spans[0].t0, t0, 1e-12);
  EXPECT_NEAR(spans[0].t1, 1 - t0, 1e-12);
}

TEST(ImageSpans, EndWhereTheArcEnds) {
  const auto arc = arcBetween({0.5, 0, 1}, {0.5, 10, 1});
  const auto spans = imageSpans(square(), *arc);
  ASSERT_EQ(spans.size(), 1U);
  EXPECT_EQ(spans[0].t0, 0);
  EXPECT_EQ(spans[0].end0, ImageEnd::kArcEnd);
  EXPECT_EQ(spans[0].end1, ImageEnd::kBorder);
  const auto whole = imageSpans(square(), *arcBetween({0.5, 0, 1}, {0.5, 0.7, 1}));
  ASSERT_EQ(whole.size(), 1U);
  EXPECT_EQ(whole[0].t0, 0);
  EXPECT_EQ(whole[0].t1, 1);
  EXPECT_EQ(whole[0].end1, ImageEnd::kArcEnd);
}

TEST(ImageSpans, NothingIsSeenOutsideOrBehind) {
  EXPECT_TRUE(imageSpans(square(), *arcBetween({2, 0, 1}, {2, 1, 1})).empty());
  EXPECT_TRUE(imageSpans(square(), *arcBetween({0.1, 0, -1}, {0.2, 1, -1})).empty());
  EXPECT_TRUE(imageSpans(square(), *arcBetween({-1, 2, 0.1}, {1, 2, 0.1})).empty());
}

TEST(ImageSpans, AShortPieceAcrossACornerIsFound) {
  // Cuts off 3 px from the corner at x / z = y / z = 1.01.
  const auto arc = arcBetween({-3, 5.02 - 0.06, 1}, {5.02 - 0.06, -3, 1});
  const auto spans = imageSpans(square(), *arc);
  ASSERT_EQ(spans.size(), 1U);
  const auto a = square().project(arc->at(spans[0].t0)), b = square().project(arc->at(spans[0].t1));
  ASSERT_TRUE(a && b);
  EXPECT_NEAR((*a - *b).norm(), 3 * std::sqrt(2.0), 1e-6);
}

TEST(ImageSpans, AnArcThroughTheBlindConeIsSeenTwice) {
  // 105 degrees; both ends are at 100 degrees, the middle is nearer to -z.
  const double limit = 105 * M_PI / 180, end = 100 * M_PI / 180;
  const Camera camera =
      makeCamera("omni", std::vector<double>{1.4, 590.5, 589.75, 644.25, 508.5}, 1280, 1024, limit);
  const auto arc = arcBetween(rayAt(end, 0), rayAt(end, 150 * M_PI / 180));
  const auto spans = imageSpans(camera, *arc);
  ASSERT_EQ(spans.size(), 2U);
  EXPECT_EQ(spans[0].end0, ImageEnd::kArcEnd);
  EXPECT_EQ(spans[0].end1, ImageEnd::kRim);
  EXPECT_EQ(spans[1].end0, ImageEnd::kRim);
  EXPECT_EQ(spans[1].end1, ImageEnd::kArcEnd);
  for (const double t : {spans[0].t1, spans[1].t0}) {
    EXPECT_NEAR(std::acos(arc->at(t).z()), limit, 1e-11);
  }
  EXPECT_NEAR(spans[0].t1, 1 - spans[1].t0, 1e-11);
}

TEST(ImageCurve, OfAStraightLineIsStraight) {
  const auto arc = arcBetween({-0.9, -0.3, 1}, {0.8, 0.4, 1});
  const auto points = imageCurve(square(), *arc, 0, 1);
  ASSERT_GE(points.size(), 2U);
  EXPECT_LE((points.front() - Vector2d(5, 35)).norm(), 1e-12);
  EXPECT_LE((points.back() - Vector2d(90, 70)).norm(), 1e-12);
  EXPECT_LE(points.size(), 5U);
}

TEST(ImageCurve, FollowsACircleAsCloselyAsAsked) {
  // xi = 1 is the stereographic projection: circles go to circles, here |p| = 200 with 90 degrees.
  const Camera camera = makeCamera("omni", std::vector<double>{1, 200, 200, 0, 0}, 640, 480);
  const auto arc = arcBetween(rayAt(M_PI / 2, 0), rayAt(M_PI / 2, 2.5));
  size_t previous = 2;
  for (const double tolerance : {1.0, 0.1, 0.01, 0.001}) {
    const auto points = imageCurve(camera, *arc, 0, 1, tolerance);
    double worst = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(points[i].norm(), 200, 1e-12);
      if (i > 0) worst = std::max(worst, 200 - ((points[i] + points[i - 1]) / 2).norm());
    }
    EXPECT_LE(worst, tolerance);
    // 2.5 rad in pieces of 2 acos(1 - tolerance / 200), and not twice as many.
    const double needed = 2.5 / (2 * std::acos(1 - tolerance / 200));
    EXPECT_LE(static_cast<double>(points.size()), 2 * needed + 5);
    EXPECT_GT(points.size(), previous);
    previous = points.size();
    EXPECT_LE((points.front() - Vector2d(200, 0)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace dlsd
