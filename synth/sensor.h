#pragma once
// The sensor: linear radiance -> pixels. Optical blur, exposure, encoding, read noise,
// quantisation, in this order; each can be switched off.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "synth/dataset/image.h"

namespace dlsd {

/// How linear light in [0, 1] becomes a grey level.
enum class Encoding {
  kLinear,  ///< 255 x. Edges stay where they are: the default for tests.
  kSrgb,    ///< The sRGB curve (IEC 61966-2-1). Moves edges by up to half a pixel towards the dark.
  kGamma,   ///< 255 x^(1 / gamma).
};

struct SensorOptions {
  double psf_sigma_px = 0.7;     ///< Gaussian optical blur, px, in [0, 20]; 0 switches it off.
  double exposure = 1;           ///< Factor on the radiance, in [1e-3, 1e3].
  double read_noise_levels = 0;  ///< Sigma in 8-bit grey levels, added after encoding, in [0, 100].
  Encoding encoding = Encoding::kLinear;
  double gamma = 2.2;  ///< For kGamma, in [1, 4].

  /// Throws std::invalid_argument naming the field, its value and the allowed range.
  void check() const;
};

/// "linear", "srgb", "gamma": the names in files and on the command line.
[[nodiscard]] std::string_view toString(Encoding encoding);
[[nodiscard]] std::optional<Encoding> encodingFromName(std::string_view name);

[[nodiscard]] nlohmann::ordered_json toJson(const SensorOptions& sensor);
/// The inverse of toJson. `source` names the file in messages. Throws InputError for anything
/// missing, of the wrong type or out of range.
[[nodiscard]] SensorOptions sensorFromJson(const nlohmann::json& json, const std::string& source);

/// Grey level (0..255, not rounded, clamped as a saturating sensor does) of linear radiance,
/// without noise. Monotone in the radiance.
[[nodiscard]] double greyLevel(const SensorOptions& sensor, double radiance);

/// Gaussian blur of `radiance` (width * height, row-major) in place of optical spread. The image is
/// continued by its border pixels; pixels without a ray (renderRadiance gives them 0) count as the
/// black they are. The kernel is the Gaussian sampled at whole pixels, cut at 4 sigma and
/// normalised.
void blur(const SensorOptions& sensor, int width, int height, std::vector<float>* radiance);

/// Encodes blurred radiance to 8 bits, with noise from (seed, index, pixel).
[[nodiscard]] Image exposeImage(const SensorOptions& sensor,
                                int width,
                                int height,
                                const std::vector<float>& blurred_radiance,
                                uint64_t seed,
                                uint64_t index);

}  // namespace dlsd
