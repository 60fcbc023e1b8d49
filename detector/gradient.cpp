#include "detector/gradient.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "detector/grey_rows.h"

namespace dlsd {
namespace {

// The loops below are plain so that compilers turn them into 16-bit SIMD; each intermediate is cast
// back to 16 bits (all fit) because C++ would widen it to 32 and halve the speed.
using U = uint16_t;
using I = int16_t;

void smoothAlong(const U* __restrict padded, int width, U* __restrict out) {
  for (int x = 0; x < width; ++x) {
    const U outer = static_cast<U>(padded[x] + padded[x + 4]);
    const U inner = static_cast<U>(padded[x + 1] + padded[x + 3]);
    const U centre = padded[x + 2];
    const U sum = static_cast<U>(outer + 4 * inner + 6 * centre + 8);
    out[x] = static_cast<U>(sum >> 4);
  }
}

void smoothAcross(const std::array<const U*, 5>& rows, int width, I* __restrict out) {
  const U* __restrict r0 = rows[0];
  const U* __restrict r1 = rows[1];
  const U* __restrict r2 = rows[2];
  const U* __restrict r3 = rows[3];
  const U* __restrict r4 = rows[4];
  for (int x = 0; x < width; ++x) {
    const U outer = static_cast<U>(r0[x] + r4[x]);
    const U inner = static_cast<U>(r1[x] + r3[x]);
    const U sum = static_cast<U>(outer + 4 * inner + 6 * r2[x] + 8);
    out[x] = static_cast<I>(static_cast<U>(sum >> 4));
  }
}

void gradientRow(const I* __restrict above,
                 const I* __restrict row,
                 const I* __restrict below,
                 int width,
                 I* __restrict gx,
                 I* __restrict gy,
                 U* __restrict magnitude) {
  for (int x = 0; x < width; ++x) {
    const I dx_outer = static_cast<I>(above[x + 2] - above[x] + below[x + 2] - below[x]);
    const I dx_centre = static_cast<I>(row[x + 2] - row[x]);
    const I dy_outer = static_cast<I>(below[x] - above[x] + below[x + 2] - above[x + 2]);
    const I dy_centre = static_cast<I>(below[x + 1] - above[x + 1]);
    const I dx = static_cast<I>(dx_outer + 2 * dx_centre);
    const I dy = static_cast<I>(dy_outer + 2 * dy_centre);
    gx[x] = dx;
    gy[x] = dy;
    const I ax = std::max(dx, static_cast<I>(-dx));
    const I ay = std::max(dy, static_cast<I>(-dy));
    const I larger = std::max(ax, ay);
    const I smaller = std::min(ax, ay);
    const I sum = static_cast<I>(larger + (smaller >> 2) + (smaller >> 3));
    magnitude[x] = static_cast<U>(sum);
  }
}

}  // namespace

GradientFilter::GradientFilter(int width, int height)
    : width_(width),
      height_(height),
      grey_row_(static_cast<size_t>(width) + 4),
      smooth_x_(5 * static_cast<size_t>(width)),
      smooth_(3 * (static_cast<size_t>(width) + 2)) {}

void GradientFilter::compute(const ImageView& image, const BitRows& usable, GradientField* field) {
  const size_t w = static_cast<size_t>(width_);
  const size_t count = w * static_cast<size_t>(height_);
  field->width = width_;
  field->height = height_;
  field->gx.resize(count);
  field->gy.resize(count);
  field->magnitude.resize(count);

  const auto smoothXRow = [&](int y) { return &smooth_x_[static_cast<size_t>(y % 5) * w]; };
  const auto smoothRow = [&](int y) { return &smooth_[static_cast<size_t>(y % 3) * (w + 2)]; };

  // Step s loads row s, smooths row s - 2 and differentiates row s - 3.
  for (int s = 0; s < height_ + 3; ++s) {
    if (s < height_) {
      U* grey = grey_row_.data();
      loadGreyRow(image, s, grey + 2);
      grey[0] = grey[1] = grey[2];
      grey[w + 2] = grey[w + 3] = grey[w + 1];
      smoothAlong(grey, width_, smoothXRow(s));
    }
    const int y = s - 2;
    if (y >= 0 && y < height_) {
      std::array<const U*, 5> rows{};
      for (int i = 0; i < 5; ++i) {
        rows[static_cast<size_t>(i)] = smoothXRow(std::clamp(y + i - 2, 0, height_ - 1));
      }
      I* smooth = smoothRow(y);
      smoothAcross(rows, width_, smooth + 1);
      smooth[0] = smooth[1];
      smooth[w + 1] = smooth[w];
    }
    const int g = s - 3;
    if (g >= 0 && g < height_) {
      const size_t offset = static_cast<size_t>(g) * w;
      gradientRow(smoothRow(std::max(g - 1, 0)),
                  smoothRow(g),
                  smoothRow(std::min(g + 1, height_ - 1)),
                  width_,
                  &field->gx[offset],
                  &field->gy[offset],
                  &field->magnitude[offset]);
      for (int x = 0; x < width_; ++x) {
        if (!usable.test(x, g)) field->magnitude[offset + static_cast<size_t>(x)] = 0;
      }
    }
  }
}

}  // namespace dlsd
