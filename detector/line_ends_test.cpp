// Where lines end: at what only seems to be more of them, and at half a turn.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "detector/detector.h"
#include "detector/test_scene.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kWidth = 320, kHeight = 300;
constexpr double kDepthPx = 60;  // of rectangles

/// A rectangle beside an edge along which s is measured: at d > 0 or on the other side.
struct Piece {
  double from_s, to_s;
  double contrast;  ///< Of its grey levels to the ground's.
  bool beyond;      ///< At d < 0.
};

/// An edge in a direction, from the point s = 0.
struct Edge {
  Vector2d start;
  double angle_rad;
  std::vector<Piece> pieces;

  [[nodiscard]] Vector2d along() const { return {std::cos(angle_rad), std::sin(angle_rad)}; }
  [[nodiscard]] Vector2d across() const { return {-std::sin(angle_rad), std::cos(angle_rad)}; }

  /// Through a Gaussian blur of 0.76 px.
  [[nodiscard]] std::vector<uint8_t> image(double noise, uint64_t seed) const {
    const auto step = [](double x) {
      return std::abs(x) > 5 ? (x > 0 ? 1 : 0) : 0.5 * std::erfc(-x / (0.76 * std::sqrt(2.0)));
    };
    std::vector<float> grey(size_t{kWidth} * kHeight);
    for (size_t i = 0; i < grey.size(); ++i) {
      const Vector2d p =
          Vector2d(static_cast<double>(i % kWidth), static_cast<double>(i / kWidth)) - start;
      const double s = p.dot(along()), d = p.dot(across());
      double sum = 80;
      for (const Piece& piece : pieces) {
        const double side = piece.beyond ? -d : d;
        sum += piece.contrast * (step(s - piece.from_s) - step(s - piece.to_s)) *
               (step(side) - step(side - kDepthPx));
      }
      grey[i] = static_cast<float>(sum);
    }
    return test::toU8(grey, noise, seed);
  }
};

/// From where to where the longest line along the edge goes; how far its ends are off.
struct Found {
  double from_s = 0, to_s = 0, off_px = 1e9;
  int lines = 0;  ///< Along the edge.
};

Found find(const Camera& camera, Detector* detector, const Edge& edge, uint64_t seed) {
  const auto image = edge.image(1, seed);
  Found found;
  double longest = 0;
  for (const DetectedLine& line : detector->detect(test::viewOf(image, camera))) {
    const Vector2d a = line.from_px - edge.start, b = line.to_px - edge.start;
    const double off = std::max(std::abs(a.dot(edge.across())), std::abs(b.dot(edge.across())));
    if (off > 2) continue;
    ++found.lines;
    if (line.length_px < longest) continue;
    longest = line.length_px;
    found.off_px = off;
    found.from_s = std::min(a.dot(edge.along()), b.dot(edge.along()));
    found.to_s = std::max(a.dot(edge.along()), b.dot(edge.along()));
  }
  return found;
}

class LineEnds : public testing::Test {
 protected:
  /// In some directions; f(what was found, message).
  template <class F>
  void forEdges(const std::vector<Piece>& pieces, F&& f) {
    for (const double angle : {0.0, 0.3, 0.7, 1.3, 2.2, 3.5, 5.2}) {
      // The middle of the edge is in the middle of the image, but for a fraction of a pixel.
      double length = 0;
      for (const Piece& piece : pieces) length = std::max(length, piece.to_s);
      const Edge edge{Vector2d(kWidth / 2.0 + 0.31 * angle, kHeight / 2.0 + 0.17) -
                          length / 2 * Vector2d(std::cos(angle), std::sin(angle)),
                      angle,
                      pieces};
      SCOPED_TRACE(testing::Message() << "angle " << angle);
      f(find(camera_, &detector_, edge, static_cast<uint64_t>(10 * angle)));
      ++edges_;
    }
  }

  Camera camera_ = makeCamera("pinhole", std::array{300.0, 300.0, 159.5, 149.5}, kWidth, kHeight);
  Detector detector_{camera_};
  int edges_ = 0;
};

/// An end is known to its four rows, which are up to 5.7 px of a slanted edge; and corners are
/// round.
void expectEnds(const Found& found, double from_s, double to_s) {
  EXPECT_LE(found.off_px, 0.3);
  EXPECT_GE(found.from_s, from_s - 3);
  EXPECT_LE(found.from_s, from_s + 5);
  EXPECT_GE(found.to_s, to_s - 5);
  EXPECT_LE(found.to_s, to_s + 3);
}

// Behind its end, exactly in line, a short piece of another edge: much fainter, or the other way
// round.
TEST_F(LineEnds, PiecesOfOtherEdgesAreNotTheLines) {
  constexpr double kEnd = 150;
  for (const double gap : {4.0, 5.0, 6.0, 7.0, 8.0}) {
    for (const Piece& stranger :
         {Piece{0, 12, 15, false}, {0, 12, 15, true}, {0, 8, 15, true}, {0, 8, -60, false}}) {
      const Piece behind{
          kEnd + gap, kEnd + gap + stranger.to_s, stranger.contrast, stranger.beyond};
      SCOPED_TRACE(testing::Message() << "gap " << gap << " contrast " << stranger.contrast
                                      << " beyond " << stranger.beyond);
      forEdges({{0, kEnd, 100, false}, behind},
               [](const Found& found) { expectEnds(found, 0, kEnd); });
    }
  }
  EXPECT_EQ(edges_, 5 * 4 * 7);
}

// As at the corners of a chessboard, whose fields are as strong as each other.
std::vector<Piece> fieldsOf(int count, double size) {
  std::vector<Piece> fields;
  for (int i = 0; i < count; ++i) fields.push_back({size * i, size * (i + 1), 100, i % 2 == 1});
  return fields;
}

TEST_F(LineEnds, ALineCrossesTheFieldsOfAChessboard) {
  forEdges(fieldsOf(6, 28), [](const Found& found) { expectEnds(found, 0, 168); });
  EXPECT_EQ(edges_, 7);
}

// What is fainter for long is believed.
TEST_F(LineEnds, AnEdgeThatFadesIsOneLine) {
  for (const double contrast : {25.0, 15.0}) {
    SCOPED_TRACE(testing::Message() << "contrast " << contrast);
    forEdges({{0, 120, 100, false}, {120, 180, contrast, false}}, [](const Found& found) {
      EXPECT_EQ(found.lines, 1);
      expectEnds(found, 0, 180);
    });
  }
  EXPECT_EQ(edges_, 2 * 7);
}

/// The border of a half space through cameras that see more than half a turn of it.
class Horizon : public testing::Test {
 protected:
  struct Seen {
    double longest_rad = 0;
    double seen_rad = 0, covered_rad = 0;  ///< Of the border; within 0.5 px of a line.
  };

  /// f(what was seen); tilts: of the border's plane against the optical axis.
  template <class F>
  void forHorizons(const std::vector<double>& tilts, F&& f) {
    for (const auto& [name, camera] : cameras()) {
      Detector detector(camera);
      for (const double tilt : tilts) {
        for (const double turn : {-1.0, 1.0}) {
          SCOPED_TRACE(testing::Message() << name << " tilt " << tilt << " turn " << turn);
          const Vector3d normal =
              Vector3d(turn * camera.height(), camera.width(), tilt * camera.width()).normalized();
          f(look(camera, &detector, normal));
          ++horizons_;
        }
      }
    }
  }

  int horizons_ = 0;

 private:
  static std::vector<test::NamedCamera> cameras() {
    constexpr double kFocal = 0.35 * 512;
    return {{"fov", makeCamera("fov", std::array{kFocal, kFocal, 255.5, 255.5, 0.93}, 512, 512)},
            test::testCameras()[3]};
  }

  static Seen look(const Camera& camera, Detector* detector, const Vector3d& normal) {
    test::Scene scene;
    scene.shapes.push_back(test::cone(normal, M_PI / 2, 180));
    const auto image = test::toU8(test::render(scene, camera), 1, 3);
    Seen seen;
    std::vector<std::vector<Vector2d>> curves;
    for (const DetectedLine& line : detector->detect(test::viewOf(image, camera))) {
      EXPECT_LT(line.arc.angle(), M_PI);
      EXPECT_LE(angleBetweenPlanes(line.arc.normal, normal), 1e-3);
      seen.longest_rad = std::max(seen.longest_rad, line.arc.angle());
      curves.push_back(test::curveOf(camera, line));
    }
    const Vector3d a = normal.unitOrthogonal(), b = normal.cross(a);
    constexpr int kSamples = 2000;
    for (int i = 0; i < kSamples; ++i) {
      const double t = 2 * M_PI * i / kSamples;
      const auto px = camera.project(std::cos(t) * a + std::sin(t) * b);
      if (!px || !camera.inImage(*px)) continue;
      seen.seen_rad += 2 * M_PI / kSamples;
      if (std::any_of(curves.begin(), curves.end(), [&](const auto& curve) {
            return test::distanceToPolyline(*px, curve) <= 0.5;
          })) {
        seen.covered_rad += 2 * M_PI / kSamples;
      }
    }
    return seen;
  }
};

TEST_F(Horizon, IsALineOfNearlyHalfATurn) {
  forHorizons({-0.12, 0.2}, [](const Seen& seen) {
    EXPECT_GE(seen.seen_rad, 3.5);
    EXPECT_GE(seen.longest_rad, 3.0);
    EXPECT_GE(seen.covered_rad, 3.0);
  });
  EXPECT_EQ(horizons_, 2 * 2 * 2);
}

}  // namespace
}  // namespace dlsd
