#pragma once
// Cameras of all four models for the tests of this folder.

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// FoV (TUM mono wide), Kannala-Brandt (200 degrees across, rim in the image), unified omni with
/// xi > 1, pinhole; each 1280 x 1024 divided by `shrink`.
[[nodiscard]] inline std::vector<std::pair<std::string, Camera>> testCameras(int shrink = 1) {
  const double s = 1.0 / shrink;
  const int w = 1280 / shrink, h = 1024 / shrink;
  const double cx = 0.5 * w - 0.5 - 3.1 * s, cy = 0.5 * h - 0.5 + 1.7 * s;
  const std::array<double, 5> fov{446.915863 * s, 447.071228 * s, cx, cy, 0.933271};
  const std::array<double, 8> kb{330 * s, 331 * s, cx, cy, -0.01, 0.004, -0.002, 0.0001};
  const std::array<double, 5> omni{1.2, 620 * s, 621 * s, cx, cy};
  const std::array<double, 4> pinhole{520 * s, 521 * s, cx, cy};
  return {{"fov", makeCamera("fov", fov, w, h)},
          {"kb", makeCamera("kannala_brandt", kb, w, h, 100 * M_PI / 180)},
          {"omni", makeCamera("omni", omni, w, h)},
          {"pinhole", makeCamera("pinhole", pinhole, w, h)}};
}

}  // namespace dlsd
