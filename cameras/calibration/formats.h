#pragma once
// The formats of calibration files, one row each. Not part of the installed interface.

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/fields.h"

namespace dlsd::calib {

/// A line of a plain text file without its comment; empty lines are left out.
struct TextLine {
  int number;  ///< From 1.
  std::vector<Node> words;
  /// A word, named in messages as "line 3: fx".
  [[nodiscard]] Field word(const std::string& source, size_t index, std::string_view name) const;
};

/// A file that was understood as far as its syntax goes.
struct Document {
  std::string source;
  std::string text;
  bool tree = true;             ///< YAML, JSON or XML; otherwise plain text.
  Node root;                    ///< Of a tree.
  std::vector<TextLine> lines;  ///< Of plain text.
  [[nodiscard]] Field field() const { return {root, source}; }
};

struct Loaded {
  std::vector<NamedCamera> cameras;
  bool from_corner = false;  ///< Pixel coordinates were those of the other convention, and shifted.
};

struct Format {
  std::string_view name;
  std::string_view about;  ///< What it is, and by what its files are known.
  bool tree;               ///< YAML, JSON or XML; otherwise plain text.
  /// Whether a file of the right syntax looks like this format, complete or not. Null if the format
  /// has to be asked for.
  bool (*recognises)(const Document&);
  Loaded (*read)(const Document&);
  /// Throws std::invalid_argument for cameras that it cannot say. Null if it is only read.
  std::string (*write)(const std::vector<NamedCamera>&);
};

/// For a writer's refusal: "cam0: <format> cannot say the model ocam, but pinhole, ...: convert the
/// camera first".
[[noreturn]] void refuseModel(const NamedCamera& camera,
                              std::string_view format,
                              std::span<const std::string_view> models);
/// The camera of a format whose files hold one alone.
[[nodiscard]] const NamedCamera& onlyCamera(const std::vector<NamedCamera>& cameras,
                                            std::string_view format);
/// "cam7" -> 7; nothing for other names.
[[nodiscard]] std::optional<long> cameraNumber(std::string_view name);

// kalibr.cpp
bool isKalibr(const Document& document);
Loaded readKalibr(const Document& document);
std::string writeKalibr(const std::vector<NamedCamera>& cameras);
bool isPanorama(const Document& document);
Loaded readPanorama(const Document& document);

// opencv.cpp
bool isOpencv(const Document& document);
Loaded readOpencv(const Document& document);
Loaded readOpencvFisheye(const Document& document);
Loaded readOpencvOmnidir(const Document& document);
Loaded readOpencvPinhole(const Document& document);
std::string writeOpencv(const std::vector<NamedCamera>& cameras);
std::string writeOpencvFisheye(const std::vector<NamedCamera>& cameras);
std::string writeOpencvOmnidir(const std::vector<NamedCamera>& cameras);
std::string writeOpencvPinhole(const std::vector<NamedCamera>& cameras);
bool isRos(const Document& document);
Loaded readRos(const Document& document);
std::string writeRos(const std::vector<NamedCamera>& cameras);

// slam.cpp
bool isCamodocal(const Document& document);
Loaded readCamodocal(const Document& document);
bool isOrbSlam3(const Document& document);
Loaded readOrbSlam3(const Document& document);

// json.cpp
bool isBasalt(const Document& document);
Loaded readBasalt(const Document& document);
std::string writeBasalt(const std::vector<NamedCamera>& cameras);
bool isWoodscape(const Document& document);
Loaded readWoodscape(const Document& document);

// text.cpp
bool isColmap(const Document& document);
Loaded readColmap(const Document& document);
std::string writeColmap(const std::vector<NamedCamera>& cameras);
bool isTum(const Document& document);
Loaded readTum(const Document& document);
bool isOcamcalib(const Document& document);
Loaded readOcamcalib(const Document& document);

}  // namespace dlsd::calib
