#pragma once
// Video files, read and written frame by frame. The only files of ours behind which OpenCV's
// videoio stands, and behind that FFmpeg.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "synth/dataset/image.h"

namespace cv {
class VideoCapture;
class VideoWriter;
}  // namespace cv

namespace dlsd::cli {

/// Whether the name ends as those of videos do (.mp4, .MOV, ...).
[[nodiscard]] bool isVideoName(const std::string& path);

/// A video file, whose frames come one after another; of them only one is kept.
class VideoReader {
 public:
  /// Throws InputError if it is no regular file or no video that can be decoded.
  explicit VideoReader(const std::string& path);
  ~VideoReader();
  VideoReader(const VideoReader&) = delete;
  VideoReader& operator=(const VideoReader&) = delete;

  /// Frames a second and number of frames as the file announces them: the number is an estimate in
  /// some formats. None if it does not, or nonsense.
  [[nodiscard]] std::optional<double> rate() const { return rate_; }
  [[nodiscard]] std::optional<uint64_t> announcedFrames() const { return announced_; }

  /// Goes on to the next frame (first to the first); false if there is none. Throws InputError if
  /// there has been none at all, or if many fewer than announced.
  [[nodiscard]] bool next();

  /// The frame: number from 0; R, G, B of 8 bit as stored, never rotated; when it is shown, seconds
  /// from the start of the video, where that is known.
  [[nodiscard]] uint64_t index() const { return count_ - 1; }
  [[nodiscard]] Image image() const;
  [[nodiscard]] std::optional<double> stampS() const { return stamp_s_; }

 private:
  std::string path_;
  std::unique_ptr<cv::VideoCapture> capture_;
  std::optional<double> rate_, stamp_s_;
  std::optional<uint64_t> announced_;
  uint64_t count_ = 0;
  double last_stamp_s_ = -1;
};

/// A video that grows beside its place and is put there by commit(), as AtomicFile does it.
class VideoWriter {
 public:
  /// Throws InputError unless the name ends in .avi (Motion JPEG) or .mp4 (H.264, else MPEG-4).
  static void checkName(const std::string& path);

  /// Throws SystemError if the video can't be written, as all here.
  VideoWriter(const std::string& path, double rate, int width, int height);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;
  /// @param image  R, G, B of 8 bit in the size of the video.
  void add(const Image& image);
  void commit();

 private:
  std::string path_, target_, temporary_;
  int width_, height_;
  std::unique_ptr<cv::VideoWriter> writer_;
  uint64_t count_ = 0;
};

}  // namespace dlsd::cli
