#include "synth/sensor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "cameras/calibration/files.h"
#include "synth/dataset/json_fields.h"
#include "synth/dataset/random.h"

namespace dlsd {
namespace {

/// Stream of the read noise, so that other uses of (seed, index) don't see the same numbers.
constexpr uint64_t kReadNoiseStream = 0x5ead;

void requireRange(std::string_view name, double value, double lo, double hi) {
  if (value >= lo && value <= hi) return;
  std::ostringstream message;
  message << "sensor." << name << " = " << value << " is out of range: allowed is [" << lo << ", "
          << hi << "]";
  throw std::invalid_argument(message.str());
}

constexpr std::array<std::pair<Encoding, std::string_view>, 3> kEncodings{
    {{Encoding::kLinear, "linear"}, {Encoding::kSrgb, "srgb"}, {Encoding::kGamma, "gamma"}}};

std::vector<float> gaussianKernel(double sigma) {
  const int radius = std::max(1, static_cast<int>(std::ceil(4 * sigma)));
  std::vector<double> kernel;
  double sum = 0;
  for (int k = -radius; k <= radius; ++k) {
    kernel.push_back(std::exp(-0.5 * (k / sigma) * (k / sigma)));
    sum += kernel.back();
  }
  std::vector<float> out;
  out.reserve(kernel.size());
  for (const double w : kernel) out.push_back(static_cast<float>(w / sum));
  return out;
}

}  // namespace

void SensorOptions::check() const {
  requireRange("psf_sigma_px", psf_sigma_px, 0, 20);
  requireRange("exposure", exposure, 1e-3, 1e3);
  requireRange("read_noise_levels", read_noise_levels, 0, 100);
  requireRange("gamma", gamma, 1, 4);
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
  (void)field["bits"].integer(8, 8);
  try {
    sensor.check();
  } catch (const std::invalid_argument& e) {
    throw InputError(source + ": " + e.what());
  }
  return sensor;
}

nlohmann::ordered_json toJson(const SensorOptions& sensor) {
  nlohmann::ordered_json json{{"psf_sigma_px", sensor.psf_sigma_px},
                              {"exposure", sensor.exposure},
                              {"read_noise_levels", sensor.read_noise_levels},
                              {"encoding", toString(sensor.encoding)}};
  if (sensor.encoding == Encoding::kGamma) json["gamma"] = sensor.gamma;
  json["bits"] = 8;
  return json;
}

double greyLevel(const SensorOptions& sensor, double radiance) {
  const double x = std::clamp(radiance * sensor.exposure, 0.0, 1.0);
  switch (sensor.encoding) {
    case Encoding::kLinear:
      return 255 * x;
    case Encoding::kSrgb:
      return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055);
    case Encoding::kGamma:
      return 255 * std::pow(x, 1 / sensor.gamma);
  }
  return 0;
}

void blur(const SensorOptions& sensor, int width, int height, std::vector<float>* radiance) {
  if (!(sensor.psf_sigma_px > 0)) return;
  const std::vector<float> kernel = gaussianKernel(sensor.psf_sigma_px);
  const int radius = static_cast<int>(kernel.size() / 2);
  const auto w = static_cast<size_t>(width), h = static_cast<size_t>(height);
  // Rows, through a copy that is continued by the border pixels.
  std::vector<float> padded(w + 2 * static_cast<size_t>(radius));
  for (size_t y = 0; y < h; ++y) {
    float* row = radiance->data() + y * w;
    for (size_t x = 0; x < padded.size(); ++x) {
      const int source = std::clamp(static_cast<int>(x) - radius, 0, width - 1);
      padded[x] = row[source];
    }
    std::fill(row, row + w, 0.0F);
    for (size_t k = 0; k < kernel.size(); ++k) {
      const float weight = kernel[k];
      for (size_t x = 0; x < w; ++x) row[x] += weight * padded[x + k];
    }
  }
  // Columns: every output row is a weighted sum of input rows.
  const std::vector<float> input = *radiance;
  for (size_t y = 0; y < h; ++y) {
    float* row = radiance->data() + y * w;
    std::fill(row, row + w, 0.0F);
    for (size_t k = 0; k < kernel.size(); ++k) {
      const int source =
          std::clamp(static_cast<int>(y) + static_cast<int>(k) - radius, 0, height - 1);
      const float* in = input.data() + static_cast<size_t>(source) * w;
      const float weight = kernel[k];
      for (size_t x = 0; x < w; ++x) row[x] += weight * in[x];
    }
  }
}

Image exposeImage(const SensorOptions& sensor,
                  int width,
                  int height,
                  const std::vector<float>& blurred_radiance,
                  uint64_t seed,
                  uint64_t index) {
  Image image{width, height, 1, 8, {}};
  image.bytes.resize(blurred_radiance.size());
  const Random noise(hashCounters({seed, index}), kReadNoiseStream);
  for (size_t i = 0; i < blurred_radiance.size(); ++i) {
    double grey = greyLevel(sensor, static_cast<double>(blurred_radiance[i]));
    if (sensor.read_noise_levels > 0) grey += sensor.read_noise_levels * noise.normal(i);
    image.bytes[i] = static_cast<uint8_t>(std::clamp(std::floor(grey + 0.5), 0.0, 255.0));
  }
  return image;
}

}  // namespace dlsd
