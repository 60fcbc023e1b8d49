#include "evaluation/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

using nlohmann::ordered_json;

constexpr std::array kStrata{
    Stratum::kHeadline, Stratum::kCrowded, Stratum::kShort, Stratum::kFaint};

GroupSummary emptyGroup(std::string name, const EvaluationOptions& options) {
  GroupSummary group;
  group.name = std::move(name);
  group.at_rho.resize(options.rho_px.size());
  return group;
}

ordered_json toJson(const Ratio& ratio) {
  return {{"counted", ratio.counted}, {"total", ratio.total}};
}

ordered_json toJson(const DistanceStats& stats) {
  ordered_json j{{"samples", stats.count}};
  if (stats.count > 0) {  // without samples there is no error, and 0 would look perfect
    j["mean_px"] = stats.mean();
    j["rms_px"] = stats.rms();
    j["p95_px"] = stats.quantile(0.95);
  }
  return j;
}

ordered_json toJson(const GroupSummary& group, const EvaluationOptions& options) {
  ordered_json at_rho = ordered_json::array();
  for (size_t r = 0; r < options.rho_px.size(); ++r) {
    const GroupSummary::AtRho& sums = group.at_rho[r];
    ordered_json found, fragments;
    for (const Stratum s : kStrata) {
      found[std::string(toString(s))] = toJson(sums.found[size_t(s)]);
      fragments[std::string(toString(s))] = toJson(sums.fragments[size_t(s)]);
    }
    at_rho.push_back({{"rho_px", options.rho_px[r]},
                      {"found", found},
                      {"right", toJson(sums.right)},
                      {"right_long", toJson(sums.right_long)},
                      {"merged", toJson(sums.merged)},
                      {"merged_long", toJson(sums.merged_long)},
                      {"fragments_per_found_run", fragments}});
  }
  ordered_json localisation{{"rho_px", options.rho_px.back()}};
  for (const Stratum s : kStrata) {
    localisation[std::string(toString(s))] = toJson(group.localisation[size_t(s)]);
  }
  return {{"name", group.name},
          {"frames", group.frames},
          {"labels", group.labels},
          {"detections", group.detections},
          {"at_rho", std::move(at_rho)},
          {"localisation", std::move(localisation)}};
}

}  // namespace

void GroupSummary::add(const FrameOutcome& outcome, const EvaluationOptions& options) {
  ++frames;
  labels += long(outcome.strata.size());
  detections += long(outcome.detection_angle_rad.size());
  for (size_t r = 0; r < at_rho.size(); ++r) {
    AtRho& sums = at_rho[r];
    for (size_t i = 0; i < outcome.strata.size(); ++i) {
      const LabelOutcome& label = outcome.labels[r][i];
      const auto s = size_t(outcome.strata[i]);
      sums.found[s] += {label.found ? 1 : 0, 1};
    }
    for (size_t i = 0; i < outcome.run_strata.size(); ++i) {
      if (const RunOutcome& run = outcome.runs[r][i]; run.found) {
        sums.fragments[size_t(outcome.run_strata[i])] +=
            {DLSD_MUTANT("fragments") ? std::min(run.fragments, 2) : run.fragments, 1};
      }
    }
    for (size_t i = 0; i < outcome.detection_angle_rad.size(); ++i) {
      const DetectionOutcome& detection = outcome.detections[r][i];
      const Ratio right_one{detection.right ? 1 : 0, 1};
      const Ratio merged_one{detection.merged ? 1 : 0, 1};
      sums.right += right_one;
      sums.merged += merged_one;
      if (outcome.detection_angle_rad[i] >= options.headline_angle_rad) {
        sums.right_long += right_one;
        sums.merged_long += merged_one;
      }
    }
  }
  for (size_t s = 0; s < kStratumCount; ++s) {
    localisation[s] += outcome.localisation[s];
  }
}

Summary::Summary(EvaluationOptions evaluation_options)
    : options(std::move(evaluation_options)), all(emptyGroup("all", options)) {
  options.check();
}

void Summary::add(const FrameEvaluation& frame, const Camera& camera) {
  const FrameOutcome& outcome = frame.outcome;
  const std::string camera_name = cameraName(frame.labels);
  auto it = std::lower_bound(
      cameras.begin(), cameras.end(), camera_name, [](const GroupSummary& g, const std::string& n) {
        return g.name < n;
      });
  if (it == cameras.end() || it->name != camera_name) {
    it = cameras.insert(it, emptyGroup(camera_name, options));
  }
  it->add(outcome, options);
  all.add(outcome, options);

  const size_t image = images.size();
  ImageRow& row = images.emplace_back();
  row.image = frame.labels.image;
  row.camera = camera_name;
  row.model = camera.modelName();
  if (const auto noise = frame.labels.sensor.find("read_noise_levels");
      frame.labels.sensor.is_object() && noise != frame.labels.sensor.end() && noise->is_number()) {
    row.noise_levels = noise->get<double>();
  }
  row.time_ms = frame.detections.time_ms;
  row.rectification_ms = frame.detections.rectification_ms;

  for (size_t i = 0; i < frame.labels.lines.size(); ++i) {
    const LabelLine& line = frame.labels.lines[i];
    LabelRow& label = labels.emplace_back();
    label.image = image;
    label.kind = line.kind;
    label.conditions = outcome.conditions[i];
    label.contrast = line.contrast;
    label.length_px = line.length_px;
    label.angle_rad = line.angle_rad;
    const Eigen::Vector3d middle =
        line.points_in_cam[0].normalized() + line.points_in_cam[1].normalized();
    label.field_angle_rad = std::atan2(middle.head<2>().norm(), middle.z());
    for (size_t r = 0; r < options.rho_px.size(); ++r) {
      const LabelOutcome& at_rho = outcome.labels[r][i];
      label.found |= at_rho.found ? 1U << r : 0;
      label.found_score[r] = at_rho.found_score;
    }
    label.errors = outcome.errors[i];
  }
  for (size_t i = 0; i < frame.detections.lines.size(); ++i) {
    DetectionRow& detection = detections.emplace_back();
    detection.image = image;
    detection.score = outcome.detection_score[i];
    detection.length_px = outcome.detection_length_px[i];
    detection.angle_rad = outcome.detection_angle_rad[i];
    detection.field_angle_rad = outcome.detection_field_angle_rad[i];
    for (size_t r = 0; r < options.rho_px.size(); ++r) {
      detection.right |= outcome.detections[r][i].right ? 1U << r : 0;
      detection.merged |= outcome.detections[r][i].merged ? 1U << r : 0;
    }
  }
  for (size_t k = 0; k < kStructuralKinds; ++k) {
    structure[k].push_back(frame.structure[k]);
  }
}

std::string text(const Ratio& ratio) {
  if (ratio.total == 0) {
    return "0/0";
  }
  return fmt::format("{}/{} {:5.1f} %",
                     ratio.counted,
                     ratio.total,
                     100 * double(ratio.counted) / double(ratio.total));
}

bool reaches(const Ratio& ratio, double share) {
  // The quotient is rounded as the number that was typed is; share * total would be another number.
  return ratio.total > 0 && double(ratio.counted) / double(ratio.total) >= share;
}

std::string table(const Summary& summary) {
  const EvaluationOptions& options = summary.options;
  std::vector<const GroupSummary*> groups;
  size_t name_width = 6;
  for (const GroupSummary& group : summary.cameras) {
    groups.push_back(&group);
    name_width = std::max(name_width, group.name.size());
  }
  groups.push_back(&summary.all);

  std::string out;
  const auto line = [&](const std::string& name, const auto&... cells) {
    std::string row = fmt::format("{:<{}}", name, name_width);
    ((row += fmt::format("  {:>18}", cells)), ...);
    out += row + "\n";
  };
  const auto row = [&](const GroupSummary& group, size_t r, const auto&... cells) {
    line(r == 0 ? group.name : "", fmt::format("{:g}", options.rho_px[r]), cells...);
  };

  out += fmt::format(
      "Labels found / labels (headline: contrast >= {:g} grey levels, length >= {:g} deg and {:g} "
      "px,"
      " no other label within {:g} px)\n",
      options.headline_contrast,
      options.headline_angle_rad * 180 / M_PI,
      options.headline_length_px,
      options.crowded_px);
  line("camera", "rho_px", "headline", "crowded", "short", "faint");
  for (const GroupSummary* group : groups) {
    for (size_t r = 0; r < options.rho_px.size(); ++r) {
      const auto& found = group->at_rho[r].found;
      row(*group, r, text(found[0]), text(found[1]), text(found[2]), text(found[3]));
    }
  }

  const std::string at_least = fmt::format(">= {:g} deg", options.headline_angle_rad * 180 / M_PI);
  out += "\nDetections right, merged / detections; fragments per found headline run\n";
  line("camera",
       "rho_px",
       "right " + at_least,
       "right all",
       "merged " + at_least,
       "merged all",
       "fragments / found");
  for (const GroupSummary* group : groups) {
    for (size_t r = 0; r < options.rho_px.size(); ++r) {
      const GroupSummary::AtRho& sums = group->at_rho[r];
      const Ratio& fragments = sums.fragments[size_t(Stratum::kHeadline)];
      std::string per_label = fmt::format("{}/{}", fragments.counted, fragments.total);
      if (fragments.total > 0) {
        per_label += fmt::format(" {:6.3f}", double(fragments.counted) / double(fragments.total));
      }
      row(*group,
          r,
          text(sums.right_long),
          text(sums.right),
          text(sums.merged_long),
          text(sums.merged),
          per_label);
    }
  }

  out += fmt::format("\nDistance of found headline labels to their detection at rho = {:g} px\n",
                     options.rho_px.back());
  line("camera", "mean_px", "rms_px", "p95_px", "samples", "frames", "labels", "detections");
  for (const GroupSummary* group : groups) {
    const DistanceStats& stats = group->localisation[size_t(Stratum::kHeadline)];
    const auto px = [&](double value) {
      return stats.count > 0 ? fmt::format("{:.3f}", value) : std::string("-");
    };
    line(group->name,
         px(stats.mean()),
         px(stats.rms()),
         px(stats.quantile(0.95)),
         stats.count,
         group->frames,
         group->labels,
         group->detections);
  }
  return out;
}

ordered_json toJson(const Summary& summary) {
  ordered_json cameras = ordered_json::array();
  for (const GroupSummary& group : summary.cameras) {
    cameras.push_back(toJson(group, summary.options));
  }
  return {{"options",
           {{"rho_px", summary.options.rho_px},
            {"headline_contrast", summary.options.headline_contrast},
            {"headline_angle_rad", summary.options.headline_angle_rad},
            {"headline_length_px", summary.options.headline_length_px},
            {"crowded_px", summary.options.crowded_px}}},
          {"cameras", std::move(cameras)},
          {"all", toJson(summary.all, summary.options)}};
}

}  // namespace dlsd
