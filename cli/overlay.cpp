#include "cli/overlay.h"

#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

namespace dlsd::cli {
namespace {

/// Eight hues, bright enough on dark and on light ground, neighbours far apart.
const cv::Scalar kColours[] = {{255, 60, 60},
                               {60, 200, 255},
                               {255, 200, 40},
                               {150, 110, 255},
                               {60, 230, 100},
                               {255, 110, 220},
                               {255, 140, 40},
                               {60, 110, 255}};

uint8_t value8(const Image& image, size_t i) {
  if (image.bits == 8) {
    return image.bytes[i];
  }
  uint16_t value = 0;
  std::memcpy(&value, image.bytes.data() + 2 * i, sizeof value);
  return uint8_t((value + 128) / 257);
}

}  // namespace

Image drawOverlay(const Image& image, const std::vector<DetectionLine>& lines) {
  Image drawn;
  drawn.width = image.width;
  drawn.height = image.height;
  drawn.channels = 3;
  const size_t pixels = size_t(image.width) * size_t(image.height);
  drawn.bytes.resize(3 * pixels);
  for (size_t i = 0; i < pixels; ++i) {
    for (size_t c = 0; c < 3; ++c) {
      const size_t channel = image.channels >= 3 ? c : 0;
      drawn.bytes[3 * i + c] = value8(image, i * size_t(image.channels) + channel);
    }
  }
  cv::Mat canvas(drawn.height, drawn.width, CV_8UC3, drawn.bytes.data());
  constexpr int kShift = 4;  // fixed point: 1/16 px
  const int thickness = std::max(1, int(std::lround(image.width / 1000.0)));
  for (size_t i = 0; i < lines.size(); ++i) {
    std::vector<cv::Point> points;
    for (const Eigen::Vector2d& p : lines[i].points) {
      points.emplace_back(int(std::lround(p.x() * (1 << kShift))),
                          int(std::lround(p.y() * (1 << kShift))));
    }
    cv::polylines(
        canvas, points, false, kColours[i % std::size(kColours)], thickness, cv::LINE_AA, kShift);
  }
  return drawn;
}

}  // namespace dlsd::cli
