// What must hold for batches of points, for every camera model, scalar type and build of the loops.
// A new model needs a row in kBudgets.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <iomanip>
#include <limits>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "cameras/batch.h"
#include "cameras/calibration/files.h"
#include "properties/gen.h"
#include "properties/holds.h"
#include "properties/oracle.h"
#include "properties/worst.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// --- Error budgets inside the image of realistic cameras of at most 4000 x 4000 px, in px:
// deviation of a projection from the equations in long double; of a ray from the one that these map
// to the pixel, as the angle times the smallest singular value of the Jacobian, that is by how far
// the pixel would have to move. docs/cameras.md has the same table. ---

struct Budget {
  std::string_view model;
  double project_px, unproject_px;              ///< Of double.
  double float_project_px, float_unproject_px;  ///< Of float.
};
constexpr Budget kBudgets[] = {
    {"pinhole", 2e-12, 2e-12, 8e-4, 8e-4},
    {"fov", 2e-12, 2e-12, 1e-3, 1e-3},
    {"kannala_brandt", 3e-12, 3e-12, 2e-3, 2e-3},
    {"omni", 3e-12, 2e-12, 1.5e-3, 1e-3},
    {"pinhole_radtan", 4e-12, 2e-12, 3e-3, 1e-3},
    {"omni_radtan", 4e-12, 2e-12, 3e-3, 1e-3},
    {"ocam", 4e-12, 2e-12, 3e-3, 1e-3},
    {"theta_polynomial", 4e-12, 2e-12, 3e-3, 1e-3},
    {"eucm", 3e-12, 2e-12, 2e-3, 1e-3},
    {"double_sphere", 4e-12, 3e-12, 3e-3, 2e-3},
    {"equirectangular", 3e-12, 3e-12, 2e-3, 2e-3},
};

Budget budgetOf(std::string_view model) {
  for (const Budget& budget : kBudgets) {
    if (budget.model == model) return budget;
  }
  ADD_FAILURE() << "kBudgets has no row for " << model;
  return {model, 0, 0, 0, 0};
}

/// Validity in float may differ from that in double within this relative distance of a bound.
constexpr double kFloatBand = 1e-5;

// --- Helpers ---

std::vector<Simd> supportedBuilds() {
  std::vector<Simd> builds;
  for (const Simd simd : {Simd::kPortable, Simd::kAvx2, Simd::kAvx512}) {
    if (simdSupported(simd)) builds.push_back(simd);
  }
  return builds;
}

/// Rays and pixels as arrays. Outputs of one call and inputs of the other.
template <class T>
struct Arrays {
  std::vector<T> x, y, z, u, v;
  std::vector<uint8_t> valid;
  explicit Arrays(size_t n) : x(n), y(n), z(n), u(n), v(n), valid(n, 7) {}
  explicit Arrays(const std::vector<Vector3d>& rays) : Arrays(rays.size()) {
    for (size_t i = 0; i < rays.size(); ++i) {
      x[i] = static_cast<T>(rays[i].x());
      y[i] = static_cast<T>(rays[i].y());
      z[i] = static_cast<T>(rays[i].z());
    }
  }
  explicit Arrays(const std::vector<Vector2d>& pixels) : Arrays(pixels.size()) {
    for (size_t i = 0; i < pixels.size(); ++i) {
      u[i] = static_cast<T>(pixels[i].x());
      v[i] = static_cast<T>(pixels[i].y());
    }
  }
  [[nodiscard]] size_t size() const { return x.size(); }
  [[nodiscard]] Vector3d ray(size_t i) const {
    return {static_cast<double>(x[i]), static_cast<double>(y[i]), static_cast<double>(z[i])};
  }
  [[nodiscard]] Vector2d pixel(size_t i) const {
    return {static_cast<double>(u[i]), static_cast<double>(v[i])};
  }
  void project(const Camera& camera, Simd simd) {
    projectAll(camera,
               std::span<const T>(x),
               std::span<const T>(y),
               std::span<const T>(z),
               std::span<T>(u),
               std::span<T>(v),
               valid,
               simd);
  }
  void unproject(const Camera& camera, Simd simd) {
    unprojectAll(camera,
                 std::span<const T>(u),
                 std::span<const T>(v),
                 std::span<T>(x),
                 std::span<T>(y),
                 std::span<T>(z),
                 valid,
                 simd);
  }
};

/// Many draws of one generator; only cameras shrink.
template <class T>
struct Draws {
  std::vector<T> values;
};
template <class T>
void showValue(const Draws<T>& draws, std::ostream& out) {
  out << draws.values.size() << " draws";
}
template <class T>
std::vector<T> draw(const rc::Gen<std::vector<T>>& gen) {
  return (*rc::gen::noShrink(
              rc::gen::map(gen, [](std::vector<T> values) { return Draws<T>{std::move(values)}; })))
      .values;
}
template <class T>
std::vector<T> draw(size_t count, const rc::Gen<T>& gen) {
  return draw(rc::gen::container<std::vector<T>>(count, gen));
}

/// Values that break kernels written without them in mind.
rc::Gen<double> genHostile() {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  return rc::gen::elementOf(std::vector<double>{0.0,
                                                -0.0,
                                                kNan,
                                                kInf,
                                                -kInf,
                                                1.0,
                                                -1.0,
                                                5e-324,
                                                1e-160,
                                                1e-40,
                                                1e-19,
                                                1e19,
                                                1e38,
                                                1e160,
                                                1e9});
}

/// One in eight of them hostile.
rc::Gen<std::vector<Vector3d>> genRays(const Camera& camera, size_t count) {
  const rc::Gen<Vector3d> ordinary = genRayFor(camera);
  const rc::Gen<Vector3d> hostile =
      rc::gen::map(rc::gen::tuple(genHostile(), genHostile(), genHostile()),
                   [](const std::tuple<double, double, double>& t) {
                     return Vector3d(std::get<0>(t), std::get<1>(t), std::get<2>(t));
                   });
  return rc::gen::container<std::vector<Vector3d>>(
      count,
      rc::gen::mapcat(genInt(0, 7), [=](int kind) { return kind == 7 ? hostile : ordinary; }));
}
rc::Gen<std::vector<Vector2d>> genPixels(const Camera& camera, size_t count) {
  const rc::Gen<Vector2d> ordinary = genPixelFor(camera);
  const rc::Gen<Vector2d> hostile =
      rc::gen::map(rc::gen::pair(genHostile(), genHostile()),
                   [](const std::pair<double, double>& p) { return Vector2d(p.first, p.second); });
  return rc::gen::container<std::vector<Vector2d>>(
      count,
      rc::gen::mapcat(genInt(0, 7), [=](int kind) { return kind == 7 ? hostile : ordinary; }));
}

double fieldAngle(const Vector3d& ray) {
  return std::atan2(std::hypot(ray.x(), ray.y()), ray.z());
}
double angleBetween(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

template <class Point>
std::string describe(const Camera& camera, const Point& point, double error) {
  std::ostringstream text;
  text << std::setprecision(17) << camera << " at " << point.transpose() << ": " << error;
  return text.str();
}

/// By model name.
class BatchSuite : public ::testing::TestWithParam<std::string_view> {};
INSTANTIATE_TEST_SUITE_P(,
                         BatchSuite,
                         ::testing::ValuesIn(cameraModelNames()),
                         [](const auto& test) { return std::string(test.param); });

Range drawRange() {
  return *genInt(0, 2) == 2 ? Range::kAdmissible : Range::kRealistic;
}

// --- Every build, every length ---

/// Calls `body` with lengths 0 ... 3 W + 1 for the widest vector W there is (64 floats, when loops
/// are interleaved), and with those around a block of the loops.
template <class Body>
void forLengths(const Body& body) {
  for (size_t n = 0; n <= 3 * 64 + 1; ++n) body(n);
  for (const size_t n : std::initializer_list<size_t>{511, 512, 513, 1023, 1024, 1025}) body(n);
}

/// The value of a generator for a seed.
template <class T>
T sample(const rc::Gen<T>& gen, uint64_t seed) {
  return gen(rc::Random(seed), rc::kNominalSize).value();
}

template <class T>
void everyLengthIsServedAndNothingElse(const Camera& camera, uint64_t seed, long& compared) {
  constexpr size_t kMost = 1025, kGuard = 70;
  constexpr T kUntouched = T(-12345.5);
  Arrays<T> rays(sample(genRays(camera, kMost), seed));
  Arrays<T> pixels(sample(genPixels(camera, kMost), seed));
  rays.project(camera, Simd::kPortable);
  pixels.unproject(camera, Simd::kPortable);
  const auto expectSame = [&](const std::vector<T>& all, const std::vector<T>& part, size_t n) {
    for (size_t i = 0; i < n; ++i) ASSERT_TRUE(part[i] == all[i] || std::isnan(all[i])) << n;
    for (size_t i = n; i < part.size(); ++i) ASSERT_EQ(part[i], kUntouched) << n;
  };
  for (const Simd simd : supportedBuilds()) {
    forLengths([&](size_t n) {
      std::vector<T> a(n + kGuard, kUntouched), b = a, c = a;
      std::vector<uint8_t> valid(n + kGuard, 7);
      const auto in = [&](const std::vector<T>& v) { return std::span<const T>(v).first(n); };
      const auto out = [&](std::vector<T>& v) { return std::span<T>(v).first(n); };
      const auto flags = std::span<uint8_t>(valid).first(n);
      const auto expectSameFlags = [&](const std::vector<uint8_t>& all) {
        for (size_t i = 0; i < n; ++i) ASSERT_EQ(valid[i], all[i]) << n;
        for (size_t i = n; i < valid.size(); ++i) ASSERT_EQ(valid[i], 7) << n;
      };
      projectAll(camera, in(rays.x), in(rays.y), in(rays.z), out(a), out(b), flags, simd);
      expectSame(rays.u, a, n);
      expectSame(rays.v, b, n);
      expectSameFlags(rays.valid);
      a.assign(n + kGuard, kUntouched);
      b = a;
      unprojectAll(camera, in(pixels.u), in(pixels.v), out(a), out(b), out(c), flags, simd);
      expectSame(pixels.x, a, n);
      expectSame(pixels.y, b, n);
      expectSame(pixels.z, c, n);
      expectSameFlags(pixels.valid);
      compared += static_cast<long>(2 * n);
    });
  }
}

TEST_P(BatchSuite, EveryLengthIsServedAndNothingElse) {
  long compared = 0;
  for (uint64_t seed = 0; seed < 4; ++seed) {
    const Camera camera =
        sample(genCamera(GetParam(), seed == 0 ? Range::kAdmissible : Range::kRealistic), seed);
    everyLengthIsServedAndNothingElse<float>(camera, seed, compared);
    everyLengthIsServedAndNothingElse<double>(camera, seed, compared);
  }
  EXPECT_GE(compared, 4 * 2 * 2 * (193 * 194 / 2 + 4608));
}

template <class T>
void buildsGiveTheSameBits(const Camera& camera, long& compared) {
  Arrays<T> rays(draw(genRays(camera, 97))), pixels(draw(genPixels(camera, 97)));
  rays.project(camera, Simd::kPortable);
  pixels.unproject(camera, Simd::kPortable);
  for (const Simd simd : supportedBuilds()) {
    Arrays<T> again_rays = rays, again_pixels = pixels;
    again_rays.project(camera, simd);
    again_pixels.unproject(camera, simd);
    for (size_t i = 0; i < rays.size(); ++i) {
      RC_ASSERT(rays.valid[i] == again_rays.valid[i]);
      RC_ASSERT(pixels.valid[i] == again_pixels.valid[i]);
      if (rays.valid[i] == 1) RC_ASSERT(rays.pixel(i) == again_rays.pixel(i));
      if (pixels.valid[i] == 1) RC_ASSERT(pixels.ray(i) == again_pixels.ray(i));
      ++compared;
    }
  }
  for (size_t i = 0; i < rays.size(); ++i) {
    // valid implies finite.
    if (rays.valid[i] == 1) RC_ASSERT(rays.pixel(i).allFinite() && rays.ray(i).allFinite());
    if (pixels.valid[i] == 1) RC_ASSERT(pixels.ray(i).allFinite() && pixels.pixel(i).allFinite());
    if constexpr (std::is_same_v<T, double>) {
      const auto pixel = camera.project(rays.ray(i));
      RC_ASSERT(rays.valid[i] == (pixel ? 1 : 0));
      if (pixel) RC_ASSERT(*pixel == rays.pixel(i));
      const auto ray = camera.unproject(pixels.pixel(i));
      RC_ASSERT(pixels.valid[i] == (ray ? 1 : 0));
      if (ray) RC_ASSERT(*ray == pixels.ray(i));
    }
  }
}

TEST_P(BatchSuite, BuildsAndSinglePointsGiveTheSameBits) {
  long compared = 0;
  const long cases = holds(1, [&] {
    const Camera camera = *genCamera(GetParam(), drawRange());
    buildsGiveTheSameBits<double>(camera, compared);
    buildsGiveTheSameBits<float>(camera, compared);
  });
  EXPECT_EQ(compared, cases * 2 * 97 * static_cast<long>(supportedBuilds().size()));
  EXPECT_GT(cases, 0);
}

TEST(Batch, ABuildThatTheProcessorLacksIsRefused) {
  const Camera camera = makeCamera("pinhole", std::vector<double>{1, 1, 0, 0}, 4, 4);
  Arrays<double> points(3);
  for (const Simd simd : {Simd::kPortable, Simd::kAvx2, Simd::kAvx512}) {
    if (simdSupported(simd)) {
      EXPECT_NO_THROW(points.project(camera, simd));
    } else {
      EXPECT_THROW(points.project(camera, simd), std::invalid_argument);
      EXPECT_THROW(points.unproject(camera, simd), std::invalid_argument);
    }
  }
  EXPECT_TRUE(simdSupported(widestSimd()));
}

// --- Budgets ---

template <class T>
constexpr bool kIsFloat = std::is_same_v<T, float>;

/// What a unit ray of T resolves there, px: a rounding of 2 eps times the Jacobian's largest
/// singular value. None at the fold itself.
template <class T>
std::optional<double> resolutionPx(const Camera& camera, const Vector3d& ray) {
  const auto J = camera.jacobian(ray);
  if (!J) return std::nullopt;
  const Eigen::JacobiSVD<ProjectionJacobian> svd(*J);
  return svd.singularValues()(0) * 2 * static_cast<double>(std::numeric_limits<T>::epsilon());
}

/// Near the fold of an OCam, where rays of T are further apart than the budget, in px, they are
/// allowed that; such rays are counted.
template <class T>
void projectionKeepsItsBudget(const Camera& camera,
                              double budget,
                              Worst& worst,
                              Worst& unresolved) {
  Arrays<T> points(draw(64, genRayFor(camera)));
  points.project(camera, widestSimd());
  for (size_t i = 0; i < points.size(); ++i) {
    const Vector3d ray = points.ray(i);
    const auto exact = oracleProject(camera.model(), ray.x(), ray.y(), ray.z());
    const auto in_double = camera.project(ray);
    if (kIsFloat<T> && (points.valid[i] == 1) != in_double.has_value()) {
      const double off = fieldAngle(ray) / camera.maxFieldAngle() - 1;
      const double size = points.pixel(i).cwiseAbs().maxCoeff();
      if (!(std::abs(off) <= kFloatBand) && !(size > 0.99 * kMaxPixel)) {
        RC_FAIL("validity: " + describe(camera, ray, off));
      }
    }
    if (points.valid[i] == 0 || !in_double || !exact) continue;
    if (!camera.inImage(*in_double)) continue;
    const Vector2d truth(static_cast<double>((*exact)[0]), static_cast<double>((*exact)[1]));
    const double error = (points.pixel(i) - truth).norm();
    double allowed = budget;
    if (std::holds_alternative<Ocam>(camera.model())) {
      const auto resolution = resolutionPx<T>(camera, ray);
      if (!resolution) continue;
      if (!(*resolution <= budget)) {
        allowed = budget + *resolution;
        unresolved.see(error / allowed);
      }
    }
    if (allowed == budget) worst.see(error);
    if (!(error <= allowed)) RC_FAIL(describe(camera, ray, error));
  }
}

/// The ray of a pixel, from that of Camera by one Newton step on the equations in long double.
Vector3d exactRay(const Camera& camera, const Vector2d& pixel, const Vector3d& near) {
  const auto exact = oracleProject(camera.model(), near.x(), near.y(), near.z());
  const auto J = camera.jacobian(near);
  if (!exact || !J) return near;
  const Vector2d residual(static_cast<double>((*exact)[0] - static_cast<long double>(pixel.x())),
                          static_cast<double>((*exact)[1] - static_cast<long double>(pixel.y())));
  return near - J->completeOrthogonalDecomposition().solve(residual);
}

template <class T>
void unprojectionKeepsItsBudget(const Camera& camera, double budget, Worst& worst) {
  Arrays<T> points(draw(64, rc::gen::oneOf(genPixelInImage(camera), genPixelOnBorder(camera))));
  points.unproject(camera, widestSimd());
  const Vector2d c = principalPoint(camera);
  for (size_t i = 0; i < points.size(); ++i) {
    const Vector2d pixel = points.pixel(i);
    const auto in_double = camera.unproject(pixel);
    if (kIsFloat<T> && (points.valid[i] == 1) != in_double.has_value()) {
      // Then a little further in or out it must change in double, too.
      const bool in = camera.unproject(c + (pixel - c) * (1 - kFloatBand)).has_value();
      const bool out = camera.unproject(c + (pixel - c) * (1 + kFloatBand)).has_value();
      if (in == out) RC_FAIL("validity: " + describe(camera, pixel, 0));
    }
    if (points.valid[i] == 0 || !in_double) continue;
    const auto J = camera.jacobian(*in_double);
    if (!J) continue;
    const Eigen::JacobiSVD<ProjectionJacobian> svd(*J);
    const double error =
        angleBetween(points.ray(i), exactRay(camera, pixel, *in_double)) * svd.singularValues()(1);
    worst.see(error);
    if (!(error <= budget)) RC_FAIL(describe(camera, pixel, error));
  }
}

template <class T>
void budgetsAreKept(std::string_view model) {
  const Budget budget = budgetOf(model);
  Worst project(kIsFloat<T> ? "projection in float, px" : "projection, px");
  Worst unresolved("projection where rays do not resolve the budget, over what they do");
  Worst unproject(kIsFloat<T> ? "unprojection in float, px" : "unprojection, px");
  holds(1, [&] {
    const Camera camera = *genCamera(model, Range::kRealistic);
    projectionKeepsItsBudget<T>(
        camera, kIsFloat<T> ? budget.float_project_px : budget.project_px, project, unresolved);
    unprojectionKeepsItsBudget<T>(
        camera, kIsFloat<T> ? budget.float_unproject_px : budget.unproject_px, unproject);
  });
  EXPECT_GT(project.count(), 1000);
  EXPECT_LE(unresolved.count(), project.count() / 100);
  EXPECT_GT(unproject.count(), 1000);
}

TEST_P(BatchSuite, TheDocumentedBudgetsAreThese) {
  const Budget budget = budgetOf(GetParam());
  std::ostringstream row;
  row << "| " << budget.model << " | " << budget.project_px << " | " << budget.unproject_px << " | "
      << budget.float_project_px << " | " << budget.float_unproject_px << " |";
  const std::string docs = readFile(std::string(DLSD_SOURCE_DIR) + "/docs/cameras.md");
  EXPECT_NE(docs.find(row.str()), std::string::npos) << "docs/cameras.md lacks the row\n"
                                                     << row.str();
}

TEST_P(BatchSuite, DoublesKeepTheirBudget) {
  budgetsAreKept<double>(GetParam());
}
TEST_P(BatchSuite, FloatsKeepTheirBudget) {
  budgetsAreKept<float>(GetParam());
}

}  // namespace
}  // namespace dlsd
