// Kalibr's camchain, our native form, and the one-line description of a panorama.
#include <algorithm>
#include <array>
#include <numbers>
#include <optional>

#include "cameras/calibration/formats.h"

namespace dlsd::calib {
namespace {

/// Which model a pair of Kalibr names means. The model's parameters, in the order of its kParams,
/// are the file's intrinsics, its distortion coefficients, and then what may be absent.
struct KalibrModel {
  std::string_view camera_model, distortion_model;
  std::string_view name;      ///< kName of our model.
  size_t intrinsics;          ///< How many of the parameters stand in `intrinsics`,
  size_t coefficients;        ///< and how many in `distortion_coeffs`.
  bool extension = false;     ///< Ours, unknown to Kalibr.
  bool fifth = false;         ///< distortion_coeffs may have one more: an extension.
  std::string_view scalar{};  ///< The last parameter has this key, if it is not 0: an extension.
};
constexpr std::array<KalibrModel, 11> kModels{{
    {"pinhole", "none", "pinhole", 4, 0},
    {"pinhole", "fov", "fov", 4, 1},
    {"pinhole", "equidistant", "kannala_brandt", 4, 4},
    {"pinhole", "radtan", "pinhole_radtan", 4, 4, false, true},
    {"omni", "none", "omni", 5, 0},
    {"omni", "radtan", "omni_radtan", 5, 4, false, false, "skew"},
    {"eucm", "none", "eucm", 6, 0},
    {"ds", "none", "double_sphere", 6, 0},
    {"ocam", "none", "ocam", 14, 0, true},
    {"theta_polynomial", "none", "theta_polynomial", 7, 0, true},
    {"equirectangular", "none", "equirectangular", 4, 0, true},
}};

/// Keys of Kalibr, and of OpenVINS, that say nothing about the intrinsics.
constexpr std::array<std::string_view, 7> kIgnoredKeys{"rostopic",
                                                       "T_cn_cnm1",
                                                       "T_cam_imu",
                                                       "T_imu_cam",
                                                       "cam_overlaps",
                                                       "timeshift_cam_imu",
                                                       "line_delay"};
constexpr std::array<std::string_view, 5> kNeededKeys{
    "camera_model", "intrinsics", "distortion_model", "distortion_coeffs", "resolution"};
constexpr std::string_view kMaxFieldAngle = "max_field_angle";

const KalibrModel& modelOf(const Field& entry) {
  const std::string camera_model = entry.at("camera_model").word();
  const std::string distortion_model = entry.at("distortion_model").word();
  const auto* const known = std::find_if(kModels.begin(), kModels.end(), [&](const KalibrModel& m) {
    return m.camera_model == camera_model && m.distortion_model == distortion_model;
  });
  if (known == kModels.end()) {
    std::string supported;
    for (const KalibrModel& m : kModels) {
      supported += (supported.empty() ? "" : ", ") + std::string(m.camera_model) + " with " +
                   std::string(m.distortion_model);
    }
    entry.at("camera_model")
        .fail(inQuotes(camera_model) + " with distortion_model " + inQuotes(distortion_model) +
              " is not supported, supported are " + supported);
  }
  return *known;
}

Camera readEntry(const Field& entry) {
  if (!entry.node().isMap()) entry.fail("must be a map with " + listed(kNeededKeys));
  // The model decides which extensions its entry may have, but a missing or unknown key is named
  // before it.
  std::vector<std::string_view> optional{kMaxFieldAngle, "skew"};
  entry.expectKeys(kNeededKeys, optional, kIgnoredKeys);
  const KalibrModel& model = modelOf(entry);
  if (model.scalar.empty()) {
    optional.pop_back();
    entry.expectKeys(kNeededKeys, optional, kIgnoredKeys);
  }
  const std::span<const ParamSpec> specs = paramSpecsOf(model.name);
  std::vector<double> params = entry.at("intrinsics").numbers(specs.first(model.intrinsics));
  const Field coefficients = entry.at("distortion_coeffs");
  const bool has_fifth = model.fifth && coefficients.node().items.size() == model.coefficients + 1;
  for (const double k : coefficients.numbers(
           specs.subspan(model.intrinsics, model.coefficients + (has_fifth ? 1 : 0)))) {
    params.push_back(k);
  }
  if (!model.scalar.empty() && entry.has(model.scalar)) {
    params.push_back(entry.at(model.scalar).number(allowedBy(specs.back())));
  }
  params.resize(specs.size(), 0);
  const double max_field_angle =
      entry.has(kMaxFieldAngle) ? entry.at(kMaxFieldAngle).maxFieldAngle() : M_PI;
  return entry.camera(model.name, params, entry.at("resolution").resolution(), max_field_angle);
}

}  // namespace

bool isKalibr(const Document& document) {
  return std::any_of(document.root.keys.begin(),
                     document.root.keys.end(),
                     [](const std::string& key) { return cameraNumber(key).has_value(); });
}

Loaded readKalibr(const Document& document) {
  if (!document.root.isMap()) {
    document.field().fail("is not a Kalibr camchain: a map of cam0, cam1, ... is expected");
  }
  Loaded loaded;
  for (size_t i = 0; i < document.root.keys.size(); ++i) {
    const std::string& name = document.root.keys[i];
    if (!cameraNumber(name)) {
      document.field().fail("unknown key " + inQuotes(name) + ", allowed are cam0, cam1, ...");
    }
    loaded.cameras.push_back({name, readEntry({document.root.items[i], document.source, name})});
  }
  if (loaded.cameras.empty()) {
    document.field().fail("holds no camera, cam0, cam1, ... are expected");
  }
  return loaded;
}

std::string writeKalibr(const std::vector<NamedCamera>& cameras) {
  std::string text;
  for (const NamedCamera& entry : cameras) {
    const Camera& camera = entry.camera;
    const auto* const known =
        std::find_if(kModels.begin(), kModels.end(), [&](const KalibrModel& m) {
          return m.name == camera.modelName();
        });
    if (known == kModels.end()) {
      refuseModel(entry, "kalibr", column(kModels, &KalibrModel::name));
    }
    const KalibrModel& model = *known;
    const std::vector<double> params = camera.params();
    const bool has_fifth = model.fifth && params.back() != 0;
    const auto list = [&](size_t begin, size_t count) {
      std::string out = "[";
      for (size_t i = begin; i < begin + count; ++i) {
        out += (i > begin ? ", " : "") + yamlNumber(params[i]);
      }
      return out + "]";
    };
    text += entry.name + ":\n";
    text += "  camera_model: " + std::string(model.camera_model);
    if (model.extension) text += "  # an extension of dlsd, unknown to Kalibr";
    text += "\n  intrinsics: " + list(0, model.intrinsics);
    text += "\n  distortion_model: " + std::string(model.distortion_model);
    text += "\n  distortion_coeffs: " +
            list(model.intrinsics, model.coefficients + (has_fifth ? 1 : 0));
    if (has_fifth)
      text += "  # k1, k2, p1, p2, k3: the fifth is an extension of dlsd, unknown to Kalibr";
    text += "\n";
    if (!model.scalar.empty() && params.back() != 0) {
      text += "  " + std::string(model.scalar) + ": " + yamlNumber(params.back()) +
              "  # u = fx x + skew y + cx; an extension of dlsd, unknown to Kalibr\n";
    }
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

// model: equirectangular and a resolution, nothing else: the image shows the whole sphere, column x
// the longitude ((x + 1/2) / width - 1/2) 2 pi, row y the elevation (1/2 - (y + 1/2) / height) pi.

bool isPanorama(const Document& document) {
  const Node* const model = document.root.find("model");
  return model != nullptr && model->text == "equirectangular";
}

Loaded readPanorama(const Document& document) {
  constexpr std::array<std::string_view, 2> kKeys{"model", "resolution"};
  constexpr std::array<std::string_view, 1> kPanoramaModels{"equirectangular"};
  const Field root = document.field();
  root.expectKeys(kKeys);
  (void)root.at("model").oneOf(kPanoramaModels);
  const auto [width, height] = root.at("resolution").resolution();
  const double w = width;
  const double h = height;
  const std::array<double, 4> params{
      w / (2 * std::numbers::pi), h / std::numbers::pi, (w - 1) / 2, (h - 1) / 2};
  return {{{"cam0", root.camera("equirectangular", params, {width, height})}}};
}

}  // namespace dlsd::calib
