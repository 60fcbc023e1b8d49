#include "evaluation/picture.h"

#include <algorithm>
#include <cstdint>

namespace dlsd {

Image shrunk(const Image& image, int max_width) {
  const int factor = std::max(1, (image.width + max_width - 1) / max_width);
  if (factor == 1 || image.height < factor) {
    return image;
  }
  Image small;
  small.width = image.width / factor;
  small.height = image.height / factor;
  small.channels = image.channels;
  small.bytes.reserve(size_t(small.width) * size_t(small.height) * size_t(small.channels));
  const int bytes = image.bits / 8;
  const auto valueAt = [&](int x, int y, int channel) -> unsigned {
    const size_t i =
        (size_t(y) * size_t(image.width) + size_t(x)) * size_t(image.channels) + size_t(channel);
    if (bytes == 1) {
      return image.bytes[i];
    }
    uint16_t value = 0;
    std::copy_n(image.bytes.begin() + long(2 * i), 2, reinterpret_cast<uint8_t*>(&value));
    return value / 257;
  };
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int c = 0; c < small.channels; ++c) {
        unsigned sum = 0;
        for (int k = 0; k < factor * factor; ++k) {
          sum += valueAt(x * factor + k % factor, y * factor + k / factor, c);
        }
        const auto n = unsigned(factor * factor);
        small.bytes.push_back(uint8_t((sum + n / 2) / n));
      }
    }
  }
  return small;
}

Image cropped(const Image& image, int x, int y, int width, int height) {
  Image part;
  part.width = width;
  part.height = height;
  part.channels = image.channels;
  part.bits = image.bits;
  const size_t pixel = size_t(image.channels) * size_t(image.bits / 8);
  for (int row = y; row < y + height; ++row) {
    const auto begin =
        image.bytes.begin() + long((size_t(row) * size_t(image.width) + size_t(x)) * pixel);
    part.bytes.insert(part.bytes.end(), begin, begin + long(size_t(width) * pixel));
  }
  return part;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    for (size_t k = 0; k < 3; ++k) {
      three = three << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0U);
    }
    for (size_t k = 0; k < 4; ++k) {
      out += i + k <= bytes.size() ? kDigits[three >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return out;
}

}  // namespace dlsd
