// Batches allocate nothing, whatever the model, the build and the length.

#include <gtest/gtest.h>

#include <variant>
#include <vector>

#include "cameras/batch.h"
#include "tests/allocation_counter.h"

namespace dlsd {
namespace {

template <class T>
void expectNoAllocation(const Camera& camera, size_t n) {
  // Over the bounds of the domain and far beyond, so that iterations run, too.
  std::vector<T> x(n), y(n), z(n), u(n), v(n);
  std::vector<uint8_t> valid(n);
  for (size_t i = 0; i < n; ++i) {
    const T angle = static_cast<T>(M_PI * static_cast<double>(i) / static_cast<double>(n));
    x[i] = std::sin(angle);
    z[i] = std::cos(angle);
    u[i] = static_cast<T>(2000 * (static_cast<double>(i) / static_cast<double>(n) - 0.5));
  }
  const std::span<const T> cx = x, cy = y, cz = z, cu = u, cv = v;
  const std::span<T> mx = x, my = y, mz = z, mu = u, mv = v;
  for (const Simd simd : {Simd::kPortable, Simd::kAvx2, Simd::kAvx512}) {
    if (!simdSupported(simd)) continue;
    const long before = allocations;
    unprojectAll(camera, cu, cv, mx, my, mz, valid, simd);
    projectAll(camera, cx, cy, cz, mu, mv, valid, simd);
    EXPECT_EQ(allocations - before, 0) << camera.modelName();
  }
}

template <class V>
struct ForModels;
template <class... Ms>
struct ForModels<std::variant<Ms...>> {
  template <class Body>
  static void run(const Body& body) {
    (body(Ms()), ...);
  }
};

TEST(Allocation, NoneInBatches) {
  const long before = allocations;
  int models = 0;
  ForModels<CameraModelVariant>::run([&](const auto& model) {
    ++models;
    for (const double limit : {1.5, M_PI}) {
      const Camera camera(model, 640, 480, limit);
      for (const size_t n : {size_t{1}, size_t{1000}, size_t{5000}}) {
        expectNoAllocation<double>(camera, n);
        expectNoAllocation<float>(camera, n);
      }
    }
  });
  // One with a fold, where the fixed number of steps does not arrive.
  const Camera folded(KannalaBrandt::fromParams({300, 300, 0, 0, -0.2, 0, 0, 0}), 640, 480);
  expectNoAllocation<double>(folded, 5000);
  EXPECT_GE(models, 4);
  EXPECT_GT(allocations, before);  // the counter counts
}

}  // namespace
}  // namespace dlsd
