#include "synth/render.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "synth/dataset/random.h"
#include "synth/generate.h"
#include "synth/test_cameras.h"
#include "synth/tubes.h"
#include "synth/variety.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;

// Bilinear rays between corners against the exact inverse projection.
TEST(CameraRays, InterpolateWithinTheirBound) {
  for (const auto& [name, camera] : testCameras()) {
    const CameraRays rays(camera);
    double worst = 0;
    size_t pixels = 0;
    for (int j = 0; j < camera.height(); j += 3) {
      for (int i = 0; i < camera.width(); i += 3) {
        if (rays.isExact(i, j)) continue;
        ++pixels;
        for (const auto& [a, b] :
             {std::pair(0.5, 0.5), std::pair(0.5, 0.02), std::pair(0.25, 0.75)}) {
          const Eigen::Vector3f ray = static_cast<float>((1 - b) * (1 - a)) * rays.cornerRay(i, j) +
                                      static_cast<float>((1 - b) * a) * rays.cornerRay(i + 1, j) +
                                      static_cast<float>(b * (1 - a)) * rays.cornerRay(i, j + 1) +
                                      static_cast<float>(b * a) * rays.cornerRay(i + 1, j + 1);
          const auto pixel = camera.project(ray.cast<double>());
          ASSERT_TRUE(pixel) << name;
          worst = std::max(worst, (*pixel - Vector2d(i - 0.5 + a, j - 0.5 + b)).norm());
        }
      }
    }
    std::printf("%s: %zu of %d pixels exact, worst interpolation error elsewhere %.2g px\n",
                name.c_str(),
                rays.exactCount(),
                camera.width() * camera.height(),
                worst);
    EXPECT_GT(pixels, 20000U) << name;
    EXPECT_LT(worst, 1e-3) << name;
  }
}

// Where the adaptive image spends fewer than 64 samples, they would not have changed it.
TEST(Render, AdaptiveEqualsSixtyFourSamplesEverywhere) {
  // A room, and solids among tubes, cylinders and patterns.
  SceneView solids = makeSceneView("polyhedra", 200, 1);
  SceneVariety variety;
  variety.distractors = variety.clutter = {15, 15};
  variety.noise = variety.wood = {0.15, 0.15};
  addVariety(variety, 200, 1, &solids);
  addRodSides(solids.pose.position_in_world, &solids.scene);
  for (const SceneView& view : {makeSceneView("room", 200, 1), solids})
    for (const auto& [name, camera] : testCameras(3)) {
      size_t pixels = 0, off = 0;
      const CameraRays rays(camera);
      const Raycaster raycaster(view.scene);
      const Shader shader(view.scene);
      const PixelResponse response(0.7, 0);
      const auto spans = visibleSpans(view.scene, raycaster, camera, view.pose);
      const auto render = [&](Sampling sampling) {
        return renderRadiance(
            view.scene, raycaster, shader, rays, view.pose, spans, 5, response, sampling);
      };
      const Rendering adaptive = render(Sampling::kAdaptive), full = render(Sampling::kEverywhere);
      EXPECT_LT(adaptive.fine_pixels, full.fine_pixels / 2) << name;
      for (size_t i = 0; i < full.radiance.size(); ++i) {
        ++pixels;
        const double difference = std::abs(static_cast<double>(full.radiance[i]) -
                                           static_cast<double>(adaptive.radiance[i]));
        off += difference * 255 > 1 ? 1U : 0U;
      }
      std::printf("%s: adaptive sampling: %zu of %zu pixels differ by more than 1 grey level\n",
                  name.c_str(),
                  off,
                  pixels);
      EXPECT_GT(pixels, 140000U) << name;
      EXPECT_LE(off, pixels / 10000) << name;
    }
}

/// What a pixel answers, by its definition: the mean radiance of single rays at random places
/// around it, spread like its square, the defocus disc and the Gaussian.
double pixelByDice(const SceneView& view,
                   const Raycaster& raycaster,
                   const Shader& shader,
                   const Camera& camera,
                   const SensorOptions& sensor,
                   const Vector2d& pixel,
                   double* standard_error) {
  constexpr int kDraws = 3000;
  const Eigen::Matrix3d world_from_cam = view.pose.cam_from_world.transpose();
  const Random random(
      5, hashCounters({static_cast<uint64_t>(pixel.x()), static_cast<uint64_t>(pixel.y())}));
  double sum = 0, squares = 0;
  for (uint64_t i = 0; i < kDraws; ++i) {
    const double r = sensor.defocus_radius_px * std::sqrt(random.uniform(6 * i, 0, 1));
    const double phi = random.uniform(6 * i + 1, 0, 2 * M_PI);
    const Vector2d place =
        pixel + r * Vector2d(std::cos(phi), std::sin(phi)) +
        sensor.psf_sigma_px * Vector2d(random.normal(6 * i + 2), random.normal(6 * i + 3)) +
        Vector2d(random.uniform(6 * i + 4, -0.5, 0.5), random.uniform(6 * i + 5, -0.5, 0.5));
    double radiance = 0;
    if (const auto ray = camera.unproject(place)) {
      const Eigen::Vector3d direction = world_from_cam * *ray;
      const Hit hit = raycaster.cast(view.pose.position_in_world.cast<float>(),
                                     direction.cast<float>(),
                                     0,
                                     std::numeric_limits<float>::infinity());
      const Seen seen = shader.shade(hit, view.pose.position_in_world, direction);
      radiance = static_cast<double>(seen.radiance);
    }
    sum += radiance;
    squares += radiance * radiance;
  }
  const double mean = sum / kDraws;
  *standard_error = std::sqrt(std::max(0.0, squares / kDraws - mean * mean) / kDraws);
  return mean;
}

// Pixels where the picture is most uneven, against single rays and the response's definition.
TEST(Render, PixelsAnswerAsTheirDefinitionSays) {
  struct Case {
    double sigma, disc;
  };
  size_t checked = 0;
  double squares = 0;
  for (const auto& [name, camera] : testCameras(6)) {
    const SceneView view = makeSceneView("room", 210, 3);
    const Raycaster raycaster(view.scene);
    const Shader shader(view.scene);
    const CameraRays rays(camera);
    const auto spans = visibleSpans(view.scene, raycaster, camera, view.pose);
    for (const Case& blur : {Case{0, 0}, Case{0.7, 0}, Case{2.5, 0}, Case{0.5, 2}}) {
      SensorOptions sensor;
      sensor.psf_sigma_px = blur.sigma;
      sensor.defocus_radius_px = blur.disc;
      const PixelResponse response(blur.sigma, blur.disc);
      const std::vector<float> image =
          renderRadiance(view.scene, raycaster, shader, rays, view.pose, spans, 5, response)
              .radiance;
      const int width = camera.width();
      const auto at = [&](int x, int y) {
        return static_cast<double>(image[static_cast<size_t>(y * width + x)]);
      };
      const Random random(8, 1);
      constexpr int kMargin = 14;
      int found = 0;
      for (uint64_t i = 0; found < 60 && i < 100000; ++i) {
        const int x = static_cast<int>(random.uniform(2 * i, kMargin, camera.width() - kMargin));
        const int y =
            static_cast<int>(random.uniform(2 * i + 1, kMargin, camera.height() - kMargin));
        if (std::abs(at(x + 1, y) - at(x - 1, y)) + std::abs(at(x, y + 1) - at(x, y - 1)) < 0.1) {
          continue;
        }
        ++found;
        double standard_error = 0;
        const double expected =
            pixelByDice(view, raycaster, shader, camera, sensor, {x, y}, &standard_error);
        // 64 samples have an error too, largest without any blur.
        const double own_error = blur.sigma + blur.disc > 0 ? 0.006 : 0.02;
        const double tolerance = 4.5 * std::hypot(standard_error, own_error);
        EXPECT_NEAR(at(x, y), expected, tolerance)
            << name << " " << blur.sigma << " " << blur.disc << " at " << x << " " << y;
        if (blur.sigma == 0.7) squares += std::pow(at(x, y) - expected, 2);
        ++checked;
      }
    }
  }
  EXPECT_EQ(checked, 4U * 4 * 60);
  std::printf("pixels against 3000 random rays, sigma 0.7: rms difference %.4f\n",
              std::sqrt(squares / (4 * 60)));
}

// One thread or two, the same picture to the bit.
TEST(Render, DoesNotDependOnThreads) {
  const Camera camera = testCameras(4)[1].second;
  const CameraRays rays(camera);
  const SceneView view = makeSceneView("room", 220, 1);
  const Raycaster raycaster(view.scene);
  const Shader shader(view.scene);
  const auto spans = visibleSpans(view.scene, raycaster, camera, view.pose);
  const PixelResponse response(0.7, 1);
  std::vector<std::vector<float>> images;
  for (const int threads : {1, 2, 5}) {
    tbb::task_arena(threads).execute([&] {
      images.push_back(
          renderRadiance(view.scene, raycaster, shader, rays, view.pose, spans, 5, response)
              .radiance);
    });
  }
  EXPECT_EQ(images[0], images[1]);
  EXPECT_EQ(images[0], images[2]);
}

/// Least-squares fit, by Gauss-Newton, of a step between two ramps, blurred: with t = x - x0 and
/// the normal distribution P, p of standard deviation s,
///   a + b t + c P(t) + d (t P(t) + s^2 p(t)),
/// where c is the step and d the change of slope (shading has one at most creases).
struct StepFit {
  double x0 = 0, rms_share = 1;  ///< Residual over the step's height.
};

StepFit fitStep(const std::vector<double>& x,
                const std::vector<double>& y,
                double start,
                double sigma) {
  const auto n = static_cast<Eigen::Index>(x.size());
  double x0 = start, s = sigma;
  Eigen::VectorXd linear = Eigen::VectorXd::Zero(4);
  Eigen::VectorXd residual(n);
  for (int iteration = 0; iteration < 20; ++iteration) {
    // The linear parameters for this x0 and s, then a step of all six.
    Eigen::MatrixXd A(n, 6);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double t = x[static_cast<size_t>(i)] - x0;
      const double P = (1 + std::erf(t / (std::sqrt(2.0) * s))) / 2;
      const double p = std::exp(-0.5 * t * t / (s * s)) / (std::sqrt(2 * M_PI) * s);
      A.row(i) << 1, t, P, t * P + s * s * p, 0, 0;
      residual[i] = y[static_cast<size_t>(i)];
    }
    linear = A.leftCols(4).colPivHouseholderQr().solve(residual);
    residual -= A.leftCols(4) * linear;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double t = x[static_cast<size_t>(i)] - x0;
      const double P = A(i, 2);
      const double p = std::exp(-0.5 * t * t / (s * s)) / (std::sqrt(2 * M_PI) * s);
      A(i, 4) = -linear[1] - linear[2] * p - linear[3] * P;
      A(i, 5) = -linear[2] * t / s * p + linear[3] * s * p;
    }
    const Eigen::VectorXd step = A.colPivHouseholderQr().solve(residual);
    x0 += step[4];
    s = std::clamp(s + step[5], 0.2, 5.0);
  }
  return {x0, std::sqrt(residual.squaredNorm() / static_cast<double>(n)) / std::abs(linear[2])};
}

/// Where the steps of noise-free pictures are, against the labels.
struct EdgeErrors {
  std::vector<double> errors;  ///< px, each pooled over 10 rows or columns.
  size_t fits = 0, poor = 0;   ///< Single rows or columns.
};

/// Where a row or column meets the image of the plane with this normal, near `start` on that row or
/// column: labels' points are joined by straight pieces, which are up to 0.01 px off. No value at
/// the rim of the domain.
std::optional<Vector2d> onCurve(const Camera& camera,
                                const Eigen::Vector3d& normal,
                                int across,
                                const Vector2d& start) {
  const Vector2d step = 0.05 * Vector2d::Unit(across);
  const auto low = camera.unproject(start - step), high = camera.unproject(start + step);
  if (!low || !high) return std::nullopt;
  const double a = normal.dot(*low), b = normal.dot(*high);
  return start + (2 * a / (a - b) - 1) * step;
}

void measureEdges(const Camera& camera, const Frame& frame, EdgeErrors* out) {
  const auto grey = [&](int x, int y) {
    return 255 * static_cast<double>(
                     frame.radiance[static_cast<size_t>(y) * static_cast<size_t>(camera.width()) +
                                    static_cast<size_t>(x)]);
  };
  // Samples of all labels on a grid, to find isolated places.
  constexpr int kCell = 10;
  const int columns = camera.width() / kCell + 3;
  std::vector<std::vector<std::pair<Vector2d, int>>> grid(
      static_cast<size_t>(columns) * static_cast<size_t>(camera.height() / kCell + 3));
  const auto cell = [&](double x, double y) {
    return static_cast<size_t>((static_cast<int>(y) / kCell + 1) * columns +
                               static_cast<int>(x) / kCell + 1);
  };
  for (const LabelLine& line : frame.labels.lines) {
    for (size_t i = 1; i < line.points.size(); ++i) {
      const Vector2d d = line.points[i] - line.points[i - 1];
      const int steps = static_cast<int>(std::ceil(d.norm()));
      for (int k = 0; k <= steps; ++k) {
        const Vector2d p =
            line.points[i - 1] + d * (steps == 0 ? 0.0 : static_cast<double>(k) / steps);
        grid[cell(std::max(0.0, p.x()), std::max(0.0, p.y()))].emplace_back(p, line.id);
      }
    }
  }
  const auto isolated = [&](const Vector2d& p, int id) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        for (const auto& [q, other] : grid[cell(p.x() + dx * kCell, p.y() + dy * kCell)]) {
          if (other != id && (p - q).norm() < 9) return false;
        }
      }
    }
    return true;
  };
  for (const LabelLine& line : frame.labels.lines) {
    if (line.kind == LineKind::kWire || line.contrast_min < 30 || line.length_px < 40) continue;
    // Rows where the line is rather upright, else columns.
    const Vector2d chord = line.points.back() - line.points.front();
    const bool rows = std::abs(chord.y()) > std::abs(chord.x());
    const int along = rows ? 1 : 0, across = 1 - along;
    double sum = 0;
    int count = 0;
    for (size_t i = 1; i < line.points.size(); ++i) {
      Vector2d a = line.points[i - 1], b = line.points[i];
      if (a[along] > b[along]) std::swap(a, b);
      for (int row = static_cast<int>(std::ceil(a[along])); row < b[along]; ++row) {
        const double t = (row - a[along]) / (b[along] - a[along]);
        const auto on_curve = onCurve(camera, line.normal, across, a + t * (b - a));
        if (!on_curve) continue;
        const Vector2d p = *on_curve;
        if (std::min((p - line.points.front()).norm(), (p - line.points.back()).norm()) < 10)
          continue;
        if (p.x() < 14 || p.y() < 14 || p.x() > camera.width() - 15 || p.y() > camera.height() - 15)
          continue;
        if (!isolated(p, line.id)) continue;
        std::vector<double> x, y;
        const int middle = static_cast<int>(std::lround(p[across]));
        for (int k = -5; k <= 5; ++k) {
          x.push_back(middle + k);
          y.push_back(rows ? grey(middle + k, row) : grey(row, middle + k));
        }
        if (std::abs(y.front() - y.back()) < 25) continue;
        const double cosine = std::abs((b - a).normalized()[along]);
        const StepFit fit = fitStep(x, y, p[across], 0.75 / cosine);
        ++out->fits;
        // Round things and faint lines near by spoil a fit; they are not what is tested here.
        if (!(fit.rms_share < 0.01) || !(std::abs(fit.x0 - p[across]) < 2)) {
          ++out->poor;
          continue;
        }
        sum += (fit.x0 - p[across]) * cosine;
        if (++count == 10) {
          out->errors.push_back(std::abs(sum / count));
          sum = 0;
          count = 0;
        }
      }
    }
  }
}

// The noise-free picture has its edges where the labels are. Isolated labels only; steps are fitted
// row by row (or column by column) and pooled over 10 px.
TEST(Render, EdgesLieOnTheirLabels) {
  std::vector<double> all;
  for (const auto& [name, camera] : testCameras(1)) {
    GenerateOptions options;
    options.cameras = {{name, camera}};
    options.seed = 300;
    EdgeErrors m;
    measureEdges(camera, renderFrame(options, 1), &m);
    ASSERT_GT(m.errors.size(), 100U) << name;
    std::sort(m.errors.begin(), m.errors.end());
    double mean = 0;
    for (const double e : m.errors) mean += e / static_cast<double>(m.errors.size());
    std::printf(
        "%s: edge position: %zu pooled fits (%zu rows, %zu poor), mean |error| %.4f px, "
        "99 %% %.4f px, max %.4f px\n",
        name.c_str(),
        m.errors.size(),
        m.fits,
        m.poor,
        mean,
        m.errors[m.errors.size() * 99 / 100],
        m.errors.back());
    EXPECT_LT(m.poor, m.fits / 10) << name;
    EXPECT_LE(mean, 0.005) << name;
    all.insert(all.end(), m.errors.begin(), m.errors.end());
  }
  // Over all models: of one alone these are two or three values.
  std::sort(all.begin(), all.end());
  std::printf("edge position: 99 %% of %zu %.4f px\n", all.size(), all[all.size() * 99 / 100]);
  EXPECT_LE(all[all.size() * 99 / 100], 0.02);
}

}  // namespace
}  // namespace dlsd
