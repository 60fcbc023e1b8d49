// Cases of label properties: on disk and back, with some of a scene's parts, and smaller ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "cameras/calibration/files.h"
#include "properties/checks/case.h"
#include "properties/checks/judge.h"
#include "properties/checks/labels.h"
#include "properties/checks/scene_parts.h"
#include "properties/gen.h"
#include "properties/gen_labels.h"
#include "properties/holds.h"
#include "properties/saved_cases.h"
#include "synth/dataset/json_fields.h"
#include "synth/labels.h"
#include "synth/shadows.h"
#include "synth/tubes.h"
#include "synth/variety.h"

namespace dlsd {
namespace {

using ::testing::HasSubstr;

Labels labelsOf(SceneView view, const Camera& camera) {
  const Raycaster raycaster(view.scene);
  addRodSides(view.pose.position_in_world, &view.scene);
  addShadowEdges(raycaster, &view.scene);
  const auto spans = visibleSpans(view.scene, raycaster, camera, view.pose);
  const Shader shader(view.scene, &raycaster);
  return makeLabels(view.scene, raycaster, shader, camera, view.pose, SensorOptions(), spans);
}

std::vector<int> allParts(const Scene& scene) {
  std::vector<int> parts(static_cast<size_t>(partCount(scene)));
  std::iota(parts.begin(), parts.end(), 0);
  return parts;
}

LabelProperty genProperty() {
  return static_cast<LabelProperty>(*genInt(0, kLabelPropertyCount - 1));
}

/// The parts of its whole scene that a case has: a shrunk one has not all.
std::vector<int> partsOf(const LabelCase& c) {
  return c.parts ? *c.parts : allParts(viewOf(c).scene);
}

/// Some of the parts, from one to all.
std::vector<int> genSomeOf(const std::vector<int>& parts) {
  if (parts.empty()) return {};
  const auto most = static_cast<int>(parts.size());
  const int count = *genInt(1, most);
  std::set<int> some;
  while (static_cast<int>(some.size()) < count) {
    some.insert(parts[static_cast<size_t>(*genInt(0, most - 1))]);
  }
  return {some.begin(), some.end()};
}

// --- On disk ---

TEST(LabelCase, RoundTripsThroughJson) {
  holds(1, [] {
    LabelCase c = drawLabelCase(genProperty());
    c.camera = *genAnyCamera(Range::kAdmissible);
    if (*genInt(0, 1) == 1) c.parts = genSomeOf(partsOf(c));
    const auto json = toJson(c);
    const LabelCase back = labelCaseFromJson(parseJson(json.dump(), "case"), "case");
    RC_ASSERT(toJson(back) == json);
    RC_ASSERT(back.camera == c.camera && back.other == c.other && back.parts == c.parts);
  });
}

// What a case shows depends on more than its preset.
TEST(LabelCase, VersionsAreThoseOfAllThatIsDrawn) {
  const Camera camera(Pinhole{100, 100, 79.5, 59.5}, 160, 120);
  LabelCase c{.camera = camera, .scene = "paper"};
  const std::string preset = presetVersion("paper");
  EXPECT_EQ(sceneVersionOf(toJson(c)), preset);
  c.things_on_top = true;
  EXPECT_EQ(sceneVersionOf(toJson(c)), preset + ", " + kVarietyVersion);
  c.parts = {0};
  EXPECT_EQ(sceneVersionOf(toJson(c)), preset + ", " + kVarietyVersion + ", " + kPartsVersion);
  FrameCase frame{.property = "recovery", .camera = camera, .scene = "paper"};
  EXPECT_EQ(sceneVersionOf(toJson(frame)), preset);
  frame.variety.distractors = {2, 6};
  EXPECT_EQ(sceneVersionOf(toJson(frame)), preset + ", " + kVarietyVersion);
}

// What is wrong with a file is said with source, key, value and what is allowed.
TEST(LabelCase, WrongInputIsNamed) {
  const Camera camera(Pinhole{100, 100, 79.5, 59.5}, 160, 120);
  const auto json = toJson(LabelCase{.camera = camera, .scene = "paper"});
  const auto messageFor = [&](const char* key, const nlohmann::json& value) -> std::string {
    nlohmann::json wrong = json;
    wrong[key] = value;
    try {
      (void)judgeCase(wrong, "some.json", false);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(messageFor("scene", "moon"),
              HasSubstr("some.json: scene = \"moon\" is unknown: allowed is room,"));
  EXPECT_THAT(messageFor("property", "labels-odd"), HasSubstr("labels-complete"));
  EXPECT_THAT(messageFor("property", "labels-other-lens"), HasSubstr("other_camera"));
  EXPECT_THAT(messageFor("seed", -1), HasSubstr("seed"));
  EXPECT_THAT(messageFor("things_on_top", 2), HasSubstr("things_on_top"));
  EXPECT_THAT(messageFor("parts", nlohmann::json{0, 1000}), HasSubstr("parts[1] = 1000"));
  EXPECT_THAT(messageFor("parts", nlohmann::json{1, 1}), HasSubstr("is not in ascending order"));
  EXPECT_EQ(messageFor("seed", 3U), "accepted");
}

// --- Parts of scenes ---

TEST(SceneParts, AllOfThemAreTheScene) {
  holds(0.1, [] {
    const LabelCase c = drawLabelCase(LabelProperty::kOnBorders);
    const SceneView view = viewOf(c);
    const Scene same = withParts(view.scene, allParts(view.scene));
    RC_ASSERT(same.triangles.size() == view.scene.triangles.size());
    RC_ASSERT(same.faces.size() == view.scene.faces.size());
    RC_ASSERT(same.edges.size() == view.scene.edges.size());
    const Labels a = labelsOf(view, c.camera), b = labelsOf({same, view.pose}, c.camera);
    RC_ASSERT(a.lines.size() == b.lines.size());
    for (size_t i = 0; i < a.lines.size(); ++i) {
      RC_ASSERT(a.lines[i].edge == b.lines[i].edge);
      RC_ASSERT(a.lines[i].points == b.lines[i].points);
      RC_ASSERT(a.lines[i].contrast == b.lines[i].contrast);
    }
  });
}

// Whatever is taken out of a scene, its labels are true of what is left.
TEST(SceneParts, SomeOfThemAreAScene) {
  const auto draw = [] {
    LabelCase c = drawLabelCase(genProperty());
    c.parts = genSomeOf(partsOf(c));
    const Scene scene = viewOf(c).scene;
    for (const Triangle& t : scene.triangles) {
      RC_ASSERT(t.face >= 0 && t.face < static_cast<int>(scene.faces.size()));
    }
    for (const Edge& edge : scene.edges) {
      RC_ASSERT(std::max(edge.face0, edge.face1) < static_cast<int>(scene.faces.size()));
      RC_ASSERT(edge.rod < static_cast<int>(scene.rods.size()));
    }
    long sides = 0;
    for (const Face& face : scene.faces) {
      for (const Decal& print : face.decals) sides += print.shape == DecalShape::kRectangle ? 4 : 0;
    }
    RC_ASSERT(sides == std::count_if(scene.edges.begin(), scene.edges.end(), [](const Edge& edge) {
                return edge.source == EdgeSource::kDecal;
              }));
    return c;
  };
  std::array<long, kLabelPropertyCount> judged{};
  holdsOrSaves(
      0.3,
      draw,
      [](const LabelCase& c) { return checkLabels(c); },
      [&](const LabelCase& c, const LabelsOutcome& outcome) {
        if (outcome.applies) judged[static_cast<size_t>(c.property)] += outcome.counted;
      });
  for (int i = 0; i < kLabelPropertyCount; ++i) {
    EXPECT_GT(judged[static_cast<size_t>(i)], 20) << nameOf(static_cast<LabelProperty>(i));
  }
}

TEST(SceneParts, FramesAreOfSomeOfThem) {
  FrameCase c{.property = "recovery",
              .camera = Camera(Pinhole{100, 100, 79.5, 59.5}, 160, 120),
              .scene = "wires",
              .seed = 2,
              .index = 3,
              .sensor = {},
              .variety = {}};
  const Frame whole = renderCase(c);
  c.parts = allParts(makeSceneView(c.scene, c.seed, c.index).scene);
  EXPECT_EQ(renderCase(c).image.bytes, whole.image.bytes);
  c.parts->resize(c.parts->size() / 2);
  const FrameCase back = frameCaseFromJson(parseJson(toJson(c).dump(), "case"), "case");
  EXPECT_EQ(back.parts, c.parts);
  const Frame half = renderCase(back);
  EXPECT_GT(half.labels.lines.size(), 0U);
  EXPECT_LT(half.labels.lines.size(), whole.labels.lines.size());
}

// A defect that needs two things of a scene, seen in one corner of the picture, is shown by little
// more than these.
TEST(SceneParts, FailingCasesShrinkToFew) {
  const Camera camera(Pinhole{301.5, 299.25, 200.5, 140.5}, 400, 300);
  LabelCase c{.camera = camera, .scene = "room", .seed = 3, .index = 5, .things_on_top = true};
  const int count = partCount(viewOf(c).scene);
  ASSERT_GT(count, 20);
  const auto fails = [&](const LabelCase& tried) {
    const auto has = [&](int part) {
      return !tried.parts || std::count(tried.parts->begin(), tried.parts->end(), part) > 0;
    };
    return has(3) && has(count - 2) && tried.camera.width() >= 100;
  };
  for (bool is_simpler = true; is_simpler;) {
    const std::vector<LabelCase> simpler = simplerCases(c);
    const auto found = std::find_if(simpler.begin(), simpler.end(), fails);
    is_simpler = found != simpler.end();
    if (is_simpler) c = *found;
  }
  EXPECT_EQ(c.parts, (std::vector<int>{3, count - 2}));
  EXPECT_EQ(c.camera, Camera(Pinhole{50, 50, 49.5, 18}, 100, 37));
}

}  // namespace
}  // namespace dlsd
