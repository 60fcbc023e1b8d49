#include "properties/checks/case.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "cameras/calibration/files.h"
#include "evaluation/detections.h"
#include "properties/checks/labels.h"
#include "properties/checks/scene_parts.h"
#include "synth/scene.h"
#include "synth/variety.h"

namespace dlsd {

using nlohmann::ordered_json;

ordered_json cameraToJson(const Camera& camera) {
  ordered_json params;
  const std::vector<double> values = camera.params();
  for (size_t i = 0; i < values.size(); ++i) {
    params[std::string(camera.paramSpecs()[i].name)] = values[i];
  }
  return {{"model", camera.modelName()},
          {"params", params},
          {"width", camera.width()},
          {"height", camera.height()},
          {"max_field_angle", camera.maxFieldAngleLimit()}};
}

Camera cameraFromJson(const JsonField& json) {
  const std::string model = json["model"].text();
  try {
    std::vector<double> values;
    for (const ParamSpec& spec : paramSpecsOf(model)) {
      values.push_back(json["params"][std::string(spec.name).c_str()].number());
    }
    return makeCamera(model,
                      values,
                      json["width"].integer(1, 65535),
                      json["height"].integer(1, 65535),
                      json["max_field_angle"].number());
  } catch (const std::invalid_argument& error) {
    json.fail(error.what());
  }
}

std::string oneOf(const std::vector<std::string>& names, const JsonField& json) {
  std::string name = json.text();
  if (std::count(names.begin(), names.end(), name) == 0) {
    json.fail(fmt::format("is unknown: allowed is {}", fmt::join(names, ", ")));
  }
  return name;
}

std::vector<int> partsFromJson(const JsonField& json, const Scene& scene) {
  const int last = partCount(scene) - 1;
  std::vector<int> parts;
  for (const JsonField& part : json.array()) {
    const int number = part.integer(0, last);
    if (!parts.empty() && number <= parts.back()) part.fail("is not in ascending order");
    parts.push_back(number);
  }
  return parts;
}

namespace {

GenerateOptions optionsOf(const FrameCase& frame_case) {
  GenerateOptions options;
  options.cameras = {{"camera", frame_case.camera}};
  options.scene = frame_case.scene;
  options.seed = frame_case.seed;
  options.sensor = frame_case.sensor;
  options.variety = frame_case.variety;
  return options;
}

}  // namespace

ordered_json toJson(const FrameCase& frame_case) {
  ordered_json json{
      {"format", "dlsd-case/1"},
      {"property", frame_case.property},
      {"camera", cameraToJson(frame_case.camera)},
      {"scene", frame_case.scene},
      {"seed", frame_case.seed},
      {"index", frame_case.index},
      {"sensor", toJson(frame_case.sensor)},
      {"distractors", {frame_case.variety.distractors.lo, frame_case.variety.distractors.hi}},
      {"detector", frame_case.detector}};
  if (frame_case.parts) json["parts"] = *frame_case.parts;
  return json;
}

FrameCase frameCaseFromJson(const nlohmann::json& json, const std::string& source) {
  const JsonField root(json, source);
  if (root["format"].text() != "dlsd-case/1") root["format"].fail("is not dlsd-case/1");
  const std::string property = root["property"].text();
  if (property != "recovery" && property != "soundness") {
    std::string allowed = "recovery, soundness";
    for (int i = 0; i < kLabelPropertyCount; ++i) {
      allowed += ", " + std::string(nameOf(static_cast<LabelProperty>(i)));
    }
    root["property"].fail("is unknown for a scene: allowed is " + allowed);
  }
  // One by one: where the reading of a later member throws in the braces, g++ 12 destroys what was
  // not made.
  FrameCase frame_case{.property = property, .camera = cameraFromJson(root["camera"])};
  frame_case.scene = oneOf(scenePresets(), root["scene"]);
  frame_case.seed = root["seed"].counter();
  frame_case.index = root["index"].counter();
  frame_case.sensor = sensorFromJson(root["sensor"].raw(), source);
  frame_case.detector = oneOf(builtinDetectors(), root["detector"]);
  if (root.has("distractors")) {  // Cases of the first version have none.
    const std::vector<JsonField> range = root["distractors"].array(2, 2);
    frame_case.variety.distractors = {range[0].number(), range[1].number()};
    try {
      frame_case.variety.check();
    } catch (const std::invalid_argument& error) {
      root["distractors"].fail(std::string("is out of range: ") + error.what());
    }
  }
  if (root.has("parts")) {
    SceneView view = makeSceneView(frame_case.scene, frame_case.seed, frame_case.index);
    addVariety(frame_case.variety, frame_case.seed, frame_case.index, &view);
    frame_case.parts = partsFromJson(root["parts"], view.scene);
  }
  return frame_case;
}

Frame renderCase(const FrameCase& frame_case) {
  return renderFrame(optionsOf(frame_case), frame_case.index, [&](Scene* scene) {
    if (frame_case.parts) *scene = withParts(std::move(*scene), *frame_case.parts);
  });
}

}  // namespace dlsd
