#pragma once
// RapidCheck generators of pictures that no scene made: every pixel type, channel count, stride and
// size that a detector may be given, filled with what breaks edge detectors.

#include <rapidcheck.h>

#include <cstddef>
#include <iosfwd>
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
};
inline constexpr int kFillCount = 10;
[[nodiscard]] std::string_view nameOf(Fill fill);

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
std::ostream& operator<<(std::ostream& out, const TestImage& image);
inline void showValue(const TestImage& image, std::ostream& out) {
  out << image;
}

/// Grey levels in [0, 255], row-major: a fill with its own parameters drawn from (seed, pixel).
/// noise_sigma: of kWhiteNoise and kBlurredNoise (before the blur of blur_px).
[[nodiscard]] std::vector<float> filled(
    Fill fill, int width, int height, uint64_t seed, double noise_sigma, double blur_px);

/// Any fill, type, channel count and stride; sides of 1 to max_side px, 1 in 8 of them 1 to 20.
/// Shrinks to one grey pixel.
[[nodiscard]] rc::Gen<TestImage> genTestImage(int max_side);

/// The part of a camera's image that starts at (left, top), width x height px: the same model with
/// its principal point moved. May reach beyond the camera's image.
[[nodiscard]] Camera croppedCamera(const Camera& camera, int left, int top, int width, int height);

/// A realistic camera with sides of at most max_side px, 100 px if its image is not very long: the
/// whole view of a drawn one.
[[nodiscard]] rc::Gen<Camera> genSmallCamera(std::string_view model, int max_side);

}  // namespace dlsd
