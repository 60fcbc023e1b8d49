#include "synth/variety.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "cameras/calibration/files.h"
#include "synth/shading.h"

namespace dlsd {
namespace {

size_t roundThings(const Scene& scene) {
  return scene.spheres.size() + scene.discs.size() + scene.tubes.size();
}

TEST(Variety, ChangesNothingByDefault) {
  const SceneView plain = makeSceneView("room", 3, 4);
  SceneView view = makeSceneView("room", 3, 4);
  addVariety(SceneVariety(), 3, 4, &view);
  EXPECT_EQ(roundThings(view.scene), roundThings(plain.scene));
  EXPECT_EQ(view.scene.surfaces.size(), plain.scene.surfaces.size());
}

// Distractors are clear of everything, and prints stay in their faces.
TEST(Variety, AddsRoundThingsInTheOpenAndPrints) {
  SceneVariety variety;
  variety.distractors = {6, 6};
  variety.prints = {0.5, 0.5};
  for (uint64_t index = 0; index < 6; ++index) {
    for (const std::string preset : {"room", "polyhedra", "corridor"}) {
      const SceneView plain = makeSceneView(preset, 3, index);
      SceneView view = makeSceneView(preset, 3, index), again = view;
      addVariety(variety, 3, index, &view);
      addVariety(variety, 3, index, &again);
      ASSERT_EQ(roundThings(view.scene), roundThings(again.scene));
      EXPECT_GT(roundThings(view.scene), roundThings(plain.scene)) << preset;
      size_t prints = 0, prints_before = 0;
      for (const Face& face : view.scene.faces) prints += face.decals.size();
      for (const Face& face : plain.scene.faces) prints_before += face.decals.size();
      EXPECT_GT(prints, prints_before) << preset;
      for (size_t k = plain.scene.spheres.size(); k < view.scene.spheres.size(); ++k) {
        const Sphere& s = view.scene.spheres[k];
        EXPECT_EQ(s.radius, again.scene.spheres[k].radius);
        const Eigen::Vector3d centre = s.centre.cast<double>();
        const auto radius = static_cast<double>(s.radius);
        EXPECT_GT((centre - view.pose.position_in_world).norm() - radius, 0.05);
        for (const Eigen::Vector3f& v : view.scene.vertices) {
          EXPECT_GT((v.cast<double>() - centre).norm(), radius);
        }
        // Not inside of a solid or a wall either: solids' pieces are boxes.
        for (const SolidPiece& piece : view.scene.pieces) {
          const Eigen::Vector3d d = piece.axes.transpose() * (centre - piece.centre);
          if (preset == "polyhedra") continue;  // Their pieces are bounding boxes.
          EXPECT_GT((d.cwiseAbs() - piece.half).cwiseMax(0).norm(), radius * 0.99) << preset;
        }
      }
    }
  }
}

TEST(Variety, DrawsTheKindsThatAreAskedFor) {
  const auto viewOf = [](const std::string& kind) {
    SceneVariety variety;
    variety.distractors = {8, 8};
    variety.distractor_kinds = {kind};
    SceneView view = makeSceneView("corridor", 3, 2);
    addVariety(variety, 3, 2, &view);
    return view.scene;
  };
  const Scene plain = makeSceneView("corridor", 3, 2).scene;
  EXPECT_GT(viewOf("ball").spheres.size(), plain.spheres.size() + 3);
  EXPECT_GT(viewOf("disc").discs.size(), plain.discs.size() + 3);
  EXPECT_GT(viewOf("cylinder").rods.size(), plain.rods.size() + 3);
  for (const auto& [name, kind] :
       {std::pair("ring", Tube::Kind::kRing), {"string", Tube::Kind::kString}}) {
    const Scene scene = viewOf(name);
    EXPECT_GT(scene.tubes.size(), 3U);
    for (const Tube& tube : scene.tubes) EXPECT_EQ(tube.kind, kind);
    EXPECT_EQ(scene.spheres.size(), plain.spheres.size());
  }
}

// Clutter keeps to its distances and lengths; old edges keep their numbers and carriers.
TEST(Variety, ClutterFollowsItsRanges) {
  SceneVariety variety;
  variety.clutter = {20, 20};
  variety.distance_m = {1, 2};
  variety.length_m = {0.2, 0.5};
  size_t added = 0;
  for (uint64_t index = 0; index < 5; ++index) {
    const SceneView plain = makeSceneView("corridor", 3, index);
    SceneView view = plain;
    addVariety(variety, 3, index, &view);
    ASSERT_GE(view.scene.edges.size(), plain.scene.edges.size());
    for (size_t e = 0; e < plain.scene.edges.size(); ++e) {
      ASSERT_EQ(view.scene.edges[e].from, plain.scene.edges[e].from);
      EXPECT_EQ(view.scene.edges[e].carrier, plain.scene.edges[e].carrier);
    }
    for (size_t p = plain.scene.pieces.size(); p < view.scene.pieces.size(); ++p, ++added) {
      const SolidPiece& piece = view.scene.pieces[p];
      const double distance = (piece.centre - view.pose.position_in_world).norm();
      EXPECT_GE(distance, 0.7);
      EXPECT_LE(distance, 2.3);
    }
    for (size_t e = plain.scene.edges.size(); e < view.scene.edges.size(); ++e) {
      const Edge& edge = view.scene.edges[e];
      const double length = (edge.to - edge.from).norm();
      EXPECT_LE(length, 0.5 + 1e-5);
    }
  }
  EXPECT_GT(added, 15U);
}

TEST(Variety, TexturesTheirShare) {
  SceneVariety variety;
  variety.noise = {0.3, 0.3};
  variety.wood = {0.5, 0.5};
  SceneView view = makeSceneView("room", 3, 1);
  addVariety(variety, 3, 1, &view);
  double noise = 0, wood = 0;
  for (const Surface& surface : view.scene.surfaces) {
    if (surface.texture < 0) continue;
    const Texture& texture = view.scene.textures[static_cast<size_t>(surface.texture)];
    (texture.kind == Texture::Kind::kNoise ? noise : wood) += 1;
  }
  const auto all = static_cast<double>(view.scene.surfaces.size());
  EXPECT_NEAR(noise / all, 0.3, 0.1);
  EXPECT_NEAR(wood / all, 0.7 * 0.5, 0.1);
}

TEST(Textures, AreSmoothAroundOneAndDifferBySeed) {
  for (const Texture::Kind kind : {Texture::Kind::kNoise, Texture::Kind::kWood}) {
    Texture texture;
    texture.kind = kind;
    texture.size_m = 0.1;
    texture.amplitude = 0.4;
    Texture other = texture;
    other.seed = 1;
    double sum = 0, lo = 2, hi = 0, steepest = 0, differ = 0;
    constexpr int kPoints = 20000;
    const Eigen::Vector3d step(3e-5, 2e-5, 4e-5);
    for (int k = 0; k < kPoints; ++k) {
      const Eigen::Vector3d p = 0.001 * k * Eigen::Vector3d(0.5, 0.7, -0.4);
      const double value = textureFactor(texture, p);
      sum += value;
      lo = std::min(lo, value);
      hi = std::max(hi, value);
      steepest = std::max(steepest, std::abs(textureFactor(texture, p + step) - value));
      differ += std::abs(textureFactor(other, p) - value);
    }
    EXPECT_NEAR(sum / kPoints, 1, 0.05);
    EXPECT_GE(lo, 0.6);
    EXPECT_LE(hi, 1.4);
    EXPECT_GT(hi - lo, 0.3);
    EXPECT_LE(steepest, 0.005);  // 5.4e-5 m: a step would be 0.1 and more.
    EXPECT_GT(differ / kPoints, 0.05);
  }
}

TEST(Variety, ScalesContrastAndSwitchesShadows) {
  SceneVariety variety;
  variety.contrast = {0.5, 0.5};
  variety.shadows = 1;
  const SceneView plain = makeSceneView("polyhedra", 3, 1);
  SceneView view = plain;
  addVariety(variety, 3, 1, &view);
  const auto spread = [](const Scene& scene) {
    double lo = 1, hi = 0;
    for (const Surface& s : scene.surfaces) {
      lo = std::min(lo, s.albedo);
      hi = std::max(hi, s.albedo);
    }
    return hi - lo;
  };
  EXPECT_NEAR(spread(view.scene), spread(plain.scene) / 2, 1e-12);
  ASSERT_FALSE(view.scene.lights.empty());
  for (const Light& light : view.scene.lights) EXPECT_TRUE(light.casts_shadows);
}

TEST(RandomCameras, FollowTheirRanges) {
  CameraVariety variety;
  for (const std::string& model : randomCameraModels()) {
    double widest = 0;
    for (uint64_t k = 0; k < 60; ++k) {
      const Camera camera = drawCamera(model, variety, 5, k);
      EXPECT_GE(camera.width(), 640);
      EXPECT_LE(camera.width(), 1280);
      EXPECT_GE(camera.height(), 0.56 * camera.width());
      EXPECT_LE(camera.height(), camera.width());
      ASSERT_EQ(camera.params(), drawCamera(model, variety, 5, k).params());
      EXPECT_NE(camera.params(), drawCamera(model, variety, 6, k).params());
      // Half of the field, on the side where the image is a little more or less than half.
      const auto params = camera.params();
      const auto specs = camera.paramSpecs();
      double cx = 0, cy = 0;
      for (size_t i = 0; i < specs.size(); ++i) {
        if (specs[i].name == "cx") cx = params[i];
        if (specs[i].name == "cy") cy = params[i];
      }
      EXPECT_NEAR(cx, camera.width() / 2.0, 0.031 * camera.width() + 1);
      const auto ray = camera.unproject({cx + camera.width() / 2.0, cy});
      ASSERT_TRUE(ray) << model << " " << k;
      const double field = 2 * fieldAngle(*ray) * 180 / M_PI;
      EXPECT_GE(field, 55) << model << " " << k;
      EXPECT_LE(field, 220.001) << model << " " << k;
      widest = std::max(widest, field);
    }
    EXPECT_GE(widest, model == "pinhole" ? 114 : 150) << model;
  }
  EXPECT_THROW((void)drawCamera("fisheye", variety, 0, 0), std::invalid_argument);
}

TEST(VarietyFile, IsReadAndRefused) {
  const std::string path = std::filesystem::temp_directory_path() / "dlsd-variety-test.json";
  const auto read = [&](const std::string& text, SceneVariety* scene, CameraVariety* camera) {
    std::ofstream(path) << text;
    readVariety(path, scene, camera);
  };
  SceneVariety scene;
  CameraVariety camera;
  read(R"({"scene": {"distractors": [1, 4], "shadows": 0.5}, "camera": {"width_px": [320, 400]}})",
       &scene,
       &camera);
  EXPECT_EQ(scene.distractors, (VarietyRange{1, 4}));
  EXPECT_EQ(scene.contrast, (VarietyRange{1, 1}));
  EXPECT_EQ(scene.shadows, 0.5);
  EXPECT_EQ(camera.width_px, (VarietyRange{320, 400}));
  // What it prints, it reads.
  SceneVariety scene_again;
  CameraVariety camera_again;
  const nlohmann::ordered_json printed{{"scene", toJson(scene)}, {"camera", toJson(camera)}};
  read(printed.dump(), &scene_again, &camera_again);
  EXPECT_EQ(scene_again, scene);
  EXPECT_EQ(camera_again, camera);
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      read(text, &scene, &camera);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("{\"lens\": {}}"), testing::HasSubstr("lens"));
  EXPECT_THAT(refusal("{\"scene\": {\"contrasts\": [1, 1]}}"), testing::HasSubstr("contrasts"));
  EXPECT_THAT(refusal("{\"scene\": {\"contrast\": [2, 1]}}"), testing::HasSubstr("contrast"));
  EXPECT_THAT(refusal("{\"scene\": {\"contrast\": [1]}}"), testing::HasSubstr("contrast"));
  EXPECT_THAT(refusal("{\"camera\": {\"width_px\": [1, 10]}}"), testing::HasSubstr("width_px"));
  EXPECT_THAT(refusal("[]"), testing::HasSubstr("object"));
  EXPECT_THAT(refusal(R"({"scene": {"distractor_kinds": ["cube"]}})"), testing::HasSubstr("cube"));
  EXPECT_THAT(refusal(R"({"scene": {"distractor_kinds": []}})"), testing::HasSubstr("empty"));
  EXPECT_THAT(refusal(R"({"scene": {"length_m": [0, 1]}})"), testing::HasSubstr("length_m"));
  std::filesystem::remove(path);
}

TEST(VarietySettings, AreThoseOfTheFile) {
  SceneVariety scene;
  CameraVariety camera;
  setVariety("clutter=4,12", &scene, &camera);
  setVariety("wood=0.25", &scene, &camera);
  setVariety("shadows=0.5", &scene, &camera);
  setVariety("distractor_kinds=ring,cylinder", &scene, &camera);
  setVariety("field_of_view_deg=90,180", &scene, &camera);
  EXPECT_EQ(scene.clutter, (VarietyRange{4, 12}));
  EXPECT_EQ(scene.wood, (VarietyRange{0.25, 0.25}));
  EXPECT_EQ(scene.shadows, 0.5);
  EXPECT_EQ(scene.distractor_kinds, (std::vector<std::string>{"ring", "cylinder"}));
  EXPECT_EQ(camera.field_of_view_deg, (VarietyRange{90, 180}));
  for (const std::string bad : {"clutter",
                                "clutter=",
                                "clutter=a,b",
                                "clutter=1,2,3",
                                "clutter=12,4",
                                "cluttr=1,2",
                                "=3"}) {
    EXPECT_THROW(setVariety(bad, &scene, &camera), InputError) << bad;
  }
  EXPECT_EQ(scene.clutter, (VarietyRange{4, 12}));
}

}  // namespace
}  // namespace dlsd
