#include "detector/detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <stdexcept>

#include "detector/options.h"
#include "detector/test_scene.h"
#include "detector/validation.h"

namespace dlsd {
namespace {

using test::Label;
using test::NamedCamera;
using test::Scene;

std::vector<std::vector<Eigen::Vector2d>> curvesOf(const Camera& camera,
                                                   const std::vector<DetectedLine>& lines) {
  std::vector<std::vector<Eigen::Vector2d>> curves;
  for (const auto& line : lines) curves.push_back(test::curveOf(camera, line));
  return curves;
}

double sceneAngle(const Camera& camera) {
  return std::min(camera.maxFieldAngle(), 1.75);
}

struct Quality {
  int labels = 0, found_4 = 0, found_1 = 0, past_90 = 0, detections = 0, right_4 = 0, right_1 = 0;
};

/// Labels of >= 30 grey levels, >= max(5 deg, 40 px), >= 12 px from other edges and, since none can
/// be seen there, from the rim; detections of >= 5 degrees.
Quality qualityOn(const Camera& camera, const DetectorOptions& options, int scenes, double noise) {
  Detector detector(camera, options);
  Quality q;
  for (int s = 0; s < scenes; ++s) {
    const auto seed = static_cast<uint64_t>(s);
    const Scene scene = test::randomScene(seed, 9, 0, sceneAngle(camera));
    const auto image = test::toU8(test::render(scene, camera), noise, seed + 1000);
    const auto labels = test::labelsOf(scene, camera);
    const auto& lines = detector.detect(test::viewOf(image, camera));
    const auto curves = curvesOf(camera, lines);
    for (const Label& label : labels) {
      if (label.contrast < 30 || label.angle_rad < 5 * M_PI / 180 || label.length_px < 40) continue;
      if (label.clearance_px < 12) continue;
      bool near_rim = false, past_90 = false;
      for (size_t i = 0; i < label.points.size(); i += 2) {
        for (int k = 0; k < 8; ++k) {
          const Eigen::Vector2d d(8 * std::cos(k * M_PI / 4), 8 * std::sin(k * M_PI / 4));
          near_rim = near_rim || !camera.unproject(label.points[i] + d);
        }
        const auto ray = camera.unproject(label.points[i]);
        past_90 = past_90 || (ray && ray->z() < 0);
      }
      if (near_rim) continue;
      ++q.labels;
      const bool found_4 = test::coverage(label, curves, 4) >= 0.9;
      q.found_4 += found_4;
      q.found_1 += test::coverage(label, curves, 1) >= 0.9;
      q.past_90 += found_4 && past_90;
    }
    for (size_t i = 0; i < lines.size(); ++i) {
      if (lines[i].arc.angle() < 5 * M_PI / 180) continue;
      ++q.detections;
      q.right_4 += test::rightness(curves[i], labels, 4) >= 0.9;
      q.right_1 += test::rightness(curves[i], labels, 1) >= 0.9;
    }
  }
  return q;
}

class DetectorOnScenes : public testing::TestWithParam<int> {
 protected:
  NamedCamera camera_ = test::testCameras()[static_cast<size_t>(GetParam())];
};
INSTANTIATE_TEST_SUITE_P(
    Models, DetectorOnScenes, testing::Range(0, 4), [](const testing::TestParamInfo<int>& model) {
      return std::string(test::testCameras()[static_cast<size_t>(model.param)].name);
    });

TEST_P(DetectorOnScenes, FindsLabelsAndLittleElse) {
  const Quality q = qualityOn(camera_.camera, DetectorOptions{}, 6, 0);
  EXPECT_GE(q.labels, 25);
  EXPECT_GE(q.found_4, q.labels - 1);
  EXPECT_GE(q.found_1, 0.97 * q.labels);
  EXPECT_GE(q.detections, q.labels);
  EXPECT_GE(q.right_4, 0.98 * q.detections);
  EXPECT_GE(q.right_1, 0.97 * q.detections);
  const std::string name = camera_.name;
  if (name == "kannala_brandt" || name == "omni") {
    EXPECT_GE(q.past_90, 3);
  }
}

TEST_P(DetectorOnScenes, FindsLabelsInNoise) {
  const Quality q = qualityOn(camera_.camera, DetectorOptions{}, 4, 8);
  EXPECT_GE(q.labels, 15);
  EXPECT_GE(q.found_4, q.labels - 1);
  EXPECT_GE(q.right_4, 0.97 * q.detections);
}

TEST_P(DetectorOnScenes, PaperFindsMostLabels) {
  const Quality q = qualityOn(camera_.camera, DetectorOptions::paper(), 6, 0);
  EXPECT_GE(q.labels, 25);
  EXPECT_GE(q.found_4, 0.85 * q.labels);
  EXPECT_GE(q.right_4, 0.95 * q.detections);
}

TEST_P(DetectorOnScenes, RecordsAreConsistent) {
  const Camera& camera = camera_.camera;
  for (const auto& options : {DetectorOptions{}, DetectorOptions::paper()}) {
    Detector detector(camera, options);
    const Scene scene = test::randomScene(3, 9, 2, sceneAngle(camera));
    const auto image = test::toU8(test::render(scene, camera), 2, 5);
    const auto& lines = detector.detect(test::viewOf(image, camera));
    ASSERT_GE(lines.size(), 8U);
    double previous_score = 1e300;
    for (const DetectedLine& line : lines) {
      EXPECT_LE(line.score, previous_score);
      previous_score = line.score;
      EXPECT_NEAR(line.arc.normal.norm(), 1, 1e-12);
      EXPECT_EQ(line.arc.normal, canonicalNormal(line.arc.normal));
      EXPECT_LE(std::abs(line.arc.normal.dot(line.arc.from)), 1e-12);
      EXPECT_LE(std::abs(line.arc.normal.dot(line.arc.to)), 1e-12);
      EXPECT_EQ(camera.project(line.arc.from), line.from_px);
      EXPECT_EQ(camera.project(line.arc.to), line.to_px);
      EXPECT_TRUE(camera.inImage(line.from_px) && camera.inImage(line.to_px));
      EXPECT_LE(line.rms_px, line.max_px);
      EXPECT_LE(line.max_px, 2 * options.validation.rho_px);
      // Length of the image curve, apart from the crests' zigzag and the first and last half pixel.
      double length = 0;
      const auto curve = test::curveOf(camera, line);
      for (size_t i = 1; i < curve.size(); ++i) length += (curve[i] - curve[i - 1]).norm();
      EXPECT_NEAR(line.length_px, length, 2 + 0.01 * length);
      // Rank 2: nothing along the normal, two positive eigenvalues.
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(line.normal_cov);
      EXPECT_LE((line.normal_cov * line.arc.normal).norm(), 1e-9 * eigen.eigenvalues()[2]);
      EXPECT_GT(eigen.eigenvalues()[1], 1e-6 * eigen.eigenvalues()[2]);
      EXPECT_TRUE(line.polarity == 1 || line.polarity == -1);
    }
  }
}

TEST_P(DetectorOnScenes, TheRimIsNoLine) {
  // A bright room in black surroundings, also with a rim at 90 degrees, which is a great circle.
  const Camera& given = camera_.camera;
  for (const double limit : {0.6, M_PI / 2, 2.0}) {
    const Camera camera(given.model(), given.width(), given.height(), limit);
    Scene scene;
    scene.background = 200;
    for (const double noise : {0.0, 3.0}) {
      const auto image = test::toU8(test::render(scene, camera), noise, 5);
      EXPECT_THAT(Detector(camera).detect(test::viewOf(image, camera)), testing::IsEmpty())
          << limit;
      EXPECT_THAT(Detector(camera, DetectorOptions::paper()).detect(test::viewOf(image, camera)),
                  testing::IsEmpty())
          << limit;
    }
  }
}

TEST_P(DetectorOnScenes, PolarityTellsTheBrighterSide) {
  const Camera& camera = camera_.camera;
  for (const double inside : {20.0, 220.0}) {
    Scene scene;
    scene.background = 120;
    scene.shapes.push_back(
        test::polygon(Eigen::Vector3d(0.1, -0.05, 1), 0.35, {0.3, 1.8, 3.4, 4.9}, inside));
    const auto image = test::toU8(test::render(scene, camera), 0, 1);
    Detector detector(camera);
    const auto& lines = detector.detect(test::viewOf(image, camera));
    ASSERT_EQ(lines.size(), 4U);
    for (const auto& line : lines) {
      const bool axis_side = line.arc.normal.dot(scene.shapes[0].axis) > 0;
      EXPECT_EQ(line.polarity == 1, axis_side == (inside > 120));
    }
  }
}

/// Everything that is promised about where a reported line lies.
void expectInsideImage(const Camera& camera, const std::vector<DetectedLine>& lines) {
  for (const DetectedLine& line : lines) {
    EXPECT_LT(line.arc.angle(), M_PI - 1e-3);
    EXPECT_TRUE(camera.inImage(line.from_px) && camera.inImage(line.to_px));
    constexpr int kSamples = 400;
    for (int k = 0; k <= kSamples; ++k) {
      const auto p = camera.project(line.arc.at(static_cast<double>(k) / kSamples));
      ASSERT_TRUE(p.has_value());
      EXPECT_GE(p->x(), -1);
      EXPECT_LE(p->x(), camera.width());
      EXPECT_GE(p->y(), -1);
      EXPECT_LE(p->y(), camera.height());
    }
  }
}

// Cameras that see nearly everything, fold strongly or have an odd image: random scenes with noise,
// at both ends of what the options allow.
TEST(Detector, LinesStayInImageAndDomain) {
  std::vector<Camera> cameras;
  for (const auto& [w, h] : {std::pair{200, 500}, {500, 200}, {60, 700}, {300, 300}}) {
    const double cx = 0.45 * w, cy = 0.495 * h;
    const double f = 0.125 * std::max(w, h);
    cameras.push_back(makeCamera("fov", std::array{f, 1.03 * f, cx, cy, 0.515}, w, h));
    cameras.push_back(makeCamera("fov", std::array{f, f, cx, cy, 0.95}, w, h));
    cameras.push_back(makeCamera("pinhole", std::array{f / 2, f / 2, cx, cy}, w, h));
    cameras.push_back(makeCamera("kannala_brandt", std::array{f, f, cx, cy, 0., 0., 0., 0.}, w, h));
    for (const double xi : {0.8, 1.0, 1.3, 3.0}) {
      cameras.push_back(
          makeCamera("omni", std::array{xi, f * (1 + xi), f * (1 + xi), cx, cy}, w, h));
    }
  }
  DetectorOptions loose;
  loose.validation.rho_px = loose.validation.tight_rho_px = 3;
  loose.validation.max_gap_px = 40;
  loose.validation.min_score = -100;
  loose.validation.min_bend_radius_px = 0;
  loose.planes.max_err_px = 3;
  size_t lines = 0;
  for (size_t c = 0; c < cameras.size(); ++c) {
    const Camera& camera = cameras[c];
    const Scene scene = test::randomScene(c + 50, 14, 2, M_PI);
    const auto clean = test::render(scene, camera);
    for (const auto& options : {DetectorOptions{}, loose, DetectorOptions::paper()}) {
      Detector detector(camera, options);
      for (const double noise : {1.0, 12.0}) {
        const auto image = test::toU8(clean, noise, c);
        const auto& found = detector.detect(test::viewOf(image, camera));
        SCOPED_TRACE(testing::Message() << "camera " << c << " noise " << noise);
        expectInsideImage(camera, found);
        lines += found.size();
      }
    }
  }
  EXPECT_GE(lines, 1000U);
}

// Faint edges full of gaps, where a trace may begin in a gap: its ends are edge points all the
// same.
TEST(Detector, LengthIsThatOfTheCurveOnFaintEdges) {
  DetectorOptions options;
  options.validation.min_score = -100;
  size_t lines = 0;
  for (const auto& [name, camera] : test::testCameras(70)) {
    for (uint64_t seed = 0; seed < 4; ++seed) {
      Scene scene = test::randomScene(seed, 9, 0, sceneAngle(camera));
      for (auto& shape : scene.shapes) shape.grey = scene.background + (shape.grey - 128) / 8;
      const auto image = test::toU8(test::render(scene, camera), 12, seed);
      Detector detector(camera, options);
      for (const auto& line : detector.detect(test::viewOf(image, camera))) {
        ++lines;
        double length = 0;
        const auto curve = test::curveOf(camera, line);
        for (size_t i = 1; i < curve.size(); ++i) length += (curve[i] - curve[i - 1]).norm();
        EXPECT_NEAR(line.length_px, length, 3 + 0.02 * length) << name << " " << seed;
      }
    }
  }
  EXPECT_GE(lines, 30U);
}

TEST(Detector, EndsAndPlanesAreExactOnACleanPolygon) {
  for (const auto& [name, camera] : test::testCameras()) {
    Scene scene;
    scene.shapes.push_back(
        test::polygon(Eigen::Vector3d(0.2, 0.1, 1), 0.4, {0.3, 1.8, 3.4, 4.9}, 200));
    const auto image = test::toU8(test::render(scene, camera), 0, 1);
    Detector detector(camera);
    const auto& lines = detector.detect(test::viewOf(image, camera));
    ASSERT_EQ(lines.size(), 4U) << name;
    for (size_t i = 0; i < 4; ++i) {
      const auto side =
          arcBetween(scene.shapes[0].vertices[i], scene.shapes[0].vertices[(i + 1) % 4]);
      int matches = 0;
      for (const auto& line : lines) {
        if (angleBetweenPlanes(line.arc.normal, side->normal) > 0.05) continue;
        ++matches;
        // Measured: 5e-6 ... 4.2e-4 rad, 0.04 px (the samples that the image was drawn with), ends
        // 1 px from the corners.
        EXPECT_LE(angleBetweenPlanes(line.arc.normal, side->normal), 5e-4) << name;
        EXPECT_LE(line.rms_px, 0.05) << name;
        const auto a = camera.project(side->from), b = camera.project(side->to);
        const bool crossed = (line.from_px - *a).norm() > (line.from_px - *b).norm();
        EXPECT_LE((line.from_px - (crossed ? *b : *a)).norm(), 1.5) << name;
        EXPECT_LE((line.to_px - (crossed ? *a : *b)).norm(), 1.5) << name;
      }
      EXPECT_EQ(matches, 1) << name;
    }
  }
}

TEST(Detector, OneLineAcrossTheCornersOfAChessboard) {
  const Camera camera = test::testCameras()[1].camera;
  // Two dark squares that touch at a corner: both of the lines through it change polarity there.
  const auto vertex = [](double x, double y) { return Eigen::Vector3d(x, y, 1.0).normalized(); };
  Scene scene;
  scene.background = 190;
  for (const double s : {0.0, -0.5}) {
    test::Shape shape;
    shape.vertices = {
        vertex(s, s), vertex(s + 0.5, s), vertex(s + 0.5, s + 0.5), vertex(s, s + 0.5)};
    shape.axis = vertex(s + 0.25, s + 0.25);
    shape.grey = 40;
    scene.shapes.push_back(shape);
  }
  const auto image = test::toU8(test::render(scene, camera), 1, 1);
  Detector detector(camera);
  int through_the_corner = 0;
  for (const auto& line : detector.detect(test::viewOf(image, camera))) {
    if (std::abs(line.arc.normal.z()) > 0.01) continue;  // planes through the axis (x = 0, y = 0)
    ++through_the_corner;
    EXPECT_GT(line.arc.angle(), 0.8);
  }
  EXPECT_EQ(through_the_corner, 2);
}

TEST(Detector, DiscsAreNoLines) {
  const Camera camera = makeCamera("fov", std::array{447.0, 447.0, 400.0, 380.0, 0.93}, 800, 760);
  Detector detector(camera);
  for (const double radius : {80.0, 120.0, 200.0, 300.0}) {
    for (const double noise : {0.0, 4.0}) {
      std::vector<float> image(800 * 760);
      for (int y = 0; y < 760; ++y) {
        for (int x = 0; x < 800; ++x) {
          const double d = radius - std::hypot(x - 401.3, y - 378.7);
          image[static_cast<size_t>(y * 800 + x)] =
              static_cast<float>(70 + 55 * std::erfc(-d / (0.76 * std::sqrt(2.0))));
        }
      }
      const auto pixels = test::toU8(image, noise, 3);
      const auto& lines = detector.detect(test::viewOf(pixels, camera));
      EXPECT_LE(lines.size(), 2U) << radius << " " << noise;
      // What is taken for a line is an arc that a plane fits within half a pixel.
      for (const auto& line : lines) {
        for (const Eigen::Vector2d& p : test::curveOf(camera, line)) {
          EXPECT_NEAR((p - Eigen::Vector2d(401.3, 378.7)).norm(), radius, 0.5);
        }
      }
    }
  }
}

TEST(Detector, NoiseIsNoLine) {
  const Camera camera = test::testCameras()[0].camera;
  Detector detector(camera);
  for (const double sigma : {1.0, 8.0, 40.0}) {
    const std::vector<float> flat(640 * 512, 128);
    const auto image = test::toU8(flat, sigma, 9);
    EXPECT_THAT(detector.detect(test::viewOf(image, camera)), testing::IsEmpty()) << sigma;
  }
}

TEST(Detector, NormalCovarianceMatchesRepeatedNoise) {
  const Camera camera = test::testCameras()[2].camera;
  Scene scene;
  scene.shapes.push_back(
      test::polygon(Eigen::Vector3d(0.3, 0.1, 1), 0.45, {0.3, 1.8, 3.4, 4.9}, 160));
  const auto clean = test::render(scene, camera);
  const auto side = arcBetween(scene.shapes[0].vertices[0], scene.shapes[0].vertices[1]);
  Detector detector(camera);
  double sum = 0;
  int count = 0;
  for (uint64_t trial = 0; trial < 60; ++trial) {
    const auto image = test::toU8(clean, 6, 40 + trial);
    for (const auto& line : detector.detect(test::viewOf(image, camera))) {
      if (angleBetweenPlanes(line.arc.normal, side->normal) > 0.02) continue;
      Eigen::Vector3d err = line.arc.normal - side->normal;
      if (line.arc.normal.dot(side->normal) < 0) err = line.arc.normal + side->normal;
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(line.normal_cov);
      for (int i = 1; i < 3; ++i) {
        const double component = eigen.eigenvectors().col(i).dot(err);
        sum += component * component / eigen.eigenvalues()[i];
        ++count;
      }
    }
  }
  ASSERT_GE(count, 110);
  // Squared error over predicted variance: 1 if the covariance is right.
  EXPECT_GT(sum / count, 0.4);
  EXPECT_LT(sum / count, 2.5);
}

TEST(Detector, TwiceTheSameImageGivesTheSameLines) {
  const Camera camera = test::testCameras()[3].camera;
  const auto image =
      test::toU8(test::render(test::randomScene(1, 9, 2, sceneAngle(camera)), camera), 4, 2);
  const auto other =
      test::toU8(test::render(test::randomScene(2, 9, 2, sceneAngle(camera)), camera), 4, 2);
  for (const auto& options : {DetectorOptions{}, DetectorOptions::paper()}) {
    Detector detector(camera, options), second(camera, options);
    const std::vector<DetectedLine> first = detector.detect(test::viewOf(image, camera));
    ASSERT_GT(first.size(), 5U);
    (void)detector.detect(test::viewOf(other, camera));
    Detector moved = std::move(detector);
    for (Detector* d : {&moved, &second}) {
      const auto& again = d->detect(test::viewOf(image, camera));
      ASSERT_EQ(again.size(), first.size());
      for (size_t i = 0; i < first.size(); ++i) {
        EXPECT_EQ(again[i].arc.normal, first[i].arc.normal);
        EXPECT_EQ(again[i].from_px, first[i].from_px);
        EXPECT_EQ(again[i].to_px, first[i].to_px);
        EXPECT_EQ(again[i].score, first[i].score);
        EXPECT_EQ(again[i].normal_cov, first[i].normal_cov);
      }
    }
  }
}

TEST(Detector, StageTimesAddUp) {
  const Camera camera = test::testCameras()[0].camera;
  const auto image =
      test::toU8(test::render(test::randomScene(1, 9, 2, sceneAngle(camera)), camera), 0, 2);
  for (const auto& options : {DetectorOptions{}, DetectorOptions::paper()}) {
    Detector detector(camera, options);
    (void)detector.detect(test::viewOf(image, camera));
    const StageTimes& t = detector.times();
    for (const double stage : {t.gradient, t.linking, t.planes, t.validation}) EXPECT_GT(stage, 0);
    // Steps of the paper that the default makes in the same pass as another.
    const bool is_paper = options.method == DetectorOptions::Method::kConvexPolygons;
    EXPECT_EQ(t.anchors > 0, is_paper);
    EXPECT_EQ(t.chains > 0, is_paper);
    const double sum = t.gradient + t.anchors + t.linking + t.chains + t.planes + t.validation;
    EXPECT_LE(sum, t.total);
  }
}

TEST(Detector, AnySizeOfImageWorks) {
  for (const auto& options : {DetectorOptions{}, DetectorOptions::paper()}) {
    int sizes = 0;
    for (int w = 1; w <= 12; ++w) {
      for (int h = 1; h <= 12; ++h, ++sizes) {
        const Camera camera = makeCamera("fov", std::array{8.0, 8.0, w / 2.0, h / 2.0, 0.9}, w, h);
        std::vector<uint8_t> image(static_cast<size_t>(w * h));
        for (size_t i = 0; i < image.size(); ++i) {
          image[i] = static_cast<uint8_t>(256 * test::uniform(7, i));
        }
        EXPECT_THAT(Detector(camera, options).detect(test::viewOf(image, camera)),
                    testing::IsEmpty());
      }
    }
    EXPECT_EQ(sizes, 144);
    for (const auto& [w, h] : {std::pair{700, 1}, {1, 700}, {700, 5}, {5, 700}, {64, 17}}) {
      const Camera camera = makeCamera("omni", std::array{1.2, 90.0, 90.0, 30.0, 8.0}, w, h);
      std::vector<uint8_t> image(static_cast<size_t>(w * h));
      for (size_t i = 0; i < image.size(); ++i) {
        image[i] = static_cast<uint8_t>(256 * test::uniform(7, i));
      }
      EXPECT_LE(Detector(camera, options).detect(test::viewOf(image, camera)).size(), 3U);
    }
  }
}

TEST(Detector, FlatImagesAndCamerasWithoutRaysGiveNothing) {
  const Camera camera = test::testCameras(30)[0].camera;
  for (const int grey : {0, 128, 255}) {
    const std::vector<uint8_t> image(static_cast<size_t>(camera.width() * camera.height()),
                                     static_cast<uint8_t>(grey));
    EXPECT_THAT(Detector(camera).detect(test::viewOf(image, camera)), testing::IsEmpty());
  }
  // Principal point far outside: no pixel has a ray.
  const Camera blind = makeCamera("omni", std::array{2.0, 50.0, 50.0, 900.0, 900.0}, 64, 48);
  std::vector<uint8_t> image(64 * 48);
  for (size_t i = 0; i < image.size(); ++i) image[i] = i % 64 < 30 ? 20 : 220;
  EXPECT_THAT(Detector(blind).detect(test::viewOf(image, blind)), testing::IsEmpty());
}

TEST(Detector, ExtremeImagesGiveFiniteRecords) {
  // Full contrast in checks, stripes, spirals and noise: the most edges that an image can hold.
  const Camera camera = test::testCameras(40)[2].camera;
  const int w = camera.width(), h = camera.height();
  size_t paper_lines = 0, unchecked_lines = 0;
  for (int kind = 0; kind < 8; ++kind) {
    std::vector<uint8_t> image(static_cast<size_t>(w * h));
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const double angle = std::atan2(y - h / 2.0, x - w / 2.0);
        const double r = std::hypot(x - w / 2.0, y - h / 2.0);
        bool on = false;
        if (kind < 3) {
          on = ((x >> kind) + (y >> kind)) % 2 == 0;
        } else if (kind < 5) {
          on = (kind == 3 ? x : y) / 3 % 2 == 0;
        } else if (kind == 5) {
          on = std::sin(r * 0.6 + angle) > 0;
        } else {
          const int size = kind == 6 ? 1 : 24;  // noise; random squares, whose sides may be lines
          on = test::uniform(8, static_cast<uint64_t>(y / size * w + x / size)) < 0.5;
        }
        image[static_cast<size_t>(y * w + x)] = on ? 255 : 0;
      }
    }
    for (auto options : {DetectorOptions{}, DetectorOptions::paper()}) {
      if (kind == 7) {
        options.edges.anchor_gradient = options.edges.min_gradient = 0;
        options.edges.anchor_noise_ratio = options.edges.min_noise_ratio = 0;
        options.edges.anchor_interval_px = 1;
        options.edges.min_chain_px = 2;
        options.planes.seed_px = 4;
        options.planes.max_err_px = 3;
        options.validation.rho_px = options.validation.tight_rho_px = 3;
        options.validation.min_score = -100;
        options.validation.min_length_px = 2;
        options.validation.max_gap_px = 1000;
        options.validation.min_bend_radius_px = 0;
      }
      Detector detector(camera, options);
      const auto& lines = detector.detect(test::viewOf(image, camera));
      if (options.method == DetectorOptions::Method::kConvexPolygons) {
        paper_lines += lines.size();
      } else if (kind == 7) {
        unchecked_lines += lines.size();
      } else {
        EXPECT_LE(lines.size(), 3U) << kind;  // nothing there is straight in space
      }
      for (const auto& line : lines) {
        EXPECT_TRUE(line.arc.normal.allFinite() && line.normal_cov.allFinite());
        EXPECT_TRUE(std::isfinite(line.score) && std::isfinite(line.rms_px));
        EXPECT_TRUE(std::isfinite(line.max_px) && line.length_px > 0);
      }
      expectInsideImage(camera, lines);
    }
  }
  EXPECT_GE(paper_lines, 50U);
  EXPECT_GE(unchecked_lines, 30U);
}

TEST(Detector, WrongViewsAreRefusedWithBothSizes) {
  const Camera camera = makeCamera("pinhole", std::array{100.0, 100.0, 32.0, 24.0}, 64, 48);
  Detector detector(camera);
  const std::vector<uint8_t> image(64 * 48 * 4);
  const ImageView good{.data = image.data(), .width = 64, .height = 48, .stride_bytes = 64};
  const auto refusal = [&](const auto& change) {
    ImageView view = good;
    change(view);
    try {
      (void)detector.detect(view);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal([](ImageView&) {}), "");
  EXPECT_THAT(refusal([](ImageView& v) { v.width = 63; }),
              testing::AllOf(testing::HasSubstr("63 x 48"), testing::HasSubstr("64 x 48")));
  EXPECT_THAT(refusal([](ImageView& v) { v.data = nullptr; }), testing::HasSubstr("no data"));
  EXPECT_THAT(refusal([](ImageView& v) { v.channels = 2; }), testing::HasSubstr("2 channels"));
  EXPECT_THAT(refusal([](ImageView& v) { v.stride_bytes = 63; }), testing::HasSubstr("stride"));
  EXPECT_THAT(refusal([](ImageView& v) {
                v.type = PixelType::kF32;
                v.stride_bytes = 64 * 4 + 2;
              }),
              testing::HasSubstr("aligned"));
}

TEST(Detector, MaskedPartsGiveNoLines) {
  const Camera camera = test::testCameras()[2].camera;
  const auto image =
      test::toU8(test::render(test::randomScene(3, 9, 2, sceneAngle(camera)), camera), 1, 2);
  const int w = camera.width(), h = camera.height();
  for (const auto& options : {DetectorOptions{}, DetectorOptions::paper()}) {
    Detector detector(camera, options);
    const std::vector<DetectedLine> all = detector.detect(test::viewOf(image, camera));
    std::vector<uint8_t> mask(image.size(), 255);
    const ImageView mask_view = test::viewOf(mask, camera);
    const std::vector<DetectedLine> open = detector.detect(test::viewOf(image, camera), mask_view);
    ASSERT_EQ(open.size(), all.size());
    for (size_t i = 0; i < all.size(); ++i) EXPECT_EQ(open[i].arc.normal, all[i].arc.normal);
    // A border at no multiple of 8.
    const int split = w / 2 + 3;
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < split; ++x) mask[static_cast<size_t>(y * w + x)] = 0;
    }
    const auto& half = detector.detect(test::viewOf(image, camera), mask_view);
    EXPECT_GE(half.size(), 5U);
    EXPECT_LT(half.size(), all.size());
    for (const auto& line : half) {
      for (const Eigen::Vector2d& p : test::curveOf(camera, line)) EXPECT_GE(p.x(), split - 3);
    }
    std::fill(mask.begin(), mask.end(), uint8_t{0});
    EXPECT_THAT(detector.detect(test::viewOf(image, camera), mask_view), testing::IsEmpty());
    EXPECT_EQ(detector.detect(test::viewOf(image, camera)).size(), all.size());
    ImageView wrong = mask_view;
    wrong.width = w - 1;
    EXPECT_THROW((void)detector.detect(test::viewOf(image, camera), wrong), std::invalid_argument);
    wrong = mask_view;
    wrong.type = PixelType::kU16;
    wrong.stride_bytes = 2 * w;
    EXPECT_THROW((void)detector.detect(test::viewOf(image, camera), wrong), std::invalid_argument);
  }
}

TEST(DetectorOptions, OutOfRangeIsNamed) {
  const Camera camera = makeCamera("pinhole", std::array{100.0, 100.0, 32.0, 24.0}, 64, 48);
  const auto refusal = [&](const auto& change) {
    DetectorOptions options;
    change(options);
    try {
      const Detector detector(camera, options);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal([](DetectorOptions&) {}), "");
  EXPECT_THAT(refusal([](DetectorOptions& o) { o.validation.rho_px = 0; }),
              testing::HasSubstr("validation.rho_px = 0"));
  EXPECT_THAT(refusal([](DetectorOptions& o) { o.validation.tight_rho_px = 2; }),
              testing::HasSubstr("(0, 1]"));
  EXPECT_THAT(refusal([](DetectorOptions& o) { o.edges.min_gradient = std::nan(""); }),
              testing::HasSubstr("edges.min_gradient"));
  EXPECT_THAT(refusal([](DetectorOptions& o) { o.polygons.max_turn_rad = 2; }),
              testing::HasSubstr("polygons.max_turn_rad"));
  EXPECT_THAT(refusal([](DetectorOptions& o) { o.planes.seed_px = 3; }),
              testing::HasSubstr("planes.seed_px"));
  const DetectorOptions paper = DetectorOptions::paper();
  EXPECT_NO_THROW(paper.check());
  EXPECT_EQ(paper.method, DetectorOptions::Method::kConvexPolygons);
  EXPECT_EQ(paper.polygons.max_turn_rad, M_PI / 16);
  EXPECT_EQ(paper.validation.rho_px, 4);
  EXPECT_EQ(paper.polygons.min_single_px, 25);
}

// An edge from x = 35 to 365 px of a pinhole image with a bend at 290 px: two straight pieces, one
// convex chain, judged as a whole (4.4). The line that fits it best leaves the ends of the pieces
// at 13, 21, 21 and 45 px times the bend (rad): with 0.1 rad one of the four is beyond rho = 4 px.
TEST(Detector, PaperDropsAChainWithOneBadEnd) {
  const Camera camera = makeCamera("pinhole", std::array{400.0, 400.0, 200.0, 200.0}, 400, 400);
  const auto linesAt = [&](double bend_rad, double rho_px) {
    std::vector<uint8_t> image(400 * 400);
    for (int y = 0; y < 400; ++y) {
      for (int x = 0; x < 400; ++x) {
        const double edge_y = 200.3 - std::max(0.0, x - 290.0) * std::tan(bend_rad);
        // The contrast fades away at both ends: no other edge bounds the bright part.
        const double contrast = 60 * std::clamp(std::min(x - 30, 370 - x) / 20.0, 0.0, 1.0);
        image[static_cast<size_t>(y * 400 + x)] =
            static_cast<uint8_t>(120 + contrast * std::erf((y - edge_y) / 1.1));
      }
    }
    DetectorOptions options = DetectorOptions::paper();
    options.validation.rho_px = rho_px;
    Detector detector(camera, options);
    return detector.detect(test::viewOf(image, camera)).size();
  };
  EXPECT_EQ(linesAt(0, 4), 1U);
  EXPECT_EQ(linesAt(0.08, 4), 1U);
  EXPECT_EQ(linesAt(0.10, 4), 0U);
  EXPECT_EQ(linesAt(0.10, 6), 1U);
}

}  // namespace
}  // namespace dlsd
