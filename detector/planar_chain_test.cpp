#include "detector/planar_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "detector/test_scene.h"

namespace dlsd {
namespace {

// The upper boundary of a polygon as seen by a fisheye camera, a whole pixel in every column: as
// many pieces as sides, each with that side's plane.
TEST(PlanarChain, SplitsWhereThePlaneChanges) {
  const Camera camera = test::testCameras()[2].camera;
  const RayTable rays(camera);
  const Eigen::Vector3d a(-0.8, -0.2, 1), b(-0.1, -0.5, 1), c(0.6, -0.45, 1), d(1.2, 0.1, 1);
  const std::array<Eigen::Vector3d, 3> normals = {
      a.cross(b).normalized(), b.cross(c).normalized(), c.cross(d).normalized()};
  CrestChains chains;
  const auto first = camera.project(a), last = camera.project(d);
  ASSERT_TRUE(first && last);
  std::vector<int> corners;
  for (const Eigen::Vector3d& corner : {b, c}) {
    corners.push_back(static_cast<int>(camera.project(corner)->x()));
  }
  const int begin = static_cast<int>(first->x()) + 1, end = static_cast<int>(last->x());
  for (int x = begin; x < end; ++x) {
    const size_t side = x < corners[0] ? 0 : x < corners[1] ? 1 : 2;
    // Where the plane's image crosses the column.
    double low = 0, high = camera.height() - 1;
    for (int i = 0; i < 50; ++i) {
      const double y = (low + high) / 2;
      const bool above = camera.unproject({double(x), y})->dot(normals[side]) *
                             camera.unproject({double(x), 0.0})->dot(normals[side]) >
                         0;
      (above ? low : high) = y;
    }
    chains.across.push_back(static_cast<uint16_t>(std::lround(low)));
  }
  chains.chains.push_back(
      {0, static_cast<uint32_t>(chains.across.size()), static_cast<uint16_t>(begin), false});
  PlanarSplitter splitter(rays, {});
  std::vector<PlanarPiece> pieces;
  splitter.split(chains, &pieces);
  // Corners are cut, which may make pieces of their own. The long ones are the sides.
  std::array<int, 3> length_px{};
  for (const PlanarPiece& piece : pieces) {
    if (piece.length_px < 40) continue;
    size_t side = 0;
    for (size_t i = 1; i < 3; ++i) {
      if (angleBetweenPlanes(piece.normal, normals[i]) <
          angleBetweenPlanes(piece.normal, normals[side])) {
        side = i;
      }
    }
    EXPECT_LE(angleBetweenPlanes(piece.normal, normals[side]), 0.03);
    const RaySample sample = rays.at(piece.start_px.x(), piece.start_px.y());
    EXPECT_LE(std::abs(sample.ray.dot(normals[side])) * sample.pxPerRad(), 1.5);
    length_px[side] += piece.length_px;
  }
  EXPECT_GE(length_px[0], 0.85 * (corners[0] - begin));
  EXPECT_GE(length_px[1], 0.85 * (corners[1] - corners[0]));
  EXPECT_GE(length_px[2], 0.85 * (end - corners[1]));
  splitter.split({}, &pieces);
  EXPECT_TRUE(pieces.empty());
}

// A chain that bows out by less than max_err_px is one piece, by more it is two.
TEST(PlanarChain, SplitsWhereAnEdgeIsTooFarFromThePlane) {
  const Camera camera = test::testCameras()[0].camera;
  const RayTable rays(camera);
  const auto pieces = [&](double bow_px) {
    // One coordinate for eight rows, so that the nodes' means say fractions of a pixel.
    CrestChains chains;
    constexpr int kRows = 240;
    double rest = 0;
    for (int i = 0; i < kRows; ++i) {
      const double exact = 200 + bow_px * (1 - std::abs(2.0 * i / kRows - 1)) + rest;
      chains.across.push_back(static_cast<uint16_t>(std::lround(exact)));
      rest = exact - static_cast<double>(chains.across.back());
    }
    chains.chains.push_back({0, kRows, 100, true});
    PlanarSplitter splitter(rays, {.max_err_px = 2});
    std::vector<PlanarPiece> out;
    splitter.split(chains, &out);
    return out.size();
  };
  EXPECT_EQ(pieces(1.4), 1U);
  EXPECT_EQ(pieces(2.8), 2U);
}

TEST(PlanarChain, ShortPiecesAreDropped) {
  const Camera camera = test::testCameras()[0].camera;
  const RayTable rays(camera);
  const auto pieces = [&](int length) {
    CrestChains chains;
    chains.across.assign(static_cast<size_t>(length), 200);
    chains.chains.push_back({0, static_cast<uint32_t>(length), 100, true});
    PlanarSplitter splitter(rays, {.seed_px = 12});
    std::vector<PlanarPiece> out;
    splitter.split(chains, &out);
    return out.size();
  };
  EXPECT_EQ(pieces(11), 0U);
  EXPECT_EQ(pieces(12), 1U);
}

}  // namespace
}  // namespace dlsd
