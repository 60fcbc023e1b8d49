// RayTable against the camera itself, for every model.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <Eigen/Geometry>
#include <array>
#include <string>

#include "cameras/ray_table.h"
#include "properties/gen.h"
#include "properties/holds.h"

namespace dlsd {
namespace {

/// The camera with another image size: tables of small images are quick to make.
Camera shrunk(const Camera& camera, int width, int height) {
  return {camera.model(), width, height, camera.maxFieldAngleLimit()};
}

struct Seen {
  double err_px = 0, err_rad_excess = 0, derivative = 0;
  long interpolated = 0, covered = 0, asked = 0;
};

void compare(const RayTable& table, double u, double v, Seen* seen) {
  const Camera& camera = table.camera();
  const auto exact = camera.unproject({u, v});
  ++seen->asked;
  RC_ASSERT(table.covers(u, v) == (exact.has_value() && camera.inImage({u, v})));
  if (!exact) return;
  ++seen->covered;
  const RaySample sample = table.at(u, v);
  RC_ASSERT(std::abs(sample.ray.norm() - 1) <= 1e-12);
  const double err_rad = (sample.ray - *exact).norm();
  // By its float nodes: an answer of the camera's own is exact.
  seen->interpolated += err_rad > 0 ? 1 : 0;
  const auto J = camera.jacobian(*exact);
  // Where directions are not resolved the answer is the camera's own.
  if (!J || !(sample.pxPerRad() > 0)) {
    RC_ASSERT(err_rad == 0);
    return;
  }
  const double scale = sample.pxPerRad();
  seen->err_px = std::max(seen->err_px, (err_rad - 2e-7) * scale);
  Eigen::Matrix<double, 3, 2> D;
  D << sample.du, sample.dv;
  if (sample.du.cross(sample.dv).norm() > 1e-9) {
    seen->derivative = std::max(seen->derivative, (*J * D - Eigen::Matrix2d::Identity()).norm());
  }
}

template <class Model>
void expectWithinBounds() {
  Seen all;
  SCOPED_TRACE(Model::kName);
  holds(1, [&] {
    const Camera drawn = *genCamera<Model>(Range::kRealistic);
    // The top left part of the image, as large as keeps a case quick.
    const Camera camera =
        shrunk(drawn, std::min(drawn.width(), 640), std::min(drawn.height(), 512));
    const RayTable table(camera);
    const uint64_t seed = *rc::gen::arbitrary<uint64_t>();
    rc::Random random(seed);
    Seen seen;
    const auto uniform = [&] { return static_cast<double>(random.next() >> 11) * 0x1p-53; };
    for (int i = 0; i < 2000; ++i) {
      compare(table, uniform() * camera.width() - 0.5, uniform() * camera.height() - 0.5, &seen);
    }
    for (const double u : {-0.5, 0.0, camera.width() - 0.5}) {
      for (const double v : {-0.5, 0.0, camera.height() - 0.5}) compare(table, u, v, &seen);
    }
    RC_ASSERT(!table.covers(camera.width() + 0.0, 0));
    RC_ASSERT(seen.err_px <= RayTable::kMaxErrPx);
    RC_ASSERT(seen.derivative <= 1e-3);
    all.err_px = std::max(all.err_px, seen.err_px);
    all.derivative = std::max(all.derivative, seen.derivative);
    all.interpolated += seen.interpolated;
    all.covered += seen.covered;
    all.asked += seen.asked;
  });
  EXPECT_GT(all.covered, all.asked / 4);
  EXPECT_GT(all.interpolated, all.covered / 2) << "hardly anything was interpolated";
  std::cout << Model::kName << ": largest error " << all.err_px << " px, of the derivatives "
            << all.derivative << "; interpolated " << all.interpolated << " of " << all.covered
            << "\n";
}

TEST(RayTableSuite, RaysOfEveryModelAreWithinTheStatedError) {
  const auto run = []<size_t... I>(std::index_sequence<I...>) {
    (expectWithinBounds<std::variant_alternative_t<I, CameraModelVariant>>(), ...);
  };
  run(std::make_index_sequence<std::variant_size_v<CameraModelVariant>>());
}

// A night's find: in the middle of a cell the errors along its two directions cancelled, while on
// its left side there was 0.0012 px.
TEST(RayTableSuite, WhereErrorsCancelInTheMiddleOfACellItsSidesAreGood) {
  const Camera camera = makeCamera("kannala_brandt",
                                   std::array{441.99109405725602,
                                              427.79390919494222,
                                              202.11708588890454,
                                              579.74116120489145,
                                              0.0041188111819424889,
                                              -0.0085985037476946843,
                                              -0.019315960664983995,
                                              0.0046615458813616022},
                                   386,
                                   512);
  const RayTable table(camera);
  Seen seen;
  for (int y = 0; y < 8 * camera.height(); ++y) {
    for (int x = 0; x < 8 * camera.width(); x += y % 64 == 0 ? 1 : 8) {
      compare(table, x / 8.0 - 0.5, y / 8.0 - 0.5, &seen);
    }
  }
  EXPECT_LE(seen.err_px, RayTable::kMaxErrPx);
  EXPECT_LE(seen.derivative, 1e-3);
  EXPECT_GT(seen.interpolated, seen.covered / 2);
}

TEST(RayTableSuite, ImagesOfAnySize) {
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 9}, {8, 8}, {9, 8}, {7, 17}, {64, 1}}) {
    const Camera camera = makeCamera("pinhole", std::array{40.0, 41.0, 1.0, 2.0}, w, h);
    const RayTable table(camera);
    for (const double u : {-0.5, 0.0, w - 0.5}) {
      for (const double v : {-0.5, 0.0, h - 0.5}) {
        ASSERT_TRUE(table.covers(u, v));
        EXPECT_LE((table.at(u, v).ray - camera.unproject({u, v}).value()).norm(), 1e-3 / 40);
      }
    }
    EXPECT_FALSE(table.covers(w + 0.0, 0));
    EXPECT_FALSE(table.covers(0, -0.51));
    EXPECT_FALSE(table.covers(std::nan(""), 0));
  }
}

}  // namespace
}  // namespace dlsd
