#include <fmt/format.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "cameras/calibration/files.h"
#include "cli/command.h"
#include "properties/checks/judge.h"
#include "synth/dataset/json_fields.h"

namespace dlsd::cli {
namespace {

struct Options {
  std::string path, out;
};

int replay(const Options& options) {
  std::string path = options.path;
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) path = std::filesystem::path(path) / "case.json";
  const auto json = parseJson(readFile(path), path);
  const Verdict verdict = judgeCase(json, path, !options.out.empty());
  if (!options.out.empty()) {
    const std::string& what = verdict.failure.empty() ? verdict.noted : verdict.failure;
    print(saveCounterexample(options.out, verdict.judged, what, verdict.shown) + "\n");
  }
  for (const std::string& detail : verdict.details) print(detail + "\n");
  if (!verdict.other_scene.empty()) print("warning: " + verdict.other_scene + "\n");
  if (!verdict.failure.empty()) {
    print("failed: " + verdict.failure + "\n");
  } else if (!verdict.noted.empty()) {
    print("noted: " + verdict.noted + " (of many frames, a share may be)\n");
  } else {
    print((verdict.is_judged ? "passed: " : "nothing to judge: ") + verdict.summary + "\n");
  }
  return verdict.failure.empty() ? kDone : kCheckFailed;
}

}  // namespace

Run addReplay(CLI::App& command) {
  auto options = std::make_shared<Options>();
  command.add_option("case", options->path, "A case: counterexample-.../case.json, or its folder")
      ->required();
  command.add_option(
      "--out", options->out, "Folder in which to write the case's folder with its pictures");
  command.footer(
      "Examples:\n"
      "  dlsd replay fixtures/counterexamples/x.json\n"
      "  dlsd replay case.json --out look      then open overlay.svg: what fails is red\n\n"
      "docs/properties.md explains the properties. Exit code 1 if the case still fails; 0, and\n"
      "\"noted\", if labels are missed or lines are wrong of which a share of many frames may be.\n"
      "\"nothing to judge\": the property speaks of nothing that is in the case's pictures.");
  return [options] { return replay(*options); };
}

}  // namespace dlsd::cli
