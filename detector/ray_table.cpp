#include "detector/ray_table.h"

#include <algorithm>

#include "cameras/batch.h"

namespace dlsd {
namespace {

/// out[i] = 1 if any in[j] is, |i - j| <= radius, for `count` entries `stride` apart.
void dilate(const uint8_t* in, uint8_t* out, int count, size_t stride, int radius) {
  int last_set = -radius - 1;  // last set entry at or before i + radius
  for (int i = -radius; i < count; ++i) {
    const int ahead = i + radius;
    if (ahead < count && in[static_cast<size_t>(ahead) * stride] != 0) last_set = ahead;
    if (i >= 0) {
      out[static_cast<size_t>(i) * stride] = static_cast<uint8_t>(last_set >= i - radius);
    }
  }
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
  std::vector<uint8_t> has_no_ray(entries_.size()), near_row(entries_.size()),
      near(entries_.size());
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
  for (int row = 0; row < height_; ++row) {
    const size_t offset = static_cast<size_t>(row) * w;
    dilate(&has_no_ray[offset], &near_row[offset], width_, 1, kRimPx);
  }
  for (size_t column = 0; column < w; ++column) {
    dilate(&near_row[column], &near[column], height_, w, kRimPx);
  }
  for (int row = kBorderPx; row < height_ - kBorderPx; ++row) {
    for (int column = kBorderPx; column < width_ - kBorderPx; ++column) {
      const size_t i = index(column, row);
      if (near[i] == 0) usable_[i] = 0xffff;
    }
  }
}

}  // namespace dlsd
