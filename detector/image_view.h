#pragma once
#include <cstddef>
#include <cstdint>

namespace dlsd {

enum class PixelType { kU8, kU16, kF32 };

/// A borrowed image: nothing is copied, nothing is written. Row y starts at data + y *
/// stride_bytes. Channels are interleaved; with 3 or 4 the first three are R, G, B (B, G, R with
/// bgr = true) and a fourth is ignored. kF32 values are grey levels on the 8-bit scale (0 black,
/// 255 white); kU16 is scaled by 255 / 65535.
struct ImageView {
  const void* data = nullptr;
  int width = 0, height = 0;
  int channels = 1;
  ptrdiff_t stride_bytes = 0;
  PixelType type = PixelType::kU8;
  bool bgr = false;
};

}  // namespace dlsd
