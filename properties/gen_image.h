#pragma once
// RapidCheck generators of pictures that no scene made, and of cameras for them.

#include <rapidcheck.h>

#include <string_view>

#include "cameras/camera.h"
#include "properties/checks/test_image.h"

namespace dlsd {

/// Any fill, type, channel count and stride; sides of 1 to max_side px, 1 in 8 of them 1 to 20.
/// Shrinks to one grey pixel.
[[nodiscard]] rc::Gen<TestImageSpec> genTestImage(int max_side);

/// A realistic camera with sides of at most max_side px, 100 px if its image is not very long: the
/// whole view of a drawn one.
[[nodiscard]] rc::Gen<Camera> genSmallCamera(std::string_view model, int max_side);

}  // namespace dlsd
