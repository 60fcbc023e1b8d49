#include "cameras/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace dlsd {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

const std::vector<double> kPinholeParams{100, 200, 10, 20};

TEST(Camera, SaysWhatItIs) {
  const Camera camera = makeCamera("pinhole", kPinholeParams, 640, 480, 1.0);
  EXPECT_EQ(camera.modelName(), "pinhole");
  EXPECT_EQ(camera.params(), kPinholeParams);
  EXPECT_EQ(camera.paramSpecs()[2].name, "cx");
  EXPECT_EQ(camera.width(), 640);
  EXPECT_EQ(camera.height(), 480);
  EXPECT_EQ(camera.maxFieldAngleLimit(), 1.0);
  EXPECT_EQ(camera.maxFieldAngle(), 1.0);
  EXPECT_EQ(makeCamera("pinhole", kPinholeParams, 640, 480).maxFieldAngle(), M_PI / 2);
  EXPECT_EQ(paramSpecsOf("omni")[0].name, "xi");
}

TEST(Camera, RefusesWithNameValueAndRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, 1e8, nan, inf}) {
    EXPECT_THAT(refusal([&] {
                  (void)Camera(Pinhole{bad, 1, 0, 0}, 4, 4);
                }),
                AllOf(HasSubstr("pinhole parameter fx = "), HasSubstr("[0.001, 1e+07]")));
    EXPECT_THAT(refusal([&] {
                  (void)makeCamera("pinhole", std::vector{1., bad, 0., 0.}, 4, 4);
                }),
                HasSubstr("pinhole parameter fy"));
  }
  EXPECT_THAT(refusal([&] {
                (void)makeCamera("omni", std::vector{-1., 1., 1., 0., 0.}, 4, 4);
              }),
              HasSubstr("omni parameter xi = -1"));
  for (const int bad : {0, -5, 65536}) {
    EXPECT_THAT(refusal([&] { (void)makeCamera("pinhole", kPinholeParams, bad, 4); }),
                AllOf(HasSubstr("image width"), HasSubstr("[1, 65535]")));
    EXPECT_THAT(refusal([&] { (void)makeCamera("pinhole", kPinholeParams, 4, bad); }),
                HasSubstr("image height"));
  }
  for (const double bad : {0.0, -1.0, 3.2, nan}) {
    EXPECT_THAT(refusal([&] { (void)makeCamera("pinhole", kPinholeParams, 4, 4, bad); }),
                HasSubstr("max_field_angle"));
  }
  EXPECT_THAT(refusal([] { (void)makeCamera("fisheye", kPinholeParams, 4, 4); }),
              AllOf(HasSubstr("'fisheye'"), HasSubstr("pinhole, fov, kannala_brandt, omni")));
  EXPECT_THAT(refusal([] { (void)paramSpecsOf("fisheye"); }), HasSubstr("'fisheye'"));
  EXPECT_THAT(refusal([] { (void)makeCamera("fov", kPinholeParams, 4, 4); }),
              HasSubstr("takes 5 parameters, got 4"));
}

// A model is an aggregate, so its derived values can be forgotten; the camera does not trust them.
TEST(Camera, DerivesWhatModelsDerive) {
  KannalaBrandt forgotten;
  forgotten.k1 = -1.0 / 3;
  EXPECT_EQ(Camera(forgotten, 4, 4).model(),
            CameraModelVariant(KannalaBrandt::fromParams({1, 1, 0, 0, -1.0 / 3, 0, 0, 0})));
  const Fov half_built{100, 100, 0, 0, 0.9};
  EXPECT_EQ(Camera(half_built, 4, 4), Camera(Fov::fromParams({100, 100, 0, 0, 0.9}), 4, 4));
}

TEST(Camera, ALimitOfTheFieldAngleHoldsBothWays) {
  const Camera camera = makeCamera("omni", std::vector<double>{1, 100, 100, 0, 0}, 640, 480, 2.0);
  const auto at = [](double angle) { return Eigen::Vector3d(std::sin(angle), 0, std::cos(angle)); };
  EXPECT_TRUE(camera.project(at(2.0 - 1e-12)));
  EXPECT_FALSE(camera.project(at(2.0 + 1e-12)));
  EXPECT_TRUE(camera.project(7 * at(1.9)));
  EXPECT_FALSE(camera.project(7 * at(2.1)));
  const double radius = 100 * std::tan(1.0);  // stereographic: tan(theta / 2)
  EXPECT_TRUE(camera.unproject({radius * (1 - 1e-12), 0}));
  EXPECT_FALSE(camera.unproject({radius * (1 + 1e-12), 0}));
  EXPECT_TRUE(camera.jacobian(at(1.9)));
  EXPECT_FALSE(camera.jacobian(at(2.1)));
}

TEST(Camera, TheImageReachesHalfAPixelBeyondTheOutermostCentres) {
  const Camera camera = makeCamera("pinhole", kPinholeParams, 640, 480);
  for (const double u : {-0.5, 0.0, 639.5}) EXPECT_TRUE(camera.inImage({u, 0}));
  for (const double v : {-0.5, 0.0, 479.5}) EXPECT_TRUE(camera.inImage({0, v}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {-0.500001, 639.500001, nan}) EXPECT_FALSE(camera.inImage({bad, 0}));
  for (const double bad : {-0.500001, 479.500001, nan}) EXPECT_FALSE(camera.inImage({0, bad}));
}

}  // namespace
}  // namespace dlsd
