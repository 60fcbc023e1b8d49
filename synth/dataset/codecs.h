#pragma once
// OpenCV's image codecs behind a table of functions, so that what uses them need not be linked
// with them.

#include <cstdint>
#include <string>
#include <vector>

namespace cv {
class Mat;
}

namespace dlsd {

struct ImageCodecs {
  /// What an image file holds, as stored and not rotated by EXIF; empty if it can't be decoded.
  cv::Mat (*decode)(const std::string& content);
  /// Bytes of a PNG file; none if that fails.
  std::vector<uint8_t> (*encodePng)(const cv::Mat& image);
};

/// In the program itself (codecs.cpp), as other projects link it, or in a module that is loaded
/// when first needed (codecs_on_demand.cpp), as our own programs do; throws SystemError without it.
[[nodiscard]] const ImageCodecs& imageCodecs();

}  // namespace dlsd

extern "C" const dlsd::ImageCodecs dlsd_image_codecs;
