#include "cameras/unified_omni.h"

#include <gtest/gtest.h>

#include "cameras/pinhole.h"

namespace dlsd {
namespace {

TEST(UnifiedOmni, KnownPointsOfTheParabolicMirror) {
  const UnifiedOmni m{1, 100, 200, 10, 20};
  const auto p = m.project(3.0, 0.0, 0.0);  // m = 1 / (0 + 1)
  ASSERT_TRUE(p.valid);
  EXPECT_EQ(p.u, 110);
  EXPECT_EQ(p.v, 20);
  const auto ray = m.unproject(210.0, 20.0);  // m = 2: stereographic projection
  ASSERT_TRUE(ray.valid);
  EXPECT_NEAR(ray.x, 0.8, 2e-16);
  EXPECT_NEAR(ray.z, -0.6, 2e-16);
  EXPECT_EQ(m.maxFieldAngle(), M_PI);
  EXPECT_FALSE(m.project(0.0, 0.0, -1.0).valid);
  EXPECT_TRUE(m.project(1e-6, 0.0, -1.0).valid);
}

TEST(UnifiedOmni, TheParabolicMirrorIsExactNearItsPole) {
  const UnifiedOmni m{1, 1, 1, 0, 0};
  for (const double delta : {1e-2, 1e-4, 1e-6, 1e-8}) {
    // sin(delta) / (1 - cos(delta)) = 1 / tan(delta / 2)
    const auto p = m.project(std::sin(delta), 0.0, -std::cos(delta));
    ASSERT_TRUE(p.valid);
    EXPECT_NEAR(p.u * std::tan(delta / 2), 1, 1e-15);
  }
}

TEST(UnifiedOmni, XiZeroIsThePinhole) {
  const UnifiedOmni m{0, 100, 200, 10, 20};
  const Pinhole pinhole{100, 200, 10, 20};
  EXPECT_EQ(m.project(1.0, 2.0, 4.0).u, pinhole.project(1.0, 2.0, 4.0).u);
  EXPECT_FALSE(m.project(1.0, 0.0, 0.0).valid);
  EXPECT_FALSE(m.project(1.0, 0.0, -1e-9).valid);
  EXPECT_EQ(m.maxFieldAngle(), M_PI / 2);
  const auto ray = m.unproject(1e8, 0.0);
  ASSERT_TRUE(ray.valid);
  EXPECT_NEAR(ray.z, 1e-6, 1e-12);
}

TEST(UnifiedOmni, BelowOneTheDomainEndsWherePixelsGoToInfinity) {
  const UnifiedOmni m{0.5, 100, 100, 0, 0};  // z = -1/2: 120 degrees
  EXPECT_NEAR(m.maxFieldAngle(), 2 * M_PI / 3, 1e-15);
  const double inside = 2 * M_PI / 3 - 1e-6, outside = 2 * M_PI / 3 + 1e-12;
  EXPECT_TRUE(m.project(std::sin(inside), 0.0, std::cos(inside)).valid);
  EXPECT_FALSE(m.project(std::sin(outside), 0.0, std::cos(outside)).valid);
  EXPECT_TRUE(m.unproject(1e9, -1e9).valid);
}

TEST(UnifiedOmni, AboveOneTheImageFolds) {
  const UnifiedOmni m{2, 100, 100, 0, 0};  // z = -1/2 again; m = sin / (cos + 2) = 1 / sqrt(3)
  const double fold = 2 * M_PI / 3, radius = 100 / std::sqrt(3.0);
  EXPECT_NEAR(m.maxFieldAngle(), fold, 1e-15);
  EXPECT_TRUE(m.project(std::sin(fold * (1 - 1e-12)), 0.0, std::cos(fold * (1 - 1e-12))).valid);
  EXPECT_FALSE(m.project(std::sin(fold * (1 + 1e-12)), 0.0, std::cos(fold * (1 + 1e-12))).valid);
  EXPECT_TRUE(m.unproject(radius * (1 - 1e-12), 0.0).valid);
  EXPECT_FALSE(m.unproject(radius * (1 + 1e-12), 0.0).valid);
}

TEST(UnifiedOmni, ExtremeXi) {
  const UnifiedOmni m{1e3, 1e6, 1e6, 0, 0};
  EXPECT_NEAR(m.maxFieldAngle(), M_PI / 2 + 1e-3, 1e-9);
  for (const double theta : {1e-9, 0.1, 1.0, 1.5, 1.57}) {
    const auto p = m.project(0.0, std::sin(theta), std::cos(theta));
    ASSERT_TRUE(p.valid);
    const auto ray = m.unproject(p.u, p.v);
    ASSERT_TRUE(ray.valid);
    EXPECT_NEAR(std::atan2(ray.y, ray.z), theta, 1e-13 + 2e-16 / std::cos(theta));
  }
  for (const double near_one : {1 - 1e-12, 1 - 1e-16, 1 + 3e-16, 1 + 1e-12}) {
    const UnifiedOmni n{near_one, 1, 1, 0, 0};
    EXPECT_NEAR(n.maxFieldAngle(), M_PI, 2e-6);
    EXPECT_TRUE(n.project(1.0, 0.0, -1e5).valid) << near_one;
  }
}

}  // namespace
}  // namespace dlsd
