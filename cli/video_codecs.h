#pragma once
// What of OpenCV's videoio is no virtual function: video_module.cpp has it, which is loaded when a
// video is first opened.

#include <memory>
#include <string>

namespace cv {
class VideoCapture;
class VideoWriter;
}  // namespace cv

namespace dlsd::cli {

struct VideoCodecs {
  /// None if the video can't be decoded.
  std::unique_ptr<cv::VideoCapture> (*openReader)(const std::string& path);
  /// @param codec  Four letters.
  /// None if such videos can't be written.
  std::unique_ptr<cv::VideoWriter> (*openWriter)(
      const std::string& path, const char* codec, double rate, int width, int height);
};

}  // namespace dlsd::cli

extern "C" const dlsd::cli::VideoCodecs dlsd_video_codecs;
