// The program `dlsd`: reads the command line, runs one command, turns errors into exit codes.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <exception>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "cameras/calibration/files.h"
#include "cli/command.h"

namespace {

using namespace dlsd::cli;

struct Entry {
  const char* name;
  const char* help;
  Run (*add)(CLI::App& command);
};

constexpr Entry kCommands[] = {
    {"generate",
     "Make a labelled dataset: images, exact line labels, cameras, manifest.",
     addGenerate},
    {"detect", "Find straight 3D lines in distorted images.", addDetect},
    {"evaluate", "Compare detections with the exact labels of a dataset.", addEvaluate},
    {"camera", "Look at calibration files.", addCamera},
    {"report", "Write a static HTML page of a dataset and its detections.", addReport},
    {"replay", "Make a saved property case again and check it.", addReplay},
};

int run(int argc, char** argv) {
  CLI::App app{"Distorted straight line segments: exact synthetic data, detection, evaluation."};
  app.name("dlsd");
  app.set_version_flag("--version", "dlsd " DLSD_VERSION);
  app.footer("dlsd COMMAND --help shows the options of a command and examples.");
  std::vector<std::pair<CLI::App*, Run>> commands;
  for (const Entry& entry : kCommands) {
    CLI::App* command = app.add_subcommand(entry.name, entry.help);
    commands.emplace_back(command, entry.add(*command));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help, --version
      app.exit(error);
      print("");
      return kDone;
    }
    complain(error.what());
    return kBadInput;
  }
  for (const auto& [command, execute] : commands) {
    if (command->parsed()) {
      return execute();
    }
  }
  std::vector<std::string_view> names;
  for (const Entry& entry : kCommands) {
    names.emplace_back(entry.name);
  }
  complain(fmt::format("a command is needed, one of {} (dlsd --help)", fmt::join(names, ", ")));
  return kBadInput;
}

}  // namespace

int main(int argc, char** argv) {
  hushLibraries();
  try {
    return run(argc, argv);
  } catch (const dlsd::InputError& error) {
    complain(error.what());
    return kBadInput;
  } catch (const std::invalid_argument& error) {
    complain(error.what());
    return kBadInput;
  } catch (const dlsd::SystemError& error) {
    complain(error.what());
    return kSystemFailed;
  } catch (const std::filesystem::filesystem_error& error) {
    complain(error.what());
    return kSystemFailed;
  } catch (const std::bad_alloc&) {
    complain("out of memory");
    return kSystemFailed;
  } catch (const std::exception& error) {
    complain(error.what());
    return kSystemFailed;
  }
}
