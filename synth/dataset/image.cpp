#include "synth/dataset/image.h"

#include <algorithm>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>

#include "cameras/calibration/files.h"

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

}  // namespace

Image readImage(const std::string& path) {
  std::string content = readFile(path);
  cv::Mat mat;
  if (!content.empty()) {
    try {
      // IMREAD_UNCHANGED: as stored, not rotated by EXIF.
      mat = cv::imdecode(cv::Mat(1, static_cast<int>(content.size()), CV_8UC1, content.data()),
                         cv::IMREAD_UNCHANGED);
    } catch (const cv::Exception&) {
      mat.release();  // Said below, in our words.
    }
  }
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
  std::vector<uint8_t> png;
  bool ok = false;
  try {
    ok = cv::imencode(".png", mat, png, {cv::IMWRITE_PNG_COMPRESSION, 3});
  } catch (const cv::Exception&) {
    ok = false;
  }
  if (!ok) throw SystemError("an image could not be encoded as PNG");
  return {png.begin(), png.end()};
}

}  // namespace dlsd
