// OpenCV's FileStorage (YAML, JSON, XML), which has no fixed names, and ROS's camera_info, which
// writes the same matrices under fixed ones.
#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>

#include "cameras/calibration/formats.h"

namespace dlsd::calib {
namespace {

using Names = std::span<const std::string_view>;

// What programs call it; the first is what we write.
constexpr std::array<std::string_view, 8> kCameraMatrix{"camera_matrix",
                                                        "cameraMatrix",
                                                        "Camera_Matrix",
                                                        "CameraMatrix",
                                                        "camera_intrinsics",
                                                        "intrinsic_matrix",
                                                        "mtx",
                                                        "K"};
constexpr std::array<std::string_view, 12> kDistortion{"distortion_coefficients",
                                                       "distortionCoefficients",
                                                       "Distortion_Coefficients",
                                                       "DistortionCoefficients",
                                                       "distortion_coeffs",
                                                       "distCoeffs",
                                                       "dist_coeffs",
                                                       "dist_coeff",
                                                       "dist_coefs",
                                                       "distortion",
                                                       "dist",
                                                       "D"};
constexpr std::array<std::string_view, 2> kXi{"xi", "Xi"};
constexpr std::array<std::string_view, 5> kWidth{
    "image_width", "image_Width", "imageWidth", "ImageWidth", "width"};
constexpr std::array<std::string_view, 5> kHeight{
    "image_height", "image_Height", "imageHeight", "ImageHeight", "height"};
constexpr std::array<std::string_view, 5> kSize{
    "image_size", "imageSize", "ImageSize", "img_size", "resolution"};
constexpr std::array<std::string_view, 1> kFisheyeModel{"fisheye_model"};
constexpr std::array<std::string_view, 1> kMaxFieldAngle{"max_field_angle"};
/// What OpenCV's own calibration programs write beside the lens.
constexpr std::array<std::string_view, 49> kIgnored{"calibration_time",
                                                    "calibration_Time",
                                                    "calibration_date",
                                                    "calibrationDate",
                                                    "camera_name",
                                                    "cameraName",
                                                    "nr_of_frames",
                                                    "nrOfFrames",
                                                    "nframes",
                                                    "nFrames",
                                                    "framesCount",
                                                    "board_width",
                                                    "board_height",
                                                    "board_Width",
                                                    "board_Height",
                                                    "square_size",
                                                    "square_Size",
                                                    "squareSize",
                                                    "marker_size",
                                                    "fix_aspect_ratio",
                                                    "FixAspectRatio",
                                                    "aspectRatio",
                                                    "flags",
                                                    "flagValue",
                                                    "calibrationFlags",
                                                    "avg_reprojection_error",
                                                    "Avg_Reprojection_Error",
                                                    "avg_reprojection_error_percent",
                                                    "per_view_reprojection_errors",
                                                    "Per_View_Reprojection_Errors",
                                                    "reprojection_error",
                                                    "reprojectionError",
                                                    "totalAvgErr",
                                                    "rms",
                                                    "RMS",
                                                    "cameraResolution",
                                                    "extrinsic_parameters",
                                                    "Extrinsic_Parameters",
                                                    "Extrinsics",
                                                    "extrinsics",
                                                    "rvecs",
                                                    "tvecs",
                                                    "used_imgs",
                                                    "image_points",
                                                    "Image_points",
                                                    "imagePoints",
                                                    "grid_points",
                                                    "objectPoints",
                                                    "timestamp"};

/// The one of these keys that the file has, if any; two are refused.
std::optional<Field> findOne(const Field& root, Names names) {
  std::optional<Field> found;
  for (const std::string_view name : names) {
    if (!root.has(name)) continue;
    if (found)
      root.fail("has both " + found->place() + " and " + std::string(name) +
                ", allowed is one of them");
    found = root.at(name);
  }
  return found;
}

struct Matrix {
  size_t rows = 0, cols = 0;
  std::vector<Field> values;  ///< Row by row.
};

/// A map {rows, cols, dt, data}, a list of rows, or a list of numbers, which is one row.
Matrix matrix(const Field& field) {
  constexpr size_t kMaxSize = 64;  // Of a side: lenses need 14 at most.
  constexpr std::array<std::string_view, 3> kNeeded{"rows", "cols", "data"};
  constexpr std::array<std::string_view, 2> kOptional{"dt", "type_id"};
  constexpr std::array<std::string_view, 3> kTypes{"d", "f", "i"};
  Matrix m;
  const auto append = [&](const Field& list) {
    if (list.node().items.size() > kMaxSize) {
      list.fail("has " + std::to_string(list.node().items.size()) +
                " entries, allowed are at most " + std::to_string(kMaxSize));
    }
    for (size_t i = 0; i < list.node().items.size(); ++i) m.values.push_back(list.item(i, ""));
  };
  if (field.node().isMap()) {
    field.expectKeys(kNeeded, kOptional);
    m.rows = static_cast<size_t>(field.at("rows").integer(0, kMaxSize));
    m.cols = static_cast<size_t>(field.at("cols").integer(0, kMaxSize));
    if (field.has("dt")) (void)field.at("dt").oneOf(kTypes);
    const Field data = field.at("data");
    if (data.node().isList()) {
      append(data);
    } else if (data.node().isScalar()) {
      m.values.push_back(data);
    } else if (m.rows * m.cols > 0) {
      data.fail("must be a list of numbers");
    }
    if (m.values.size() != m.rows * m.cols) {
      data.fail("holds " + std::to_string(m.values.size()) + " numbers, but rows x cols is " +
                std::to_string(m.rows) + " x " + std::to_string(m.cols));
    }
    return m;
  }
  if (!field.node().isList()) {
    field.fail("must be a matrix: a map with rows, cols and data, or a list");
  }
  const bool nested = !field.node().items.empty() && field.node().items.front().isList();
  if (!nested) {
    append(field);
    m.rows = 1;
    m.cols = m.values.size();
    return m;
  }
  m.rows = field.node().items.size();
  if (m.rows > kMaxSize)
    field.fail("has too many rows, allowed are at most " + std::to_string(kMaxSize));
  m.cols = field.node().items.front().items.size();
  for (size_t i = 0; i < m.rows; ++i) {
    const Field row = field.item(i, "");
    if (!row.node().isList() || row.node().items.size() != m.cols) {
      row.fail("must be a list of " + std::to_string(m.cols) + " numbers as the first row");
    }
    append(row);
  }
  return m;
}

/// fx, fy, cx, cy, skew of a 3 x 3 camera matrix.
struct CameraMatrix {
  std::array<double, 4> fx_fy_cx_cy{};
  double skew = 0;
};

CameraMatrix cameraMatrix(const Field& field) {
  Matrix m = matrix(field);
  if (m.rows == 1 && m.cols == 9) m.rows = m.cols = 3;
  if (m.rows != 3 || m.cols != 3) {
    field.fail("is a matrix of " + std::to_string(m.rows) + " x " + std::to_string(m.cols) +
               ", allowed is 3 x 3");
  }
  const auto fixed = [&](size_t i, double value) { (void)m.values[i].number({value, value, ""}); };
  fixed(3, 0);
  fixed(6, 0);
  fixed(7, 0);
  fixed(8, 1);
  const auto value = [&](size_t i, std::string_view name) {
    return m.values[i].number(allowedBy(specOf("pinhole", name)));
  };
  return {{value(0, "fx"), value(4, "fy"), value(2, "cx"), value(5, "cy")},
          m.values[1].number({-1e7, 1e7, "px"})};
}

constexpr std::array<size_t, 1> kOne{1};
constexpr std::array<size_t, 1> kFour{4};
constexpr std::array<size_t, 6> kPinholeCounts{0, 4, 5, 8, 12, 14};

/// The numbers of a row or column. `counts`: how many there may be.
std::vector<Field> vectorOf(const Field& field, std::span<const size_t> counts) {
  const Matrix m = matrix(field);
  const bool right_shape = m.rows <= 1 || m.cols <= 1;
  if (!right_shape || std::find(counts.begin(), counts.end(), m.values.size()) == counts.end()) {
    std::string allowed;
    for (const size_t n : counts) allowed += (allowed.empty() ? "" : ", ") + std::to_string(n);
    field.fail("is a matrix of " + std::to_string(m.rows) + " x " + std::to_string(m.cols) +
               ", allowed are one row or column of " + allowed + " numbers");
  }
  return m.values;
}

/// OpenCV's distortion vector k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty as our k1 k2 p1 p2 k3. What
/// we have no model for must be 0.
std::array<double, 5> radtanCoefficients(const std::vector<Field>& values) {
  constexpr std::array<std::string_view, 9> kMustBeZero{
      "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"};
  std::array<double, 5> k{};
  for (size_t i = 0; i < values.size(); ++i) {
    if (i < k.size()) {
      k[i] = values[i].number(allowedBy(paramSpecsOf("pinhole_radtan")[4 + i]));
    } else if (values[i].number({-1e9, 1e9, ""}) != 0) {
      values[i].fail(
          "(" + std::string(kMustBeZero[i - k.size()]) + ") = " + shown(values[i].node().text) +
          " belongs to the rational, thin prism or tilted model, which is not supported: "
          "allowed is 0");
    }
  }
  return k;
}

/// Coefficients as parameters of a model from `first` on.
std::vector<double> coefficients(const std::vector<Field>& values,
                                 std::string_view model,
                                 size_t first) {
  std::vector<double> k;
  k.reserve(values.size());
  for (size_t i = 0; i < values.size(); ++i) {
    k.push_back(values[i].number(allowedBy(paramSpecsOf(model)[first + i])));
  }
  return k;
}

Camera fisheyeCamera(const Field& root,
                     const CameraMatrix& K,
                     const Field& distortion,
                     std::pair<int, int> size,
                     double max_field_angle_rad) {
  std::vector<double> params(K.fx_fy_cx_cy.begin(), K.fx_fy_cx_cy.end());
  for (const double k : coefficients(vectorOf(distortion, kFour), "kannala_brandt", 4)) {
    params.push_back(k);
  }
  return root.camera("kannala_brandt", params, size, max_field_angle_rad);
}

void refuseSkew(const Field& field, double skew) {
  if (skew != 0) {
    field.fail("has the skew " + shortest(skew) + ", allowed is 0: the model has none");
  }
}

enum class Lens { kUnknown, kPinhole, kFisheye, kOmnidir };

std::pair<int, int> imageSize(const Field& root) {
  const std::optional<Field> width = findOne(root, kWidth), height = findOne(root, kHeight),
                             size = findOne(root, kSize);
  if (size && (width || height)) {
    root.fail("has both " + size->place() + " and " + (width ? width : height)->place() +
              ", allowed is one of them");
  }
  if (size) return size->resolution();
  if (!width || !height) {
    root.fail("says no image size: image_width and image_height are missing, please add them");
  }
  return {width->imageSize(), height->imageSize()};
}

void refuseUnknownStorageKeys(const Field& root) {
  std::vector<std::string_view> known;
  for (const Names names : {Names(kCameraMatrix),
                            Names(kDistortion),
                            Names(kXi),
                            Names(kWidth),
                            Names(kHeight),
                            Names(kSize),
                            Names(kFisheyeModel),
                            Names(kMaxFieldAngle),
                            Names(kIgnored)}) {
    known.insert(known.end(), names.begin(), names.end());
  }
  for (const std::string& key : root.node().keys) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      root.fail("has the unknown key " + inQuotes(key) +
                ", please remove it if it says nothing about the lens");
    }
  }
}

/// The model of a file: what was asked for, what it says by a word, or what its number of
/// coefficients says where that is no other model's.
Lens lensOf(const Field& root, Lens asked_for, const Field& distortion) {
  constexpr std::array<std::string_view, 4> kWords{"0", "1", "false", "true"};
  const std::optional<Field> xi = findOne(root, kXi);
  const std::optional<Field> fisheye = findOne(root, kFisheyeModel);
  Lens said = Lens::kUnknown;
  if (fisheye) said = fisheye->oneOf(kWords) % 2 == 1 ? Lens::kFisheye : Lens::kPinhole;
  if (xi && said == Lens::kFisheye) {
    root.fail("has both xi and fisheye_model: 1, allowed is one of them");
  }
  if (xi) said = Lens::kOmnidir;
  if (said == Lens::kUnknown) said = asked_for;
  if (asked_for != Lens::kUnknown && asked_for != said) {
    root.fail("says by " + (xi ? xi : fisheye)->place() +
              " that it is another model than the one asked for");
  }
  if (asked_for == Lens::kOmnidir && !xi) root.fail("has no xi, which cv::omnidir needs");
  if (said != Lens::kUnknown) return said;
  if (vectorOf(distortion, kPinholeCounts).size() == 4) {
    distortion.fail(
        "has 4 coefficients, which is cv::fisheye (k1, k2, k3, k4) or the pinhole model (k1, k2, "
        "p1, p2): please choose the format opencv-fisheye or opencv-pinhole, or add fisheye_model: "
        "1 or 0");
  }
  return Lens::kPinhole;
}

Loaded readStorage(const Document& document, Lens asked_for) {
  const Field root = document.field();
  refuseUnknownStorageKeys(root);
  const std::optional<Field> matrix_field = findOne(root, kCameraMatrix);
  const std::optional<Field> D = findOne(root, kDistortion);
  const std::optional<Field> limit = findOne(root, kMaxFieldAngle);
  if (!matrix_field) root.fail("has no camera matrix: camera_matrix (or K) is missing");
  if (!D) {
    root.fail(
        "has no distortion coefficients: distortion_coefficients (or D) is missing, which is zeros "
        "for a lens without distortion");
  }
  const CameraMatrix K = cameraMatrix(*matrix_field);
  const std::pair<int, int> size = imageSize(root);
  const double max_field_angle = limit ? limit->maxFieldAngle() : M_PI;
  const Lens lens = lensOf(root, asked_for, *D);
  if (lens == Lens::kOmnidir) {
    const Field xi = findOne(root, kXi).value();
    std::vector<double> params{(xi.node().isScalar() ? xi : vectorOf(xi, kOne).front())
                                   .number(allowedBy(specOf("omni", "xi")))};
    params.insert(params.end(), K.fx_fy_cx_cy.begin(), K.fx_fy_cx_cy.end());
    std::vector<double> distortion =
        coefficients(vectorOf(*D, kFour), "omni_radtan", params.size());
    distortion.push_back(K.skew);
    return {{{"cam0", root.omniOrRadtan(params, distortion, size, max_field_angle)}}};
  }
  refuseSkew(*matrix_field, K.skew);
  return {{{"cam0",
            lens == Lens::kFisheye
                ? fisheyeCamera(root, K, *D, size, max_field_angle)
                : root.pinholeOrRadtan(K.fx_fy_cx_cy,
                                       radtanCoefficients(vectorOf(*D, kPinholeCounts)),
                                       size,
                                       max_field_angle)}}};
}

std::string matrixText(std::string_view key,
                       std::string_view tag,
                       size_t rows,
                       size_t cols,
                       std::span<const double> values) {
  std::string text = std::string(key) + ":" + std::string(tag) +
                     "\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(cols) +
                     (tag.empty() ? "" : "\n  dt: d") + "\n  data: [";
  for (size_t i = 0; i < values.size(); ++i) text += (i > 0 ? ", " : "") + yamlNumber(values[i]);
  return text + "]\n";
}

double param(const Camera& camera, std::string_view name) {
  const std::span<const ParamSpec> specs = camera.paramSpecs();
  for (size_t i = 0; i < specs.size(); ++i) {
    if (specs[i].name == name) return camera.params()[i];
  }
  return 0;
}

std::string cameraMatrixText(const Camera& camera, std::string_view tag) {
  const std::array<double, 9> K{param(camera, "fx"),
                                param(camera, "skew"),
                                param(camera, "cx"),
                                0,
                                param(camera, "fy"),
                                param(camera, "cy"),
                                0,
                                0,
                                1};
  return matrixText("camera_matrix", tag, 3, 3, K);
}

std::string maxFieldAngleText(const Camera& camera) {
  if (camera.maxFieldAngleLimit() == M_PI) return "";
  return "max_field_angle: " + yamlNumber(camera.maxFieldAngleLimit()) +
         "  # rad from the optical axis; an extension of dlsd\n";
}

std::vector<double> params(const Camera& camera, std::initializer_list<std::string_view> names) {
  std::vector<double> values;
  for (const std::string_view name : names) values.push_back(param(camera, name));
  return values;
}

std::string writeStorage(const std::vector<NamedCamera>& cameras,
                         std::string_view format,
                         Names models) {
  const NamedCamera& only = onlyCamera(cameras, format);
  const Camera& camera = only.camera;
  const std::string_view model = camera.modelName();
  if (std::find(models.begin(), models.end(), model) == models.end())
    refuseModel(only, format, models);
  constexpr std::string_view kTag = " !!opencv-matrix";
  std::string text = "%YAML:1.0\n---\nimage_width: " + std::to_string(camera.width()) +
                     "\nimage_height: " + std::to_string(camera.height()) + "\n";
  std::vector<double> distortion;
  if (model == "kannala_brandt") {
    text += "fisheye_model: 1\n";
    distortion = params(camera, {"k1", "k2", "k3", "k4"});
  } else if (model.starts_with("omni")) {
    text += "xi: " + yamlNumber(param(camera, "xi")) + "\n";
    distortion = params(camera, {"k1", "k2", "p1", "p2"});
  } else {
    text += "fisheye_model: 0\n";
    distortion = params(camera, {"k1", "k2", "p1", "p2", "k3"});
  }
  return text + maxFieldAngleText(camera) + cameraMatrixText(camera, kTag) +
         matrixText("distortion_coefficients", kTag, 1, distortion.size(), distortion);
}

constexpr std::array<std::string_view, 5> kStorageModels{
    "pinhole", "pinhole_radtan", "kannala_brandt", "omni", "omni_radtan"};

}  // namespace

bool isOpencv(const Document& document) {
  const auto matrix_of = [&](std::string_view key) {
    const Node* const node = document.root.find(key);
    return node != nullptr && (node->isMap() || node->isList()) ? node : nullptr;
  };
  return !isRos(document) && std::any_of(kCameraMatrix.begin(), kCameraMatrix.end(), matrix_of);
}

Loaded readOpencv(const Document& document) {
  return readStorage(document, Lens::kUnknown);
}
Loaded readOpencvFisheye(const Document& document) {
  return readStorage(document, Lens::kFisheye);
}
Loaded readOpencvOmnidir(const Document& document) {
  return readStorage(document, Lens::kOmnidir);
}
Loaded readOpencvPinhole(const Document& document) {
  return readStorage(document, Lens::kPinhole);
}

std::string writeOpencv(const std::vector<NamedCamera>& cameras) {
  return writeStorage(cameras, "opencv", kStorageModels);
}
std::string writeOpencvPinhole(const std::vector<NamedCamera>& cameras) {
  return writeStorage(cameras, "opencv-pinhole", Names(kStorageModels).first(2));
}
std::string writeOpencvFisheye(const std::vector<NamedCamera>& cameras) {
  return writeStorage(cameras, "opencv-fisheye", Names(kStorageModels).subspan(2, 1));
}
std::string writeOpencvOmnidir(const std::vector<NamedCamera>& cameras) {
  return writeStorage(cameras, "opencv-omnidir", Names(kStorageModels).last(2));
}

// ROS camera_info, as camera_calibration_parsers writes it.

namespace {
constexpr std::array<std::string_view, 5> kRosNeeded{
    "image_width", "image_height", "camera_matrix", "distortion_model", "distortion_coefficients"};
constexpr std::array<std::string_view, 3> kRosIgnored{
    "camera_name", "rectification_matrix", "projection_matrix"};
constexpr std::array<std::string_view, 3> kRosModels{
    "plumb_bob", "rational_polynomial", "equidistant"};
constexpr std::array<std::string_view, 4> kRosOptional{
    "binning_x", "binning_y", "roi", "max_field_angle"};

/// The words for the same in a file and in the messages of ROS 1 and 2, as `rostopic echo` and
/// `ros2 topic echo` print them.
struct RosKeys {
  std::array<std::string_view, 5> needed;  ///< Width, height, matrix, model, distortion.
  std::array<std::string_view, 3> ignored;
};
constexpr RosKeys kRosFile{kRosNeeded, kRosIgnored};
constexpr RosKeys kRos1Message{{"width", "height", "K", "distortion_model", "D"},
                               {"header", "R", "P"}};
constexpr RosKeys kRos2Message{{"width", "height", "k", "distortion_model", "d"},
                               {"header", "r", "p"}};

bool isRosMessage(const Document& document, const RosKeys& keys) {
  const Node* const K = document.root.find(keys.needed[2]);
  return K != nullptr && K->isList() && document.root.find("distortion_model") != nullptr;
}

/// Pixels that are put together, or a part of the sensor, are another image than the calibrated.
void refuseBinningAndRoi(const Field& root, std::pair<int, int> size) {
  for (const std::string_view key : {"binning_x", "binning_y"}) {
    if (root.has(key)) (void)root.at(key).integer(0, 1);
  }
  if (!root.has("roi")) return;
  constexpr std::array<std::string_view, 4> kNeeded{"x_offset", "y_offset", "height", "width"};
  constexpr std::array<std::string_view, 1> kDoRectify{"do_rectify"};
  const Field roi = root.at("roi");
  roi.expectKeys(kNeeded, {}, kDoRectify);
  (void)roi.at("x_offset").integer(0, 0);
  (void)roi.at("y_offset").integer(0, 0);
  const std::pair<int, int> part{roi.at("width").integer(0, Camera::kMaxImageSize),
                                 roi.at("height").integer(0, Camera::kMaxImageSize)};
  if (part != size && part != std::pair<int, int>(0, 0)) {
    roi.fail("is a part of " + std::to_string(part.first) + " x " + std::to_string(part.second) +
             " px, allowed are the whole image and 0 x 0, which means that");
  }
}
}  // namespace

bool isRos(const Document& document) {
  if (isRosMessage(document, kRos1Message) || isRosMessage(document, kRos2Message)) return true;
  const Node* const K = document.root.find("camera_matrix");
  return K != nullptr && K->isMap() && !K->opencv_matrix && K->find("type_id") == nullptr &&
         (document.root.find("distortion_model") != nullptr ||
          document.root.find("rectification_matrix") != nullptr ||
          document.root.find("projection_matrix") != nullptr);
}

Loaded readRos(const Document& document) {
  const Field root = document.field();
  const RosKeys& keys = isRosMessage(document, kRos1Message)   ? kRos1Message
                        : isRosMessage(document, kRos2Message) ? kRos2Message
                                                               : kRosFile;
  root.expectKeys(keys.needed, kRosOptional, keys.ignored);
  const Field matrix_field = root.at(keys.needed[2]);
  const CameraMatrix K = cameraMatrix(matrix_field);
  refuseSkew(matrix_field, K.skew);
  const std::pair<int, int> size{root.at(keys.needed[0]).imageSize(),
                                 root.at(keys.needed[1]).imageSize()};
  refuseBinningAndRoi(root, size);
  const double max_field_angle =
      root.has("max_field_angle") ? root.at("max_field_angle").maxFieldAngle() : M_PI;
  const size_t model = root.at("distortion_model").oneOf(kRosModels);
  const Field D = root.at(keys.needed[4]);
  if (kRosModels[model] == "equidistant") {
    return {{{"cam0", fisheyeCamera(root, K, D, size, max_field_angle)}}};
  }
  constexpr std::array<size_t, 3> kPlumbBob{0, 4, 5};
  constexpr std::array<size_t, 1> kRational{8};
  const std::vector<Field> values =
      kRosModels[model] == "plumb_bob" ? vectorOf(D, kPlumbBob) : vectorOf(D, kRational);
  return {
      {{"cam0",
        root.pinholeOrRadtan(K.fx_fy_cx_cy, radtanCoefficients(values), size, max_field_angle)}}};
}

std::string writeRos(const std::vector<NamedCamera>& cameras) {
  constexpr std::string_view kFormat = "ros";
  const NamedCamera& only = onlyCamera(cameras, kFormat);
  const Camera& camera = only.camera;
  const Names models = Names(kStorageModels).first(3);
  if (std::find(models.begin(), models.end(), camera.modelName()) == models.end())
    refuseModel(only, kFormat, models);
  const bool fisheye = camera.modelName() == "kannala_brandt";
  const std::vector<double> distortion = fisheye ? params(camera, {"k1", "k2", "k3", "k4"})
                                                 : params(camera, {"k1", "k2", "p1", "p2", "k3"});
  const std::array<double, 9> R{1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::array<double, 12> P{param(camera, "fx"),
                                 0,
                                 param(camera, "cx"),
                                 0,
                                 0,
                                 param(camera, "fy"),
                                 param(camera, "cy"),
                                 0,
                                 0,
                                 0,
                                 1,
                                 0};
  // The distortion last: a file cut off anywhere then lacks a key or a bracket.
  return "image_width: " + std::to_string(camera.width()) +
         "\nimage_height: " + std::to_string(camera.height()) + "\ncamera_name: " + only.name +
         "\n" + maxFieldAngleText(camera) + cameraMatrixText(camera, "") +
         "distortion_model: " + (fisheye ? "equidistant" : "plumb_bob") + "\n" +
         matrixText("rectification_matrix", "", 3, 3, R) +
         matrixText("projection_matrix", "", 3, 4, P) +
         matrixText("distortion_coefficients", "", 1, distortion.size(), distortion);
}

}  // namespace dlsd::calib
