#include "detector/usable_mask.h"

#include <gtest/gtest.h>

#include "detector/test_scene.h"

namespace dlsd {
namespace {

TEST(UsableMask, UsableIsWhatKeepsClearOfBorderAndRim) {
  for (const auto& [name, camera] : test::testCameras(20)) {
    const UsableMask mask(camera);
    const int w = camera.width(), h = camera.height();
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        bool expected = x >= 2 && y >= 2 && x < w - 2 && y < h - 2;
        for (int j = 0; j < h && expected; ++j) {
          for (int i = 0; i < w && expected; ++i) {
            if ((i - x) * (i - x) + (j - y) * (j - y) > 25) continue;
            expected = camera.unproject({double(i), double(j)}).has_value();
          }
        }
        ASSERT_EQ(mask.bits().contains(x, y), expected) << name << " " << x << " " << y;
      }
    }
  }
}

TEST(UsableMask, TinyImagesHaveNoUsablePixel) {
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 9}, {9, 1}, {2, 2}, {3, 3}, {4, 4}}) {
    const UsableMask mask(makeCamera("pinhole", std::array{10.0, 10.0, 1.0, 1.0}, w, h));
    for (const uint64_t word : mask.bits().words) EXPECT_EQ(word, 0U);
  }
}

TEST(BitRows, BoundsHoldAllThatIsSet) {
  uint64_t k = 0;
  const auto below = [&](int n) { return static_cast<int>(n * test::uniform(7, k++)); };
  for (int i = 0; i < 2000; ++i) {
    BitRows bits(1 + below(200), 1 + below(9));
    PixelBox expected{bits.width, bits.height, 0, 0};
    const int count = below(4);
    for (int n = 0; n < count; ++n) {
      const int x = below(bits.width), y = below(bits.height);
      bits.set(x, y);
      expected = {std::min(expected.x0, x),
                  std::min(expected.y0, y),
                  std::max(expected.x1, x + 1),
                  std::max(expected.y1, y + 1)};
    }
    if (count == 0) expected = {};
    const PixelBox box = bits.bounds();
    ASSERT_EQ((std::array{box.x0, box.y0, box.x1, box.y1}),
              (std::array{expected.x0, expected.y0, expected.x1, expected.y1}))
        << bits.width << " x " << bits.height;
  }
}

}  // namespace
}  // namespace dlsd
