#include "synth/render.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cameras/calibration/files.h"
#include "synth/generate.h"
#include "synth/test_cameras.h"

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

// Where the adaptive image spends one sample, 64 would not have changed it.
TEST(Render, AdaptiveEqualsSixtyFourSamplesEverywhere) {
  for (const auto& [name, camera] : testCameras(5)) {
    size_t pixels = 0, off = 0;
    const CameraRays rays(camera);
    const SceneView view = makeSceneView("room", 200, 1);
    const Raycaster raycaster(view.scene);
    const Shader shader(view.scene);
    const auto spans = visibleSpans(view.scene, raycaster, camera, view.pose);
    const auto adaptive = renderRadiance(view.scene, raycaster, shader, rays, view.pose, spans, 5);
    const auto full = renderRadiance(
        view.scene, raycaster, shader, rays, view.pose, spans, 5, Sampling::kEverywhere);
    EXPECT_LT(adaptive.fine_pixels, full.fine_pixels) << name;
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
    EXPECT_GT(pixels, 50000U) << name;
    EXPECT_LE(off, pixels / 10000) << name;
  }
}

/// Least-squares fit of a blurred step a + b x + c erf((x - x0) / (sqrt(2) s)) by Gauss-Newton.
struct StepFit {
  double x0 = 0, rms_share = 1;  ///< Residual over the step's height.
};

StepFit fitStep(const std::vector<double>& x,
                const std::vector<double>& y,
                double start,
                double sigma) {
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::VectorXd p(5);
  p << (y.front() + y.back()) / 2, 0, (y.back() - y.front()) / 2, start, sigma;
  Eigen::VectorXd residual(n);
  for (int iteration = 0; iteration < 20; ++iteration) {
    Eigen::MatrixXd J(n, 5);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<size_t>(i);
      const double u = (x[k] - p[3]) / (std::sqrt(2.0) * p[4]);
      const double e = std::erf(u), g = 2 / std::sqrt(M_PI) * std::exp(-u * u);
      residual[i] = y[k] - (p[0] + p[1] * (x[k] - p[3]) + p[2] * e);
      J(i, 0) = 1;
      J(i, 1) = x[k] - p[3];
      J(i, 2) = e;
      J(i, 3) = -p[1] - p[2] * g / (std::sqrt(2.0) * p[4]);
      J(i, 4) = -p[2] * g * u / p[4];
    }
    p += J.colPivHouseholderQr().solve(residual);
    p[4] = std::clamp(p[4], 0.2, 5.0);
  }
  return {p[3], std::sqrt(residual.squaredNorm() / static_cast<double>(n)) / (2 * std::abs(p[2]))};
}

/// Where the steps of noise-free pictures are, against the labels.
struct EdgeErrors {
  std::vector<double> errors;  ///< px, each pooled over 10 rows or columns.
  size_t fits = 0, poor = 0;   ///< Single rows or columns.
};

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
        const Vector2d p = a + t * (b - a);
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
    EXPECT_LE(mean, 0.02) << name;
    all.insert(all.end(), m.errors.begin(), m.errors.end());
  }
  // Over all models: of one alone these are two or three values.
  std::sort(all.begin(), all.end());
  std::printf("edge position: 99 %% of %zu %.4f px\n", all.size(), all[all.size() * 99 / 100]);
  EXPECT_LE(all[all.size() * 99 / 100], 0.05);
}

TEST(Sensor, BlurKeepsLightAndBorder) {
  SensorOptions sensor;
  std::vector<float> image(40 * 30, 0.25F);
  blur(sensor, 40, 30, &image);
  for (const float v : image) ASSERT_NEAR(v, 0.25F, 1e-6);
  image.assign(40 * 30, 0);
  image[15 * 40 + 20] = 1;
  blur(sensor, 40, 30, &image);
  double sum = 0, second = 0;
  for (int i = 0; i < 40 * 30; ++i) {
    const double v = static_cast<double>(image[static_cast<size_t>(i)]);
    sum += v;
    second += v * (i % 40 - 20) * (i % 40 - 20);
  }
  EXPECT_NEAR(sum, 1, 1e-6);
  EXPECT_NEAR(std::sqrt(second), sensor.psf_sigma_px, 0.01);
}

TEST(Sensor, NoiseHasItsSigmaAndItsSeed) {
  SensorOptions sensor;
  sensor.read_noise_levels = 3;
  const std::vector<float> grey(200 * 200, 0.5F);
  const Image a = exposeImage(sensor, 200, 200, grey, 1, 2);
  EXPECT_EQ(a.bytes, exposeImage(sensor, 200, 200, grey, 1, 2).bytes);
  EXPECT_NE(a.bytes, exposeImage(sensor, 200, 200, grey, 1, 3).bytes);
  double mean = 0, variance = 0;
  for (const uint8_t v : a.bytes) mean += v / 40000.0;
  for (const uint8_t v : a.bytes) variance += (v - mean) * (v - mean) / 40000;
  EXPECT_NEAR(mean, 127.5, 0.1);
  EXPECT_NEAR(std::sqrt(variance), std::hypot(3, std::sqrt(1.0 / 12)), 0.1);
}

TEST(Sensor, EncodingsAreMonotoneAndMeetAtTheEnds) {
  for (const Encoding encoding : {Encoding::kLinear, Encoding::kSrgb, Encoding::kGamma}) {
    SensorOptions sensor;
    sensor.encoding = encoding;
    EXPECT_EQ(greyLevel(sensor, 0), 0);
    EXPECT_NEAR(greyLevel(sensor, 1), 255, 1e-9);
    EXPECT_NEAR(greyLevel(sensor, 7), 255, 1e-9);
    for (int i = 1; i <= 1000; ++i) {
      EXPECT_GT(greyLevel(sensor, i / 1000.0), greyLevel(sensor, (i - 1) / 1000.0));
    }
  }
}

TEST(Sensor, SurvivesItsJson) {
  for (const Encoding encoding : {Encoding::kLinear, Encoding::kSrgb, Encoding::kGamma}) {
    EXPECT_EQ(encodingFromName(toString(encoding)), encoding);
    SensorOptions sensor;
    sensor.psf_sigma_px = 0.3;
    sensor.exposure = 1.25;
    sensor.read_noise_levels = 2;
    sensor.encoding = encoding;
    sensor.gamma = 1.8;
    const nlohmann::json json = toJson(sensor);
    EXPECT_EQ(toJson(sensorFromJson(json, "x")), toJson(sensor));
    for (const auto& [key, value] : json.items()) {
      nlohmann::json missing = json, wrong = json;
      missing.erase(key);
      wrong[key] = -7;
      EXPECT_THROW((void)sensorFromJson(missing, "x"), InputError) << key;
      EXPECT_THROW((void)sensorFromJson(wrong, "x"), InputError) << key;
    }
  }
  EXPECT_FALSE(encodingFromName("rot13"));
}

TEST(Sensor, RefusesWhatIsOutOfRange) {
  const auto refuses = [](auto set, const char* field) {
    SensorOptions sensor;
    set(&sensor);
    try {
      sensor.check();
      ADD_FAILURE() << field << " was accepted";
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(field), std::string::npos) << e.what();
    }
  };
  refuses([](SensorOptions* s) { s->psf_sigma_px = -1; }, "psf_sigma_px");
  refuses([](SensorOptions* s) { s->psf_sigma_px = std::nan(""); }, "psf_sigma_px");
  refuses([](SensorOptions* s) { s->exposure = 0; }, "exposure");
  refuses([](SensorOptions* s) { s->read_noise_levels = 101; }, "read_noise_levels");
  refuses([](SensorOptions* s) { s->gamma = 0.5; }, "gamma");
}

}  // namespace
}  // namespace dlsd
