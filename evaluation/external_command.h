#pragma once
// Anyone's detector, run as a program on one image after the other.

#include <functional>
#include <string>
#include <vector>

#include "evaluation/dataset_evaluation.h"

namespace dlsd {

/// Words of a command line: separated by blanks, '...' and "..." hold what they enclose together.
/// No other character is special: this is no shell (write sh -c '...' for one). Throws InputError
/// if there is no word or a quote is not closed.
[[nodiscard]] std::vector<std::string> splitCommand(const std::string& command);

struct CommandOptions {
  /// With {image}, {out} and, if wanted, {camera}: absolute paths of the image, of the file that
  /// the program writes and of the calibration file. {image} and {out} must be there.
  std::string command;
  double timeout_s = 60;  ///< For one image, in (0, 1e6].
  /// If given, called every few ms while the program runs, by the thread that waits for it. What it
  /// throws is thrown on, after the program and what it started are killed.
  std::function<void()> while_running = {};
};

/// Runs a program for each image: it writes one JSON object to {out} as in docs/dataset-format.md
/// (detections), of which `lines[].points` is required; `image` is not, and not looked at. Each
/// thread has a scratch folder below the system's temporary one, removed at the end; the program
/// runs in the folder that we are in, with nothing on its standard input and its standard output
/// thrown away. Throws InputError, naming image and program, if it can't be started, ends with
/// another code than 0 (with the last line of its standard error), is killed, takes longer than the
/// timeout (then it and what it started are killed), or writes no record; now if the command or the
/// timeout is bad.
/// @param timed  Keep the time: the record's `time_ms`, else how long the program ran in all.
[[nodiscard]] DetectionSource detectionsOfCommand(const Dataset& dataset,
                                                  const CommandOptions& options,
                                                  bool timed = false);

}  // namespace dlsd
