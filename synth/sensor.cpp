#include "synth/sensor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "cameras/calibration/files.h"
#include "cameras/mutant.h"
#include "synth/dataset/json_fields.h"
#include "synth/dataset/random.h"
#include "synth/parallel.h"
#include "synth/pixel_response.h"

namespace dlsd {
namespace {

/// Streams of the noise, so that other uses of (seed, index) don't see the same numbers.
constexpr uint64_t kReadNoiseStream = 0x5ead, kShotNoiseStream = 0x5407;

void requireRange(std::string_view name, double value, double lo, double hi) {
  if (value >= lo && value <= hi) return;
  std::ostringstream message;
  message << "sensor." << name << " = " << value << " is out of range: allowed is [" << lo << ", "
          << hi << "]";
  throw std::invalid_argument(message.str());
}

constexpr std::array<std::pair<Encoding, std::string_view>, 3> kEncodings{
    {{Encoding::kLinear, "linear"}, {Encoding::kSrgb, "srgb"}, {Encoding::kGamma, "gamma"}}};

/// x with P(normal <= x) = p, for p in (0, 1/2], by Newton's method from the left.
double normalQuantile(double p) {
  double x = -std::sqrt(-2 * std::log(p));
  for (int i = 0; i < 60; ++i) {
    const double density = std::exp(-0.5 * x * x) / std::sqrt(2 * M_PI);
    const double step = (std::erfc(-x / std::sqrt(2.0)) / 2 - p) / density;
    x -= step;
    if (std::abs(step) < 1e-12) break;
  }
  return x;
}

/// Standard normal values: the quantile of a uniform value, interpolated in a table (to 1e-3)
/// except for the outermost 0.4 %.
class NormalTable {
 public:
  NormalTable() {
    for (size_t i = 1; i <= kCells / 2; ++i) {
      quantiles_[i] = normalQuantile(static_cast<double>(i) / kCells);
      quantiles_[kCells - i] = -quantiles_[i];
    }
    quantiles_[kCells / 2] = 0;
  }

  [[nodiscard]] double at(uint64_t bits) const {
    const double place = unitFromBits(bits) * kCells;
    const auto cell = static_cast<size_t>(place);
    if (cell < kTail) return normalQuantile((place + 0x1p-42) / kCells);
    if (cell >= kCells - kTail) return -normalQuantile((kCells - place) / kCells);
    const double fraction = place - static_cast<double>(cell);
    return quantiles_[cell] + fraction * (quantiles_[cell + 1] - quantiles_[cell]);
  }

 private:
  static constexpr size_t kCells = 4096, kTail = 8;
  std::array<double, kCells> quantiles_{};
};

const NormalTable& normals() {
  static const NormalTable table;
  return table;
}

/// A Poisson number with this mean; from 32 on a normal one of the same mean and variance.
double poisson(double mean, uint64_t bits) {
  if (mean >= 32) return std::max(0.0, mean + std::sqrt(mean) * normals().at(bits));
  double rest = unitFromBits(bits), probability = std::exp(-mean);
  int count = 0;
  while (rest >= probability && count < 200) {
    rest -= probability;
    ++count;
    probability *= mean / count;
  }
  return count;
}

/// greyLevel by linear interpolation in a table, to 1e-3 levels; the steep dark end is computed.
class EncodingTable {
 public:
  explicit EncodingTable(const SensorOptions& sensor) : sensor_(sensor) {
    sensor_.exposure = 1;
    if (sensor_.encoding == Encoding::kLinear) return;
    for (size_t i = 0; i <= kCells; ++i) {
      levels_.push_back(greyLevel(sensor_, static_cast<double>(i) / kCells));
    }
  }

  /// @param linear  Linear level, 1 is white.
  [[nodiscard]] double at(double linear) const {
    const double x = std::clamp(linear, 0.0, 1.0);
    if (levels_.empty()) return 255 * x;
    const double place = x * kCells;
    const auto cell = static_cast<size_t>(place);
    if (cell < kDark || cell >= kCells) return greyLevel(sensor_, x);
    const double fraction = place - static_cast<double>(cell);
    return levels_[cell] + fraction * (levels_[cell + 1] - levels_[cell]);
  }

 private:
  static constexpr size_t kCells = 4096, kDark = 64;
  SensorOptions sensor_;
  std::vector<double> levels_;
};

}  // namespace

void SensorOptions::check() const {
  requireRange("psf_sigma_px", psf_sigma_px, 0, 20);
  requireRange("defocus_radius_px", defocus_radius_px, 0, PixelResponse::kMaxDefocusPx);
  requireRange("vignetting", vignetting, 0, 1);
  requireRange("exposure", exposure, 1e-3, 1e3);
  if (full_well_electrons != 0) requireRange("full_well_electrons", full_well_electrons, 1, 1e9);
  requireRange("read_noise_levels", read_noise_levels, 0, 100);
  requireRange("gamma", gamma, 1, 4);
  if (bits != 8 && bits != 16) {
    throw std::invalid_argument("sensor.bits = " + std::to_string(bits) +
                                " is out of range: allowed are 8 and 16");
  }
}

std::string_view toString(Encoding encoding) {
  for (const auto& [value, name] : kEncodings) {
    if (value == encoding) return name;
  }
  return "";
}

std::optional<Encoding> encodingFromName(std::string_view wanted) {
  for (const auto& [value, name] : kEncodings) {
    if (name == wanted) return value;
  }
  return std::nullopt;
}

SensorOptions sensorFromJson(const nlohmann::json& json, const std::string& source) {
  const JsonField field(json, source, "sensor");
  SensorOptions sensor;
  sensor.psf_sigma_px = field["psf_sigma_px"].number();
  sensor.exposure = field["exposure"].number();
  sensor.read_noise_levels = field["read_noise_levels"].number();
  const auto encoding = encodingFromName(field["encoding"].text());
  if (!encoding) field["encoding"].fail("must be one of linear, srgb, gamma");
  sensor.encoding = *encoding;
  if (sensor.encoding == Encoding::kGamma) sensor.gamma = field["gamma"].number();
  sensor.bits = field["bits"].integer(8, 16);
  if (field.has("defocus_radius_px")) {
    sensor.defocus_radius_px = field["defocus_radius_px"].number();
  }
  if (field.has("vignetting")) sensor.vignetting = field["vignetting"].number();
  if (field.has("full_well_electrons")) {
    sensor.full_well_electrons = field["full_well_electrons"].number();
  }
  if (field.has("shot_noise_seed")) sensor.shot_noise_seed = field["shot_noise_seed"].counter();
  if (field.has("read_noise_seed")) sensor.read_noise_seed = field["read_noise_seed"].counter();
  try {
    sensor.check();
  } catch (const std::invalid_argument& e) {
    throw InputError(source + ": " + e.what());
  }
  return sensor;
}

nlohmann::ordered_json toJson(const SensorOptions& sensor) {
  nlohmann::ordered_json json{{"psf_sigma_px", sensor.psf_sigma_px}};
  if (sensor.defocus_radius_px > 0) json["defocus_radius_px"] = sensor.defocus_radius_px;
  if (sensor.vignetting > 0) json["vignetting"] = sensor.vignetting;
  json["exposure"] = sensor.exposure;
  if (sensor.full_well_electrons > 0) {
    json["full_well_electrons"] = sensor.full_well_electrons;
    json["shot_noise_seed"] = sensor.shot_noise_seed;
  }
  json["read_noise_levels"] = sensor.read_noise_levels;
  if (sensor.read_noise_levels > 0) json["read_noise_seed"] = sensor.read_noise_seed;
  json["encoding"] = toString(sensor.encoding);
  if (sensor.encoding == Encoding::kGamma) json["gamma"] = sensor.gamma;
  json["bits"] = sensor.bits;
  return json;
}

double vignettingAt(const SensorOptions& sensor,
                    int width,
                    int height,
                    const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d half(width / 2.0, height / 2.0);
  const Eigen::Vector2d from_centre =
      pixel - half + Eigen::Vector2d(0.5, DLSD_MUTANT("vignetting-centre") ? 0.0 : 0.5);
  return std::max(0.0, 1 - sensor.vignetting * from_centre.squaredNorm() / half.squaredNorm());
}

double greyLevel(const SensorOptions& sensor, double radiance) {
  const double x = std::clamp(radiance * sensor.exposure, 0.0, 1.0);
  switch (sensor.encoding) {
    case Encoding::kLinear:
      return 255 * x;
    case Encoding::kSrgb:
      return 255 * (x <= (DLSD_MUTANT("srgb-bound") ? 0.04045 : 0.0031308)
                        ? 12.92 * x
                        : 1.055 * std::pow(x, 1 / 2.4) - 0.055);
    case Encoding::kGamma:
      return 255 * std::pow(x, 1 / sensor.gamma);
  }
  return 0;
}

Image exposeImage(const SensorOptions& sensor,
                  int width,
                  int height,
                  const std::vector<float>& radiance,
                  uint64_t seed,
                  uint64_t index) {
  Image image{width, height, 1, sensor.bits, {}};
  image.bytes.resize(radiance.size() * static_cast<size_t>(sensor.bits / 8));
  const EncodingTable encoding(sensor);
  const Random shot(hashCounters({seed, index, sensor.shot_noise_seed}), kShotNoiseStream);
  const Random read(hashCounters({seed, index, sensor.read_noise_seed}), kReadNoiseStream);
  const double white = sensor.bits == 8 ? 255 : 65535;
  forEachBand(height, [&](int /*band*/, int first, int end) {
    for (int y = first; y < end; ++y) {
      for (int x = 0; x < width; ++x) {
        const size_t i =
            static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
        double linear = static_cast<double>(radiance[i]) * sensor.exposure;
        if (sensor.vignetting > 0) linear *= vignettingAt(sensor, width, height, {x, y});
        if (sensor.full_well_electrons > 0) {
          const double mean = std::max(0.0, linear) * sensor.full_well_electrons;
          linear = poisson(mean, DLSD_MUTANT("noise-dependent") ? read.bits(i) : shot.bits(i)) /
                   sensor.full_well_electrons;
        }
        double grey = encoding.at(linear);
        if (sensor.read_noise_levels > 0) {
          grey += sensor.read_noise_levels *
                  normals().at(read.bits(DLSD_MUTANT("read-noise-pairs") ? i / 2 : i));
        }
        const double level =
            std::clamp(std::floor(grey * (white / 255) + (DLSD_MUTANT("sensor-floor") ? 0.0 : 0.5)),
                       0.0,
                       white);
        if (sensor.bits == 8) {
          image.bytes[i] = static_cast<uint8_t>(level);
        } else {
          const auto value = static_cast<uint16_t>(level);
          std::memcpy(image.bytes.data() + 2 * i, &value, 2);
        }
      }
    }
  });
  return image;
}

}  // namespace dlsd
