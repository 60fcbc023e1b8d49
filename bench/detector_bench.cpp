// The detector against the floor (OpenCV's GaussianBlur 5x5 and two 16-bit Sobels) on the same
// generated frames, one thread.

#include <benchmark/benchmark.h>

#include <map>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "cameras/calibration/calibration.h"
#include "detector/detector.h"
#include "evaluation/detections.h"
#include "synth/generate.h"

namespace dlsd {
namespace {

constexpr int kFrames = 8;
constexpr const char* kCameras[] = {"pinhole_90", "tum_mono_wide", "fisheye_180", "catadioptric"};
constexpr const char* kScenes[] = {"paper", "room"};

Camera cameraOf(const std::string& name) {
  return loadCamera(DLSD_SOURCE_DIR "/fixtures/calibrations/" + name + ".yaml");
}

/// Frames of a scene with noise 2, rendered once.
const std::vector<Image>& framesOf(const std::string& scene, const std::string& camera) {
  static std::map<std::string, std::vector<Image>> cache;
  std::vector<Image>& frames = cache[scene + camera];
  if (frames.empty()) {
    GenerateOptions options;
    options.cameras = {{camera, cameraOf(camera)}};
    options.scene = scene;
    options.sensor.read_noise_levels = 2;
    for (uint64_t i = 0; i < kFrames; ++i) frames.push_back(renderFrame(options, 20 * i).image);
  }
  return frames;
}

void floorOf(benchmark::State& state, const std::string& scene, const std::string& camera) {
  cv::setNumThreads(1);
  const std::vector<Image>& frames = framesOf(scene, camera);
  cv::Mat smooth, dx, dy;
  size_t i = 0;
  for (auto _ : state) {
    const Image& image = frames[i++ % frames.size()];
    const cv::Mat grey(image.height, image.width, CV_8U, const_cast<uint8_t*>(image.bytes.data()));
    cv::GaussianBlur(grey, smooth, {5, 5}, 1);
    cv::Sobel(smooth, dx, CV_16S, 1, 0);
    cv::Sobel(smooth, dy, CV_16S, 0, 1);
    benchmark::DoNotOptimize(dx.data);
    benchmark::DoNotOptimize(dy.data);
  }
}

void detectorOf(benchmark::State& state,
                const std::string& name,
                const std::string& scene,
                const std::string& camera) {
  const std::vector<Image>& frames = framesOf(scene, camera);
  Detector detector(cameraOf(camera), builtinOptions(name));
  StageTimes sum;
  size_t i = 0, lines = 0;
  for (auto _ : state) {
    lines += detector.detect(viewOf(frames[i++ % frames.size()])).size();
    const StageTimes& t = detector.times();
    sum.gradient += t.gradient;
    sum.anchors += t.anchors;
    sum.linking += t.linking;
    sum.chains += t.chains;
    sum.planes += t.planes;
    sum.validation += t.validation;
  }
  const auto mean_ms = [](double seconds) {
    return benchmark::Counter(seconds * 1e3, benchmark::Counter::kAvgIterations);
  };
  state.counters["gradient_ms"] = mean_ms(sum.gradient);
  state.counters["anchors_ms"] = mean_ms(sum.anchors);
  state.counters["linking_ms"] = mean_ms(sum.linking);
  state.counters["chains_ms"] = mean_ms(sum.chains);
  state.counters["planes_ms"] = mean_ms(sum.planes);
  state.counters["validation_ms"] = mean_ms(sum.validation);
  state.counters["lines"] =
      benchmark::Counter(static_cast<double>(lines), benchmark::Counter::kAvgIterations);
}

}  // namespace
}  // namespace dlsd

int main(int argc, char** argv) {
  for (const std::string scene : dlsd::kScenes) {
    for (const std::string camera : dlsd::kCameras) {
      const std::string suffix = "/" + scene + "/" + camera;
      const auto add = [&](const std::string& name, auto function, auto... arguments) {
        benchmark::RegisterBenchmark((name + suffix).c_str(), function, arguments...)
            ->Unit(benchmark::kMillisecond);
      };
      add("floor", dlsd::floorOf, scene, camera);
      for (const std::string& name : dlsd::builtinDetectors()) {
        add(name, dlsd::detectorOf, name, scene, camera);
      }
    }
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
