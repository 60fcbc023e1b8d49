#pragma once
// The sensor: linear radiance -> pixels. Optical blur, vignetting, exposure, shot noise, encoding,
// read noise, quantisation, in this order; each can be switched off.

#include <Eigen/Core>
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

/// Every stage can be switched off; the values here are "off" except for psf_sigma_px.
struct SensorOptions {
  double psf_sigma_px = 0.7;     ///< Gaussian optical blur, px, in [0, 20]; 0: off.
  double defocus_radius_px = 0;  ///< Radius of the disc of an unfocused lens, in [0, 10]; 0: off.
  /// Share of the light lost in the image's corners, in [0, 1]; 0: off. A pixel at the distance d
  /// from the image's centre keeps 1 - vignetting * (d / half of the diagonal)^2.
  double vignetting = 0;
  double exposure = 1;  ///< Factor on the radiance, in [1e-3, 1e3]; 1: off.
  /// Photoelectrons that make a pixel white, in [1, 1e9]; 0: no shot noise. A pixel of linear level
  /// x (1 is white) collects a Poisson number of electrons with mean x * full_well_electrons.
  double full_well_electrons = 0;
  uint64_t shot_noise_seed = 0;  ///< Another one: other noise on the same picture.
  double read_noise_levels = 0;  ///< Sigma in 8-bit grey levels, added after encoding, in [0, 100].
  uint64_t read_noise_seed = 0;
  Encoding encoding = Encoding::kLinear;
  double gamma = 2.2;  ///< For kGamma, in [1, 4].
  int bits = 8;        ///< Of the image: 8 or 16.

  /// Throws std::invalid_argument naming the field, its value and the allowed range.
  void check() const;
};

/// "linear", "srgb", "gamma": the names in files and on the command line.
[[nodiscard]] std::string_view toString(Encoding encoding);
[[nodiscard]] std::optional<Encoding> encodingFromName(std::string_view name);

/// Stages that are off by default (defocus, vignetting, shot noise, 16 bit) appear where they are
/// on.
[[nodiscard]] nlohmann::ordered_json toJson(const SensorOptions& sensor);
/// The inverse of toJson. `source` names the file in messages. Throws InputError for anything
/// missing, of the wrong type or out of range.
[[nodiscard]] SensorOptions sensorFromJson(const nlohmann::json& json, const std::string& source);

/// What vignetting leaves of the light at a place of a width x height image: 1 in its centre.
[[nodiscard]] double vignettingAt(const SensorOptions& sensor,
                                  int width,
                                  int height,
                                  const Eigen::Vector2d& pixel);

/// Grey level (0..255, not rounded, clamped as a saturating sensor does) of linear radiance,
/// without noise and vignetting. Monotone in the radiance.
[[nodiscard]] double greyLevel(const SensorOptions& sensor, double radiance);

/// Turns what the pixels answer (renderRadiance with a PixelResponse of psf_sigma_px and
/// defocus_radius_px) into an image. Shot noise is a function of (seed, index, shot_noise_seed,
/// pixel), read noise of (seed, index, read_noise_seed, pixel). A 16-bit level is 1/257 of an 8-bit
/// one.
[[nodiscard]] Image exposeImage(const SensorOptions& sensor,
                                int width,
                                int height,
                                const std::vector<float>& radiance,
                                uint64_t seed,
                                uint64_t index);

}  // namespace dlsd
