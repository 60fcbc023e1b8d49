// Rendering against its floor: bare ray casting of 4 samples a pixel, coherent packets of 16, of
// the same scene, in the same run. Floor and frame alternate, so that both see the same machine.
//
//   bench_synth [repetitions] [threads]

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "synth/dataset/random.h"
#include "synth/labels.h"
#include "synth/render.h"
#include "synth/scene_builder.h"
#include "synth/sensor.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 1280, kHeight = 1024;

Vector3d drawDirection(Random* random) {
  const double z = random->next(-1, 1), a = random->next(0, 2 * M_PI);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

double distanceToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d d = b - a;
  return (a + std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) * d - p).norm();
}

/// 60 boxes and 200 rods all around the camera, in a hall; a sun and a lamp.
SceneView boxesAndRods() {
  Random random(1, 0xbe4c);
  SceneBuilder builder;
  const Vector3d hall(16, 16, 16), eye = roundToFloat(hall / 2);
  std::array<Panel, 4> walls;
  for (Panel& wall : walls) wall.surface = {random.next(0.4, 0.8), 0};
  builder.addRoom(hall, walls, {0.5, 0}, {0.7, 0});
  struct Ball {
    Vector3d centre;
    double radius;
  };
  std::vector<Ball> balls;
  while (balls.size() < 60) {
    const Vector3d half{random.next(0.1, 0.5), random.next(0.1, 0.5), random.next(0.1, 0.5)};
    const Vector3d direction = drawDirection(&random);
    const Ball ball{eye + direction * random.next(1.5, 6.5), half.norm()};
    Frame3 frame;
    frame.origin = ball.centre;
    frame.axes =
        Eigen::AngleAxisd(random.next(0, 2 * M_PI), drawDirection(&random)).toRotationMatrix();
    const Surface surface{random.next(0.1, 0.9), 0};
    bool fits = (ball.centre - eye).norm() > ball.radius + 0.6 &&
                (ball.centre - eye).cwiseAbs().maxCoeff() + ball.radius < 7.9;
    for (const Ball& other : balls) {
      fits = fits && (other.centre - ball.centre).norm() > other.radius + ball.radius;
    }
    if (!fits) continue;
    balls.push_back(ball);
    builder.addBox(frame, -half, half, surface);
  }
  for (int rods = 0; rods < 200;) {
    const Vector3d centre = eye + drawDirection(&random) * random.next(0.8, 6);
    const Vector3d half = drawDirection(&random) * random.next(0.3, 2);
    const double radius = random.next(0.004, 0.012);
    const Surface surface{random.next(0.1, 0.9), 0};
    const Vector3d from = centre - half, to = centre + half;
    bool fits =
        distanceToSegment(eye, from, to) > 0.4 &&
        std::max((from - eye).cwiseAbs().maxCoeff(), (to - eye).cwiseAbs().maxCoeff()) < 7.8;
    for (const Ball& ball : balls) {
      fits = fits && distanceToSegment(ball.centre, from, to) > ball.radius + radius;
    }
    if (!fits) continue;
    builder.addRod(from, to, radius, 8, surface);
    ++rods;
  }
  builder.finish();
  Light sun;
  sun.place = Vector3d(0.3, 0.5, 0.8).normalized();
  sun.strength = 0.5;
  Light lamp;
  lamp.kind = Light::Kind::kPoint;
  lamp.place = eye + Vector3d(2, 1, 3);
  lamp.strength = 0.4;
  lamp.half_distance = 3;
  builder.scene.lights = {sun, lamp};
  return {std::move(builder.scene), lookAt(eye, eye + Vector3d(1, 0.3, -0.1), 0.1)};
}

/// The floor's rays, in packets of 2 x 2 pixels with 4 samples each, world frame.
struct FloorRays {
  std::vector<float> x, y, z;

  FloorRays(const Camera& camera, const Pose& pose) {
    const Eigen::Matrix3d world_from_cam = pose.cam_from_world.transpose();
    for (int j = 0; j < kHeight; j += 2) {
      for (int i = 0; i < kWidth; i += 2) {
        for (int k = 0; k < 16; ++k) {
          const auto ray = camera.unproject({i - 0.25 + (k % 4) * 0.5, j - 0.25 + (k / 4) * 0.5});
          if (!ray) continue;
          const Eigen::Vector3f d = (world_from_cam * *ray).cast<float>();
          x.push_back(d.x());
          y.push_back(d.y());
          z.push_back(d.z());
        }
      }
    }
    const size_t whole = x.size() / Raycaster::kPacket * Raycaster::kPacket;
    for (auto* values : {&x, &y, &z}) values->resize(whole);
  }

  void cast(const Raycaster& raycaster, const Pose& pose) const {
    const Eigen::Vector3f origin = pose.position_in_world.cast<float>();
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, x.size() / Raycaster::kPacket, 1024),
        [&](const tbb::blocked_range<size_t>& packets) {
          std::array<Hit, Raycaster::kPacket> hits;
          int sum = 0;
          for (size_t p = packets.begin(); p < packets.end(); ++p) {
            const size_t k = p * Raycaster::kPacket;
            raycaster.castPacket(
                origin, x.data() + k, y.data() + k, z.data() + k, Raycaster::kPacket, hits.data());
            sum += hits[0].index;
          }
          volatile int used = sum;
          (void)used;
        });
  }
};

/// Wall and processor time of named stages.
class Stopwatch {
 public:
  struct Time {
    double wall_ms = 0, cpu_ms = 0;
  };

  template <class Function>
  void time(const std::string& stage, const Function& function) {
    const Time begin = now();
    function();
    const Time end = now();
    times_[stage].push_back({end.wall_ms - begin.wall_ms, end.cpu_ms - begin.cpu_ms});
  }

  /// Medians over the repetitions.
  [[nodiscard]] Time median(const std::string& stage) const {
    const std::vector<Time>& all = times_.at(stage);
    std::vector<double> wall, cpu;
    for (const Time& t : all) {
      wall.push_back(t.wall_ms);
      cpu.push_back(t.cpu_ms);
    }
    const auto middle = [](std::vector<double>* values) {
      std::nth_element(values->begin(),
                       values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2),
                       values->end());
      return (*values)[values->size() / 2];
    };
    return {middle(&wall), middle(&cpu)};
  }

 private:
  static Time now() {
    timespec cpu{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
    const auto wall = std::chrono::steady_clock::now().time_since_epoch();
    return {std::chrono::duration<double, std::milli>(wall).count(),
            static_cast<double>(cpu.tv_sec) * 1e3 + static_cast<double>(cpu.tv_nsec) * 1e-6};
  }

  std::map<std::string, std::vector<Time>> times_;
};

/// Largest resident memory so far, MB.
double peakMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kilobytes = 0;
    if (word == "VmHWM:" && status >> kilobytes) return kilobytes / 1024;
  }
  return 0;
}

void run(int repetitions) {
  const std::array<double, 8> params{407.4, 407.4, 639.5, 511.5, 0, 0, 0, 0};
  const Camera camera = makeCamera("kannala_brandt", params, kWidth, kHeight, M_PI / 2);
  const SceneView view = boxesAndRods();
  const Raycaster raycaster(view.scene);
  const FloorRays floor_rays(camera, view.pose);
  const SensorOptions sensor;
  const PixelResponse response(sensor.psf_sigma_px, sensor.defocus_radius_px);
  Stopwatch watch;
  watch.time("ray table", [&] { const CameraRays rays(camera); });
  const CameraRays rays(camera);

  const std::vector<std::string> stages{"build", "spans", "labels", "image", "sensor"};
  std::vector<EdgeSpan> spans;
  Labels labels;
  Rendering adaptive;
  for (int k = 0; k < repetitions; ++k) {
    watch.time("floor", [&] { floor_rays.cast(raycaster, view.pose); });
    watch.time("frame", [&] {
      std::optional<Raycaster> own;
      std::optional<Shader> shader;
      watch.time("build", [&] {
        own.emplace(view.scene);
        shader.emplace(view.scene);
      });
      watch.time("spans", [&] { spans = visibleSpans(view.scene, *own, camera, view.pose); });
      watch.time("labels", [&] {
        labels = makeLabels(view.scene, *own, *shader, camera, view.pose, sensor, spans);
      });
      watch.time("image", [&] {
        adaptive = renderRadiance(view.scene, *own, *shader, rays, view.pose, spans, 1, response);
      });
      watch.time("sensor",
                 [&] { (void)exposeImage(sensor, kWidth, kHeight, adaptive.radiance, 1, 1); });
    });
  }
  const double memory = peakMemory();
  const Shader shader(view.scene);
  const Rendering full = renderRadiance(
      view.scene, raycaster, shader, rays, view.pose, spans, 1, response, Sampling::kEverywhere);
  size_t off = 0;
  for (size_t i = 0; i < full.radiance.size(); ++i) {
    off += std::abs(full.radiance[i] - adaptive.radiance[i]) * 255 > 1 ? 1 : 0;
  }

  const auto floor = watch.median("floor"), frame = watch.median("frame");
  std::printf("%-34s %8s %8s\n", "median, ms", "wall", "CPU");
  const auto print = [&](const std::string& name) {
    const auto t = watch.median(name);
    std::printf("%-34s %8.1f %8.1f\n", name.c_str(), t.wall_ms, t.cpu_ms);
  };
  print("floor");
  print("frame");
  for (const std::string& stage : stages) print(stage);
  print("ray table");
  std::printf("floor: %zu rays, %.1f Mrays/s of CPU time\n",
              floor_rays.x.size(),
              static_cast<double>(floor_rays.x.size()) / floor.cpu_ms / 1e3);
  std::printf("frame / floor: wall %.2f, CPU %.2f\n",
              frame.wall_ms / floor.wall_ms,
              frame.cpu_ms / floor.cpu_ms);
  std::printf("labels' share of the frame (CPU): %.1f %%\n",
              100 * (watch.median("spans").cpu_ms + watch.median("labels").cpu_ms) / frame.cpu_ms);
  std::printf("pixels with more than one sample: %.2f %%, labels %zu\n",
              100.0 * static_cast<double>(adaptive.fine_pixels) / (kWidth * kHeight),
              labels.lines.size());
  std::printf("more than 1 grey level from 64 samples everywhere: %zu of %d pixels (%.4f %%)\n",
              off,
              kWidth * kHeight,
              100.0 * static_cast<double>(off) / (kWidth * kHeight));
  std::printf("peak memory: %.0f MB (of which the floor's rays %.0f)\n",
              memory,
              static_cast<double>(floor_rays.x.size()) * 12 / 1e6);
}

}  // namespace
}  // namespace dlsd

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::atoi(argv[1]) : 11;
  const int threads = argc > 2 ? std::atoi(argv[2]) : 2;
  if (repetitions < 1 || threads < 1) {
    std::fprintf(stderr, "usage: %s [repetitions] [threads]\n", argv[0]);
    return 2;
  }
  tbb::task_arena(threads).execute([&] { dlsd::run(repetitions); });
  return 0;
}
