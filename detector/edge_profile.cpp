#include "detector/edge_profile.h"

#include <algorithm>
#include <cmath>

#if defined(__x86_64__) && defined(__GNUC__)
#define DLSD_HAVE_AVX2_KERNELS
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
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
/// The same of the wide even filter.
constexpr double kWideEvenTaperFrom = 4;

double taper(double t, double from) {
  const double beyond = std::clamp((std::abs(t) - from) / (kCentreTap - from), 0.0, 1.0);
  return 0.5 * (1 + std::cos(M_PI * beyond));
}

/// Integration over the taps, fine against every blur.
constexpr int kIntegrationSteps = 64;

/// Response of an odd filter to a step of one grey level through a blur.
template <class Filter>
double oddStep(const Filter& odd, double variance) {
  double sum = 0;
  for (int i = -kCentreTap * kIntegrationSteps; i <= kCentreTap * kIntegrationSteps; ++i) {
    const double t = static_cast<double>(i) / kIntegrationSteps;
    sum += odd(t) * 0.5 * std::erfc(-t / std::sqrt(2 * variance)) / kIntegrationSteps;
  }
  return sum;
}

/// Change of an even filter's response to the same with the step's position.
template <class Filter>
double evenSlope(const Filter& even, double variance) {
  double sum = 0;
  for (int i = -kCentreTap * kIntegrationSteps; i <= kCentreTap * kIntegrationSteps; ++i) {
    const double t = static_cast<double>(i) / kIntegrationSteps;
    sum -= even(t) * std::exp(-0.5 * t * t / variance) / std::sqrt(2 * M_PI * variance) /
           kIntegrationSteps;
  }
  return sum;
}

template <class T>
void measurePortable(const EdgeProfiler::Rows<T>& rows,
                     const EdgeProfiler::Kernels* kernels,
                     const std::array<float, 4>& scale,
                     EdgeResponse* responses) {
  for (size_t row = 0; row < EdgeProfiler::kRows; ++row) {
    const EdgeProfiler::Kernels& its_kernels = kernels[rows.phases[row]];
    std::array<float, 4> response;
    for (size_t k = 0; k < 4; ++k) {
      int32_t sum = 0;
      for (size_t i = 0; i < kTaps; ++i) {
        sum += static_cast<int32_t>(rows.pixels[row][i]) * its_kernels.tap(k, i);
      }
      response[k] = static_cast<float>(sum) * scale[k];
    }
    // The positions were rounded to the filters' phases: moved back, to first order.
    const float rounding = rows.rounding_px[row];
    responses[row] = {response[0],
                      response[1] + rounding * response[0],
                      response[2],
                      response[3] + rounding * response[2]};
  }
}

#ifdef DLSD_HAVE_AVX2_KERNELS
#define DLSD_AVX2 __attribute__((target("avx2")))

DLSD_AVX2 inline __m256i load16(const uint8_t* pixels) {
  return _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(pixels)));
}
DLSD_AVX2 inline __m256i load16(const uint16_t* pixels) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(pixels));
}
template <class T>
DLSD_AVX2 void measureAvx2(const EdgeProfiler::Rows<T>& rows,
                           const EdgeProfiler::Kernels* kernels,
                           const std::array<float, 4>& scale,
                           EdgeResponse* responses) {
  const __m128 unit = _mm_load_ps(scale.data());
  for (size_t row = 0; row < EdgeProfiler::kRows; ++row) {
    const auto* taps = reinterpret_cast<const __m256i*>(kernels[rows.phases[row]].taps);
    const __m256i pixels = load16(rows.pixels[row]);
    // Two pixels for each of the four filters, in both halves.
    const __m256i sum01 =
        _mm256_add_epi32(_mm256_madd_epi16(_mm256_shuffle_epi32(pixels, 0x00), taps[0]),
                         _mm256_madd_epi16(_mm256_shuffle_epi32(pixels, 0x55), taps[1]));
    const __m256i sum23 =
        _mm256_add_epi32(_mm256_madd_epi16(_mm256_shuffle_epi32(pixels, 0xaa), taps[2]),
                         _mm256_madd_epi16(_mm256_shuffle_epi32(pixels, 0xff), taps[3]));
    const __m256i all = _mm256_add_epi32(sum01, sum23);
    const __m128i sums =
        _mm_add_epi32(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
    const __m128 response = _mm_mul_ps(_mm_cvtepi32_ps(sums), unit);
    // Odd responses in place of even ones, 0 in place of odd ones.
    const __m128 odd = _mm_castsi128_ps(_mm_slli_epi64(_mm_castps_si128(response), 32));
    const __m128 rounding = _mm_set1_ps(rows.rounding_px[row]);
    _mm_store_ps(&responses[row].odd_narrow, _mm_add_ps(response, _mm_mul_ps(rounding, odd)));
  }
}
#endif

#ifdef __SSE2__
/// Rows become columns: 8 x 8 bytes from `from` on; column k goes to to + k * to_stride.
void transpose8x8(const uint8_t* from, ptrdiff_t stride, uint8_t* to, ptrdiff_t to_stride) {
  const auto row = [&](int i) {
    return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(from + i * stride));
  };
  const __m128i a01 = _mm_unpacklo_epi8(row(0), row(1)), a23 = _mm_unpacklo_epi8(row(2), row(3));
  const __m128i a45 = _mm_unpacklo_epi8(row(4), row(5)), a67 = _mm_unpacklo_epi8(row(6), row(7));
  const __m128i b0 = _mm_unpacklo_epi16(a01, a23), b1 = _mm_unpackhi_epi16(a01, a23);
  const __m128i b2 = _mm_unpacklo_epi16(a45, a67), b3 = _mm_unpackhi_epi16(a45, a67);
  const auto store = [&](int k, __m128i two) {
    _mm_storel_epi64(reinterpret_cast<__m128i*>(to + k * to_stride), two);
    _mm_storel_epi64(reinterpret_cast<__m128i*>(to + (k + 1) * to_stride),
                     _mm_unpackhi_epi64(two, two));
  };
  store(0, _mm_unpacklo_epi32(b0, b2));
  store(2, _mm_unpackhi_epi32(b0, b2));
  store(4, _mm_unpacklo_epi32(b1, b3));
  store(6, _mm_unpackhi_epi32(b1, b3));
}
#endif

/// Ratio of the variances of neighbouring blurs in the tables, and its logarithm.
constexpr double kShapeStep = 1.32, kLogShapeStep = 0.27763173659827955;
double shapeVariance(size_t i) {
  return EdgeProfiler::kLeastVariance * std::pow(kShapeStep, static_cast<double>(i));
}

/// Taps of a filter whose middle is phase / kPhases behind the centre tap.
template <class Filter>
void setTaps(const Filter& filter, size_t phase, size_t k, EdgeProfiler::Kernels* kernels) {
  int sum = 0;
  for (size_t i = 0; i < kTaps; ++i) {
    const double t =
        static_cast<double>(i) - kCentreTap - static_cast<double>(phase) / EdgeProfiler::kPhases;
    kernels->tap(k, i) = static_cast<int16_t>(std::lround(filter(t)));
    sum += kernels->tap(k, i);
  }
  // No response at all to a constant grey level.
  int16_t& centre = kernels->tap(k, kCentreTap);
  centre = static_cast<int16_t>(centre - sum);
}

}  // namespace

const EdgeProfiler& EdgeProfiler::computed() {
  static const EdgeProfiler profiler{Compute{}};
  return profiler;
}

EdgeProfiler::EdgeProfiler(Compute)
    : measure_8_(measurePortable<uint8_t>), measure_16_(measurePortable<uint16_t>) {
#ifdef DLSD_HAVE_AVX2_KERNELS
  if (__builtin_cpu_supports("avx2") != 0) {
    measure_8_ = measureAvx2<uint8_t>;
    measure_16_ = measureAvx2<uint16_t>;
  }
#endif
  const double sigmas[2] = {kNarrowPx, kWidePx};
  constexpr int kFine = static_cast<int>(kPhases);
  // Responses to a step of one grey level through each blur, of the even ones their change with the
  // step's position.
  std::array<std::array<double, kShapes>, 4> steps{};
  for (size_t width = 0; width < 2; ++width) {
    const double s2 = sigmas[width] * sigmas[width];
    // A window that is 0 beyond the taps at every phase, and what leaves the even filter without a
    // mean: the constant of the second derivative, or the window.
    const auto bell = [&](double t) { return std::exp(-0.5 * t * t / s2) * taper(t, kTaperFrom); };
    const auto evenBell = [&](double t) {
      return width == 0 ? bell(t)
                        : std::exp(-0.5 * t * t / kWideEvenVariance) * taper(t, kWideEvenTaperFrom);
    };
    const auto without = [&](double t) {
      return width == 0 ? bell(t) * t * t / s2 : taper(t, kWideEvenTaperFrom);
    };
    double sum = 0, sum_without = 0;
    for (int i = -kCentreTap * kFine; i <= kCentreTap * kFine; ++i) {
      const double t = static_cast<double>(i) / kFine;
      sum += evenBell(t);
      sum_without += without(t);
    }
    // Largest value of t exp(-t^2 / 2s^2): s / sqrt(e).
    const double odd_scale = kKernelMax / (sigmas[width] * std::exp(-0.5));
    const auto odd = [&](double t) { return odd_scale * t * bell(t); };
    const double share = sum / sum_without;
    // The narrow one the other way round: 1 is its largest value, too.
    const double even_scale = kKernelMax / (width == 0 ? share : 1 - share);
    const auto even = [&](double t) { return even_scale * (share * without(t) - evenBell(t)); };
    const double odd_step = oddStep(odd, kBlurVariance), even_step = evenSlope(even, kBlurVariance);
    double odd_ramp = 0;
    for (int i = -kCentreTap * kFine; i <= kCentreTap * kFine; ++i) {
      const double t = static_cast<double>(i) / kFine;
      odd_ramp += odd(t) * t / kFine;
    }
    scale_[2 * width] = static_cast<float>(1 / odd_step);
    scale_[2 * width + 1] = static_cast<float>(1 / even_step);
    (width == 0 ? ramp_.odd_narrow : ramp_.odd_wide) = static_cast<float>(odd_ramp / odd_step);
    for (size_t i = 0; i < kShapes; ++i) {
      steps[2 * width][i] = oddStep(odd, shapeVariance(i)) / odd_step;
      steps[2 * width + 1][i] = evenSlope(even, shapeVariance(i)) / even_step;
    }
    for (size_t phase = 0; phase < kPhases; ++phase) {
      setTaps(odd, phase, 2 * width, &kernels_[phase]);
      setTaps(even, phase, 2 * width + 1, &kernels_[phase]);
    }
  }
  const auto norm = [&](size_t k) {
    double sum = 0;
    for (size_t i = 0; i < kTaps; ++i) {
      const double tap = kernels_[0].tap(k, i);
      sum += tap * tap;
    }
    return static_cast<float>(std::sqrt(sum));
  };
  white_noise_ = {
      norm(0) * scale_[0], norm(1) * scale_[1], norm(2) * scale_[2], norm(3) * scale_[3]};
  for (size_t i = 0; i < kShapes; ++i) {
    ratio_[i] = static_cast<float>(steps[0][i] / steps[2][i]);
    narrow_gain_[i] = static_cast<float>(steps[0][i] / steps[1][i]);
    wide_gain_[i] = static_cast<float>(steps[2][i] / steps[3][i]);
  }
}

double EdgeProfiler::blurVariance(double narrow_over_wide) const {
  const auto ratio = static_cast<float>(narrow_over_wide);
  size_t i = 0;
  while (i + 2 < kShapes && ratio_[i + 1] > ratio) ++i;
  const float t = std::clamp((ratio_[i] - ratio) / (ratio_[i] - ratio_[i + 1]), 0.0F, 1.0F);
  return shapeVariance(i) * std::pow(kShapeStep, static_cast<double>(t));
}

StepGain EdgeProfiler::gain(double blur_variance) const {
  const double at =
      std::log(std::clamp(blur_variance, kLeastVariance, kMostVariance) / kLeastVariance) /
      kLogShapeStep;
  const size_t i = std::min(static_cast<size_t>(at), kShapes - 2);
  const auto t = static_cast<float>(at - static_cast<double>(i));
  const auto between = [&](const std::array<float, kShapes>& table) {
    return table[i] + t * (table[i + 1] - table[i]);
  };
  return {between(narrow_gain_), between(wide_gain_)};
}

EdgeResponse EdgeProfiler::stepResponse(double position_px, double blur_variance) const {
  std::array<double, 4> sums{};
  for (size_t i = 0; i < kTaps; ++i) {
    const double t = static_cast<double>(i) - kCentreTap - position_px;
    const double level = 0.5 * std::erfc(-t / std::sqrt(2 * blur_variance));
    for (size_t k = 0; k < 4; ++k) sums[k] += level * kernels_[0].tap(k, i);
  }
  return {static_cast<float>(sums[0]) * scale_[0],
          static_cast<float>(sums[1]) * scale_[1],
          static_cast<float>(sums[2]) * scale_[2],
          static_cast<float>(sums[3]) * scale_[3]};
}

template <class T>
void EdgeProfiler::measureTyped(const T* data,
                                const EdgeWindow& window,
                                Measure<T> measure_rows,
                                const std::array<float, 4>& scale,
                                std::array<EdgeResponse, kRows>* responses) const {
  const int rows = window.crosses_rows ? pixels_.height : pixels_.width;
  const int columns = window.crosses_rows ? pixels_.width : pixels_.height;
  const ptrdiff_t row_stride = window.crosses_rows ? pixels_.stride : 1;
  const ptrdiff_t column_stride = window.crosses_rows ? 1 : pixels_.stride;
  // Positions in units of 2^-16 px from a whole pixel near the first.
  constexpr int kPositionBits = 16, kPhaseBits = 6, kRestBits = kPositionBits - kPhaseBits;
  static_assert(kPhases == 1 << kPhaseBits);
  constexpr double kUnit = 1 << kPositionBits;
  const double first_px = window.across - 3.5 * window.slope;
  const int base = static_cast<int>(first_px);
  int exact = static_cast<int>((first_px - base) * kUnit);
  const int step = static_cast<int>(window.slope * kUnit);
  std::array<int, kRows> begin;  // of the pixels of a row
  Rows<T> work;
  for (size_t k = 0; k < kRows; ++k, exact += step) {
    const int position = (exact + (1 << (kRestBits - 1))) >> kRestBits;
    begin[k] = base + (position >> kPhaseBits) - kCentreTap;
    work.phases[k] = position & (static_cast<int>(kPhases) - 1);
    work.rounding_px[k] =
        static_cast<float>(position * (1 << kRestBits) - exact) * static_cast<float>(1 / kUnit);
  }
  const int least = std::min(begin.front(), begin.back());
  const int most = std::max(begin.front(), begin.back());
  const bool is_inside = least >= 0 && most + kTaps <= columns && window.first_row >= 0 &&
                         window.first_row + kRows <= rows;
  constexpr int kBuffer = 40;  // slopes below 2.1 need no more
  alignas(16) std::array<std::array<T, kBuffer>, kRows> copies;
  bool is_done = false;
  if (is_inside && column_stride == 1) {
    for (size_t k = 0; k < kRows; ++k) {
      work.pixels[k] = data + (window.first_row + static_cast<int>(k)) * row_stride + begin[k];
    }
    is_done = true;
  }
#ifdef __SSE2__
  if constexpr (sizeof(T) == 1) {
    const int blocks = (most - least + kTaps + 7) / 8;
    if (!is_done && is_inside && 8 * blocks <= kBuffer && least + 8 * blocks <= columns) {
      for (int b = 0; b < blocks; ++b) {
        transpose8x8(data + window.first_row + (least + 8 * b) * column_stride,
                     column_stride,
                     copies[0].data() + 8 * b,
                     kBuffer);
      }
      for (size_t k = 0; k < kRows; ++k) work.pixels[k] = copies[k].data() + (begin[k] - least);
      is_done = true;
    }
  }
#endif
  if (!is_done) {
    for (size_t k = 0; k < kRows; ++k) {
      const int row = window.first_row + static_cast<int>(k);
      work.pixels[k] = copies[k].data();
      for (int tap = 0; tap < kTaps; ++tap) {
        const int column = std::clamp(begin[k] + tap, 0, columns - 1);
        copies[k][static_cast<size_t>(tap)] =
            row < 0 || row >= rows ? T{0} : data[row * row_stride + column * column_stride];
      }
    }
  }
  measure_rows(work, kernels_.data(), scale, responses->data());
}

void EdgeProfiler::measure(const EdgeWindow& window,
                           std::array<EdgeResponse, kRows>* responses) const {
  if (pixels_.u8 != nullptr) {
    measureTyped(pixels_.u8, window, measure_8_, scale_, responses);
    return;
  }
  alignas(16) std::array<float, 4> scale = scale_;
  for (float& value : scale) value /= kGreyUnit;
  measureTyped(pixels_.fixed, window, measure_16_, scale, responses);
}

}  // namespace dlsd
