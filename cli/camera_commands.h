#pragma once
// The commands of `dlsd camera`, one file each, and what they share.

#include <optional>
#include <string>

#include "cameras/calibration/calibration.h"
#include "cli/command.h"

namespace dlsd::cli {

Run addCameraShow(CLI::App& command);
Run addCameraCheck(CLI::App& command);
Run addCameraConvert(CLI::App& command);
Run addCameraRectify(CLI::App& command);

/// Adds --format, by which calibration files are read; empty: by their content.
void addCalibrationFormat(CLI::App& command, std::string* format);

/// What the user names by FILE or FILE:camera and --format.
struct CameraArgument {
  std::string path, format;
};

/// Adds both to a command, the file required and first.
void addCameraArgument(CLI::App& command, CameraArgument* argument);

/// The cameras of the file, or the one that is named.
[[nodiscard]] LoadedCalibration loadChosen(const CameraArgument& argument);

/// The one camera. Throws InputError if the file holds several and none is named.
[[nodiscard]] Camera loadOne(const CameraArgument& argument);

/// Angle of a ray to the optical axis, rad.
[[nodiscard]] double fieldAngle(const Eigen::Vector3d& ray_in_cam);

/// Ray with a field angle, and an angle from x towards y about the axis.
[[nodiscard]] Eigen::Vector3d rayAt(double field_angle_rad, double azimuth_rad);

/// Scale of the image at a ray, px per degree: along the meridian and across it.
struct Scale {
  double angle_rad = 0;  ///< Field angle of the ray.
  double radial = 0, tangential = 0;
};
/// No value outside the domain.
[[nodiscard]] std::optional<Scale> scaleAt(const Camera& camera, const Eigen::Vector3d& ray_in_cam);

inline constexpr double kDegreesPerRad = 57.295779513082320877;

}  // namespace dlsd::cli
