#pragma once
// Image files. The only header of ours behind which OpenCV's codecs stand.

#include <cstdint>
#include <string>
#include <vector>

namespace dlsd {

/// An owned image, rows top to bottom without padding, channels interleaved as R, G, B (, A) when
/// > 1.
struct Image {
  int width = 0, height = 0, channels = 1;
  int bits = 8;                ///< 8 or 16.
  std::vector<uint8_t> bytes;  ///< width * height * channels * bits / 8, native byte order.
};

/// Reads PNG, JPEG, TIFF, PGM, ... at 8 or 16 bit, 1, 3 or 4 channels, never rotated by EXIF.
/// Throws InputError naming the file if it is missing, can't be decoded, or is a PNG or JPEG that
/// is truncated (JPEG: no end-of-image marker) or damaged (PNG: a wrong checksum).
[[nodiscard]] Image readImage(const std::string& path);

/// PNG bytes (deterministic). Throws SystemError if encoding fails.
[[nodiscard]] std::string encodePng(const Image& image);

}  // namespace dlsd
