#pragma once
#include <string>

#include "cameras/camera.h"
#include "synth/dataset/image.h"

namespace dlsd::cli {

/// A picture of a camera: on the left the field angle against the distance from the principal point
/// along the directions to the four corners, with the scale; on the right the image's region that
/// has rays, with contours of the field angle every 10 degrees.
[[nodiscard]] Image drawCamera(const Camera& camera, const std::string& title);

}  // namespace dlsd::cli
