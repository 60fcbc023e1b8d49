// Counts calls of operator new in a program of its own: after the first frames detect() allocates
// nothing.

#include <gtest/gtest.h>

#include "detector/detector.h"
#include "detector/options.h"
#include "detector/test_scene.h"
#include "tests/allocation_counter.h"

namespace dlsd {
namespace {

TEST(Allocation, NoneAfterTheFirstFrame) {
  const Camera camera = test::testCameras()[2].camera;
  const auto image = test::toU8(test::render(test::randomScene(1, 9, 3, 1.7), camera), 3, 2);
  for (const auto& options : {DetectorOptions{}, DetectorOptions::paper()}) {
    Detector detector(camera, options);
    const long before_first = allocations;
    const size_t count = detector.detect(test::viewOf(image, camera)).size();
    EXPECT_GT(allocations, before_first);  // the counter counts
    EXPECT_GT(count, 5U);
    const long before = allocations;
    for (int i = 0; i < 5; ++i) (void)detector.detect(test::viewOf(image, camera));
    EXPECT_EQ(allocations - before, 0);
  }
}

}  // namespace
}  // namespace dlsd
