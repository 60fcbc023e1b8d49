#include "evaluation/report.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "cli/command.h"

namespace dlsd::cli {
namespace {

struct Arguments {
  std::string data, detections;
  ReportOptions options;
};

int run(Arguments& arguments) {
  ReportOptions& options = arguments.options;
  std::sort(options.evaluation.rho_px.begin(), options.evaluation.rho_px.end());
  options.evaluation.check();
  const Dataset dataset(arguments.data);
  std::optional<DetectionSource> source;
  if (!arguments.detections.empty()) {
    source = detectionsOfFile(dataset, arguments.detections);
    options.detections_title = std::filesystem::path(arguments.detections).filename().string();
  }
  checkPlaceForFolder(options.out);
  const Report report = writeReport(dataset, source, options);
  std::string text = table(report.statistics);
  if (report.summary) {
    text += "\n" + table(*report.summary);
  }
  print(text + "\n" + report.index_path + "\n");
  return kDone;
}

}  // namespace

Run addReport(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  command.add_option("--data", arguments->data, "Dataset folder")->type_name("DIR")->required();
  command.add_option("--out", arguments->options.out, "Folder for the page")
      ->type_name("DIR")
      ->required();
  command
      .add_option("--detections",
                  arguments->detections,
                  "Detections to show and evaluate, one JSON object per line")
      ->type_name("FILE");
  command.add_option("--rho", arguments->options.evaluation.rho_px, "Tolerances in px")
      ->type_name("PX")
      ->capture_default_str()
      ->delimiter(',');
  command.add_option("--jobs", arguments->options.jobs, "Threads; 0: one per core")
      ->capture_default_str()
      ->transform(wholeNumber(0, 1024));
  command.footer(
      "Examples:\n"
      "  dlsd report --data data --out data/gallery\n"
      "  dlsd report --data data --detections det.jsonl --out gallery\n"
      "Open index.html of the folder with a double click; it needs no server.");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
