#include "detector/edge_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#if defined(__x86_64__) && defined(__GNUC__)
#define DLSD_HAVE_AVX2_KERNELS
#include <immintrin.h>

#include "cameras/mutant.h"
#endif

namespace dlsd {
namespace {

// Each loop is written once, compiled for each instruction set, and vectorised by the compiler;
// each intermediate is cast back to 16 bits (all fit) because C++ would widen it to 32.
using U = uint16_t;
using I = int16_t;
#define DLSD_INLINE inline __attribute__((always_inline))

template <class T>
DLSD_INLINE U weighted(T a, T b, T c, T d, T e, T f) {
  const U outer = static_cast<U>(a + f), middle = static_cast<U>(b + e);
  const U inner = static_cast<U>(c + d);
  return static_cast<U>(outer + 5 * static_cast<U>(middle + 2 * inner));
}

DLSD_INLINE void smoothAlongLoop(const U* __restrict in, size_t count, U* __restrict out) {
  for (size_t i = 0; i < count; ++i) {
    const U sum = weighted(in[i], in[i + 1], in[i + 2], in[i + 3], in[i + 4], in[i + 5]);
    out[i] = static_cast<U>(static_cast<U>(sum + 16) >> 5);
  }
}

DLSD_INLINE void smoothAcrossLoop(const std::array<const U*, 6>& rows,
                                  size_t count,
                                  I* __restrict out) {
  const U* __restrict r0 = rows[0];
  const U* __restrict r1 = rows[1];
  const U* __restrict r2 = rows[2];
  const U* __restrict r3 = rows[3];
  const U* __restrict r4 = rows[4];
  const U* __restrict r5 = rows[5];
  for (size_t i = 0; i < count; ++i) {
    const U sum = weighted(r0[i], r1[i], r2[i], r3[i], r4[i], r5[i]);
    out[i] = static_cast<I>(static_cast<U>(static_cast<U>(sum + 2) >> 2));
  }
}

DLSD_INLINE void gradientLoop(const I* __restrict above,
                              const I* __restrict below,
                              size_t count,
                              I* __restrict gx,
                              I* __restrict gy,
                              I* __restrict magnitude) {
  for (size_t i = 0; i < count; ++i) {
    const I a = above[i], b = above[i + 1], c = below[i], d = below[i + 1];
    const I falling = static_cast<I>(d - a), rising = static_cast<I>(b - c);
    const I dx = static_cast<I>(falling + rising);
    const I dy = static_cast<I>(falling - rising);
    gx[i] = dx;
    gy[i] = dy;
    const I ax = std::max(dx, static_cast<I>(-dx));
    const I ay = std::max(dy, static_cast<I>(-dy));
    const I larger = std::max(ax, ay), smaller = std::min(ax, ay);
    magnitude[i] = static_cast<I>(larger + static_cast<I>(smaller >> 2) + (smaller >> 3));
  }
}

void crestsPortable(const EdgeRowKernels::CrestRows& r, size_t words) {
  for (size_t word = 0; word < words; ++word) {
    std::array<uint64_t, kCrestPlanes + 1> bits{};
    for (size_t bit = 0; bit < 64 && r.usable[word] != 0; ++bit) {
      const size_t x = 64 * word + bit;
      const int m = r.row[x];
      if (m < r.low || (r.usable[word] >> bit & 1) == 0) continue;
      const int ax = std::abs(r.gx[x]), ay = std::abs(r.gy[x]);
      const int16_t before = *(r.row + x - 1);
      const bool along_x = m > before && m >= r.row[x + 1] && ay <= ax + (ax >> 2);
      const bool along_y = m > r.above[x] && m >= r.below[x] && ax <= ay;
      const auto on = [&](size_t plane, bool set) {
        bits[plane] |= static_cast<uint64_t>(set) << bit;
      };
      on(kRight, along_x && r.gx[x] > 0);
      on(kLeft, along_x && r.gx[x] <= 0);
      on(kDown, along_y && r.gy[x] > 0);
      on(kUp, along_y && r.gy[x] <= 0);
      on(kCrestPlanes, m >= r.high && (along_x || along_y));
    }
    for (size_t plane = 0; plane < bits.size(); ++plane) r.words[plane][word] = bits[plane];
  }
}

constexpr EdgeRowKernels kPortable = {
    [](const U* in, size_t count, U* out) { smoothAlongLoop(in, count, out); },
    [](const std::array<const U*, 6>& rows, size_t count, I* out) {
      smoothAcrossLoop(rows, count, out);
    },
    [](const I* above, const I* below, size_t count, I* gx, I* gy, I* magnitude) {
      gradientLoop(above, below, count, gx, gy, magnitude);
    },
    crestsPortable};

#ifdef DLSD_HAVE_AVX2_KERNELS
#define DLSD_AVX2 __attribute__((target("avx2")))

DLSD_AVX2 void smoothAlongAvx2(const U* in, size_t count, U* out) {
  smoothAlongLoop(in, count, out);
}
DLSD_AVX2 void smoothAcrossAvx2(const std::array<const U*, 6>& rows, size_t count, I* out) {
  smoothAcrossLoop(rows, count, out);
}
DLSD_AVX2 void gradientAvx2(
    const I* above, const I* below, size_t count, I* gx, I* gy, I* magnitude) {
  gradientLoop(above, below, count, gx, gy, magnitude);
}

DLSD_AVX2 inline __m256i loadRow(const I* p) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
}
/// Bits of 32 lanes of 16 bits that are 0 or -1.
DLSD_AVX2 inline uint32_t bitsOf(__m256i low, __m256i high) {
  const __m256i bytes = _mm256_permute4x64_epi64(_mm256_packs_epi16(low, high), 0xd8);
  return static_cast<uint32_t>(_mm256_movemask_epi8(bytes));
}

DLSD_AVX2 void crestsAvx2(const EdgeRowKernels::CrestRows& r, size_t words) {
  const __m256i below_low = _mm256_set1_epi16(static_cast<I>(r.low - 1));
  const __m256i below_high = _mm256_set1_epi16(static_cast<I>(r.high - 1));
  const __m256i zero = _mm256_setzero_si256();
  for (size_t word = 0; word < words; ++word) {
    std::array<uint64_t, kCrestPlanes + 1> bits{};
    for (size_t half = 0; half < 2 && r.usable[word] != 0; ++half) {
      const size_t first = 64 * word + 32 * half;
      const __m256i m0 = loadRow(r.row + first), m1 = loadRow(r.row + first + 16);
      const __m256i any = _mm256_cmpgt_epi16(_mm256_max_epi16(m0, m1), below_low);
      if (_mm256_testz_si256(any, any) != 0) continue;
      __m256i lanes[kCrestPlanes + 1][2];
      for (size_t i = 0; i < 2; ++i) {
        const size_t x = first + 16 * i;
        const __m256i m = i == 0 ? m0 : m1;
        const __m256i gx = loadRow(r.gx + x), gy = loadRow(r.gy + x);
        const __m256i ax = _mm256_abs_epi16(gx), ay = _mm256_abs_epi16(gy);
        const __m256i edge = _mm256_cmpgt_epi16(m, below_low);
        // Conditions that must not hold.
        const __m256i not_x =
            _mm256_or_si256(_mm256_cmpgt_epi16(loadRow(r.row + x + 1), m),
                            _mm256_cmpgt_epi16(ay, _mm256_add_epi16(ax, _mm256_srai_epi16(ax, 2))));
        const __m256i not_y = _mm256_or_si256(_mm256_cmpgt_epi16(loadRow(r.below + x), m),
                                              _mm256_cmpgt_epi16(ax, ay));
        const __m256i along_x = _mm256_andnot_si256(
            not_x, _mm256_and_si256(edge, _mm256_cmpgt_epi16(m, loadRow(r.row + x - 1))));
        const __m256i along_y = _mm256_andnot_si256(
            not_y, _mm256_and_si256(edge, _mm256_cmpgt_epi16(m, loadRow(r.above + x))));
        const __m256i right = _mm256_cmpgt_epi16(gx, zero), down = _mm256_cmpgt_epi16(gy, zero);
        lanes[kRight][i] = _mm256_and_si256(along_x, right);
        lanes[kLeft][i] = _mm256_andnot_si256(right, along_x);
        lanes[kDown][i] = _mm256_and_si256(along_y, down);
        lanes[kUp][i] = _mm256_andnot_si256(down, along_y);
        lanes[kCrestPlanes][i] =
            _mm256_and_si256(_mm256_or_si256(along_x, along_y), _mm256_cmpgt_epi16(m, below_high));
      }
      for (size_t plane = 0; plane < bits.size(); ++plane) {
        bits[plane] |= static_cast<uint64_t>(bitsOf(lanes[plane][0], lanes[plane][1]))
                       << (32 * half);
      }
    }
    for (size_t plane = 0; plane < bits.size(); ++plane) {
      r.words[plane][word] = bits[plane] & r.usable[word];
    }
  }
}

constexpr EdgeRowKernels kAvx2 = {smoothAlongAvx2, smoothAcrossAvx2, gradientAvx2, crestsAvx2};
#endif

constexpr size_t kGreyPad = 3;        // before a row of grey levels
constexpr size_t kMagnitudePad = 32;  // before a row of magnitudes
constexpr size_t kAlongRows = 8, kCornerRows = 2, kGradientRows = 4;

}  // namespace

const EdgeRowKernels& portableEdgeRowKernels() {
  return kPortable;
}

const EdgeRowKernels* avx2EdgeRowKernels() {
#ifdef DLSD_HAVE_AVX2_KERNELS
  if (__builtin_cpu_supports("avx2") != 0) return &kAvx2;
#endif
  return nullptr;
}

EdgeMapper::EdgeMapper(int width,
                       int height,
                       const EdgeDrawingOptions& options,
                       const EdgeRowKernels& kernels)
    : options_(options),
      kernels_(kernels),
      width_(width),
      height_(height),
      words_per_row_((static_cast<size_t>(width) + 63) / 64),
      padded_((words_per_row_ + 2) * 64),
      grey_(padded_),
      along_(kAlongRows * padded_),
      corners_(kCornerRows * padded_),
      gx_(kGradientRows * padded_),
      gy_(kGradientRows * padded_),
      magnitude_(kGradientRows * padded_ + kMagnitudePad),
      histogram_((1 << 15) >> 3) {}

/// Into along_, row y of the image; what lies outside repeats the border.
void EdgeMapper::loadRow(const GreyPixels& pixels, int y) {
  uint16_t* grey = grey_.data() + kGreyPad;
  const size_t w = static_cast<size_t>(width_);
  if (pixels.u8 != nullptr) {
    const uint8_t* source = pixels.u8 + y * pixels.stride;
    for (size_t x = 0; x < w; ++x) grey[x] = static_cast<U>(source[x] << 3);
  } else {
    static_assert(kGreyUnit == 16);
    const uint16_t* source = pixels.fixed + y * pixels.stride;
    for (size_t x = 0; x < w; ++x) grey[x] = static_cast<U>(source[x] >> 1);
  }
  for (size_t i = 0; i < kGreyPad; ++i) {
    grey_[i] = grey[0];
    grey[w + i] = grey[w - 1];
  }
  const size_t slot = static_cast<size_t>(y) % kAlongRows;
  // Corner i lies before pixel i; there is one more of them.
  kernels_.smoothAlong(grey_.data(), words_per_row_ * 64 + 1, &along_[slot * padded_]);
}

double EdgeMapper::measureNoise(const GreyPixels& pixels, const BitRows& usable) {
  // Rows enough for 1 % of the quantile.
  constexpr int kRows = 32;
  constexpr int kShift = 3;  // bins of 1/16 grey level per px
  constexpr int kColumnStep = 3;
  std::fill(histogram_.begin(), histogram_.end(), 0);
  const size_t count = words_per_row_ * 64;
  const PixelBox where = usable.bounds();
  const int step = std::max(1, where.height() / kRows);
  int total = 0;
  for (int y = where.y0 + step / 2; y < where.y1; y += step) {
    for (int dy = -3; dy <= 3; ++dy) {
      const int row = y + dy;
      if (row >= 0 && row < height_) loadRow(pixels, row);
    }
    for (int side = 0; side < 2; ++side) {
      std::array<const U*, 6> rows{};
      for (int i = 0; i < 6; ++i) {
        const int row = std::clamp(y + side + i - 3, 0, height_ - 1);
        rows[static_cast<size_t>(i)] = &along_[static_cast<size_t>(row) % kAlongRows * padded_];
      }
      kernels_.smoothAcross(rows, count + 1, &corners_[static_cast<size_t>(side) * padded_]);
    }
    kernels_.gradient(&corners_[0], &corners_[padded_], count, &gx_[0], &gy_[0], &magnitude_[0]);
    for (int x = where.x0 + (y - where.y0) % kColumnStep; x < where.x1; x += kColumnStep) {
      if (!usable.test(x, y)) continue;
      ++histogram_[static_cast<size_t>(magnitude_[static_cast<size_t>(x)] >> kShift)];
      ++total;
    }
  }
  const double rank = (DLSD_MUTANT("noise-quantile") ? 0.45 : 0.4) * total;
  double below = 0;
  for (size_t bin = 0; bin < histogram_.size(); ++bin) {
    const double here = histogram_[bin];
    if (below + here >= rank && here > 0) {
      const double quantile = (static_cast<double>(bin) + (rank - below) / here) * (1 << kShift);
      // 1.011 from the Rayleigh distribution; 1.040 is the mean excess of `magnitude` over the
      // norm.
      return quantile / (1.011 * 1.040 * kGradientUnit);
    }
    below += here;
  }
  return 0;
}

void EdgeMapper::compute(const GreyPixels& pixels, const BitRows& usable, EdgeMap* map) {
  const bool measures_noise = options_.anchor_noise_ratio > 0 || options_.min_noise_ratio > 0;
  noise_ = measures_noise ? measureNoise(pixels, usable) : 0;
  const auto units = [&](double gradient, double noise_ratio) {
    const double bound = std::max(gradient, noise_ratio * noise_) * kGradientUnit;
    return static_cast<int16_t>(std::clamp(bound, 1.0, 32767.0));
  };
  EdgeRowKernels::CrestRows rows{};
  rows.low = units(options_.min_gradient, options_.min_noise_ratio);
  rows.high = units(options_.anchor_gradient, options_.anchor_noise_ratio);

  std::array<BitRows*, kCrestPlanes + 1> planes{};
  for (size_t i = 0; i < kCrestPlanes; ++i) planes[i] = &map->crests[i];
  planes[kCrestPlanes] = &map->strong;
  for (BitRows* plane : planes) {
    if (plane->width != width_ || plane->height != height_) *plane = BitRows(width_, height_);
  }

  const size_t count = words_per_row_ * 64;
  const auto cornerRow = [&](int y) {
    return &corners_[static_cast<size_t>(y) % kCornerRows * padded_];
  };
  const auto gradientRow = [&](auto& buffer, int y) {
    const size_t slot = static_cast<size_t>(std::clamp(y, 0, height_ - 1)) % kGradientRows;
    return &buffer[slot * padded_];
  };
  // Step s loads row s, makes the corners above row s - 2, the gradient of row s - 3 and the crests
  // of row s - 4.
  for (int s = 0; s < height_ + 5; ++s) {
    if (s < height_) loadRow(pixels, s);
    const int corner = s - 2;
    if (corner >= 0 && corner <= height_) {
      std::array<const U*, 6> from{};
      for (int i = 0; i < 6; ++i) {
        const int row = std::clamp(corner + i - 3, 0, height_ - 1);
        from[static_cast<size_t>(i)] = &along_[static_cast<size_t>(row) % kAlongRows * padded_];
      }
      kernels_.smoothAcross(from, count + 1, cornerRow(corner));
    }
    const int g = s - 3;
    if (g >= 0 && g < height_) {
      kernels_.gradient(cornerRow(g),
                        cornerRow(g + 1),
                        count,
                        gradientRow(gx_, g),
                        gradientRow(gy_, g),
                        gradientRow(magnitude_, g) + kMagnitudePad);
    }
    const int y = s - 4;
    if (y >= 0 && y < height_) {
      rows.above = gradientRow(magnitude_, y - 1) + kMagnitudePad;
      rows.row = gradientRow(magnitude_, y) + kMagnitudePad;
      rows.below = gradientRow(magnitude_, y + 1) + kMagnitudePad;
      rows.gx = gradientRow(gx_, y);
      rows.gy = gradientRow(gy_, y);
      rows.usable = usable.row(y);
      for (size_t i = 0; i < planes.size(); ++i) rows.words[i] = planes[i]->row(y);
      kernels_.crests(rows, words_per_row_);
    }
  }
}

}  // namespace dlsd
