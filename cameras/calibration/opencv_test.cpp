// OpenCV as judge: it reads what we write, we read what it writes, and the cameras agree.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#ifdef DLSD_HAVE_CALIB3D
#include <opencv2/calib3d.hpp>
#endif
#ifdef DLSD_HAVE_CCALIB
#include <opencv2/ccalib/omnidir.hpp>
#endif

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"

namespace dlsd {
namespace {

constexpr int kWidth = 1280, kHeight = 1024;

const std::vector<double> kKannalaBrandt{
    332.53, 331.19, 641.70000000000005, 509.3, -0.0125, 0.0041, -1.0 / 300, 0.0004};
const std::vector<double> kRadtan{
    800.1, 801.7, 640.3, 500.9, -0.3, 0.1, 1.0 / 3000, -0.0007, -0.01};
const std::vector<double> kOmniRadtan{
    1.45, 1150.3, 1149.1, 644.25, 508.7, -0.2, 0.15, 0.0003, -0.0007, 2.5};

/// What is in a file for OpenCV's eyes.
struct Lens {
  cv::Mat K, D;
  double xi = 0;
  int width = 0, height = 0;
};

Lens lensOf(const std::string& text) {
  cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
  Lens lens;
  file["camera_matrix"] >> lens.K;
  file["distortion_coefficients"] >> lens.D;
  if (!file["xi"].empty()) file["xi"] >> lens.xi;
  file["image_width"] >> lens.width;
  file["image_height"] >> lens.height;
  return lens;
}

std::string written(const Lens& lens,
                    const std::string& extension,
                    bool fisheye,
                    bool xi_as_matrix) {
  cv::FileStorage file("x" + extension, cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "calibration_time"
       << "Tue Mar  3 11:02:57 2026";
  file << "image_width" << lens.width << "image_height" << lens.height;
  if (lens.xi == 0) file << "fisheye_model" << (fisheye ? 1 : 0);
  file << "camera_matrix" << lens.K << "distortion_coefficients" << lens.D;
  if (xi_as_matrix) {
    file << "xi" << cv::Mat(1, 1, CV_64F, lens.xi);
  } else if (lens.xi != 0) {
    file << "xi" << lens.xi;
  }
  file << "per_view_reprojection_errors" << cv::Mat::ones(40, 1, CV_32F);
  file << "image_points" << cv::Mat(40, 54, CV_32FC2, cv::Scalar(1.5, 2.5));
  return file.releaseAndGetString();
}

std::vector<Eigen::Vector3d> raysInFront() {
  std::vector<Eigen::Vector3d> rays;
  for (int i = -8; i <= 8; ++i) {
    for (int j = -8; j <= 8; ++j) rays.emplace_back(0.08 * i, 0.07 * j, 1.1);
  }
  return rays;
}

/// Our projection against OpenCV's for rays that it treats correctly.
template <class Project>
void expectSamePixels(const Camera& camera, Project project) {
  std::vector<cv::Point3d> points;
  for (const Eigen::Vector3d& ray : raysInFront()) points.emplace_back(ray.x(), ray.y(), ray.z());
  std::vector<cv::Point2d> pixels;
  project(points, pixels);
  ASSERT_EQ(pixels.size(), points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    const std::optional<Eigen::Vector2d> ours =
        camera.project({points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(ours.has_value());
    EXPECT_NEAR(ours->x(), pixels[i].x, 1e-9);
    EXPECT_NEAR(ours->y(), pixels[i].y, 1e-9);
  }
}

TEST(Opencv, ReadsOurNumbersExactly) {
  for (const auto& [model, params] :
       std::initializer_list<std::pair<std::string, std::vector<double>>>{
           {"kannala_brandt", kKannalaBrandt},
           {"pinhole_radtan", kRadtan},
           {"omni_radtan", kOmniRadtan},
           {"pinhole", {800.1, 801.7, 640.3, 500.9}},
           {"omni", {0.9, 800.1, 801.7, 640.3, 500.9}}}) {
    const Camera camera = makeCamera(model, params, kWidth, kHeight, 1.25);
    const Lens lens = lensOf(calibrationText({{"cam0", camera}}, "opencv"));
    EXPECT_EQ(lens.width, kWidth);
    EXPECT_EQ(lens.height, kHeight);
    const size_t first = model.starts_with("omni") ? 1 : 0;
    EXPECT_EQ(lens.xi, first == 1 ? params[0] : 0);
    ASSERT_EQ(lens.K.size(), cv::Size(3, 3)) << model;
    EXPECT_EQ(lens.K.at<double>(0, 0), params[first]);
    EXPECT_EQ(lens.K.at<double>(1, 1), params[first + 1]);
    EXPECT_EQ(lens.K.at<double>(0, 2), params[first + 2]);
    EXPECT_EQ(lens.K.at<double>(1, 2), params[first + 3]);
    EXPECT_EQ(lens.K.at<double>(0, 1), model == "omni_radtan" ? params.back() : 0);
    for (int i = 0; i < lens.D.cols; ++i) {
      const size_t k = first + 4 + static_cast<size_t>(i);
      EXPECT_EQ(lens.D.at<double>(i), k < params.size() ? params[k] : 0) << model << i;
    }
  }
}

TEST(Opencv, WhatItWritesIsReadExactly) {
  size_t files = 0;
  for (const std::string extension : {".yaml", ".xml", ".json"}) {
    for (const bool column : {false, true}) {
      for (const bool xi_as_matrix : {false, true}) {
        for (const auto& [model, params] :
             std::initializer_list<std::pair<std::string, std::vector<double>>>{
                 {"kannala_brandt", kKannalaBrandt},
                 {"pinhole_radtan", kRadtan},
                 {"omni_radtan", kOmniRadtan}}) {
          const bool omni = model == "omni_radtan";
          if (xi_as_matrix && !omni) continue;
          const size_t first = omni ? 1 : 0;
          Lens lens;
          lens.width = kWidth;
          lens.height = kHeight;
          lens.K = (cv::Mat_<double>(3, 3) << params[first],
                    (omni ? params.back() : 0),
                    params[first + 2],
                    0,
                    params[first + 1],
                    params[first + 3],
                    0,
                    0,
                    1);
          const size_t count = model == "pinhole_radtan" ? 5 : 4;
          lens.D =
              cv::Mat(std::vector<double>(params.begin() + static_cast<long>(first) + 4,
                                          params.begin() + static_cast<long>(first + 4 + count)),
                      true)
                  .reshape(1, column ? static_cast<int>(count) : 1);
          lens.xi = omni ? params[0] : 0;
          const std::string text =
              written(lens, extension, model == "kannala_brandt", xi_as_matrix);
          const LoadedCalibration loaded = parseCalibration(text, "f");
          EXPECT_EQ(loaded.format, "opencv");
          EXPECT_EQ(loaded.cameras.at(0).camera, makeCamera(model, params, kWidth, kHeight))
              << text;
          ++files;
        }
      }
    }
  }
  EXPECT_EQ(files, 3U * 2U * 4U);
}

TEST(Opencv, SinglePrecisionIsReadAsItIs) {
  Lens lens;
  lens.width = kWidth;
  lens.height = kHeight;
  lens.K = (cv::Mat_<float>(3, 3) << 332.53F, 0, 641.7F, 0, 331.19F, 509.3F, 0, 0, 1);
  lens.D = (cv::Mat_<float>(4, 1) << -0.0125F, 0.0041F, -0.0032F, 0.0004F);
  for (const std::string extension : {".yaml", ".xml", ".json"}) {
    const std::vector<double> params =
        parseCalibration(written(lens, extension, true, false), "f").cameras.at(0).camera.params();
    EXPECT_EQ(static_cast<float>(params[0]), 332.53F);
    EXPECT_EQ(static_cast<float>(params[3]), 509.3F);
    EXPECT_EQ(static_cast<float>(params[7]), 0.0004F);
  }
}

// The numbers mean the same: OpenCV projects with what it reads from our file as we do.
#ifdef DLSD_HAVE_CALIB3D
TEST(Opencv, FisheyeProjectsAsOurCamera) {
  const Camera camera = makeCamera("kannala_brandt", kKannalaBrandt, kWidth, kHeight);
  const Lens lens = lensOf(calibrationText({{"cam0", camera}}, "opencv-fisheye"));
  expectSamePixels(camera, [&](const auto& points, auto& pixels) {
    cv::fisheye::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), lens.K, lens.D);
  });
}

TEST(Opencv, PinholeProjectsAsOurCamera) {
  const Camera camera = makeCamera("pinhole_radtan", kRadtan, kWidth, kHeight);
  const Lens lens = lensOf(calibrationText({{"cam0", camera}}, "opencv-pinhole"));
  expectSamePixels(camera, [&](const auto& points, auto& pixels) {
    cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), lens.K, lens.D, pixels);
  });
}
#endif

#ifdef DLSD_HAVE_CCALIB
TEST(Opencv, OmnidirProjectsAsOurCamera) {
  const Camera camera = makeCamera("omni_radtan", kOmniRadtan, kWidth, kHeight);
  const Lens lens = lensOf(calibrationText({{"cam0", camera}}, "opencv-omnidir"));
  expectSamePixels(camera, [&](const auto& points, auto& pixels) {
    cv::omnidir::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), lens.K, lens.xi, lens.D);
  });
}
#endif

}  // namespace
}  // namespace dlsd
