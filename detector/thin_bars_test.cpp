#include "detector/thin_bars.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <vector>

#include "detector/plane_curve.h"
#include "detector/test_scene.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Bar {
  std::vector<uint8_t> image;
  Vector3d normal;  ///< Of the plane of its centre line.
  double length_px;
};

/// A bar of this width around the line between two pixels.
Bar barImage(
    const Camera& camera, const Vector2d& from, const Vector2d& to, double width_px, double grey) {
  const Vector2d along = (to - from).normalized();
  const Vector2d half(-along.y() * width_px / 2, along.x() * width_px / 2);
  test::Shape shape;
  for (const Vector2d& corner :
       {Vector2d(from - half), Vector2d(to - half), Vector2d(to + half), Vector2d(from + half)}) {
    shape.vertices.push_back(*camera.unproject(corner));
  }
  shape.axis = *camera.unproject((from + to) / 2);
  shape.grey = grey;
  test::Scene scene;
  scene.background = 100;
  scene.shapes.push_back(shape);
  return {test::toU8(test::render(scene, camera), 1, 7),
          camera.unproject(from)->cross(*camera.unproject(to)).normalized(),
          (to - from).norm()};
}

// Bright and dark, any direction, every camera: a thin bar is one line in its middle, from end to
// end; a thick one is its two sides.
TEST(ThinBars, OneLineUntilTheTwoSidesShow) {
  int thin = 0, thick = 0;
  for (const auto& [name, camera] : test::testCameras()) {
    Detector detector(camera);
    for (const double angle : {0.1, 0.8, 1.5, 2.4}) {
      const Vector2d centre(camera.width() / 2.0 + 60, camera.height() / 2.0 - 40);
      const Vector2d half(90 * std::cos(angle), 90 * std::sin(angle));
      for (const double grey : {20.0, 230.0}) {
        for (const double width : {1.0, 1.8, 5.0}) {
          const Bar bar = barImage(camera, centre - half, centre + half, width, grey);
          std::vector<DetectedLine> lines = detector.detect(test::viewOf(bar.image, camera));
          std::erase_if(lines, [](const DetectedLine& line) { return line.length_px < 50; });
          SCOPED_TRACE(testing::Message() << name << " " << angle << " " << grey << " " << width);
          if (width == 5.0) {
            EXPECT_EQ(lines.size(), 2U);
            ++thick;
            continue;
          }
          ASSERT_EQ(lines.size(), 1U);
          ++thin;
          const DetectedLine& line = lines[0];
          EXPECT_NEAR(line.length_px, bar.length_px, 8);
          const RayTable rays(camera);
          for (const Vector2d& px : {line.from_px, line.to_px}) {
            EXPECT_LE(std::abs(curveOffset(rays.at(px.x(), px.y()), bar.normal).offset_px), 0.25);
          }
          EXPECT_EQ(line.arc.normal, canonicalNormal(line.arc.normal));
          EXPECT_LE((line.normal_cov * line.arc.normal).norm(), 1e-12 * line.normal_cov.norm());
        }
      }
    }
  }
  EXPECT_EQ(thin, 4 * 4 * 2 * 2);
  EXPECT_EQ(thick, 4 * 4 * 2);
}

// A bar that crosses the corner of the image is one line, too, though one side's ends, moved half
// way to the other, lie outside.
TEST(ThinBars, OneLineUpToTheBorder) {
  const Camera camera = test::testCameras()[0].camera;
  Detector detector(camera);
  int bars = 0;
  for (const double grey : {20.0, 230.0}) {
    for (const double slope : {0.6, 1.0, 1.7}) {
      const Vector2d from(-20, 100 + 20 * slope), to(100 / slope + 20, -20 * slope);
      const Bar bar = barImage(camera, from, to, 1.5, grey);
      const auto& lines = detector.detect(test::viewOf(bar.image, camera));
      SCOPED_TRACE(testing::Message() << grey << " " << slope);
      ASSERT_EQ(lines.size(), 1U);
      ++bars;
      for (const Vector2d& px : {lines[0].from_px, lines[0].to_px}) {
        EXPECT_TRUE(camera.inImage(px));
        EXPECT_LE(std::min(px.x(), px.y()), 2);
        const Vector2d across = Vector2d(slope, 1).normalized();
        EXPECT_NEAR(across.dot(px - from), 0, 0.25);
      }
    }
  }
  EXPECT_EQ(bars, 6);
}

/// Convex, of pixels in either order.
test::Shape quadrangle(const Camera& camera, const std::array<Vector2d, 4>& corners, double grey) {
  test::Shape shape;
  shape.axis = Vector3d::Zero();
  for (const Vector2d& corner : corners) {
    shape.vertices.push_back(*camera.unproject(corner));
    shape.axis += shape.vertices.back();
  }
  shape.axis.normalize();
  if (shape.vertices[0].cross(shape.vertices[1]).dot(shape.axis) < 0) {
    std::reverse(shape.vertices.begin(), shape.vertices.end());
  }
  shape.grey = grey;
  return shape;
}

/// Bright and dark bars, some with lighter ground on one side, in every camera: each side is a line
/// of its own, and where the side is, from end to end.
void expectSides(const std::vector<double>& angles_rad, double blur_px) {
  constexpr double kGround = 100, kLighter = 140, kHalfLengthPx = 60, kSpacingPx = 42;
  const std::array widths{2.6, 3.2, 4.0, 5.0};
  int sides = 0, variant = 0;
  for (const auto& [name, camera] : test::testCameras()) {
    Detector detector(camera);
    const RayTable rays(camera);
    for (const double angle : angles_rad) {
      const Vector2d centre(camera.width() / 2.0 + 8, camera.height() / 2.0 - 5);
      const Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
      test::Scene scene;
      scene.background = kGround;
      // An edge that stands alone tells the blur.
      const Vector2d alone = centre + 105 * along;
      scene.shapes.push_back(quadrangle(camera,
                                        {alone - 150 * across,
                                         alone + 150 * across,
                                         alone + 150 * across + 40 * along,
                                         alone - 150 * across + 40 * along},
                                        180));
      struct Side {
        Vector3d normal;
        Vector2d from, to;
        double inwards;  ///< 1 if the bar is on the side of the normal.
        double width_px;
        bool bright;
      };
      std::vector<Side> all;
      ++variant;
      for (int i = 0; i < 8; ++i) {
        const double half_px = widths[static_cast<size_t>(i) % 4] / 2;
        const bool bright = (i + variant) % 2 == 0, lit = (i / 4 + i / 2 + variant / 2) % 2 == 0;
        const Vector2d middle = centre + kSpacingPx * (i - 3.5) * across - 40 * along;
        const Vector2d from = middle - kHalfLengthPx * along, to = middle + kHalfLengthPx * along;
        if (lit) {
          const Vector2d wide = 16 * across;
          scene.shapes.push_back(
              quadrangle(camera, {from, to, Vector2d(to + wide), Vector2d(from + wide)}, kLighter));
        }
        const Vector2d half = half_px * across;
        scene.shapes.push_back(quadrangle(camera,
                                          {Vector2d(from - half),
                                           Vector2d(to - half),
                                           Vector2d(to + half),
                                           Vector2d(from + half)},
                                          bright ? 230 : 20));
        for (const double sign : {-1.0, 1.0}) {
          const Vector2d a = from + sign * half, b = to + sign * half;
          const Vector3d normal = camera.unproject(a)->cross(*camera.unproject(b)).normalized();
          all.push_back(
              {normal,
               a,
               b,
               normal.dot(*camera.unproject(from) + *camera.unproject(to)) > 0 ? 1.0 : -1.0,
               2 * half_px,
               bright});
        }
      }
      const auto image = test::toU8(test::render(scene, camera, blur_px), 1, 7);
      const auto& lines = detector.detect(test::viewOf(image, camera));
      for (const Side& side : all) {
        SCOPED_TRACE(testing::Message() << name << " angle " << angle << " blur " << blur_px
                                        << " width " << side.width_px << " bright " << side.bright);
        // Nearer to it than to the other one, and of its polarity.
        int found = 0;
        double worst_px = 0;
        for (const DetectedLine& line : lines) {
          const Vector2d at = *camera.project(line.arc.at(0.5));
          const double same_way = line.arc.normal.dot(side.normal) < 0 ? -1 : 1;
          const bool is_bright = line.polarity * same_way * side.inwards > 0;
          if (line.length_px < 40 || is_bright != side.bright ||
              (at - (side.from + side.to) / 2).norm() > 40 ||
              std::abs(curveOffset(rays.at(at.x(), at.y()), side.normal).offset_px) >
                  side.width_px / 2) {
            continue;
          }
          ++found;
          // An end is known to its four rows, which are up to 5.7 px of a slanted edge.
          EXPECT_GE(line.length_px, 2 * kHalfLengthPx - 12);
          EXPECT_LE(line.length_px, 2 * kHalfLengthPx + 6);
          for (int k = 0; k <= 10; ++k) {
            const Vector2d px = *camera.project(line.arc.at(k / 10.0));
            if (!rays.covers(px.x(), px.y())) continue;
            worst_px = std::max(
                worst_px, std::abs(curveOffset(rays.at(px.x(), px.y()), side.normal).offset_px));
          }
        }
        EXPECT_EQ(found, 1);
        EXPECT_LE(worst_px, 0.2);
        ++sides;
      }
    }
  }
  EXPECT_EQ(sides, 4 * static_cast<int>(angles_rad.size()) * 8 * 2);
}

TEST(ThinBars, SidesAreWhereTheyAre) {
  expectSides({0.1, 0.8, 2.7}, 0.7);
}

TEST(ThinBars, SidesAreWhereTheyAreThroughSoftOptics) {
  expectSides({0.1, 1.9}, 1.0);
}

// Two steps of the same sign 1.6 px apart are no bar, whatever they are.
TEST(ThinBars, StairsAreNoBar) {
  const Camera camera = test::testCameras()[0].camera;
  const RayTable rays(camera);
  const auto lineAt = [&](double y, int polarity) {
    DetectedLine line;
    line.from_px = {200, y};
    line.to_px = {400, y + 30};
    line.arc = *arcBetween(*camera.unproject(line.from_px), *camera.unproject(line.to_px));
    line.arc.normal = canonicalNormal(line.arc.normal);
    line.normal_cov = Eigen::Matrix3d::Identity();
    line.length_px = 200;
    line.polarity = polarity;
    return line;
  };
  ThinBarMerger merger(rays);
  for (const auto& [polarity, apart, count] :
       {std::tuple(1, 1.6, 2U), {-1, 1.6, 1U}, {-1, 1.9, 1U}, {-1, 2.2, 2U}, {-1, 2.8, 2U}}) {
    std::vector<DetectedLine> lines{lineAt(200, 1), lineAt(200 + apart, polarity)};
    merger.merge(&lines);
    EXPECT_EQ(lines.size(), count) << polarity << " " << apart;
    if (count == 1U) {
      EXPECT_NEAR(lines[0].from_px.y(), 200 + apart / 2, 0.05);
      EXPECT_NEAR(lines[0].to_px.y(), 230 + apart / 2, 0.05);
    }
  }
}

}  // namespace
}  // namespace dlsd
