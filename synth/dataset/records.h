#pragma once
// The records of docs/dataset-format.md as values, and their JSON.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace dlsd {

enum class LineKind { kCrease, kSilhouette, kMaterial, kWire, kShadow };
enum class EndKind { kVertex, kOccluder, kBorder, kRim, kSeam };

/// One visible span of one scene edge.
struct LabelLine {
  int id = 0;
  int edge = 0;     ///< Scene edge.
  int carrier = 0;  ///< Infinite 3D line that the edge lies on; several edges may share one.
  LineKind kind = LineKind::kCrease;
  std::array<Eigen::Vector3d, 2> points_in_cam;  ///< 3D ends of the visible span, metres.
  Eigen::Vector3d normal;                        ///< Unit, camera frame, canonical sign.
  std::vector<Eigen::Vector2d> points;           ///< Image curve, chord error <= 0.01 px.
  std::array<EndKind, 2> ends{};
  double length_px = 0, angle_rad = 0;
  double contrast = 0, contrast_min = 0;  ///< 8-bit grey levels across the edge: mean and least.
};

struct Junction {
  Eigen::Vector2d point;
  std::vector<int> lines;  ///< Ids of the labels that meet here.
};

/// labels/NNNNNN.json, format "dlsd-labels/1".
struct LabelRecord {
  std::string image;   ///< "images/000000.png", relative to the data folder.
  std::string camera;  ///< "cameras/NAME.yaml", relative to the data folder.
  int width = 0, height = 0;
  uint64_t seed = 0, index = 0;
  Eigen::Matrix4d cam_from_world = Eigen::Matrix4d::Identity();
  nlohmann::ordered_json sensor;  ///< What was switched on, with parameters.
  std::vector<LabelLine> lines;
  std::vector<Junction> junctions;
};

/// One detected line. Only `points` is required in a file.
struct DetectionLine {
  std::vector<Eigen::Vector2d> points;
  std::optional<Eigen::Vector3d> normal;
  std::optional<std::array<Eigen::Vector3d, 2>> end_rays_in_cam;
  std::optional<Eigen::Matrix3d> normal_cov;
  std::optional<double> rms_px, max_px, angle_rad, score;
  std::optional<int> polarity;
};

/// One line of a detections file, format "dlsd-detections/1".
struct DetectionRecord {
  std::string image;
  std::string camera;
  int width = 0, height = 0;
  std::vector<DetectionLine> lines;
  std::optional<double> time_ms;
  std::optional<uint64_t> frame;  ///< Of a video, from 0.
  std::optional<double> stamp_s;  ///< When the frame is shown, from the start of the video.
};

[[nodiscard]] std::string_view toString(LineKind kind);
[[nodiscard]] std::string_view toString(EndKind kind);

[[nodiscard]] nlohmann::ordered_json toJson(const LabelRecord& record);
[[nodiscard]] nlohmann::ordered_json toJson(const DetectionRecord& record);

/// `source` names the file (and line) in messages. Throw InputError (calibration/files.h) with
/// source, key, value and what is allowed, for anything missing, of the wrong type, not finite or
/// unknown.
[[nodiscard]] LabelRecord labelRecordFromJson(const nlohmann::json& json,
                                              const std::string& source);
[[nodiscard]] DetectionRecord detectionRecordFromJson(const nlohmann::json& json,
                                                      const std::string& source);

/// A detections file: JSON Lines, one object per image. Blank lines are skipped.
[[nodiscard]] std::vector<DetectionRecord> readDetections(const std::string& path);

}  // namespace dlsd
