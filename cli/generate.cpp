#include "synth/generate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "cli/camera_commands.h"
#include "cli/command.h"
#include "synth/dataset/verify.h"
#include "synth/scene.h"

namespace dlsd::cli {
namespace {

struct Arguments {
  std::vector<std::string> cameras;
  std::string format;
  std::string shard = "0/1";
  std::string encoding = "linear";
  std::vector<std::string> planes;
  std::string verify;
  std::string config;
  std::vector<std::string> settings;
  bool print_config = false;
  CameraVariety camera_variety;
  GenerateOptions options;
};

constexpr std::string_view kRandom = "random:";

/// Adds the cameras that "random:MODEL" or "random:MODEL:N" stands for.
void addRandomCameras(const std::string& text,
                      const Arguments& arguments,
                      GenerateOptions* options) {
  std::string model = text.substr(kRandom.size());
  int count = 8;
  const size_t colon = model.find(':');
  if (colon != std::string::npos) {
    const char* end = model.data() + model.size();
    const auto number = std::from_chars(model.data() + colon + 1, end, count);
    if (number.ec != std::errc() || number.ptr != end || count < 1 || count > 10000) {
      throw InputError("--camera is \"" + text +
                       "\", allowed is random:MODEL:N with N from 1 to 10000");
    }
    model.resize(colon);
  }
  const auto& models = randomCameraModels();
  if (std::find(models.begin(), models.end(), model) == models.end()) {
    throw InputError(
        fmt::format("--camera is \"{}\", allowed models are {}", text, fmt::join(models, ", ")));
  }
  for (int k = 0; k < count; ++k) {
    options->cameras.emplace_back(
        fmt::format("random-{}-{}", model, k),
        drawCamera(model, arguments.camera_variety, options->seed, static_cast<uint64_t>(k)));
  }
}

/// The name of a camera in the dataset: the file's stem, and the camera's name too if one is
/// chosen; what names may not have becomes '_'.
std::string nameOf(const std::string& path_and_camera) {
  const std::string file = calibrationFile(path_and_camera);
  std::string name = std::filesystem::path(file).stem().string();
  if (file != path_and_camera) {
    name += "-" + path_and_camera.substr(file.size() + 1);
  }
  std::replace_if(
      name.begin(),
      name.end(),
      [](unsigned char c) { return c >= 0x80 || !(std::isalnum(c) || c == '_' || c == '-'); },
      '_');
  return name;
}

void readShard(const std::string& text, GenerateOptions* options) {
  const char* end = text.data() + text.size();
  const auto index = std::from_chars(text.data(), end, options->shard_index);
  if (index.ec == std::errc() && index.ptr != end && *index.ptr == '/') {
    const auto count = std::from_chars(index.ptr + 1, end, options->shard_count);
    if (count.ec == std::errc() && count.ptr == end) {
      return;
    }
  }
  throw InputError("--shard is \"" + text + "\", allowed is i/n as in 0/4, with i from 0 to n - 1");
}

int verify(const std::string& folder) {
  std::optional<Progress> progress;
  const DatasetCheck check = verifyDataset(folder, [&](size_t done, size_t total) {
    if (!progress) progress.emplace("frames", total);
    progress->done(done);
  });
  progress.reset();
  for (const std::string& problem : check.problems) print(problem + "\n");
  if (check.unfinished && check.named == 0) {
    complain(folder + ": not finished yet, the dlsd generate that began it goes on from there");
    return kCheckFailed;
  }
  print(fmt::format("{}: {} of {} frames are whole\n", folder, check.whole, check.named));
  if (check.problems.empty()) return kDone;
  complain(fmt::format("{}: {} wrong, the dlsd generate that made it makes it whole again",
                       folder,
                       check.problems.size() == 1
                           ? "1 thing is"
                           : fmt::format("{} things are", check.problems.size())));
  return kCheckFailed;
}

int run(Arguments& arguments) {
  GenerateOptions& options = arguments.options;
  if (!arguments.verify.empty()) return verify(arguments.verify);
  if (!arguments.config.empty()) {
    readVariety(arguments.config, &options.variety, &arguments.camera_variety);
  }
  for (const std::string& setting : arguments.settings) {
    setVariety(setting, &options.variety, &arguments.camera_variety);
  }
  if (arguments.print_config) {
    const nlohmann::ordered_json config{{"scene", toJson(options.variety)},
                                        {"camera", toJson(arguments.camera_variety)}};
    print(config.dump(2) + "\n");
    return kDone;
  }
  for (const auto& [name, given] :
       {std::pair("--camera", !arguments.cameras.empty()), {"--out", !options.out.empty()}}) {
    if (!given) throw InputError(std::string(name) + " is required");
  }
  std::set<std::string> names;
  for (const std::string& path : arguments.cameras) {
    if (path.starts_with(kRandom)) {
      addRandomCameras(path, arguments, &options);
      continue;
    }
    options.cameras.emplace_back(nameOf(path), loadCamera(path, arguments.format));
    if (!names.insert(options.cameras.back().first).second) {
      throw InputError("--camera " + path + ": another camera is named \"" +
                       options.cameras.back().first + "\" too, rename one of the files");
    }
  }
  readShard(arguments.shard, &options);
  options.sensor.encoding = encodingFromName(arguments.encoding).value_or(Encoding::kLinear);
  for (const std::string& name : arguments.planes) {
    options.planes.push_back(planeFromName(name).value_or(PlaneKind::kDepth));
  }
  options.check();
  checkPlaceForFolder(options.out);

  GenerateResult result{};
  {
    const int own = options.count - options.shard_index + options.shard_count - 1;
    Progress progress("frames", size_t(own / options.shard_count));
    const Interruption interruption;
    result = generateDataset(options, [&](const GenerateProgress& p) {
      progress.done(size_t(p.done));
      if (p.done < p.total) {
        interruption.check(fmt::format(
            "{} of {} frames are finished, the same command goes on from there", p.done, p.total));
      }
    });
  }
  print(fmt::format("{}: {} frames, {} made now, {} kept\n",
                    options.out,
                    result.written + result.kept,
                    result.written,
                    result.kept));
  return kDone;
}

}  // namespace

Run addGenerate(CLI::App& command) {
  const auto arguments = std::make_shared<Arguments>();
  GenerateOptions& options = arguments->options;
  command
      .add_option(
          "--camera",
          arguments->cameras,
          fmt::format(
              "Calibration file, or file:camera if it holds several, or random:MODEL:N for N "
              "(8) random ones, of {}; may be repeated: frames go round",
              fmt::join(randomCameraModels(), ", ")))
      ->type_name("FILE")
      ->expected(1)
      ->take_all();
  addCalibrationFormat(command, &arguments->format);
  command.add_option("--out", options.out, "Folder for the dataset")->type_name("DIR");
  command
      .add_option("--config",
                  arguments->config,
                  "JSON file of ranges that scenes and random cameras are drawn from")
      ->type_name("FILE");
  command
      .add_option("--set",
                  arguments->settings,
                  "One of these ranges, as --print-config names it: clutter=4,12; may be repeated")
      ->type_name("NAME=LOW,HIGH")
      ->expected(1)
      ->take_all();
  command.add_flag(
      "--print-config", arguments->print_config, "Print these ranges and do nothing else");
  command
      .add_option("--scene",
                  options.scene,
                  fmt::format("Scene preset: {}", fmt::join(scenePresets(), ", ")))
      ->type_name("NAME")
      ->capture_default_str();
  command.add_option("--count", options.count, "Frames")
      ->transform(wholeNumber(1, 10000000))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "Seed; the same seed gives the same bytes")
      ->transform(wholeNumber<uint64_t>(0, UINT64_MAX))
      ->capture_default_str();
  command
      .add_option(
          "--noise", options.sensor.read_noise_levels, "Noise, standard deviation in grey levels")
      ->capture_default_str();
  command
      .add_option("--psf", options.sensor.psf_sigma_px, "Optical blur, standard deviation in px")
      ->capture_default_str();
  command
      .add_option("--defocus",
                  options.sensor.defocus_radius_px,
                  "Blur of an unfocused lens, radius of its disc in px")
      ->capture_default_str();
  command
      .add_option("--vignetting",
                  options.sensor.vignetting,
                  "Share of the light lost in the image's corners, 0 to 1")
      ->capture_default_str();
  command.add_option("--exposure", options.sensor.exposure, "Factor on the light")
      ->capture_default_str();
  command
      .add_option("--full-well",
                  options.sensor.full_well_electrons,
                  "Electrons that make a pixel white, for shot noise; 0: none")
      ->capture_default_str();
  command
      .add_option("--shot-seed",
                  options.sensor.shot_noise_seed,
                  "Another one: other shot noise on the same pictures")
      ->transform(wholeNumber<uint64_t>(0, UINT64_MAX))
      ->capture_default_str();
  command.add_option("--noise-seed", options.sensor.read_noise_seed, "The same for --noise")
      ->transform(wholeNumber<uint64_t>(0, UINT64_MAX))
      ->capture_default_str();
  command
      .add_option(
          "--encoding", arguments->encoding, "Light to grey levels: linear, srgb or gamma (2.2)")
      ->type_name("NAME")
      ->capture_default_str()
      ->check(CLI::IsMember({"linear", "srgb", "gamma"}));
  command.add_option("--bits", options.sensor.bits, "Of the images: 8 or 16")
      ->check(CLI::IsMember({8, 16}))
      ->capture_default_str();
  command
      .add_option("--planes",
                  arguments->planes,
                  fmt::format("Per-pixel ground truth to write besides, as .npy, with commas: {}",
                              fmt::join(planeNames(), ", ")))
      ->type_name("NAMES")
      ->delimiter(',')
      ->check(CLI::IsMember(planeNames()));
  command.add_option("--jobs", options.jobs, "Threads; 0: one per core")
      ->transform(wholeNumber(0, 1024))
      ->capture_default_str();
  command
      .add_option("--shard", arguments->shard, "i/n: make only the frames with number mod n = i")
      ->type_name("I/N");
  command
      .add_option("--verify",
                  arguments->verify,
                  "Make nothing: check that every file of this dataset is there and unchanged")
      ->type_name("DIR")
      ->excludes("--camera")
      ->excludes("--format")
      ->excludes("--out");
  command.footer(
      "Examples:\n"
      "  dlsd generate --camera wide.yaml --count 100 --out data\n"
      "  dlsd generate --camera rig.yaml:cam0 --camera rig.yaml:cam1 --scene paper --noise 2 --out "
      "data\n"
      "  dlsd generate --camera random:kb:50 --config ranges.json --scene corridor --count 500 "
      "--out "
      "data\n"
      "  dlsd generate --camera wide.yaml --scene polyhedra --set distractors=2,6 --set wood=0.3 "
      "--out data\n"
      "  dlsd generate --camera wide.yaml --planes depth,normal,df --out data\n"
      "  dlsd generate --camera wide.yaml --count 1000 --shard 0/4 --out data   (and 1/4, 2/4, "
      "3/4)\n"
      "  dlsd generate --verify data   (exit code 1 and what is wrong, if anything is)");
  return [arguments] { return run(*arguments); };
}

}  // namespace dlsd::cli
