#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "cameras/calibration/files.h"
#include "cameras/conversion.h"
#include "cli/camera_commands.h"

namespace dlsd::cli {
namespace {

struct Arguments {
  CameraArgument camera;
  std::string model, out, out_format = "kalibr";
  double max_angle_deg = 180;
  std::optional<double> max_px;
};

constexpr double kWorthAWordPx = 1;  // a residual that the user is told of

/// Without the limit of the field angle that the conversion added, if the format says the camera
/// only so.
Camera withoutUnsayableLimit(const Camera& source, const Camera& camera, std::string_view format) {
  if (camera.maxFieldAngleLimit() == source.maxFieldAngleLimit()) {
    return camera;
  }
  const auto says = [&](const Camera& c) {
    try {
      (void)calibrationText({{"cam0", c}}, format);
      return true;
    } catch (const std::invalid_argument&) {
      return false;
    }
  };
  const Camera unlimited(camera.model(), camera.width(), camera.height());
  return !says(camera) && says(unlimited) ? unlimited : camera;
}

/// As Kalibr wants them, cam0, cam1, ...; what was renamed is said.
std::string renumber(std::vector<NamedCamera>* cameras) {
  std::string text;
  for (size_t i = 0; i < cameras->size(); ++i) {
    const std::string name = fmt::format("cam{}", i);
    std::string& before = (*cameras)[i].name;
    if (before != name) {
      text += fmt::format("{}{} is {}", text.empty() ? "in the file " : ", ", before, name);
      before = name;
    }
  }
  return text.empty() ? text : text + "\n";
}

/// @param note  Lines to stand below the parameters.
std::string textOf(const Conversion& conversion, const std::string& note) {
  const Camera& camera = conversion.camera;
  std::string text = fmt::format("{:<14}  {}\n", "model", camera.modelName());
  const std::vector<double> params = camera.params();
  for (size_t i = 0; i < params.size(); ++i) {
    const ParamSpec& spec = camera.paramSpecs()[i];
    text += fmt::format("{:<14}  {}{}{}\n",
                        spec.name,
                        params[i],
                        spec.unit == "1" ? "" : " ",
                        spec.unit == "1" ? "" : spec.unit);
  }
  if (camera.maxFieldAngleLimit() < M_PI) {
    text += fmt::format("{:<14}  {:.6f} deg, as far as the source goes\n",
                        "limit",
                        camera.maxFieldAngleLimit() * kDegreesPerRad);
  }
  text += note;
  text += "\nfield angle      pixels      rms px      max px   not projected\n";
  const auto row = [](const std::string& name, const ResidualBand& band) {
    return fmt::format("{:<14}  {:>7}  {:>10.3g}  {:>10.3g}  {:>14}\n",
                       name,
                       band.compared,
                       band.rms_px,
                       band.max_px,
                       band.lost);
  };
  for (const ResidualBand& band : conversion.residual.bands) {
    if (band.compared + band.lost > 0) {
      text += row(fmt::format("{:>3.0f} - {:<3.0f} deg",
                              band.from_rad * kDegreesPerRad,
                              band.to_rad * kDegreesPerRad),
                  band);
    }
  }
  text += row("all", conversion.residual.all);
  text += fmt::format("worst at ({:g}, {:g})\n",
                      conversion.residual.worst_px.x(),
                      conversion.residual.worst_px.y());
  return text;
}

int run(const Arguments& arguments) {
  if (!(arguments.max_angle_deg > 0 && arguments.max_angle_deg <= 180)) {
    throw InputError(
        fmt::format("--max-angle is {}, allowed are degrees in (0, 180]", arguments.max_angle_deg));
  }
  if (arguments.max_px && !(*arguments.max_px >= 0)) {
    throw InputError(fmt::format("--max-px is {}, allowed is a number >= 0", *arguments.max_px));
  }
  if (arguments.model.empty() && arguments.out.empty()) {
    throw InputError("camera convert needs --to MODEL, or --out FILE for another file format");
  }
  if (!arguments.model.empty()) {
    (void)paramSpecsOf(arguments.model);  // says which there are
  }
  const LoadedCalibration calibration = loadChosen(arguments.camera);
  if (!arguments.out.empty()) {
    checkOutputs({calibrationFile(arguments.camera.path)}, {arguments.out});
    checkPlaceForFile(arguments.out);
  }
  const double max_angle = std::min(M_PI, arguments.max_angle_deg / kDegreesPerRad);
  std::string text;
  std::vector<std::string> complaints, warnings;
  std::vector<NamedCamera> converted;
  for (const NamedCamera& named : calibration.cameras) {
    const std::string model =
        arguments.model.empty() ? std::string(named.camera.modelName()) : arguments.model;
    const std::optional<Conversion> conversion = convertCamera(named.camera, model, max_angle);
    if (!conversion) {
      throw InputError(
          fmt::format("{} ({}): no pixel has a ray within {:g} degrees that {} projects",
                      arguments.camera.path,
                      named.name,
                      arguments.max_angle_deg,
                      model));
    }
    if (calibration.cameras.size() > 1) {
      text += fmt::format("{}== {} ==\n", text.empty() ? "" : "\n", named.name);
    }
    Camera written = conversion->camera;
    std::string note;
    if (!arguments.out.empty()) {
      written = withoutUnsayableLimit(named.camera, written, arguments.out_format);
      if (!(written == conversion->camera)) {
        note = fmt::format(
            "{:<14}  is not in the file: {} has no word for it\n", "", arguments.out_format);
      }
    }
    text +=
        fmt::format("{:<14}  {}\n", "from", named.camera.modelName()) + textOf(*conversion, note);
    const ResidualBand& all = conversion->residual.all;
    if (!arguments.max_px && (all.lost > 0 || !(all.max_px <= kWorthAWordPx))) {
      warnings.push_back(fmt::format(
          "{} ({}): {} does not fit this camera well: {} of its pixels do not project, the others "
          "are off by up to {:.3g} px; --max-angle leaves out the rim, --max-px refuses such a "
          "result",
          arguments.camera.path,
          named.name,
          model,
          all.lost,
          all.max_px));
    }
    if (arguments.max_px && !(all.max_px <= *arguments.max_px)) {
      complaints.push_back(fmt::format("{} ({}): {} is off by {:.3g} px, more than --max-px {:g}",
                                       arguments.camera.path,
                                       named.name,
                                       model,
                                       all.max_px,
                                       *arguments.max_px));
    } else if (arguments.max_px && all.lost > 0) {
      complaints.push_back(fmt::format(
          "{} ({}): {} does not project the rays of {} pixels; --max-angle leaves them out",
          arguments.camera.path,
          named.name,
          model,
          all.lost));
    }
    converted.push_back({named.name, written});
  }
  if (complaints.empty() && !arguments.out.empty()) {
    if (converted.size() == 1 || arguments.out_format == "kalibr") {
      text += renumber(&converted);
    }
    saveCalibration(arguments.out, converted, arguments.out_format);
  }
  print(text);
  for (const std::string& warning : warnings) {
    complain(warning);
  }
  for (const std::string& complaint : complaints) {
    complain(complaint);
  }
  return complaints.empty() ? kDone : kCheckFailed;
}

}  // namespace

Run addCameraConvert(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  addCameraArgument(command, &arguments->camera);
  command.add_option("--to", arguments->model, "Model to fit; without it the model stays as it is")
      ->type_name("MODEL");
  command.add_option("--out", arguments->out, "Calibration file to write")->type_name("FILE");
  std::vector<std::string> names;
  for (const CalibrationFormat& format : calibrationFormats()) {
    if (format.written) {
      names.emplace_back(format.name);
    }
  }
  command
      .add_option("--to-format",
                  arguments->out_format,
                  fmt::format("Format of that file: {}", fmt::join(names, ", ")))
      ->type_name("NAME")
      ->check(CLI::IsMember(names))
      ->capture_default_str();
  command
      .add_option("--max-angle",
                  arguments->max_angle_deg,
                  "Only rays up to this angle to the optical axis, degrees")
      ->type_name("DEG")
      ->capture_default_str();
  command
      .add_option("--max-px",
                  arguments->max_px,
                  "Exit with 1 and write nothing if any pixel is off by more or does not project")
      ->type_name("PX");
  command.footer(
      "Examples:\n"
      "  dlsd camera convert wide.yaml --to kannala_brandt --out wide_kb.yaml --max-px 0.1\n"
      "  dlsd camera convert wide.yaml --to pinhole_radtan --max-angle 60\n"
      "  dlsd camera convert camera.txt --out camera.yaml\n"
      "  dlsd camera convert rig.yaml --out rig.json --to-format basalt");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
