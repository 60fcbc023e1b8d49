#include "detector/usable_mask.h"

#include <algorithm>
#include <bit>

#include "cameras/batch.h"
#include "cameras/mutant.h"

namespace dlsd {
namespace {

/// Distance along a row to the nearest entry that is set; `far` where that is farther or there is
/// none.
void distanceAlong(const uint8_t* set, uint8_t* distance, int count, uint8_t far) {
  const auto sweep = [&](int begin, int step, bool first) {
    uint8_t d = far;
    for (int n = 0, i = begin; n < count; ++n, i += step) {
      d = set[i] != 0 ? uint8_t{0} : static_cast<uint8_t>(std::min<int>(d + 1, far));
      distance[i] = first ? d : std::min(distance[i], d);
    }
  };
  sweep(0, 1, true);
  sweep(count - 1, -1, false);
}

}  // namespace

PixelBox BitRows::bounds() const {
  PixelBox box;
  const auto isSet = [](uint64_t word) { return word != 0; };
  const auto isEmpty = [&](int y) { return std::none_of(row(y), row(y) + words_per_row, isSet); };
  while (box.y0 < height && isEmpty(box.y0)) ++box.y0;
  if (box.y0 == height) return {};
  for (box.y1 = height; isEmpty(box.y1 - 1);) --box.y1;
  // Column by column of words.
  uint64_t all = 0;
  const auto columnOf = [&](size_t word) {
    all = 0;
    for (int y = box.y0; y < box.y1; ++y) all |= row(y)[word];
    return all;
  };
  size_t word = 0;
  while (columnOf(word) == 0) ++word;
  box.x0 = static_cast<int>(64 * word) + std::countr_zero(all);
  word = words_per_row - 1;
  while (columnOf(word) == 0) --word;
  box.x1 = static_cast<int>(64 * word) + 64 - std::countl_zero(all);
  return box;
}

UsableMask::UsableMask(const Camera& camera) : bits_(camera.width(), camera.height()) {
  const int width = camera.width(), height = camera.height();
  const size_t w = static_cast<size_t>(width);
  std::vector<double> u(w), v(w), x(w), y(w), z(w);
  std::vector<uint8_t> valid(w), has_no_ray(w);
  std::vector<uint8_t> row_distance(w * static_cast<size_t>(height));
  for (size_t i = 0; i < w; ++i) u[i] = static_cast<double>(i);
  for (int row = 0; row < height; ++row) {
    std::fill(v.begin(), v.end(), row);
    unprojectAll(camera, u, v, x, y, z, valid);
    for (size_t i = 0; i < w; ++i) has_no_ray[i] = static_cast<uint8_t>(valid[i] == 0);
    distanceAlong(
        has_no_ray.data(), &row_distance[static_cast<size_t>(row) * w], width, kRimPx + 1);
  }
  for (int row = kBorderPx; row < height - kBorderPx; ++row) {
    for (int column = kBorderPx; column < width - kBorderPx + (DLSD_MUTANT("mask-border") ? 1 : 0);
         ++column) {
      bool near_rim = false;
      for (int dy = -kRimPx; dy <= kRimPx && !near_rim; ++dy) {
        if (row + dy < 0 || row + dy >= height) continue;
        const int dx =
            row_distance[static_cast<size_t>(row + dy) * w + static_cast<size_t>(column)];
        near_rim = dx * dx + dy * dy <= kRimPx * kRimPx - (DLSD_MUTANT("mask-rim") ? 1 : 0);
      }
      if (!near_rim) bits_.set(column, row);
    }
  }
}

}  // namespace dlsd
