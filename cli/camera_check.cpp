#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/App.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "cameras/batch.h"
#include "cameras/calibration/files.h"
#include "cli/camera_commands.h"
#include "cli/camera_straightness.h"
#include "synth/dataset/image.h"

namespace dlsd::cli {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Arguments {
  CameraArgument camera;
  std::vector<std::string> images;
  double max_px = 1e-6;
};

struct Worst {
  double value = 0;
  Vector2d at_px{0, 0};

  void add(double candidate, const Vector2d& at) {
    if (!(candidate <= value)) {  // what is not a number, too
      value = candidate;
      at_px = at;
    }
  }
};

struct RoundTrip {
  size_t pixels = 0, with_ray = 0;
  size_t broken = 0;  ///< Pixels with a ray that does not project, or not finite, or comes back so.
  size_t folded = 0;  ///< Pixels where the Jacobian's determinant is not positive.
  Worst pixel_px, ray_rad, ray_px;      ///< ray_px: ray_rad in px at its place.
  double min_scale = 0, max_scale = 0;  ///< px per rad, singular values of the Jacobian.
};

RoundTrip roundTrip(const Camera& camera) {
  RoundTrip result;
  const auto width = size_t(camera.width());
  std::vector<double> u(width), v(width), x(width), y(width), z(width), pu(width), pv(width);
  std::vector<double> x2(width), y2(width), z2(width);
  std::vector<uint8_t> has_ray(width), projects(width), returns(width);
  for (size_t i = 0; i < width; ++i) {
    u[i] = double(i);
  }
  for (int row = 0; row < camera.height(); ++row) {
    std::fill(v.begin(), v.end(), double(row));
    unprojectAll(camera, u, v, x, y, z, has_ray);
    projectAll(camera, x, y, z, pu, pv, projects);
    unprojectAll(camera, pu, pv, x2, y2, z2, returns);
    for (size_t i = 0; i < width; ++i) {
      ++result.pixels;
      if (has_ray[i] == 0) {
        continue;
      }
      ++result.with_ray;
      const Vector2d pixel(u[i], v[i]), back(pu[i], pv[i]);
      const Vector3d ray(x[i], y[i], z[i]), ray_back(x2[i], y2[i], z2[i]);
      const std::optional<ProjectionJacobian> jacobian = camera.jacobian(ray);
      if (projects[i] == 0 || returns[i] == 0 || !jacobian || !ray.allFinite() ||
          !back.allFinite() || !ray_back.allFinite()) {
        ++result.broken;
        continue;
      }
      // Orientation: u to the right and v down see z forward.
      const Vector3d ju = jacobian->row(0), jv = jacobian->row(1);
      const double determinant = ju.cross(jv).dot(ray);
      result.folded += determinant > 0 ? 0 : 1;
      const double uu = ju.squaredNorm(), vv = jv.squaredNorm(), uv = ju.dot(jv);
      const double middle = (uu + vv) / 2, apart = std::hypot((uu - vv) / 2, uv);
      const double larger = std::sqrt(middle + apart);
      const double smaller = std::abs(determinant) / larger;
      result.min_scale = result.with_ray == 1 ? smaller : std::min(result.min_scale, smaller);
      result.max_scale = std::max(result.max_scale, larger);
      const double angle = std::atan2(ray.cross(ray_back).norm(), ray.dot(ray_back));
      result.pixel_px.add((back - pixel).norm(), pixel);
      result.ray_rad.add(angle, pixel);
      result.ray_px.add(angle * larger, pixel);
    }
  }
  return result;
}

/// Whether the image is a radial curve about the image of the axis, but for a little tangential
/// distortion. A panorama's meridians are no such curves.
bool isRadial(const Camera& camera) {
  return !std::holds_alternative<Equirectangular>(camera.model());
}

/// The first place, walking outwards from the image of the axis, where the field angle of a radial
/// camera does not rise.
struct Turn {
  Vector2d at_px{0, 0};
  double angle_rad = 0;
};
std::optional<Turn> firstTurn(const Camera& camera) {
  constexpr int kDirections = 64, kSteps = 2000;
  const std::optional<Vector2d> centre = camera.project(Vector3d::UnitZ());
  if (!centre) {
    return std::nullopt;
  }
  const double reach = std::hypot(camera.width(), camera.height());
  for (int i = 0; i < kDirections; ++i) {
    const double a = 2 * M_PI * i / kDirections;
    double before = -1;
    for (int k = 0; k <= kSteps; ++k) {
      const Vector2d pixel = *centre + reach * k / kSteps * Vector2d(std::cos(a), std::sin(a));
      const std::optional<Vector3d> ray = camera.unproject(pixel);
      if (!ray || !camera.inImage(pixel)) {
        break;
      }
      const double angle = fieldAngle(*ray);
      if (!(angle > before)) {
        return Turn{pixel, angle};
      }
      before = angle;
    }
  }
  return std::nullopt;
}

std::string textOf(const Straightness& s) {
  std::string text = fmt::format(
      "\n{} image{}: {} lines, {:.0f} px together, the longest {:.0f} px\n\n"
      "field angle   lines      px   rms px  median px   bulge of 100 px, px\n",
      s.images,
      s.images == 1 ? "" : "s",
      s.lines,
      s.length_px,
      s.longest_px);
  for (const StraightnessBand& band : s.bands) {
    text += fmt::format("{:>3.0f} - {:<3.0f} deg {:>6} {:>7.0f}",
                        band.from_rad * kDegreesPerRad,
                        band.to_rad * kDegreesPerRad,
                        band.lines,
                        band.length_px);
    if (band.lines > 0) {
      text += fmt::format("   {:>6.3f}     {:>6.3f}", band.rms_px, band.median_px);
    }
    if (band.lines > 2) {
      text += fmt::format("   {:>+7.3f} +- {:.3f}{}",
                          band.bulge.mean_px,
                          band.bulge.sigma_px,
                          std::abs(band.bulge.mean_px) > 3 * band.bulge.sigma_px
                              ? (band.bulge.mean_px > 0 ? "  outwards" : "  inwards")
                              : "");
    }
    text += "\n";
  }
  if (s.trials.empty()) {
    return text + "\nstraightness: no lines, no verdict\n";
  }
  const double at = s.reference_rad * kDegreesPerRad;
  text += fmt::format(
      "\nradius at {:.0f} deg changed by   length of a point's line   against the calibration\n",
      at);
  for (const StraightnessTrial& trial : s.trials) {
    text += fmt::format("{:>+23g} px   {:>21.1f} px", trial.radius_px, trial.mean_length_px);
    if (trial.radius_px != 0) {
      text += fmt::format("   {:>+9.1f} +- {:.1f} %", 100 * trial.gain, 100 * trial.gain_sigma);
    }
    text += "\n";
  }
  const std::string bulge = fmt::format(
      "100 px of an edge bulge by {:+.3f} +- {:.3f} px", s.bulge.mean_px, s.bulge.sigma_px);
  text += "\nstraightness: ";
  switch (s.verdict) {
    case Straightness::Verdict::kConsistent:
      text += "consistent with the calibration; " + bulge;
      if (s.shows_below_px || s.shows_above_px) {
        std::vector<std::string> shows;
        for (const auto& px : {s.shows_below_px, s.shows_above_px}) {
          if (px) {
            shows.push_back(fmt::format("{:+g} px", *px));
          }
        }
        text +=
            fmt::format("; lines get shorter with {} at {:.0f} deg", fmt::join(shows, " and "), at);
      }
      break;
    case Straightness::Verdict::kOff:
      text += fmt::format("the calibration is off; {}: the radius should be {} towards the rim",
                          bulge,
                          s.bulge.mean_px > 0 ? "smaller" : "larger");
      if (s.best_px != 0) {
        text += fmt::format("; lines are longest with {:+g} px at {:.0f} deg", s.best_px, at);
      }
      break;
    case Straightness::Verdict::kUndecided:
      text += "no verdict, these lines do not tell; " + bulge;
      if (s.only_beyond_rad) {
        text += fmt::format(
            "; only those beyond {:.0f} deg are bowed: if the lens ends there, a max_field_angle "
            "in "
            "the calibration says so",
            *s.only_beyond_rad * kDegreesPerRad);
      }
      break;
  }
  text += "\n";
  return text;
}

int run(const Arguments& arguments) {
  if (!(arguments.max_px >= 0)) {
    throw InputError(fmt::format("--max-px is {}, allowed is a number >= 0", arguments.max_px));
  }
  const LoadedCalibration calibration = loadChosen(arguments.camera);
  if (!arguments.images.empty() && calibration.cameras.size() > 1) {
    (void)loadOne(arguments.camera);  // says which there are
  }
  std::vector<Image> images;
  for (const std::string& path : arguments.images) {
    const Camera& camera = calibration.cameras.front().camera;
    images.push_back(readImage(path));
    if (images.back().width != camera.width() || images.back().height != camera.height()) {
      throw InputError(fmt::format("{}: is {}x{} px, the camera is {}x{} px",
                                   path,
                                   images.back().width,
                                   images.back().height,
                                   camera.width(),
                                   camera.height()));
    }
    for (size_t i = 0; i + 1 < images.size(); ++i) {
      if (images[i].bytes == images.back().bytes) {
        throw InputError(fmt::format(
            "{}: is the same picture as {}, which would count twice", path, arguments.images[i]));
      }
    }
  }

  std::string text;
  std::vector<std::string> complaints;
  for (const NamedCamera& named : calibration.cameras) {
    const Camera& camera = named.camera;
    if (calibration.cameras.size() > 1) {
      text += fmt::format("{}== {} ==\n", text.empty() ? "" : "\n", named.name);
    }
    const auto row = [&](const std::string& name, const std::string& value) {
      text += fmt::format("{:<22}  {}\n", name, value);
    };
    const RoundTrip trip = roundTrip(camera);
    const bool radial = isRadial(camera);
    const std::optional<Turn> turn = radial ? firstTurn(camera) : std::nullopt;
    const auto place = [](const Worst& worst) {
      return fmt::format("({}, {})", worst.at_px.x(), worst.at_px.y());
    };
    row("model",
        fmt::format("{}, {} x {} px", camera.modelName(), camera.width(), camera.height()));
    row("pixel -> ray -> pixel",
        fmt::format("{:.2g} px at worst, at {}", trip.pixel_px.value, place(trip.pixel_px)));
    row("ray -> pixel -> ray",
        fmt::format("{:.2g} rad at worst, at {}; in the image at most {:.2g} px",
                    trip.ray_rad.value,
                    place(trip.ray_rad),
                    trip.ray_px.value));
    row("pixels without a ray",
        fmt::format("{}/{} {:.2f} %",
                    trip.pixels - trip.with_ray,
                    trip.pixels,
                    100 * double(trip.pixels - trip.with_ray) / double(trip.pixels)));
    row("rays that do not return", fmt::format("{}/{}", trip.broken, trip.with_ray));
    row("radial curve",
        turn      ? fmt::format("does not rise at ({:.1f}, {:.1f}), {:.2f} deg",
                           turn->at_px.x(),
                           turn->at_px.y(),
                           turn->angle_rad * kDegreesPerRad)
        : !radial ? "none: a panorama is not radial; the determinant below tells of folds"
                  : "the field angle rises from the principal point to the border or rim");
    row("Jacobian",
        fmt::format("determinant not positive at {}/{} pixels; {:.3f} ... {:.3f} px/deg",
                    trip.folded,
                    trip.with_ray,
                    trip.min_scale / kDegreesPerRad,
                    trip.max_scale / kDegreesPerRad));
    std::vector<std::string> failures;
    if (!(trip.pixel_px.value <= arguments.max_px && trip.ray_px.value <= arguments.max_px)) {
      failures.push_back(fmt::format("the round trip is worse than {:g} px", arguments.max_px));
    }
    if (trip.with_ray == 0) {
      failures.emplace_back("no pixel has a ray");
    }
    if (trip.broken > 0) {
      failures.emplace_back("rays do not return");
    }
    if (turn || trip.folded > 0) {
      failures.emplace_back("the image folds");
    }
    row("check",
        failures.empty() ? fmt::format("passed: at most {:g} px", arguments.max_px)
                         : fmt::format("failed: {}", fmt::join(failures, ", ")));
    if (!failures.empty()) {
      complaints.push_back(
          fmt::format("{} ({}): {}", arguments.camera.path, named.name, fmt::join(failures, ", ")));
    }
  }
  if (!images.empty()) {
    StraightnessCheck check(calibration.cameras.front().camera);
    for (const Image& image : images) {
      check.add(image);
    }
    text += textOf(check.result());
  }
  print(text);
  for (const std::string& complaint : complaints) {
    complain(complaint);
  }
  return complaints.empty() ? kDone : kCheckFailed;
}

}  // namespace

Run addCameraCheck(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  addCameraArgument(command, &arguments->camera);
  command
      .add_option(
          "--image", arguments->images, "Photograph by the camera, with straight things in it")
      ->type_name("FILE")
      ->expected(1)
      ->take_all();
  command
      .add_option("--max-px", arguments->max_px, "Exit with 1 if the round trip is worse than this")
      ->type_name("PX")
      ->capture_default_str();
  command.footer(
      "Examples:\n"
      "  dlsd camera check wide.yaml\n"
      "  dlsd camera check rig.yaml --max-px 1e-9\n"
      "  dlsd camera check rig.yaml:cam0 --image a.png --image b.png");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
