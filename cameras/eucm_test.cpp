#include "cameras/eucm.h"

#include <gtest/gtest.h>

#include "cameras/pinhole.h"

namespace dlsd {
namespace {

TEST(Eucm, KnownPoints) {
  // d = sqrt(4 * 9 + 64) = 10, denominator 0.6 * 10 + 0.4 * 8 = 9.2.
  const Eucm m{0.6, 4, 92, 920, 10, 20};
  const auto p = m.project(3.0, 0.0, 8.0);
  ASSERT_TRUE(p.valid);
  EXPECT_NEAR(p.u, 40, 1e-14);
  EXPECT_EQ(p.v, 20);
  const auto q = m.project(0.0, -3.0, 8.0);
  ASSERT_TRUE(q.valid);
  EXPECT_NEAR(q.v, -280, 1e-13);
  // Behind the camera: 0.6 * 10 - 0.4 * 8 = 2.8.
  const auto behind = Eucm{0.6, 4, 28, 28, 0, 0}.project(0.0, 3.0, -8.0);
  EXPECT_FALSE(behind.valid);  // 0.6 * -8 < -0.4 * 10: past the fold.
  const auto before_fold = Eucm{0.6, 4, 48, 48, 0, 0}.project(0.0, 4.0, -6.0);
  ASSERT_TRUE(before_fold.valid);  // 0.6 * 10 - 0.4 * 6 = 3.6
  EXPECT_NEAR(before_fold.v, 48 * 4 / 3.6, 1e-13);
  const auto ray = Eucm{0.6, 4, 48, 48, 0, 0}.unproject(0.0, 48 * 4 / 3.6);
  ASSERT_TRUE(ray.valid);
  EXPECT_NEAR(ray.y, 4 / std::sqrt(52), 2e-15);
  EXPECT_NEAR(ray.z, -6 / std::sqrt(52), 2e-15);
}

TEST(Eucm, AlphaZeroIsThePinholeWhateverBeta) {
  const Pinhole pinhole{100, 200, 10, 20};
  for (const double beta : {1e-3, 0.7, 1.0, 1e3}) {
    const Eucm m{0, beta, 100, 200, 10, 20};
    EXPECT_EQ(m.project(1.0, 2.0, 4.0).u, pinhole.project(1.0, 2.0, 4.0).u);
    EXPECT_EQ(m.project(1.0, 2.0, 4.0).v, pinhole.project(1.0, 2.0, 4.0).v);
    EXPECT_FALSE(m.project(1.0, 0.0, 0.0).valid);
    EXPECT_FALSE(m.project(1.0, 0.0, -1e-9).valid);
    EXPECT_EQ(m.maxFieldAngle(), M_PI / 2);
    EXPECT_TRUE(m.unproject(1e9, -1e9).valid);
  }
}

TEST(Eucm, AlphaOneIsOrthographicAndEndsAt90Degrees) {
  const Eucm m{1, 1, 100, 100, 0, 0};
  const auto p = m.project(std::sin(1.2), 0.0, std::cos(1.2));
  ASSERT_TRUE(p.valid);
  EXPECT_NEAR(p.u, 100 * std::sin(1.2), 1e-13);
  EXPECT_EQ(m.maxFieldAngle(), M_PI / 2);
  EXPECT_FALSE(m.project(1.0, 0.0, -1e-9).valid);
  EXPECT_TRUE(m.unproject(100.0, 0.0).valid);
  EXPECT_EQ(m.unproject(100.0, 0.0).z, 0);
  EXPECT_FALSE(m.unproject(100 * (1 + 1e-12), 0.0).valid);
}

TEST(Eucm, AlphaOneHalfSeesAllButBackwards) {
  for (const double beta : {0.5, 1.0, 2.0}) {
    const Eucm m{0.5, beta, 1, 1, 0, 0};
    EXPECT_EQ(m.maxFieldAngle(), M_PI);
    EXPECT_FALSE(m.project(0.0, 0.0, -1.0).valid);
    for (const double delta : {1e-2, 1e-4, 1e-6, 1e-8}) {
      // 2 r / (sqrt(beta r^2 + 1) - 1) = 2 (sqrt(beta r^2 + 1) + 1) / (beta r)
      const auto p = m.project(delta, 0.0, -1.0);
      ASSERT_TRUE(p.valid);
      const double exact = 2 * (std::sqrt(beta * delta * delta + 1) + 1) / (beta * delta);
      EXPECT_NEAR(p.u / exact, 1, 1e-15) << delta;
    }
  }
}

TEST(Eucm, BelowOneHalfTheDomainEndsWherePixelsGoToInfinity) {
  // d = 3 at (sqrt(8 / beta), 0, -1): alpha 3 = 1 - alpha.
  for (const double beta : {0.5, 1.0, 3.0}) {
    const Eucm m{0.25, beta, 100, 100, 0, 0};
    EXPECT_NEAR(m.maxFieldAngle(), std::atan2(std::sqrt(8 / beta), -1.0), 1e-15);
    const double inside = m.maxFieldAngle() * (1 - 1e-12);
    const double outside = m.maxFieldAngle() * (1 + 1e-12);
    EXPECT_TRUE(m.project(std::sin(inside - 1e-6), 0.0, std::cos(inside - 1e-6)).valid);
    EXPECT_FALSE(m.project(std::sin(outside), 0.0, std::cos(outside)).valid);
    EXPECT_TRUE(m.unproject(1e9, 1e9).valid);
  }
}

TEST(Eucm, AboveOneHalfTheImageFolds) {
  // (1 - alpha) / alpha = 1/3: the fold is at d = 3 again, m = sqrt(8 / beta) / (0.75 * 3 - 0.25).
  for (const double beta : {0.5, 1.0, 3.0}) {
    const Eucm m{0.75, beta, 100, 100, 0, 0};
    const double fold = std::atan2(std::sqrt(8 / beta), -1.0);
    const double radius = 100 * std::sqrt(8 / beta) / 2;
    EXPECT_NEAR(m.maxFieldAngle(), fold, 1e-15);
    EXPECT_TRUE(m.project(std::sin(fold * (1 - 1e-12)), 0.0, std::cos(fold * (1 - 1e-12))).valid);
    EXPECT_FALSE(m.project(std::sin(fold * (1 + 1e-12)), 0.0, std::cos(fold * (1 + 1e-12))).valid);
    EXPECT_TRUE(m.unproject(radius * (1 - 1e-12), 0.0).valid);
    EXPECT_FALSE(m.unproject(radius * (1 + 1e-12), 0.0).valid);
  }
}

}  // namespace
}  // namespace dlsd
