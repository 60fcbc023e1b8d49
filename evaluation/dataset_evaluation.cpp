#include "evaluation/dataset_evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "cameras/calibration/files.h"
#include "detector/detector.h"
#include "evaluation/detections.h"

namespace dlsd {

Detections detectionsOf(const DetectionRecord& record,
                        const LabelRecord& labels,
                        const std::string& source) {
  if ((record.width != 0 && record.width != labels.width) ||
      (record.height != 0 && record.height != labels.height)) {
    throw InputError(fmt::format("{}: image \"{}\" is {}x{} there, {}x{} in the data folder",
                                 source,
                                 record.image,
                                 record.width,
                                 record.height,
                                 labels.width,
                                 labels.height));
  }
  return {record.lines, record.time_ms, std::nullopt, source};
}

DetectionSource detectionsOfFile(const Dataset& dataset, const std::string& path) {
  std::vector<std::string> images;
  for (const auto& frame : dataset.manifest().at("frames")) {
    images.push_back(frame.at("image").get<std::string>());
  }
  const auto records = std::make_shared<const std::vector<DetectionRecord>>(
      matchToImages(readDetections(path), images, dataset.folder(), path));
  return [records, path]() -> FrameDetections {
    return [records, path](size_t i, const LabelRecord& labels) {
      return detectionsOf(records->at(i), labels, path);
    };
  };
}

DetectionSource detectionsOfDetector(const Dataset& dataset, const std::string& name, bool timed) {
  const DetectorOptions options = builtinOptions(name);
  return [&dataset, options, timed]() -> FrameDetections {
    const auto detectors = std::make_shared<std::map<std::string, Detector>>();
    return [&dataset, options, timed, detectors](size_t, const LabelRecord& labels) {
      auto it = detectors->find(labels.camera);
      if (it == detectors->end()) {
        it = detectors->emplace(labels.camera, Detector(dataset.camera(labels), options)).first;
      }
      Detections detections{
          detectLines(it->second, dataset.image(labels)), std::nullopt, std::nullopt};
      if (timed) {
        detections.time_ms = 1000 * it->second.times().total;
      }
      return detections;
    };
  };
}

namespace {

/// Straight pieces of a Bezier curve: more than its deviation from them at any image size needs.
constexpr int kBezierPieces = 240;

/// Replaces the points of lines by points of the Bezier curves through them.
void followBezier(std::vector<DetectionLine>& lines) {
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::vector<Eigen::Vector2d> points = std::move(lines[i].points);
    if (points.size() < 2 || points.size() > 8) {
      throw std::invalid_argument(fmt::format(
          "detection {} has {} points, a Bezier curve passes through 2 to 8", i, points.size()));
    }
    lines[i].points.clear();
    for (int k = 0; k <= kBezierPieces; ++k) {
      lines[i].points.push_back(interpolatingBezier(points, double(k) / kBezierPieces));
    }
  }
}

std::array<StructuralOutcome, kStructuralKinds> structureOf(
    const LabelRecord& labels,
    const std::vector<StructuralCurve>& curves,
    const FrameOutcome& outcome) {
  std::vector<StructuralCurve> label_curves;
  std::vector<bool> clear;
  for (size_t i = 0; i < labels.lines.size(); ++i) {
    label_curves.push_back(structuralCurve(labels.lines[i].points, labels.width, labels.height));
    clear.push_back(!outcome.conditions[i].faint && !outcome.conditions[i].is_short);
  }
  const std::vector<bool> all(clear.size(), true);
  const auto match = [&](const std::vector<bool>& counts, bool chord) {
    return matchStructure(label_curves, counts, curves, outcome.detection_score, chord);
  };
  return {match(all, false), match(clear, false), match(all, true), match(clear, true)};
}

}  // namespace

void evaluate(const Camera& camera, const EvaluationOptions& options, FrameEvaluation* frame) {
  const LabelRecord& labels = frame->labels;
  std::vector<DetectionLine>& lines = frame->detections.lines;
  const std::vector<DetectionLine> given = options.bezier ? lines : std::vector<DetectionLine>{};
  if (options.bezier) {
    followBezier(lines);
  }
  frame->outcome = evaluateFrame(camera, labels.lines, lines, options, imageNoise(labels));
  std::vector<StructuralCurve> curves;
  for (size_t k = 0; k < lines.size(); ++k) {
    curves.push_back(options.bezier
                         ? structuralCurveOfBezier(given[k].points, labels.width, labels.height)
                         : structuralCurve(lines[k].points, labels.width, labels.height));
  }
  frame->structure = structureOf(labels, curves, frame->outcome);
}

std::string cameraName(const LabelRecord& labels) {
  return std::filesystem::path(labels.camera).stem().string();
}

void evaluateFrames(const Dataset& dataset,
                    const DetectionSource& source,
                    const EvaluationOptions& options,
                    int jobs,
                    const std::function<void(FrameEvaluation&&)>& take) {
  options.check();
  const size_t frames = dataset.size();
  const size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const size_t threads = std::min(std::max<size_t>(frames, 1), jobs > 0 ? size_t(jobs) : cores);

  // Frames finish in any order and are handed over in theirs; a thread that is too far ahead waits,
  // so that few are held at a time.
  std::mutex mutex;
  std::condition_variable handed_over;
  std::map<size_t, FrameEvaluation> finished;
  size_t next_to_start = 0;
  size_t next_to_take = 0;
  std::map<size_t, std::exception_ptr> errors;

  const auto evaluateOne = [&](const FrameDetections& detections, size_t i) {
    FrameEvaluation frame;
    frame.labels = dataset.labels(i);
    try {
      frame.detections = detections(i, frame.labels);
      evaluate(dataset.camera(frame.labels), options, &frame);
    } catch (const std::invalid_argument& error) {
      const std::string& given_by = frame.detections.source;
      throw InputError(fmt::format("{}{}{}/{}: {}",
                                   given_by,
                                   given_by.empty() ? "" : ": ",
                                   dataset.folder(),
                                   frame.labels.image,
                                   error.what()));
    }
    return frame;
  };
  const auto work = [&] {
    std::unique_lock lock(mutex);
    std::optional<FrameDetections> detections;
    while (errors.empty() && next_to_start < frames) {
      const size_t i = next_to_start++;
      lock.unlock();
      std::optional<FrameEvaluation> frame;
      std::exception_ptr error;
      try {
        if (!detections) {
          detections = source();
        }
        frame = evaluateOne(*detections, i);
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      if (error) {
        errors.emplace(i, error);
        break;
      }
      finished.emplace(i, *std::move(frame));
      try {
        for (auto it = finished.begin(); it != finished.end() && it->first == next_to_take;
             it = finished.erase(it), ++next_to_take) {
          take(std::move(it->second));
        }
      } catch (...) {
        errors.emplace(next_to_take, std::current_exception());
      }
      handed_over.notify_all();
      handed_over.wait(
          lock, [&] { return !errors.empty() || next_to_start < next_to_take + 4 * threads; });
    }
    handed_over.notify_all();
  };
  std::vector<std::jthread> pool;
  pool.reserve(threads);
  try {
    while (pool.size() + 1 < threads) {
      pool.emplace_back(work);
    }
  } catch (const std::system_error&) {  // no more threads to be had: those that run do it
  }
  work();
  pool.clear();  // joins
  if (!errors.empty()) {
    std::rethrow_exception(errors.begin()->second);
  }
}

}  // namespace dlsd
