#include <opencv2/videoio.hpp>

#include "cli/video_codecs.h"

namespace dlsd::cli {
namespace {

std::unique_ptr<cv::VideoCapture> openReader(const std::string& path) {
  auto reader = std::make_unique<cv::VideoCapture>();
  if (!reader->open(
          path, cv::CAP_FFMPEG, {cv::CAP_PROP_HW_ACCELERATION, cv::VIDEO_ACCELERATION_NONE})) {
    return nullptr;
  }
  return reader;
}

std::unique_ptr<cv::VideoWriter> openWriter(
    const std::string& path, const char* codec, double rate, int width, int height) {
  auto writer = std::make_unique<cv::VideoWriter>();
  const int fourcc = cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]);
  if (!writer->open(path, cv::CAP_FFMPEG, fourcc, rate, cv::Size(width, height))) return nullptr;
  return writer;
}

}  // namespace
}  // namespace dlsd::cli

const dlsd::cli::VideoCodecs dlsd_video_codecs{dlsd::cli::openReader, dlsd::cli::openWriter};
