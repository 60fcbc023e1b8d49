// The evaluation of one frame, and the figures of 1000 frames, with 200 labels and as many
// detections each.

#include <benchmark/benchmark.h>

#include <vector>

#include "cameras/arc.h"
#include "evaluation/dataset_evaluation.h"
#include "evaluation/figures.h"
#include "evaluation/paper_experiment.h"
#include "evaluation/summary.h"
#include "synth/dataset/random.h"
#include "synth/dataset/statistics.h"

namespace dlsd {
namespace {

constexpr size_t kLines = 200;

/// Random lines of the paper's camera, and detections of them that are off by up to 2 px.
FrameEvaluation randomFrame(const Camera& camera, uint64_t index) {
  Random random(0, index);
  const auto pixel = [&] {
    return Eigen::Vector2d{random.next(0, camera.width() - 1), random.next(0, camera.height() - 1)};
  };
  FrameEvaluation frame;
  frame.labels.camera = "cameras/wide.yaml";
  frame.labels.width = camera.width();
  frame.labels.height = camera.height();
  frame.labels.sensor = {{"psf_sigma_px", 0.7}, {"read_noise_levels", 2.0}, {"encoding", "linear"}};
  while (frame.labels.lines.size() < kLines) {
    const Eigen::Vector2d from = pixel();
    const Eigen::Vector2d to =
        from + Eigen::Vector2d{random.next(-200, 200), random.next(-200, 200)};
    const auto ray0 = camera.unproject(from), ray1 = camera.unproject(to);
    const auto arc = ray0 && ray1 ? arcBetween(*ray0, *ray1) : std::nullopt;
    if (!arc || !camera.inImage(to)) {
      continue;
    }
    LabelLine line;
    line.id = line.edge = line.carrier = int(frame.labels.lines.size());
    line.points_in_cam = {*ray0, *ray1};
    line.normal = canonicalNormal(arc->normal);
    line.points = imageCurve(camera, *arc, 0, 1);
    line.length_px = curveLength(line.points);
    line.angle_rad = arc->angle();
    line.contrast = line.contrast_min = random.next(5, 100);
    DetectionLine detection;
    const Eigen::Vector2d shift{random.next(-2, 2), random.next(-2, 2)};
    for (const Eigen::Vector2d& p : line.points) {
      detection.points.emplace_back(p + shift);
    }
    detection.score = line.contrast;
    frame.labels.lines.push_back(std::move(line));
    frame.detections.lines.push_back(std::move(detection));
  }
  return frame;
}

void evaluateOneFrame(benchmark::State& state) {
  const Camera camera = paperCamera();
  FrameEvaluation frame = randomFrame(camera, 0);
  for (auto _ : state) {
    evaluate(camera, {}, &frame);
    benchmark::DoNotOptimize(frame.outcome.labels.data());
  }
}
BENCHMARK(evaluateOneFrame)->Unit(benchmark::kMillisecond);

void figuresOf1000Frames(benchmark::State& state) {
  const Camera camera = paperCamera();
  Summary summary{EvaluationOptions{}};
  for (uint64_t i = 0; i < 1000; ++i) {
    FrameEvaluation frame = randomFrame(camera, i);
    evaluate(camera, {}, &frame);
    summary.add(frame, camera);
  }
  for (auto _ : state) {
    const Figures figures = makeFigures(summary);
    benchmark::DoNotOptimize(figures.list.data());
  }
}
BENCHMARK(figuresOf1000Frames)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dlsd

BENCHMARK_MAIN();
