#include "cameras/arc.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

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

// Polynomials of a high degree bend a line beside the middle of a piece by more than in it: judged
// by the middles alone, these curves were up to 0.02 and 0.036 px off.
TEST(ImageCurve, KeepsCloseToPolynomialsBesideTheMiddlesToo) {
  struct Line {
    Camera camera;
    Vector2d from, to;
  };
  const std::vector<double> radtan{415.04378861384583,
                                   412.15503994595065,
                                   846.4,
                                   229.95,
                                   0.39981724309793776,
                                   -0.18563304731502175,
                                   0.00402411508445597,
                                   -0.0087666276587777068,
                                   0.034970985446074229};
  const std::vector<double> ocam{-172.81114038529583,
                                 0.0066957795743405411,
                                 0.00030384527857001278,
                                 -3.7892714758242463e-06,
                                 2.203618899726893e-09,
                                 -4.9393069066329425e-13,
                                 2.0921638832698202e-14,
                                 -6.00744171460948e-17,
                                 6.8065130748369487e-20,
                                 394.15,
                                 287.40488254640042,
                                 1.0833472632240997,
                                 0.0043008077747426262,
                                 -0.01};
  for (const Line& line :
       {Line{makeCamera("pinhole_radtan", radtan, 1882, 419), {63, 160}, {1557, 327}},
        Line{makeCamera("ocam", ocam, 877, 593), {408, 297}, {819, 432}}}) {
    const auto arc = arcBetween(line.camera.unproject(line.from).value(),
                                line.camera.unproject(line.to).value());
    const auto points = imageCurve(line.camera, arc.value(), 0, 1);
    double worst = 0;
    for (int i = 0; i <= 3000; ++i) {
      const auto p = line.camera.project(arc->at(i / 3000.0));
      double nearest = std::numeric_limits<double>::infinity();
      for (size_t k = 1; k < points.size(); ++k) {
        const Vector2d d = points[k] - points[k - 1], off = p.value() - points[k - 1];
        const double t = std::clamp(off.dot(d) / d.squaredNorm(), 0.0, 1.0);
        nearest = std::min(nearest, (off - t * d).norm());
      }
      worst = std::max(worst, nearest);
    }
    EXPECT_LE(worst, 0.01);
    EXPECT_GT(worst, 0.005);  // Not by points without number.
    EXPECT_LE(points.size(), 40U);
  }
}

// --- Panoramas ---

/// The whole sphere in 1024 x 512 px.
Camera panorama() {
  return makeCamera(
      "equirectangular", std::vector<double>{512 / M_PI, 512 / M_PI, 511.5, 255.5}, 1024, 512);
}

Vector3d rayAtLongitude(double longitude_deg, double latitude_deg) {
  const double a = longitude_deg * M_PI / 180, b = latitude_deg * M_PI / 180;
  return {std::cos(b) * std::sin(a), std::sin(b), std::cos(b) * std::cos(a)};
}

TEST(PanoramaSpans, AreCutAtTheSeam) {
  const auto arc = arcBetween(rayAtLongitude(160, -10), rayAtLongitude(-150, 30));
  const auto spans = imageSpans(panorama(), *arc);
  ASSERT_EQ(spans.size(), 2U);
  EXPECT_EQ(spans[0].end0, ImageEnd::kArcEnd);
  EXPECT_EQ(spans[0].end1, ImageEnd::kSeam);
  EXPECT_EQ(spans[1].end0, ImageEnd::kSeam);
  EXPECT_EQ(spans[1].end1, ImageEnd::kArcEnd);
  EXPECT_EQ(spans[0].t1, spans[1].t0);
  EXPECT_NEAR(arc->at(spans[0].t1).x(), 0, 1e-15);
  // The curve goes out on the right and comes in on the left at the same height.
  const auto right = imageCurve(panorama(), *arc, spans[0].t0, spans[0].t1);
  const auto left = imageCurve(panorama(), *arc, spans[1].t0, spans[1].t1);
  EXPECT_NEAR(right.back().x(), 1023.5, 1e-9);
  EXPECT_NEAR(left.front().x(), -0.5, 1e-9);
  EXPECT_NEAR(right.back().y(), left.front().y(), 1e-9);
  EXPECT_GT(right.front().x(), 900);
  EXPECT_LT(left.back().x(), 100);
  // A line cannot show both.
  EXPECT_EQ(imageCurve(panorama(), *arc, 0, 1).size(), left.size());
  // The other way round.
  const auto back = imageSpans(panorama(), {arc->normal, arc->to, arc->from});
  ASSERT_EQ(back.size(), 2U);
  EXPECT_NEAR(back[0].t1, 1 - spans[0].t1, 1e-12);
}

TEST(PanoramaSpans, AreCutAtAPole) {
  const auto arc = arcBetween(rayAtLongitude(60, 50), rayAtLongitude(-120, 70));
  const auto spans = imageSpans(panorama(), *arc);
  ASSERT_EQ(spans.size(), 2U);
  EXPECT_EQ(spans[0].end1, ImageEnd::kSeam);
  EXPECT_EQ(spans[1].end0, ImageEnd::kSeam);
  EXPECT_NEAR(spans[0].t1, 40.0 / 60, 1e-12);
  const auto up = imageCurve(panorama(), *arc, spans[0].t0, spans[0].t1);
  const auto down = imageCurve(panorama(), *arc, spans[1].t0, spans[1].t1);
  for (const auto& p : up) EXPECT_NEAR(p.x(), 511.5 + 1024.0 / 6, 1e-3);
  for (const auto& p : down) EXPECT_NEAR(p.x(), 511.5 - 1024.0 / 3, 1e-3);
  EXPECT_NEAR(up.back().y(), 511.5, 1e-5);
  EXPECT_NEAR(down.front().y(), 511.5, 1e-5);
}

TEST(PanoramaSpans, AnArcAlongTheSeamStaysOnOneSide) {
  const auto arc = arcBetween(Vector3d(0, -0.7, -1), Vector3d(0, 0.9, -1));
  const auto spans = imageSpans(panorama(), *arc);
  ASSERT_EQ(spans.size(), 1U);
  for (const auto& p : imageCurve(panorama(), *arc, 0, 1)) EXPECT_EQ(p.x(), -0.5);
  // Tilted by next to nothing, it crosses over once.
  const auto tilted = arcBetween(Vector3d(1e-14, -0.7, -1), Vector3d(-1e-14, 0.9, -1));
  const auto two = imageSpans(panorama(), *tilted);
  ASSERT_EQ(two.size(), 2U);
  for (const auto& p : imageCurve(panorama(), *tilted, two[0].t0, two[0].t1)) {
    EXPECT_NEAR(p.x(), 1023.5, 1e-9);
  }
  for (const auto& p : imageCurve(panorama(), *tilted, two[1].t0, two[1].t1)) {
    EXPECT_NEAR(p.x(), -0.5, 1e-9);
  }
}

TEST(PanoramaSpans, AnArcThatBeginsOnTheSeamBelongsToItsSide) {
  for (const double side : {-1.0, 1.0}) {
    for (const double rounding : {0.0, 1e-17, -1e-17, 1e-15, -1e-15}) {
      const auto arc = arcBetween(Vector3d(rounding, 0.2, -1), Vector3d(side, 0.5, -1));
      const auto spans = imageSpans(panorama(), *arc);
      ASSERT_EQ(spans.size(), 1U) << rounding;
      EXPECT_LE(spans[0].t0, 1e-12);
      EXPECT_EQ(spans[0].t1, 1);
      const auto points = imageCurve(panorama(), *arc, spans[0].t0, spans[0].t1);
      ASSERT_GE(points.size(), 2U);
      for (const auto& p : points) EXPECT_GT(side * (p.x() - 511.5), 300) << rounding;
    }
  }
}

TEST(PanoramaSpans, WithoutTheSeamInTheImageThereIsNone) {
  const Camera narrow =
      makeCamera("equirectangular", std::vector<double>{200, 200, 400, 300}, 801, 601);
  const auto arc = arcBetween(rayAtLongitude(100, 5), rayAtLongitude(-100, 15));
  const auto spans = imageSpans(narrow, *arc);
  ASSERT_EQ(spans.size(), 2U);  // Longitudes up to 114.7 degrees are in the image.
  EXPECT_EQ(spans[0].end1, ImageEnd::kBorder);
  EXPECT_EQ(spans[1].end0, ImageEnd::kBorder);
  const auto curve = imageCurve(narrow, *arc, spans[0].t0, spans[0].t1);
  EXPECT_NEAR(curve.back().x(), 800.5, 1e-9);
}

/// Uniform in [lo, hi).
double draw(std::mt19937_64& bits, double lo, double hi) {
  return lo + (hi - lo) * std::ldexp(static_cast<double>(bits() >> 11U), -53);
}

/// Great circles anywhere, through the seam, along it, past the poles at any distance.
Arc drawPanoramaArc(std::mt19937_64& bits) {
  for (;;) {
    const auto sphere = [&] {
      const double z = draw(bits, -1, 1), r = std::sqrt(1 - z * z), a = draw(bits, -M_PI, M_PI);
      return Vector3d(r * std::cos(a), z, r * std::sin(a));
    };
    const Vector3d middle = [&]() -> Vector3d {
      const double off = std::pow(10, draw(bits, -18, -1));
      switch (bits() % 4) {
        case 0:
          return sphere();
        case 1:
          return {draw(bits, -1, 1) * off, draw(bits, -2, 2), -1};
        case 2:
          return {draw(bits, -1, 1) * off, bits() % 2 == 0 ? 1.0 : -1.0, draw(bits, -1, 1) * off};
        default:
          return {0, draw(bits, -2, 2), bits() % 2 == 0 ? 0.0 : -1.0};
      }
    }();
    Vector3d along = bits() % 4 == 0 ? Vector3d(0, 1, 0) : sphere();
    if (bits() % 8 == 0) along = Vector3d(0, draw(bits, -1, 1), draw(bits, -1, 1));
    const Vector3d m = middle.normalized();
    const Vector3d s = (along - m * m.dot(along)).normalized();
    const double a = draw(bits, 0, 1.5), b = draw(bits, 0, 1.5);
    const auto arc =
        arcBetween(std::cos(a) * m - std::sin(a) * s, std::cos(b) * m + std::sin(b) * s);
    if (arc) return *arc;
  }
}

TEST(PanoramaSpans, AndCurvesAreThoseOfADenseSampling) {
  std::mt19937_64 bits(1);
  int seams = 0, borders = 0, swept = 0;
  long seen = 0;
  for (int n = 0; n < 3000; ++n) {
    // Whole spheres, more and less than them.
    const double f = draw(bits, 100, 1500);
    const int kind = static_cast<int>(bits() % 3);
    const int width = static_cast<int>(2 * M_PI * f * (kind == 0 ? 1 : draw(bits, 0.4, 1.2)));
    const int height = static_cast<int>(M_PI * f * (kind == 0 ? 1 : draw(bits, 0.4, 1.2)));
    const double fx = kind == 0 ? width / (2 * M_PI) : f, fy = kind == 0 ? height / M_PI : f;
    const double shift = kind == 2 ? draw(bits, -0.2, 0.2) : 0;
    const Camera camera = makeCamera(
        "equirectangular",
        std::vector<double>{fx, fy, width * (0.5 + shift) - 0.5, height * (0.5 + shift) - 0.5},
        width,
        height);
    const Arc arc = drawPanoramaArc(bits);
    const auto spans = imageSpans(camera, arc);
    const auto tell = [&] {
      return ::testing::Message() << n << ": f " << fx << " " << fy << " size " << width << " "
                                  << height << " from " << arc.from.transpose() << " to "
                                  << arc.to.transpose();
    };
    double previous = 0;
    for (const ImageSpan& span : spans) {
      ASSERT_GE(span.t0, previous) << tell();
      ASSERT_GT(span.t1, span.t0) << tell();
      previous = span.t1;
      for (const ImageEnd end : {span.end0, span.end1}) {
        seams += static_cast<int>(end == ImageEnd::kSeam);
        borders += static_cast<int>(end == ImageEnd::kBorder);
      }
      const auto curve = imageCurve(camera, arc, span.t0, span.t1);
      ASSERT_GE(curve.size(), 2U) << tell();
      for (size_t k = 0; k < curve.size(); ++k) {
        EXPECT_GE(curve[k].x(), -0.5 - 1e-9) << tell();
        EXPECT_LE(curve[k].x(), width - 0.5 + 1e-9) << tell();
        if (k == 0) continue;
        // All of the drawn line is near the circle: nothing is drawn across.
        swept += static_cast<int>(std::abs(curve[k].x() - curve[k - 1].x()) > fx);
        for (const double s : {0.1, 0.3, 0.5, 0.7, 0.9}) {
          const auto ray = camera.unproject(curve[k - 1] + s * (curve[k] - curve[k - 1]));
          ASSERT_TRUE(ray) << tell();
          ASSERT_LE(std::abs(arc.angleToPlane(*ray)), 0.0101 / std::min(fx, fy)) << tell();
        }
      }
      // All of the circle is near the drawn line.
      for (int i = 1; i < 200; ++i) {  // Ends may be on either side of a seam.
        const auto p = camera.project(arc.at(span.t0 + (span.t1 - span.t0) * i / 200));
        ASSERT_TRUE(p) << tell();
        double nearest = std::numeric_limits<double>::infinity();
        for (size_t k = 1; k < curve.size(); ++k) {
          const Vector2d d = curve[k] - curve[k - 1];
          const double s =
              std::clamp((*p - curve[k - 1]).dot(d) / std::max(d.squaredNorm(), 1e-300), 0.0, 1.0);
          nearest = std::min(nearest, (*p - curve[k - 1] - s * d).norm());
        }
        ASSERT_LE(nearest, 0.01) << tell() << " at " << i << " of 200";
      }
    }
    // Samples in the image are in a span, those outside are not.
    for (int i = 0; i <= 500; ++i) {
      const double t = i / 500.0;
      const auto p = camera.project(arc.at(t));
      ASSERT_TRUE(p);
      const double inner =
          std::min({p->x() + 0.5, width - 0.5 - p->x(), p->y() + 0.5, height - 0.5 - p->y()});
      if (std::abs(inner) < 1e-6) continue;
      const bool in_span = std::any_of(spans.begin(), spans.end(), [&](const ImageSpan& s) {
        return t >= s.t0 - 1e-12 && t <= s.t1 + 1e-12;
      });
      ++seen;
      ASSERT_EQ(in_span, inner > 0) << tell() << " at " << t << " pixel " << p->transpose();
    }
  }
  EXPECT_GT(seams, 500);
  EXPECT_GT(borders, 500);
  EXPECT_GT(swept, 20);  // Past a pole, nearly along its row.
  EXPECT_GT(seen, 3000 * 300);
}

}  // namespace
}  // namespace dlsd
