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
