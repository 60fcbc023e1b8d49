// The detector against exact labels, over random cameras of every model and random scenes.
//
// Cases are a function of (RC_PARAMS seed, model, number), so a run can be repeated; RC_PARAMS
// max_success sets how many frames there are (one per 20).

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

#include "cameras/calibration/files.h"
#include "properties/checks/counterexample.h"
#include "properties/checks/recovery.h"
#include "properties/gen.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {
namespace {

/// A number from RC_PARAMS ("seed=1 max_success=200").
uint64_t rcParam(const std::string& key, uint64_t otherwise) {
  const char* env = std::getenv("RC_PARAMS");
  std::string params = " ";
  if (env != nullptr) params += env;
  const size_t at = params.find(" " + key + "=");
  return at == std::string::npos ? otherwise : std::stoull(params.substr(at + key.size() + 2));
}

/// A camera that could take the picture: large enough for lines of 40 px, small enough to be quick.
Camera drawCamera(std::string_view model, uint64_t seed) {
  const auto gen = rc::gen::suchThat(genCamera(model, Range::kRealistic), [](const Camera& camera) {
    const long pixels = static_cast<long>(camera.width()) * camera.height();
    return pixels >= 300000 && pixels <= 1500000;
  });
  return gen(rc::Random(seed), 100).value();
}

constexpr const char* kScenes[] = {
    "polyhedra", "room", "polyhedra", "polyhedra", "paper", "polyhedra"};

struct Pool {
  long eligible = 0, qualified = 0, found = 0;
  Pool& operator+=(const RecoveryOutcome& outcome) {
    eligible += outcome.eligible;
    qualified += outcome.qualified;
    found += outcome.found();
    return *this;
  }
};

std::ostream& operator<<(std::ostream& out, const Pool& pool) {
  return out << "found " << pool.found << "/" << pool.qualified << " clear labels; "
             << pool.qualified << "/" << pool.eligible << " of contrast and length are clear";
}

// Noise-free, linear encoding, optical blur 0.7 px: labels of >= 30 grey levels and >= max(5 deg,
// 40 px) that are >= 12 px from other edges are found at rho = 4 px. Pooled recall >= 97 %, over
// all models and each; at least 30 % of the labels of that contrast and length must be clear, or
// the property would be about the easy few.
TEST(DetectorSuite, ClearLabelsAreFound) {
  const uint64_t seed = rcParam("seed", 1);
  const uint64_t frames = std::max<uint64_t>(4, rcParam("max_success", 100) / 20);
  const std::string folder = "counterexamples";
  Pool all;
  const auto run = [&]<class Model>(const Model&) {
    Pool pool;
    for (uint64_t i = 0; i < frames; ++i) {
      FrameCase frame_case{.property = "recovery",
                           .camera = drawCamera(Model::kName, seed * 1000003 + i),
                           .scene = kScenes[i % std::size(kScenes)],
                           .seed = seed,
                           .index = i,
                           .sensor = {},
                           .detector = "dlsd"};
      const Frame frame = renderCase(frame_case);
      const RecoveryOutcome outcome = checkRecovery(frame_case, frame, {});
      pool += outcome;
      all += outcome;
      if (!outcome.missed_ids.empty()) {
        std::cout << "  " << outcome.missed_ids.size() << " missed of " << outcome.qualified << ": "
                  << saveCounterexample(folder, frame_case, frame, outcome) << "\n";
      }
    }
    std::cout << Model::kName << ", " << frames << " frames: " << pool << "\n";
    EXPECT_GT(pool.qualified, 0);
    EXPECT_GE(static_cast<double>(pool.found), 0.97 * static_cast<double>(pool.qualified))
        << Model::kName << ": replay the cases in " << std::filesystem::absolute(folder);
  };
  const auto run_all = [&]<size_t... I>(std::index_sequence<I...>) {
    (run(std::variant_alternative_t<I, CameraModelVariant>{}), ...);
  };
  run_all(std::make_index_sequence<std::variant_size_v<CameraModelVariant>>());
  std::cout << "all models, seed " << seed << ": " << all << "\n";
  EXPECT_GE(static_cast<double>(all.qualified), 0.30 * static_cast<double>(all.eligible));
}

// A found and fixed failure stays fixed.
TEST(Counterexamples, EachIsFixed) {
  const std::filesystem::path folder = DLSD_SOURCE_DIR "/fixtures/counterexamples";
  int replayed = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".json") continue;
    const std::string path = entry.path().string();
    const FrameCase frame_case = frameCaseFromJson(parseJson(readFile(path), path), path);
    ASSERT_EQ(frame_case.property, "recovery") << path;
    const RecoveryOutcome outcome = checkRecovery(frame_case, renderCase(frame_case), {});
    EXPECT_GT(outcome.qualified, 0) << path;
    EXPECT_TRUE(outcome.missed_ids.empty())
        << path << ": " << outcome.missed_ids.size() << " missed";
    ++replayed;
  }
  std::cout << replayed << " counterexamples replayed\n";
}

TEST(FrameCase, RoundTripsThroughJson) {
  rc::check([] {
    const FrameCase frame_case{
        .property = "recovery",
        .camera = *genAnyCamera(Range::kAdmissible),
        .scene = "paper",
        .seed = *rc::gen::arbitrary<uint64_t>(),
        .index = *rc::gen::arbitrary<uint64_t>(),
        .sensor = {.psf_sigma_px = *genReal(0, 20), .encoding = Encoding::kGamma},
        .detector = "dlsd-paper"};
    const auto json = toJson(frame_case);
    const FrameCase back = frameCaseFromJson(parseJson(json.dump(), "case"), "case");
    RC_ASSERT(toJson(back) == json);
    RC_ASSERT(back.camera == frame_case.camera);
  }) ||
      (ADD_FAILURE(), true);
}

}  // namespace
}  // namespace dlsd
