#include "detector/polygonal_chain.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dlsd {
namespace {

/// Points one px apart that turn by the given angles (rad) after each `length_px`.
std::vector<Eigen::Vector2d> path(const std::vector<double>& turns, int length_px) {
  std::vector<Eigen::Vector2d> points{{100, 100}};
  double heading = 0.3;
  for (size_t leg = 0; leg <= turns.size(); ++leg) {
    for (int i = 0; i < length_px; ++i) {
      points.push_back(points.back() + Eigen::Vector2d(std::cos(heading), std::sin(heading)));
    }
    if (leg < turns.size()) heading += turns[leg];
  }
  return points;
}

std::vector<ConvexGroup> groupsOf(const std::vector<Eigen::Vector2d>& points,
                                  std::vector<StraightPiece>* pieces) {
  const PolygonalChainOptions options;
  std::vector<ConvexGroup> groups;
  splitStraight(points, options, pieces);
  groupConvex(*pieces, options, &groups);
  return groups;
}

TEST(PolygonalChain, LegsBecomePieces) {
  const auto points = path({0.9, -1.1, 0.8}, 60);
  std::vector<StraightPiece> pieces;
  PolygonalChainOptions options;
  splitStraight(points, options, &pieces);
  ASSERT_EQ(pieces.size(), 4U);
  double heading = 0.3;
  const double turns[] = {0.9, -1.1, 0.8, 0};
  int previous_end = 0;
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_GE(pieces[i].begin, previous_end);
    EXPECT_NEAR(pieces[i].begin, 60.0 * static_cast<double>(i), 6);
    EXPECT_NEAR(
        pieces[i].direction.dot(Eigen::Vector2d(std::cos(heading), std::sin(heading))), 1, 1e-3);
    heading += turns[i];
    previous_end = pieces[i].end;
  }
  EXPECT_EQ(previous_end, static_cast<int>(points.size()));
}

TEST(PolygonalChain, SmoothConvexTurnsMakeOneGroup) {
  std::vector<StraightPiece> pieces;
  const auto groups = groupsOf(path({0.15, 0.15, 0.15, 0.15}, 50), &pieces);
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_EQ(groups[0].first, 0);
  EXPECT_EQ(groups[0].last, static_cast<int>(pieces.size()));
  EXPECT_GE(pieces.size(), 4U);
}

TEST(PolygonalChain, AnOppositeTurnStartsANewGroup) {
  std::vector<StraightPiece> pieces;
  const auto groups = groupsOf(path({0.15, 0.15, -0.15, -0.15}, 50), &pieces);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].last, groups[1].first);
}

TEST(PolygonalChain, ASharpTurnStartsANewGroup) {
  std::vector<StraightPiece> pieces;
  // theta = pi / 16 = 0.196
  EXPECT_EQ(groupsOf(path({0.15, 0.3, 0.15}, 50), &pieces).size(), 2U);
}

TEST(PolygonalChain, ShortOrEmptyChainsGiveNothing) {
  std::vector<StraightPiece> pieces;
  EXPECT_TRUE(groupsOf({}, &pieces).empty());
  EXPECT_TRUE(groupsOf(path({}, 5), &pieces).empty());
}

}  // namespace
}  // namespace dlsd
