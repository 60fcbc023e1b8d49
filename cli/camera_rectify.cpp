#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <Eigen/Geometry>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "cameras/calibration/files.h"
#include "cameras/rectification.h"
#include "cli/camera_commands.h"
#include "synth/dataset/image.h"

namespace dlsd::cli {
namespace {

struct Arguments {
  CameraArgument camera;
  std::vector<std::string> images;
  std::string view = "pinhole", size, rotate = "0,0,0", interpolation = "linear";
  std::string out, maps, mask, out_camera;
  std::optional<double> fov_deg;
  bool crop = false;
};

constexpr int kMaxSize = 32766;  // OpenCV's remap
constexpr int kSeamMargin = 2;   // cubic interpolation looks that far

/// Numbers between separators, all of the text.
template <class T>
std::optional<std::vector<T>> readNumbers(const std::string& text, char separator) {
  std::vector<T> numbers;
  const char *at = text.data(), *end = at + text.size();
  for (;;) {
    T value{};
    const auto read = std::from_chars(at, end, value);
    if (read.ec != std::errc()) {
      return std::nullopt;
    }
    numbers.push_back(value);
    if (read.ptr == end) {
      return numbers;
    }
    if (*read.ptr != separator) {
      return std::nullopt;
    }
    at = read.ptr + 1;
  }
}

ViewKind kindOf(const std::string& name) {
  return name == "pinhole"       ? ViewKind::kPinhole
         : name == "cylindrical" ? ViewKind::kCylindrical
                                 : ViewKind::kEquirectangular;
}

Eigen::Matrix3d readRotation(const std::string& text) {
  const auto degrees = readNumbers<double>(text, ',');
  bool good = degrees && degrees->size() == 3;
  for (size_t i = 0; good && i < 3; ++i) {
    good = std::abs((*degrees)[i]) <= 360;
  }
  if (!good) {
    throw InputError(
        "--rotate is \"" + text +
        "\", allowed are yaw,pitch,roll in degrees as in 30,0,-5, each in [-360, 360]");
  }
  const auto about = [&](size_t i, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd((*degrees)[i] / kDegreesPerRad, axis);
  };
  return (about(0, Eigen::Vector3d::UnitY()) * about(1, Eigen::Vector3d::UnitX()) *
          about(2, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

ViewRequest readRequest(const Arguments& arguments, const Camera& camera) {
  ViewRequest request;
  request.kind = kindOf(arguments.view);
  request.cam_from_view = readRotation(arguments.rotate);
  const bool pinhole = request.kind == ViewKind::kPinhole;
  if (arguments.fov_deg) {
    const double fov = *arguments.fov_deg;
    if (pinhole && fov >= 180) {
      throw InputError(
          fmt::format("--fov is {:g}: a pinhole view shows less than 180 degrees; take --view "
                      "cylindrical or equirectangular, or several pinhole views by --rotate",
                      fov));
    }
    if (!(fov > 0 && fov <= 360)) {
      throw InputError(fmt::format(
          "--fov is {:g}, allowed are degrees in (0, {}", fov, pinhole ? "180)" : "360]"));
    }
    request.fov_rad = fov / kDegreesPerRad;
  } else if (!arguments.crop) {
    request.fov_rad = (pinhole                                  ? 90
                       : request.kind == ViewKind::kCylindrical ? 180
                                                                : 360) /
                      kDegreesPerRad;
  }
  if (!arguments.size.empty()) {
    const auto size = readNumbers<int>(arguments.size, 'x');
    if (!size || size->size() != 2) {
      throw InputError("--size is \"" + arguments.size + "\", allowed is WxH as in 1280x1024");
    }
    request.width = (*size)[0];
    request.height = (*size)[1];
  } else {
    request.width = camera.width();
    request.height = camera.height();
    if (request.kind == ViewKind::kEquirectangular && !arguments.crop) {
      // From pole to pole.
      request.height = std::max(1, int(std::lround(request.width * M_PI / *request.fov_rad)));
    }
  }
  const int min_size = arguments.crop ? 2 : 1;
  for (const int size : {request.width, request.height}) {
    if (size < min_size || size > kMaxSize) {
      throw InputError(fmt::format("--size is {}x{}, allowed are {} to {} px each way",
                                   request.width,
                                   request.height,
                                   min_size,
                                   kMaxSize));
    }
  }
  return request;
}

VirtualView makeView(const Arguments& arguments, const Camera& camera, const ViewRequest& request) {
  if (!arguments.crop) {
    return centredView(request);
  }
  const Crop crop = cropView(camera, request);
  if (!crop.view) {
    throw InputError(arguments.camera.path +
                     ": the axis of the view is not in the image, there is nothing to crop");
  }
  if (crop.cut_by_fov && !request.fov_rad && request.kind == ViewKind::kPinhole) {
    throw InputError(fmt::format(
        "{}: sees {:.0f} degrees and more across, where a pinhole crop has no bound of its own: "
        "give one by --fov, 120 for example",
        arguments.camera.path,
        kPinholeCropFovRad * kDegreesPerRad));
  }
  if (!arguments.size.empty()) {
    return *crop.view;
  }
  // Square pixels, as far as whole ones go: the side that is drawn larger is made smaller. The
  // rectangle ends in the centres of the outermost pixels.
  ViewRequest square = request;
  const double ratio = crop.view->fx / crop.view->fy;
  if (ratio > 1) {
    square.width = std::max(2, 1 + int(std::lround((request.width - 1) / ratio)));
  } else {
    square.height = std::max(2, 1 + int(std::lround((request.height - 1) * ratio)));
  }
  return *cropView(camera, square).view;
}

/// NumPy's format 1.0: float32 of shape (height, width, 2), (u, v) of the source by view pixel.
/// What is not valid points to (-2, -2), outside any image for every interpolation.
std::string npyOf(const ViewMaps& maps) {
  static_assert(std::endian::native == std::endian::little);
  std::string header =
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}, 2), }}",
                  maps.height,
                  maps.width);
  header.append(63 - (10 + header.size()) % 64, ' ');
  header += '\n';
  std::string text("\x93NUMPY\x01\x00", 8);
  text += char(header.size() % 256);
  text += char(header.size() / 256);
  text += header;
  const size_t start = text.size();
  text.resize(start + maps.u.size() * 2 * sizeof(float));
  for (size_t i = 0; i < maps.u.size(); ++i) {
    const bool valid = maps.valid[i] != 0;
    const float pair[2] = {valid ? maps.u[i] : -2, valid ? maps.v[i] : -2};
    std::memcpy(text.data() + start + i * sizeof pair, pair, sizeof pair);
  }
  return text;
}

Image maskOf(const ViewMaps& maps) {
  Image mask;
  mask.width = maps.width;
  mask.height = maps.height;
  for (const uint8_t valid : maps.valid) {
    mask.bytes.push_back(valid != 0 ? 255 : 0);
  }
  return mask;
}

/// 8 or 16 bit and channels as in the source; black where the maps have no source.
/// @param margin  Columns of the image's other side to put on each side first; `map` counts them.
Image remapped(
    const Image& image, int margin, const cv::Mat& map, const ViewMaps& maps, int interpolation) {
  Image view;
  view.width = maps.width;
  view.height = maps.height;
  view.channels = image.channels;
  view.bits = image.bits;
  const size_t bytes = size_t(image.channels) * size_t(image.bits) / 8;
  view.bytes.resize(maps.valid.size() * bytes);
  const int type = CV_MAKETYPE(image.bits == 16 ? CV_16U : CV_8U, image.channels);
  // Only read; OpenCV has no const view.
  cv::Mat from(
      image.height, image.width, type, const_cast<uint8_t*>(image.bytes.data()));  // NOLINT
  if (margin > 0) {
    const cv::Mat once = from;
    cv::copyMakeBorder(once, from, 0, 0, margin, margin, cv::BORDER_WRAP);
  }
  cv::Mat to(view.height, view.width, type, view.bytes.data());
  cv::remap(from, to, map, cv::noArray(), interpolation, cv::BORDER_REPLICATE);
  for (size_t i = 0; i < maps.valid.size(); ++i) {
    if (maps.valid[i] == 0) {
      std::memset(&view.bytes[i * bytes], 0, bytes);
    }
  }
  return view;
}

std::string textOf(const VirtualView& view, const std::string& kind, const ViewMaps& maps) {
  std::string text;
  const auto row = [&](const std::string& name, const std::string& value) {
    text += fmt::format("{:<14}  {}\n", name, value);
  };
  row("view", kind);
  row("size", fmt::format("{} x {} px", view.width, view.height));
  const char* unit = view.kind == ViewKind::kPinhole ? "px" : "px/rad";
  row("fx, fy",
      fmt::format("{} {}, {} {}",
                  view.fx,
                  unit,
                  view.fy,
                  view.kind == ViewKind::kCylindrical ? "px" : unit));
  row("cx, cy", fmt::format("{} px, {} px", view.cx, view.cy));
  for (int i = 0; i < 3; ++i) {
    const Eigen::RowVector3d r = view.cam_from_view.row(i);
    row(i == 0 ? "cam_from_view" : "", fmt::format("{:9.6f} {:9.6f} {:9.6f}", r.x(), r.y(), r.z()));
  }
  const auto shown = size_t(std::count(maps.valid.begin(), maps.valid.end(), 1));
  row("shows",
      fmt::format("{}/{} {:.2f} % of the view's pixels",
                  shown,
                  maps.valid.size(),
                  100 * double(shown) / double(maps.valid.size())));
  return text;
}

int run(const Arguments& arguments) {
  const Camera camera = loadOne(arguments.camera);
  const int margin = goesAround(camera) ? kSeamMargin : 0;
  if (std::max(camera.width() + 2 * margin, camera.height()) > kMaxSize) {
    throw InputError(fmt::format("{}: images of more than {} px cannot be rectified",
                                 arguments.camera.path,
                                 kMaxSize - 2 * margin));
  }
  const ViewRequest request = readRequest(arguments, camera);
  if (!arguments.images.empty() && arguments.out.empty()) {
    throw InputError("--out is needed, the folder for the views of the images");
  }
  if (arguments.images.empty() && arguments.maps.empty() && arguments.mask.empty() &&
      arguments.out_camera.empty()) {
    throw InputError("camera rectify needs images, or --maps, --mask or --out-camera");
  }
  std::vector<std::string> inputs{calibrationFile(arguments.camera.path)}, outputs;
  std::vector<std::string> views;
  for (const std::string& image : arguments.images) {
    inputs.push_back(image);
    views.push_back(arguments.out + "/" + std::filesystem::path(image).stem().string() + ".png");
  }
  outputs = views;
  for (const std::string& file : {arguments.maps, arguments.mask, arguments.out_camera}) {
    if (!file.empty()) {
      outputs.push_back(file);
    }
  }
  checkOutputs(inputs, outputs);
  // All that may be refused before anything is made.
  const VirtualView view = makeView(arguments, camera, request);
  const std::optional<Camera> view_camera =
      arguments.out_camera.empty() ? std::nullopt : view.camera();
  if (!arguments.out_camera.empty() && !view_camera) {
    throw InputError("--out-camera: there is no camera model for a " + arguments.view + " view");
  }
  if (!arguments.out.empty()) {
    checkPlaceForFolder(arguments.out);
    makeFolders(arguments.out);
  }
  for (const std::string& output : outputs) {
    checkPlaceForFile(output);
  }

  const ViewMaps maps = viewMaps(camera, view);
  std::vector<std::string> complaints;
  if (!views.empty()) {
    cv::Mat map(maps.height, maps.width, CV_32FC2);
    for (int y = 0; y < maps.height; ++y) {
      for (int x = 0; x < maps.width; ++x) {
        const size_t i = size_t(y) * size_t(maps.width) + size_t(x);
        map.at<cv::Vec2f>(y, x) = {maps.u[i] + float(margin), maps.v[i]};
      }
    }
    const int interpolation =
        arguments.interpolation == "cubic" ? cv::INTER_CUBIC : cv::INTER_LINEAR;
    Progress progress("images", views.size());
    for (size_t i = 0; i < views.size(); ++i) {
      try {
        const Image image = readImage(arguments.images[i]);
        if (image.width != camera.width() || image.height != camera.height()) {
          throw InputError(fmt::format("{}: is {}x{} px, the camera is {}x{} px",
                                       arguments.images[i],
                                       image.width,
                                       image.height,
                                       camera.width(),
                                       camera.height()));
        }
        writeFileAtomically(views[i], encodePng(remapped(image, margin, map, maps, interpolation)));
      } catch (const InputError& error) {
        complaints.emplace_back(error.what());
      }
      progress.done(i + 1);
    }
  }
  if (views.empty() || complaints.size() < views.size()) {
    if (view_camera) {
      saveCameras(arguments.out_camera, {{"cam0", *view_camera}});
    }
    if (!arguments.maps.empty()) {
      writeFileAtomically(arguments.maps, npyOf(maps));
    }
    if (!arguments.mask.empty()) {
      writeFileAtomically(arguments.mask, encodePng(maskOf(maps)));
    }
    print(textOf(view, arguments.view, maps));
  }
  for (const std::string& complaint : complaints) {
    complain(complaint);
  }
  return complaints.empty() ? kDone : kBadInput;
}

}  // namespace

Run addCameraRectify(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  addCameraArgument(command, &arguments->camera);
  command.add_option("images", arguments->images, "Images, all of the camera's size")
      ->type_name("FILE");
  command.add_option("--view", arguments->view, "pinhole, cylindrical or equirectangular")
      ->type_name("NAME")
      ->capture_default_str()
      ->check(CLI::IsMember({"pinhole", "cylindrical", "equirectangular"}));
  command
      .add_option("--fov",
                  arguments->fov_deg,
                  "Horizontal field of view, degrees (default: pinhole 90, cylindrical 180, "
                  "equirectangular 360); with --crop the most that the view may span")
      ->type_name("DEG");
  command
      .add_option("--size",
                  arguments->size,
                  "Size of the view (default: the camera's; equirectangular: from pole to pole; "
                  "with --crop what makes pixels square within the camera's, while a size given "
                  "stretches what is shown to it: fx is not fy then)")
      ->type_name("WxH");
  command.add_flag("--crop",
                   arguments->crop,
                   "The largest rectangle that shows nothing but the image, without black borders");
  command
      .add_option("--rotate",
                  arguments->rotate,
                  "Where the view looks, degrees: to the right, up, and clockwise about its axis")
      ->type_name("YAW,PITCH,ROLL")
      ->capture_default_str();
  command.add_option("--interpolation", arguments->interpolation, "linear or cubic")
      ->type_name("NAME")
      ->capture_default_str()
      ->check(CLI::IsMember({"linear", "cubic"}));
  command.add_option("--out", arguments->out, "Folder for the views, PNG")->type_name("DIR");
  command
      .add_option("--maps",
                  arguments->maps,
                  "NumPy file, float32 (height, width, 2): where each pixel of the view is in the "
                  "image, as cv2.remap takes it (for a panorama of 360 degrees with BORDER_WRAP)")
      ->type_name("FILE.npy");
  command.add_option("--mask", arguments->mask, "PNG file, 255 where the view shows the image")
      ->type_name("FILE.png");
  command
      .add_option("--out-camera",
                  arguments->out_camera,
                  "Calibration file of the view, for pinhole and equirectangular ones")
      ->type_name("FILE");
  command.footer(
      "Examples:\n"
      "  dlsd camera rectify wide.yaml photo.png --crop --fov 120 --out rectified --out-camera "
      "rect.yaml\n"
      "  dlsd camera rectify wide.yaml *.png --fov 100 --size 800x600 --rotate 30,0,0 --out right\n"
      "  dlsd camera rectify wide.yaml --view cylindrical --fov 180 --maps maps.npy --mask "
      "mask.png");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
