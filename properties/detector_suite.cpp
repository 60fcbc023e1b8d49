// The detector against exact labels, over random cameras of every model and random scenes.
//
// Cases are a function of (RC_PARAMS seed, model, number); without a seed one is drawn, and
// printed, so that a run can be repeated. RC_PARAMS max_success sets how many frames there are (one
// per 20).

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "cameras/calibration/files.h"
#include "properties/checks/counterexample.h"
#include "properties/checks/recovery.h"
#include "properties/gen.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {
namespace {

/// A number from RC_PARAMS ("seed=1 max_success=200").
std::optional<uint64_t> rcParam(const std::string& key) {
  const char* env = std::getenv("RC_PARAMS");
  std::string params = " ";
  if (env != nullptr) params += env;
  const size_t at = params.find(" " + key + "=");
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

struct Pool {
  long eligible = 0, qualified = 0, found = 0;
  Pool& operator+=(const RecoveryOutcome& outcome) {
    return *this += Pool{outcome.eligible, outcome.qualified, outcome.found()};
  }
  Pool& operator+=(const Pool& other) {
    eligible += other.eligible;
    qualified += other.qualified;
    found += other.found;
    return *this;
  }
};

std::ostream& operator<<(std::ostream& out, const Pool& pool) {
  return out << "found " << pool.found << "/" << pool.qualified << " clear labels; "
             << pool.qualified << "/" << pool.eligible << " of contrast and length are clear";
}

/// Frames of these scenes through random cameras of every model; misses are saved. The share of
/// labels of contrast and length that must be clear keeps the property from being about an easy
/// few.
void expectClearLabelsFound(const std::vector<const char*>& scenes, double min_clear_share) {
  const uint64_t seed = rcParam("seed").value_or(std::random_device{}());
  const uint64_t frames = std::max<uint64_t>(10, rcParam("max_success").value_or(100) / 20);
  std::cout << "seed " << seed << "\n";
  const std::string folder = "counterexamples";
  Pool all;
  const auto run = [&]<class Model>(const Model&) {
    Pool pool;
    for (uint64_t i = 0; i < frames; ++i) {
      const FrameCase frame_case{.property = "recovery",
                                 .camera = drawCamera(Model::kName, seed * 1000003 + i),
                                 .scene = scenes[i % scenes.size()],
                                 .seed = seed,
                                 .index = i,
                                 .sensor = {},
                                 .detector = "dlsd"};
      const Frame frame = renderCase(frame_case);
      SCOPED_TRACE(toJson(frame_case).dump());
      const RecoveryOutcome outcome = checkRecovery(frame_case, frame, {});
      pool += outcome;
      if (!outcome.missed_ids.empty()) {
        std::cout << "  " << outcome.missed_ids.size() << " missed of " << outcome.qualified << ": "
                  << saveCounterexample(folder, frame_case, frame, outcome) << "\n";
      }
    }
    std::cout << Model::kName << ", " << frames << " frames: " << pool << "\n";
    EXPECT_GT(pool.qualified, 0) << Model::kName;
    all += pool;
  };
  const auto run_all = [&]<size_t... I>(std::index_sequence<I...>) {
    (run(std::variant_alternative_t<I, CameraModelVariant>{}), ...);
  };
  run_all(std::make_index_sequence<std::variant_size_v<CameraModelVariant>>());
  std::cout << "all models: " << all << "\n";
  EXPECT_GE(all.qualified, 100);
  EXPECT_GE(static_cast<double>(all.found), 0.97 * static_cast<double>(all.qualified))
      << "replay the cases in " << std::filesystem::absolute(folder);
  EXPECT_GE(static_cast<double>(all.qualified),
            min_clear_share * static_cast<double>(all.eligible));
}

// Noise-free, linear encoding, optical blur 0.7 px: labels of >= 30 grey levels and >= max(5 deg,
// 40 px) that are >= 12 px from other edges are found at rho = 4 px: pooled recall >= 97 %, and at
// least 30 % of the labels of that contrast and length are clear.
TEST(DetectorSuite, ClearLabelsOfSolidsAndSheetsAreFound) {
  expectClearLabelsFound({"polyhedra", "polyhedra", "paper"}, 0.30);
}

// The same in furnished rooms, where fewer labels are clear: every label that something stands in
// front of has the edge of that thing at its end.
TEST(DetectorSuite, ClearLabelsOfRoomsAreFound) {
  expectClearLabelsFound({"room"}, 0.03);
}

// A found and fixed failure stays fixed.
TEST(Counterexamples, EachIsFixed) {
  const std::filesystem::path folder = DLSD_SOURCE_DIR "/fixtures/counterexamples";
  int replayed = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
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
  EXPECT_GT(replayed, 0);
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
