#include "synth/dataset/records.h"

#include <limits>
#include <string_view>

#include "cameras/calibration/files.h"
#include "cameras/mutant.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::string_view kLabelFormat = "dlsd-labels/1";
constexpr std::string_view kDetectionFormat = "dlsd-detections/1";
constexpr int kMaxInt = std::numeric_limits<int>::max();
constexpr int kMaxSide = 65535;

constexpr std::array<std::string_view, 5> kLineKinds{
    "crease", "silhouette", "material", "wire", "shadow"};
constexpr std::array<std::string_view, 5> kEndKinds{"vertex", "occluder", "border", "rim", "seam"};

template <class Enum>
Enum enumFromJson(const JsonField& field, const std::array<std::string_view, 5>& names) {
  const std::string name = field.text();
  std::string allowed = "must be one of";
  for (size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) return static_cast<Enum>(i);
    allowed += (i == 0 ? " " : ", ") + std::string(names[i]);
  }
  field.fail(allowed);
}

template <int N>
ordered_json vectorJson(const Eigen::Matrix<double, N, 1>& v) {
  ordered_json array = ordered_json::array();
  for (int i = 0; i < N; ++i) array.push_back(v[i]);
  return array;
}

template <int N>
ordered_json matrixJson(const Eigen::Matrix<double, N, N>& m) {
  ordered_json rows = ordered_json::array();
  for (int i = 0; i < N; ++i) {
    rows.push_back(vectorJson<N>(Eigen::Matrix<double, N, 1>(m.row(i).transpose())));
  }
  return rows;
}

ordered_json pointsJson(const std::vector<Eigen::Vector2d>& points) {
  ordered_json array = ordered_json::array();
  for (const auto& p : points) array.push_back(vectorJson<2>(p));
  return array;
}

template <int N>
Eigen::Matrix<double, N, N> matrixFromJson(const JsonField& field) {
  Eigen::Matrix<double, N, N> m;
  const auto rows = field.array(N, N);
  for (int i = 0; i < N; ++i) {
    const auto entries = rows[static_cast<size_t>(i)].array(N, N);
    for (int j = 0; j < N; ++j) m(i, j) = entries[static_cast<size_t>(j)].number();
  }
  return m;
}

std::vector<Eigen::Vector2d> curveFromJson(const JsonField& field) {
  std::vector<Eigen::Vector2d> points;
  for (const JsonField& p : field.array(2)) points.push_back(p.vector2());
  return points;
}

void requireFormat(const JsonField& document, std::string_view format) {
  const JsonField field = document["format"];
  if (field.text() != format) field.fail("must be \"" + std::string(format) + "\"");
}

double atLeastZero(const JsonField& field) {
  const double x = field.number();
  if (!(x >= 0)) field.fail("must be >= 0");
  return x;
}

LabelLine lineFromJson(const JsonField& j) {
  LabelLine line;
  line.id = j["id"].integer(0, kMaxInt);
  line.edge = j["edge"].integer(0, kMaxInt);
  line.carrier = j["carrier"].integer(0, kMaxInt);
  line.kind = enumFromJson<LineKind>(j["kind"], kLineKinds);
  const auto ends = j["points_in_cam"].array(2, 2);
  line.points_in_cam = {ends[0].vector3(), ends[1].vector3()};
  line.normal = j["normal"].unitVector3();
  line.points = curveFromJson(j["points"]);
  const auto kinds = j["ends"].array(2, 2);
  line.ends = {enumFromJson<EndKind>(kinds[0], kEndKinds),
               enumFromJson<EndKind>(kinds[1], kEndKinds)};
  line.length_px = atLeastZero(j["length_px"]);
  line.angle_rad = atLeastZero(j["angle_rad"]);
  line.contrast = atLeastZero(j["contrast"]);
  line.contrast_min = atLeastZero(j[DLSD_MUTANT("record-contrast") ? "contrast" : "contrast_min"]);
  return line;
}

}  // namespace

std::string_view toString(LineKind kind) {
  return kLineKinds[static_cast<size_t>(kind)];
}
std::string_view toString(EndKind kind) {
  return kEndKinds[static_cast<size_t>(kind)];
}

ordered_json toJson(const LabelRecord& record) {
  ordered_json lines = ordered_json::array();
  for (const LabelLine& line : record.lines) {
    lines.push_back({{"id", line.id},
                     {"edge", line.edge},
                     {"carrier", line.carrier},
                     {"kind", toString(line.kind)},
                     {"points_in_cam",
                      {vectorJson<3>(line.points_in_cam[0]), vectorJson<3>(line.points_in_cam[1])}},
                     {"normal", vectorJson<3>(line.normal)},
                     {"points", pointsJson(line.points)},
                     {"ends", {toString(line.ends[0]), toString(line.ends[1])}},
                     {"length_px", line.length_px},
                     {"angle_rad", line.angle_rad},
                     {"contrast", line.contrast},
                     {"contrast_min", line.contrast_min}});
  }
  ordered_json junctions = ordered_json::array();
  for (const Junction& junction : record.junctions) {
    junctions.push_back({{"point", vectorJson<2>(junction.point)},
                         {"degree", junction.lines.size()},
                         {"lines", junction.lines}});
  }
  return {{"format", kLabelFormat},
          {"image", record.image},
          {"camera", record.camera},
          {"width", record.width},
          {"height", record.height},
          {"seed", record.seed},
          {"index", record.index},
          {"cam_from_world", matrixJson<4>(record.cam_from_world)},
          {"sensor", record.sensor},
          {"lines", std::move(lines)},
          {"junctions", std::move(junctions)}};
}

ordered_json toJson(const DetectionRecord& record) {
  ordered_json lines = ordered_json::array();
  for (const DetectionLine& line : record.lines) {
    ordered_json j{{"points", pointsJson(line.points)}};
    if (line.normal) j["normal"] = vectorJson<3>(*line.normal);
    if (line.end_rays_in_cam) {
      j["end_rays_in_cam"] = {vectorJson<3>((*line.end_rays_in_cam)[0]),
                              vectorJson<3>((*line.end_rays_in_cam)[1])};
    }
    if (line.normal_cov) j["normal_cov"] = matrixJson<3>(*line.normal_cov);
    if (line.rms_px) j["rms_px"] = *line.rms_px;
    if (line.max_px) j["max_px"] = *line.max_px;
    if (line.angle_rad) j["angle_rad"] = *line.angle_rad;
    if (line.polarity) j["polarity"] = *line.polarity;
    if (line.score) j["score"] = *line.score;
    lines.push_back(std::move(j));
  }
  ordered_json out{{"format", kDetectionFormat}, {"image", record.image}};
  if (!record.camera.empty()) out["camera"] = record.camera;
  if (record.width > 0) out["width"] = record.width;
  if (record.height > 0) out["height"] = record.height;
  if (record.frame) out["frame"] = *record.frame;
  if (record.stamp_s) out["stamp_s"] = *record.stamp_s;
  out["lines"] = std::move(lines);
  if (record.time_ms) out["time_ms"] = *record.time_ms;
  return out;
}

LabelRecord labelRecordFromJson(const json& document, const std::string& source) {
  const JsonField j(document, source);
  requireFormat(j, kLabelFormat);
  LabelRecord record;
  record.image = j["image"].text();
  record.camera = j["camera"].text();
  record.width = j["width"].integer(1, kMaxSide);
  record.height = j["height"].integer(1, kMaxSide);
  record.seed = j["seed"].counter();
  record.index = j["index"].counter();
  record.cam_from_world = matrixFromJson<4>(j["cam_from_world"]);
  const JsonField sensor = j["sensor"];
  if (!sensor.raw().is_object()) sensor.fail("must be an object");
  record.sensor = sensor.raw();
  for (const JsonField& line : j["lines"].array()) record.lines.push_back(lineFromJson(line));
  for (const JsonField& field : j["junctions"].array()) {
    Junction junction;
    junction.point = field["point"].vector2();
    for (const JsonField& id : field["lines"].array(2)) {
      junction.lines.push_back(id.integer(0, kMaxInt));
    }
    const int lines = static_cast<int>(junction.lines.size());
    (void)field["degree"].integer(lines, lines);
    record.junctions.push_back(std::move(junction));
  }
  return record;
}

DetectionRecord detectionRecordFromJson(const json& document, const std::string& source) {
  const JsonField j(document, source);
  if (j.has("format")) requireFormat(j, kDetectionFormat);
  DetectionRecord record;
  record.image = j["image"].text();
  if (j.has("camera")) record.camera = j["camera"].text();
  if (j.has("width")) record.width = j["width"].integer(1, kMaxSide);
  if (j.has("height")) record.height = j["height"].integer(1, kMaxSide);
  if (j.has("frame")) record.frame = j["frame"].counter();
  if (j.has("stamp_s")) record.stamp_s = atLeastZero(j["stamp_s"]);
  if (j.has("time_ms")) record.time_ms = atLeastZero(j["time_ms"]);
  for (const JsonField& field : j["lines"].array()) {
    DetectionLine line;
    line.points = curveFromJson(field["points"]);
    if (field.has("normal")) line.normal = field["normal"].unitVector3();
    if (field.has("end_rays_in_cam")) {
      const auto rays = field["end_rays_in_cam"].array(2, 2);
      line.end_rays_in_cam = {rays[0].unitVector3(), rays[1].unitVector3()};
    }
    if (field.has("normal_cov")) line.normal_cov = matrixFromJson<3>(field["normal_cov"]);
    if (field.has("rms_px")) line.rms_px = atLeastZero(field["rms_px"]);
    if (field.has("max_px")) line.max_px = atLeastZero(field["max_px"]);
    if (field.has("angle_rad")) line.angle_rad = atLeastZero(field["angle_rad"]);
    if (field.has("score")) line.score = field["score"].number();
    if (field.has("polarity")) {
      line.polarity = field["polarity"].integer(-1, 1);
      if (*line.polarity == 0) field["polarity"].fail("must be 1 or -1");
    }
    record.lines.push_back(std::move(line));
  }
  return record;
}

std::vector<DetectionRecord> readDetections(const std::string& path) {
  const std::string content = readFile(path);
  std::vector<DetectionRecord> records;
  std::string_view rest = content;
  for (int number = 1; !rest.empty(); ++number) {
    const size_t end = rest.find('\n');
    const std::string_view line = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const std::string source = path + " line " + std::to_string(number);
    records.push_back(detectionRecordFromJson(parseJson(line, source), source));
  }
  return records;
}

}  // namespace dlsd
