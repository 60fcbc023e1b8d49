#include "cameras/pinhole_radtan.h"

#include <gtest/gtest.h>

namespace dlsd {
namespace {

TEST(PinholeRadtan, KnownPixel) {
  const PinholeRadtan m =
      PinholeRadtan::fromParams({100, 200, 10, 20, 0.5, 0.25, 0.125, 0.0625, 0.03125});
  // At (0.5, 0): t = 0.25, R = 1 + 0.125 + 0.015625 + 0.00048828125.
  const double R = 1 + 0.125 + 0.015625 + 0.00048828125;
  const auto p = m.project(1.0, 0.0, 2.0);
  ASSERT_TRUE(p.valid);
  EXPECT_NEAR(p.u, 100 * (0.5 * R + 0.0625 * 0.75) + 10, 1e-13);
  EXPECT_NEAR(p.v, 200 * 0.125 * 0.25 + 20, 1e-13);
}

TEST(PinholeRadtan, NothingBehindTheCameraOrBeyondTheFold) {
  const PinholeRadtan m = PinholeRadtan::fromParams({100, 100, 0, 0, -1. / 3, 0, 0, 0, 0});
  EXPECT_NEAR(m.maxFieldAngle(), M_PI / 4, 1e-15);
  for (const double side : {1.0, -1.0}) {
    EXPECT_TRUE(m.project(side * (1 - 1e-12), 0.0, 1.0).valid);
    EXPECT_FALSE(m.project(side * (1 + 1e-12), 0.0, 1.0).valid);
    EXPECT_FALSE(m.project(side * 0.5, 0.0, -1.0).valid);
    EXPECT_FALSE(m.project(side * 3, 0.0, 1.0).valid);
    EXPECT_TRUE(m.unproject(side * 200 / 3 * (1 - 1e-12), 0.0).valid);
    EXPECT_FALSE(m.unproject(side * 200 / 3 * (1 + 1e-12), 0.0).valid);
  }
  const PinholeRadtan plain = PinholeRadtan::fromParams({100, 100, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(plain.maxFieldAngle(), M_PI / 2);
  EXPECT_TRUE(plain.project(1e6, 0.0, 1.0).valid);
  EXPECT_FALSE(plain.project(1.0, 0.0, 0.0).valid);
}

// A narrow lens: only the outermost corners of the image look past the fold.
TEST(PinholeRadtan, AllButTheCornersOfARealPhotographHaveARay) {
  const PinholeRadtan m = PinholeRadtan::fromParams({560.3314836257335,
                                                     561.3767078958164,
                                                     651.2626491081023,
                                                     499.0654019103108,
                                                     -0.23294918206407358,
                                                     0.06172427072793471,
                                                     -1.8042344369185743e-05,
                                                     3.396357463982982e-05,
                                                     -0.007549618066613639});
  int without = 0;
  double least = 1e9;
  for (int v = 0; v < 960; ++v) {
    for (int u = 0; u < 1280; ++u) {
      const auto ray = m.unproject(static_cast<double>(u), static_cast<double>(v));
      if (!ray.valid) {
        ++without;
        least = std::min(least, std::hypot(u - m.cx, v - m.cy));
        continue;
      }
      const auto back = m.project(ray.x, ray.y, ray.z);
      ASSERT_TRUE(back.valid) << u << " " << v;
      ASSERT_LE(std::hypot(back.u - u, back.v - v), 1e-12) << u << " " << v;
    }
  }
  // Its radius of 648 px leaves 9 % of the image out.
  EXPECT_NEAR(least, 648, 1);
  EXPECT_NEAR(without / (1280. * 960), 0.094, 0.001);
}

}  // namespace
}  // namespace dlsd
