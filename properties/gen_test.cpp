#include "properties/gen.h"

#include <gmock/gmock.h>
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

#include "cameras/calibration/files.h"
#include "properties/holds.h"
#include "properties/worst.h"

namespace dlsd {
namespace {

template <class T>
std::vector<T> draws(const rc::Gen<T>& gen, int count) {
  std::vector<T> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(gen(rc::Random(static_cast<uint64_t>(i))).value());
  }
  return values;
}

/// Follows the first failing shrink until there is none.
template <class T, class Fails>
T shrunk(const rc::Gen<T>& gen, const Fails& fails) {
  for (uint64_t seed = 0;; ++seed) {
    rc::Shrinkable<T> current = gen(rc::Random(seed));
    if (!fails(current.value())) continue;
    for (bool moved = true; moved;) {
      moved = false;
      auto candidates = current.shrinks();
      while (auto candidate = candidates.next()) {
        if (fails(candidate->value())) {
          current = *candidate;
          moved = true;
          break;
        }
      }
    }
    return current.value();
  }
}

TEST(GenReal, StaysInItsRangeAndSpreads) {
  for (const auto& [lo, hi] : std::initializer_list<std::pair<double, double>>{
           {0, 1}, {-3, 5}, {-1e6, 1e6}, {1e-3, 1e7}, {2, 2}, {-1e-300, 1e300}}) {
    const auto values = draws(genReal(lo, hi), 4000);
    std::array<int, 10> bins{};
    for (const double x : values) {
      ASSERT_GE(x, lo);
      ASSERT_LE(x, hi);
      if (hi > lo) ++bins[static_cast<size_t>(std::min((x - lo) / (hi - lo) * 10, 9.0))];
    }
    // 350 expected per inner bin; 6 standard deviations are 106.
    for (size_t i = 1; i < 9 && hi > lo; ++i) EXPECT_NEAR(bins[i], 350, 106) << i;
  }
}

TEST(GenReal, OneDrawInEightIsAtOrNextToABound) {
  const auto values = draws(genReal(-3, 5), 8000);
  const auto count = [&](double lo, double hi) {
    return std::count_if(
        values.begin(), values.end(), [&](double x) { return x >= lo && x <= hi; });
  };
  EXPECT_NEAR(static_cast<double>(count(-3, -3)), 250, 95);
  EXPECT_NEAR(static_cast<double>(count(5, 5)), 250, 95);
  EXPECT_NEAR(static_cast<double>(count(-3, -3 + 1e-12)), 500, 130);
  EXPECT_NEAR(static_cast<double>(count(5 - 1e-12, 5)), 500, 130);
}

TEST(GenReal, ShrinksToTheLeastFailingValue) {
  EXPECT_EQ(shrunk(genReal(0, 100), [](double) { return true; }), 0);
  EXPECT_EQ(shrunk(genReal(-7, 100), [](double) { return true; }), -7);
  EXPECT_NEAR(shrunk(genReal(0, 100), [](double x) { return x >= 12.345; }), 12.345, 1e-13);
  EXPECT_NEAR(shrunk(genReal(-50, 50), [](double x) { return x > std::numbers::pi; }),
              std::numbers::pi,
              1e-13);
  EXPECT_EQ(shrunk(genReal(-50, 50), [](double x) { return x >= 50; }), 50);
}

TEST(GenLogReal, SpreadsOverTheDecades) {
  const auto values = draws(genLogReal(1e-3, 1e7), 4000);
  std::array<int, 10> decades{};
  for (const double x : values) {
    ASSERT_GE(x, 1e-3);
    ASSERT_LE(x, 1e7);
    ++decades[static_cast<size_t>(std::clamp(std::log10(x) + 3, 0.0, 9.0))];
  }
  for (size_t i = 1; i < 9; ++i) EXPECT_NEAR(decades[i], 350, 106) << i;
  EXPECT_EQ(shrunk(genLogReal(1e-3, 1e7), [](double) { return true; }), 1e-3);
  EXPECT_EQ(*std::max_element(values.begin(), values.end()), 1e7);
}

TEST(GenInt, ReachesAllValuesAndShrinksToTheLeast) {
  const auto values = draws(genInt(-2, 3), 500);
  EXPECT_EQ(std::set<int>(values.begin(), values.end()), (std::set<int>{-2, -1, 0, 1, 2, 3}));
  EXPECT_EQ(shrunk(genInt(-2, 3000), [](int i) { return i >= 17; }), 17);
  EXPECT_EQ(draws(genInt(5, 5), 3), (std::vector<int>{5, 5, 5}));
}

TEST(GenParam, StaysInTheTable) {
  for (const Range range : {Range::kRealistic, Range::kAdmissible}) {
    for (const std::string_view model : cameraModelNames()) {
      for (const ParamSpec& spec : paramSpecsOf(model)) {
        const bool realistic = range == Range::kRealistic;
        for (const double x : draws(genParam(spec, range), 500)) {
          ASSERT_GE(x, realistic ? spec.realistic_min : spec.min) << spec.name;
          ASSERT_LE(x, realistic ? spec.realistic_max : spec.max) << spec.name;
        }
      }
    }
  }
}

TEST(GenCamera, RealisticCamerasSeeSomethingInMostOfTheirPixels) {
  for (const std::string_view model : cameraModelNames()) {
    int seen = 0, limited = 0, with_blind_corner = 0;
    const auto cameras = draws(genCamera(model, Range::kRealistic), 300);
    for (const Camera& camera : cameras) {
      EXPECT_EQ(camera.modelName(), model);
      EXPECT_GE(camera.maxFieldAngle(), 0.3);
      limited += static_cast<int>(camera.maxFieldAngleLimit() < M_PI);
      with_blind_corner += static_cast<int>(!camera.unproject({-0.5, -0.5}).has_value());
      for (int i = 0; i < 100; ++i) {
        seen += static_cast<int>(camera
                                     .unproject({(i % 10 + 0.5) / 10 * camera.width(),
                                                 (i / 10 + 0.5) / 10 * camera.height()})
                                     .has_value());
      }
      ASSERT_TRUE(camera.unproject(principalPoint(camera)).has_value());
    }
    EXPECT_GT(seen, 300 * 70) << model;
    EXPECT_NEAR(limited, 75 + 9, 50) << model;
    EXPECT_GT(with_blind_corner, 5) << model;
  }
}

TEST(GenCamera, AnyModelIsDrawn) {
  std::set<std::string_view> models;
  for (const Camera& c : draws(genAnyCamera(Range::kAdmissible), 100)) models.insert(c.modelName());
  EXPECT_EQ(models.size(), std::variant_size_v<CameraModelVariant>);
}

TEST(GenRay, IsUniformOnTheSphereAndShrinksToTheAxis) {
  const auto rays = draws(genRay(), 8000);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& ray : rays) {
    ASSERT_NEAR(ray.norm(), 1, 1e-15);
    mean += ray / 8000;
    second += ray * ray.transpose() / 8000;
  }
  // Azimuth 0 and the poles are drawn more often than the rest, by 1 in 8 each.
  EXPECT_LT(mean.norm(), 0.1);
  EXPECT_LT((second - Eigen::Matrix3d::Identity() / 3).norm(), 0.15);
  EXPECT_EQ(shrunk(genRay(), [](const Eigen::Vector3d&) { return true; }),
            Eigen::Vector3d(0, 0, 1));
}

TEST(GenRay, NearBoundIsOnBothSides) {
  const Camera camera = makeCamera("omni", std::vector<double>{2, 500, 500, 320, 240}, 640, 480);
  const double bound = 2 * M_PI / 3;
  int inside = 0, outside = 0, close = 0;
  for (const Eigen::Vector3d& ray : draws(genRayNearBound(camera), 1000)) {
    const double angle = std::atan2(ray.head<2>().norm(), ray.z());
    inside += static_cast<int>(angle < bound);
    outside += static_cast<int>(angle > bound);
    close += static_cast<int>(std::abs(angle - bound) < 1e-9);
  }
  EXPECT_GT(inside, 250);
  EXPECT_GT(outside, 250);
  EXPECT_GT(close, 250);
}

TEST(GenPixel, BorderAndInsideAreInTheImage) {
  const Camera camera = makeCamera("pinhole", std::vector<double>{500, 500, 320, 240}, 640, 480);
  std::set<std::pair<int, double>> sides;
  for (const Eigen::Vector2d& p : draws(genPixelInImage(camera), 500))
    ASSERT_TRUE(camera.inImage(p));
  for (const Eigen::Vector2d& p : draws(genPixelOnBorder(camera), 500)) {
    ASSERT_TRUE(camera.inImage(p));
    const bool on_u = p.x() == -0.5 || p.x() == 639.5, on_v = p.y() == -0.5 || p.y() == 479.5;
    ASSERT_TRUE(on_u || on_v) << p.transpose();
    if (on_u) sides.insert({0, p.x()});
    if (on_v) sides.insert({1, p.y()});
  }
  EXPECT_EQ(sides.size(), 4U);
}

TEST(GenPixel, NearBoundIsOnBothSidesOfTheFold) {
  const Camera camera = makeCamera("omni", std::vector<double>{2, 500, 500, 320, 240}, 640, 480);
  int inside = 0, outside = 0;
  for (const Eigen::Vector2d& p : draws(genPixelNearBound(camera), 1000)) {
    (camera.unproject(p) ? inside : outside)++;
  }
  EXPECT_GT(inside, 250);
  EXPECT_GT(outside, 250);
}

TEST(GenCamera, IsShownInFull) {
  std::ostringstream out;
  showValue(makeCamera("pinhole", std::vector<double>{0.1, 2, 3, 4}, 640, 480), out);
  EXPECT_EQ(out.str(),
            "pinhole(fx = 0.10000000000000001, fy = 2, cx = 3, cy = 4) 640 x 480, limit "
            "3.1415926535897931 rad");
}

// --- holds ---

void holdsUpTo10() {
  holds(1, [] {
    const int drawn = *genInt(0, 1000);
    if (drawn > 10) RC_FAIL("is more than 10");
  });
}

// Also where there is no time for shrinking, the case that failed is shown with what it drew.
TEST(Holds, ShowsTheCaseThatFails) {
  EXPECT_NONFATAL_FAILURE(holdsUpTo10(), "\nint:\n11\n");
  EXPECT_NONFATAL_FAILURE(holdsUpTo10(), "is more than 10");
  ASSERT_EQ(setenv("DLSD_SHRINK_SECONDS", "0", 1), 0);
  EXPECT_NONFATAL_FAILURE(holdsUpTo10(), "\nint:\n");
  EXPECT_NONFATAL_FAILURE(holdsUpTo10(), "is more than 10");
  ASSERT_EQ(unsetenv("DLSD_SHRINK_SECONDS"), 0);
}

TEST(Holds, FailsWhereMostCasesAreDiscarded) {
  EXPECT_NONFATAL_FAILURE(holds(1, [] { RC_PRE(*genInt(0, 9) == 0); }), "Gave up");
}

TEST(Holds, CountsItsCases) {
  const auto wanted = std::max(10, rc::detail::configuration().testParams.maxSuccess / 2);
  EXPECT_EQ(holds(0.5, [] { RC_ASSERT(*genInt(0, 9) <= 9); }), wanted);
}

TEST(Holds, CountsNoCasesThatAreDiscarded) {
  long judged = 0;
  const long cases = holds(0.5, [&] {
    RC_PRE(*genInt(0, 9) < 7);
    ++judged;
  });
  EXPECT_GE(cases, 10);
  EXPECT_EQ(cases, judged);
}

// What is tested may throw: a failure as others, shrunk for as long as others.
long calls_after_failure = 0;
void throwsAbove10() {
  bool has_failed = false;
  calls_after_failure = 0;
  holds(1, [&] {
    calls_after_failure += has_failed ? 1 : 0;
    if (*genInt(0, 1000) <= 10) return;
    has_failed = true;
    throw std::runtime_error("thrown above 10");
  });
}
TEST(Holds, AnExceptionIsAFailure) {
  EXPECT_NONFATAL_FAILURE(throwsAbove10(), "\nint:\n11\n");
  EXPECT_NONFATAL_FAILURE(throwsAbove10(), "thrown above 10");
  EXPECT_GT(calls_after_failure, 1);
  ASSERT_EQ(setenv("DLSD_SHRINK_SECONDS", "0", 1), 0);
  EXPECT_NONFATAL_FAILURE(throwsAbove10(), "thrown above 10");
  ASSERT_EQ(unsetenv("DLSD_SHRINK_SECONDS"), 0);
  EXPECT_LE(calls_after_failure, 1);
}

// --- Worst ---

TEST(Worst, KeepsTheWorstOfEachKindAndNaNForGood) {
  const std::string path = testing::TempDir() + "worst_test.tsv";
  std::filesystem::remove(path);
  const char* given = std::getenv("DLSD_WORST");
  const std::string kept = given != nullptr ? given : "";
  ASSERT_EQ(setenv("DLSD_WORST", path.c_str(), 1), 0);
  {
    Worst worst("error, px", {"some", "others", "none"});
    for (const double value : {1.0, 3.0, 2.0}) worst.see(value, 0);
    for (const double value : {1.0, std::nan(""), 7.0, 0.5}) worst.see(value, 1);
    EXPECT_EQ(worst.count(), 7);
  }
  ASSERT_EQ(given != nullptr ? setenv("DLSD_WORST", kept.c_str(), 1) : unsetenv("DLSD_WORST"), 0);
  const std::string test = "Worst.KeepsTheWorstOfEachKindAndNaNForGood\terror, px\t";
  EXPECT_EQ(readFile(path),
            test + "some\t3\t3\n" + test + "others\tnan\t4\n" + test + "none\t0\t0\n");
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace dlsd
