#include "properties/checks/counterexample.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <string_view>

#include "cameras/calibration/files.h"
#include "detector/test_scene.h"
#include "properties/checks/scene_parts.h"
#include "synth/dataset/dataset.h"
#include "synth/scene.h"
#include "synth/variety.h"

namespace dlsd {
namespace {

std::string svgCurves(const ShownPicture::Curves& curves, std::string_view style) {
  std::string text;
  for (const std::vector<Eigen::Vector2d>& points : curves) {
    text += fmt::format("<polyline fill='none' {} points='", style);
    // SVG's origin is the corner of the first pixel, ours its centre.
    for (const Eigen::Vector2d& p : points) {
      text += fmt::format("{:.2f},{:.2f} ", p.x() + 0.5, p.y() + 0.5);
    }
    text += "'/>\n";
  }
  return text;
}

std::string imageName(size_t i) {
  return i == 0 ? "image.png" : fmt::format("image-{}.png", i + 1);
}

std::string overlaySvg(const std::vector<ShownPicture>& shown) {
  constexpr int kGapPx = 8;
  int width = 0, height = 0;
  std::string body;
  for (size_t i = 0; i < shown.size(); ++i) {
    const ShownPicture& picture = shown[i];
    body += fmt::format(
        "<g transform='translate({} 0)'>\n<image href='{}' width='{}' height='{}' "
        "style='image-rendering:pixelated'/>\n",
        width,
        imageName(i),
        picture.image.width,
        picture.image.height);
    body += svgCurves(picture.labels, "stroke='#4af' stroke-width='0.5'");
    body += svgCurves(picture.lines, "stroke='#2d2' stroke-width='1'");
    body += svgCurves(picture.failed, "stroke='#f22' stroke-width='1.5'") + "</g>\n";
    width += picture.image.width + kGapPx;
    height = std::max(height, picture.image.height);
  }
  return fmt::format(
             "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' viewBox='0 0 {0} "
             "{1}'>\n",
             width,
             height) +
         body + "</svg>\n";
}

}  // namespace

std::string sceneVersionOf(const nlohmann::json& json) {
  if (!json.contains("scene")) return test::kSceneVersion;
  std::string version = presetVersion(json["scene"].get<std::string>());
  const bool has_distractors = json.contains("distractors") && json["distractors"][1] != 0;
  if (json.value("things_on_top", 0) != 0 || has_distractors) {
    version += std::string(", ") + kVarietyVersion;
  }
  if (json.contains("parts")) version += std::string(", ") + kPartsVersion;
  return version;
}

std::string saveCounterexample(const std::string& parent,
                               const nlohmann::ordered_json& failing_case,
                               const std::string& failure,
                               const std::vector<ShownPicture>& shown) {
  const std::string hash = sha256Hex(failing_case.dump()).substr(0, 12);
  const std::string folder = parent + "/counterexample-" + hash;
  nlohmann::ordered_json text = failing_case;
  text["failure"] = failure;
  text["replay"] = "dlsd replay case.json";
  text["versions"] = {
      {"dlsd", DLSD_VERSION}, {"compiler", __VERSION__}, {"scene", sceneVersionOf(failing_case)}};
  makeFolders(folder);
  writeFileAtomically(folder + "/case.json", text.dump(1) + "\n");
  for (size_t i = 0; i < shown.size(); ++i) {
    writeFileAtomically(folder + "/" + imageName(i), encodePng(shown[i].image));
  }
  writeFileAtomically(folder + "/overlay.svg", overlaySvg(shown));
  return folder;
}

UnfinishedCase::UnfinishedCase(const std::string& parent, const nlohmann::ordered_json& judged)
    : path_(fmt::format("{}/unfinished-{}.json", parent, ::getpid())) {
  makeFolders(parent);
  nlohmann::ordered_json text = judged;
  text["versions"] = {{"dlsd", DLSD_VERSION}, {"scene", sceneVersionOf(judged)}};
  writeFileAtomically(path_, text.dump(1) + "\n");
}

UnfinishedCase::~UnfinishedCase() {
  ::unlink(path_.c_str());
}

}  // namespace dlsd
