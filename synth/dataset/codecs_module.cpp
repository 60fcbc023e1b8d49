#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "synth/dataset/codecs.h"

namespace dlsd {
namespace {

cv::Mat decode(const std::string& content) {
  if (content.empty()) return {};
  try {
    // Only read; OpenCV has no const view.
    auto* bytes = const_cast<char*>(content.data());  // NOLINT
    return cv::imdecode(cv::Mat(1, static_cast<int>(content.size()), CV_8UC1, bytes),
                        cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return {};
  }
}

std::vector<uint8_t> encodePng(const cv::Mat& image) {
  std::vector<uint8_t> png;
  try {
    if (!cv::imencode(".png", image, png, {cv::IMWRITE_PNG_COMPRESSION, 3})) png.clear();
  } catch (const cv::Exception&) {
    png.clear();
  }
  return png;
}

}  // namespace
}  // namespace dlsd

const dlsd::ImageCodecs dlsd_image_codecs{dlsd::decode, dlsd::encodePng};
