#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <utility>

#include "cameras/calibration/files.h"
#include "cli/camera_commands.h"
#include "cli/command.h"

namespace dlsd::cli {
namespace {

struct Entry {
  const char* name;
  const char* help;
  Run (*add)(CLI::App& command);
};

constexpr Entry kCommands[] = {
    {"show", "Model, parameters, field of view, domain and conventions of cameras.", addCameraShow},
    {"check",
     "Does every pixel come back from its ray; with photographs: are lines straight.",
     addCameraCheck},
    {"convert",
     "Write a camera in another file format, or fit another model to it.",
     addCameraConvert},
    {"rectify", "Pinhole, cylindrical and equirectangular views of images.", addCameraRectify},
};

}  // namespace

void addCalibrationFormat(CLI::App& command, std::string* format) {
  std::vector<std::string> names;
  for (const CalibrationFormat& f : calibrationFormats()) {
    names.emplace_back(f.name);
  }
  command
      .add_option("--format",
                  *format,
                  fmt::format("Format of the calibration file, if its content does not tell: {}",
                              fmt::join(names, ", ")))
      ->type_name("NAME")
      ->check(CLI::IsMember(names));
}

void addCameraArgument(CLI::App& command, CameraArgument* argument) {
  command
      .add_option("file", argument->path, "Calibration file, or file:camera if it holds several")
      ->type_name("FILE")
      ->required();
  addCalibrationFormat(command, &argument->format);
}

LoadedCalibration loadChosen(const CameraArgument& argument) {
  const std::string file = calibrationFile(argument.path);
  if (file == argument.path) {
    return loadCalibration(file, argument.format);
  }
  const std::string name = argument.path.substr(file.size() + 1);
  LoadedCalibration calibration = loadCalibration(file, argument.format);
  std::vector<std::string> names;
  for (const NamedCamera& camera : calibration.cameras) {
    if (camera.name == name) {
      const NamedCamera chosen = camera;
      calibration.cameras = {chosen};
      return calibration;
    }
    names.push_back(camera.name);
  }
  throw InputError(
      fmt::format("{}: has no camera \"{}\", only {}", file, name, fmt::join(names, ", ")));
}

Camera loadOne(const CameraArgument& argument) {
  const LoadedCalibration calibration = loadChosen(argument);
  if (calibration.cameras.size() > 1) {
    std::vector<std::string> names;
    for (const NamedCamera& camera : calibration.cameras) {
      names.push_back(argument.path + ":" + camera.name);
    }
    throw InputError(fmt::format(
        "{}: holds several cameras, choose one of {}", argument.path, fmt::join(names, ", ")));
  }
  return calibration.cameras.front().camera;
}

double fieldAngle(const Eigen::Vector3d& ray_in_cam) {
  return std::atan2(std::hypot(ray_in_cam.x(), ray_in_cam.y()), ray_in_cam.z());
}

Eigen::Vector3d rayAt(double field_angle_rad, double azimuth_rad) {
  const double s = std::sin(field_angle_rad);
  return {s * std::cos(azimuth_rad), s * std::sin(azimuth_rad), std::cos(field_angle_rad)};
}

std::optional<Scale> scaleAt(const Camera& camera, const Eigen::Vector3d& ray_in_cam) {
  const std::optional<ProjectionJacobian> jacobian = camera.jacobian(ray_in_cam.normalized());
  if (!jacobian) {
    return std::nullopt;
  }
  const Eigen::Vector3d ray = ray_in_cam.normalized();
  const double r = std::hypot(ray.x(), ray.y());
  const Eigen::Vector3d across =
      r > 0 ? Eigen::Vector3d(-ray.y() / r, ray.x() / r, 0) : Eigen::Vector3d::UnitY();
  return Scale{fieldAngle(ray),
               (*jacobian * across.cross(ray)).norm() / kDegreesPerRad,
               (*jacobian * across).norm() / kDegreesPerRad};
}

Run addCamera(CLI::App& command) {
  std::vector<std::pair<CLI::App*, Run>> commands;
  std::vector<std::string> names;
  for (const Entry& entry : kCommands) {
    CLI::App* sub = command.add_subcommand(entry.name, entry.help);
    commands.emplace_back(sub, entry.add(*sub));
    names.emplace_back(entry.name);
  }
  command.footer(
      "Examples:\n"
      "  dlsd camera show wide.yaml --plot wide.png\n"
      "  dlsd camera check wide.yaml --image photo.png\n"
      "  dlsd camera convert wide.yaml --to kannala_brandt --out wide_kb.yaml\n"
      "  dlsd camera rectify wide.yaml photo.png --crop --fov 120 --out rectified\n"
      "dlsd camera COMMAND --help shows more.");
  return [commands, names]() -> int {
    for (const auto& [sub, run] : commands) {
      if (sub->parsed()) {
        return run();
      }
    }
    throw InputError(fmt::format("camera needs to be told what to do: {} (dlsd camera --help)",
                                 fmt::join(names, ", ")));
  };
}

}  // namespace dlsd::cli
