#include "cli/video.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "cameras/calibration/files.h"
#include "cli/video_codecs.h"
#include "synth/dataset/module.h"

namespace dlsd::cli {
namespace {

namespace fs = std::filesystem;

/// The ending of the name in lower case, with its dot.
std::string endingOf(const std::string& path) {
  std::string ending = fs::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) {
    return char(std::tolower(c));
  });
  return ending;
}

const VideoCodecs& videoCodecs() {
  static const auto& codecs =
      *static_cast<const VideoCodecs*>(moduleTable("video", "dlsd_video_codecs"));
  return codecs;
}

}  // namespace

bool isVideoName(const std::string& path) {
  static constexpr const char* kEndings[] = {".3gp",
                                             ".avi",
                                             ".flv",
                                             ".m2ts",
                                             ".m4v",
                                             ".mkv",
                                             ".mov",
                                             ".mp4",
                                             ".mpeg",
                                             ".mpg",
                                             ".mts",
                                             ".ogv",
                                             ".ts",
                                             ".webm",
                                             ".wmv"};
  return std::find(std::begin(kEndings), std::end(kEndings), endingOf(path)) != std::end(kEndings);
}

VideoReader::VideoReader(const std::string& path) : path_(path) {
  std::error_code error;
  if (!fs::exists(path, error)) {
    throw InputError(path + ": cannot be read: " +
                     std::make_error_code(std::errc::no_such_file_or_directory).message());
  }
  if (!fs::is_regular_file(path, error)) {
    throw InputError(path + ": is no regular file, as a video must be");
  }
  // An absolute path, lest FFmpeg takes what is before a colon for a protocol.
  capture_ = videoCodecs().openReader(fs::absolute(path).string());
  if (capture_ == nullptr) {
    throw InputError(path + ": not a video that can be decoded (unknown, truncated or damaged)");
  }
  capture_->set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
  // Formats that know no rate are given their clock's.
  constexpr double kMostRate = 1000;
  const double rate = capture_->get(cv::CAP_PROP_FPS);
  if (!(rate > 0 && rate <= kMostRate)) {
    return;
  }
  rate_ = rate;
  constexpr double kMostFrames = 1e12;
  const double frames = capture_->get(cv::CAP_PROP_FRAME_COUNT);
  if (frames >= 1 && frames <= kMostFrames) {
    announced_ = uint64_t(frames);
  }
}

VideoReader::~VideoReader() = default;

bool VideoReader::next() {
  if (capture_->grab()) {
    ++count_;
    // The last frames of some videos come without their times.
    const double stamp_s = capture_->get(cv::CAP_PROP_POS_MSEC) / 1000;
    stamp_s_ = stamp_s > last_stamp_s_ && std::isfinite(stamp_s) && stamp_s >= 0
                   ? std::optional(stamp_s)
                   : std::nullopt;
    last_stamp_s_ = stamp_s_.value_or(last_stamp_s_);
    return true;
  }
  if (count_ == 0) {
    throw InputError(path_ + ": no frame of the video can be decoded");
  }
  // Both, since the number may be an estimate, and times may be missing.
  constexpr double kMissing = 0.01, kMissingS = 0.5;
  if (announced_) {
    const double announced = double(*announced_), duration_s = announced / *rate_;
    if (double(count_) < (1 - kMissing) * announced &&
        last_stamp_s_ < duration_s - std::max(kMissingS, kMissing * duration_s)) {
      throw InputError(
          fmt::format("{}: truncated or damaged video: only {} of {} frames could be "
                      "decoded",
                      path_,
                      count_,
                      *announced_));
    }
  }
  return false;
}

Image VideoReader::image() const {
  cv::Mat bgr;
  if (!capture_->retrieve(bgr) || bgr.type() != CV_8UC3) {
    throw InputError(fmt::format("{}: frame {} cannot be decoded", path_, index()));
  }
  Image image{bgr.cols, bgr.rows, 3, 8, std::vector<uint8_t>(bgr.total() * 3)};
  cv::Mat rgb(bgr.rows, bgr.cols, CV_8UC3, image.bytes.data());
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return image;
}

void VideoWriter::checkName(const std::string& path) {
  const std::string ending = endingOf(path);
  if (ending != ".avi" && ending != ".mp4") {
    throw InputError(path + ": videos are written as .avi or .mp4");
  }
}

VideoWriter::VideoWriter(const std::string& path, double rate, int width, int height)
    : path_(path), width_(width), height_(height) {
  const std::string ending = endingOf(path);
  std::error_code ignored;
  target_ = fs::exists(path, ignored) ? fs::canonical(path, ignored).string()
                                      : fs::absolute(path, ignored).string();
  // FFmpeg goes by the ending.
  temporary_ = fmt::format("{}.tmp-{}{}", target_, ::getpid(), ending);
  const std::vector<const char*> codecs =
      ending == ".avi" ? std::vector{"MJPG"} : std::vector{"avc1", "mp4v"};
  for (const char* codec : codecs) {
    writer_ = videoCodecs().openWriter(temporary_, codec, rate, width, height);
    if (writer_ != nullptr) {
      return;
    }
    fs::remove(temporary_, ignored);
  }
  throw SystemError(path + ": cannot be written: OpenCV cannot make such a video here");
}

VideoWriter::~VideoWriter() {
  std::error_code ignored;
  writer_->release();
  fs::remove(temporary_, ignored);
}

void VideoWriter::add(const Image& image) {
  if (image.width != width_ || image.height != height_ || image.channels != 3 || image.bits != 8) {
    throw std::invalid_argument("VideoWriter::add: an image that the video is not made for");
  }
  // Only read; OpenCV has no const view.
  const cv::Mat rgb(height_, width_, CV_8UC3, const_cast<uint8_t*>(image.bytes.data()));  // NOLINT
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  writer_->write(bgr);
  ++count_;
}

void VideoWriter::commit() {
  writer_->release();
  // OpenCV does not tell whether all arrived: a full disk shows here.
  uint64_t written = 0;
  try {
    written = VideoReader(temporary_).announcedFrames().value_or(0);
  } catch (const InputError&) {
    written = 0;
  }
  if (written < count_) {
    throw SystemError(path_ + ": cannot be written: the video is not whole (disk full?)");
  }
  std::error_code error;
  fs::rename(temporary_, target_, error);
  if (error) {
    throw SystemError(path_ + ": cannot be written: " + error.message());
  }
}

}  // namespace dlsd::cli
