#include "detector/ray_table.h"

#include <algorithm>

#include "cameras/batch.h"

namespace dlsd {
namespace {

/// Distance along a line of `count` entries, `stride` apart, to the nearest one that is set; `far`
/// where that is farther or there is none.
void distanceAlong(const uint8_t* set, uint8_t* distance, int count, size_t stride, uint8_t far) {
  const auto sweep = [&](int begin, int step, bool first) {
    uint8_t d = far;
    for (int n = 0, i = begin; n < count; ++n, i += step) {
      const size_t k = static_cast<size_t>(i) * stride;
      d = set[k] != 0 ? uint8_t{0} : static_cast<uint8_t>(std::min<int>(d + 1, far));
      distance[k] = first ? d : std::min(distance[k], d);
    }
  };
  sweep(0, 1, true);
  sweep(count - 1, -1, false);
}

}  // namespace

RayTable::RayTable(const Camera& camera)
    : width_(camera.width()),
      height_(camera.height()),
      entries_(static_cast<size_t>(width_) * static_cast<size_t>(height_)),
      usable_(entries_.size()) {
  const size_t w = static_cast<size_t>(width_);
  std::vector<double> u(w), v(w), x(w), y(w), z(w);
  std::vector<uint8_t> valid(w);
  std::vector<uint8_t> has_no_ray(entries_.size()), row_distance(entries_.size());
  for (size_t i = 0; i < w; ++i) u[i] = static_cast<double>(i);
  for (int row = 0; row < height_; ++row) {
    std::fill(v.begin(), v.end(), row);
    unprojectAll(camera, u, v, x, y, z, valid);
    const size_t offset = static_cast<size_t>(row) * w;
    for (size_t i = 0; i < w; ++i) {
      has_no_ray[offset + i] = static_cast<uint8_t>(valid[i] == 0);
      if (valid[i] == 0) continue;  // stays 0: never read, see usable()
      Entry& e = entries_[offset + i];
      e.ray[0] = static_cast<float>(x[i]);
      e.ray[1] = static_cast<float>(y[i]);
      e.ray[2] = static_cast<float>(z[i]);
      e.has_ray = 1;
    }
  }
  constexpr uint8_t kFar = kRimPx + 1;
  for (int row = 0; row < height_; ++row) {
    const size_t offset = static_cast<size_t>(row) * w;
    distanceAlong(&has_no_ray[offset], &row_distance[offset], width_, 1, kFar);
  }
  for (int row = kBorderPx; row < height_ - kBorderPx; ++row) {
    for (int column = kBorderPx; column < width_ - kBorderPx; ++column) {
      bool near_rim = false;
      for (int dy = -kRimPx; dy <= kRimPx && !near_rim; ++dy) {
        if (row + dy < 0 || row + dy >= height_) continue;
        const int dx = row_distance[index(column, row + dy)];
        near_rim = dx * dx + dy * dy <= kRimPx * kRimPx;
      }
      if (!near_rim) usable_[index(column, row)] = 0xffff;
    }
  }
}

}  // namespace dlsd
