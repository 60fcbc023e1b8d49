#pragma once
// The loops of batch.h, not installed. Included by one source file for each instruction set, which
// defines before
//
//   DLSD_BATCH_ISA     the namespace of this build
//   DLSD_BATCH_TARGET  the attribute that selects the instruction set
//   DLSD_BATCH_FLAG    the type of a validity flag inside a loop over doubles
//
// Only functions of that namespace carry the attribute; what is inlined into them takes it over,
// and what is not is code for any processor. So no inline function of another header exists in two
// builds among which the linker could choose the wrong one, as it would with -mavx2 for a file.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <variant>

#include "cameras/camera.h"
#include "cameras/mutant.h"

#ifdef __clang__
#pragma clang diagnostic ignored "-Wpass-failed"  // Models with branches stay scalar.
#define DLSD_BATCH_LOOP _Pragma("clang loop vectorize(enable) interleave_count(4)")
#else
#define DLSD_BATCH_LOOP _Pragma("GCC ivdep")
#endif

namespace dlsd::batch {

/// One instruction set's functions; arrays of length n that do not overlap.
template <class T>
struct Functions {
  void (*project)(const Camera& camera,
                  const T* x,
                  const T* y,
                  const T* z,
                  T* u,
                  T* v,
                  uint8_t* valid,
                  size_t n);
  void (*unproject)(
      const Camera& camera, const T* u, const T* v, T* x, T* y, T* z, uint8_t* valid, size_t n);
};

/// What each of the source files defines.
struct Build {
  Functions<float> in_float;
  Functions<double> in_double;
};
extern const Build kPortable;
#ifdef __x86_64__
extern const Build kAvx2, kAvx512;
#endif

namespace DLSD_BATCH_ISA {

/// Points of a block, which stays in the first-level cache from one loop to the next.
inline constexpr size_t kBlock = 512;

/// Compilers interleave as many vectors of T as fit between the sizes of T and of the flag; the
/// kernels are long chains of operations that wait for each other, so that this is worth a factor.
template <class T>
using Flag = std::conditional_t<std::is_same_v<T, float>, uint8_t, DLSD_BATCH_FLAG>;
enum : uint8_t { kInvalid, kValid, kUnsettled };

// Answers are bound to references: gcc 12 keeps small named ones in memory, and vectorises nothing.

template <class M, class T>
DLSD_BATCH_TARGET void projectBlock(const M& model,
                                    const T* __restrict x,
                                    const T* __restrict y,
                                    const T* __restrict z,
                                    T* __restrict u,
                                    T* __restrict v,
                                    uint8_t* __restrict valid,
                                    size_t n) {
  const M m = model;  // A copy that no store through a pointer can change.
  Flag<T> flag[kBlock];
  if constexpr (requires { m.attemptProject(x[0], y[0], z[0]); }) {
    DLSD_BATCH_LOOP
    for (size_t i = 0; i < n; ++i) {
      const Attempt<Pixel<T>>& p = m.attemptProject(x[i], y[i], z[i]);
      u[i] = p.u;
      v[i] = p.v;
      const Flag<T> answer = p.valid ? Flag<T>(kValid) : Flag<T>(kInvalid);
      flag[i] = p.settled ? answer : Flag<T>(kUnsettled);
    }
    for (size_t i = 0; i < n; ++i) valid[i] = static_cast<uint8_t>(flag[i]);
    for (size_t i = 0; i < n; ++i) {
      if (valid[i] != kUnsettled) continue;
      const Pixel<T> p = m.project(x[i], y[i], z[i]);
      u[i] = p.u;
      v[i] = p.v;
      valid[i] = p.valid ? kValid : kInvalid;
    }
  } else {
    DLSD_BATCH_LOOP
    for (size_t i = 0; i < n; ++i) {
      const Pixel<T>& p = m.project(x[i], y[i], z[i]);
      u[i] = p.u;
      v[i] = p.v;
      flag[i] = p.valid ? Flag<T>(kValid) : Flag<T>(kInvalid);
    }
    for (size_t i = 0; i < n; ++i) valid[i] = static_cast<uint8_t>(flag[i]);
  }
}

template <class M, class T>
DLSD_BATCH_TARGET void unprojectBlock(const M& model,
                                      const T* __restrict u,
                                      const T* __restrict v,
                                      T* __restrict x,
                                      T* __restrict y,
                                      T* __restrict z,
                                      uint8_t* __restrict valid,
                                      size_t n) {
  const M m = model;
  Flag<T> flag[kBlock];
  if constexpr (requires { m.attemptUnproject(u[0], v[0]); }) {
    DLSD_BATCH_LOOP
    for (size_t i = 0; i < n; ++i) {
      const Attempt<Ray<T>>& ray = m.attemptUnproject(u[i], v[i]);
      x[i] = ray.x;
      y[i] = ray.y;
      z[i] = ray.z;
      const Flag<T> answer = ray.valid ? Flag<T>(kValid) : Flag<T>(kInvalid);
      flag[i] = ray.settled ? answer : Flag<T>(kUnsettled);
    }
    for (size_t i = 0; i < n; ++i) valid[i] = static_cast<uint8_t>(flag[i]);
    for (size_t i = 0; i < n; ++i) {
      if (valid[i] != kUnsettled) continue;
      if (DLSD_MUTANT("batch-unsettled")) {
        valid[i] = kInvalid;
        continue;
      }
      const Ray<T> ray = m.unproject(u[i], v[i]);
      x[i] = ray.x;
      y[i] = ray.y;
      z[i] = ray.z;
      valid[i] = ray.valid ? kValid : kInvalid;
    }
  } else {
    DLSD_BATCH_LOOP
    for (size_t i = 0; i < n; ++i) {
      const Ray<T>& ray = m.unproject(u[i], v[i]);
      x[i] = ray.x;
      y[i] = ray.y;
      z[i] = ray.z;
      flag[i] = ray.valid ? Flag<T>(kValid) : Flag<T>(kInvalid);
    }
    for (size_t i = 0; i < n; ++i) valid[i] = static_cast<uint8_t>(flag[i]);
  }
}

template <class T>
DLSD_BATCH_TARGET void limitBlock(const FieldAngleLimit limit,
                                  const T* __restrict x,
                                  const T* __restrict y,
                                  const T* __restrict z,
                                  uint8_t* __restrict valid,
                                  size_t n) {
  DLSD_BATCH_LOOP
  for (size_t i = 0; i < n; ++i) {
    const uint8_t inside = limit.admits(x[i], y[i], z[i]) ? kValid : kInvalid;
    valid[i] = static_cast<uint8_t>(valid[i] & inside);
  }
}

template <class T>
void project(const Camera& camera,
             const T* x,
             const T* y,
             const T* z,
             T* u,
             T* v,
             uint8_t* valid,
             size_t n) {
  const bool limited = camera.maxFieldAngleLimit() < M_PI;
  std::visit(
      [&](const auto& m) {
        for (size_t i = 0; i < n; i += kBlock) {
          size_t count = std::min(kBlock, n - i);
          if (DLSD_MUTANT("batch-tail") && count % 8 == 7) --count;
          projectBlock(m, x + i, y + i, z + i, u + i, v + i, valid + i, count);
          if (limited) limitBlock(camera.angleLimit(), x + i, y + i, z + i, valid + i, count);
        }
      },
      camera.model());
}

template <class T>
void unproject(
    const Camera& camera, const T* u, const T* v, T* x, T* y, T* z, uint8_t* valid, size_t n) {
  const bool limited = camera.maxFieldAngleLimit() < M_PI;
  std::visit(
      [&](const auto& m) {
        for (size_t i = 0; i < n; i += kBlock) {
          const size_t count = std::min(kBlock, n - i);
          unprojectBlock(m, u + i, v + i, x + i, y + i, z + i, valid + i, count);
          if (limited) limitBlock(camera.angleLimit(), x + i, y + i, z + i, valid + i, count);
        }
      },
      camera.model());
}

inline constexpr Build kBuild{{&project<float>, &unproject<float>},
                              {&project<double>, &unproject<double>}};

}  // namespace DLSD_BATCH_ISA
}  // namespace dlsd::batch
