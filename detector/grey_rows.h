#pragma once
// Any image view as rows of grey levels in fixed point.

#include <cstddef>
#include <cstdint>

#include "detector/image_view.h"

namespace dlsd {

/// Fixed-point units of one grey level.
inline constexpr int kGreyUnit = 16;

/// Pixels of one channel: the caller's own 8-bit pixels, or a copy in 1 / kGreyUnit grey levels.
struct GreyPixels {
  const uint8_t* u8 = nullptr;
  const uint16_t* fixed = nullptr;  ///< Read if u8 is null.
  ptrdiff_t stride = 0;             ///< In pixels of that type.
  int width = 0, height = 0;
};

/// Row y of the image in 1 / kGreyUnit grey levels, width entries. Float values outside [0, 255]
/// are clamped, and what is not a number counts as 0. Colours are weighted by BT.601.
void loadGreyRow(const ImageView& image, int y, uint16_t* row);

}  // namespace dlsd
