// Counts calls of operator new in a program of its own: after the first frames detect() allocates
// nothing.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "detector/detector.h"
#include "detector/options.h"
#include "detector/test_scene.h"

namespace {
std::atomic<long> allocations{0};

void* countedAllocation(std::size_t size, std::size_t alignment) {
  ++allocations;
  void* memory = alignment > alignof(std::max_align_t)
                     ? std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment)
                     : std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
}  // namespace

void* operator new(std::size_t size) {
  return countedAllocation(size, 1);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return countedAllocation(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

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
