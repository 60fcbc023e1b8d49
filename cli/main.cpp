// The program `dlsd`: reads the command line, runs one command, turns errors into exit codes.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
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
    {"export", "Write a dataset in the form of another program's loader.", addExport},
    {"report", "Write a static HTML page of a dataset and its detections.", addReport},
    {"replay", "Make a saved property case again and check it.", addReplay},
};

/// Changes of one letter (also two neighbours swapped) that turn one word into the other.
size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      const size_t change = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

/// Throws InputError if a word where a command belongs is none. CLI11 alone would show the general
/// help for `dlsd detct --help`.
void checkCommands(const CLI::App& app, int argc, char** argv) {
  const CLI::App* at = &app;
  std::string path = "dlsd";
  for (int i = 1; i < argc && argv[i][0] != '-'; ++i) {
    const std::vector<const CLI::App*> known = at->get_subcommands(nullptr);
    if (known.empty()) {
      return;
    }
    const std::string_view word = argv[i];
    std::vector<std::string> names;
    at = nullptr;
    for (const CLI::App* command : known) {
      names.push_back(command->get_name());
      if (names.back() == word) {
        at = command;
      }
    }
    if (at == nullptr) {
      const auto closest =
          std::min_element(names.begin(), names.end(), [&](const auto& a, const auto& b) {
            return editDistance(a, word) < editDistance(b, word);
          });
      throw dlsd::InputError(
          editDistance(*closest, word) <= 2
              ? fmt::format("{0} has no command \"{1}\", did you mean {2}? ({0} {2} --help)",
                            path,
                            word,
                            *closest)
              : fmt::format("{0} has no command \"{1}\", only {2} ({0} --help)",
                            path,
                            word,
                            fmt::join(names, ", ")));
    }
    path += " " + at->get_name();
  }
}

/// ", did you mean --out?" for the first option that the command does not have, if one of its own
/// is like it.
std::string meantOption(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  for (const std::string& word : app.remaining(true)) {
    if (!word.starts_with("--")) continue;
    const std::string name = word.substr(2, word.find('=') - 2);
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& known : option->get_lnames()) {
        if (editDistance(known, name) <= (name.size() > 4 ? 2 : 1))
          return ", did you mean --" + known + "?";
      }
    }
    break;
  }
  return "";
}

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
  checkCommands(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError& error) {
    complain(error.what() + meantOption(app));
    return kBadInput;
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
  } catch (const Interrupted& interrupted) {
    complain(interrupted.what());
    return 128 + interrupted.signal;
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
