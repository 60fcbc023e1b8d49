#pragma once
// Pictures that no scene made: every pixel type, channel count, stride and size that a detector may
// be given, filled with what breaks edge detectors.

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string_view>
#include <vector>

#include "cameras/camera.h"
#include "detector/image_view.h"

namespace dlsd {

enum class Fill {
  kConstant,
  kRamp,
  kStripes,
  kCheckerboard,
  kDisc,
  kPolygon,
  kWhiteNoise,
  kBlurredNoise,
  kSaltAndPepper,
  kRandomBytes,
  kShotNoise,
};
inline constexpr int kFillCount = 11;
[[nodiscard]] std::string_view nameOf(Fill fill);
[[nodiscard]] std::optional<Fill> fillFromName(std::string_view name);

/// What a picture that no scene made is made from, bit for bit.
struct TestImageSpec {
  Fill fill = Fill::kConstant;
  int width = 1, height = 1, channels = 1;
  PixelType type = PixelType::kU8;
  int padding = 0;  ///< Values between the rows.
  bool bgr = false;
  uint64_t seed = 0;
  double noise_sigma = 0, blur_px = 0;  ///< Of the fills that read them (see filled).
};

/// An owned picture of any type, with padding between the rows.
struct TestImage {
  Fill fill = Fill::kConstant;
  int width = 1, height = 1, channels = 1;
  PixelType type = PixelType::kU8;
  ptrdiff_t stride_bytes = 1;
  bool bgr = false;
  std::vector<std::byte> bytes;

  [[nodiscard]] ImageView view() const {
    return {bytes.data(), width, height, channels, stride_bytes, type, bgr};
  }
};
/// One line, for a person.
std::ostream& operator<<(std::ostream& out, const TestImageSpec& spec);
inline void showValue(const TestImageSpec& spec, std::ostream& out) {
  out << spec;
}

/// Grey levels in [0, 255], row-major: a fill with its own parameters drawn from (seed, pixel).
/// noise_sigma: of kWhiteNoise, kBlurredNoise (before the blur of blur_px) and kShotNoise (Poisson
/// counts with a mean of 128 grey levels, so many electrons that this is their spread).
[[nodiscard]] std::vector<float> filled(
    Fill fill, int width, int height, uint64_t seed, double noise_sigma, double blur_px);

/// Standard deviation that the blur of kBlurredNoise leaves of white noise of 1.
[[nodiscard]] double blurGain(double blur_px);

[[nodiscard]] TestImage makeTestImage(const TestImageSpec& spec);

/// The part of a camera's image that starts at (left, top), width x height px: the same model with
/// its principal point moved. May reach beyond the camera's image.
[[nodiscard]] Camera croppedCamera(const Camera& camera, int left, int top, int width, int height);

/// The camera behind a mirror: column u becomes column width - 1 - u.
[[nodiscard]] Camera mirroredCamera(const Camera& camera);

}  // namespace dlsd
