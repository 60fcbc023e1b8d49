// The presets are frozen: what a version means never changes.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "cameras/calibration/calibration.h"
#include "synth/dataset/dataset.h"
#include "synth/dataset/statistics.h"
#include "synth/labels.h"
#include "synth/scene.h"

namespace dlsd {
namespace {

/// Everything that a scene draws, in units of 1e-4, so that the last bits of sine and cosine of
/// another machine make no difference.
class SceneText {
 public:
  explicit SceneText(const SceneView& view) {
    const Scene& scene = view.scene;
    for (const Eigen::Vector3f& v : scene.vertices) add(v.cast<double>());
    for (const Triangle& t : scene.triangles) {
      for (const int v : t.vertices) addCount(v);
      addCount(t.face);
    }
    for (const Edge& e : scene.edges) {
      add(e.from);
      add(e.to);
      for (const int k : {static_cast<int>(e.source), e.face0, e.face1, e.rod}) addCount(k);
    }
    for (const Face& f : scene.faces) {
      addCount(f.surface);
      for (const Decal& d : f.decals) {
        addCount(static_cast<int>(d.shape));
        addCount(d.surface);
        for (const Eigen::Vector2d& v : {d.centre, d.axis, d.half}) add(v);
      }
    }
    for (const Surface& s : scene.surfaces) add(Eigen::Vector2d(s.albedo, s.emission));
    for (const Sphere& s : scene.spheres) {
      add(s.centre.cast<double>());
      add(static_cast<double>(s.radius));
    }
    for (const Disc& d : scene.discs) {
      add(d.centre.cast<double>());
      add(d.normal.cast<double>());
      add(static_cast<double>(d.radius));
    }
    for (const Light& l : scene.lights) {
      add(l.place);
      add(Eigen::Vector2d(l.strength, l.half_distance));
    }
    add(Eigen::Vector2d(scene.ambient_up, scene.ambient_down));
    for (int i = 0; i < 3; ++i) add(Eigen::Vector3d(view.pose.cam_from_world.row(i).transpose()));
    add(view.pose.position_in_world);
  }

  [[nodiscard]] std::string sha256() const { return sha256Hex(text_); }

 private:
  template <class Vector>
  void add(const Vector& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i) add(v[i]);
  }
  void add(double x) { text_ += std::to_string(std::lround(x * 1e4)) + ' '; }
  void addCount(int n) { text_ += std::to_string(n) + ' '; }
  std::string text_;
};

// If this fails, seeds give other scenes than before and every dataset, figure and counter-example
// made from them means something else: give the preset a new version number ("room/3") together
// with the new hash, or undo the change.
TEST(Presets, AreFrozen) {
  const std::map<std::string, std::string> golden{
      {"room/2", "696f0c889ec57beab9896897de4688e319af69d6977ddcb648e9bf610fc39bc9"},
      {"paper/2", "82e168e233c851f9de6825822fd29cbccd8d0409029fafd4ae1b25652d15b196"},
      {"polyhedra/2", "40100d284b41bce29366e969ee8e0244152694366f7c31de731e94dd2acf6b0c"},
      {"wires/2", "1eca6861e84a1de4bae6b922f54621a16fff1967ba495a1e4c29d188dd16d52f"},
      {"corridor/2", "039c248772c695078e0fd715cd5f67697fd63051b882c0b8f700344a251620c2"},
      {"facade/2", "4a5497cb2f5dd6a676dba3eed006034c09a40827acc1ed8e49a19bd7562cefc1"},
      {"checkerboard/2", "2e28e52e6f656dc6de56558851df6107ac41038496595675a70f9099d4ce6643"},
  };
  ASSERT_EQ(golden.size(), scenePresets().size());
  for (const std::string& preset : scenePresets()) {
    std::string all;
    for (uint64_t k = 0; k < 8; ++k) {
      all += SceneText(makeSceneView(preset, k / 2, 37 * k)).sha256();
    }
    const std::string version = presetVersion(preset);
    ASSERT_TRUE(golden.contains(version)) << version;
    EXPECT_EQ(sha256Hex(all), golden.at(version)) << version;
  }
}

// What makes `room` a real room and not a toy: many labels, crowded, cut off. "Crowded" is the
// strict count, which leaves out 15 px at every end, so that shared corners don't make neighbours.
TEST(Presets, RoomsAreCrowded) {
  const std::vector<std::string> names{
      "catadioptric", "fisheye_180", "tum_mono_wide", "pinhole_90"};
  constexpr uint64_t kFramesPerCamera = 10;
  std::vector<LabelRecord> all;
  for (size_t c = 0; c < names.size(); ++c) {
    const Camera camera =
        loadCamera(DLSD_SOURCE_DIR "/fixtures/calibrations/" + names[c] + ".yaml");
    ASSERT_EQ(camera.width(), 1280);
    ASSERT_EQ(camera.height(), 1024);
    std::vector<LabelRecord> records;
    for (uint64_t i = 0; i < kFramesPerCamera; ++i) {
      const SceneView view = makeSceneView("room", 0, i * names.size() + c);
      const Raycaster raycaster(view.scene);
      LabelRecord record;
      record.lines = makeLabels(view.scene,
                                raycaster,
                                Shader(view.scene),
                                camera,
                                view.pose,
                                SensorOptions{},
                                visibleSpans(view.scene, raycaster, camera, view.pose))
                         .lines;
      records.push_back(std::move(record));
    }
    const LabelStatistics s = labelStatistics(records);
    std::printf("%s: median %.0f labels, crowded %.1f %%, cut ends %.1f %%\n",
                names[c].c_str(),
                s.median_lines_per_frame,
                100 * s.crowdedShare(),
                100 * s.cutEndShare());
    EXPECT_GE(s.median_lines_per_frame, 100) << names[c];
    all.insert(all.end(), records.begin(), records.end());
  }
  const LabelStatistics s = labelStatistics(all);
  std::printf("all: median %.0f labels, crowded %.1f %%, cut ends %.1f %%\n",
              s.median_lines_per_frame,
              100 * s.crowdedShare(),
              100 * s.cutEndShare());
  EXPECT_GE(s.median_lines_per_frame, 100);
  EXPECT_GE(s.crowdedShare(), 0.30);
  EXPECT_GE(s.cutEndShare(), 0.25);
}

}  // namespace
}  // namespace dlsd
