#include "evaluation/peers/peers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "cameras/arc.h"
#include "evaluation/hand_made.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using hand_made::pinholeCamera;
using hand_made::TemporaryFolder;
using hand_made::writeDataset;

/// The edge between two half-spaces, as a camera sees it: bright where normal . ray > 0, blurred by
/// the pixel.
Image edgeImage(const Camera& camera, const Vector3d& normal) {
  Image image;
  image.width = camera.width();
  image.height = camera.height();
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      double sum = 0;
      for (int k = 0; k < 64; ++k) {
        const auto ray =
            camera.unproject({x + (k % 8 + 0.5) / 8 - 0.5, y + (k / 8 + 0.5) / 8 - 0.5});
        sum += ray && normal.dot(*ray) > 0 ? 180 : 60;
      }
      image.bytes.push_back(uint8_t(std::lround(sum / 64)));
    }
  }
  return image;
}

struct Peer : testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(All, Peer, testing::ValuesIn(peerDetectors()), [](const auto& peer) {
  return peer.param;
});

TEST_P(Peer, FindsALongEdgeWhereItIsOnADistortedImage) {
  const Camera camera{Fov::fromParams({223.4, 223.5, 315.4, 255.2, 0.933271}), 640, 512};
  PeerDetector detector(camera, GetParam());
  const Vector3d normal = Vector3d(0.25, 1, -0.35).normalized();
  const Detections detections = detector.detect(edgeImage(camera, normal));
  EXPECT_GE(detections.time_ms.value(), 0);
  EXPECT_GE(detections.rectification_ms.value(), 0);
  ASSERT_FALSE(detections.lines.empty());
  double length = 0, sum = 0;
  size_t count = 0;
  for (const DetectionLine& line : detections.lines) {
    // The curve is the image of its plane, and close to the edge.
    for (const Vector2d& p : line.points) {
      const Vector3d ray = camera.unproject(p).value();
      EXPECT_LE(std::abs(line.normal.value().dot(ray)), 1e-4);
      const double signed_px =
          std::asin(normal.dot(ray)) *
          ((*camera.jacobian((ray - normal.dot(ray) * normal).normalized())) * normal).norm();
      EXPECT_LE(std::abs(signed_px), 1.5);
      sum += signed_px;
      ++count;
    }
    length = std::max(length, line.angle_rad.value());
  }
  // The view is about 100 degrees wide.
  EXPECT_GE(length, 60 * M_PI / 180);
  // Nobody's convention is off by half a pixel.
  EXPECT_LE(std::abs(sum / double(count)), 0.3);
  RecordProperty("mean_offset_px", std::to_string(sum / double(count)));
}

TEST_P(Peer, BlankImagesHaveNoLinesAndWrongSizesAreRefused) {
  const Camera camera = pinholeCamera();
  PeerDetector detector(camera, GetParam());
  Image blank;
  blank.width = 640;
  blank.height = 480;
  blank.bytes.assign(640 * 480, 90);
  EXPECT_TRUE(detector.detect(blank).lines.empty());
  blank.height = 240;
  EXPECT_THROW((void)detector.detect(blank), std::invalid_argument);
}

TEST_P(Peer, ColourAndSixteenBitsAreTheSameImage) {
  const Camera camera = pinholeCamera();
  PeerDetector detector(camera, GetParam());
  const Image grey = edgeImage(camera, Vector3d(0.2, 1, -0.1).normalized());
  Image colour = grey, deep = grey;
  colour.channels = 3;
  colour.bytes.clear();
  deep.bits = 16;
  deep.bytes.clear();
  for (const uint8_t value : grey.bytes) {
    colour.bytes.insert(colour.bytes.end(), 3, value);
    deep.bytes.insert(deep.bytes.end(), 2, value);  // value * 257
  }
  const Detections expected = detector.detect(grey);
  ASSERT_FALSE(expected.lines.empty());
  for (const Image* image : {&colour, &deep}) {
    const Detections same = detector.detect(*image);
    ASSERT_EQ(same.lines.size(), expected.lines.size());
    for (size_t i = 0; i < same.lines.size(); ++i) {
      EXPECT_EQ(same.lines[i].points, expected.lines[i].points);
    }
  }
}

TEST_P(Peer, RunsOnADataset) {
  const TemporaryFolder folder("dlsd-peers-test");
  const LabelLine line = hand_made::label(pinholeCamera(), {3, 199.5}, {636, 199.5}, 0);
  writeDataset(folder / "data", {{line}, {line}});
  const Dataset dataset(folder / "data");
  for (const bool timed : {false, true}) {
    size_t frames = 0;
    evaluateFrames(
        dataset, detectionsOfPeer(dataset, GetParam(), timed), {}, 2, [&](FrameEvaluation&& frame) {
          ++frames;
          EXPECT_EQ(frame.detections.time_ms.has_value(), timed);
          EXPECT_EQ(frame.detections.rectification_ms.has_value(), timed);
          EXPECT_TRUE(frame.outcome.labels.back().at(0).found);
        });
    EXPECT_EQ(frames, 2U);
  }
}

TEST(Peers, TheViewShowsNothingButTheImageAndAtMost130Degrees) {
  const Camera wide{
      Fov::fromParams({446.915863, 447.071228, 631.219238, 510.997498, 0.933271}), 1280, 1024};
  const Camera catadioptric{
      UnifiedOmni::fromParams({1.4, 590.5, 589.75, 644.25, 508.5}), 1280, 1024, 105 * M_PI / 180};
  for (const Camera& camera : {wide, catadioptric, pinholeCamera()}) {
    const VirtualView view = PeerDetector(camera, "fld").view();
    EXPECT_EQ(view.width, camera.width());
    EXPECT_EQ(view.height, camera.height());
    double left = 0, right = 0;
    for (int y = 0; y < view.height; y += 7) {
      const Vector3d first = view.rayInCam({0, double(y)}).value();
      const Vector3d last = view.rayInCam({double(view.width - 1), double(y)}).value();
      for (const Vector3d& ray : {first, last}) {
        const auto pixel = camera.project(ray);
        ASSERT_TRUE(pixel);
        EXPECT_TRUE(camera.inImage(*pixel));
      }
      left = std::max(left, std::atan2(-first.x(), first.z()));
      right = std::max(right, std::atan2(last.x(), last.z()));
    }
    EXPECT_LE(left + right, kPeerMaxFieldRad + 1e-9);
    EXPECT_GE(left + right, 60 * M_PI / 180);
  }
}

TEST(Peers, UnknownNamesAreRefused) {
  try {
    const PeerDetector detector(pinholeCamera(), "elsed");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "peer \"elsed\" is unknown, there are lsd, edlines, fld");
  }
}

}  // namespace
}  // namespace dlsd
