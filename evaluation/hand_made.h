#pragma once
// Hand-made labels and detections with known answers, for the tests of this folder.

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "cameras/arc.h"
#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "cameras/camera.h"
#include "evaluation/dataset_evaluation.h"
#include "synth/dataset/dataset.h"
#include "synth/dataset/records.h"

namespace dlsd::hand_made {

/// 640 x 480 without distortion: straight 3D lines are straight in the image.
inline Camera pinholeCamera() {
  return {Pinhole::fromParams({400, 400, 320, 240}), 640, 480};
}

/// A label between two pixels of the image of `camera`, on the exact curve of the 3D line through
/// them. Strong and long enough for the headline if it is 40 px and 5 degrees.
inline LabelLine label(const Camera& camera,
                       const Eigen::Vector2d& from,
                       const Eigen::Vector2d& to,
                       int carrier) {
  const auto ray0 = camera.unproject(from);
  const auto ray1 = camera.unproject(to);
  if (!ray0 || !ray1) {
    throw std::logic_error("a hand-made label needs pixels that have rays");
  }
  const Arc arc = arcBetween(*ray0, *ray1).value();
  LabelLine line;
  line.id = line.edge = line.carrier = carrier;
  line.points_in_cam = {*ray0, *ray1};
  line.normal = canonicalNormal(arc.normal);
  line.points = imageCurve(camera, arc, 0, 1);
  for (size_t i = 1; i < line.points.size(); ++i) {
    line.length_px += (line.points[i] - line.points[i - 1]).norm();
  }
  line.angle_rad = arc.angle();
  line.contrast = line.contrast_min = 50;
  return line;
}

inline DetectionLine detection(std::vector<Eigen::Vector2d> points) {
  DetectionLine line;
  line.points = std::move(points);
  return line;
}

/// The label's own curve, every point moved by `shift`.
inline DetectionLine shifted(const LabelLine& label, const Eigen::Vector2d& shift) {
  DetectionLine line;
  for (const Eigen::Vector2d& p : label.points) {
    line.points.emplace_back(p + shift);
  }
  return line;
}

inline DetectionLine reversed(DetectionLine line) {
  std::reverse(line.points.begin(), line.points.end());
  return line;
}

/// A frame evaluated as evaluateFrames does.
inline FrameEvaluation frame(const std::string& camera_name,
                             const Camera& camera,
                             const std::vector<LabelLine>& labels,
                             const std::vector<DetectionLine>& detections,
                             nlohmann::ordered_json sensor = nlohmann::ordered_json::object()) {
  FrameEvaluation result;
  result.labels.camera = "cameras/" + camera_name + ".yaml";
  result.labels.lines = labels;
  result.labels.width = camera.width();
  result.labels.height = camera.height();
  result.labels.sensor = std::move(sensor);
  result.detections.lines = detections;
  evaluate(camera, {}, &result);
  return result;
}

/// A fresh empty folder below the system's temporary one, removed at the end.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / (name + "-" + std::to_string(::getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::string operator/(const std::string& name) const {
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

/// A grey 640 x 480 image, darker above and brighter below row `step_row`.
inline Image stepImage(int step_row) {
  Image image;
  image.width = 640;
  image.height = 480;
  for (int y = 0; y < image.height; ++y) {
    image.bytes.insert(image.bytes.end(), size_t(image.width), uint8_t(y < step_row ? 60 : 180));
  }
  return image;
}

/// Writes a dataset of pinhole frames, frame i with the labels given for it and a step at row 200,
/// seen by the cameras "left" and "right" in turn.
inline void writeDataset(const std::string& folder,
                         const std::vector<std::vector<LabelLine>>& labels) {
  for (const char* part : {"/images", "/labels", "/cameras"}) {
    makeFolders(folder + part);
  }
  nlohmann::ordered_json manifest{{"format", kDatasetFormat},
                                  {"cameras", nlohmann::ordered_json::array()},
                                  {"frames", nlohmann::ordered_json::array()}};
  for (const char* name : {"left", "right"}) {
    const std::string file = std::string("cameras/") + name + ".yaml";
    saveCameras(folder + "/" + file, {{"cam0", pinholeCamera()}});
    manifest["cameras"].push_back({{"file", file}});
  }
  for (size_t i = 0; i < labels.size(); ++i) {
    const std::string number = std::string(5, '0') + std::to_string(i);
    LabelRecord record;
    record.image = "images/" + number + ".png";
    record.camera = i % 2 == 0 ? "cameras/left.yaml" : "cameras/right.yaml";
    record.width = 640;
    record.height = 480;
    record.index = i;
    record.sensor = nlohmann::ordered_json::object();
    record.lines = labels[i];
    writeFileAtomically(folder + "/" + record.image, encodePng(stepImage(200)));
    writeFileAtomically(folder + "/labels/" + number + ".json", toJson(record).dump());
    manifest["frames"].push_back(
        {{"image", record.image}, {"labels", "labels/" + number + ".json"}});
  }
  writeFileAtomically(folder + "/manifest.json", manifest.dump());
}

}  // namespace dlsd::hand_made
