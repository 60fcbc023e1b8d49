#include "evaluation/detections.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <map>
#include <optional>
#include <system_error>

#include "cameras/calibration/files.h"

namespace dlsd {

const std::vector<std::string>& builtinDetectors() {
  static const std::vector<std::string> names{"dlsd", "dlsd-paper"};
  return names;
}

DetectorOptions builtinOptions(const std::string& name) {
  if (name == "dlsd") {
    return {};
  }
  if (name == "dlsd-paper") {
    return DetectorOptions::paper();
  }
  throw InputError(fmt::format(
      "detector \"{}\" is unknown, there are {}", name, fmt::join(builtinDetectors(), ", ")));
}

ImageView viewOf(const Image& image) {
  return {.data = image.bytes.data(),
          .width = image.width,
          .height = image.height,
          .channels = image.channels,
          .stride_bytes = ptrdiff_t{image.width} * image.channels * image.bits / 8,
          .type = image.bits == 16 ? PixelType::kU16 : PixelType::kU8,
          .bgr = false};
}

DetectionLine toDetectionLine(const Camera& camera, const DetectedLine& line) {
  DetectionLine record;
  record.points = imageCurve(camera, line.arc, 0, 1);
  if (record.points.size() < 2) {  // both ends on the rim of the domain
    record.points = {line.from_px, line.to_px};
  }
  record.normal = line.arc.normal;
  record.end_rays_in_cam = {line.arc.from, line.arc.to};
  record.normal_cov = line.normal_cov;
  record.rms_px = line.rms_px;
  record.max_px = line.max_px;
  record.angle_rad = line.arc.angle();
  record.polarity = line.polarity;
  record.score = line.score;
  return record;
}

std::vector<DetectionLine> detectLines(Detector& detector, const Image& image) {
  std::vector<DetectionLine> lines;
  for (const DetectedLine& line : detector.detect(viewOf(image))) {
    lines.push_back(toDetectionLine(detector.camera(), line));
  }
  return lines;
}

std::vector<DetectionRecord> matchToImages(std::vector<DetectionRecord> records,
                                           const std::vector<std::string>& images,
                                           const std::string& folder,
                                           const std::string& source) {
  namespace fs = std::filesystem;
  std::map<std::string, size_t> by_path;
  std::multimap<std::string, size_t> by_stem;
  for (size_t i = 0; i < images.size(); ++i) {
    const fs::path path = fs::path(images[i]).lexically_normal();
    by_path.emplace(path.generic_string(), i);
    by_stem.emplace(path.stem().string(), i);
  }
  std::error_code ignored;  // a path that can't be resolved just isn't the image's
  const fs::path root = fs::weakly_canonical(fs::absolute(folder), ignored);

  const auto imageOf = [&](const std::string& given) {
    const fs::path path(given);
    if (const auto it = by_path.find(path.lexically_normal().generic_string());
        it != by_path.end()) {
      return it->second;
    }
    const fs::path from_here = fs::weakly_canonical(fs::absolute(path), ignored);
    if (const auto it = by_path.find(from_here.lexically_relative(root).generic_string());
        it != by_path.end()) {
      return it->second;
    }
    const auto [first, last] = by_stem.equal_range(path.stem().string());
    if (first == last) {
      throw InputError(
          fmt::format("{}: image \"{}\" is not in the data folder {}", source, given, folder));
    }
    if (std::next(first) != last) {
      throw InputError(fmt::format("{}: image \"{}\" may be {} or {} of the data folder {}",
                                   source,
                                   given,
                                   images[first->second],
                                   images[std::next(first)->second],
                                   folder));
    }
    return first->second;
  };

  std::vector<std::optional<DetectionRecord>> matched(images.size());
  for (DetectionRecord& record : records) {
    std::optional<DetectionRecord>& place = matched[imageOf(record.image)];
    if (place) {
      throw InputError(
          fmt::format("{}: images \"{}\" and \"{}\" are the same image of the data folder",
                      source,
                      place->image,
                      record.image));
    }
    place = std::move(record);
  }
  std::vector<DetectionRecord> ordered;
  for (size_t i = 0; i < images.size(); ++i) {
    if (!matched[i]) {
      throw InputError(fmt::format(
          "{}: has no record for {} (an image without detections has a record with \"lines\": [])",
          source,
          images[i]));
    }
    ordered.push_back(*std::move(matched[i]));
  }
  return ordered;
}

}  // namespace dlsd
