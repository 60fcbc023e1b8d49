// The detector against exact labels, over random cameras of every model and random scenes.
//
// Cases are a function of (RC_PARAMS seed, model, number); without a seed one is drawn, and
// printed, so that a run can be repeated. RC_PARAMS max_success sets how many frames there are (one
// per 30 to 60, of each model).

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cameras/calibration/files.h"
#include "properties/checks/counterexample.h"
#include "properties/checks/judge.h"
#include "properties/checks/recovery.h"
#include "properties/checks/soundness.h"
#include "properties/gen.h"
#include "properties/holds.h"
#include "properties/worst.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {
namespace {

/// A number from RC_PARAMS ("seed=1 max_success=200"): the last of that name, as RapidCheck takes
/// it.
std::optional<uint64_t> rcParam(const std::string& key) {
  const char* env = std::getenv("RC_PARAMS");
  std::string params = " ";
  if (env != nullptr) params += env;
  const size_t at = params.rfind(" " + key + "=");
  if (at == std::string::npos) return std::nullopt;
  return std::stoull(params.substr(at + key.size() + 2));
}

/// A camera of 0.7 to 2 megapixels.
Camera drawCamera(std::string_view model, uint64_t seed) {
  const auto gen = rc::gen::suchThat(genCamera(model, Range::kRealistic), [](const Camera& camera) {
    const long pixels = static_cast<long>(camera.width()) * camera.height();
    return pixels >= 700000 && pixels <= 2000000;
  });
  return gen(rc::Random(seed), 100).value();
}

/// counted / total over frames.
struct Pool {
  long counted = 0, total = 0;
  [[nodiscard]] double share() const {
    return total > 0 ? static_cast<double>(counted) / static_cast<double>(total) : 0;
  }
  void add(const Pool& other) {
    counted += other.counted;
    total += other.total;
  }
  /// Three standard deviations of a count of which each is counted with this probability: few say
  /// little.
  [[nodiscard]] double chance(double share_of_each) const {
    return 3 * std::sqrt(share_of_each * (1 - share_of_each) * static_cast<double>(total));
  }
  [[nodiscard]] bool atLeast(double bound) const {
    return static_cast<double>(counted) >= bound * static_cast<double>(total) - chance(bound);
  }
  [[nodiscard]] bool atMost(double bound) const {
    return static_cast<double>(counted) <= bound * static_cast<double>(total) + chance(bound);
  }
};
std::ostream& operator<<(std::ostream& out, const Pool& pool) {
  return out << pool.counted << "/" << pool.total;
}

struct Frames {
  const char* property;
  std::vector<std::string> scenes;
  double noise_levels = 0;
  bool distractors = false;
  double frames_per_case = 0.03;
};

void save(const FrameCase& frame_case, const std::string& what, const ShownPicture& shown) {
  const std::string folder =
      saveCounterexample("counterexamples", toJson(frame_case), what, {shown});
  std::cout << "  " << what << ": dlsd replay "
            << std::filesystem::absolute(folder + "/case.json").string() << "\n";
}

/// Calls judge(case, frame) for frames of these scenes through random cameras of every model, and
/// after_model(model) after those of each. What judge throws is a failure, and saved.
void forFrames(const Frames& frames, const auto& judge, const auto& after_model) {
  const uint64_t seed = rcParam("seed").value_or(std::random_device{}());
  // Of fewer frames than those of the quick preset, shares say too little.
  constexpr uint64_t kQuickCases = 200;
  const uint64_t cases = std::max(kQuickCases, rcParam("max_success").value_or(kQuickCases));
  const auto count =
      static_cast<uint64_t>(static_cast<double>(cases) * frames.frames_per_case + 1e-9);
  std::cout << "seed " << seed << ", " << count << " frames of each model\n";
  for (const std::string_view model : cameraModelNames()) {
    for (uint64_t i = 0; i < count; ++i) {
      FrameCase frame_case{.property = frames.property,
                           .camera = drawCamera(model, seed * 1000003 + i),
                           .scene = frames.scenes[i % frames.scenes.size()],
                           .seed = seed,
                           .index = i,
                           .sensor = {.read_noise_levels = frames.noise_levels},
                           .variety = {},
                           .detector = "dlsd"};
      if (frames.distractors) frame_case.variety.distractors = {2, 6};
      SCOPED_TRACE(toJson(frame_case).dump());
      const UnfinishedCase unfinished("counterexamples", toJson(frame_case));
      const Frame frame = renderCase(frame_case);
      try {
        judge(frame_case, frame);
      } catch (const std::exception& error) {
        ADD_FAILURE() << error.what();
        save(frame_case, std::string("an exception: ") + error.what(), {frame.image, {}, {}, {}});
      }
    }
    std::cout << model << ": ";
    after_model(model);
  }
}

// --- Saved cases, before all others ---

TEST(Counterexamples, EachIsFixed) {
  const std::filesystem::path folder = DLSD_SOURCE_DIR "/fixtures/counterexamples";
  int replayed = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".json") continue;
    const std::string path = entry.path().string();
    const Verdict verdict = judgeCase(parseJson(readFile(path), path), path, false);
    EXPECT_GT(verdict.counted, 0) << path;
    EXPECT_EQ(verdict.failure, "") << path;
    EXPECT_EQ(verdict.noted, "") << path;
    EXPECT_EQ(verdict.other_scene, "") << path;
    ++replayed;
  }
  EXPECT_GT(replayed, 0);
}

// --- Recovery ---

/// Of the labels of contrast and length, this share at least is clear, and of these, that share is
/// found. The first keeps the property from being about an easy few.
struct RecoveryBounds {
  double clear, found;
  double found_by_model;  ///< Of each model, give or take chance.
};

void expectClearLabelsFound(const Frames& frames, const RecoveryBounds& bounds) {
  Pool clear, found, model_clear, model_found;
  Worst missed("share of clear labels missed", cameraModelNames());
  size_t kind = 0;
  forFrames(
      frames,
      [&](const FrameCase& frame_case, const Frame& frame) {
        const RecoveryOutcome outcome =
            checkRecovery(frame_case, frame, recoveryCriteria(frame_case));
        model_clear.add({outcome.qualified, outcome.eligible});
        model_found.add({outcome.found(), outcome.qualified});
        if (outcome.missed_ids.empty()) return;
        save(frame_case,
             std::to_string(outcome.missed_ids.size()) + " of " +
                 std::to_string(outcome.qualified) + " clear labels missed",
             shownOf(frame, outcome));
      },
      [&](std::string_view model) {
        std::cout << "found " << model_found << " clear labels; " << model_clear
                  << " of contrast and length are\n";
        EXPECT_TRUE(model_found.atLeast(bounds.found_by_model)) << model << " " << model_found;
        if (model_found.total > 0) missed.see(1 - model_found.share(), kind);
        ++kind;
        clear.add(std::exchange(model_clear, {}));
        found.add(std::exchange(model_found, {}));
      });
  EXPECT_GE(found.total, 100);
  EXPECT_GE(found.share(), bounds.found) << found;
  EXPECT_GE(clear.share(), bounds.clear) << clear;
}

TEST(DetectorSuite, ClearLabelsOfSolidsAndSheetsAreFound) {
  expectClearLabelsFound({"recovery", {"polyhedra", "polyhedra", "paper"}}, {0.30, 0.99, 0.98});
}

TEST(DetectorSuite, ClearLabelsOfSolidsAndSheetsAreFoundInNoise) {
  expectClearLabelsFound({"recovery", {"polyhedra", "polyhedra", "paper"}, 8}, {0.30, 0.97, 0.95});
}

// Fewer labels are clear: every label that something stands in front of has the edge of that thing
// at its end.
TEST(DetectorSuite, ClearLabelsOfRoomsAreFound) {
  expectClearLabelsFound({"recovery", {"room"}, 0, false, 0.02}, {0.03, 0.98, 0.96});
}

// --- Soundness ---

/// At most these shares of the detections lie on no labels, and on labels of several 3D lines, and
/// in at most this share of the frames a detection of kLongWrongPx lies on none.
struct SoundnessBounds {
  double wrong, astray;
  double wrong_by_model;  ///< Of each model, give or take chance.
  double long_wrong;      ///< Give or take chance.
};

void expectSound(const Frames& frames, const SoundnessBounds& bounds) {
  Pool wrong, merged, astray, model_wrong, long_wrong;
  Worst longest("length of a detection on no label, px");
  Worst wrong_shares("share of detections on no label", cameraModelNames());
  size_t kind = 0;
  forFrames(
      frames,
      [&](const FrameCase& frame_case, const Frame& frame) {
        const SoundnessOutcome outcome = checkSoundness(frame_case, frame);
        const auto detections = static_cast<long>(outcome.detections.size());
        model_wrong.add({static_cast<long>(outcome.wrong.size()), detections});
        merged.add({static_cast<long>(outcome.merged.size()), detections});
        astray.add({static_cast<long>(outcome.astray.size()), detections});
        longest.see(outcome.longest_wrong_px);
        const bool is_long = !(outcome.longest_wrong_px < kLongWrongPx);
        long_wrong.add({is_long ? 1 : 0, 1});
        if (!is_long) return;
        save(frame_case, "a detection of 150 px or more on no label", shownOf(frame, outcome));
      },
      [&](std::string_view model) {
        std::cout << model_wrong << " on no label\n";
        EXPECT_TRUE(model_wrong.atMost(bounds.wrong_by_model)) << model << " " << model_wrong;
        if (model_wrong.total > 0) wrong_shares.see(model_wrong.share(), kind);
        ++kind;
        wrong.add(std::exchange(model_wrong, {}));
      });
  std::cout << wrong << " on no label, " << astray << " on several lines, " << merged
            << " bridge gaps; of 150 px on no label in " << long_wrong << " frames\n";
  EXPECT_GE(wrong.total, 500);
  EXPECT_LE(wrong.share(), bounds.wrong) << wrong;
  EXPECT_LE(astray.share(), bounds.astray) << astray;
  EXPECT_TRUE(long_wrong.atMost(bounds.long_wrong)) << long_wrong;
}

TEST(DetectorSuite, DetectionsAreLabelledLines) {
  expectSound({"soundness", scenePresets(), 0, false, 0.035}, {0.01, 0.03, 0.02, 0.01});
}

TEST(DetectorSuite, DetectionsAreLabelledLinesBesideRoundThings) {
  expectSound({"soundness", {"polyhedra", "paper", "wires"}, 2, true, 0.015},
              {0.10, 0.06, 0.15, 0.02});
}

// --- Cases ---

TEST(FrameCase, RoundTripsThroughJson) {
  holds(1, [] {
    const FrameCase frame_case{
        .property = "recovery",
        .camera = *genAnyCamera(Range::kAdmissible),
        .scene = "paper",
        .seed = *rc::gen::arbitrary<uint64_t>(),
        .index = *rc::gen::arbitrary<uint64_t>(),
        .sensor = {.psf_sigma_px = *genReal(0, 20), .encoding = Encoding::kGamma},
        .variety = {.distractors = {0, *genReal(0, 30)}},
        .detector = "dlsd-paper"};
    const auto json = toJson(frame_case);
    const FrameCase back = frameCaseFromJson(parseJson(json.dump(), "case"), "case");
    RC_ASSERT(toJson(back) == json);
    RC_ASSERT(back.camera == frame_case.camera);
  });
}

}  // namespace
}  // namespace dlsd
