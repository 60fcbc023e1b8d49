#include "cameras/calibration/calibration.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>

#include "cameras/calibration/files.h"

namespace dlsd {
namespace {

/// Which model a pair of Kalibr names means. The model's parameters, in the order of its kParams,
/// are the file's intrinsics followed by its distortion coefficients.
struct KalibrModel {
  std::string_view camera_model, distortion_model;
  std::string_view name;  ///< kName of our model.
  size_t intrinsics;      ///< How many of the parameters stand in `intrinsics`.
};
constexpr std::array<KalibrModel, 5> kKalibrModels{{
    {"pinhole", "none", Pinhole::kName, 4},
    {"pinhole", "fov", Fov::kName, 4},
    {"pinhole", "equidistant", KannalaBrandt::kName, 4},
    {"omni", "none", UnifiedOmni::kName, 5},
    {"eucm", "none", Eucm::kName, 6},
}};

/// Keys of Kalibr that say nothing about the intrinsics.
constexpr std::array<std::string_view, 5> kIgnoredKeys{
    "rostopic", "T_cn_cnm1", "T_cam_imu", "cam_overlaps", "timeshift_cam_imu"};

constexpr std::string_view kCameraModel = "camera_model";
constexpr std::string_view kIntrinsics = "intrinsics";
constexpr std::string_view kDistortionModel = "distortion_model";
constexpr std::string_view kDistortionCoeffs = "distortion_coeffs";
constexpr std::string_view kResolution = "resolution";
constexpr std::string_view kMaxFieldAngle = "max_field_angle";

std::string inQuotes(std::string_view text) {
  constexpr size_t kMaxShown = 60;
  std::string out = "\"";
  for (const char c : text.substr(0, kMaxShown)) out += (c >= ' ' && c < 0x7f) ? c : '?';
  if (text.size() > kMaxShown) out += "...";
  return out + "\"";
}

/// Shortest text that reads back as the same number.
std::string shortest(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

/// The same for YAML: Kalibr's reader takes a number without a decimal point for an integer or,
/// with an exponent, for a string.
std::string yamlNumber(double value) {
  std::string text = shortest(value);
  if (text.find('.') == std::string::npos) {
    text.insert(std::min(text.find('e'), text.size()), ".0");
  }
  return text;
}

std::string range(double lo, double hi) {
  return "[" + shortest(lo) + ", " + shortest(hi) + "]";
}

std::string camerasText(const std::vector<NamedCamera>& cameras) {
  std::string text;
  for (const NamedCamera& c : cameras) text += (text.empty() ? "" : ", ") + c.name;
  return text;
}

bool isCameraName(std::string_view name) {
  if (name.size() < 4 || name.size() > 12 || !name.starts_with("cam")) return false;
  name.remove_prefix(3);
  return std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; }) &&
         (name.size() == 1 || name[0] != '0');
}

/// One entry of a camchain, with what is needed to name a value in a message.
class CameraEntry {
 public:
  CameraEntry(std::string file, std::string name, const YAML::Node& node)
      : file_(std::move(file)), name_(std::move(name)) {
    if (!node.IsMap()) {
      throw InputError(file_ + ": " + name_ + " must be a map with " + std::string(kCameraModel) +
                       ", " + std::string(kIntrinsics) + ", " + std::string(kDistortionModel) +
                       ", " + std::string(kDistortionCoeffs) + " and " + std::string(kResolution));
    }
    std::set<std::string, std::less<>> seen;
    for (const auto& item : node) {
      if (!item.first.IsScalar()) {
        throw InputError(file_ + ": " + name_ + " has a key that is not a plain word");
      }
      const std::string& key = item.first.Scalar();
      if (!seen.insert(key).second) fail(key, "is given twice, allowed is once");
      if (key == kCameraModel) {
        camera_model_ = item.second;
      } else if (key == kIntrinsics) {
        intrinsics_ = item.second;
      } else if (key == kDistortionModel) {
        distortion_model_ = item.second;
      } else if (key == kDistortionCoeffs) {
        distortion_coeffs_ = item.second;
      } else if (key == kResolution) {
        resolution_ = item.second;
      } else if (key == kMaxFieldAngle) {
        max_field_angle_ = item.second;
      } else if (std::find(kIgnoredKeys.begin(), kIgnoredKeys.end(), key) == kIgnoredKeys.end()) {
        throw InputError(file_ + ": " + name_ + " has the unknown key " + inQuotes(key) +
                         ", allowed are " + allowedKeys());
      }
    }
    for (const std::string_view key :
         {kCameraModel, kIntrinsics, kDistortionModel, kDistortionCoeffs, kResolution}) {
      if (!seen.contains(key)) fail(key, "is missing, needed are " + neededKeys());
    }
  }

  [[nodiscard]] Camera camera() const {
    const std::string camera_model = word(kCameraModel, camera_model_);
    const std::string distortion_model = word(kDistortionModel, distortion_model_);
    const auto* const known =
        std::find_if(kKalibrModels.begin(), kKalibrModels.end(), [&](const KalibrModel& m) {
          return m.camera_model == camera_model && m.distortion_model == distortion_model;
        });
    if (known == kKalibrModels.end()) {
      std::string supported;
      for (const KalibrModel& m : kKalibrModels) {
        supported += (supported.empty() ? "" : ", ") + std::string(m.camera_model) + " with " +
                     std::string(m.distortion_model);
      }
      fail(kCameraModel,
           inQuotes(camera_model) + " with " + std::string(kDistortionModel) + " " +
               inQuotes(distortion_model) + " is not supported, supported are " + supported);
    }
    const std::span<const ParamSpec> specs = paramSpecsOf(known->name);
    std::vector<double> params;
    readNumbers(kIntrinsics, intrinsics_, specs.first(known->intrinsics), &params);
    readNumbers(kDistortionCoeffs, distortion_coeffs_, specs.subspan(known->intrinsics), &params);
    const auto [width, height] = size();
    try {
      return makeCamera(known->name, params, width, height, maxFieldAngle());
    } catch (const std::invalid_argument& e) {
      throw InputError(file_ + ": " + name_ + ": " + e.what());
    }
  }

 private:
  [[noreturn]] void fail(std::string_view key, const std::string& problem) const {
    throw InputError(file_ + ": " + name_ + "." + std::string(key) + " " + problem);
  }

  static std::string neededKeys() {
    std::string text;
    for (const std::string_view key :
         {kCameraModel, kIntrinsics, kDistortionModel, kDistortionCoeffs, kResolution}) {
      text += (text.empty() ? "" : ", ") + std::string(key);
    }
    return text;
  }
  static std::string allowedKeys() {
    std::string text = neededKeys() + ", " + std::string(kMaxFieldAngle);
    for (const std::string_view key : kIgnoredKeys) text += ", " + std::string(key);
    return text;
  }

  [[nodiscard]] std::string word(std::string_view key, const YAML::Node& node) const {
    if (!node.IsScalar()) fail(key, "must be one word");
    return node.Scalar();
  }

  /// Text of a number as written. yaml-cpp marks quoted text by the tag "!": that is not a number.
  [[nodiscard]] std::string numberText(const std::string& key,
                                       const YAML::Node& node,
                                       const std::string& allowed) const {
    if (!node.IsScalar()) fail(key, "must be a number, allowed is " + allowed);
    if (node.Tag() == "!") {
      fail(key, "= " + inQuotes(node.Scalar()) + " is text in quotes, allowed is " + allowed);
    }
    return node.Scalar();
  }

  [[nodiscard]] double number(const std::string& key,
                              const YAML::Node& node,
                              const std::string& allowed) const {
    const std::string text = numberText(key, node, allowed);
    const char* begin = text.data();
    const char* const end = begin + text.size();
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
    double value = 0;
    const auto [stop, error] = std::from_chars(begin, end, value);
    if (error != std::errc() || stop != end || !std::isfinite(value)) {
      fail(key, "= " + inQuotes(text) + " is not a finite number, allowed is " + allowed);
    }
    return value;
  }

  void readNumbers(std::string_view key,
                   const YAML::Node& node,
                   std::span<const ParamSpec> specs,
                   std::vector<double>* out) const {
    std::string names;
    for (const ParamSpec& spec : specs)
      names += (names.empty() ? "" : ", ") + std::string(spec.name);
    const std::string wanted =
        "must be a list of " + std::to_string(specs.size()) + " numbers [" + names + "]";
    if (!node.IsSequence()) fail(key, wanted);
    if (node.size() != specs.size()) fail(key, wanted + ", got " + std::to_string(node.size()));
    for (size_t i = 0; i < specs.size(); ++i) {
      const ParamSpec& spec = specs[i];
      const std::string place =
          std::string(key) + "[" + std::to_string(i) + "] (" + std::string(spec.name) + ")";
      const std::string allowed = range(spec.min, spec.max) + " " + std::string(spec.unit);
      const double value = number(place, node[i], allowed);
      if (!(value >= spec.min && value <= spec.max)) {
        fail(place, "= " + shortest(value) + " is out of range, allowed is " + allowed);
      }
      out->push_back(value);
    }
  }

  [[nodiscard]] std::pair<int, int> size() const {
    if (!resolution_.IsSequence() || resolution_.size() != 2) {
      fail(kResolution, "must be a list of 2 whole numbers [width, height]");
    }
    const std::string allowed =
        "a whole number in [1, " + std::to_string(Camera::kMaxImageSize) + "]";
    std::array<int, 2> size{};
    for (size_t i = 0; i < 2; ++i) {
      const std::string place =
          std::string(kResolution) + (i == 0 ? "[0] (width)" : "[1] (height)");
      const std::string text = numberText(place, resolution_[i], allowed);
      const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), size[i]);
      if (error != std::errc() || stop != text.data() + text.size() || size[i] < 1 ||
          size[i] > Camera::kMaxImageSize) {
        fail(place, "= " + inQuotes(text) + " is out of range, allowed is " + allowed);
      }
    }
    return {size[0], size[1]};
  }

  [[nodiscard]] double maxFieldAngle() const {
    if (!max_field_angle_) return M_PI;
    const std::string allowed = "(0, " + shortest(M_PI) + "] rad";
    const std::string key(kMaxFieldAngle);
    const double value = number(key, *max_field_angle_, allowed);
    if (!(value > 0 && value <= M_PI)) {
      fail(key, "= " + shortest(value) + " is out of range, allowed is " + allowed);
    }
    return value;
  }

  std::string file_, name_;
  YAML::Node camera_model_, intrinsics_, distortion_model_, distortion_coeffs_, resolution_;
  std::optional<YAML::Node> max_field_angle_;
};

YAML::Node parseYaml(const std::string& path, const std::string& text) {
  std::vector<YAML::Node> documents;
  try {
    documents = YAML::LoadAll(text);
  } catch (const YAML::Exception& e) {
    throw InputError(path + ": is not complete and correct YAML: line " +
                     std::to_string(e.mark.line + 1) + ", column " +
                     std::to_string(e.mark.column + 1) + ": " + e.msg);
  }
  if (documents.empty() || (documents.size() == 1 && documents[0].IsNull())) {
    throw InputError(path + ": is empty, a camchain with cam0, cam1, ... is expected");
  }
  if (documents.size() > 1) {
    throw InputError(path + ": holds " + std::to_string(documents.size()) +
                     " YAML documents, allowed is one");
  }
  return documents[0];
}

}  // namespace

std::vector<NamedCamera> loadCameras(const std::string& path) {
  const YAML::Node root = parseYaml(path, readFile(path));
  if (!root.IsMap()) {
    throw InputError(path + ": is not a Kalibr camchain: a map of cam0, cam1, ... is expected");
  }
  std::vector<NamedCamera> cameras;
  std::set<std::string> seen;
  for (const auto& item : root) {
    const std::string name = item.first.IsScalar() ? item.first.Scalar() : "";
    if (!isCameraName(name)) {
      throw InputError(path + ": unknown key " + inQuotes(name) + ", allowed are cam0, cam1, ...");
    }
    if (!seen.insert(name).second) {
      throw InputError(path + ": " + name + " is given twice, allowed is once");
    }
    cameras.push_back({name, CameraEntry(path, name, item.second).camera()});
  }
  if (cameras.empty()) {
    throw InputError(path + ": holds no camera, cam0, cam1, ... are expected");
  }
  return cameras;
}

LoadedCalibration loadCalibration(const std::string& path, const std::string& format) {
  if (!format.empty() && format != "kalibr") {
    throw InputError(path + ": unknown calibration format " + inQuotes(format) +
                     ", allowed is kalibr");
  }
  return {"kalibr", "integer coordinates are pixel centres, read as they are", loadCameras(path)};
}

Camera loadCamera(const std::string& path_or_path_and_name) {
  std::string path = path_or_path_and_name, name;
  std::error_code ignored;
  const size_t colon = path.rfind(':');
  if (!std::filesystem::exists(path, ignored) && colon != std::string::npos &&
      std::filesystem::is_regular_file(path.substr(0, colon), ignored)) {
    name = path.substr(colon + 1);
    path.resize(colon);
  }
  const std::vector<NamedCamera> cameras = loadCameras(path);
  if (path == path_or_path_and_name) {
    if (cameras.size() != 1) {
      throw InputError(path + ": holds " + std::to_string(cameras.size()) +
                       " cameras, choose one of " + camerasText(cameras) + " as in " + path + ":" +
                       cameras.front().name);
    }
    return cameras.front().camera;
  }
  for (const NamedCamera& c : cameras) {
    if (c.name == name) return c.camera;
  }
  throw InputError(path + ": holds no camera " + inQuotes(name) + ", allowed are " +
                   camerasText(cameras));
}

std::string kalibrYaml(const std::vector<NamedCamera>& cameras) {
  if (cameras.empty()) throw std::invalid_argument("a camchain needs at least one camera");
  std::set<std::string> seen;
  std::string text;
  for (const NamedCamera& entry : cameras) {
    const std::string& name = entry.name;
    const Camera& camera = entry.camera;
    if (!isCameraName(name) || !seen.insert(name).second) {
      throw std::invalid_argument("camera name " + inQuotes(name) +
                                  " in a camchain: allowed are cam0, cam1, ..., each once");
    }
    const auto* const known =
        std::find_if(kKalibrModels.begin(), kKalibrModels.end(), [&](const KalibrModel& m) {
          return m.name == camera.modelName();
        });
    if (known == kKalibrModels.end()) {
      throw std::invalid_argument(name + ": a camchain cannot say the model " +
                                  std::string(camera.modelName()));
    }
    const std::vector<double> params = camera.params();
    const auto list = [&](size_t begin, size_t end) {
      std::string out = "[";
      for (size_t i = begin; i < end; ++i) out += (i > begin ? ", " : "") + yamlNumber(params[i]);
      return out + "]\n";
    };
    text += name + ":\n";
    text += "  camera_model: " + std::string(known->camera_model) + "\n";
    text += "  intrinsics: " + list(0, known->intrinsics);
    text += "  distortion_model: " + std::string(known->distortion_model) + "\n";
    text += "  distortion_coeffs: " + list(known->intrinsics, params.size());
    // Before the resolution: a file cut off anywhere then lacks a key or a bracket.
    if (camera.maxFieldAngleLimit() < M_PI) {
      text += "  max_field_angle: " + yamlNumber(camera.maxFieldAngleLimit()) +
              "  # rad from the optical axis; an extension of dlsd, unknown to Kalibr\n";
    }
    text += "  resolution: [" + std::to_string(camera.width()) + ", " +
            std::to_string(camera.height()) + "]\n";
  }
  return text;
}

void saveCameras(const std::string& path, const std::vector<NamedCamera>& cameras) {
  writeFileAtomically(path, kalibrYaml(cameras));
}

}  // namespace dlsd
