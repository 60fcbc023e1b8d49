// The detector against its goals. Four modes, each prints a table (bench/README.md):
//
//   time        detector, floor and peers on the same generated frames, taking turns
//   quality     found, right, fragments, localisation, normals on datasets of `dlsd generate`
//   efficiency  one isolated line over repeated noise against the Cramer-Rao bound
//   alarms      pure noise, discs and spheres

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <functional>
#include <map>
#include <opencv2/imgproc.hpp>
#include <opencv2/ximgproc/edge_drawing.hpp>
#include <opencv2/ximgproc/fast_line_detector.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/test_images.h"
#include "cameras/calibration/calibration.h"
#include "cameras/rectification.h"
#include "detector/detector.h"
#include "evaluation/dataset_evaluation.h"
#include "evaluation/detections.h"
#include "evaluation/normal_bound.h"
#include "evaluation/peers/peers.h"
#include "evaluation/summary.h"
#include "synth/dataset/dataset.h"
#include "synth/generate.h"

namespace dlsd {
namespace {

constexpr const char* kCameras[] = {"pinhole_90", "tum_mono_wide", "fisheye_180", "catadioptric"};
constexpr const char* kScenes[] = {"paper", "room"};

Camera cameraOf(const std::string& name) {
  return loadCamera(DLSD_SOURCE_DIR "/fixtures/calibrations/" + name + ".yaml");
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nan("");
  const auto at = values.begin() + static_cast<ptrdiff_t>(q * double(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// ---------------------------------------------------------------------------------------- time

double cpuMs() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * double(now.tv_sec) + 1e-6 * double(now.tv_nsec);
}

/// Something that is run on an image, all buffers its own.
struct Contestant {
  std::string name;
  std::function<void(const Image&)> run;
};

cv::Mat matOf(const Image& image) {
  return {image.height, image.width, CV_8U, const_cast<uint8_t*>(image.bytes.data())};
}

/// OpenCV's 5 x 5 blur and two 16-bit Sobels, the yardstick.
Contestant floorContestant() {
  return {"floor",
          [smooth = cv::Mat(), dx = cv::Mat(), dy = cv::Mat()](const Image& image) mutable {
            cv::GaussianBlur(matOf(image), smooth, {5, 5}, 1);
            cv::Sobel(smooth, dx, CV_16S, 1, 0);
            cv::Sobel(smooth, dy, CV_16S, 0, 1);
          }};
}

std::vector<std::pair<std::string, std::function<void(const cv::Mat&)>>> peers() {
  std::vector<cv::Vec4f> lines;
  return {
      {"lsd",
       [lsd = cv::createLineSegmentDetector(), lines](const cv::Mat& grey) mutable {
         lsd->detect(grey, lines);
       }},
      {"edlines",
       [ed = cv::ximgproc::createEdgeDrawing(), lines](const cv::Mat& grey) mutable {
         ed->detectEdges(grey);
         ed->detectLines(lines);
       }},
      {"fld", [fld = cv::ximgproc::createFastLineDetector(), lines](const cv::Mat& grey) mutable {
         fld->detect(grey, lines);
       }}};
}

int printTimes(int rounds, const std::string& only_camera, bool with_peers) {
  constexpr int kFrames = 8;
  cv::setNumThreads(1);
  fmt::print("median over {} interleaved frames of CPU time / floor\n", rounds * kFrames);
  for (const std::string scene : kScenes) {
    for (const std::string camera_name : kCameras) {
      if (!only_camera.empty() && only_camera != camera_name) continue;
      const Camera camera = cameraOf(camera_name);
      GenerateOptions options;
      options.cameras = {{camera_name, camera}};
      options.scene = scene;
      options.sensor.read_noise_levels = 2;
      std::vector<Image> frames;
      for (uint64_t i = 0; i < kFrames; ++i) frames.push_back(renderFrame(options, 20 * i).image);

      std::vector<Contestant> all{floorContestant()};
      std::vector<std::unique_ptr<Detector>> detectors;
      for (const std::string& name : builtinDetectors()) {
        detectors.push_back(std::make_unique<Detector>(camera, builtinOptions(name)));
        all.push_back({name, [detector = detectors.back().get()](const Image& image) {
                         (void)detector->detect(viewOf(image));
                       }});
      }
      const auto others = with_peers ? peers() : decltype(peers()){};
      for (const auto& [name, run] : others) {
        all.push_back({name + " raw", [run = run](const Image& image) { run(matOf(image)); }});
      }
      const Crop crop = cropView(camera,
                                 {.kind = ViewKind::kPinhole,
                                  .width = camera.width(),
                                  .height = camera.height(),
                                  .fov_rad = kPeerMaxFieldRad});
      ViewMaps maps = viewMaps(camera, crop.view.value());
      const cv::Mat u(maps.height, maps.width, CV_32F, maps.u.data());
      const cv::Mat v(maps.height, maps.width, CV_32F, maps.v.data());
      const auto rectified = std::make_shared<cv::Mat>();
      if (with_peers) {
        all.push_back({"rectification", [rectified, u, v](const Image& image) {
                         cv::remap(matOf(image), *rectified, u, v, cv::INTER_LINEAR);
                       }});
      }
      for (const auto& [name, run] : others) {
        all.push_back(
            {name + " rectified", [run = run, rectified](const Image&) { run(*rectified); }});
      }

      std::vector<std::vector<double>> ratios(all.size());
      std::vector<double> floor_ms;
      StageTimes sum{};
      for (int round = -1; round < rounds; ++round) {
        for (const Image& image : frames) {
          double floor = 0;
          for (size_t k = 0; k < all.size(); ++k) {
            const double start = cpuMs();
            all[k].run(image);
            const double ms = cpuMs() - start;
            if (k == 0) floor = ms;
            if (round < 0) continue;
            ratios[k].push_back(ms / floor);
            if (k == 0) floor_ms.push_back(ms);
          }
          const StageTimes& t = detectors[0]->times();
          if (round < 0) continue;
          sum.gradient += t.gradient;
          sum.linking += t.linking;
          sum.planes += t.planes;
          sum.validation += t.validation;
          sum.total += t.total;
        }
      }
      fmt::print("{:<6} {:<14} floor {:.2f} ms", scene, camera_name, quantile(floor_ms, 0.5));
      for (size_t k = 1; k < all.size(); ++k) {
        fmt::print("{} {} {:.2f}", k == 1 ? ":" : ",", all[k].name, quantile(ratios[k], 0.5));
      }
      fmt::print(
          "\n       dlsd by stage: crests {:.0f}, linking {:.0f}, planes {:.0f}, tracing {:.0f} "
          "%\n",
          100 * sum.gradient / sum.total,
          100 * sum.linking / sum.total,
          100 * sum.planes / sum.total,
          100 * sum.validation / sum.total);
      std::fflush(stdout);
    }
  }
  return 0;
}

// ------------------------------------------------------------------------------------- quality

/// What the table says of one detector on the frames of one camera, or of all.
struct Quality {
  std::array<Ratio, kStratumCount> found;  // at the first rho
  Ratio right_long, right_long_4, fragments;
  double sum2_px2 = 0;
  long samples = 0;
  std::vector<double> normal_deg, over_bound;
  std::vector<double> towards_bright_px, towards_x_px, towards_y_px;

  void add(const FrameEvaluation& frame, const Camera& camera, const EvaluationOptions& options) {
    const FrameOutcome& outcome = frame.outcome;
    for (size_t i = 0; i < outcome.strata.size(); ++i) {
      found[size_t(outcome.strata[i])] += {outcome.labels[0][i].found, 1};
      if (outcome.strata[i] != Stratum::kHeadline || !outcome.errors[i]) continue;
      const LabelErrors& errors = *outcome.errors[i];
      sum2_px2 += errors.sum2_px2;
      samples += errors.samples;
      if (errors.normal_rad && frame.labels.lines[i].angle_rad >= 20 * M_PI / 180) {
        normal_deg.push_back(*errors.normal_rad * 180 / M_PI);
      }
      if (errors.normal_sigmas) over_bound.push_back(errors.normal_sigmas->angle);
      addBias(camera,
              frame.labels.lines[i],
              frame.detections.lines[size_t(outcome.labels.back()[i].detection)]);
    }
    for (size_t i = 0; i < outcome.run_strata.size(); ++i) {
      const RunOutcome& run = outcome.runs[0][i];
      if (run.found && outcome.run_strata[i] == Stratum::kHeadline) {
        fragments += {run.fragments, 1};
      }
    }
    for (size_t i = 0; i < outcome.detection_angle_rad.size(); ++i) {
      if (outcome.detection_angle_rad[i] < options.headline_angle_rad) continue;
      right_long += {outcome.detections.front()[i].right, 1};
      right_long_4 += {outcome.detections.back()[i].right, 1};
    }
  }

  /// From the label's middle to the detected curve.
  void addBias(const Camera& camera, const LabelLine& label, const DetectionLine& detection) {
    if (!detection.normal) return;
    const Eigen::Vector3d ray =
        (label.points_in_cam[0].normalized() + label.points_in_cam[1].normalized()).normalized();
    const Eigen::Vector3d foot =
        (ray - ray.dot(*detection.normal) * *detection.normal).normalized();
    const auto from = camera.project(ray), to = camera.project(foot);
    if (!from || !to || !((*to - *from).norm() <= 1)) return;
    const Eigen::Vector2d shift = *to - *from;
    towards_x_px.push_back(shift.x());
    towards_y_px.push_back(shift.y());
    if (detection.polarity) {
      const double sign = *detection.polarity * ray.dot(*detection.normal) > 0 ? -1 : 1;
      towards_bright_px.push_back(sign * shift.norm());
    }
  }

  Quality& operator+=(const Quality& other) {
    for (size_t s = 0; s < kStratumCount; ++s) found[s] += other.found[s];
    right_long += other.right_long;
    right_long_4 += other.right_long_4;
    fragments += other.fragments;
    sum2_px2 += other.sum2_px2;
    samples += other.samples;
    const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(normal_deg, other.normal_deg);
    append(over_bound, other.over_bound);
    append(towards_bright_px, other.towards_bright_px);
    append(towards_x_px, other.towards_x_px);
    append(towards_y_px, other.towards_y_px);
    return *this;
  }
};

void printQuality(const std::string& name, const Quality& q) {
  const auto percent = [](const Ratio& ratio) {
    return ratio.total == 0
               ? std::string("-")
               : fmt::format("{:.1f}", 100.0 * double(ratio.counted) / double(ratio.total));
  };
  // A robust mean: of the middle 90 %, which single mismatches do not move.
  const auto bias = [](std::vector<double> values) {
    if (values.empty()) return std::nan("");
    std::sort(values.begin(), values.end());
    const size_t cut = values.size() / 20;
    double sum = 0;
    for (size_t i = cut; i < values.size() - cut; ++i) sum += values[i];
    return sum / double(values.size() - 2 * cut);
  };
  fmt::print(
      "{:<24} {:>5} {:>5} {:>5} {:>5} of {:<5} {:>5} {:>5} {:>5.2f} {:>6.3f} {:>6.3f} {:>6.3f} "
      "{:>6.3f} {:>7.4f} {:>5.1f}\n",
      name,
      percent(q.found[size_t(Stratum::kHeadline)]),
      percent(q.found[size_t(Stratum::kCrowded)]),
      percent(q.found[size_t(Stratum::kShort)]),
      percent(q.found[size_t(Stratum::kFaint)]),
      q.found[size_t(Stratum::kHeadline)].total,
      percent(q.right_long),
      percent(q.right_long_4),
      double(q.fragments.counted) / double(q.fragments.total),
      std::sqrt(q.sum2_px2 / double(q.samples)),
      bias(q.towards_bright_px),
      bias(q.towards_x_px),
      bias(q.towards_y_px),
      quantile(q.normal_deg, 0.9),
      quantile(q.over_bound, 0.9));
}

int printQualities(const std::vector<std::string>& folders, bool with_peers) {
  fmt::print(
      "found at rho = 1 px in % (headline, crowded, short, faint; of so many headline labels), "
      "right at 1 and 4 px in % of the detections >= 5 deg,\nfragments per found run, RMS px, bias "
      "px (towards the brighter side, x, y), p90 of the normal's error >= 20 deg, the same over "
      "the "
      "Cramer-Rao bound\n");
  for (const std::string& folder : folders) {
    const Dataset dataset(folder);
    const EvaluationOptions options;
    std::vector<std::pair<std::string, DetectionSource>> sources;
    sources.emplace_back("dlsd", detectionsOfDetector(dataset, "dlsd"));
    if (with_peers) {
      sources.emplace_back("dlsd-paper", detectionsOfDetector(dataset, "dlsd-paper"));
      for (const std::string& peer : peerDetectors()) {
        sources.emplace_back(peer, detectionsOfPeer(dataset, peer));
      }
    }
    fmt::print("{}\n", folder);
    for (const auto& [name, source] : sources) {
      std::map<std::string, Quality> by_camera;
      evaluateFrames(dataset, source, options, 0, [&](FrameEvaluation&& frame) {
        by_camera[cameraName(frame.labels)].add(frame, dataset.camera(frame.labels), options);
      });
      Quality all;
      for (const auto& [camera, quality] : by_camera) {
        if (name == "dlsd") printQuality("  " + name + " " + camera, quality);
        all += quality;
      }
      printQuality("  " + name + " all", all);
      std::fflush(stdout);
    }
  }
  return 0;
}

// ---------------------------------------------------------------------------------- efficiency

int printEfficiency(int repeats) {
  fmt::print(
      "isolated lines over {} noises each: root mean square error over the bound of offset "
      "and angle,\nbias px towards the brighter side, found, offset in the detector's own standard "
      "deviations\n",
      repeats);
  struct Case {
    double length_px, contrast, noise, blur_px;
  };
  std::vector<Case> cases;
  for (const double blur : {0.0, 0.7, 1.0, 1.5}) {
    for (const auto& [contrast, noise] :
         {std::pair{20., 2.}, {20., 8.}, {60., 4.}, {150., 2.}, {150., 8.}}) {
      for (const double length : {60.0, 120.0, 300.0})
        cases.push_back({length, contrast, noise, blur});
    }
  }
  std::vector<double> offset_ratios, angle_ratios;
  for (const bool distorted : {false, true}) {
    for (const bool corners : {true, false}) {
      for (const Case& c : cases) {
        bench::LineErrors sum;
        for (int i = 0; i < repeats; ++i) {
          sum += bench::detectIsolatedLine({.length_px = c.length_px,
                                            .contrast = c.contrast,
                                            .noise = c.noise,
                                            .blur_px = c.blur_px,
                                            .distorted = distorted,
                                            .has_corners = corners},
                                           static_cast<uint64_t>(i));
        }
        const double offset = sum.offsetInBounds(), angle = sum.angleInBounds();
        if (c.blur_px > 0) {
          offset_ratios.push_back(offset);
          angle_ratios.push_back(angle);
        }
        fmt::print(
            "{} {} length {:>3.0f} contrast {:>3.0f} noise {:.0f} blur {:.1f}: offset {:.2f} "
            "angle {:.2f} bias {:+.4f} found {}/{} own {:.2f}\n",
            distorted ? "distorted" : "straight ",
            corners ? "square" : "border",
            c.length_px,
            c.contrast,
            c.noise,
            c.blur_px,
            offset,
            angle,
            sum.biasPx(),
            sum.found,
            sum.tried,
            sum.ownSigmas());
        std::fflush(stdout);
      }
    }
  }
  fmt::print(
      "blur >= 0.7: offset median {:.2f}, largest {:.2f}; angle median {:.2f}, largest {:.2f}\n",
      quantile(offset_ratios, 0.5),
      quantile(offset_ratios, 1),
      quantile(angle_ratios, 0.5),
      quantile(angle_ratios, 1));
  return 0;
}

// -------------------------------------------------------------------------------------- alarms

int printAlarms(int images) {
  const Camera camera = cameraOf("tum_mono_wide");
  Detector detector(camera);
  fmt::print("pure noise, {} images each: lines per image, most in one, >= 40 px per image\n",
             images);
  for (const double blur : {0.0, 0.7, 1.0, 1.5}) {
    for (const double sigma : {0.5, 2.0, 8.0, 20.0, 40.0}) {
      size_t lines = 0, most = 0, longer = 0;
      for (int i = 0; i < images; ++i) {
        const auto image = bench::noiseImage(camera, sigma, blur, static_cast<uint64_t>(i));
        const auto& found = detector.detect(bench::viewOf(image, camera));
        lines += found.size();
        most = std::max(most, found.size());
        for (const DetectedLine& line : found) longer += line.length_px >= 40;
      }
      fmt::print("sigma {:>4} blur {}: {:.2f} {} {:.2f}\n",
                 sigma,
                 blur,
                 double(lines) / images,
                 most,
                 double(longer) / images);
      std::fflush(stdout);
    }
  }
  fmt::print(
      "discs (images of spheres): lines per disc, longest line / longest arc of a great circle "
      "within 0.5 px\n");
  for (const std::string name : kCameras) {
    const Camera its_camera = cameraOf(name);
    Detector its_detector(its_camera);
    for (const double radius_px : {20., 40., 80., 150., 220., 300., 400.}) {
      size_t lines = 0;
      double worst = 0;
      for (int i = 0; i < images; ++i) {
        const auto disc = bench::discImage(its_camera, radius_px, 2, 0.7, static_cast<uint64_t>(i));
        for (const DetectedLine& line :
             its_detector.detect(bench::viewOf(disc.image, its_camera))) {
          ++lines;
          worst = std::max(worst, line.length_px / disc.longest_arc_px);
        }
      }
      fmt::print("{} radius {}: {:.2f} {:.2f}\n", name, radius_px, double(lines) / images, worst);
      std::fflush(stdout);
    }
  }
  return 0;
}

int usage() {
  fmt::print(stderr,
             "bench_detector time [--peers] [ROUNDS [CAMERA]] | quality [--peers] DATA... | efficiency "
             "[REPEATS] | alarms [IMAGES]\n");
  return 2;
}

int run(std::vector<std::string> arguments) {
  const bool with_peers = std::erase(arguments, "--peers") > 0;
  if (arguments.empty()) return usage();
  const std::string& mode = arguments[0];
  const auto number = [&](int otherwise) {
    return arguments.size() > 1 ? std::stoi(arguments[1]) : otherwise;
  };
  if (mode == "time") {
    return printTimes(number(25), arguments.size() > 2 ? arguments[2] : "", with_peers);
  }
  if (mode == "quality") {
    const std::vector<std::string> folders(arguments.begin() + 1, arguments.end());
    return folders.empty() ? usage() : printQualities(folders, with_peers);
  }
  if (mode == "efficiency") return printEfficiency(number(60));
  if (mode == "alarms") return printAlarms(number(10));
  return usage();
}

}  // namespace
}  // namespace dlsd

int main(int argc, char** argv) {
  try {
    return dlsd::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
