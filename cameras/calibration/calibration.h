#pragma once
// Calibration files. The native form is Kalibr's camchain YAML.

#include <string>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

struct NamedCamera {
  std::string name;  ///< "cam0", "cam1", ... in Kalibr files.
  Camera camera;
};

struct LoadedCalibration {
  std::string format;  ///< "kalibr".
  std::string
      pixel_convention;  ///< What the file's pixel coordinates mean, and how they were read.
  std::vector<NamedCamera> cameras;  ///< In file order, at least one.
};

/// A calibration file, and how it was understood.
/// @param format  "" recognises the format by the file's content.
/// Throws InputError as loadCameras.
[[nodiscard]] LoadedCalibration loadCalibration(const std::string& path,
                                                const std::string& format = "");

/// All cameras of a calibration file, in file order.
/// Throws InputError (files.h) with file, key, value and allowed range for anything missing,
/// unknown, truncated, ambiguous or out of range; nothing is guessed.
[[nodiscard]] std::vector<NamedCamera> loadCameras(const std::string& path);

/// One camera: "file.yaml" (the file must hold exactly one) or "file.yaml:cam1".
[[nodiscard]] Camera loadCamera(const std::string& path_or_path_and_name);

/// Kalibr camchain text; exact: reading it back gives cameras that compare equal. A limit of the
/// field angle is written as our extension `max_field_angle` (rad), with a comment that marks it as
/// ours. Throws std::invalid_argument if there is no camera, or names are not cam0, cam1, ..., each
/// once.
[[nodiscard]] std::string kalibrYaml(const std::vector<NamedCamera>& cameras);

/// Writes kalibrYaml atomically.
void saveCameras(const std::string& path, const std::vector<NamedCamera>& cameras);

}  // namespace dlsd
