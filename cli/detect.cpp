#include <fmt/format.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
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
#include "detector/detector.h"
#include "evaluation/detections.h"
#include "synth/dataset/dataset.h"

namespace dlsd::cli {
namespace {

struct Arguments {
  std::string camera, format, data, out = "-", overlay, mask;
  std::vector<std::string> images;
  bool paper = false, time = false;
};

/// One image to look at: where it is and what its record says.
struct Task {
  std::string path;           ///< From here.
  std::string image, camera;  ///< As in the record.
};

struct Work {
  std::vector<Task> tasks;
  std::vector<std::string> inputs;        ///< All files that are read.
  std::map<std::string, Camera> cameras;  ///< By the record's name.
};

Work workOf(const Arguments& arguments) {
  Work work;
  if (!arguments.data.empty()) {
    if (!arguments.camera.empty() || !arguments.images.empty() || !arguments.format.empty()) {
      throw InputError(
          "--data brings its own images and cameras, neither they nor --format may be given with "
          "it");
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
  for (const std::string& image : arguments.images) {
    work.tasks.push_back({image, image, arguments.camera});
    work.inputs.push_back(image);
  }
  return work;
}

std::string overlayPath(const std::string& folder, const Task& task) {
  return folder + "/" + std::filesystem::path(task.path).stem().string() + ".png";
}

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

int run(const Arguments& arguments) {
  Work work = workOf(arguments);
  std::optional<Image> mask;
  if (!arguments.mask.empty()) {
    mask = readMask(arguments.mask, work.cameras);
    work.inputs.push_back(arguments.mask);
  }
  const bool to_stdout = arguments.out == "-";
  std::vector<std::string> outputs;
  if (!to_stdout) {
    outputs.push_back(arguments.out);
  }
  if (!arguments.overlay.empty()) {
    for (const Task& task : work.tasks) {
      outputs.push_back(overlayPath(arguments.overlay, task));
    }
  }
  checkOutputs(work.inputs, outputs);
  if (!to_stdout) {
    checkPlaceForFile(arguments.out);
  }
  if (!arguments.overlay.empty()) {
    makeFolders(arguments.overlay);
  }

  std::map<std::string, Detector> detectors;
  for (const auto& [name, camera] : work.cameras) {
    detectors.emplace(name,
                      Detector(camera, builtinOptions(arguments.paper ? "dlsd-paper" : "dlsd")));
  }

  std::string output;
  std::vector<std::string> complaints;
  std::vector<StageTimes> times;
  {
    Progress progress("images", work.tasks.size());
    for (size_t i = 0; i < work.tasks.size(); ++i) {
      const Task& task = work.tasks[i];
      Detector& detector = detectors.at(task.camera);
      const Camera& camera = detector.camera();
      try {
        if (!isUtf8(task.image)) {
          throw InputError(task.path + ": the name is not UTF-8, as a record needs it");
        }
        const Image image = readImage(task.path);
        if (image.width != camera.width() || image.height != camera.height()) {
          throw InputError(fmt::format("{}: is {}x{} px, its camera {} is {}x{} px",
                                       task.path,
                                       image.width,
                                       image.height,
                                       task.camera,
                                       camera.width(),
                                       camera.height()));
        }
        DetectionRecord record;
        record.image = task.image;
        record.camera = task.camera;
        record.width = image.width;
        record.height = image.height;
        record.lines = detectLines(detector, image, mask);
        if (arguments.time) {
          times.push_back(detector.times());
          record.time_ms = 1000 * times.back().total;
        }
        if (!arguments.overlay.empty()) {
          writeFileAtomically(overlayPath(arguments.overlay, task),
                              encodePng(drawOverlay(image, record.lines)));
        }
        const std::string line = toJson(record).dump() + "\n";
        if (to_stdout) {
          print(line);
        } else {
          output += line;
        }
      } catch (const InputError& error) {
        complaints.emplace_back(error.what());
      }
      progress.done(i + 1);
    }
  }
  if (!to_stdout) {
    if (complaints.empty() || complaints.size() < work.tasks.size()) {
      writeFileAtomically(arguments.out, output);
    } else {
      std::error_code ignored;
      complaints.back() +=
          fmt::format("; {} was not written{}",
                      arguments.out,
                      std::filesystem::exists(arguments.out, ignored) ? " and is as before" : "");
    }
  }
  for (const std::string& complaint : complaints) {
    complain(complaint);
  }
  if (!times.empty()) {
    tell(table(times));
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
  command.add_option("images", arguments->images, "Images, all of the camera's size")
      ->type_name("FILE");
  command
      .add_option("--data", arguments->data, "Dataset: all its images, each with its own camera")
      ->type_name("DIR");
  command
      .add_option(
          "--out", arguments->out, "Detections, one JSON object per line; - is standard output")
      ->type_name("FILE")
      ->capture_default_str();
  command.add_option("--mask", arguments->mask, "8-bit grey image: no lines where it is black (0)")
      ->type_name("FILE");
  command.add_flag("--paper", arguments->paper, "The algorithm as published, not the default");
  command
      .add_option("--overlay",
                  arguments->overlay,
                  "Folder for PNG images with the detections drawn on them")
      ->type_name("DIR");
  command.add_flag("--time",
                   arguments->time,
                   "Add time_ms: how long detection took, reading apart; at the end the median "
                   "time of each stage over the images on standard error");
  command.footer(
      "Examples:\n"
      "  dlsd detect --camera wide.yaml frame.png\n"
      "  dlsd detect --camera rig.yaml:cam0 images/*.png --out det.jsonl --overlay overlays\n"
      "  dlsd detect --data data --paper --time --out det.jsonl");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
