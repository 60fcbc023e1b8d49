#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cameras/batch.h"
#include "cameras/calibration/files.h"
#include "cli/camera_commands.h"
#include "cli/camera_plot.h"
#include "synth/dataset/image.h"

namespace dlsd::cli {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using nlohmann::ordered_json;

struct Arguments {
  CameraArgument camera;
  std::string plot;
  bool json = false;
};

/// Farthest point with a ray on the way from one, which has one, to the border.
struct Reach {
  Vector2d pixel{0, 0};
  double angle_rad = 0;
  bool cut = false;  ///< The domain ends before the border.
};

Reach reach(const Camera& camera, const Vector2d& centre, const Vector2d& border) {
  if (const std::optional<Vector3d> ray = camera.unproject(border)) {
    return {border, fieldAngle(*ray), false};
  }
  double inside = 0, outside = 1;
  while (outside - inside > 1e-9) {
    const double t = (inside + outside) / 2;
    (camera.unproject(centre + t * (border - centre)) ? inside : outside) = t;
  }
  const Vector2d pixel = centre + inside * (border - centre);
  const std::optional<Vector3d> ray = camera.unproject(pixel);
  return {pixel, ray ? fieldAngle(*ray) : 0, true};
}

/// Angles on both sides of the axis, summed: past 180 degrees, too.
struct View {
  double one_rad = 0, other_rad = 0;
  bool cut = false;
};

/// Where the domain ends inside the image, seen from the principal point.
struct Rim {
  double min_px = 0, max_px = 0;
  bool complete = false;
};

std::optional<Rim> rimOf(const Camera& camera, const Vector2d& centre) {
  constexpr int kDirections = 720;
  Rim rim;
  int found = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double a = 2 * M_PI * i / kDirections;
    const Vector2d direction(std::cos(a), std::sin(a));
    // The border in this direction.
    const double bx = direction.x() > 0 ? camera.width() - 0.5 : -0.5;
    const double by = direction.y() > 0 ? camera.height() - 0.5 : -0.5;
    const double tx = direction.x() != 0 ? (bx - centre.x()) / direction.x() : 1e9;
    const double ty = direction.y() != 0 ? (by - centre.y()) / direction.y() : 1e9;
    const Reach end = reach(camera, centre, centre + std::min(tx, ty) * direction);
    if (end.cut) {
      const double radius = (end.pixel - centre).norm();
      rim.min_px = found == 0 ? radius : std::min(rim.min_px, radius);
      rim.max_px = std::max(rim.max_px, radius);
      ++found;
    }
  }
  if (found == 0) {
    return std::nullopt;
  }
  rim.complete = found == kDirections;
  return rim;
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

/// All that is said about a camera.
struct Facts {
  Vector2d principal_px{0, 0};  ///< Image of the optical axis.
  std::optional<View> horizontal, vertical, diagonals[2];
  std::optional<Scale> centre, rim;
  std::optional<Rim> circle;
  size_t with_ray = 0, pixels = 0;
};

Facts factsOf(const Camera& camera) {
  Facts facts;
  const double w = camera.width(), h = camera.height();
  const std::optional<Vector2d> axis = camera.project(Vector3d::UnitZ());
  facts.principal_px = axis.value_or(Vector2d((w - 1) / 2, (h - 1) / 2));
  facts.with_ray = pixelsWithRay(camera);
  facts.pixels = size_t(camera.width()) * size_t(camera.height());
  facts.centre = scaleAt(camera, Vector3d::UnitZ());
  const Vector2d centre = facts.principal_px;
  if (!axis || !camera.inImage(centre) || !camera.unproject(centre)) {
    return facts;
  }
  const auto view = [&](const Vector2d& one, const Vector2d& other) {
    const Reach a = reach(camera, centre, one), b = reach(camera, centre, other);
    return View{a.angle_rad, b.angle_rad, a.cut || b.cut};
  };
  facts.horizontal = view({-0.5, centre.y()}, {w - 0.5, centre.y()});
  facts.vertical = view({centre.x(), -0.5}, {centre.x(), h - 0.5});
  facts.diagonals[0] = view({-0.5, -0.5}, {w - 0.5, h - 0.5});
  facts.diagonals[1] = view({w - 0.5, -0.5}, {-0.5, h - 0.5});
  Reach farthest;
  for (const Vector2d& corner : {Vector2d(-0.5, -0.5),
                                 Vector2d(w - 0.5, -0.5),
                                 Vector2d(-0.5, h - 0.5),
                                 Vector2d(w - 0.5, h - 0.5)}) {
    const Reach end = reach(camera, centre, corner);
    farthest = end.angle_rad > farthest.angle_rad ? end : farthest;
  }
  // A corner of a panorama is its pole, where there is no scale: just off it.
  const Vector2d rim = farthest.pixel + 2 * (centre - farthest.pixel).normalized();
  const bool pole = std::holds_alternative<Equirectangular>(camera.model());
  if (const std::optional<Vector3d> ray = camera.unproject(pole ? rim : farthest.pixel)) {
    facts.rim = scaleAt(camera, *ray);
  }
  facts.circle = rimOf(camera, centre);
  return facts;
}

std::string text(const View& view) {
  return fmt::format("{:.2f} deg ({:.2f} + {:.2f}){}",
                     (view.one_rad + view.other_rad) * kDegreesPerRad,
                     view.one_rad * kDegreesPerRad,
                     view.other_rad * kDegreesPerRad,
                     view.cut ? ", cut by the domain" : "");
}

std::string textOf(const LoadedCalibration& calibration, const Camera& camera) {
  const Facts facts = factsOf(camera);
  std::string result;
  const auto row = [&](const std::string& name, const std::string& value) {
    result += fmt::format("{:<18}  {}\n", name, value);
  };
  row("format", calibration.format);
  row("pixels in the file", calibration.pixel_convention);
  row("model", std::string(camera.modelName()));
  row("size", fmt::format("{} x {} px", camera.width(), camera.height()));
  const std::vector<double> params = camera.params();
  for (size_t i = 0; i < params.size(); ++i) {
    const ParamSpec& spec = camera.paramSpecs()[i];
    row(std::string(spec.name),
        fmt::format(
            "{}{}{}", params[i], spec.unit == "1" ? "" : " ", spec.unit == "1" ? "" : spec.unit));
  }
  const Vector2d& c = facts.principal_px;
  row("principal point",
      fmt::format("({}, {}) if (0, 0) is the centre of the top left pixel, as everywhere in dlsd",
                  c.x(),
                  c.y()));
  row("", fmt::format("({}, {}) if (0, 0) is its corner", c.x() + 0.5, c.y() + 0.5));
  row("domain",
      fmt::format("rays up to {:.4f} deg from the optical axis project{}",
                  camera.maxFieldAngle() * kDegreesPerRad,
                  camera.maxFieldAngleLimit() < M_PI ? " (max_field_angle of the file)" : ""));
  if (facts.horizontal) {
    row("horizontal view", text(*facts.horizontal));
    row("vertical view", text(*facts.vertical));
    row("diagonal view", text(*facts.diagonals[0]));
    row("", text(*facts.diagonals[1]));
  } else {
    row("view", "the principal point is outside the image: no view across it");
  }
  if (facts.circle) {
    const bool round = facts.circle->max_px - facts.circle->min_px < 0.05;
    row("valid circle",
        fmt::format(
            "the domain ends {} px from the principal point, {}",
            round ? fmt::format("{:.2f}", facts.circle->min_px)
                  : fmt::format("{:.2f} to {:.2f}", facts.circle->min_px, facts.circle->max_px),
            facts.circle->complete ? "all around inside the image"
                                   : "in a part of the directions inside the image"));
  }
  if (facts.centre) {
    row("scale",
        fmt::format("{:.3f} x {:.3f} px/deg at the centre",
                    facts.centre->radial,
                    facts.centre->tangential));
  }
  if (facts.rim) {
    row(facts.centre ? "" : "scale",
        fmt::format("{:.3f} px/deg along and {:.3f} px/deg across the meridian at {:.2f} deg, the "
                    "farthest in a corner's direction",
                    facts.rim->radial,
                    facts.rim->tangential,
                    facts.rim->angle_rad * kDegreesPerRad));
  }
  row("pixels with a ray",
      fmt::format("{}/{} {:.2f} %",
                  facts.with_ray,
                  facts.pixels,
                  100 * double(facts.with_ray) / double(facts.pixels)));
  row("conventions",
      fmt::format("image [-0.5, {}] x [-0.5, {}], x right, y down, z forward",
                  camera.width() - 0.5,
                  camera.height() - 0.5));
  return result;
}

ordered_json jsonOf(const NamedCamera& named) {
  const Camera& camera = named.camera;
  const Facts facts = factsOf(camera);
  ordered_json params;
  for (size_t i = 0; i < camera.params().size(); ++i) {
    params[std::string(camera.paramSpecs()[i].name)] = camera.params()[i];
  }
  const auto view = [](const std::optional<View>& v) {
    return v ? ordered_json{{"total_deg", (v->one_rad + v->other_rad) * kDegreesPerRad},
                            {"sides_deg",
                             {v->one_rad * kDegreesPerRad, v->other_rad * kDegreesPerRad}},
                            {"cut_by_domain", v->cut}}
             : ordered_json();
  };
  const auto scale = [](const std::optional<Scale>& s) {
    return s ? ordered_json{{"field_angle_deg", s->angle_rad * kDegreesPerRad},
                            {"radial_px_per_deg", s->radial},
                            {"tangential_px_per_deg", s->tangential}}
             : ordered_json();
  };
  return {{"name", named.name},
          {"model", camera.modelName()},
          {"width", camera.width()},
          {"height", camera.height()},
          {"params", params},
          {"principal_point_px", {facts.principal_px.x(), facts.principal_px.y()}},
          {"max_field_angle_deg", camera.maxFieldAngle() * kDegreesPerRad},
          {"horizontal_view", view(facts.horizontal)},
          {"vertical_view", view(facts.vertical)},
          {"diagonal_views", {view(facts.diagonals[0]), view(facts.diagonals[1])}},
          {"valid_circle",
           facts.circle ? ordered_json{{"min_radius_px", facts.circle->min_px},
                                       {"max_radius_px", facts.circle->max_px},
                                       {"complete", facts.circle->complete}}
                        : ordered_json()},
          {"scale_at_centre", scale(facts.centre)},
          {"scale_at_rim", scale(facts.rim)},
          {"pixels_with_ray", facts.with_ray},
          {"pixels", facts.pixels}};
}

int run(const Arguments& arguments) {
  const LoadedCalibration calibration = loadChosen(arguments.camera);
  if (!arguments.plot.empty()) {
    if (calibration.cameras.size() > 1) {
      (void)loadOne(arguments.camera);  // says which there are
    }
    checkOutputs({calibrationFile(arguments.camera.path)}, {arguments.plot});
    checkPlaceForFile(arguments.plot);
    const NamedCamera& camera = calibration.cameras.front();
    const std::string file =
        std::filesystem::path(calibrationFile(arguments.camera.path)).filename().string();
    writeFileAtomically(arguments.plot,
                        encodePng(drawCamera(camera.camera, file + ":" + camera.name)));
  }
  if (arguments.json) {
    ordered_json cameras = ordered_json::array();
    for (const NamedCamera& camera : calibration.cameras) {
      cameras.push_back(jsonOf(camera));
    }
    print(ordered_json{{"format", "dlsd-camera/1"},
                       {"calibration_format", calibration.format},
                       {"pixel_convention", calibration.pixel_convention},
                       {"cameras", cameras}}
              .dump(1) +
          "\n");
    return kDone;
  }
  std::string result;
  for (const NamedCamera& camera : calibration.cameras) {
    if (calibration.cameras.size() > 1) {
      result += fmt::format("{}== {} ==\n", result.empty() ? "" : "\n", camera.name);
    }
    result += textOf(calibration, camera.camera);
  }
  print(result);
  return kDone;
}

}  // namespace

Run addCameraShow(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  addCameraArgument(command, &arguments->camera);
  command
      .add_option("--plot",
                  arguments->plot,
                  "PNG file for a picture of the field-angle curve and the valid region")
      ->type_name("FILE");
  command.add_flag("--json", arguments->json, "The same as JSON");
  command.footer(
      "Examples:\n"
      "  dlsd camera show wide.yaml\n"
      "  dlsd camera show rig.yaml:cam1 --plot cam1.png\n"
      "  dlsd camera show cameras.txt --format colmap --json");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
