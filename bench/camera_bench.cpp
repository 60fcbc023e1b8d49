// Camera models: batches in every build of the loops and one point at a time, against textbook code
// with libm, all in one run. Prints ns per point and a table of ratios. See README.md here.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "cameras/batch.h"

namespace dlsd {
namespace {

constexpr int kWidth = 1280, kHeight = 1024;
constexpr size_t kPoints = size_t{kWidth} * kHeight;

// --- The reference: the equations of the papers, a point at a time, with libm. Iterations are
// Newton's from the undistorted value until the step is below the last bits. ---

struct Point2 {
  double u, v;
};
struct Point3 {
  double x, y, z;
};

Point3 unit(double x, double y, double z) {
  const double norm = std::sqrt(x * x + y * y + z * z);
  return {x / norm, y / norm, z / norm};
}

/// Zero of f by Newton's method; f returns value and slope.
template <class F>
double newton(double x, const F& f) {
  for (int i = 0; i < 50; ++i) {
    const auto [value, slope] = f(x);
    const double step = value / slope;
    x -= step;
    if (std::abs(step) <= 1e-15 * std::abs(x)) break;
  }
  return x;
}

Point2 referenceProject(const Pinhole& m, double x, double y, double z) {
  return {m.fx * x / z + m.cx, m.fy * y / z + m.cy};
}
Point3 referenceUnproject(const Pinhole& m, double u, double v) {
  return unit((u - m.cx) / m.fx, (v - m.cy) / m.fy, 1);
}

Point2 referenceProject(const Fov& m, double x, double y, double z) {
  const double r = std::sqrt(x * x + y * y);
  if (r == 0) return {m.cx, m.cy};
  const double r_d = std::atan2(m.two_tan_half_omega * r, z) / m.omega;
  return {m.fx * r_d * x / r + m.cx, m.fy * r_d * y / r + m.cy};
}
Point3 referenceUnproject(const Fov& m, double u, double v) {
  const double mx = (u - m.cx) / m.fx, my = (v - m.cy) / m.fy;
  const double r_d = std::sqrt(mx * mx + my * my);
  if (r_d == 0) return {0, 0, 1};
  // r / z = tan(r_d omega) / (2 tan(omega / 2)), without a case for 90 degrees.
  const double r = std::sin(r_d * m.omega) / m.two_tan_half_omega;
  return unit(mx / r_d * r, my / r_d * r, std::cos(r_d * m.omega));
}

Point2 referenceProject(const KannalaBrandt& m, double x, double y, double z) {
  const double r = std::sqrt(x * x + y * y);
  if (r == 0) return {m.cx, m.cy};
  const double theta = std::atan2(r, z), t = theta * theta;
  const double d = theta * (1 + t * (m.k1 + t * (m.k2 + t * (m.k3 + t * m.k4))));
  return {m.fx * d * x / r + m.cx, m.fy * d * y / r + m.cy};
}
Point3 referenceUnproject(const KannalaBrandt& m, double u, double v) {
  const double mx = (u - m.cx) / m.fx, my = (v - m.cy) / m.fy;
  const double r_d = std::sqrt(mx * mx + my * my);
  if (r_d == 0) return {0, 0, 1};
  const double theta = newton(r_d, [&](double a) {
    const double t = a * a;
    return std::pair(a * (1 + t * (m.k1 + t * (m.k2 + t * (m.k3 + t * m.k4)))) - r_d,
                     1 + t * (3 * m.k1 + t * (5 * m.k2 + t * (7 * m.k3 + t * 9 * m.k4))));
  });
  const double s = std::sin(theta) / r_d;
  return {mx * s, my * s, std::cos(theta)};
}

Point2 referenceProject(const UnifiedOmni& m, double x, double y, double z) {
  const double denominator = z + m.xi * std::sqrt(x * x + y * y + z * z);
  return {m.fx * x / denominator + m.cx, m.fy * y / denominator + m.cy};
}
Point3 liftToSphere(double xi, double x, double y) {
  const double m2 = x * x + y * y;
  const double s = (xi + std::sqrt(1 + (1 - xi * xi) * m2)) / (1 + m2);
  return {s * x, s * y, s - xi};
}
Point3 referenceUnproject(const UnifiedOmni& m, double u, double v) {
  return liftToSphere(m.xi, (u - m.cx) / m.fx, (v - m.cy) / m.fy);
}

/// Brown's distortion of (x, y).
Point2 distort(const Radtan& m, double x, double y) {
  const double t = x * x + y * y;
  const double radial = 1 + m.k1 * t + m.k2 * t * t + m.k3 * t * t * t;
  return {x * radial + 2 * m.p1 * x * y + m.p2 * (t + 2 * x * x),
          y * radial + m.p1 * (t + 2 * y * y) + 2 * m.p2 * x * y};
}
/// Its inverse by Newton's method in two dimensions.
Point2 undistort(const Radtan& m, double mx, double my) {
  double x = mx, y = my;
  for (int i = 0; i < 50; ++i) {
    const double t = x * x + y * y;
    const double radial = 1 + m.k1 * t + m.k2 * t * t + m.k3 * t * t * t;
    const double slope = 2 * (m.k1 + 2 * m.k2 * t + 3 * m.k3 * t * t);
    const double xx = radial + slope * x * x + 2 * m.p1 * y + 6 * m.p2 * x;
    const double yy = radial + slope * y * y + 6 * m.p1 * y + 2 * m.p2 * x;
    const double xy = slope * x * y + 2 * m.p1 * x + 2 * m.p2 * y;
    const auto [dx, dy] = distort(m, x, y);
    const double determinant = xx * yy - xy * xy;
    const double step_x = (yy * (dx - mx) - xy * (dy - my)) / determinant;
    const double step_y = (xx * (dy - my) - xy * (dx - mx)) / determinant;
    x -= step_x;
    y -= step_y;
    if (std::abs(step_x) + std::abs(step_y) <= 1e-15 * (std::abs(x) + std::abs(y))) break;
  }
  return {x, y};
}

Point2 referenceProject(const PinholeRadtan& m, double x, double y, double z) {
  const auto [mx, my] = distort(m.radtan, x / z, y / z);
  return {m.fx * mx + m.cx, m.fy * my + m.cy};
}
Point3 referenceUnproject(const PinholeRadtan& m, double u, double v) {
  const auto [x, y] = undistort(m.radtan, (u - m.cx) / m.fx, (v - m.cy) / m.fy);
  return unit(x, y, 1);
}

Point2 referenceProject(const Eucm& m, double x, double y, double z) {
  const double d = std::sqrt(m.beta * (x * x + y * y) + z * z);
  const double denominator = m.alpha * d + (1 - m.alpha) * z;
  return {m.fx * x / denominator + m.cx, m.fy * y / denominator + m.cy};
}
Point3 referenceUnproject(const Eucm& m, double u, double v) {
  const double mx = (u - m.cx) / m.fx, my = (v - m.cy) / m.fy;
  const double r2 = mx * mx + my * my;
  const double z = (1 - m.beta * m.alpha * m.alpha * r2) /
                   (m.alpha * std::sqrt(1 - (2 * m.alpha - 1) * m.beta * r2) + (1 - m.alpha));
  return unit(mx, my, z);
}

Point2 referenceProject(const DoubleSphere& m, double x, double y, double z) {
  const double r2 = x * x + y * y;
  const double z1 = z + m.xi * std::sqrt(r2 + z * z);
  const double denominator = m.alpha * std::sqrt(r2 + z1 * z1) + (1 - m.alpha) * z1;
  return {m.fx * x / denominator + m.cx, m.fy * y / denominator + m.cy};
}
Point3 referenceUnproject(const DoubleSphere& m, double u, double v) {
  const double mx = (u - m.cx) / m.fx, my = (v - m.cy) / m.fy;
  const double r2 = mx * mx + my * my;
  const double mz = (1 - m.alpha * m.alpha * r2) /
                    (m.alpha * std::sqrt(1 - (2 * m.alpha - 1) * r2) + 1 - m.alpha);
  const double k = (mz * m.xi + std::sqrt(mz * mz + (1 - m.xi * m.xi) * r2)) / (mz * mz + r2);
  return {k * mx, k * my, k * mz - m.xi};
}

Point2 referenceProject(const OmniRadtan& m, double x, double y, double z) {
  const double denominator = z + m.xi * std::sqrt(x * x + y * y + z * z);
  const auto [mx, my] = distort(m.radtan, x / denominator, y / denominator);
  return {m.fx * mx + m.skew * my + m.cx, m.fy * my + m.cy};
}
Point3 referenceUnproject(const OmniRadtan& m, double u, double v) {
  const double my = (v - m.cy) / m.fy;
  const auto [x, y] = undistort(m.radtan, (u - m.cx - m.skew * my) / m.fx, my);
  return liftToSphere(m.xi, x, y);
}

/// -f(rho) and its slope.
std::pair<double, double> forward(const Ocam& m, double rho) {
  double value = 0, slope = 0;
  for (size_t i = m.a.size(); i-- > 0;) {
    slope = slope * rho + value;
    value = value * rho - m.a[i];
  }
  return {value, slope};
}
Point2 referenceProject(const Ocam& m, double x, double y, double z) {
  const double r = std::sqrt(x * x + y * y);
  if (r == 0) return {m.cx, m.cy};
  const double rho = newton(-m.a[0] * std::atan2(r, z), [&](double a) {
    const auto [value, slope] = forward(m, a);
    return std::pair(a * z - value * r, z - slope * r);
  });
  const double px = x / r * rho, py = y / r * rho;
  return {px + m.e * py + m.cx, m.d * px + m.c * py + m.cy};
}
Point3 referenceUnproject(const Ocam& m, double u, double v) {
  const double determinant = m.c - m.d * m.e;
  const double px = (m.c * (u - m.cx) - m.e * (v - m.cy)) / determinant;
  const double py = (v - m.cy - m.d * (u - m.cx)) / determinant;
  return unit(px, py, forward(m, std::sqrt(px * px + py * py)).first);
}

Point2 referenceProject(const ThetaPolynomial& m, double x, double y, double z) {
  const double r = std::sqrt(x * x + y * y);
  if (r == 0) return {m.cx, m.cy};
  const double theta = std::atan2(r, z);
  const double rho = theta * (m.k1 + theta * (m.k2 + theta * (m.k3 + theta * m.k4)));
  return {rho * x / r + m.cx, m.aspect * rho * y / r + m.cy};
}
Point3 referenceUnproject(const ThetaPolynomial& m, double u, double v) {
  const double mx = u - m.cx, my = (v - m.cy) / m.aspect;
  const double rho = std::sqrt(mx * mx + my * my);
  if (rho == 0) return {0, 0, 1};
  const double theta = newton(rho / m.k1, [&](double a) {
    return std::pair(a * (m.k1 + a * (m.k2 + a * (m.k3 + a * m.k4))) - rho,
                     m.k1 + a * (2 * m.k2 + a * (3 * m.k3 + a * 4 * m.k4)));
  });
  const double s = std::sin(theta) / rho;
  return {mx * s, my * s, std::cos(theta)};
}

Point2 referenceProject(const Equirectangular& m, double x, double y, double z) {
  return {m.fx * std::atan2(x, z) + m.cx, m.fy * std::atan2(y, std::sqrt(x * x + z * z)) + m.cy};
}
Point3 referenceUnproject(const Equirectangular& m, double u, double v) {
  const double longitude = (u - m.cx) / m.fx, latitude = (v - m.cy) / m.fy;
  return {std::cos(latitude) * std::sin(longitude),
          std::sin(latitude),
          std::cos(latitude) * std::cos(longitude)};
}

// --- Cameras of about 1280 x 1024, each near one that exists ---

Camera exampleCamera(std::string_view model) {
  const std::map<std::string_view, std::vector<double>> params{
      {"pinhole", {600, 600, 640, 512}},
      // TUM mono, wide angle.
      {"fov", {446.915863, 447.071228, 631.219238, 510.997498, 0.933271}},
      // TUM-VI, 2.5 times as large.
      {"kannala_brandt",
       {477.446, 477.433, 637.83, 512.5, 0.00348238, 0.00071503, -0.00205323, 0.00020293}},
      {"omni", {1.4, 590.5, 589.75, 644.25, 508.5}},
      // EuRoC, 1.7 times as large.
      {"pinhole_radtan",
       {779.71, 777.40, 640.2, 512.3, -0.28340811, 0.07395907, 0.00019359, 1.76187e-05, 0}},
      {"eucm", {0.6, 1.1, 380, 380, 640, 512}},
      {"omni_radtan", {1.4, 900, 899, 640, 512, -0.1, 0.02, 2e-4, -3e-4, 0}},
      {"ocam", {-500, 0, 6e-4, -1e-7, 3e-10, 0, 0, 0, 0, 640, 512, 1.0003, 1e-4, -2e-4}},
      // WoodScape, front view.
      {"theta_polynomial", {339.749, -31.988, 48.275, -7.201, 1, 643.4, 515.8}},
      // TUM-VI, 2.5 times as large.
      {"double_sphere", {-0.17213, 0.59302, 395.7, 395.7, 637.8, 512.4}},
      {"equirectangular", {1280 / (2 * M_PI), 1024 / M_PI, 639.5, 511.5}},
  };
  return makeCamera(model, params.at(model), kWidth, kHeight);
}

// --- Measuring ---

template <class T>
struct Arrays {
  std::vector<T> x, y, z, u, v;
  std::vector<uint8_t> valid;
  explicit Arrays(size_t n) : x(n), y(n), z(n), u(n), v(n), valid(n) {}
};

/// All pixel centres and their rays; the principal point stands in for pixels without a ray.
struct Inputs {
  Arrays<double> in_double{kPoints};
  Arrays<float> in_float{kPoints};

  explicit Inputs(const Camera& camera) {
    const Eigen::Vector2d centre = camera.project(Eigen::Vector3d::UnitZ()).value();
    for (size_t i = 0; i < kPoints; ++i) {
      Eigen::Vector2d pixel(static_cast<double>(i % kWidth), static_cast<double>(i / kWidth));
      auto ray = camera.unproject(pixel);
      if (!ray) {
        pixel = centre;
        ray = Eigen::Vector3d::UnitZ();
      }
      in_double.u[i] = pixel.x();
      in_double.v[i] = pixel.y();
      in_double.x[i] = ray->x();
      in_double.y[i] = ray->y();
      in_double.z[i] = ray->z();
    }
    const auto narrow = [](const std::vector<double>& from, std::vector<float>& to) {
      std::transform(
          from.begin(), from.end(), to.begin(), [](double a) { return static_cast<float>(a); });
    };
    narrow(in_double.u, in_float.u);
    narrow(in_double.v, in_float.v);
    narrow(in_double.x, in_float.x);
    narrow(in_double.y, in_float.y);
    narrow(in_double.z, in_float.z);
  }
};

/// Fails loudly where reference and batch do not compute the same.
template <class M>
void check(const M& m, const Camera& camera, const Arrays<double>& in) {
  Arrays<double> out(kPoints);
  projectAll(camera, in.x, in.y, in.z, out.u, out.v, out.valid);
  double worst_px = 0, worst_rad = 0;
  for (size_t i = 0; i < kPoints; ++i) {
    const auto [u, v] = referenceProject(m, in.x[i], in.y[i], in.z[i]);
    worst_px = std::max({worst_px, std::abs(u - out.u[i]), std::abs(v - out.v[i])});
  }
  unprojectAll(camera, in.u, in.v, out.x, out.y, out.z, out.valid);
  for (size_t i = 0; i < kPoints; ++i) {
    const auto [x, y, z] = referenceUnproject(m, in.u[i], in.v[i]);
    worst_rad = std::max(
        {worst_rad, std::abs(x - out.x[i]), std::abs(y - out.y[i]), std::abs(z - out.z[i])});
  }
  if (!(worst_px <= 1e-9 && worst_rad <= 1e-11)) {
    throw std::runtime_error(std::string(M::kName) + ": batch and reference differ by " +
                             std::to_string(worst_px) + " px, " + std::to_string(worst_rad));
  }
}

const std::map<Simd, std::string> kBuilds{
    {Simd::kPortable, "portable"}, {Simd::kAvx2, "avx2"}, {Simd::kAvx512, "avx512"}};

void measure(const std::string& name, const std::function<void()>& all_points) {
  benchmark::RegisterBenchmark(name.c_str(), [all_points](benchmark::State& state) {
    for (auto _ : state) {
      all_points();
      benchmark::ClobberMemory();
    }
    state.counters["ns/point"] = benchmark::Counter(
        static_cast<double>(kPoints) * 1e-9,
        benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  })->Unit(benchmark::kMillisecond);
}

template <class M>
void addModel() {
  const Camera camera = exampleCamera(M::kName);
  const M m = std::get<M>(camera.model());
  const auto in = std::make_shared<const Inputs>(camera);
  check(m, camera, in->in_double);
  const auto out = std::make_shared<Arrays<double>>(kPoints);
  const auto out_float = std::make_shared<Arrays<float>>(kPoints);
  const std::string name(M::kName);

  measure(name + "/project/reference", [=] {
    const Arrays<double>& a = in->in_double;
    for (size_t i = 0; i < kPoints; ++i) {
      const auto [u, v] = referenceProject(m, a.x[i], a.y[i], a.z[i]);
      out->u[i] = u;
      out->v[i] = v;
    }
  });
  measure(name + "/project/single", [=] {
    const Arrays<double>& a = in->in_double;
    for (size_t i = 0; i < kPoints; ++i) {
      const auto pixel = camera.project({a.x[i], a.y[i], a.z[i]});
      out->valid[i] = pixel.has_value();
      if (!pixel) continue;
      out->u[i] = pixel->x();
      out->v[i] = pixel->y();
    }
  });
  measure(name + "/unproject/reference", [=] {
    const Arrays<double>& a = in->in_double;
    for (size_t i = 0; i < kPoints; ++i) {
      const auto [x, y, z] = referenceUnproject(m, a.u[i], a.v[i]);
      out->x[i] = x;
      out->y[i] = y;
      out->z[i] = z;
    }
  });
  measure(name + "/unproject/single", [=] {
    const Arrays<double>& a = in->in_double;
    for (size_t i = 0; i < kPoints; ++i) {
      const auto ray = camera.unproject({a.u[i], a.v[i]});
      out->valid[i] = ray.has_value();
      if (!ray) continue;
      out->x[i] = ray->x();
      out->y[i] = ray->y();
      out->z[i] = ray->z();
    }
  });
  for (const auto& [simd, build] : kBuilds) {
    if (!simdSupported(simd)) continue;
    const Simd chosen = simd;
    measure(name + "/project/" + build, [=] {
      const Arrays<double>& a = in->in_double;
      projectAll(camera, a.x, a.y, a.z, out->u, out->v, out->valid, chosen);
    });
    measure(name + "/unproject/" + build, [=] {
      const Arrays<double>& a = in->in_double;
      unprojectAll(camera, a.u, a.v, out->x, out->y, out->z, out->valid, chosen);
    });
    measure(name + "/project/" + build + "_float", [=] {
      const Arrays<float>& a = in->in_float;
      projectAll(camera, a.x, a.y, a.z, out_float->u, out_float->v, out_float->valid, chosen);
    });
    measure(name + "/unproject/" + build + "_float", [=] {
      const Arrays<float>& a = in->in_float;
      unprojectAll(
          camera, a.u, a.v, out_float->x, out_float->y, out_float->z, out_float->valid, chosen);
    });
  }
}

/// Keeps the least CPU time of each benchmark's repetitions, and prints as usual.
class LeastTimes : public benchmark::ConsoleReporter {
 public:
  std::map<std::string, double> ns_per_point;

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) continue;
      const double ns = run.GetAdjustedCPUTime() * 1e6 / static_cast<double>(kPoints);
      const auto [known, is_new] = ns_per_point.emplace(run.run_name.function_name, ns);
      if (!is_new) known->second = std::min(known->second, ns);
    }
  }
};

void printTable(const std::map<std::string, double>& ns) {
  std::vector<std::string> columns{"reference", "single"};
  for (const char* type : {"", "_float"}) {
    for (const auto& [simd, build] : kBuilds) columns.push_back(build + type);
  }
  std::printf(
      "\nns per point, least of the repetitions; in brackets: times as fast as the "
      "reference\n%-27s",
      "");
  for (const std::string& column : columns) std::printf("%17s", column.c_str());
  for (const auto& [name, reference] : ns) {
    const size_t slash = name.rfind('/');
    if (name.substr(slash + 1) != "reference") continue;
    std::printf("\n%-27s", name.substr(0, slash).c_str());
    for (const std::string& column : columns) {
      const auto found = ns.find(name.substr(0, slash + 1) + column);
      if (found == ns.end()) {
        std::printf("%17s", "-");
      } else {
        std::printf("%9.2f (%4.1fx)", found->second, reference / found->second);
      }
    }
  }
  std::printf("\n");
}

template <class V>
struct AddModels;
template <class... Ms>
struct AddModels<std::variant<Ms...>> {
  static void run() { (addModel<Ms>(), ...); }
};

int run(int argc, char** argv) {
  // Other programs disturb all benchmarks alike when these take turns.
  std::vector<std::string> defaults{argv[0],
                                    "--benchmark_repetitions=5",
                                    "--benchmark_enable_random_interleaving=true",
                                    "--benchmark_min_time=0.05"};
  std::vector<char*> arguments;
  for (std::string& argument : defaults) arguments.push_back(argument.data());
  arguments.insert(arguments.end(), argv + 1, argv + argc);
  int count = static_cast<int>(arguments.size());
  arguments.push_back(nullptr);
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;
  AddModels<CameraModelVariant>::run();
  LeastTimes reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  printTable(reporter.ns_per_point);
  return 0;
}

}  // namespace
}  // namespace dlsd

int main(int argc, char** argv) {
  return dlsd::run(argc, argv);
}
