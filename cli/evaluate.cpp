#include "evaluation/evaluate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>

#include "cameras/calibration/files.h"
#include "cli/command.h"
#include "evaluation/dataset_evaluation.h"
#include "evaluation/figures.h"
#include "evaluation/summary.h"
#include "synth/dataset/dataset.h"

namespace dlsd::cli {
namespace {

struct Arguments {
  std::string data, detections, json, min_recall;
  std::vector<std::string> detectors;
  EvaluationOptions options;
  int jobs = 0;
};

/// "0.98@1": headline labels found at rho = 1 px must be at least 0.98 of them.
struct MinRecall {
  double share = 0;
  size_t rho_index = 0;
};

MinRecall readMinRecall(const std::string& text, const std::vector<double>& rho_px) {
  MinRecall result;
  double rho = 0;
  const char* end = text.data() + text.size();
  const auto share = std::from_chars(text.data(), end, result.share);
  if (share.ec == std::errc() && share.ptr != end && *share.ptr == '@') {
    const auto at = std::from_chars(share.ptr + 1, end, rho);
    const auto it = std::find(rho_px.begin(), rho_px.end(), rho);
    if (at.ec == std::errc() && at.ptr == end && it != rho_px.end() && result.share >= 0 &&
        result.share <= 1) {
      result.rho_index = size_t(it - rho_px.begin());
      return result;
    }
  }
  throw InputError(fmt::format(
      "--min-recall is \"{}\", allowed is SHARE@RHO as in 0.98@1, with SHARE from 0 to 1 and "
      "RHO one of {}",
      text,
      fmt::join(rho_px, ", ")));
}

int run(Arguments& arguments) {
  EvaluationOptions& options = arguments.options;
  std::sort(options.rho_px.begin(), options.rho_px.end());
  options.check();
  std::optional<MinRecall> min_recall;
  if (!arguments.min_recall.empty()) {
    min_recall = readMinRecall(arguments.min_recall, options.rho_px);
  }
  if (!arguments.json.empty()) {
    checkPlaceForFile(arguments.json);
  }
  const Dataset dataset(arguments.data);
  if (!arguments.json.empty()) {
    std::vector<std::string> inputs = filesOf(dataset);
    if (!arguments.detections.empty()) {
      inputs.push_back(arguments.detections);
    }
    checkOutputs(inputs, {arguments.json});
  }
  std::vector<std::pair<std::string, DetectionSource>> sources;
  if (!arguments.detections.empty()) {
    const std::string name = std::filesystem::path(arguments.detections).filename().string();
    if (!arguments.json.empty() && !isUtf8(name)) {
      throw InputError(arguments.detections + ": the name is not UTF-8, as --json needs it");
    }
    sources.emplace_back(name, detectionsOfFile(dataset, arguments.detections));
  } else {
    for (const std::string& name : arguments.detectors) {
      sources.emplace_back(name, detectionsOfDetector(dataset, name));
    }
  }

  std::vector<std::string> failed;
  std::string text, verdicts;
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (const auto& [name, source] : sources) {
    Summary summary(options);
    {
      Progress progress("frames (" + name + ")", dataset.size());
      evaluateFrames(dataset, source, options, arguments.jobs, [&](FrameEvaluation&& frame) {
        summary.add(frame, dataset.camera(frame.labels));
        progress.done(size_t(summary.all.frames));
      });
    }
    text += fmt::format("{}== {} ==\n{}", text.empty() ? "" : "\n", name, table(summary));
    text += table(makeFigures(summary), options);
    nlohmann::ordered_json result{{"detections", name}};
    result.update(toJson(summary));
    results.push_back(std::move(result));
    if (min_recall) {
      const Ratio& found =
          summary.all.at_rho[min_recall->rho_index].found[size_t(Stratum::kHeadline)];
      const bool enough =
          found.total > 0 && double(found.counted) >= min_recall->share * double(found.total);
      if (!enough) {
        failed.push_back(name);
      }
      verdicts +=
          fmt::format("{}: {}: headline labels found at rho = {:g} px are {}, asked for {:g}\n",
                      enough ? "passed" : "failed",
                      name,
                      options.rho_px[min_recall->rho_index],
                      dlsd::text(found),
                      min_recall->share);
    }
  }
  if (!verdicts.empty()) {
    text += "\n" + verdicts;
  }
  if (!arguments.json.empty()) {
    const nlohmann::ordered_json json{{"format", "dlsd-evaluation/1"}, {"results", results}};
    writeFileAtomically(arguments.json, json.dump(1) + "\n");
  }
  print(text);
  if (failed.empty()) {
    return kDone;
  }
  complain(fmt::format(
      "--min-recall {} is not reached by {}", arguments.min_recall, fmt::join(failed, ", ")));
  return kCheckFailed;
}

}  // namespace

Run addEvaluate(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  arguments->detectors = {"dlsd"};
  command.add_option("--data", arguments->data, "Dataset folder")->type_name("DIR")->required();
  auto* detections = command
                         .add_option("--detections",
                                     arguments->detections,
                                     "Detections of any program, one JSON object per line")
                         ->type_name("FILE");
  command
      .add_option(
          "--detector", arguments->detectors, "Built-in detectors to run instead: dlsd, dlsd-paper")
      ->type_name("NAME")
      ->capture_default_str()
      ->delimiter(',')
      ->excludes(detections);
  command.add_option("--rho", arguments->options.rho_px, "Tolerances in px")
      ->type_name("PX")
      ->capture_default_str()
      ->delimiter(',');
  command.add_option("--json", arguments->json, "Write the figures to this file, too")
      ->type_name("FILE");
  command
      .add_option("--min-recall",
                  arguments->min_recall,
                  "Exit with 1 if a smaller share of the headline labels is found at this rho")
      ->type_name("SHARE@RHO");
  command.add_option("--jobs", arguments->jobs, "Threads; 0: one per core")
      ->capture_default_str()
      ->transform(wholeNumber(0, 1024));
  command.footer(
      "Examples:\n"
      "  dlsd evaluate --data data\n"
      "  dlsd evaluate --data data --detections det.jsonl --rho 1,2,4 --json figures.json\n"
      "  dlsd evaluate --data data --detector dlsd,dlsd-paper --min-recall 0.98@4");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
