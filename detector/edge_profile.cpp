#include "detector/edge_profile.h"

#include <algorithm>
#include <cmath>

#if defined(__x86_64__) && defined(__GNUC__)
#define DLSD_HAVE_AVX2_KERNELS
#include <immintrin.h>
#endif

namespace dlsd {
namespace {

constexpr int kTaps = EdgeProfiler::kTaps;
constexpr int kCentreTap = 7;
/// From here on the filters are tapered off to 0 at the last tap: what is cut off would depend on
/// the phase.
constexpr double kTaperFrom = 3;
/// The largest tap. Sums over 16 taps of 12-bit pixels stay below 2^31.
constexpr double kKernelMax = 30000;

template <class T>
void rowSumsPortable(const T* pixels, const EdgeProfiler::Kernels& kernels, int32_t* sums) {
  for (int k = 0; k < 4; ++k) {
    int32_t sum = 0;
    for (int i = 0; i < kTaps; ++i) {
      sum += static_cast<int32_t>(pixels[i]) * kernels.taps[k][i];
    }
    sums[k] = sum;
  }
}

#ifdef DLSD_HAVE_AVX2_KERNELS
#define DLSD_AVX2 __attribute__((target("avx2")))

DLSD_AVX2 inline void rowSumsOf(__m256i pixels,
                                const EdgeProfiler::Kernels& kernels,
                                int32_t* sums) {
  const auto product = [&](int k) __attribute__((target("avx2"))) {
    return _mm256_madd_epi16(pixels,
                             _mm256_load_si256(reinterpret_cast<const __m256i*>(kernels.taps[k])));
  };
  const __m256i all = _mm256_hadd_epi32(_mm256_hadd_epi32(product(0), product(1)),
                                        _mm256_hadd_epi32(product(2), product(3)));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(sums),
                   _mm_add_epi32(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1)));
}
DLSD_AVX2 void rowSums8Avx2(const uint8_t* pixels,
                            const EdgeProfiler::Kernels& kernels,
                            int32_t* sums) {
  rowSumsOf(_mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(pixels))),
            kernels,
            sums);
}
DLSD_AVX2 void rowSums16Avx2(const uint16_t* pixels,
                             const EdgeProfiler::Kernels& kernels,
                             int32_t* sums) {
  rowSumsOf(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(pixels)), kernels, sums);
}
#endif

}  // namespace

EdgeProfiler::EdgeProfiler() : row_sums_8_(rowSumsPortable), row_sums_16_(rowSumsPortable) {
#ifdef DLSD_HAVE_AVX2_KERNELS
  if (__builtin_cpu_supports("avx2") != 0) {
    row_sums_8_ = rowSums8Avx2;
    row_sums_16_ = rowSums16Avx2;
  }
#endif
  const double sigmas[2] = {kNarrowPx, kWidePx};
  for (size_t width = 0; width < 2; ++width) {
    const double s2 = sigmas[width] * sigmas[width];
    // A window that is 0 beyond the taps at every phase, and the constant that leaves the second
    // derivative without a mean.
    const auto bell = [&](double t) {
      const double beyond =
          std::clamp((std::abs(t) - kTaperFrom) / (kCentreTap - kTaperFrom), 0.0, 1.0);
      return std::exp(-0.5 * t * t / s2) * 0.5 * (1 + std::cos(M_PI * beyond));
    };
    double sum = 0, sum_squares = 0;
    for (int i = -kCentreTap * kPhases; i <= kCentreTap * kPhases; ++i) {
      const double t = static_cast<double>(i) / kPhases;
      sum += bell(t);
      sum_squares += bell(t) * t * t / s2;
    }
    // Largest value of t exp(-t^2 / 2s^2): s / sqrt(e).
    const double odd_scale = kKernelMax / (sigmas[width] * std::exp(-0.5));
    // Responses to a step of one grey level, of the second derivative by its change with the
    // step's position, and to shading of one grey level per px.
    double odd_step = 0, even_step = 0, odd_ramp = 0;
    for (int i = -kCentreTap * kPhases; i <= kCentreTap * kPhases; ++i) {
      const double t = static_cast<double>(i) / kPhases;
      const double odd = odd_scale * t * bell(t);
      const double even = -kKernelMax * (sum_squares / sum - t * t / s2) * bell(t);
      odd_step += odd * 0.5 * std::erfc(-t / std::sqrt(2 * kBlurVariance)) / kPhases;
      even_step -= even * std::exp(-0.5 * t * t / kBlurVariance) /
                   std::sqrt(2 * M_PI * kBlurVariance) / kPhases;
      odd_ramp += odd * t / kPhases;
    }
    scale_[2 * width] = static_cast<float>(1 / odd_step);
    scale_[2 * width + 1] = static_cast<float>(1 / even_step);
    (width == 0 ? ramp_.odd_narrow : ramp_.odd_wide) = static_cast<float>(odd_ramp / odd_step);
    for (int phase = 0; phase < kPhases; ++phase) {
      auto& odd = kernels_[static_cast<size_t>(phase)].taps[2 * width];
      auto& even = kernels_[static_cast<size_t>(phase)].taps[2 * width + 1];
      int odd_sum = 0, even_sum = 0;
      for (int i = 0; i < kTaps; ++i) {
        const double t = i - kCentreTap - static_cast<double>(phase) / kPhases;
        odd[i] = static_cast<int16_t>(std::lround(odd_scale * t * bell(t)));
        even[i] = static_cast<int16_t>(
            std::lround(-kKernelMax * (sum_squares / sum - t * t / s2) * bell(t)));
        odd_sum += odd[i];
        even_sum += even[i];
      }
      // No response at all to a constant grey level.
      odd[kCentreTap] = static_cast<int16_t>(odd[kCentreTap] - odd_sum);
      even[kCentreTap] = static_cast<int16_t>(even[kCentreTap] - even_sum);
    }
  }
  const auto norm = [&](size_t k) {
    float sum = 0;
    for (const int16_t tap : kernels_[0].taps[k])
      sum += static_cast<float>(tap) * static_cast<float>(tap);
    return std::sqrt(sum) * scale_[k];
  };
  white_noise_ = {norm(0), norm(1), norm(2), norm(3)};
}

template <class T>
void EdgeProfiler::measureTyped(const T* data,
                                const EdgeWindow& window,
                                std::array<std::array<int32_t, 4>, kRows>* sums) const {
  const int rows = window.crosses_rows ? pixels_.height : pixels_.width;
  const int columns = window.crosses_rows ? pixels_.width : pixels_.height;
  const ptrdiff_t row_stride = window.crosses_rows ? pixels_.stride : 1;
  const ptrdiff_t column_stride = window.crosses_rows ? 1 : pixels_.stride;
  std::array<std::array<T, kTaps>, kRows> copies;
  std::array<const T*, kRows> from{};
  std::array<size_t, kRows> phases{};
  const double first = window.across - 3.5 * window.slope;
  for (int i = 0; i < kRows; ++i) {
    const size_t k = static_cast<size_t>(i);
    const int row = window.first_row + i;
    if (row < 0 || row >= rows) continue;
    const int position = static_cast<int>(std::floor((first + i * window.slope) * kPhases + 0.5));
    const int base = position >> 6;
    static_assert(kPhases == 1 << 6);
    phases[k] = static_cast<size_t>(position & (kPhases - 1));
    const int begin = base - kCentreTap;
    const T* line = data + row * row_stride;
    if (begin >= 0 && begin + kTaps <= columns) {
      if (column_stride == 1) {
        from[k] = line + begin;
        continue;
      }
      const T* source = line + begin * column_stride;
      for (int tap = 0; tap < kTaps; ++tap, source += column_stride) {
        copies[k][static_cast<size_t>(tap)] = *source;
      }
    } else {
      for (int tap = 0; tap < kTaps; ++tap) {
        const int column = std::clamp(begin + tap, 0, columns - 1);
        copies[k][static_cast<size_t>(tap)] = line[column * column_stride];
      }
    }
    from[k] = copies[k].data();
  }
  for (size_t k = 0; k < kRows; ++k) {
    if (from[k] == nullptr) {
      (*sums)[k] = {};
    } else if constexpr (sizeof(T) == 1) {
      row_sums_8_(from[k], kernels_[phases[k]], (*sums)[k].data());
    } else {
      row_sums_16_(from[k], kernels_[phases[k]], (*sums)[k].data());
    }
  }
}

void EdgeProfiler::measure(const EdgeWindow& window,
                           std::array<EdgeResponse, kRows>* responses) const {
  std::array<std::array<int32_t, 4>, kRows> sums;
  float unit = 1;
  if (pixels_.u8 != nullptr) {
    measureTyped(pixels_.u8, window, &sums);
  } else {
    measureTyped(pixels_.fixed, window, &sums);
    unit = 1.0F / kGreyUnit;
  }
  // The positions were rounded to the filters' phases: moved back, to first order.
  const double first = window.across - 3.5 * window.slope;
  for (int i = 0; i < kRows; ++i) {
    const auto& s = sums[static_cast<size_t>(i)];
    EdgeResponse& r = (*responses)[static_cast<size_t>(i)];
    r.odd_narrow = static_cast<float>(s[0]) * scale_[0] * unit;
    r.even_narrow = static_cast<float>(s[1]) * scale_[1] * unit;
    r.odd_wide = static_cast<float>(s[2]) * scale_[2] * unit;
    r.even_wide = static_cast<float>(s[3]) * scale_[3] * unit;
    const double exact = (first + i * window.slope) * kPhases;
    const auto rounding = static_cast<float>((std::floor(exact + 0.5) - exact) * (1.0 / kPhases));
    r.even_narrow += rounding * r.odd_narrow;
    r.even_wide += rounding * r.odd_wide;
  }
}

}  // namespace dlsd
