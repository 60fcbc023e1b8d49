#include "cameras/conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace dlsd {
namespace {

constexpr double kDegree = M_PI / 180;

Camera tumVi() {
  return makeCamera(
      "kannala_brandt",
      std::vector{190.978, 190.973, 254.932, 256.897, 0.003482, 0.000715, -0.002053, 0.000203},
      512,
      512);
}
Camera tumWide() {
  return makeCamera(
      "fov", std::vector{446.915863, 447.071228, 631.219238, 510.997498, 0.933271}, 1280, 1024);
}
Camera mirror() {
  return makeCamera(
      "omni", std::vector{1.4, 590.5, 589.75, 644.25, 508.5}, 1280, 1024, 105 * kDegree);
}
Camera pinhole() {
  return makeCamera("pinhole", std::vector{640.0, 640.5, 638.25, 513.5}, 1280, 1024);
}

TEST(Conversion, ResidualIsTheDistanceOfEachPixelToTheProjectionOfItsRay) {
  const Camera source = tumWide();
  std::vector<double> params = source.params();
  params[2] += 3;
  params[3] -= 4;
  const Camera shifted = makeCamera("fov", params, 1280, 1024);
  const ConversionResidual residual = conversionResidual(source, shifted);
  EXPECT_EQ(residual.all.compared, 1280U * 1024U);
  EXPECT_EQ(residual.all.lost, 0U);
  EXPECT_NEAR(residual.all.rms_px, 5, 1e-10);
  EXPECT_NEAR(residual.all.max_px, 5, 1e-10);
  ASSERT_EQ(residual.bands.size(), 10U);  // its corners look past 90 degrees
  size_t sum = 0;
  for (size_t i = 0; i < residual.bands.size(); ++i) {
    const ResidualBand& band = residual.bands[i];
    EXPECT_NEAR(band.from_rad, double(i) * 10 * kDegree, 1e-12);
    EXPECT_NEAR(band.to_rad, double(i + 1) * 10 * kDegree, 1e-12);
    EXPECT_GT(band.compared, 0U);
    EXPECT_NEAR(band.rms_px, 5, 1e-10);
    sum += band.compared;
  }
  EXPECT_EQ(sum, residual.all.compared);
}

TEST(Conversion, ResidualSaysWhereAndHowMuchIsLost) {
  // Only one pixel differs: the wide camera's limit of the angle takes its corner away.
  const Camera source = tumWide();
  const double corner = std::acos(source.unproject({1279, 1023})->z());
  const double other_corner = std::acos(source.unproject({0, 1023})->z());
  ASSERT_NE(corner, other_corner);
  const double widest = std::max(corner, other_corner);
  const Camera limited(source.model(), 1280, 1024, widest - 1e-9);
  const ConversionResidual residual = conversionResidual(source, limited);
  EXPECT_EQ(residual.all.lost, 1U);
  EXPECT_EQ(residual.bands.back().lost, 1U);
  EXPECT_LE(residual.all.max_px, 1e-10);

  const ConversionResidual inner = conversionResidual(source, pinhole(), 60 * kDegree);
  EXPECT_EQ(inner.bands.size(), 6U);
  EXPECT_GT(inner.all.compared, 0U);
  EXPECT_LT(inner.all.compared, 1280U * 1024U);
  const Eigen::Vector2d projected = *pinhole().project(*source.unproject(inner.worst_px));
  EXPECT_NEAR((projected - inner.worst_px).norm(), inner.all.max_px, 1e-10);
}

TEST(Conversion, ToTheSameModelIsTheIdentity) {
  for (const Camera& camera : {tumVi(), tumWide(), mirror(), pinhole()}) {
    SCOPED_TRACE(camera.modelName());
    const auto conversion = convertCamera(camera, camera.modelName());
    ASSERT_TRUE(conversion);
    EXPECT_EQ(conversion->camera, camera);
    EXPECT_LE(conversion->residual.all.max_px, 1e-10);
    EXPECT_EQ(conversion->residual.all.lost, 0U);
  }
}

// What one model can say exactly in the terms of another comes out exactly, and back.
TEST(Conversion, ExactRelationsComeOutToRounding) {
  const struct {
    Camera source;
    const char* model;
  } cases[] = {
      {pinhole(), "omni"},
      {pinhole(), "fov"},
      {pinhole(), "pinhole_radtan"},
      {pinhole(), "eucm"},
      {pinhole(), "double_sphere"},
      {pinhole(), "ocam"},
      {makeCamera("omni", std::vector{0.0, 500.0, 510.0, 320.0, 200.0}, 640, 480), "pinhole"},
      {makeCamera("fov", std::vector{500.0, 510.0, 320.0, 200.0, 0.0}, 640, 480), "omni"},
      {mirror(), "eucm"},
      {mirror(), "double_sphere"},
      {mirror(), "omni_radtan"},
      {makeCamera("kannala_brandt",
                  std::vector{190.0, 191.0, 320.0, 240.0, -0.03, 0.0, 0.0, 0.0},
                  640,
                  480),
       "theta_polynomial"},
      {makeCamera("pinhole_radtan",
                  std::vector{400.0, 402.0, 320.0, 240.0, -0.1, 0.01, 1e-3, -2e-3, 0.0},
                  640,
                  480),
       "omni_radtan"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(std::string(c.source.modelName()) + " to " + c.model);
    const auto there = convertCamera(c.source, c.model);
    ASSERT_TRUE(there);
    EXPECT_EQ(there->camera.modelName(), c.model);
    EXPECT_LE(there->residual.all.max_px, 1e-9);
    EXPECT_EQ(there->residual.all.lost, 0U);
    const auto back = convertCamera(there->camera, c.source.modelName());
    ASSERT_TRUE(back);
    EXPECT_LE(conversionResidual(c.source, back->camera).all.max_px, 1e-9);
  }
}

// Good approximations, there and back: what is lost on the way is seen on the way.
TEST(Conversion, ThereAndBackDiffersByWhatWasLostOnTheWay) {
  const struct {
    Camera source;
    const char* model;
    double rms_px;
  } cases[] = {{tumWide(), "kannala_brandt", 1e-3}, {mirror(), "kannala_brandt", 5e-3}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.source.modelName());
    const auto there = convertCamera(c.source, c.model);
    ASSERT_TRUE(there);
    EXPECT_LE(there->residual.all.rms_px, c.rms_px);
    EXPECT_GT(there->residual.all.rms_px, 1e-7);  // not exact, and said so
    const auto back = convertCamera(there->camera, c.source.modelName());
    ASSERT_TRUE(back);
    EXPECT_LE(conversionResidual(c.source, back->camera).all.rms_px, c.rms_px);
  }
}

// A minimum: no parameter can be moved either way to the better. The residual over all pixels is
// not what is minimised (a grid of them is), which leaves a little.
TEST(Conversion, IsALeastSquaresFit) {
  for (const auto& [source, model] : std::vector<std::pair<Camera, const char*>>{
           {tumVi(), "omni"}, {tumVi(), "fov"}, {mirror(), "fov"}}) {
    SCOPED_TRACE(std::string(source.modelName()) + " to " + model);
    const auto conversion = convertCamera(source, model, 80 * kDegree);
    ASSERT_TRUE(conversion);
    const double rms = conversion->residual.all.rms_px;
    const std::vector<double> params = conversion->camera.params();
    for (size_t i = 0; i < params.size(); ++i) {
      for (const double relative : {-3e-3, 3e-3}) {
        std::vector<double> moved = params;
        moved[i] *= 1 + relative;
        const Camera there = makeCamera(model, moved, source.width(), source.height());
        EXPECT_GE(conversionResidual(source, there, 80 * kDegree).all.rms_px, 0.999 * rms)
            << conversion->camera.paramSpecs()[i].name << " " << relative;
      }
    }
  }
}

/// The mean of the fit's cost over its grid of pixels.
double meanCost(const Camera& source, const Camera& other, double max_angle) {
  const double square_diagonal = std::pow(source.width(), 2) + std::pow(source.height(), 2);
  double sum = 0;
  size_t count = 0;
  for (int i = 0; i < 48; ++i) {
    for (int k = 0; k < 48; ++k) {
      const double u = k * (source.width() - 1.0) / 47, v = i * (source.height() - 1.0) / 47;
      const auto ray = source.unproject({u, v});
      if (!ray || std::atan2(std::hypot(ray->x(), ray->y()), ray->z()) > max_angle) continue;
      ++count;
      const auto pixel = other.project(*ray);
      const double square =
          pixel ? (*pixel - Eigen::Vector2d(u, v)).squaredNorm() : square_diagonal * 1e12;
      sum += square / (1 + square / square_diagonal);
    }
  }
  EXPECT_GT(count, 100U);
  return sum / double(count);
}

// Whatever the source, also where the model cannot follow it: never worse than the plain camera
// that agrees with it at the axis, from which the fit sets out.
TEST(Conversion, IsNoWorseThanTheStart) {
  const double w = 480, h = 240;
  const Camera panorama = makeCamera(
      "equirectangular", std::vector{w / (2 * M_PI), h / M_PI, (w - 1) / 2, (h - 1) / 2}, 480, 240);
  const Camera wide =
      makeCamera("fov", std::vector{139.66, 139.71, 197.256, 159.687, 0.933271}, 400, 320);
  const Camera around =
      makeCamera("omni", std::vector{1.4, 184.5, 184.25, 201.3, 158.9}, 400, 320, 105 * kDegree);
  int compared = 0;
  for (const Camera& source : {panorama, wide, around}) {
    const ProjectionJacobian axis = *source.jacobian(Eigen::Vector3d::UnitZ());
    const Eigen::Vector2d centre = *source.project(Eigen::Vector3d::UnitZ());
    const std::vector<double> plain{axis(0, 0), axis(1, 1), centre.x(), centre.y()};
    std::vector<double> equidistant = plain, flat = plain;
    equidistant.resize(8, 0);
    flat.resize(9, 0);
    for (const double max_angle : {40.0, 60.0, 80.0, 100.0, 180.0}) {
      for (const auto& [model, params] :
           {std::pair<const char*, std::vector<double>>{"kannala_brandt", equidistant},
            {"pinhole_radtan", flat},
            {"pinhole", plain}}) {
        SCOPED_TRACE(std::string(source.modelName()) + " to " + model + " up to " +
                     std::to_string(max_angle));
        const auto conversion = convertCamera(source, model, max_angle * kDegree);
        ASSERT_TRUE(conversion);
        const Camera start = makeCamera(model, params, source.width(), source.height());
        EXPECT_LE(meanCost(source, conversion->camera, max_angle * kDegree),
                  (1 + 1e-9) * meanCost(source, start, max_angle * kDegree) + 1e-12);
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 45);
}

TEST(Conversion, TheResultLooksNoFartherThanTheSource) {
  const auto mirror_as_kb = convertCamera(mirror(), "kannala_brandt");
  ASSERT_TRUE(mirror_as_kb);
  EXPECT_EQ(mirror_as_kb->camera.maxFieldAngleLimit(), mirror().maxFieldAngle());
  // Every pixel of these has a ray: no limit is needed.
  const auto vi_as_omni = convertCamera(tumVi(), "omni");
  ASSERT_TRUE(vi_as_omni);
  EXPECT_EQ(vi_as_omni->camera.maxFieldAngleLimit(), M_PI);
  // Asked for less, it gives less.
  const auto inner = convertCamera(tumVi(), "omni", 60 * kDegree);
  ASSERT_TRUE(inner);
  EXPECT_EQ(inner->camera.maxFieldAngleLimit(), 60 * kDegree);
  EXPECT_EQ(inner->residual.bands.size(), 6U);
}

TEST(Conversion, WhatAModelCannotSeeIsLost) {
  const auto flat = convertCamera(mirror(), "pinhole");
  ASSERT_TRUE(flat);
  size_t past_90 = 0, all = 0;
  for (int v = 0; v < 1024; ++v) {
    for (int u = 0; u < 1280; ++u) {
      const auto ray = mirror().unproject({double(u), double(v)});
      all += ray ? 1 : 0;
      past_90 += ray && ray->z() <= 0 ? 1 : 0;
    }
  }
  EXPECT_GT(past_90, 0U);
  EXPECT_EQ(flat->residual.all.lost, past_90);
  EXPECT_EQ(flat->residual.all.compared, all - past_90);
}

TEST(Conversion, RefusesWhatMakesNoSense) {
  EXPECT_THROW((void)convertCamera(pinhole(), "fisheye"), std::invalid_argument);
  for (const double bad : {0.0, -1.0, 3.2, std::nan("")}) {
    EXPECT_THROW((void)convertCamera(pinhole(), "omni", bad), std::invalid_argument);
  }
  // No pixel looks that close to the axis.
  EXPECT_FALSE(convertCamera(pinhole(), "omni", 1e-6));
}

}  // namespace
}  // namespace dlsd
