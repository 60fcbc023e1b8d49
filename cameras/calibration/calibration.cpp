#include "cameras/calibration/calibration.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <optional>
#include <set>
#include <stdexcept>

#include "cameras/calibration/files.h"
#include "cameras/calibration/formats.h"

namespace dlsd {
namespace calib {
namespace {

constexpr std::array<Format, 14> kFormats{{
    {"kalibr",
     "Kalibr camchain: cam0, cam1, ... (the native format)",
     true,
     isKalibr,
     readKalibr,
     writeKalibr},
    {"opencv",
     "OpenCV FileStorage: camera_matrix or K, the model as fisheye_model, xi or the coefficients "
     "say",
     true,
     isOpencv,
     readOpencv,
     writeOpencv},
    {"opencv-fisheye",
     "OpenCV FileStorage of cv::fisheye",
     true,
     nullptr,
     readOpencvFisheye,
     writeOpencvFisheye},
    {"opencv-omnidir",
     "OpenCV FileStorage of cv::omnidir",
     true,
     nullptr,
     readOpencvOmnidir,
     writeOpencvOmnidir},
    {"opencv-pinhole",
     "OpenCV FileStorage of the pinhole model",
     true,
     nullptr,
     readOpencvPinhole,
     writeOpencvPinhole},
    {"colmap", "COLMAP cameras.txt: ID MODEL ...", false, isColmap, readColmap, writeColmap},
    {"basalt", "Basalt JSON: value0", true, isBasalt, readBasalt, writeBasalt},
    {"ros",
     "ROS camera_info YAML: camera_matrix and distortion_model",
     true,
     isRos,
     readRos,
     writeRos},
    {"camodocal", "camodocal, VINS: model_type", true, isCamodocal, readCamodocal, nullptr},
    {"orbslam3", "ORB-SLAM3 settings: Camera.type", true, isOrbSlam3, readOrbSlam3, nullptr},
    {"tum", "TUM mono, DSO camera.txt: four lines", false, isTum, readTum, nullptr},
    {"ocamcalib",
     "OCamCalib calib_results.txt: five lines",
     false,
     isOcamcalib,
     readOcamcalib,
     nullptr},
    {"woodscape", "WoodScape JSON: intrinsic", true, isWoodscape, readWoodscape, nullptr},
    {"panorama",
     "model: equirectangular, and a resolution: the whole sphere",
     true,
     isPanorama,
     readPanorama,
     nullptr},
}};

template <class Predicate>
std::string formatNames(Predicate predicate) {
  std::vector<std::string_view> names;
  for (const Format& f : kFormats) {
    if (predicate(f)) names.push_back(f.name);
  }
  return listed(names);
}

/// Position of the first byte that is not part of UTF-8 text, or npos. Control characters other
/// than tab and line ends are no text.
size_t findNoText(std::string_view text) {
  for (size_t i = 0; i < text.size();) {
    const auto c = static_cast<unsigned char>(text[i]);
    if ((c < 0x20 && c != '\t' && c != '\r' && c != '\n') || c == 0x7f) return i;
    size_t length = 1;
    if (c >= 0x80) {
      length = c >= 0xf0 ? 4 : (c >= 0xe0 ? 3 : 2);
      if (c < 0xc2 || c > 0xf4 || i + length > text.size()) return i;
      uint32_t code = c & (0x7fU >> length);
      for (size_t k = 1; k < length; ++k) {
        const auto next = static_cast<unsigned char>(text[i + k]);
        if ((next & 0xc0U) != 0x80) return i;
        code = (code << 6U) | (next & 0x3fU);
      }
      constexpr std::array<uint32_t, 5> kSmallest{0, 0, 0x80, 0x800, 0x10000};
      if (code < kSmallest.at(length) || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) {
        return i;
      }
    }
    i += length;
  }
  return std::string_view::npos;
}

void refuseNoText(std::string_view text, const std::string& source) {
  if (text.size() > kMaxFileBytes) {
    throw InputError(source + ": is larger than " + std::to_string(kMaxFileBytes) +
                     " bytes, which no calibration file is");
  }
  if (const size_t at = findNoText(text); at != std::string_view::npos) {
    throw InputError(source + ": is not a text file in UTF-8: byte " + std::to_string(at + 1) +
                     " is " + std::to_string(static_cast<unsigned char>(text[at])));
  }
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    throw InputError(source + ": is empty, a calibration is expected");
  }
}

/// A number at the very end of a file may be a part of one.
void refuseCutOff(std::string_view text, const std::string& source) {
  text.remove_prefix(text.rfind('\n') + 1);              // npos + 1 is 0
  if (text.find('#') != std::string_view::npos) return;  // the comment is what may be cut off
  text.remove_prefix(text.find_last_of(" \t\r") + 1);
  if (parseNumber(text)) {
    throw InputError(source +
                     ": ends without a line break and may be cut off: please add one if the file "
                     "is complete");
  }
}

/// The words of a text without its comments, line by line.
std::vector<TextLine> linesOf(std::string_view text, const std::string& source) {
  std::vector<TextLine> lines;
  size_t words = 0;
  for (int number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    std::string_view rest = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    rest = rest.substr(0, rest.find('#'));
    TextLine line{number, {}};
    for (;;) {
      rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r"), rest.size()));
      if (rest.empty()) break;
      Node word;
      word.kind = Node::Kind::kScalar;
      word.text = rest.substr(0, rest.find_first_of(" \t\r"));
      rest.remove_prefix(word.text.size());
      line.words.push_back(std::move(word));
      if (++words > kMaxNodes) {
        throw InputError(source + ": holds more than " + std::to_string(kMaxNodes) +
                         " words, which no calibration file does");
      }
    }
    if (!line.words.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

/// XML, JSON and YAML are known by how the first line that is no comment begins, or by its colon.
bool looksLikeTree(std::string_view text) {
  while (!text.empty()) {
    std::string_view line = text.substr(0, std::min(text.find('\n'), text.size()));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
    if (line.empty() || line[0] == '#') continue;
    return std::string_view("<{[%").find(line[0]) != std::string_view::npos ||
           line.starts_with("---") ||
           line.substr(0, line.find('#')).find(':') != std::string_view::npos;
  }
  return true;
}

Document parse(std::string_view text, const std::string& source, bool tree) {
  Document document;
  document.source = source;
  document.text = text;
  document.tree = tree;
  if (!tree) {
    document.lines = linesOf(document.text, source);
  } else if (text.substr(text.find_first_not_of(" \t\r\n")).starts_with('<')) {
    document.root = parseOpencvXml(document.text, source);
  } else {
    document.root = parseYaml(document.text, source);
    if (document.root.kind == Node::Kind::kNull) {
      throw InputError(source + ": is empty, a calibration is expected");
    }
  }
  return document;
}

const Format& recognise(const Document& document) {
  std::vector<const Format*> found;
  for (const Format& f : kFormats) {
    if (f.recognises != nullptr && f.tree == document.tree && f.recognises(document)) {
      found.push_back(&f);
    }
  }
  if (found.empty()) {
    const std::string key =
        document.root.keys.empty()
            ? ""
            : " (its first key is " + inQuotes(document.root.keys.front()) + ")";
    throw InputError(document.source + ": is not a calibration file of a known format" + key +
                     ", known are " +
                     formatNames([](const Format& f) { return f.recognises != nullptr; }));
  }
  if (found.size() > 1) {
    throw InputError(document.source + ": may be " + std::string(found[0]->name) + " or " +
                     std::string(found[1]->name) + ": please choose the format");
  }
  return *found.front();
}

LoadedCalibration parseChecked(std::string_view text,
                               const std::string& source,
                               std::string_view format) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  refuseNoText(text, source);
  const auto* const forced = std::find_if(
      kFormats.begin(), kFormats.end(), [&](const Format& f) { return f.name == format; });
  if (!format.empty() && forced == kFormats.end()) {
    throw InputError(source + ": unknown calibration format " + inQuotes(format) +
                     ", allowed are " + formatNames([](const Format&) { return true; }));
  }
  const Document document =
      parse(text, source, format.empty() ? looksLikeTree(text) : forced->tree);
  const Format& chosen = format.empty() ? recognise(document) : *forced;
  Loaded loaded = chosen.read(document);
  refuseCutOff(text, source);
  return {std::string(chosen.name),
          loaded.from_corner
              ? "(0, 0) is the corner of the top left pixel in the file: 0.5 was "
                "subtracted from cx and cy"
              : "integer coordinates are pixel centres in the file, read as they are",
          std::move(loaded.cameras)};
}

}  // namespace

std::optional<long> cameraNumber(std::string_view name) {
  constexpr size_t kMaxDigits = 9;
  constexpr std::string_view kPrefix = "cam";
  if (!name.starts_with(kPrefix)) return std::nullopt;
  name.remove_prefix(kPrefix.size());
  const bool digits =
      !name.empty() && name.size() <= kMaxDigits &&
      std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits || (name.size() > 1 && name[0] == '0')) return std::nullopt;
  long number = 0;
  (void)std::from_chars(name.data(), name.data() + name.size(), number);
  return number;
}

void refuseModel(const NamedCamera& camera,
                 std::string_view format,
                 std::span<const std::string_view> models) {
  throw std::invalid_argument(camera.name + ": " + std::string(format) +
                              " cannot say this camera of the model " +
                              std::string(camera.camera.modelName()) + ", but " + listed(models) +
                              ": please convert the camera to one of them first");
}

const NamedCamera& onlyCamera(const std::vector<NamedCamera>& cameras, std::string_view format) {
  if (cameras.size() != 1) {
    throw std::invalid_argument("a file of the format " + std::string(format) +
                                " holds one camera, got " + std::to_string(cameras.size()));
  }
  return cameras.front();
}

}  // namespace calib

std::span<const CalibrationFormat> calibrationFormats() {
  // Not constexpr: to g++'s UBSan the address of a function is no constant (GCC bug 71962).
  static const auto formats = [] {
    std::array<CalibrationFormat, calib::kFormats.size()> all{};
    for (size_t i = 0; i < all.size(); ++i) {
      const calib::Format& f = calib::kFormats.at(i);
      all.at(i) = {f.name, f.about, f.recognises != nullptr, f.write != nullptr};
    }
    return all;
  }();
  return formats;
}

LoadedCalibration parseCalibration(std::string_view text,
                                   const std::string& source,
                                   std::string_view format) {
  try {
    return calib::parseChecked(text, source, format);
  } catch (const std::invalid_argument& e) {
    throw InputError(source + ": " + e.what());
  }
}

LoadedCalibration loadCalibration(const std::string& path, std::string_view format) {
  return parseCalibration(readFile(path, calib::kMaxFileBytes), path, format);
}

std::vector<NamedCamera> loadCameras(const std::string& path, std::string_view format) {
  return loadCalibration(path, format).cameras;
}

Camera loadCamera(const std::string& path_or_path_and_name, std::string_view format) {
  std::string path = path_or_path_and_name, name;
  std::error_code ignored;
  const size_t colon = path.rfind(':');
  if (!std::filesystem::exists(path, ignored) && colon != std::string::npos &&
      std::filesystem::exists(path.substr(0, colon), ignored) &&
      !std::filesystem::is_directory(path.substr(0, colon), ignored)) {
    name = path.substr(colon + 1);
    path.resize(colon);
  }
  const std::vector<NamedCamera> cameras = loadCameras(path, format);
  const auto names = [&] {
    constexpr size_t kMaxShown = 10;
    std::string text;
    for (size_t i = 0; i < std::min(cameras.size(), kMaxShown); ++i) {
      text += (i > 0 ? ", " : "") + cameras[i].name;
    }
    return cameras.size() > kMaxShown ? text + ", ..." : text;
  };
  if (path == path_or_path_and_name) {
    if (cameras.size() != 1) {
      throw InputError(path + ": holds " + std::to_string(cameras.size()) +
                       " cameras, choose one of " + names() + " as in " + path + ":" +
                       cameras.front().name);
    }
    return cameras.front().camera;
  }
  for (const NamedCamera& c : cameras) {
    if (c.name == name) return c.camera;
  }
  throw InputError(path + ": holds no camera " + calib::inQuotes(name) + ", allowed are " +
                   names());
}

std::string calibrationText(const std::vector<NamedCamera>& cameras, std::string_view format) {
  const auto* const known =
      std::find_if(calib::kFormats.begin(), calib::kFormats.end(), [&](const calib::Format& f) {
        return f.name == format && f.write != nullptr;
      });
  if (known == calib::kFormats.end()) {
    throw std::invalid_argument(
        "calibrations cannot be written in the format " + calib::inQuotes(format) +
        ", allowed are " +
        calib::formatNames([](const calib::Format& f) { return f.write != nullptr; }));
  }
  if (cameras.empty()) throw std::invalid_argument("a calibration needs at least one camera");
  std::set<std::string> seen;
  for (const NamedCamera& entry : cameras) {
    if (!calib::cameraNumber(entry.name) || !seen.insert(entry.name).second) {
      throw std::invalid_argument("camera name " + calib::inQuotes(entry.name) +
                                  " in a calibration: allowed are cam0, cam1, ..., each once");
    }
  }
  return known->write(cameras);
}

void saveCalibration(const std::string& path,
                     const std::vector<NamedCamera>& cameras,
                     std::string_view format) {
  writeFileAtomically(path, calibrationText(cameras, format));
}

std::string kalibrYaml(const std::vector<NamedCamera>& cameras) {
  return calibrationText(cameras, "kalibr");
}

void saveCameras(const std::string& path, const std::vector<NamedCamera>& cameras) {
  saveCalibration(path, cameras, "kalibr");
}

}  // namespace dlsd
