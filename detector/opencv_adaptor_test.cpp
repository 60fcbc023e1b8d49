#include "detector/opencv_adaptor.h"

#include <gtest/gtest.h>

#include <array>

#include "detector/detector.h"

namespace dlsd {
namespace {

TEST(OpencvAdaptor, EveryDepthAndRegionShowsTheSameLine) {
  const Camera camera = makeCamera("pinhole", std::array{100.0, 100.0, 50.0, 40.0}, 100, 80);
  Detector detector(camera);
  int kinds = 0;
  for (const int depth : {CV_8U, CV_16U, CV_32F}) {
    for (const int channels : {1, 3, 4}) {
      const double unit = depth == CV_16U ? 257 : 1;
      cv::Mat whole(120, 150, CV_MAKETYPE(depth, channels), cv::Scalar::all(40 * unit));
      whole.colRange(70, 150).setTo(cv::Scalar::all(180 * unit));
      const cv::Mat region = whole(cv::Rect(20, 30, 100, 80));
      const auto& lines = detector.detect(viewOf(region));
      ASSERT_EQ(lines.size(), 1U) << depth << " " << channels;
      // Between columns 49 and 50 of the region.
      EXPECT_NEAR(lines[0].from_px.x(), 49.5, 0.05);
      EXPECT_NEAR(lines[0].to_px.x(), 49.5, 0.05);
      ++kinds;
    }
  }
  EXPECT_EQ(kinds, 9);
}

TEST(OpencvAdaptor, OtherDepthsAreRefused) {
  EXPECT_THROW((void)viewOf(cv::Mat(4, 4, CV_64F)), std::invalid_argument);
}

}  // namespace
}  // namespace dlsd
