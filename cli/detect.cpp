#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cctype>
#include <climits>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "cli/camera_commands.h"
#include "cli/command.h"
#include "cli/overlay.h"
#include "cli/video.h"
#include "detector/detector.h"
#include "evaluation/detections.h"
#include "synth/dataset/dataset.h"

namespace dlsd::cli {
namespace {

struct Arguments {
  std::string camera, format, data, out = "-", overlay, mask;
  std::vector<std::string> images;
  uint64_t every = 1;
  bool paper = false, time = false;
};

/// One image or video to look at: where it is and what its records say.
struct Task {
  std::string path;           ///< From here.
  std::string image, camera;  ///< As in the record; of a video without the frame's number.
  bool video = false;
};

/// One image, or one frame of a video.
struct Frame {
  Image image;
  std::optional<uint64_t> index;
  std::optional<double> stamp_s;
};

struct Work {
  std::vector<Task> tasks;
  std::vector<std::string> inputs;        ///< All files that are read.
  std::map<std::string, Camera> cameras;  ///< By the record's name.
};

bool isVideo(const Task& task) {
  return task.video;
}

/// The images and videos in a folder, by name.
std::vector<std::string> filesToLookAt(const std::string& folder) {
  static constexpr const char* kEndings[] = {
      ".bmp", ".jpeg", ".jpg", ".pbm", ".pgm", ".png", ".pnm", ".ppm", ".tif", ".tiff", ".webp"};
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string path = entry.path().string();
    std::string ending = entry.path().extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) {
      return char(std::tolower(c));
    });
    if (!entry.is_directory() && !entry.path().filename().string().starts_with('.') &&
        (isVideoName(path) ||
         std::find(std::begin(kEndings), std::end(kEndings), ending) != std::end(kEndings))) {
      files.push_back(path);
    }
  }
  if (files.empty()) {
    throw InputError(folder + ": the folder holds no image and no video");
  }
  std::sort(files.begin(), files.end());
  return files;
}

Work workOf(const Arguments& arguments) {
  Work work;
  if (!arguments.data.empty()) {
    if (!arguments.camera.empty() || !arguments.images.empty() || !arguments.format.empty() ||
        arguments.every > 1) {
      throw InputError(
          "--data brings its own images and cameras, neither they nor --format or --every may be "
          "given with it");
    }
    const Dataset dataset(arguments.data);
    work.inputs = filesOf(dataset);
    for (size_t i = 0; i < dataset.size(); ++i) {
      const LabelRecord record = dataset.labels(i);
      work.tasks.push_back({arguments.data + "/" + record.image, record.image, record.camera});
      work.cameras.emplace(record.camera, dataset.camera(record));
    }
    return work;
  }
  if (arguments.camera.empty() || arguments.images.empty()) {
    throw InputError("either --camera and images or --data is needed");
  }
  if (!isUtf8(arguments.camera)) {
    throw InputError(arguments.camera + ": the name is not UTF-8, as the records need it");
  }
  work.inputs.push_back(calibrationFile(arguments.camera));
  work.cameras.emplace(arguments.camera, loadCamera(arguments.camera, arguments.format));
  for (const std::string& given : arguments.images) {
    std::error_code ignored;
    const bool folder = std::filesystem::is_directory(given, ignored);
    for (const std::string& image : folder ? filesToLookAt(given) : std::vector{given}) {
      work.tasks.push_back({image, image, arguments.camera, isVideoName(image)});
      work.inputs.push_back(image);
    }
  }
  if (arguments.every > 1 && std::none_of(work.tasks.begin(), work.tasks.end(), isVideo)) {
    throw InputError("--every is for videos, and none is given");
  }
  return work;
}

/// How many frames all of it is, of videos every Nth; 0 if a video does not tell. Takes the first
/// video's rate along.
size_t framesOf(const std::vector<Task>& tasks, uint64_t every, std::optional<double>* rate) {
  size_t frames = 0;
  bool known = true;
  for (const Task& task : tasks) {
    if (!task.video) {
      ++frames;
      continue;
    }
    try {
      const VideoReader video(task.path);
      known = known && video.announcedFrames();
      frames += (video.announcedFrames().value_or(0) + every - 1) / every;
      *rate = *rate ? *rate : video.rate();
    } catch (const InputError&) {
      // Said when its turn comes.
    }
  }
  return known ? frames : 0;
}

/// Calls take(Frame) for the image, or each frame of the video one after another.
template <class Take>
void forEachFrame(const Task& task, uint64_t every, Take take) {
  if (!task.video) {
    take(Frame{readImage(task.path), std::nullopt, std::nullopt});
    return;
  }
  VideoReader video(task.path);
  while (video.next()) {
    if (video.index() % every == 0) {
      take(Frame{video.image(), video.index(), video.stampS()});
    }
  }
}

/// The pictures with the lines drawn on them: PNG files in a folder, or one video.
class Overlays {
 public:
  /// @param rate  Frames a second of a video.
  Overlays(std::string path, double rate) : path_(std::move(path)), rate_(rate) {}

  /// Throws InputError if they may not be made, or would overwrite each other or inputs.
  void prepare(const Work& work, std::vector<std::string> outputs) {
    if (isVideoName(path_)) {
      VideoWriter::checkName(path_);
      for (const auto& [name, camera] : work.cameras) {
        const Camera& first = work.cameras.begin()->second;
        if (camera.width() != first.width() || camera.height() != first.height()) {
          throw InputError(path_ +
                           ": a video needs images of one size, and those of the cameras "
                           "differ; --overlay takes a folder, too");
        }
      }
      outputs.push_back(path_);
      checkOutputs(work.inputs, outputs);
      checkPlaceForFile(path_);
      return;
    }
    for (const Task& task : work.tasks) {
      outputs.push_back(pathOf(task, 0));
    }
    checkOutputs(work.inputs, outputs);
    checkPlaceForFolder(path_);
    makeFolders(path_);
  }

  void add(const Task& task,
           const Frame& frame,
           const std::vector<DetectionLine>& lines,
           const std::vector<std::string>& inputs) {
    const Image drawn = drawOverlay(frame.image, lines);
    if (isVideoName(path_)) {
      if (!video_) {
        video_.emplace(path_, rate_, drawn.width, drawn.height);
      }
      video_->add(drawn);
      return;
    }
    const std::string path = pathOf(task, frame.index.value_or(0));
    if (task.video) {
      makeFolders(std::filesystem::path(path).parent_path().string());
      checkOutputs(inputs, {path});  // How many there are shows only now.
    }
    writeFileAtomically(path, encodePng(drawn));
  }

  void commit() {
    if (video_) {
      video_->commit();
    }
  }

 private:
  /// overlays/image.png, overlays/video/000007.png.
  [[nodiscard]] std::string pathOf(const Task& task, uint64_t frame) const {
    const std::string stem = path_ + "/" + std::filesystem::path(task.path).stem().string();
    return task.video ? fmt::format("{}/{:06}.png", stem, frame) : stem + ".png";
  }

  std::string path_;
  double rate_;
  std::optional<VideoWriter> video_;
};

/// Lines of an image, outside the mask if there is one.
std::vector<DetectionLine> detectLines(Detector& detector,
                                       const Image& image,
                                       const std::optional<Image>& mask) {
  if (!mask) {
    return dlsd::detectLines(detector, image);
  }
  std::vector<DetectionLine> lines;
  for (const DetectedLine& line : detector.detect(viewOf(image), viewOf(*mask))) {
    lines.push_back(toDetectionLine(detector.camera(), line));
  }
  return lines;
}

/// A mask for images of these cameras.
Image readMask(const std::string& path, const std::map<std::string, Camera>& cameras) {
  Image mask = readImage(path);
  if (mask.channels != 1 || mask.bits != 8) {
    throw InputError(fmt::format(
        "{}: a mask has one channel of 8 bits, this has {} of {}", path, mask.channels, mask.bits));
  }
  for (const auto& [name, camera] : cameras) {
    if (mask.width != camera.width() || mask.height != camera.height()) {
      throw InputError(fmt::format("{}: is {}x{} px, the camera {} is {}x{} px",
                                   path,
                                   mask.width,
                                   mask.height,
                                   name,
                                   camera.width(),
                                   camera.height()));
    }
  }
  return mask;
}

/// Median over the images of each stage's time.
std::string table(const std::vector<StageTimes>& times) {
  constexpr std::pair<const char*, double StageTimes::*> kStages[] = {
      {"gradient", &StageTimes::gradient},
      {"anchors", &StageTimes::anchors},
      {"linking", &StageTimes::linking},
      {"chains", &StageTimes::chains},
      {"planes", &StageTimes::planes},
      {"validation", &StageTimes::validation},
      {"total", &StageTimes::total}};
  std::string text = fmt::format("{:<10}  {:>9}\n", "stage", "median ms");
  for (const auto& [name, stage] : kStages) {
    std::vector<double> ms;
    for (const StageTimes& t : times) {
      ms.push_back(1000 * t.*stage);
    }
    std::sort(ms.begin(), ms.end());
    const double median = (ms[(ms.size() - 1) / 2] + ms[ms.size() / 2]) / 2;
    text += fmt::format("{:<10}  {:>9.3f}\n", name, median);
  }
  return text + fmt::format("{:<10}  {:>9}\n", "images", times.size());
}

/// "1 line", "2 lines".
std::string counted(size_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

int run(const Arguments& arguments) {
  Work work = workOf(arguments);
  std::optional<Image> mask;
  if (!arguments.mask.empty()) {
    mask = readMask(arguments.mask, work.cameras);
    work.inputs.push_back(arguments.mask);
  }
  const bool has_video = std::any_of(work.tasks.begin(), work.tasks.end(), isVideo);
  const std::string noun = has_video ? "frame" : "image";
  std::optional<double> video_rate;
  const size_t total = framesOf(work.tasks, arguments.every, &video_rate);

  const Interruption interruption;
  std::optional<AtomicFile> out;
  std::optional<Overlays> overlays;
  const std::vector<std::string> outputs =
      arguments.out == "-" ? std::vector<std::string>{} : std::vector{arguments.out};
  checkOutputs(work.inputs, outputs);
  if (!outputs.empty()) {
    checkPlaceForFile(arguments.out);
  }
  if (!arguments.overlay.empty()) {
    constexpr double kImagesRate = 10, kVideoRate = 25;
    overlays.emplace(
        arguments.overlay,
        has_video ? video_rate.value_or(kVideoRate) / double(arguments.every) : kImagesRate);
    overlays->prepare(work, outputs);
  }
  if (!outputs.empty()) {
    out.emplace(arguments.out);
  }

  std::map<std::string, Detector> detectors;
  for (const auto& [name, camera] : work.cameras) {
    detectors.emplace(name,
                      Detector(camera, builtinOptions(arguments.paper ? "dlsd-paper" : "dlsd")));
  }

  std::vector<std::string> complaints;
  std::vector<StageTimes> times;
  size_t done = 0, lines = 0;
  {
    Progress progress(noun + "s", total);
    for (const Task& task : work.tasks) {
      Detector& detector = detectors.at(task.camera);
      const Camera& camera = detector.camera();
      const auto take = [&](const Frame& frame) {
        interruption.check(fmt::format("{} done{}",
                                       counted(done, noun),
                                       out ? ", " + arguments.out + " was not written" : ""));
        if (frame.image.width != camera.width() || frame.image.height != camera.height()) {
          throw InputError(fmt::format("{}: is {}x{} px, its camera {} is {}x{} px",
                                       task.path,
                                       frame.image.width,
                                       frame.image.height,
                                       task.camera,
                                       camera.width(),
                                       camera.height()));
        }
        DetectionRecord record;
        record.image = frame.index ? fmt::format("{}#{:06}", task.image, *frame.index) : task.image;
        record.camera = task.camera;
        record.width = frame.image.width;
        record.height = frame.image.height;
        record.frame = frame.index;
        record.stamp_s = frame.stamp_s;
        record.lines = detectLines(detector, frame.image, mask);
        if (arguments.time) {
          times.push_back(detector.times());
          record.time_ms = 1000 * times.back().total;
        }
        if (overlays) {
          overlays->add(task, frame, record.lines, work.inputs);
        }
        const std::string line = toJson(record).dump() + "\n";
        if (out) {
          out->append(line);
        } else {
          print(line);
        }
        lines += record.lines.size();
        progress.done(++done);
      };
      try {
        if (!isUtf8(task.image)) {
          throw InputError(task.path + ": the name is not UTF-8, as a record needs it");
        }
        forEachFrame(task, arguments.every, take);
      } catch (const InputError& error) {
        complaints.emplace_back(error.what());
      }
    }
    if (overlays) {
      overlays->commit();
    }
  }
  std::vector<std::string> places;
  if (complaints.empty() || done > 0) {
    if (out) {
      out->commit();
      places.push_back(arguments.out);
    }
    if (overlays && done > 0) {
      places.push_back(arguments.overlay);
    }
  } else if (out) {
    std::error_code ignored;
    complaints.back() +=
        fmt::format("; {} was not written{}",
                    arguments.out,
                    std::filesystem::exists(arguments.out, ignored) ? " and is as before" : "");
  }
  for (const std::string& complaint : complaints) {
    complain(complaint);
  }
  if (!times.empty()) {
    tell(table(times));
  }
  if (!places.empty()) {
    tell(fmt::format(
        "{}, {}: {}\n", counted(done, noun), counted(lines, "line"), fmt::join(places, ", ")));
  }
  return complaints.empty() ? kDone : kBadInput;
}

}  // namespace

Run addDetect(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  command
      .add_option(
          "--camera", arguments->camera, "Calibration file, or file:camera if it holds several")
      ->type_name("FILE");
  addCalibrationFormat(command, &arguments->format);
  command
      .add_option("images",
                  arguments->images,
                  "Images, videos (known by their endings) or folders with such, all of the "
                  "camera's size")
      ->type_name("FILE");
  command
      .add_option("--data", arguments->data, "Dataset: all its images, each with its own camera")
      ->type_name("DIR");
  command
      .add_option(
          "-o,--out", arguments->out, "Detections, one JSON object per line; - is standard output")
      ->type_name("FILE")
      ->capture_default_str();
  command.add_option("--mask", arguments->mask, "8-bit grey image: no lines where it is black (0)")
      ->type_name("FILE");
  command.add_flag("--paper", arguments->paper, "The algorithm as published, not the default");
  command
      .add_option("--overlay",
                  arguments->overlay,
                  "The images with the detections drawn on them: a folder for PNG files, or a "
                  "video, .mp4 or .avi")
      ->type_name("DIR|FILE");
  command.add_option("--every", arguments->every, "Only frames 0, N, 2N, ... of a video")
      ->type_name("N")
      ->capture_default_str()
      ->check(wholeNumber<uint64_t>(1, INT_MAX));
  command.add_flag("--time",
                   arguments->time,
                   "Add time_ms: how long detection took, reading apart; at the end the median "
                   "time of each stage over the images on standard error");
  command.footer(
      "Examples:\n"
      "  dlsd detect --camera wide.yaml frame.png\n"
      "  dlsd detect --camera rig.yaml:cam0 images --out det.jsonl --overlay overlays\n"
      "  dlsd detect --camera wide.yaml drive.mp4 --out det.jsonl --overlay lines.mp4\n"
      "  dlsd detect --data data --paper --time --out det.jsonl");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
