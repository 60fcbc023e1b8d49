// Settings of SLAM systems: camodocal's cameras (VINS-Mono, VINS-Fusion) and ORB-SLAM3.
#include <algorithm>
#include <array>
#include <cmath>

#include "cameras/calibration/formats.h"
#include "cameras/mutant.h"

namespace dlsd::calib {
namespace {

using Names = std::span<const std::string_view>;

/// Values of these keys as parameters of a model: keys[i] is the model's parameter first + i.
std::vector<double> numbersAt(const Field& map,
                              Names keys,
                              std::string_view model,
                              size_t first = 0) {
  std::vector<double> values;
  for (size_t i = 0; i < keys.size(); ++i) {
    values.push_back(map.at(keys[i]).number(allowedBy(paramSpecsOf(model)[first + i])));
  }
  return values;
}

constexpr std::array<std::string_view, 4> kRadtan{"k1", "k2", "p1", "p2"};

// camodocal

constexpr std::array<std::string_view, 3> kCamodocalNeeded{
    "model_type", "image_width", "image_height"};
/// What stands beside the camera, in VINS settings that hold it as well.
constexpr std::array<std::string_view, 62> kCamodocalIgnored{"camera_name",
                                                             "imu",
                                                             "num_of_cam",
                                                             "imu_topic",
                                                             "image_topic",
                                                             "image0_topic",
                                                             "image1_topic",
                                                             "output_path",
                                                             "cam0_calib",
                                                             "cam1_calib",
                                                             "estimate_extrinsic",
                                                             "extrinsicRotation",
                                                             "extrinsicTranslation",
                                                             "body_T_cam0",
                                                             "body_T_cam1",
                                                             "ex_calib_result_path",
                                                             "vins_out_path",
                                                             "multiple_thread",
                                                             "max_cnt",
                                                             "min_dist",
                                                             "freq",
                                                             "F_threshold",
                                                             "show_track",
                                                             "flow_back",
                                                             "equalize",
                                                             "fisheye",
                                                             "fisheye_mask",
                                                             "max_solver_time",
                                                             "max_num_iterations",
                                                             "keyframe_parallax",
                                                             "acc_n",
                                                             "gyr_n",
                                                             "acc_w",
                                                             "gyr_w",
                                                             "g_norm",
                                                             "loop_closure",
                                                             "load_previous_pose_graph",
                                                             "fast_relocalization",
                                                             "pose_graph_save_path",
                                                             "save_image",
                                                             "estimate_td",
                                                             "td",
                                                             "rolling_shutter",
                                                             "rolling_shutter_tr",
                                                             "visualize_imu_forward",
                                                             "visualize_camera_size",
                                                             "pattern_file",
                                                             "voc_file",
                                                             "min_loop_num",
                                                             "loop_closure_on",
                                                             "support_path",
                                                             "publish_rate",
                                                             "use_imu",
                                                             "world_frame_id",
                                                             "imu_frame_id",
                                                             "body_frame_id",
                                                             "camera_frame_id",
                                                             "skip_cnt",
                                                             "skip_dis",
                                                             "CENTER_X",
                                                             "CENTER_Y",
                                                             "MIN_R"};

Camera camodocalKannalaBrandt(const Field& root, std::pair<int, int> size) {
  constexpr std::array<std::string_view, 8> kKeys{"mu", "mv", "u0", "v0", "k2", "k3", "k4", "k5"};
  const Field projection = root.at("projection_parameters");
  projection.expectKeys(kKeys);
  return root.camera("kannala_brandt", numbersAt(projection, kKeys, "kannala_brandt"), size);
}

Camera camodocalPinhole(const Field& root, std::pair<int, int> size) {
  constexpr std::array<std::string_view, 4> kKeys{"fx", "fy", "cx", "cy"};
  const Field projection = root.at("projection_parameters");
  const Field distortion = root.at("distortion_parameters");
  projection.expectKeys(kKeys);
  distortion.expectKeys(kRadtan);
  std::vector<double> k = numbersAt(distortion, kRadtan, "pinhole_radtan", kKeys.size());
  k.push_back(0);
  return root.pinholeOrRadtan(numbersAt(projection, kKeys, "pinhole"), k, size);
}

Camera camodocalMei(const Field& root, std::pair<int, int> size) {
  constexpr std::array<std::string_view, 1> kMirror{"xi"};
  constexpr std::array<std::string_view, 4> kKeys{"gamma1", "gamma2", "u0", "v0"};
  const Field mirror = root.at("mirror_parameters");
  const Field projection = root.at("projection_parameters");
  const Field distortion = root.at("distortion_parameters");
  mirror.expectKeys(kMirror);
  projection.expectKeys(kKeys);
  distortion.expectKeys(kRadtan);
  std::vector<double> params = numbersAt(mirror, kMirror, "omni");
  for (const double x : numbersAt(projection, kKeys, "omni", 1)) params.push_back(x);
  std::vector<double> k = numbersAt(distortion, kRadtan, "omni_radtan", params.size());
  k.push_back(0);
  return root.omniOrRadtan(params, k, size);
}

/// camodocal: (u, v) = [ac ad; ae 1] (x, y) + (cx, cy) and the ray (x, y, -f(rho)), f(rho) = sum
/// p_i rho^i. Ours: (u, v) = [1 e; d c] (x', y') + (cx, cy). Both are equal for x' = ac x, y' = ac
/// y, f'(rho') = ac f(rho' / ac).
Camera camodocalScaramuzza(const Field& root, std::pair<int, int> size) {
  constexpr std::array<std::string_view, 5> kPoly{"p0", "p1", "p2", "p3", "p4"};
  constexpr std::array<std::string_view, 20> kInverse{
      "p0",  "p1",  "p2",  "p3",  "p4",  "p5",  "p6",  "p7",  "p8",  "p9",
      "p10", "p11", "p12", "p13", "p14", "p15", "p16", "p17", "p18", "p19"};
  constexpr std::array<std::string_view, 5> kAffine{"ac", "ad", "ae", "cx", "cy"};
  const Field poly = root.at("poly_parameters");
  const Field affine = root.at("affine_parameters");
  poly.expectKeys(kPoly);
  affine.expectKeys(kAffine);
  if (root.has("inv_poly_parameters")) {  // A fit to the other polynomial: nothing new is in it.
    const Field inverse = root.at("inv_poly_parameters");
    inverse.expectKeys({}, kInverse);
    for (const std::string& key : inverse.node().keys) {
      (void)inverse.at(key).number({-1e300, 1e300, ""});
    }
  }
  const std::span<const ParamSpec> specs = paramSpecsOf("ocam");
  constexpr size_t kCx = 9;
  constexpr size_t kC = 11;
  const double c = affine.at("ac").number({0.5, 2, ""});
  std::vector<double> params = numbersAt(poly, kPoly, "ocam");
  for (size_t i = 0; i < params.size(); ++i)
    params[i] *= std::pow(c, (DLSD_MUTANT("camodocal-scale") ? 0 : 1) - static_cast<int>(i));
  params.resize(kCx, 0);
  params.push_back(affine.at("cx").number(allowedBy(specs[kCx])));
  params.push_back(affine.at("cy").number(allowedBy(specs[kCx + 1])));
  params.push_back(1 / c);
  params.push_back(affine.at(DLSD_MUTANT("camodocal-transposed") ? "ad" : "ae")
                       .number(allowedBy(specs[kC + 1])) /
                   c);
  params.push_back(affine.at("ad").number(allowedBy(specs[kC + 2])) / c);
  return root.camera("ocam", params, size);
}

struct CamodocalModel {
  std::string_view name;
  Camera (*read)(const Field&, std::pair<int, int>);
  std::array<std::string_view, 3> parts;  ///< Keys of the maps that it needs.
  std::string_view optional_part;
};
constexpr std::array<CamodocalModel, 4> kCamodocalModels{
    {{"KANNALA_BRANDT", camodocalKannalaBrandt, {"projection_parameters"}, ""},
     {"MEI",
      camodocalMei,
      {"mirror_parameters", "distortion_parameters", "projection_parameters"},
      ""},
     {"PINHOLE", camodocalPinhole, {"distortion_parameters", "projection_parameters"}, ""},
     {"scaramuzza",
      camodocalScaramuzza,
      {"poly_parameters", "affine_parameters"},
      "inv_poly_parameters"}}};

// ORB-SLAM3

/// Settings beside the camera's intrinsics, by how their names begin.
constexpr std::array<std::string_view, 13> kOrbIgnoredPrefixes{"Stereo.",
                                                               "RGBD.",
                                                               "IMU.",
                                                               "ORBextractor.",
                                                               "Viewer.",
                                                               "System.",
                                                               "File.",
                                                               "loopClosing",
                                                               "ThDepth",
                                                               "thFarPoints",
                                                               "DepthMapFactor",
                                                               "Tbc",
                                                               "Tlr"};
constexpr std::array<std::string_view, 17> kOrbCameraIgnored{"fps",
                                                             "RGB",
                                                             "bf",
                                                             "bFishEye",
                                                             "newWidth",
                                                             "newHeight",
                                                             "lappingBegin",
                                                             "lappingEnd",
                                                             "overlappingBegin",
                                                             "overlappingEnd",
                                                             "name",
                                                             "setup",
                                                             "type",
                                                             "width",
                                                             "height",
                                                             "nFeatures",
                                                             "imageScale"};
constexpr std::array<std::string_view, 9> kOrbIntrinsics{
    "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
constexpr std::array<std::string_view, 8> kOrbFisheye{
    "fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};

bool startsWithOneOf(std::string_view text, Names prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](std::string_view prefix) {
    return text.starts_with(prefix);
  });
}

/// Rectified: a pinhole whose image needs no undistortion.
enum class OrbType { kFisheye, kPinhole, kRectified };
constexpr std::array<std::string_view, 3> kOrbTypes{"KannalaBrandt8", "PinHole", "Rectified"};

Names orbIntrinsics(OrbType type) {
  return type == OrbType::kFisheye   ? Names(kOrbFisheye)
         : type == OrbType::kPinhole ? Names(kOrbIntrinsics)
                                     : Names(kOrbIntrinsics).first(4);
}

void refuseUnknownOrbKeys(const Field& root, Names camera_prefixes, OrbType type) {
  for (const std::string& key : root.node().keys) {
    if (key.starts_with("LEFT.") || key.starts_with("RIGHT.")) {
      root.fail("has " + inQuotes(key) +
                " beside Camera., so that it is not clear whether the camera or its rectified "
                "image is meant: allowed is one of them");
    }
    if (startsWithOneOf(key, kOrbIgnoredPrefixes)) continue;
    const auto has = [](Names names, std::string_view name) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    const size_t dot = std::min(key.find('.'), key.size() - 1) + 1;
    const std::string_view prefix = std::string_view(key).substr(0, dot);
    const std::string_view name = std::string_view(key).substr(dot);
    const Names intrinsics = orbIntrinsics(type);
    if ((prefix == "Camera." || has(camera_prefixes, prefix)) && has(kOrbCameraIgnored, name)) {
      continue;
    }
    if (!has(camera_prefixes, prefix) || !has(intrinsics, name)) {
      root.fail("has the unknown key " + inQuotes(key) +
                ", allowed are Camera.type, width and "
                "height, " +
                listed(camera_prefixes) + " with " + listed(intrinsics) +
                ", and the settings of ORB-SLAM3");
    }
  }
}

Camera readOrbCamera(const Field& root,
                     std::string_view prefix,
                     OrbType type,
                     std::pair<int, int> size) {
  const auto number = [&](std::string_view name, std::string_view model) {
    return root.at(std::string(prefix) + std::string(name)).number(allowedBy(specOf(model, name)));
  };
  std::vector<double> params;
  if (type == OrbType::kFisheye) {
    for (const std::string_view name : kOrbFisheye)
      params.push_back(number(name, "kannala_brandt"));
    return root.camera("kannala_brandt", params, size);
  }
  for (const std::string_view name : Names(kOrbIntrinsics).first(4)) {
    params.push_back(number(name, "pinhole"));
  }
  // Without distortion, or with k1, k2, p1, p2 and perhaps k3.
  const auto has = [&](std::string_view name) {
    return root.has(std::string(prefix) + std::string(name));
  };
  std::vector<double> k;
  if (std::any_of(kOrbIntrinsics.begin() + 4, kOrbIntrinsics.end(), has)) {
    for (const std::string_view name : kRadtan) k.push_back(number(name, "pinhole_radtan"));
    k.push_back(has("k3") ? number("k3", "pinhole_radtan") : 0);
  }
  return root.pinholeOrRadtan(params, k, size);
}

}  // namespace

bool isCamodocal(const Document& document) {
  return document.root.find("model_type") != nullptr;
}

Loaded readCamodocal(const Document& document) {
  const Field root = document.field();
  const std::vector<std::string_view> models = column(kCamodocalModels, &CamodocalModel::name);
  const CamodocalModel& model = kCamodocalModels.at(root.at("model_type").oneOf(models));
  std::vector<std::string_view> needed(kCamodocalNeeded.begin(), kCamodocalNeeded.end());
  for (const std::string_view part : model.parts) {
    if (!part.empty()) needed.push_back(part);
  }
  std::vector<std::string_view> optional;
  if (!model.optional_part.empty()) optional.push_back(model.optional_part);
  root.expectKeys(needed, optional, kCamodocalIgnored);
  const std::pair<int, int> size{root.at("image_width").imageSize(),
                                 root.at("image_height").imageSize()};
  return {{{"cam0", model.read(root, size)}}};
}

bool isOrbSlam3(const Document& document) {
  constexpr std::array<std::string_view, 3> kPrefixes{"Camera.", "Camera1.", "Camera2."};
  return std::any_of(document.root.keys.begin(),
                     document.root.keys.end(),
                     [&](const std::string& key) { return startsWithOneOf(key, kPrefixes); });
}

Loaded readOrbSlam3(const Document& document) {
  const Field root = document.field();
  const auto type = static_cast<OrbType>(root.at("Camera.type").oneOf(kOrbTypes));
  const bool numbered = root.has("Camera1.fx");
  if (numbered && root.has("Camera.fx")) {
    root.fail("has both Camera.fx and Camera1.fx, allowed is one of them");
  }
  std::vector<std::string_view> prefixes{numbered ? "Camera1." : "Camera."};
  const bool second =
      std::any_of(root.node().keys.begin(), root.node().keys.end(), [](const std::string& key) {
        return key.starts_with("Camera2.");
      });
  if (second) prefixes.emplace_back("Camera2.");
  refuseUnknownOrbKeys(root, prefixes, type);
  const std::pair<int, int> size{root.at("Camera.width").imageSize(),
                                 root.at("Camera.height").imageSize()};
  Loaded loaded;
  for (const std::string_view prefix : prefixes) {
    // The file's own numbers; the form without a number is camera 1 where there is a second.
    const std::string name = prefix == "Camera2." ? "cam2" : (numbered || second ? "cam1" : "cam0");
    loaded.cameras.push_back({name, readOrbCamera(root, prefix, type, size)});
  }
  return loaded;
}

}  // namespace dlsd::calib
