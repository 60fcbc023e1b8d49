#include "properties/checks/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <new>

#include "cameras/calibration/files.h"
#include "evaluation/detections.h"
#include "properties/checks/labels.h"
#include "properties/checks/picture.h"
#include "properties/checks/recovery.h"
#include "properties/checks/soundness.h"

namespace dlsd {
namespace {

std::string pieceOf(const std::vector<Eigen::Vector2d>& points) {
  return fmt::format("({:.1f}, {:.1f}) to ({:.1f}, {:.1f})",
                     points.front().x(),
                     points.front().y(),
                     points.back().x(),
                     points.back().y());
}

void judgeRecovery(const FrameCase& frame_case, const Frame& frame, bool with_shown, Verdict* v) {
  const RecoveryOutcome outcome = checkRecovery(frame_case, frame, recoveryCriteria(frame_case));
  for (const LabelLine& label : frame.labels.lines) {
    if (std::count(outcome.missed_ids.begin(), outcome.missed_ids.end(), label.id) == 0) continue;
    v->details.push_back(fmt::format("missed: label {}, {} of {:.0f} grey levels, {:.0f} px, {}",
                                     label.id,
                                     toString(label.kind),
                                     label.contrast,
                                     label.length_px,
                                     pieceOf(label.points)));
  }
  v->counted = outcome.qualified;
  v->is_judged = v->counted > 0;
  v->summary = fmt::format("{}/{} clear labels found", outcome.found(), outcome.qualified);
  if (!outcome.missed_ids.empty()) v->noted = v->summary;
  if (with_shown) v->shown = {shownOf(frame, outcome)};
}

void judgeSoundness(const FrameCase& frame_case, const Frame& frame, bool with_shown, Verdict* v) {
  const SoundnessOutcome outcome = checkSoundness(frame_case, frame);
  for (const int i : outcome.wrong) {
    const DetectionLine& line = outcome.detections[static_cast<size_t>(i)];
    v->details.push_back(fmt::format("on no label: {}", pieceOf(line.points)));
  }
  v->counted = static_cast<long>(outcome.detections.size());
  v->is_judged = v->counted > 0;
  v->summary = fmt::format("{}/{} detections on no label, the longest of {:.0f} px",
                           outcome.wrong.size(),
                           outcome.detections.size(),
                           outcome.longest_wrong_px);
  if (!(outcome.longest_wrong_px < kLongWrongPx)) v->noted = v->summary;
  if (with_shown) v->shown = {shownOf(frame, outcome)};
}

/// The first cases of painted scenes do not say their version: it was the first. Those of presets
/// must say it.
std::string otherScene(const nlohmann::json& json, const std::string& source) {
  const JsonField root(json, source);
  const std::string is = sceneVersionOf(json);
  const bool says = root.has("versions") && root["versions"].has("scene");
  const std::string was = says                     ? root["versions"]["scene"].text()
                          : json.contains("scene") ? "an unknown version of it"
                                                   : "painted/1";
  if (was == is) return "";
  return fmt::format("the case was saved of {}, the scene is {} now: another picture", was, is);
}

/// In a handler. That this machine can't judge a case says nothing of it.
std::string thrown(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
      dynamic_cast<const SystemError*>(&error) != nullptr) {
    throw;
  }
  return fmt::format("an exception: {}", error.what());
}

/// Whether the case's property is one of labels.h.
bool isOfLabels(const nlohmann::json& json) {
  return json.is_object() && json.contains("property") && json["property"].is_string() &&
         labelPropertyFromName(json["property"].get<std::string>());
}

Verdict judgeFrame(const nlohmann::json& json, const std::string& source, bool with_shown) {
  const FrameCase frame_case = frameCaseFromJson(json, source);
  Verdict verdict;
  verdict.judged = toJson(frame_case);
  const Frame frame = renderCase(frame_case);
  if (with_shown) verdict.shown = {{frame.image, {}, {}, {}}};
  try {
    if (frame_case.property == "recovery") {
      judgeRecovery(frame_case, frame, with_shown, &verdict);
    } else {
      judgeSoundness(frame_case, frame, with_shown, &verdict);
    }
  } catch (const std::exception& error) {
    verdict.failure = thrown(error);
  }
  return verdict;
}

Verdict judgeLabels(const nlohmann::json& json, const std::string& source, bool with_shown) {
  const LabelCase label_case = labelCaseFromJson(json, source);
  Verdict verdict;
  verdict.judged = toJson(label_case);
  LabelsOutcome outcome;
  try {
    outcome = checkLabels(label_case, with_shown);
  } catch (const std::exception& error) {
    verdict.failure = thrown(error);
    return verdict;
  }
  verdict.failure = outcome.failure;
  verdict.details = std::move(outcome.details);
  verdict.counted = outcome.counted;
  verdict.is_judged = outcome.applies && outcome.counted > 0;
  verdict.summary = fmt::format("{}, {} counted", nameOf(label_case.property), outcome.counted);
  verdict.shown = std::move(outcome.shown);
  return verdict;
}

Verdict judgePicture(const nlohmann::json& json, const std::string& source, bool with_shown) {
  const PictureCase picture_case = pictureCaseFromJson(json, source);
  Verdict verdict;
  verdict.judged = toJson(picture_case);
  PictureOutcome outcome;
  try {
    outcome = checkPicture(picture_case, with_shown);
  } catch (const std::exception& error) {
    verdict.failure = thrown(error);
    return verdict;
  }
  verdict.failure = outcome.failure;
  verdict.counted = outcome.counted;
  // That a picture is answered, and that noise is no line, is judged without any line.
  const bool by_places = picture_case.property != PictureProperty::kEmptyBorder;
  verdict.is_judged = outcome.applies && (takesImage(picture_case.property) ||
                                          outcome.counted > (by_places ? outcome.uncompared : 0));
  verdict.summary = fmt::format("{}, {} counted", nameOf(picture_case.property), outcome.counted);
  if (outcome.uncompared > 0)
    verdict.summary += fmt::format(", {} of them not compared", outcome.uncompared);
  verdict.shown = std::move(outcome.shown);
  return verdict;
}

}  // namespace

Verdict judgeCase(const nlohmann::json& json, const std::string& source, bool with_shown) {
  const bool of_scene = json.is_object() && json.contains("scene");
  Verdict verdict = isOfLabels(json) ? judgeLabels(json, source, with_shown)
                    : of_scene       ? judgeFrame(json, source, with_shown)
                                     : judgePicture(json, source, with_shown);
  verdict.other_scene = otherScene(json, source);
  return verdict;
}

}  // namespace dlsd
