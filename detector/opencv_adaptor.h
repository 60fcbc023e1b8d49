#pragma once
// cv::Mat as an ImageView. Header only and included by nothing in the library: who uses it brings
// OpenCV along.

#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>

#include "detector/image_view.h"

namespace dlsd {

/// Borrows the matrix, region of interest included; valid while its data lives. Channels are taken
/// as OpenCV's B, G, R. CV_32F values are grey levels on the 8-bit scale, as ImageView has them.
/// Throws std::invalid_argument for a depth other than CV_8U, CV_16U, CV_32F or not 2 dimensions.
[[nodiscard]] inline ImageView viewOf(const cv::Mat& image) {
  if (image.dims != 2) throw std::invalid_argument("image must have two dimensions");
  ImageView view;
  switch (image.depth()) {
    case CV_8U:
      view.type = PixelType::kU8;
      break;
    case CV_16U:
      view.type = PixelType::kU16;
      break;
    case CV_32F:
      view.type = PixelType::kF32;
      break;
    default:
      throw std::invalid_argument("image has OpenCV depth " + std::to_string(image.depth()) +
                                  ": allowed are CV_8U, CV_16U and CV_32F");
  }
  view.data = image.data;
  view.width = image.cols;
  view.height = image.rows;
  view.channels = image.channels();
  view.stride_bytes = static_cast<ptrdiff_t>(image.step[0]);
  view.bgr = true;
  return view;
}

}  // namespace dlsd
