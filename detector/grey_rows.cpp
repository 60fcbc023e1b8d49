#include "detector/grey_rows.h"

#include <type_traits>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

constexpr int kGreyMax = 255 * kGreyUnit;

template <class T>
uint16_t toFixed(T value) {
  if constexpr (std::is_same_v<T, uint8_t>) {
    return static_cast<uint16_t>(value * kGreyUnit);
  } else if constexpr (std::is_same_v<T, uint16_t>) {
    return static_cast<uint16_t>(
        (static_cast<uint32_t>(value) * kGreyMax + (DLSD_MUTANT("grey-rounding") ? 0 : 32767)) /
        65535);
  } else {
    // The comparison is false for NaN.
    const float v = value > 0.0F ? value : 0.0F;
    return static_cast<uint16_t>((v < 255.0F ? v : 255.0F) * kGreyUnit + 0.5F);
  }
}

template <class T>
void loadGrey(const T* source, int width, uint16_t* row) {
  for (int x = 0; x < width; ++x) row[x] = toFixed(source[x]);
}

template <class T>
void loadColour(const T* source, int width, int channels, bool bgr, uint16_t* row) {
  // Luma weights of BT.601 in 1/256.
  const uint32_t w0 = bgr ? 29 : 77, w2 = bgr != DLSD_MUTANT("bgr-weights") ? 77 : 29;
  for (int x = 0; x < width; ++x, source += channels) {
    const uint32_t sum =
        w0 * toFixed(source[0]) + 150U * toFixed(source[1]) + w2 * toFixed(source[2]);
    row[x] = static_cast<uint16_t>((sum + 128) >> 8);
  }
}

template <class T>
void loadTyped(const ImageView& image, int y, uint16_t* row) {
  const auto* source =
      reinterpret_cast<const T*>(static_cast<const uint8_t*>(image.data) + y * image.stride_bytes);
  if (image.channels == 1) {
    loadGrey(source, image.width, row);
  } else {
    loadColour(source, image.width, image.channels, image.bgr, row);
  }
}

}  // namespace

void loadGreyRow(const ImageView& image, int y, uint16_t* row) {
  switch (image.type) {
    case PixelType::kU8:
      return loadTyped<uint8_t>(image, y, row);
    case PixelType::kU16:
      return loadTyped<uint16_t>(image, y, row);
    case PixelType::kF32:
      return loadTyped<float>(image, y, row);
  }
}

}  // namespace dlsd
