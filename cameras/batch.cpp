#include "cameras/batch.h"

#include <algorithm>
#include <initializer_list>
#include <stdexcept>

#define DLSD_BATCH_ISA portable
#define DLSD_BATCH_TARGET
#define DLSD_BATCH_FLAG float
#include "cameras/batch_loops.h"
#include "cameras/mutant.h"

namespace dlsd {
namespace batch {
const Build kPortable = portable::kBuild;
}

namespace {

void requireSameSize(size_t n, std::initializer_list<size_t> others) {
  for (const size_t m : others) {
    if (m != n) throw std::invalid_argument("batch arrays must all have the same length");
  }
}

const batch::Build& buildFor(Simd simd) {
  if (!simdSupported(simd)) {
    throw std::invalid_argument("this processor lacks the instruction set asked for");
  }
#ifdef __x86_64__
  if (simd == Simd::kAvx2) return batch::kAvx2;
  if (simd == Simd::kAvx512) return batch::kAvx512;
#endif
  return batch::kPortable;
}

}  // namespace

bool simdSupported(Simd simd) {
  switch (simd) {
    case Simd::kPortable:
      return true;
#ifdef __x86_64__
    case Simd::kAvx2:
      return __builtin_cpu_supports("avx2");
    case Simd::kAvx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
             __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
#endif
    default:
      return false;
  }
}

Simd widestSimd() {
  for (const Simd simd : {Simd::kAvx512, Simd::kAvx2}) {
    if (simdSupported(simd)) return simd;
  }
  return Simd::kPortable;
}

void projectAll(const Camera& camera,
                std::span<const double> x,
                std::span<const double> y,
                std::span<const double> z,
                std::span<double> u,
                std::span<double> v,
                std::span<uint8_t> valid,
                Simd simd) {
  const size_t n = x.size();
  requireSameSize(n, {y.size(), z.size(), u.size(), v.size(), valid.size()});
  buildFor(simd).in_double.project(
      camera, x.data(), y.data(), z.data(), u.data(), v.data(), valid.data(), n);
  if (DLSD_MUTANT("invalid-batch-project")) std::fill(valid.begin(), valid.end(), uint8_t{0});
}

void projectAll(const Camera& camera,
                std::span<const float> x,
                std::span<const float> y,
                std::span<const float> z,
                std::span<float> u,
                std::span<float> v,
                std::span<uint8_t> valid,
                Simd simd) {
  const size_t n = x.size();
  requireSameSize(n, {y.size(), z.size(), u.size(), v.size(), valid.size()});
  buildFor(simd).in_float.project(
      camera, x.data(), y.data(), z.data(), u.data(), v.data(), valid.data(), n);
}

void unprojectAll(const Camera& camera,
                  std::span<const double> u,
                  std::span<const double> v,
                  std::span<double> x,
                  std::span<double> y,
                  std::span<double> z,
                  std::span<uint8_t> valid,
                  Simd simd) {
  const size_t n = u.size();
  requireSameSize(n, {v.size(), x.size(), y.size(), z.size(), valid.size()});
  buildFor(simd).in_double.unproject(
      camera, u.data(), v.data(), x.data(), y.data(), z.data(), valid.data(), n);
  if (DLSD_MUTANT("invalid-batch-unproject")) std::fill(valid.begin(), valid.end(), uint8_t{0});
}

void unprojectAll(const Camera& camera,
                  std::span<const float> u,
                  std::span<const float> v,
                  std::span<float> x,
                  std::span<float> y,
                  std::span<float> z,
                  std::span<uint8_t> valid,
                  Simd simd) {
  const size_t n = u.size();
  requireSameSize(n, {v.size(), x.size(), y.size(), z.size(), valid.size()});
  buildFor(simd).in_float.unproject(
      camera, u.data(), v.data(), x.data(), y.data(), z.data(), valid.data(), n);
}

}  // namespace dlsd
