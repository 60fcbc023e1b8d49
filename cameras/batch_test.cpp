#include "cameras/batch.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace dlsd {
namespace {

TEST(Batch, AWholeImageEqualsItsPixels) {
  // With a limit inside the image, so that both answers are many.
  const Camera camera =
      makeCamera("omni", std::vector<double>{1.4, 590.5, 589.75, 644.25, 508.5}, 1280, 1024, 1.5);
  const size_t n = size_t{1280} * 1024;
  std::vector<double> u(n), v(n), x(n), y(n), z(n), u2(n), v2(n);
  std::vector<uint8_t> valid(n, 7), valid2(n, 7);
  for (size_t i = 0; i < n; ++i) {
    u[i] = static_cast<double>(i % 1280);
    v[i] = static_cast<double>(i / 1280);
  }
  unprojectAll(camera, u, v, x, y, z, valid);
  projectAll(camera, x, y, z, u2, v2, valid2);
  size_t seen = 0;
  for (size_t i = 0; i < n; ++i) {
    const auto ray = camera.unproject({u[i], v[i]});
    ASSERT_EQ(valid[i], ray ? 1 : 0) << i;
    if (!ray) continue;
    ++seen;
    ASSERT_EQ(*ray, Eigen::Vector3d(x[i], y[i], z[i])) << i;
    const auto pixel = camera.project(*ray);
    ASSERT_EQ(valid2[i], pixel ? 1 : 0) << i;
    if (pixel) {
      ASSERT_EQ(*pixel, Eigen::Vector2d(u2[i], v2[i])) << i;
    }
  }
  EXPECT_GT(seen, n / 3);
  EXPECT_LT(seen, n * 2 / 3);
}

// Where the radial function bends the other way, the second derivative says nothing of what a step
// leaves. Cases of properties/batch_suite.cpp that were 0.0024 and 0.034 px off.
TEST(Batch, FloatsAreExactAtInflections) {
  const Camera kannala_brandt = makeCamera("kannala_brandt",
                                           std::vector<double>{2000,
                                                               1800,
                                                               1046.65,
                                                               1747.255554199219,
                                                               -0.097559526676159358,
                                                               0.0037698047235608309,
                                                               -0.00084883755807434874,
                                                               0.0034399171114631163},
                                           2327,
                                           3325);
  std::vector<float> u{545.68511962890625F}, v{-0.5F}, x(1), y(1), z(1);
  std::vector<uint8_t> valid(1);
  unprojectAll(kannala_brandt, u, v, x, y, z, valid);
  ASSERT_EQ(valid[0], 1);
  const auto back = kannala_brandt.project(Eigen::Vector3f(x[0], y[0], z[0]).cast<double>());
  ASSERT_TRUE(back.has_value());
  EXPECT_LE((*back - Eigen::Vector2d(u[0], v[0])).norm(), 1e-3);

  const Camera ocam = makeCamera("ocam",
                                 std::vector<double>{-2000,
                                                     -0.00048816606958073175,
                                                     0,
                                                     -1.7311692523946931e-08,
                                                     4.0029165426499995e-12,
                                                     8.0836545282956916e-17,
                                                     -6.6371470372759332e-21,
                                                     -1.8838935828422018e-23,
                                                     4.6528209576269347e-27,
                                                     1966.4374229063176,
                                                     1587.3802502661088,
                                                     1.0597973478939264,
                                                     0.0086273254266447646,
                                                     -0.01},
                                 3939,
                                 3075);
  x = {0.58624494F};
  y = {0.37975782F};
  z = {0.71561223F};
  projectAll(ocam, x, y, z, u, v, valid);
  ASSERT_EQ(valid[0], 1);
  const auto pixel = ocam.project(Eigen::Vector3f(x[0], y[0], z[0]).cast<double>());
  ASSERT_TRUE(pixel.has_value());
  EXPECT_LE((*pixel - Eigen::Vector2d(u[0], v[0])).norm(), 1e-3);
}

TEST(Batch, LengthsMustAgree) {
  const Camera camera = makeCamera("pinhole", std::vector<double>{1, 1, 0, 0}, 4, 4);
  std::vector<double> three(3), two(2);
  std::vector<uint8_t> three_flags(3), two_flags(2);
  EXPECT_NO_THROW(projectAll(camera, three, three, three, three, three, three_flags));
  EXPECT_THROW(projectAll(camera, three, two, three, three, three, three_flags),
               std::invalid_argument);
  EXPECT_THROW(projectAll(camera, three, three, three, three, three, two_flags),
               std::invalid_argument);
  EXPECT_THROW(unprojectAll(camera, three, three, three, three, two, three_flags),
               std::invalid_argument);
  EXPECT_THROW(unprojectAll(camera, two, three, three, three, three, three_flags),
               std::invalid_argument);
}

}  // namespace
}  // namespace dlsd
