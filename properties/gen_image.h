#pragma once
// RapidCheck generators of pictures that no scene made, and of cameras for them.

#include <rapidcheck.h>

#include <array>
#include <string_view>

#include "cameras/camera.h"
#include "properties/checks/test_image.h"

namespace dlsd {

/// Any fill, type, channel count and stride; sides of 1 to max_side px, 1 in 8 of them 1 to 20.
/// Shrinks to one grey pixel.
[[nodiscard]] rc::Gen<TestImageSpec> genTestImage(int max_side);

/// Kinds of noise.
inline constexpr std::array<Fill, 4> kNoiseFills{
    Fill::kWhiteNoise, Fill::kBlurredNoise, Fill::kShotNoise, Fill::kSaltAndPepper};

/// A grey 8-bit picture of that kind of noise: white and blurred noise with a standard deviation of
/// 0.3 to 60 grey levels (below that, 8 bits leave contours of equal values and not noise), after a
/// blur of up to 1.5 px; shot noise of 1 to 60 electrons; up to 30 % salt and pepper.
[[nodiscard]] rc::Gen<TestImageSpec> genNoise(Fill kind, int width, int height);

/// A realistic camera with sides of at most max_side px, 100 px if its image is not very long: the
/// whole view of a drawn one.
[[nodiscard]] rc::Gen<Camera> genSmallCamera(std::string_view model, int max_side);

}  // namespace dlsd
