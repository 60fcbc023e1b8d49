#include "cameras/camera.h"

#include <fmt/format.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cmath>
#include <memory>
#include <optional>

#include "cameras/batch.h"
#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "cli/command.h"

namespace dlsd::cli {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegrees = 180 / M_PI;

double fieldAngle(const Vector3d& ray) {
  return std::atan2(std::hypot(ray.x(), ray.y()), ray.z());
}

/// Angle to the optical axis of the farthest pixel with a ray between two, the first of which has
/// one.
struct Reach {
  double angle_rad;
  bool cut;  ///< The domain ends before the second pixel.
};

Reach reach(const Camera& camera, const Vector2d& centre, const Vector2d& border) {
  if (const std::optional<Vector3d> ray = camera.unproject(border)) {
    return {fieldAngle(*ray), false};
  }
  double inside = 0, outside = 1;
  while (outside - inside > 1e-9) {
    const double t = (inside + outside) / 2;
    (camera.unproject(centre + t * (border - centre)) ? inside : outside) = t;
  }
  const std::optional<Vector3d> ray = camera.unproject(centre + inside * (border - centre));
  return {ray ? fieldAngle(*ray) : 0, true};
}

/// Angles on both sides of the axis, summed: past 180 degrees, too.
std::string fieldOfView(const Camera& camera,
                        const Vector2d& centre,
                        const Vector2d& one_border,
                        const Vector2d& other_border) {
  const Reach a = reach(camera, centre, one_border);
  const Reach b = reach(camera, centre, other_border);
  return fmt::format("{:.2f} deg ({:.2f} + {:.2f}){}",
                     (a.angle_rad + b.angle_rad) * kDegrees,
                     a.angle_rad * kDegrees,
                     b.angle_rad * kDegrees,
                     a.cut || b.cut ? ", cut by the domain" : "");
}

size_t pixelsWithRay(const Camera& camera) {
  const auto width = size_t(camera.width());
  std::vector<double> u(width), v(width), x(width), y(width), z(width);
  std::vector<uint8_t> valid(width);
  for (size_t i = 0; i < width; ++i) {
    u[i] = double(i);
  }
  size_t count = 0;
  for (int row = 0; row < camera.height(); ++row) {
    std::fill(v.begin(), v.end(), double(row));
    unprojectAll(camera, u, v, x, y, z, valid);
    for (const uint8_t one : valid) {
      count += one;
    }
  }
  return count;
}

int show(const std::string& path) {
  const Camera camera = loadCamera(path);
  std::string text;
  const auto row = [&](const std::string& name, const std::string& value) {
    text += fmt::format("{:<18}  {}\n", name, value);
  };
  row("model", std::string(camera.modelName()));
  row("size", fmt::format("{} x {} px", camera.width(), camera.height()));
  const std::vector<double> params = camera.params();
  std::optional<double> cx, cy;
  for (size_t i = 0; i < params.size(); ++i) {
    const ParamSpec& spec = camera.paramSpecs()[i];
    row(std::string(spec.name),
        fmt::format(
            "{}{}{}", params[i], spec.unit == "1" ? "" : " ", spec.unit == "1" ? "" : spec.unit));
    if (spec.name == "cx") {
      cx = params[i];
    } else if (spec.name == "cy") {
      cy = params[i];
    }
  }
  const double w = camera.width();
  const double h = camera.height();
  const Vector2d centre(cx.value_or((w - 1) / 2), cy.value_or((h - 1) / 2));
  row("principal point",
      fmt::format("({}, {}) if (0, 0) is the centre of the top left pixel, as everywhere in dlsd",
                  centre.x(),
                  centre.y()));
  row("", fmt::format("({}, {}) if (0, 0) is its corner", centre.x() + 0.5, centre.y() + 0.5));
  row("domain",
      fmt::format("rays up to {:.4f} deg from the optical axis project{}",
                  camera.maxFieldAngle() * kDegrees,
                  camera.maxFieldAngleLimit() < M_PI ? " (max_field_angle of the file)" : ""));
  if (camera.unproject(centre) && camera.inImage(centre)) {
    row("horizontal view", fieldOfView(camera, centre, {-0.5, centre.y()}, {w - 0.5, centre.y()}));
    row("vertical view", fieldOfView(camera, centre, {centre.x(), -0.5}, {centre.x(), h - 0.5}));
    row("diagonal view", fieldOfView(camera, centre, {-0.5, -0.5}, {w - 0.5, h - 0.5}));
    row("", fieldOfView(camera, centre, {w - 0.5, -0.5}, {-0.5, h - 0.5}));
  } else {
    row("view", "the principal point is outside the image: no view across it");
  }
  const size_t with_ray = pixelsWithRay(camera);
  const size_t pixels = size_t(camera.width()) * size_t(camera.height());
  row("pixels with a ray",
      fmt::format("{}/{} {:.2f} %", with_ray, pixels, 100 * double(with_ray) / double(pixels)));
  row("conventions",
      fmt::format("image [-0.5, {}] x [-0.5, {}], x right, y down, z forward", w - 0.5, h - 0.5));
  print(text);
  return kDone;
}

}  // namespace

Run addCamera(CLI::App& command) {
  const auto path = std::make_shared<std::string>();
  CLI::App* show_command = command.add_subcommand(
      "show", "Model, parameters, field of view, domain and conventions of a camera.");
  show_command->add_option("file", *path, "Calibration file, or file:camera if it holds several")
      ->type_name("FILE")
      ->required();
  const std::string examples =
      "Examples:\n"
      "  dlsd camera show wide.yaml\n"
      "  dlsd camera show rig.yaml:cam1";
  show_command->footer(examples);
  command.footer(examples);
  return [path, show_command]() -> int {
    if (!show_command->parsed()) {
      throw InputError("camera needs to be told what to do: show (dlsd camera --help)");
    }
    return show(*path);
  };
}

}  // namespace dlsd::cli
