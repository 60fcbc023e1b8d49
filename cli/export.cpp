#include "synth/dataset/exports/export.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "cameras/calibration/files.h"
#include "cli/command.h"

namespace dlsd::cli {
namespace {

struct Arguments {
  std::string data, format;
  std::vector<double> shares;
  size_t shard_mib = 1024;
  ExportOptions options;
};

int run(Arguments& arguments) {
  ExportOptions& options = arguments.options;
  for (const ExportFormatInfo& info : exportFormats()) {
    if (info.name == arguments.format) options.format = info.format;
  }
  if (!arguments.shares.empty()) {
    if (arguments.shares.size() != 3) {
      throw InputError("--split has " + std::to_string(arguments.shares.size()) +
                       " numbers, needed are the shares of train, val and test as in 0.8,0.1,0.1");
    }
    std::copy(arguments.shares.begin(), arguments.shares.end(), options.shares.begin());
  }
  options.shard_bytes = arguments.shard_mib << 20;
  options.check();
  const Dataset dataset(arguments.data);
  checkPlaceForFolder(options.out);
  ExportResult result;
  {
    Progress progress("frames", dataset.size());
    const Interruption interruption;
    result = exportDataset(dataset, options, [&](size_t done) {
      progress.done(done);
      if (done < dataset.size()) interruption.check("nothing was written");
    });
  }
  print(fmt::format("{}: {} frames ({} train, {} val, {} test), {} lines\n",
                    options.out,
                    result.frames[0] + result.frames[1] + result.frames[2],
                    result.frames[0],
                    result.frames[1],
                    result.frames[2],
                    result.lines));
  for (const std::string& note : result.notes) print("  " + note + "\n");
  return kDone;
}

}  // namespace

Run addExport(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  ExportOptions& options = arguments->options;
  std::vector<std::string> names;
  std::string formats = "Formats:\n";
  for (const ExportFormatInfo& info : exportFormats()) {
    names.emplace_back(info.name);
    formats += fmt::format("  {:<12}{}\n", info.name, info.about);
  }
  command
      .add_option("--format", arguments->format, fmt::format("One of {}", fmt::join(names, ", ")))
      ->type_name("NAME")
      ->required()
      ->check(CLI::IsMember(names));
  command.add_option("--data", arguments->data, "Dataset folder")->type_name("DIR")->required();
  command.add_option("--out", options.out, "Folder to make; must not be there, or be empty")
      ->type_name("DIR")
      ->required();
  command.add_option("--split", arguments->shares, "Shares of train, val, test [0.8,0.1,0.1]")
      ->type_name("A,B,C")
      ->delimiter(',');
  command
      .add_option("--min-length", options.min_length_px, "Leave out labels that are shorter, in px")
      ->type_name("PX")
      ->capture_default_str();
  command
      .add_option(
          "--min-contrast", options.min_contrast, "Leave out labels of less contrast, grey levels")
      ->type_name("LEVELS")
      ->capture_default_str();
  command.add_option("--name", options.name, "ulsd: name of the data set")->capture_default_str();
  command.add_option("--order", options.order, "ulsd: order of the curves, 1 to 4")
      ->capture_default_str()
      ->transform(wholeNumber(1, 4));
  command.add_option("--shard-size", arguments->shard_mib, "webdataset: MiB a tar file")
      ->capture_default_str()
      ->transform(wholeNumber<size_t>(1, 1 << 20));
  command.footer(
      formats +
      "Examples:\n"
      "  dlsd export --format ulsd --data data --out ulsd --min-length 10 --min-contrast 10\n"
      "  dlsd export --format coco-line --data data --out letr --split 0.9,0.1,0\n"
      "  dlsd export --format webdataset --data data --out tars");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
