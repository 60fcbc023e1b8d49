#include "properties/checks/counterexample.h"

#include <fmt/format.h>

#include <algorithm>

#include "cameras/calibration/files.h"
#include "synth/dataset/dataset.h"

namespace dlsd {
namespace {

std::string svgCurve(const std::vector<Eigen::Vector2d>& points, const char* style) {
  std::string text = "<polyline fill='none' ";
  text += style;
  text += " points='";
  // SVG's origin is the corner of the first pixel, ours its centre.
  for (const Eigen::Vector2d& p : points)
    text += fmt::format("{:.2f},{:.2f} ", p.x() + 0.5, p.y() + 0.5);
  text += "'/>\n";
  return text;
}

std::string overlaySvg(const Frame& frame, const RecoveryOutcome& outcome) {
  const int w = frame.image.width, h = frame.image.height;
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{}' height='{}' viewBox='0 0 {} {}'>\n"
      "<image href='image.png' width='{}' height='{}' style='image-rendering:pixelated'/>\n",
      w,
      h,
      w,
      h,
      w,
      h);
  for (const LabelLine& label : frame.labels.lines) {
    svg += svgCurve(label.points, "stroke='#4af' stroke-width='0.5'");
  }
  for (const DetectionLine& line : outcome.detections) {
    svg += svgCurve(line.points, "stroke='#2d2' stroke-width='1'");
  }
  for (const LabelLine& label : frame.labels.lines) {
    if (std::count(outcome.missed_ids.begin(), outcome.missed_ids.end(), label.id) > 0) {
      svg += svgCurve(label.points, "stroke='#f22' stroke-width='1.5'");
    }
  }
  return svg + "</svg>\n";
}

}  // namespace

std::string saveCounterexample(const std::string& parent,
                               const FrameCase& frame_case,
                               const Frame& frame,
                               const RecoveryOutcome& outcome) {
  const std::string text = toJson(frame_case).dump(1) + "\n";
  const std::string folder = parent + "/counterexample-" + sha256Hex(text).substr(0, 12);
  makeFolders(folder);
  writeFileAtomically(folder + "/case.json", text);
  writeFileAtomically(folder + "/image.png", encodePng(frame.image));
  writeFileAtomically(folder + "/overlay.svg", overlaySvg(frame, outcome));
  return folder;
}

}  // namespace dlsd
