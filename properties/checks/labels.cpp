#include "properties/checks/labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "properties/checks/case.h"
#include "properties/checks/label_view.h"
#include "properties/checks/scene_parts.h"
#include "synth/dataset/json_fields.h"
#include "synth/variety.h"

namespace dlsd {
namespace {

constexpr std::array<std::string_view, kLabelPropertyCount> kNames{"labels-on-borders",
                                                                   "labels-visible",
                                                                   "labels-complete",
                                                                   "labels-other-lens",
                                                                   "labels-turned",
                                                                   "labels-mirrored"};

/// With all its parts.
SceneView wholeViewOf(const LabelCase& c) {
  SceneView view = makeSceneView(c.scene, c.seed, c.index);
  if (c.things_on_top) {
    SceneVariety variety;
    variety.distractors = {3, 8};
    variety.clutter = {0, 5};
    addVariety(variety, c.seed, c.index, &view);
  }
  return view;
}

}  // namespace

std::string_view nameOf(LabelProperty property) {
  return kNames[static_cast<size_t>(property)];
}

std::optional<LabelProperty> labelPropertyFromName(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<LabelProperty>(found - kNames.begin());
}

SceneView viewOf(const LabelCase& c) {
  SceneView view = wholeViewOf(c);
  if (c.parts) view.scene = withParts(std::move(view.scene), *c.parts);
  return view;
}

nlohmann::ordered_json toJson(const LabelCase& c) {
  nlohmann::ordered_json json{{"format", "dlsd-case/1"},
                              {"property", nameOf(c.property)},
                              {"camera", cameraToJson(c.camera)}};
  if (c.other) json["other_camera"] = cameraToJson(*c.other);
  json["scene"] = c.scene;
  json["seed"] = c.seed;
  json["index"] = c.index;
  json["things_on_top"] = c.things_on_top ? 1 : 0;
  if (c.parts) json["parts"] = *c.parts;
  return json;
}

LabelCase labelCaseFromJson(const nlohmann::json& json, const std::string& source) {
  const JsonField root(json, source);
  if (root["format"].text() != "dlsd-case/1") root["format"].fail("is not dlsd-case/1");
  const auto property = labelPropertyFromName(root["property"].text());
  if (!property) {
    root["property"].fail(fmt::format("is unknown: allowed is {}", fmt::join(kNames, ", ")));
  }
  LabelCase c{.property = *property, .camera = cameraFromJson(root["camera"])};
  c.scene = oneOf(scenePresets(), root["scene"]);
  c.seed = root["seed"].counter();
  c.index = root["index"].counter();
  c.things_on_top = root["things_on_top"].integer(0, 1) == 1;
  if (root.has("other_camera")) c.other = cameraFromJson(root["other_camera"]);
  if (c.property == LabelProperty::kOtherLens && !c.other) root.fail("lacks other_camera");
  if (root.has("parts")) c.parts = partsFromJson(root["parts"], wholeViewOf(c).scene);
  return c;
}

LabelsOutcome checkLabels(const LabelCase& c, bool with_shown) {
  switch (c.property) {
    case LabelProperty::kOnBorders:
      return checkOnBorders(c, with_shown);
    case LabelProperty::kVisible:
      return checkVisible(c, with_shown);
    case LabelProperty::kComplete:
      return checkComplete(c, with_shown);
    case LabelProperty::kOtherLens:
      return checkOtherLens(c, with_shown);
    case LabelProperty::kTurned:
      return checkTurned(c, with_shown);
    case LabelProperty::kMirrored:
      return checkMirrored(c, with_shown);
  }
  throw std::logic_error("no such property");
}

}  // namespace dlsd
