#include "detector/thin_bars.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

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

// Two steps of the same sign 2.8 px apart are no bar, whatever they are.
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
       {std::tuple(1, 2.8, 2U), {-1, 2.8, 1U}, {-1, 3.4, 2U}, {-1, 0.5, 2U}}) {
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
