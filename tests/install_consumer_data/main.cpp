// Everything beyond the detector from the installed package: render a frame, detect, evaluate.
#include <cstdio>

#include "evaluation/detections.h"
#include "evaluation/evaluate.h"
#include "synth/generate.h"

int main() {
  const dlsd::Camera camera(dlsd::Pinhole{160, 160, 159.5, 119.5}, 320, 240);
  dlsd::GenerateOptions options;
  options.cameras = {{"pinhole", camera}};
  const dlsd::Frame frame = dlsd::renderFrame(options, 0);
  dlsd::Detector detector(camera);
  const auto detections = dlsd::detectLines(detector, frame.image);
  const auto outcome = dlsd::evaluateFrame(camera, frame.labels.lines, detections, {});
  std::printf("%zu labels, %zu detections\n", outcome.strata.size(), detections.size());
  return outcome.strata.empty() || detections.empty() ? 1 : 0;
}
