// Finds the 3D lines in the image of a calibrated camera: detect_lines [image.pgm]
// Without an image it looks at a bright rectangle of its own making. Prints one line of text each.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "detector/detector.h"

int main(int argc, char** argv) {
  int width = 320, height = 240;
  std::vector<uint8_t> pixels(320 * 240, 60);
  if (argc > 1) {  // a binary PGM of 8 bits, without comments
    std::ifstream file(argv[1], std::ios::binary);
    std::string magic;
    int white = 0;
    file >> magic >> width >> height >> white;
    file.get();
    if (!file || magic != "P5" || white != 255 || width < 1 || height < 1) return 2;
    pixels.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
    if (!file.read(reinterpret_cast<char*>(pixels.data()), std::ssize(pixels))) return 2;
  } else {
    for (int y = 60; y < 180; ++y)
      std::fill_n(&pixels[static_cast<size_t>(y * 320 + 90)], 140, 200);
  }
  // Your calibration goes here; fisheye lenses and mirrors are "kannala_brandt", "fov" and "omni".
  const std::vector<double> params{0.6 * width, 0.6 * width, width / 2.0, height / 2.0};
  dlsd::Detector detector(dlsd::makeCamera("pinhole", params, width, height));
  const auto& lines = detector.detect({pixels.data(), width, height, 1, width});
  for (const dlsd::DetectedLine& line : lines) {
    const Eigen::Vector3d& n = line.arc.normal;
    std::printf("(%.1f, %.1f) to (%.1f, %.1f) px, plane (%.4f, %.4f, %.4f), score %.1f\n",
                line.from_px.x(),
                line.from_px.y(),
                line.to_px.x(),
                line.to_px.y(),
                n.x(),
                n.y(),
                n.z(),
                line.score);
  }
  return lines.empty() ? 1 : 0;
}
