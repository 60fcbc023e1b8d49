#include "detector/planar_chain.h"

#include <gtest/gtest.h>

#include <cmath>

#include "detector/test_scene.h"

namespace dlsd {
namespace {

constexpr double kPxPerRad = 450;

/// One ray per px along the great circles through the vertices, with noise across in px.
ChainRays chainThrough(const std::vector<Eigen::Vector3d>& vertices,
                       double noise_px,
                       std::vector<int>* corners) {
  ChainRays chain;
  uint64_t k = 0;
  for (size_t i = 0; i + 1 < vertices.size(); ++i) {
    const auto arc = arcBetween(vertices[i], vertices[i + 1]);
    const int count = static_cast<int>(arc->angle() * kPxPerRad);
    for (int j = 0; j < count; ++j) {
      const double shift = noise_px / kPxPerRad * test::gaussian(3, k++);
      chain.add((arc->at(static_cast<double>(j) / count) + shift * arc->normal).normalized(),
                kPxPerRad);
    }
    corners->push_back(chain.size());
  }
  return chain;
}

TEST(PlanarChain, SplitsWhereThePlaneChanges) {
  const Eigen::Vector3d a(-0.5, 0.1, 1), b(0.2, 0.3, 0.9), c(0.5, -0.6, 0.2), d(0.4, -0.4, -0.5);
  for (const double noise_px : {0.0, 0.2}) {
    std::vector<int> corners;
    const ChainRays chain = chainThrough({a, b, c, d}, noise_px, &corners);
    std::vector<PlanarPiece> pieces;
    splitPlanar(chain, PlanarChainOptions{}, &pieces);
    ASSERT_EQ(pieces.size(), 3U);
    const Eigen::Vector3d expected[] = {a.cross(b), b.cross(c), c.cross(d)};
    int begin = 0;
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(pieces[i].begin, begin, 8);
      EXPECT_NEAR(pieces[i].end, corners[i], 8);
      EXPECT_LE(angleBetweenPlanes(pieces[i].normal, expected[i].normalized()), 2e-3);
      EXPECT_LE(pieces[i].rms_px, 0.3);
      begin = corners[i];
    }
  }
}

TEST(PlanarChain, OutliersDoNotEndAPiece) {
  std::vector<int> corners;
  ChainRays clean = chainThrough({{-0.5, 0.1, 1}, {0.4, 0.3, 0.9}}, 0, &corners);
  ChainRays chain;
  for (int i = 0; i < clean.size(); ++i) {
    Eigen::Vector3d ray = clean.rays[static_cast<size_t>(i)];
    if (i % 50 == 30) ray = (ray + Eigen::Vector3d(0, 5 / kPxPerRad, 0)).normalized();
    chain.add(ray, kPxPerRad);
  }
  std::vector<PlanarPiece> pieces;
  splitPlanar(chain, PlanarChainOptions{}, &pieces);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_EQ(pieces[0].begin, 0);
  EXPECT_EQ(pieces[0].end, chain.size());
}

TEST(PlanarChain, ShortChainsGiveNothing) {
  std::vector<PlanarPiece> pieces(3);
  splitPlanar(ChainRays{}, PlanarChainOptions{}, &pieces);
  EXPECT_TRUE(pieces.empty());
}

}  // namespace
}  // namespace dlsd
