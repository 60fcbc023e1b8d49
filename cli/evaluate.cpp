#include "evaluation/evaluate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <charconv>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <system_error>

#include "cameras/calibration/files.h"
#include "cli/command.h"
#include "evaluation/dataset_evaluation.h"
#include "evaluation/detections.h"
#include "evaluation/evaluation_page.h"
#include "evaluation/external_command.h"
#include "evaluation/figures.h"
#include "evaluation/paper_experiment.h"
#include "evaluation/summary.h"
#include "synth/dataset/dataset.h"
#include "synth/generate.h"
#ifdef DLSD_PEERS
#include "evaluation/peers/peers.h"
#endif

namespace dlsd::cli {
namespace {

struct Arguments {
  std::vector<std::string> data, detections, detectors;
  CommandOptions command;
  std::string json, report, curve = "polyline", experiment, out;
  std::vector<std::string> min_recall, min_right;
  std::optional<double> max_rms_px;
  EvaluationOptions options;
  bool timed = false;
  int jobs = 0;
  int frames = 800;
};

/// Something that every detector must reach.
struct Gate {
  std::string option;  ///< As typed.
  std::string what;    ///< "headline labels found at rho = 1 px".
  std::function<std::pair<bool, std::string>(const Figures&)> reached;  ///< And the figure's text.
};

/// "0.98@1" of --min-recall and the like: a share of at least 0.98 at rho = 1 px.
Gate shareGate(const std::string& option,
               const std::string& text,
               const std::vector<double>& rho_px,
               const std::string& table,
               const std::string& stratum,
               const std::string& what) {
  double share = 0, rho = 0;
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, share);
  if (read.ec == std::errc() && read.ptr != end && *read.ptr == '@') {
    const auto at = std::from_chars(read.ptr + 1, end, rho);
    if (at.ec == std::errc() && at.ptr == end && share >= 0 && share <= 1 &&
        std::find(rho_px.begin(), rho_px.end(), rho) != rho_px.end()) {
      return {option + " " + text,
              fmt::format("{} at rho = {:g} px", what, rho),
              [=](const Figures& figures) {
                const Ratio ratio = figures.find(table, stratum, rho)->ratio.value();
                return std::pair(reaches(ratio, share), dlsd::text(ratio));
              }};
    }
  }
  throw InputError(fmt::format(
      "{} is \"{}\", allowed is SHARE@RHO as in 0.98@1, with SHARE from 0 to 1 and RHO one of {}",
      option,
      text,
      fmt::join(rho_px, ", ")));
}

std::vector<Gate> gatesOf(const Arguments& arguments) {
  const EvaluationOptions& options = arguments.options;
  std::vector<Gate> gates;
  for (const std::string& text : arguments.min_recall) {
    gates.push_back(shareGate(
        "--min-recall", text, options.rho_px, "found", "headline", "headline labels found"));
  }
  const std::string at_least = fmt::format(">= {:g} deg", options.headline_angle_rad * 180 / M_PI);
  for (const std::string& text : arguments.min_right) {
    gates.push_back(shareGate("--min-right",
                              text,
                              options.rho_px,
                              "right",
                              at_least,
                              "detections " + at_least + " right"));
  }
  if (arguments.max_rms_px) {
    const double most = *arguments.max_rms_px;
    if (!(most >= 0 && most <= 100)) {
      throw InputError(fmt::format("--max-rms-px is {}, allowed is [0, 100]", most));
    }
    gates.push_back({fmt::format("--max-rms-px {:g}", most),
                     "rms distance of found headline labels",
                     [most](const Figures& figures) {
                       const Figure& rms = *figures.find("localisation", "rms px");
                       return std::pair(rms.value && *rms.value <= most,
                                        rms.value ? fmt::format("{:.4f} px", *rms.value)
                                                  : std::string("unknown: none is found"));
                     }});
  }
  return gates;
}

bool isPeer(const std::string& name) {
  return name == "lsd" || name == "edlines" || name == "fld";
}

/// Throws InputError if there is no such detector.
void checkDetector(const std::string& name) {
  const auto& own = builtinDetectors();
  if (!isPeer(name) && std::find(own.begin(), own.end(), name) == own.end()) {
    throw InputError(fmt::format(
        "detector \"{}\" is unknown, there are {}, lsd, edlines, fld", name, fmt::join(own, ", ")));
  }
#ifndef DLSD_PEERS
  if (isPeer(name)) {
    throw InputError(fmt::format(
        "detector \"{}\" is not in this program: it was built without OpenCV's ximgproc "
        "(DLSD_PEERS)",
        name));
  }
#endif
}

/// Throws InputError if one of the detectors is unknown or named twice.
void checkDetectors(const std::vector<std::string>& names) {
  for (auto it = names.begin(); it != names.end(); ++it) {
    checkDetector(*it);
    if (std::find(names.begin(), it, *it) != it) {
      throw InputError(fmt::format("--detector names {} twice", *it));
    }
  }
}

DetectionSource sourceOf(const Dataset& dataset, const std::string& name, bool timed) {
#ifdef DLSD_PEERS
  if (isPeer(name)) {
    return detectionsOfPeer(dataset, name, timed);
  }
#endif
  return detectionsOfDetector(dataset, name, timed);
}

/// The program's, without its folder.
std::string nameOf(const CommandOptions& command) {
  return std::filesystem::path(splitCommand(command.command)[0]).filename().string();
}

/// Detections of a name, one source for each dataset.
struct NamedSource {
  std::string name;
  bool built_in = false;  ///< Gives polylines, whatever --curve says.
  std::vector<DetectionSource> of_data;
};

constexpr std::string_view kNothingWritten = "nothing is written";

/// The user's program, which ends when the user interrupts us.
CommandOptions interruptible(const Arguments& arguments, const Interruption& interruption) {
  CommandOptions command = arguments.command;
  command.while_running = [&interruption] { interruption.check(kNothingWritten); };
  return command;
}

std::vector<NamedSource> sourcesOf(const Arguments& arguments,
                                   const std::deque<Dataset>& datasets,
                                   const Interruption& interruption) {
  std::vector<NamedSource> sources;
  if (!arguments.detections.empty()) {
    if (arguments.detections.size() != datasets.size()) {
      throw InputError(fmt::format(
          "--detections is given {} times and --data {} times, it is needed once for each",
          arguments.detections.size(),
          datasets.size()));
    }
    NamedSource& source = sources.emplace_back();
    source.name = std::filesystem::path(arguments.detections.front()).filename().string();
    for (size_t i = 0; i < datasets.size(); ++i) {
      source.of_data.push_back(detectionsOfFile(datasets[i], arguments.detections[i]));
    }
  }
  if (!arguments.command.command.empty()) {
    NamedSource& source = sources.emplace_back();
    source.name = nameOf(arguments.command);
    for (const Dataset& dataset : datasets) {
      source.of_data.push_back(
          detectionsOfCommand(dataset, interruptible(arguments, interruption), arguments.timed));
    }
  }
  for (const std::string& name : arguments.detectors) {
    NamedSource& source = sources.emplace_back();
    source.name = name;
    source.built_in = true;
    for (const Dataset& dataset : datasets) {
      source.of_data.push_back(sourceOf(dataset, name, arguments.timed));
    }
  }
  for (auto it = sources.begin(); it != sources.end(); ++it) {
    // Someone's file or program may be called dlsd, too.
    const std::string name = it->name;
    const auto isTaken = [&](const NamedSource& other) { return other.name == it->name; };
    for (int number = 2; std::any_of(sources.begin(), it, isTaken); ++number) {
      it->name = fmt::format("{} ({})", name, number);
    }
  }
  for (const NamedSource& source : sources) {
    if ((!arguments.json.empty() || !arguments.report.empty()) && !isUtf8(source.name)) {
      throw InputError(source.name + ": the name is not UTF-8, as --json and --report need it");
    }
  }
  return sources;
}

/// Where a report puts its files.
std::vector<std::string> reportFiles(const std::string& folder) {
  return {folder + "/index.html", folder + "/figures.csv", folder + "/evaluation.json"};
}

/// The paper's sequence in `out`/data, if the user has none.
std::string paperData(const Arguments& arguments) {
  if (arguments.data.size() > 1) {
    throw InputError("--experiment takes one --data");
  }
  if (!arguments.data.empty()) {
    return arguments.data.front();
  }
  GenerateOptions options;
  options.cameras = {{"tum_mono_wide", paperCamera()}};
  options.scene = "paper";
  options.count = arguments.frames;
  options.out = arguments.out + "/data";
  options.sensor.read_noise_levels = 2;
  options.jobs = arguments.jobs;
  Progress progress("frames made", size_t(options.count));
  const Interruption interruption;
  generateDataset(options, [&](const GenerateProgress& p) {
    progress.done(size_t(p.done));
    if (p.done < p.total) {
      interruption.check(fmt::format(
          "{} of {} frames are made, the same command goes on from there", p.done, p.total));
    }
  });
  return options.out;
}

int runExperiment(const Arguments& arguments) {
  if (arguments.out.empty()) {
    throw InputError("--experiment needs --out DIR");
  }
  checkPlaceForFolder(arguments.out);
  const std::vector<std::string> outputs{arguments.out + "/index.html",
                                         arguments.out + "/experiment.csv",
                                         arguments.out + "/experiment.json"};
  std::vector<std::string> names = arguments.detectors;
  if (names.empty()) {
    names = builtinDetectors();
#ifdef DLSD_PEERS
    names.insert(names.end(), peerDetectors().begin(), peerDetectors().end());
#endif
  }
  checkDetectors(names);
  const Dataset dataset(paperData(arguments));
  const Interruption interruption;
  checkOutputs(filesOf(dataset), outputs);
  if (dataset.manifest().at("cameras").size() != 1) {
    throw InputError(fmt::format("{}: has {} cameras, the experiment is about one",
                                 dataset.folder(),
                                 dataset.manifest().at("cameras").size()));
  }
  std::vector<ExperimentDetector> detectors;
  std::optional<VirtualView> view;
  for (const std::string& name : names) {
    detectors.push_back({name, sourceOf(dataset, name, true), !isPeer(name)});
#ifdef DLSD_PEERS
    if (isPeer(name) && dataset.size() > 0) {
      view = PeerDetector(dataset.camera(dataset.labels(0)), name).view();
    }
#endif
  }
  if (!arguments.command.command.empty()) {
    detectors.push_back({nameOf(arguments.command),
                         detectionsOfCommand(dataset, interruptible(arguments, interruption), true),
                         true});
  }
  Experiment experiment;
  {
    Progress progress("frames", dataset.size());
    experiment = runPaperExperiment(dataset, detectors, view, [&](size_t done) {
      progress.done(done);
      interruption.check(kNothingWritten);
    });
  }
  writeExperiment(experiment, "The experiment of the D-LSD paper", arguments.out);
  print(table(experiment) + "\n" + outputs[0] + "\n");
  return kDone;
}

int run(Arguments& arguments) {
  if (!arguments.experiment.empty()) {
    return runExperiment(arguments);
  }
  if (arguments.data.empty()) {
    throw InputError("--data is needed");
  }
  if (arguments.detectors.empty() && arguments.detections.empty() &&
      arguments.command.command.empty()) {
    arguments.detectors = {"dlsd"};
  }
  EvaluationOptions& options = arguments.options;
  std::sort(options.rho_px.begin(), options.rho_px.end());
  options.bezier = arguments.curve == "bezier";
  options.check();
  checkDetectors(arguments.detectors);
  const std::vector<Gate> gates = gatesOf(arguments);
  std::vector<std::string> outputs;
  if (!arguments.json.empty()) {
    checkPlaceForFile(arguments.json);
    outputs.push_back(arguments.json);
  }
  if (!arguments.report.empty()) {
    checkPlaceForFolder(arguments.report);
    for (const std::string& file : reportFiles(arguments.report)) {
      outputs.push_back(file);
    }
  }
  std::deque<Dataset> datasets;
  std::vector<std::string> inputs = arguments.detections;
  for (const std::string& folder : arguments.data) {
    const Dataset& dataset = datasets.emplace_back(folder);
    for (const Dataset& other : datasets) {
      std::error_code ignored;
      if (&other != &dataset &&
          std::filesystem::equivalent(other.folder(), dataset.folder(), ignored)) {
        throw InputError(
            fmt::format("--data {}: is given twice, its images would count twice", folder));
      }
    }
    for (std::string& file : filesOf(dataset)) {
      inputs.push_back(std::move(file));
    }
  }
  checkOutputs(inputs, outputs);
  const Interruption interruption;
  const std::vector<NamedSource> sources = sourcesOf(arguments, datasets, interruption);
  // Two detectors at a time would make each other slow.
  const int jobs = arguments.timed && arguments.jobs == 0 ? 1 : arguments.jobs;

  std::vector<EvaluatedDetections> all;
  std::string text, verdicts;
  std::vector<std::string> failures;
  size_t frames = 0;
  for (const Dataset& dataset : datasets) {
    frames += dataset.size();
  }
  for (const NamedSource& source : sources) {
    EvaluationOptions its_options = options;
    its_options.bezier = options.bezier && !source.built_in;
    EvaluatedDetections& one = all.emplace_back(
        EvaluatedDetections{source.name, Summary(its_options), {}, WorstCases(its_options)});
    {
      Progress progress("frames (" + source.name + ")", frames);
      for (size_t d = 0; d < datasets.size(); ++d) {
        evaluateFrames(
            datasets[d], source.of_data[d], its_options, jobs, [&](FrameEvaluation&& frame) {
              one.summary.add(frame, datasets[d].camera(frame.labels));
              if (!arguments.report.empty()) {
                one.worst.add(frame, datasets[d]);
              }
              progress.done(one.summary.images.size());
              interruption.check(kNothingWritten);
            });
      }
    }
    one.figures = makeFigures(one.summary);
    interruption.check(kNothingWritten);
    text += fmt::format("{}== {} ==\n{}{}",
                        text.empty() ? "" : "\n",
                        one.name,
                        table(one.summary),
                        table(one.figures, options));
    for (const Gate& gate : gates) {
      const auto [reached, figure] = gate.reached(one.figures);
      verdicts += fmt::format("{}: {}: {}: {}, asked for {}\n",
                              reached ? "passed" : "failed",
                              one.name,
                              gate.what,
                              figure,
                              gate.option);
      if (!reached) {
        failures.push_back(fmt::format(
            "{} is not reached by {}: {}: {}", gate.option, one.name, gate.what, figure));
      }
    }
  }
  if (!verdicts.empty()) {
    text += "\n" + verdicts;
  }
  if (!arguments.json.empty()) {
    writeFileAtomically(arguments.json, evaluationJson(all).dump(1) + "\n");
  }
  if (!arguments.report.empty()) {
    const std::string title = fmt::format("Line detection on {}", fmt::join(arguments.data, ", "));
    writeEvaluationPage(all, title, arguments.report);
    text += "\n" + reportFiles(arguments.report)[0] + "\n";
  }
  print(text);
  if (failures.empty()) {
    return kDone;
  }
  complain(fmt::format("{}", fmt::join(failures, "; ")));
  return kCheckFailed;
}

}  // namespace

Run addEvaluate(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  const auto each = [](CLI::Option* option) { return option->expected(1)->take_all(); };
  auto* data =
      each(command.add_option("--data",
                              arguments->data,
                              "Dataset folder; may be repeated: all are evaluated together"))
          ->type_name("DIR");
  auto* detections = each(command.add_option("--detections",
                                             arguments->detections,
                                             "Detections of any program, one JSON object per line; "
                                             "one file for each --data"))
                         ->type_name("FILE");
  command
      .add_option("--detector",
                  arguments->detectors,
                  "Detectors to run: dlsd (if nothing is said), dlsd-paper; lsd, edlines, fld on "
                  "rectified images")
      ->type_name("NAME")
      ->delimiter(',');
  auto* program =
      command
          .add_option("--command",
                      arguments->command.command,
                      "Program to run on each image, with {image}, {out} and, if wanted, "
                      "{camera} where it gets the paths: it writes one JSON object to {out}")
          ->type_name("'PROGRAM {image} {out}'")
          ->check([](const std::string& text) { return text.empty() ? "is empty" : ""; });
  command.add_option("--timeout", arguments->command.timeout_s, "Seconds for one run of --command")
      ->type_name("S")
      ->capture_default_str()
      ->needs(program);
  auto* curve =
      command
          .add_option(
              "--curve",
              arguments->curve,
              "How a detection's points are joined: polyline, or bezier for the 2 to 8 points "
              "of ULSD")
          ->type_name("NAME")
          ->capture_default_str()
          ->check(CLI::IsMember({"polyline", "bezier"}));
  auto* rho = command.add_option("--rho", arguments->options.rho_px, "Tolerances in px")
                  ->type_name("PX")
                  ->capture_default_str()
                  ->delimiter(',');
  auto* json = command.add_option("--json", arguments->json, "Write the figures to this file, too")
                   ->type_name("FILE");
  auto* report =
      command
          .add_option(
              "--report",
              arguments->report,
              "Folder for a page with plots, worst misses and false alarms, and the figures as "
              "CSV and JSON")
          ->type_name("DIR");
  auto* time = command.add_flag(
      "--time",
      arguments->timed,
      "Measure times (with one thread unless --jobs says otherwise); no two runs give "
      "the same");
  auto* recall =
      command
          .add_option("--min-recall",
                      arguments->min_recall,
                      "Exit with 1 if a smaller share of the headline labels is found at this rho")
          ->type_name("SHARE@RHO")
          ->delimiter(',');
  auto* right =
      command
          .add_option(
              "--min-right,--min-precision",
              arguments->min_right,
              "Exit with 1 if a smaller share of the detections (of the headline's angle) is "
              "right at this rho")
          ->type_name("SHARE@RHO")
          ->delimiter(',');
  auto* rms =
      command
          .add_option("--max-rms-px",
                      arguments->max_rms_px,
                      "Exit with 1 if found headline labels are farther from their detection")
          ->type_name("PX");
  auto* experiment =
      command
          .add_option(
              "--experiment",
              arguments->experiment,
              "Run a published experiment instead: dlsd-paper, on its sequence of two sheets of "
              "paper, made unless --data has it")
          ->type_name("NAME")
          ->check(CLI::IsMember({"dlsd-paper"}));
  for (CLI::Option* other : {detections, curve, rho, json, report, time, recall, right, rms}) {
    experiment->excludes(other);
  }
  command.add_option("--frames", arguments->frames, "Frames of the experiment's sequence")
      ->capture_default_str()
      ->transform(wholeNumber(1, 10000000))
      ->needs(experiment)
      ->excludes(data);
  command.add_option("--out", arguments->out, "Folder for the experiment's page, tables and data")
      ->type_name("DIR")
      ->needs(experiment);
  command.add_option("--jobs", arguments->jobs, "Threads; 0: one per core")
      ->capture_default_str()
      ->transform(wholeNumber(0, 1024));
  command.footer(
      "Examples:\n"
      "  dlsd evaluate --data data\n"
      "  dlsd evaluate --data data --detections det.jsonl --rho 1,2,4 --json figures.json\n"
      "  dlsd evaluate --data data --detector dlsd,lsd,edlines --time --report report\n"
      "  dlsd evaluate --data data --command './mydetector {image} {out}' --detector dlsd,lsd\n"
      "  dlsd evaluate --data data --min-recall 0.98@4 --min-right 0.9@4 --max-rms-px 0.2\n"
      "  dlsd evaluate --experiment dlsd-paper --out experiment");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
