#pragma once
// Calibration files of several programs. The native form is Kalibr's camchain YAML; which others
// are read and written, and what their numbers mean, is in docs/calibration-files.md.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

struct NamedCamera {
  std::string name;  ///< "cam" and the file's own number, "cam0" in files without numbers.
  Camera camera;
};

struct LoadedCalibration {
  std::string format;  ///< Name of the format that was recognised or asked for.
  std::string
      pixel_convention;  ///< What the file's pixel coordinates mean, and how they were read.
  std::vector<NamedCamera> cameras;  ///< In file order, at least one.
};

struct CalibrationFormat {
  std::string_view name;   ///< As in --format.
  std::string_view about;  ///< One line: whose format it is, and by what its files are known.
  bool recognised;         ///< By content; otherwise it has to be asked for.
  bool written;            ///< calibrationText can write it.
};

/// All formats that are read.
[[nodiscard]] std::span<const CalibrationFormat> calibrationFormats();

/// All cameras of a calibration file. The format is recognised by the file's content, or it is
/// `format`, one of calibrationFormats().
/// Throws InputError (files.h) with file, key, value and allowed range for anything missing,
/// unknown, duplicated, truncated, ambiguous or out of range; nothing is guessed. Files beyond
/// 4 MiB, 500,000 values or 32 levels are refused, so that time and memory are bounded.
[[nodiscard]] LoadedCalibration loadCalibration(const std::string& path,
                                                std::string_view format = "");

/// The same of a text; `source` names it in messages.
[[nodiscard]] LoadedCalibration parseCalibration(std::string_view text,
                                                 const std::string& source,
                                                 std::string_view format = "");

/// The cameras alone.
[[nodiscard]] std::vector<NamedCamera> loadCameras(const std::string& path,
                                                   std::string_view format = "");

/// One camera: "file.yaml" (the file must hold exactly one) or "file.yaml:cam1".
[[nodiscard]] Camera loadCamera(const std::string& path_or_path_and_name,
                                std::string_view format = "");

/// Text of a calibration file. Exact: reading it back gives cameras that compare equal, except that
/// a model whose parameters are all those of a simpler one may come back as that, where the format
/// has one word for both, and that Basalt's ucm has other parameters than ours (equal to 1e-12).
/// Throws std::invalid_argument, naming models that would do, for a camera that the format cannot
/// say, for a format that is only read, and for camera names other than cam0, cam1, ..., each once.
[[nodiscard]] std::string calibrationText(const std::vector<NamedCamera>& cameras,
                                          std::string_view format);

/// Writes calibrationText atomically.
void saveCalibration(const std::string& path,
                     const std::vector<NamedCamera>& cameras,
                     std::string_view format);

/// calibrationText(cameras, "kalibr"), which can say every camera; what Kalibr itself does not know
/// is marked by a comment.
[[nodiscard]] std::string kalibrYaml(const std::vector<NamedCamera>& cameras);

/// Writes kalibrYaml atomically.
void saveCameras(const std::string& path, const std::vector<NamedCamera>& cameras);

}  // namespace dlsd
