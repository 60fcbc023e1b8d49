// Any bytes as a calibration file: each reader must refuse them with an InputError of one line, or
// give cameras that are valid and that survive writing and reading.
//
// By libFuzzer, with DLSD_FUZZ=ON and clang (fuzz/README.md); fuzz/replay.cpp runs the same over
// saved inputs with any compiler.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"

namespace dlsd {
namespace {

[[noreturn]] void fail(const std::string& what, std::string_view format) {
  std::fprintf(stderr, "format \"%.*s\": %s\n", int(format.size()), format.data(), what.c_str());
  std::abort();
}

/// Equal up to what calibrationText excepts.
bool same(const Camera& a, const Camera& b, bool rounded) {
  if (a == b) return true;
  if (a.width() != b.width() || a.height() != b.height() ||
      a.maxFieldAngleLimit() != b.maxFieldAngleLimit()) {
    return false;
  }
  const std::vector<double> x = a.params();
  const std::vector<double> y = b.params();
  if (a.modelName() == b.modelName()) {
    for (size_t i = 0; i < x.size(); ++i) {
      if (!(std::abs(x[i] - y[i]) <= (rounded ? 1e-12 * std::abs(x[i]) : 0))) return false;
    }
    return true;
  }
  // Read back as the simpler model: its parameters come first, the rest must be 0.
  if (a.modelName() != std::string(b.modelName()) + "_radtan" || y.size() > x.size()) return false;
  for (size_t i = 0; i < x.size(); ++i) {
    if (x[i] != (i < y.size() ? y[i] : 0)) return false;
  }
  return true;
}

void checkCamera(const Camera& camera, std::string_view format) {
  for (size_t i = 0; i < camera.params().size(); ++i) {
    const ParamSpec& spec = camera.paramSpecs()[i];
    const double value = camera.params()[i];
    if (!(value >= spec.min && value <= spec.max)) {
      fail("parameter out of range: " + std::string(spec.name), format);
    }
  }
  // Valid implies finite, at a few pixels of the image.
  for (const double u : {0.0, 0.3, 0.5, 1.0}) {
    for (const double v : {0.0, 0.5, 0.9}) {
      const auto ray = camera.unproject({u * camera.width() - 0.5, v * camera.height() - 0.5});
      if (ray && !(std::abs(ray->norm() - 1) < 1e-9)) fail("a ray that is no unit vector", format);
    }
  }
}

void checkFormat(const std::string& text, std::string_view format) {
  LoadedCalibration loaded;
  try {
    loaded = parseCalibration(text, "f", format);
  } catch (const InputError& e) {
    const std::string message = e.what();
    if (!message.starts_with("f: ") || message.find('\n') != std::string::npos ||
        message.size() > 3000) {
      fail("message: " + message, format);
    }
    return;
  }
  if (loaded.cameras.empty()) fail("no camera", format);
  std::set<std::string> names;
  for (const NamedCamera& c : loaded.cameras) {
    if (!names.insert(c.name).second) fail("the name " + c.name + " twice", format);
    checkCamera(c.camera, format);
  }
  for (const CalibrationFormat& f : calibrationFormats()) {
    if (!f.written) continue;
    std::string written;
    try {
      written = calibrationText(loaded.cameras, f.name);
    } catch (const std::invalid_argument& e) {
      if (f.name == "kalibr") fail(std::string("not written: ") + e.what(), format);
      continue;
    }
    const LoadedCalibration back = parseCalibration(written, "f", "");
    if (!f.name.starts_with(back.format))
      fail("written as " + std::string(f.name) + ":\n" + written, format);
    if (back.cameras.size() != loaded.cameras.size()) fail("cameras lost:\n" + written, format);
    for (size_t i = 0; i < back.cameras.size(); ++i) {
      const bool kalibr = f.name == "kalibr";
      if ((kalibr || f.name == "colmap") && back.cameras[i].name != loaded.cameras[i].name) {
        fail("name lost:\n" + written, format);
      }
      if (kalibr ? !(back.cameras[i].camera == loaded.cameras[i].camera)
                 : !same(loaded.cameras[i].camera, back.cameras[i].camera, f.name == "basalt")) {
        fail("not read back as it was:\n" + written, format);
      }
    }
  }
}

}  // namespace
}  // namespace dlsd

/// Recognised by content, and as each of the formats, or as the one in DLSD_FUZZ_FORMAT alone.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const char* const only = std::getenv("DLSD_FUZZ_FORMAT");
  const std::string text(reinterpret_cast<const char*>(data), size);
  dlsd::checkFormat(text, "");
  for (const dlsd::CalibrationFormat& format : dlsd::calibrationFormats()) {
    if (only == nullptr || format.name == only) dlsd::checkFormat(text, format.name);
  }
  return 0;
}
