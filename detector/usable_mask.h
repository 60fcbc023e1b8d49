#pragma once
// Pixels at which an edge may be: not where smoothing and gradient see the border of the image or
// the rim of the image circle or mirror.

#include <cstdint>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// Pixels x0 <= x < x1, y0 <= y < y1.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  [[nodiscard]] int width() const { return x1 - x0; }
  [[nodiscard]] int height() const { return y1 - y0; }
};

/// One bit per pixel; rows start on whole words, the bits beyond a row's end are 0.
struct BitRows {
  int width = 0, height = 0;
  size_t words_per_row = 0;
  /// kSlackWords more than the rows need, so that unaligned reads may run over the end.
  std::vector<uint64_t> words;
  static constexpr size_t kSlackWords = 2;

  BitRows() = default;
  BitRows(int the_width, int the_height)
      : width(the_width),
        height(the_height),
        words_per_row((static_cast<size_t>(the_width) + 63) / 64),
        words(words_per_row * static_cast<size_t>(the_height) + kSlackWords) {}

  [[nodiscard]] uint64_t* row(int y) { return &words[words_per_row * static_cast<size_t>(y)]; }
  [[nodiscard]] const uint64_t* row(int y) const {
    return &words[words_per_row * static_cast<size_t>(y)];
  }
  [[nodiscard]] bool test(int x, int y) const {
    return (row(y)[static_cast<unsigned>(x) / 64] >> (static_cast<unsigned>(x) % 64) & 1) != 0;
  }
  /// Set, and a pixel of the image.
  [[nodiscard]] bool contains(int x, int y) const {
    return x >= 0 && y >= 0 && x < width && y < height && test(x, y);
  }
  void set(int x, int y) {
    row(y)[static_cast<unsigned>(x) / 64] |= uint64_t{1} << (static_cast<unsigned>(x) % 64);
  }
  void clear(int x, int y) {
    row(y)[static_cast<unsigned>(x) / 64] &= ~(uint64_t{1} << (static_cast<unsigned>(x) % 64));
  }
  /// The smallest box with all that is set; empty at (0, 0) if nothing is.
  [[nodiscard]] PixelBox bounds() const;
};

class UsableMask {
 public:
  explicit UsableMask(const Camera& camera);

  /// Set where an edge may be: kBorderPx or more from the border of the image, farther than kRimPx
  /// from every pixel without a ray.
  [[nodiscard]] const BitRows& bits() const { return bits_; }

  static constexpr int kBorderPx = 2;
  static constexpr int kRimPx = 5;

 private:
  BitRows bits_;
};

}  // namespace dlsd
