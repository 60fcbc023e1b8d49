// Basalt's and WoodScape's JSON.
#include <algorithm>
#include <array>

#include "cameras/calibration/formats.h"

namespace dlsd::calib {
namespace {

/// Basalt's name of a model and of its parameters, as key or key:ours where ours has another name.
struct BasaltModel {
  std::string_view type;
  std::string_view model;
  std::array<std::string_view, 8> keys;   ///< Basalt's.
  std::array<std::string_view, 8> names;  ///< Ours, in the same order.
};
constexpr std::array<BasaltModel, 6> kBasaltModels{
    {{"pinhole", "pinhole", {"fx", "fy", "cx", "cy"}, {"fx", "fy", "cx", "cy"}},
     {"kb4",
      "kannala_brandt",
      {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"},
      {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"}},
     {"fov", "fov", {"fx", "fy", "cx", "cy", "w"}, {"fx", "fy", "cx", "cy", "omega"}},
     {"eucm",
      "eucm",
      {"fx", "fy", "cx", "cy", "alpha", "beta"},
      {"fx", "fy", "cx", "cy", "alpha", "beta"}},
     {"ds",
      "double_sphere",
      {"fx", "fy", "cx", "cy", "xi", "alpha"},
      {"fx", "fy", "cx", "cy", "xi", "alpha"}},
     {"ucm", "omni", {"fx", "fy", "cx", "cy", "alpha"}, {"fx", "fy", "cx", "cy", "xi"}}}};

/// The unified model with weights 1 - alpha and alpha instead of 1 and xi, and a focal length to
/// match: alpha = xi / (1 + xi), f = gamma / (1 + xi).
void omniFromUcm(std::vector<double>* params) {
  constexpr double kRounding = 1e-12;  // Relative: what a parameter at its bound may be beyond it.
  const double scale = 1 - params->at(0);
  const std::span<const ParamSpec> specs = paramSpecsOf("omni");
  for (size_t i = 0; i < 3; ++i) {
    double& value = params->at(i);
    value /= scale;
    const double clamped = std::clamp(value, specs[i].min, specs[i].max);
    if (std::abs(value - clamped) <= kRounding * std::abs(clamped)) value = clamped;
  }
}
void ucmFromOmni(std::vector<double>* params) {
  const double scale = 1 + params->at(0);
  params->at(0) /= scale;
  params->at(1) /= scale;
  params->at(2) /= scale;
}

/// Index of a name in a model's parameter table.
size_t indexOf(std::string_view model, std::string_view name) {
  return static_cast<size_t>(&specOf(model, name) - paramSpecsOf(model).data());
}

size_t countOf(const BasaltModel& m) {
  return static_cast<size_t>(std::find(m.keys.begin(), m.keys.end(), "") - m.keys.begin());
}

Camera readBasaltCamera(const Field& entry, std::pair<int, int> size) {
  constexpr std::array<std::string_view, 2> kNeeded{"camera_type", "intrinsics"};
  constexpr std::array<std::string_view, 1> kOptional{"max_field_angle"};
  entry.expectKeys(kNeeded, kOptional);
  const std::vector<std::string_view> types = column(kBasaltModels, &BasaltModel::type);
  const BasaltModel& m = kBasaltModels.at(entry.at("camera_type").oneOf(types));
  const Field intrinsics = entry.at("intrinsics");
  const size_t count = countOf(m);
  intrinsics.expectKeys(std::span(m.keys).first(count));
  std::vector<double> params(count, 0);
  for (size_t i = 0; i < count; ++i) {
    Allowed allowed = allowedBy(specOf(m.model, m.names.at(i)));
    if (m.type == "ucm" && m.keys.at(i) == "alpha") {
      allowed.max = allowed.max / (1 + allowed.max);
    } else if (m.type == "ucm" && m.keys.at(i).starts_with('f')) {
      allowed.min = allowed.min / (1 + specOf(m.model, "xi").max);
    }
    params.at(indexOf(m.model, m.names.at(i))) = intrinsics.at(m.keys.at(i)).number(allowed);
  }
  if (m.type == "ucm") omniFromUcm(&params);
  const double max_field_angle =
      entry.has("max_field_angle") ? entry.at("max_field_angle").maxFieldAngle() : M_PI;
  return entry.camera(m.model, params, size, max_field_angle);
}

constexpr std::array<std::string_view, 1> kValue{"value0"};
constexpr std::array<std::string_view, 1> kBasaltComment{"comment"};
constexpr std::array<std::string_view, 2> kBasaltNeeded{"intrinsics", "resolution"};
/// Poses, IMU, vignette and time, which say nothing about the intrinsics.
constexpr std::array<std::string_view, 15> kBasaltIgnored{"comment",
                                                          "T_imu_cam",
                                                          "calib_accel_bias",
                                                          "calib_gyro_bias",
                                                          "imu_update_rate",
                                                          "accel_noise_std",
                                                          "gyro_noise_std",
                                                          "accel_bias_std",
                                                          "gyro_bias_std",
                                                          "T_mocap_world",
                                                          "T_imu_marker",
                                                          "mocap_time_offset_ns",
                                                          "mocap_to_imu_offset_ns",
                                                          "cam_time_offset_ns",
                                                          "vignette"};

}  // namespace

bool isBasalt(const Document& document) {
  return document.root.find("value0") != nullptr;
}

Loaded readBasalt(const Document& document) {
  document.field().expectKeys(kValue, {}, kBasaltComment);
  const Field value = document.field().at("value0");
  value.expectKeys(kBasaltNeeded, {}, kBasaltIgnored);
  const Field intrinsics = value.at("intrinsics");
  const Field resolution = value.at("resolution");
  if (!intrinsics.node().isList() || intrinsics.node().items.empty()) {
    intrinsics.fail("must be a list of at least one camera");
  }
  const size_t count = intrinsics.node().items.size();
  if (!resolution.node().isList() || resolution.node().items.size() != count) {
    resolution.fail("must be a list of " + std::to_string(count) +
                    " [width, height], one for each of intrinsics");
  }
  Loaded loaded;
  for (size_t i = 0; i < count; ++i) {
    loaded.cameras.push_back(
        {"cam" + std::to_string(i),
         readBasaltCamera(intrinsics.item(i, ""), resolution.item(i, "").resolution())});
  }
  return loaded;
}

std::string writeBasalt(const std::vector<NamedCamera>& cameras) {
  std::string intrinsics;
  std::string resolution;
  for (const NamedCamera& entry : cameras) {
    const Camera& camera = entry.camera;
    const auto* const known =
        std::find_if(kBasaltModels.begin(), kBasaltModels.end(), [&](const BasaltModel& m) {
          return m.model == camera.modelName();
        });
    if (known == kBasaltModels.end()) {
      refuseModel(entry, "basalt", column(kBasaltModels, &BasaltModel::model));
    }
    std::vector<double> params = camera.params();
    if (known->type == "ucm") ucmFromOmni(&params);
    if (!intrinsics.empty()) {
      intrinsics += ",\n";
      resolution += ", ";
    }
    intrinsics += "      {\"camera_type\": \"" + std::string(known->type) + "\"";
    if (camera.maxFieldAngleLimit() < M_PI) {
      intrinsics += ", \"max_field_angle\": " + yamlNumber(camera.maxFieldAngleLimit());
    }
    intrinsics += ", \"intrinsics\": {";
    for (size_t i = 0; i < countOf(*known); ++i) {
      intrinsics += (i > 0 ? ", \"" : "\"") + std::string(known->keys.at(i)) +
                    "\": " + yamlNumber(params.at(indexOf(known->model, known->names.at(i))));
    }
    intrinsics += "}}";
    resolution += std::string("[") + std::to_string(camera.width()) + ", " +
                  std::to_string(camera.height()) + "]";
  }
  return "{\n  \"value0\": {\n    \"intrinsics\": [\n" + intrinsics +
         "\n    ],\n    \"resolution\": [" + resolution + "]\n  }\n}\n";
}

bool isWoodscape(const Document& document) {
  return document.root.find("intrinsic") != nullptr;
}

Loaded readWoodscape(const Document& document) {
  constexpr std::array<std::string_view, 1> kNeeded{"intrinsic"};
  constexpr std::array<std::string_view, 2> kIgnored{"extrinsic", "name"};
  constexpr std::array<std::string_view, 11> kKeys{"model",
                                                   "poly_order",
                                                   "k1",
                                                   "k2",
                                                   "k3",
                                                   "k4",
                                                   "aspect_ratio",
                                                   "cx_offset",
                                                   "cy_offset",
                                                   "width",
                                                   "height"};
  constexpr std::array<std::string_view, 1> kModels{"radial_poly"};
  constexpr std::string_view kModel = "theta_polynomial";
  document.field().expectKeys(kNeeded, {}, kIgnored);
  const Field intrinsic = document.field().at("intrinsic");
  intrinsic.expectKeys(kKeys);
  (void)intrinsic.at("model").oneOf(kModels);
  (void)intrinsic.at("poly_order").integer(4, 4, true);
  std::vector<double> params;
  for (const std::string_view key : {"k1", "k2", "k3", "k4"}) {
    params.push_back(intrinsic.at(key).number(allowedBy(specOf(kModel, key))));
  }
  params.push_back(intrinsic.at("aspect_ratio").number(allowedBy(specOf(kModel, "aspect"))));
  const std::pair<int, int> size{intrinsic.at("width").imageSize(true),
                                 intrinsic.at("height").imageSize(true)};
  // Offsets from the image centre, (size - 1) / 2 in coordinates of pixel centres.
  params.push_back(intrinsic.at("cx_offset").number(allowedBy(specOf(kModel, "cx"))) +
                   (size.first - 1) / 2.0);
  params.push_back(intrinsic.at("cy_offset").number(allowedBy(specOf(kModel, "cy"))) +
                   (size.second - 1) / 2.0);
  return {{{"cam0", intrinsic.camera(kModel, params, size)}}};
}

}  // namespace dlsd::calib
