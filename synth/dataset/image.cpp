#include "synth/dataset/image.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "cameras/calibration/files.h"
#include "synth/dataset/codecs.h"

namespace dlsd {
namespace {

/// OpenCV keeps B, G, R; we keep R, G, B. The swap is its own inverse.
template <class T>
void swapRedAndBlue(uint8_t* bytes, size_t pixels, int channels) {
  T* p = reinterpret_cast<T*>(bytes);
  for (size_t i = 0; i < pixels; ++i, p += channels) std::swap(p[0], p[2]);
}

void swapRedAndBlue(Image* image) {
  if (image->channels < 3) return;
  const size_t pixels = static_cast<size_t>(image->width) * static_cast<size_t>(image->height);
  if (image->bits == 8) {
    swapRedAndBlue<uint8_t>(image->bytes.data(), pixels, image->channels);
  } else {
    swapRedAndBlue<uint16_t>(image->bytes.data(), pixels, image->channels);
  }
}

uint8_t byteAt(std::string_view s, size_t i) {
  return static_cast<uint8_t>(s[i]);
}

uint32_t bigEndian32(std::string_view s, size_t i) {
  uint32_t value = 0;
  for (size_t k = 0; k < 4; ++k) value = value << 8 | byteAt(s, i + k);
  return value;
}

/// The checksum of PNG chunks (ISO 3309).
uint32_t crc32(std::string_view bytes) {
  static const std::array<uint32_t, 256> table = [] {
    std::array<uint32_t, 256> t{};
    for (uint32_t i = 0; i < 256; ++i) {
      uint32_t c = i;
      for (int k = 0; k < 8; ++k) c = (c & 1) != 0 ? 0xedb88320U ^ (c >> 1) : c >> 1;
      t[i] = c;
    }
    return t;
  }();
  uint32_t c = 0xffffffffU;
  for (const char b : bytes) c = table[(c ^ static_cast<uint8_t>(b)) & 255] ^ (c >> 8);
  return ~c;
}

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";
constexpr std::string_view kJpegSignature = "\xff\xd8\xff";

/// All chunks from IHDR to IEND are there and unharmed. libpng would tell the user's terminal.
bool isWholePng(std::string_view s) {
  size_t at = kPngSignature.size();
  for (bool first = true;; first = false) {
    constexpr size_t kFrame = 12;  // Length, type, checksum.
    if (s.size() - at < kFrame) return false;
    const size_t length = bigEndian32(s, at);
    if (s.size() - at - kFrame < length) return false;
    const std::string_view type = s.substr(at + 4, 4);
    if (first && type != "IHDR") return false;
    if (crc32(s.substr(at + 4, 4 + length)) != bigEndian32(s, at + 8 + length)) return false;
    if (type == "IEND") return true;
    at += kFrame + length;
  }
}

/// All segments up to the end-of-image marker are there; what a camera adds after it may be
/// anything. The decoder would fill what is missing with grey.
bool isWholeJpeg(std::string_view s) {
  size_t at = 2;
  while (true) {
    // To the next marker: FF and neither 0 (an FF of the coded data) nor a restart nor a fill byte.
    while (at + 1 < s.size() &&
           !(byteAt(s, at) == 0xff && byteAt(s, at + 1) != 0 && byteAt(s, at + 1) != 0xff &&
             (byteAt(s, at + 1) < 0xd0 || byteAt(s, at + 1) > 0xd7))) {
      ++at;
    }
    if (at + 1 >= s.size()) return false;
    if (byteAt(s, at + 1) == 0xd9) return true;
    if (at + 3 >= s.size()) return false;
    at += 2 + static_cast<size_t>(byteAt(s, at + 2) << 8 | byteAt(s, at + 3));
  }
}

}  // namespace

Image readImage(const std::string& path) {
  const std::string content = readFile(path);
  if ((content.starts_with(kPngSignature) && !isWholePng(content)) ||
      (content.starts_with(kJpegSignature) && !isWholeJpeg(content))) {
    throw InputError(path + ": truncated or damaged image");
  }
  const cv::Mat mat = imageCodecs().decode(content);
  if (mat.empty()) throw InputError(path + ": not an image that can be decoded");
  const bool depth_ok = mat.depth() == CV_8U || mat.depth() == CV_16U;
  const int channels = mat.channels();
  if (!depth_ok || !(channels == 1 || channels == 3 || channels == 4)) {
    throw InputError(path + ": must have 1, 3 or 4 channels of 8 or 16 bits");
  }
  Image image{mat.cols, mat.rows, channels, mat.depth() == CV_8U ? 8 : 16, {}};
  const size_t row_bytes = static_cast<size_t>(mat.cols) * mat.elemSize();
  image.bytes.resize(row_bytes * static_cast<size_t>(mat.rows));
  for (int y = 0; y < mat.rows; ++y) {
    std::memcpy(image.bytes.data() + static_cast<size_t>(y) * row_bytes, mat.ptr(y), row_bytes);
  }
  swapRedAndBlue(&image);
  return image;
}

std::string encodePng(const Image& image) {
  Image bgr = image;
  swapRedAndBlue(&bgr);
  const int type = CV_MAKETYPE(image.bits == 8 ? CV_8U : CV_16U, image.channels);
  const cv::Mat mat(image.height, image.width, type, bgr.bytes.data());
  const std::vector<uint8_t> png = imageCodecs().encodePng(mat);
  if (png.empty()) throw SystemError("an image could not be encoded as PNG");
  return {png.begin(), png.end()};
}

}  // namespace dlsd
