#include "synth/generate.h"

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>

#include "cameras/calibration/files.h"
#include "synth/dataset/dataset.h"
#include "synth/dataset/json_fields.h"
#include "synth/test_cameras.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;

/// A folder that is gone afterwards.
class TempFolder {
 public:
  TempFolder() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    path_ = fs::path(testing::TempDir()) / (std::string("dlsd_") + info->name());
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~TempFolder() { fs::remove_all(path_); }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  [[nodiscard]] std::string at(const std::string& name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

GenerateOptions smallOptions(const std::string& out) {
  GenerateOptions options;
  options.cameras = testCameras(8);
  options.seed = 9;
  options.count = 6;
  options.out = out;
  options.sensor.read_noise_levels = 2;
  return options;
}

/// Path in the folder -> bytes.
std::map<std::string, std::string> contentOf(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[fs::relative(entry.path(), folder).string()] = readFile(entry.path().string());
    }
  }
  return files;
}

GenerateResult generate(const GenerateOptions& options) {
  return generateDataset(options, {});
}

std::string messageOf(const GenerateOptions& options) {
  try {
    (void)generate(options);
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

TEST(Generate, GivesTheSameBytesForAnyJobsAndShards) {
  const TempFolder temp;
  GenerateOptions options = smallOptions(temp.at("one"));
  options.jobs = 1;
  int calls = 0;
  const GenerateResult result = generateDataset(options, [&](const GenerateProgress& p) {
    EXPECT_EQ(p.done, ++calls);
    EXPECT_EQ(p.total, 6);
  });
  EXPECT_EQ(calls, 6);
  EXPECT_EQ(result.written, 6);
  EXPECT_EQ(result.kept, 0);
  const auto reference = contentOf(options.out);
  EXPECT_EQ(reference.size(), 6U + 6U + 4U + 1U);

  options.out = temp.at("two");
  options.jobs = 2;
  (void)generate(options);
  EXPECT_EQ(contentOf(options.out), reference);

  options.out = temp.at("shards");
  options.shard_count = 3;
  for (const int shard : {2, 0, 1}) {
    options.shard_index = shard;
    EXPECT_EQ(generate(options).written, 2);
  }
  auto sharded = contentOf(options.out);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(sharded.erase("manifest-" + std::to_string(i) + "-of-3.json"), 1U);
  }
  EXPECT_EQ(sharded, reference);
}

TEST(Generate, KeepsWhatIsFinishedAndRepairsWhatIsNot) {
  const TempFolder temp;
  const GenerateOptions options = smallOptions(temp.at("data"));
  (void)generate(options);
  const auto reference = contentOf(options.out);

  EXPECT_EQ(generate(options).kept, 6);
  fs::remove(options.out + "/images/000002.png");
  std::ofstream(options.out + "/labels/000004.json") << "{}";
  const GenerateResult repaired = generate(options);
  EXPECT_EQ(repaired.written, 2);
  EXPECT_EQ(repaired.kept, 4);
  EXPECT_EQ(contentOf(options.out), reference);

  fs::remove(options.out + "/manifest.json");
  EXPECT_EQ(generate(options).written, 6);
  EXPECT_EQ(contentOf(options.out), reference);
}

/// Stops after `frames` frames, as an interrupt does.
void generateSome(const GenerateOptions& options, int frames) {
  struct Interrupted {};
  EXPECT_THROW((void)generateDataset(options,
                                     [&](const GenerateProgress& p) {
                                       if (p.done == frames) throw Interrupted();
                                     }),
               Interrupted);
}

TEST(Generate, GoesOnWhereItWasInterrupted) {
  const TempFolder temp;
  GenerateOptions options = smallOptions(temp.at("whole"));
  (void)generate(options);
  const auto reference = contentOf(options.out);
  for (const int jobs : {1, 2}) {
    options.out = temp.at("jobs" + std::to_string(jobs));
    options.jobs = jobs;
    generateSome(options, 3);
    EXPECT_FALSE(fs::exists(options.out + "/manifest.json"));
    generateSome(options, 4);  // Interrupted again: the second run adds to the first one's journal.
    const std::string journal = options.out + "/journal.txt";
    // The last line torn, a file that is not what its line says, one that is half written.
    std::ofstream(journal, std::ios::app) << "5 0123";
    std::ofstream(options.out + "/images/000000.png") << "x";
    std::ofstream(options.out + "/images/000000.png.tmp-1-2") << "x";
    const GenerateResult result = generate(options);
    EXPECT_GE(result.kept, jobs == 1 ? 3 : 2);
    EXPECT_GE(result.written, 1);
    EXPECT_EQ(result.kept + result.written, 6);
    EXPECT_EQ(contentOf(options.out), reference);
  }
  // A shard's journal is of use to whoever makes the frames.
  options.out = temp.at("shards");
  options.shard_count = 2;
  generateSome(options, 2);
  options.shard_count = 1;
  EXPECT_GE(generate(options).kept, 2);
  EXPECT_EQ(contentOf(options.out), reference);
}

TEST(Generate, GoesOnWhereItWasKilled) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const TempFolder temp;
  GenerateOptions options = smallOptions(temp.at("killed"));
  options.jobs = 2;
  // With two threads the other frame is at any place of its making.
  EXPECT_EXIT((void)generateDataset(options,
                                    [](const GenerateProgress& p) {
                                      if (p.done == 3) (void)std::raise(SIGKILL);
                                    }),
              testing::KilledBySignal(SIGKILL),
              "");
  const GenerateResult result = generate(options);
  EXPECT_GE(result.kept, 3);
  EXPECT_EQ(result.kept + result.written, 6);
  const auto resumed = contentOf(options.out);
  options.out = temp.at("whole");
  (void)generate(options);
  EXPECT_EQ(resumed, contentOf(options.out));
}

TEST(Generate, RefusesAnotherRunsJournal) {
  const TempFolder temp;
  GenerateOptions options = smallOptions(temp.at("data"));
  generateSome(options, 1);
  const auto before = contentOf(options.out);
  options.seed = 10;
  EXPECT_THROW((void)generate(options), InputError);
  EXPECT_NE(messageOf(options).find("journal.txt"), std::string::npos) << messageOf(options);
  EXPECT_EQ(contentOf(options.out), before);
}

TEST(Generate, RefusesAnotherDatasetsFolder) {
  const TempFolder temp;
  GenerateOptions options = smallOptions(temp.at("data"));
  options.count = 1;
  (void)generate(options);
  const auto before = contentOf(options.out);
  options.seed = 10;
  EXPECT_THROW((void)generate(options), InputError);
  const std::string message = messageOf(options);
  EXPECT_NE(message.find("another dataset"), std::string::npos) << message;
  EXPECT_NE(message.find("seed is 9 there, 10 here"), std::string::npos) << message;
  options.seed = 9;
  options.sensor.exposure = 1.5;
  EXPECT_THROW((void)generate(options), InputError);
  options.sensor.exposure = 1;
  options.cameras.pop_back();
  EXPECT_THROW((void)generate(options), InputError);
  EXPECT_EQ(contentOf(options.out), before);
}

TEST(Generate, RefusesBadOptions) {
  const TempFolder temp;
  const auto refuses = [&](auto set, const char* says) {
    GenerateOptions options = smallOptions(temp.at("never"));
    set(&options);
    EXPECT_THROW((void)generate(options), std::invalid_argument) << says;
    EXPECT_NE(messageOf(options).find(says), std::string::npos) << messageOf(options);
  };
  refuses([](GenerateOptions* o) { o->cameras.clear(); }, "cameras");
  refuses([](GenerateOptions* o) { o->cameras[1].first = o->cameras[0].first; }, "twice");
  refuses([](GenerateOptions* o) { o->cameras[0].first = "../x"; }, "camera name");
  refuses([](GenerateOptions* o) { o->scene = "garden"; }, "garden");
  refuses([](GenerateOptions* o) { o->count = 0; }, "count = 0");
  refuses([](GenerateOptions* o) { o->jobs = -1; }, "jobs");
  refuses([](GenerateOptions* o) { o->shard_index = 1; }, "shard_index");
  refuses([](GenerateOptions* o) { o->out = ""; }, "out");
  refuses([](GenerateOptions* o) { o->sensor.psf_sigma_px = 99; }, "psf_sigma_px");
  EXPECT_FALSE(fs::exists(temp.at("never")));
}

TEST(Generate, SaysWhenItCannotWrite) {
  const TempFolder temp;
  std::ofstream(temp.at("file")) << "x";
  GenerateOptions options = smallOptions(temp.at("file") + "/data");
  EXPECT_THROW((void)generate(options), SystemError);
}

TEST(Generate, WritesWhatDatasetReads) {
  const TempFolder temp;
  const GenerateOptions options = smallOptions(temp.at("data"));
  (void)generate(options);
  const Dataset data(options.out);
  ASSERT_EQ(data.size(), 6U);
  for (size_t i = 0; i < data.size(); ++i) {
    const LabelRecord record = data.labels(i);
    EXPECT_EQ(record.index, i);
    EXPECT_EQ(record.seed, 9U);
    EXPECT_EQ(data.camera(record), options.cameras[i % 4].second);
    const Frame frame = renderFrame(options, i);
    EXPECT_EQ(data.image(record).bytes, frame.image.bytes);
    // As unordered objects: reading sorts the keys of `sensor`.
    EXPECT_EQ(nlohmann::json(toJson(record)), nlohmann::json(toJson(frame.labels)));
    EXPECT_GT(record.lines.size(), 20U);
  }
  fs::remove(options.out + "/images/000003.png");
  EXPECT_THROW((void)Dataset(options.out), InputError);
  EXPECT_THROW((void)Dataset(temp.at("nothing")), InputError);
}

// The set of spans in space depends neither on resolution nor on noise. (Rods may change between
// centre line and sides, so only edges of other things are compared; pieces at the border may end
// elsewhere.)
TEST(Generate, SpansDoNotDependOnResolutionOrNoise) {
  GenerateOptions fine, coarse;
  fine.cameras = {testCameras(1)[0]};
  coarse.cameras = {testCameras(4)[0]};
  fine.seed = coarse.seed = 77;
  coarse.sensor.read_noise_levels = 10;
  const auto inner = [](const Frame& frame) {
    std::map<std::pair<int, double>, LabelLine> lines;
    for (const LabelLine& l : frame.labels.lines) {
      const auto ok = [](EndKind e) { return e == EndKind::kVertex || e == EndKind::kOccluder; };
      if (ok(l.ends[0]) && ok(l.ends[1]))
        lines.emplace(std::pair(l.edge, l.points_in_cam[0].x()), l);
    }
    return lines;
  };
  const auto a = inner(renderFrame(fine, 1)), b = inner(renderFrame(coarse, 1));
  size_t same = 0;
  for (const auto& [key, line] : b) {
    const auto it = a.find(key);
    if (it == a.end()) continue;
    ++same;
    EXPECT_EQ(it->second.points_in_cam, line.points_in_cam);
    EXPECT_EQ(it->second.ends, line.ends);
  }
  // What is missing are rods and pieces next to the border.
  EXPECT_GT(same, b.size() * 8 / 10);
  EXPECT_GT(same, 100U);
}

}  // namespace
}  // namespace dlsd
