#include "properties/gen_labels.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <ostream>
#include <tuple>

#include "properties/checks/scene_parts.h"
#include "properties/checks/test_image.h"
#include "properties/gen.h"
#include "synth/variety.h"

namespace dlsd {
namespace {

rc::Gen<Camera> genVariedCamera(VarietyRange width_px) {
  CameraVariety variety;
  variety.width_px = width_px;
  return rc::gen::map(rc::gen::tuple(rc::gen::elementOf(randomCameraModels()), genInt(0, 100000)),
                      [variety](const auto& t) {
                        return drawCamera(
                            std::get<0>(t), variety, 1, static_cast<uint64_t>(std::get<1>(t)));
                      });
}

/// A pinhole of round numbers that looks a right angle wide.
Camera roundPinhole(int width, int height) {
  const double focal_px = std::ceil(width / 2.0);
  return Camera(Pinhole{focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0}, width, height);
}

std::vector<Camera> simplerCameras(const Camera& camera) {
  constexpr int kLeastSide = 32;
  const int width = camera.width(), height = camera.height();
  std::vector<Camera> cameras;
  const Camera round = roundPinhole(width, height);
  if (!(camera == round)) cameras.push_back(round);
  for (const int left : {0, width - width / 2}) {
    if (width < 2 * kLeastSide) break;
    cameras.push_back(croppedCamera(camera, left, 0, width / 2, height));
  }
  for (const int top : {0, height - height / 2}) {
    if (height < 2 * kLeastSide) break;
    cameras.push_back(croppedCamera(camera, 0, top, width, height / 2));
  }
  return cameras;
}

}  // namespace

LabelCase drawLabelCase(LabelProperty property) {
  // Simpler scenes and cameras are not those of smaller numbers: what is drawn does not shrink.
  const auto [scene, seed, index, things_on_top] =
      *rc::gen::noShrink(rc::gen::tuple(rc::gen::elementOf(scenePresets()),
                                        genInt(0, 1000),
                                        genInt(0, 1000),
                                        rc::gen::arbitrary<bool>()));
  // Complete labels are looked for in every pixel.
  const VarietyRange width_px =
      property == LabelProperty::kComplete ? VarietyRange{160, 240} : VarietyRange{320, 560};
  LabelCase drawn{.property = property,
                  .camera = *rc::gen::noShrink(genVariedCamera(width_px)),
                  .scene = scene,
                  .seed = static_cast<uint64_t>(seed),
                  .index = static_cast<uint64_t>(index),
                  .things_on_top = things_on_top};
  if (property == LabelProperty::kOtherLens) {
    drawn.other = *rc::gen::noShrink(genVariedCamera(width_px));
  }
  return *rc::gen::shrink(rc::gen::just(drawn), [](const LabelCase& failing) {
    return rc::seq::fromContainer(simplerCases(failing));
  });
}

std::vector<LabelCase> simplerCases(const LabelCase& label_case) {
  std::vector<LabelCase> simpler;
  std::vector<int> parts;
  if (label_case.parts) {
    parts = *label_case.parts;
  } else {
    parts.resize(static_cast<size_t>(partCount(viewOf(label_case).scene)));
    std::iota(parts.begin(), parts.end(), 0);
  }
  for (size_t size = parts.size() / 2; size > 0; size /= 2) {
    for (size_t begin = 0; begin < parts.size(); begin += size) {
      const size_t end = std::min(begin + size, parts.size());
      std::vector<int> kept(parts.begin(), parts.begin() + static_cast<ptrdiff_t>(begin));
      kept.insert(kept.end(), parts.begin() + static_cast<ptrdiff_t>(end), parts.end());
      simpler.push_back(label_case);
      simpler.back().parts = kept;
    }
  }
  for (const Camera& camera : simplerCameras(label_case.camera)) {
    simpler.push_back(label_case);
    simpler.back().camera = camera;
  }
  if (label_case.other) {
    for (const Camera& camera : simplerCameras(*label_case.other)) {
      simpler.push_back(label_case);
      simpler.back().other = camera;
    }
  }
  return simpler;
}

void showValue(const LabelCase& label_case, std::ostream& out) {
  out << toJson(label_case).dump();
}

}  // namespace dlsd
