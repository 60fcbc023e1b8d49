#include <fmt/format.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <memory>

#include "cameras/calibration/files.h"
#include "cli/command.h"
#include "properties/checks/counterexample.h"
#include "synth/dataset/json_fields.h"

namespace dlsd::cli {
namespace {

struct Options {
  std::string path, out;
};

int replay(const Options& options) {
  const FrameCase frame_case =
      frameCaseFromJson(parseJson(readFile(options.path), options.path), options.path);
  if (frame_case.property != "recovery") {
    throw InputError(fmt::format("{}: property = \"{}\" is unknown: allowed is recovery",
                                 options.path,
                                 frame_case.property));
  }
  const Frame frame = renderCase(frame_case);
  const RecoveryOutcome outcome = checkRecovery(frame_case, frame, {});
  if (!options.out.empty()) {
    print(saveCounterexample(options.out, frame_case, frame, outcome) + "\n");
  }
  for (const LabelLine& label : frame.labels.lines) {
    if (std::count(outcome.missed_ids.begin(), outcome.missed_ids.end(), label.id) == 0) continue;
    print(
        fmt::format("missed: label {}, {} of {:.0f} grey levels, {:.0f} px, ({:.1f}, {:.1f}) to "
                    "({:.1f}, {:.1f})\n",
                    label.id,
                    toString(label.kind),
                    label.contrast,
                    label.length_px,
                    label.points.front().x(),
                    label.points.front().y(),
                    label.points.back().x(),
                    label.points.back().y()));
  }
  print(fmt::format("{}: {}/{} clear labels found\n",
                    outcome.missed_ids.empty() ? "passed" : "failed",
                    outcome.found(),
                    outcome.qualified));
  return outcome.missed_ids.empty() ? kDone : kCheckFailed;
}

}  // namespace

Run addReplay(CLI::App& command) {
  auto options = std::make_shared<Options>();
  command.add_option("case", options->path, "A case, e.g. counterexample-.../case.json")
      ->required();
  command.add_option(
      "--out", options->out, "Folder in which to write the case's folder with its pictures");
  command.footer(
      "Examples:\n"
      "  dlsd replay fixtures/counterexamples/x.json\n"
      "  dlsd replay case.json --out look      then open overlay.svg: missed labels are "
      "red\n\n"
      "Exit code 1 if the case still fails.");
  return [options] { return replay(*options); };
}

}  // namespace dlsd::cli
