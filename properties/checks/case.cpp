#include "properties/checks/case.h"

#include <fmt/format.h>

#include <stdexcept>

#include "cameras/calibration/files.h"
#include "properties/checks/labels.h"

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

ordered_json toJson(const FrameCase& frame_case) {
  return {{"format", "dlsd-case/1"},
          {"property", frame_case.property},
          {"camera", cameraToJson(frame_case.camera)},
          {"scene", frame_case.scene},
          {"seed", frame_case.seed},
          {"index", frame_case.index},
          {"sensor", toJson(frame_case.sensor)},
          {"distractors", {frame_case.variety.distractors.lo, frame_case.variety.distractors.hi}},
          {"detector", frame_case.detector}};
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
  FrameCase frame_case{.property = property,
                       .camera = cameraFromJson(root["camera"]),
                       .scene = root["scene"].text(),
                       .seed = root["seed"].counter(),
                       .index = root["index"].counter(),
                       .sensor = sensorFromJson(root["sensor"].raw(), source),
                       .variety = {},
                       .detector = root["detector"].text()};
  if (root.has("distractors")) {  // Cases of the first version have none.
    const std::vector<JsonField> range = root["distractors"].array(2, 2);
    frame_case.variety.distractors = {range[0].number(), range[1].number()};
  }
  return frame_case;
}

Frame renderCase(const FrameCase& frame_case) {
  GenerateOptions options;
  options.cameras = {{"camera", frame_case.camera}};
  options.scene = frame_case.scene;
  options.seed = frame_case.seed;
  options.sensor = frame_case.sensor;
  options.variety = frame_case.variety;
  return renderFrame(options, frame_case.index);
}

}  // namespace dlsd
