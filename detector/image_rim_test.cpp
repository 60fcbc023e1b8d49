#include "detector/image_rim.h"

#include <gtest/gtest.h>

#include "detector/test_scene.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

/// Sees 2.3 rad and more in every direction of the sensor.
Camera widerThanItsLens() {
  return Camera(KannalaBrandt::fromParams({120, 121, 243, 196, 0.01, 0, 0, 0}), 480, 400);
}

/// A lens that shows no more than `angle_rad` around an axis of its own, and a square.
test::Scene sceneThrough(double angle_rad, double surround, double grey) {
  test::Scene scene;
  scene.background = surround;
  scene.shapes.push_back(test::cone(Vector3d(0.02, -0.01, 1), angle_rad, grey));
  scene.shapes.push_back(test::polygon(
      Vector3d(0.3, 0.1, 1), 0.5, {0.3, 0.3 + M_PI / 2, 0.3 + M_PI, 0.3 + 1.5 * M_PI}, 200));
  return scene;
}

struct Picture {
  std::vector<uint8_t> u8;
  std::vector<uint16_t> fixed;
  GreyPixels grey, grey_fixed;

  Picture(const test::Scene& scene, const Camera& camera)
      : u8(test::toU8(test::render(scene, camera), 2, 7)) {
    for (const uint8_t v : u8) fixed.push_back(static_cast<uint16_t>(v * kGreyUnit));
    grey.u8 = u8.data();
    grey_fixed.fixed = fixed.data();
    for (GreyPixels* p : {&grey, &grey_fixed}) {
      p->stride = p->width = camera.width();
      p->height = camera.height();
    }
  }
};

TEST(ImageRim, IsFoundWhereTheLensEnds) {
  const Camera camera = widerThanItsLens();
  ImageRimFinder finder(camera);
  for (const double angle : {1.1, 1.3, M_PI / 2}) {
    const Picture picture(sceneThrough(angle, 8, 110), camera);
    for (const GreyPixels& pixels : {picture.grey, picture.grey_fixed}) {
      const auto rim = finder.find(pixels);
      ASSERT_TRUE(rim) << angle;
      EXPECT_NEAR(rim->radius, angle, 0.02);
      EXPECT_NEAR(rim->centre.x(), 0.02, 0.02);
      EXPECT_NEAR(rim->centre.y(), -0.01, 0.02);
    }
  }
}

TEST(ImageRim, IsNotWhereThereIsNone) {
  const Camera camera = widerThanItsLens();
  ImageRimFinder finder(camera);
  // Bright all over; a lens with bright surroundings; all dark; a bright square in the dark.
  const test::Scene scenes[] = {
      sceneThrough(3.1, 8, 110), sceneThrough(1.3, 90, 160), sceneThrough(1.3, 5, 12), [] {
        test::Scene scene = sceneThrough(1.3, 5, 5);
        scene.shapes[1] =
            test::polygon(Vector3d(0, 0, 1), 1.1, {0, M_PI / 2, M_PI, 1.5 * M_PI}, 200);
        return scene;
      }()};
  for (const test::Scene& scene : scenes) {
    const Picture picture(scene, camera);
    EXPECT_FALSE(finder.find(picture.grey)) << &scene - scenes;
  }
  // Where the model ends, too, the rim is no news.
  const Camera as_its_lens =
      Camera(camera.model(), camera.width(), camera.height(), /*max_field_angle_rad=*/1.3);
  EXPECT_FALSE(
      ImageRimFinder(as_its_lens).find(Picture(sceneThrough(3.1, 8, 110), as_its_lens).grey));
  const Camera tiny(Pinhole::fromParams({1, 1, 0, 0}), 1, 1);
  const uint8_t dark = 0;
  GreyPixels pixel;
  pixel.u8 = &dark;
  pixel.stride = pixel.width = pixel.height = 1;
  EXPECT_FALSE(ImageRimFinder(tiny).find(pixel));
}

// At 90 degrees the rim is the image of a plane, as a straight edge is; dark things cut it.
TEST(ImageRim, IsNoLine) {
  const Camera camera = widerThanItsLens();
  const auto linesAlong = [&](double surround, double grey) {
    test::Scene scene = sceneThrough(M_PI / 2, surround, grey);
    for (const double phi : {0.9, 3.0, 5.1}) {
      scene.shapes.push_back(test::polygon(
          Vector3d(std::cos(phi), std::sin(phi), 0), 0.3, {0.2, 1.8, 3.5, 4.9}, surround));
    }
    const Picture picture(scene, camera);
    Detector detector(camera);
    size_t along = 0, others = 0;
    const Vector3d axis = scene.shapes[0].axis;
    for (const DetectedLine& line : detector.detect(test::viewOf(picture.u8, camera))) {
      const bool is_along =
          std::abs(line.arc.from.dot(axis)) < 0.05 && std::abs(line.arc.to.dot(axis)) < 0.05;
      ++(is_along ? along : others);
    }
    return std::pair(along, others);
  };
  const auto [along, others] = linesAlong(8, 110);
  EXPECT_EQ(along, 0U);
  EXPECT_GE(others, 4U);
  // The same circle in bright surroundings is an edge of the world.
  EXPECT_GE(linesAlong(70, 150).first, 2U);
}

TEST(ImageRim, LinesAcrossItStay) {
  const ImageRim rim{{0.02, -0.01}, 1.4};
  const auto at = [](double theta, double phi) {
    return Vector3d(
        std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  };
  EXPECT_TRUE(isOnRim(*arcBetween(at(1.4, 0.1), at(1.4, 0.4)), rim));
  EXPECT_TRUE(isOnRim(*arcBetween(at(1.35, 2), at(1.36, 2.2)), rim));
  EXPECT_FALSE(isOnRim(*arcBetween(at(1.1, 0.1), at(1.4, 0.12)), rim));
  EXPECT_FALSE(isOnRim(*arcBetween(at(1.38, 0.1), at(0.5, 1.5)), rim));
  EXPECT_FALSE(isOnRim(*arcBetween(at(1.2, 0.1), at(1.2, 0.4)), rim));
  EXPECT_FALSE(isOnRim(*arcBetween(at(1.5, 0.1), at(1.5, 0.4)), rim));
}

}  // namespace
}  // namespace dlsd
