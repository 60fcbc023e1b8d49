#include "detector/edge_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace dlsd {

EdgeThresholds edgeThresholds(const EdgeDrawingOptions& options) {
  const auto units = [&](double gradient) {
    return static_cast<uint16_t>(std::clamp(gradient * kGradientUnit, 1.0, 65535.0));
  };
  return {units(options.anchor_gradient), units(options.min_gradient)};
}

EdgeDrawer::EdgeDrawer(int width, int height, const EdgeDrawingOptions& options)
    : width_(width),
      height_(height),
      options_(options),
      // Padded to whole words, see findAnchors.
      is_crest_((static_cast<size_t>(width) + 7) / 8 * 8),
      visited_(static_cast<size_t>(width) * static_cast<size_t>(height)) {}

namespace {

/// is_crest[x] = 1 where the row has a crest that anchors accept. Written without branches: rows
/// are mostly flat and this runs over the whole image.
template <bool kAlongX>
void markCrests(const GradientField& field,
                int y,
                uint16_t threshold,
                uint8_t* __restrict is_crest) {
  const size_t row = field.at(0, y);
  const size_t w = static_cast<size_t>(field.width);
  const uint16_t* __restrict m = &field.magnitude[row];
  const uint16_t* __restrict before = kAlongX ? m - 1 : m - w;
  const uint16_t* __restrict after = kAlongX ? m + 1 : m + w;
  const int16_t* __restrict gx = &field.gx[row];
  const int16_t* __restrict gy = &field.gy[row];
  for (size_t x = 1; x + 1 < w; ++x) {
    const int16_t ax = static_cast<int16_t>(gx[x] < 0 ? -gx[x] : gx[x]);
    const int16_t ay = static_cast<int16_t>(gy[x] < 0 ? -gy[x] : gy[x]);
    const bool along_x = ax >= ay;
    const bool crest = m[x] >= threshold && m[x] > before[x] && m[x] >= after[x];
    is_crest[x] = static_cast<uint8_t>(crest && along_x == kAlongX);
  }
}

}  // namespace

void EdgeDrawer::findAnchors(const GradientField& field, const EdgeThresholds& thresholds) {
  anchors_.clear();
  if (width_ < 3 || height_ < 3) return;
  const int interval = options_.anchor_interval_px;
  for (int y = 1; y + 1 < height_; ++y) {
    const uint32_t row = static_cast<uint32_t>(field.at(0, y));
    if (y % interval == 0) {
      // Edges that cross this row.
      markCrests<true>(field, y, thresholds.anchor, is_crest_.data());
      for (size_t word = 0; word < is_crest_.size(); word += 8) {
        uint64_t eight = 0;
        std::memcpy(&eight, &is_crest_[word], 8);
        if (eight == 0) continue;
        for (size_t x = word; x < word + 8; ++x) {
          if (is_crest_[x] != 0) anchors_.push_back(row + static_cast<uint32_t>(x));
        }
      }
    }
    // Edges that cross every interval-th column.
    const size_t w = static_cast<size_t>(width_);
    const uint16_t* m = &field.magnitude[row];
    for (int x = interval; x + 1 < width_; x += interval) {
      const size_t i = static_cast<size_t>(x);
      if (m[i] < thresholds.anchor || m[i] <= *(m + i - w) || m[i] < *(m + i + w)) continue;
      if (std::abs(field.gy[row + i]) <= std::abs(field.gx[row + i])) continue;
      anchors_.push_back(row + static_cast<uint32_t>(x));
    }
  }
}

void EdgeDrawer::walk(const GradientField& field,
                      uint16_t min_magnitude,
                      int x,
                      int y,
                      int direction,
                      std::vector<ChainPixel>* pixels) {
  for (;;) {
    const size_t here = field.at(x, y);
    // The crest runs across the gradient; turning it by a right angle keeps the brighter side on
    // the same hand, so the walk can neither turn back nor change to the other side of a thin line.
    const int tx = -direction * field.gy[here];
    const int ty = direction * field.gx[here];
    std::array<std::array<int, 2>, 3> candidates{};  // straight on first: it wins ties
    if (std::abs(tx) >= std::abs(ty)) {
      const int dx = tx > 0 ? 1 : -1;
      candidates = {{{dx, 0}, {dx, -1}, {dx, 1}}};
    } else {
      const int dy = ty > 0 ? 1 : -1;
      candidates = {{{0, dy}, {-1, dy}, {1, dy}}};
    }
    uint16_t best = 0;
    std::array<int, 2> step{};
    for (const auto& c : candidates) {
      const uint16_t m = field.magnitude[field.at(x + c[0], y + c[1])];
      if (m > best) {
        best = m;
        step = c;
      }
    }
    if (best < min_magnitude) return;
    x += step[0];
    y += step[1];
    const size_t next = field.at(x, y);
    if (visited_[next] != 0) return;
    const int next_tx = -direction * field.gy[next];
    const int next_ty = direction * field.gx[next];
    if (next_tx * step[0] + next_ty * step[1] < 0) return;
    visited_[next] = 1;
    pixels->push_back({static_cast<uint16_t>(x), static_cast<uint16_t>(y)});
  }
}

void EdgeDrawer::link(const GradientField& field,
                      const EdgeThresholds& thresholds,
                      EdgeChains* chains) {
  std::fill(visited_.begin(), visited_.end(), uint8_t{0});
  std::vector<ChainPixel>& pixels = chains->pixels;
  pixels.clear();
  chains->starts.clear();
  chains->starts.push_back(0);
  for (const uint32_t anchor : anchors_) {
    if (visited_[anchor] != 0) continue;
    visited_[anchor] = 1;
    const int x = static_cast<int>(anchor) % width_;
    const int y = static_cast<int>(anchor) / width_;
    const size_t begin = pixels.size();
    walk(field, thresholds.chain, x, y, -1, &pixels);
    std::reverse(pixels.begin() + static_cast<ptrdiff_t>(begin), pixels.end());
    pixels.push_back({static_cast<uint16_t>(x), static_cast<uint16_t>(y)});
    walk(field, thresholds.chain, x, y, +1, &pixels);
    if (pixels.size() - begin < static_cast<size_t>(options_.min_chain_px)) {
      pixels.resize(begin);
    } else {
      chains->starts.push_back(static_cast<uint32_t>(pixels.size()));
    }
  }
}

}  // namespace dlsd
