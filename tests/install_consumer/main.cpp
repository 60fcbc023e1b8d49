// What a SLAM system does with the installed package: a camera, an image in memory, lines out.
#include <cstdint>
#include <cstdio>
#include <vector>

#include "detector/detector.h"
#include "detector/options.h"

int main() {
  const dlsd::Camera camera(dlsd::Pinhole{200, 200, 159.5, 119.5}, 320, 240);
  // A dark image with a bright right half: one vertical line.
  std::vector<uint8_t> pixels(320 * 240, 40);
  for (size_t y = 0; y < 240; ++y) {
    for (size_t x = 160; x < 320; ++x) pixels[y * 320 + x] = 200;
  }
  dlsd::Detector detector(camera, dlsd::DetectorOptions{});
  const auto& lines = detector.detect({pixels.data(), 320, 240, 1, 320});
  std::printf("%zu line(s)\n", lines.size());
  return lines.size() == 1 ? 0 : 1;
}
