#include "synth/dataset/dataset.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "synth/dataset/json_fields.h"
#include "synth/dataset/statistics.h"

namespace dlsd {
namespace {

using nlohmann::json;

LabelRecord sampleRecord() {
  LabelRecord r;
  r.image = "images/000007.png";
  r.camera = "cameras/wide.yaml";
  r.width = 640;
  r.height = 480;
  r.seed = 18446744073709551615ULL;
  r.index = 7;
  r.cam_from_world(0, 3) = 0.1;
  r.sensor = {{"psf_sigma_px", 0.7}};
  LabelLine line;
  line.id = 0;
  line.edge = 12;
  line.carrier = 3;
  line.kind = LineKind::kMaterial;
  line.points_in_cam = {Eigen::Vector3d(0.1, 0.2, 1.0 / 3), Eigen::Vector3d(-1, 0, 2)};
  line.normal = {0.6, 0, -0.8};
  line.points = {{1.5, 2.25}, {10, 20}, {100.123456, 200}};
  line.ends = {EndKind::kBorder, EndKind::kOccluder};
  line.length_px = 230.5;
  line.angle_rad = 0.4;
  line.contrast = 35.5;
  line.contrast_min = 20;
  r.lines = {line, line};
  r.lines[1].id = 1;
  r.junctions = {{{1.5, 2.25}, {0, 1}}};
  return r;
}

std::string messageOf(const json& document) {
  try {
    (void)labelRecordFromJson(document, "folder/x.json");
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(LabelRecord, SurvivesItsJson) {
  const LabelRecord record = sampleRecord();
  const std::string text = toJson(record).dump();
  const LabelRecord back = labelRecordFromJson(parseJson(text, "x"), "x");
  EXPECT_EQ(toJson(back).dump(), text);
  EXPECT_EQ(back.seed, record.seed);
  ASSERT_EQ(back.lines.size(), 2U);
  EXPECT_EQ(back.lines[0].points, record.lines[0].points);
  EXPECT_EQ(back.lines[0].points_in_cam, record.lines[0].points_in_cam);
  EXPECT_EQ(back.lines[0].ends, record.lines[0].ends);
  EXPECT_EQ(back.junctions[0].lines, record.junctions[0].lines);
}

/// All (pointer to object, key) of a document, in a depth-first walk.
void collectKeys(const json& value,
                 const json::json_pointer& at,
                 std::vector<json::json_pointer>* out) {
  if (value.is_object()) {
    for (const auto& [key, child] : value.items()) {
      out->push_back(at / key);
      collectKeys(child, at / key, out);
    }
  } else if (value.is_array()) {
    for (size_t i = 0; i < value.size(); ++i) collectKeys(value[i], at / i, out);
  }
}

TEST(LabelRecord, RefusalsNameFileAndKey) {
  const json document = json::parse(toJson(sampleRecord()).dump());
  std::vector<json::json_pointer> keys;
  collectKeys(document, json::json_pointer(), &keys);
  size_t tried = 0;
  for (const json::json_pointer& pointer : keys) {
    if (pointer.to_string().starts_with("/sensor/")) continue;  // Free content.
    const std::string key = pointer.back();
    json missing = document;
    missing[pointer.parent_pointer()].erase(key);
    const std::string message = messageOf(missing);
    EXPECT_NE(message.find("folder/x.json"), std::string::npos) << pointer << ": " << message;
    EXPECT_NE(message.find(key), std::string::npos) << pointer << ": " << message;
    EXPECT_NE(message.find("missing"), std::string::npos) << pointer << ": " << message;
    for (const json& wrong :
         {json(nullptr), json(true), json("?"), json(-3.5), json::array({"a"})}) {
      if (wrong.is_string() && (key == "image" || key == "camera")) continue;  // Any text will do.
      json changed = document;
      changed[pointer] = wrong;
      const std::string says = messageOf(changed);
      EXPECT_NE(says.find("folder/x.json"), std::string::npos)
          << pointer << " = " << wrong << ": " << says;
      EXPECT_NE(says.find(key), std::string::npos) << pointer << " = " << wrong << ": " << says;
      ++tried;
    }
  }
  EXPECT_GT(tried, 100U);
}

TEST(LabelRecord, RefusesWrongValues) {
  const json good = json::parse(toJson(sampleRecord()).dump());
  const auto says = [&](const char* pointer, const json& value, const char* text) {
    json changed = good;
    changed[json::json_pointer(pointer)] = value;
    EXPECT_NE(messageOf(changed).find(text), std::string::npos) << messageOf(changed);
  };
  says("/format", "dlsd-labels/2", "must be \"dlsd-labels/1\"");
  says("/lines/0/kind", "edge", "crease, silhouette, material, wire, shadow");
  says("/lines/0/ends/1", "open", "lines[0].ends[1]");
  says("/lines/1/normal", {1, 1, 0}, "unit vector");
  says("/lines/0/points", json::array({{1, 2}}), "at least 2");
  says("/lines/0/points/1", {1, 2, 3}, "lines[0].points[1]");
  says("/width", 0, "[1, 65535]");
  says("/width", 1e300, "width");
  says("/cam_from_world/2", {1, 2, 3}, "cam_from_world[2]");
  EXPECT_NE(messageOf(json::array()).find("must be an object"), std::string::npos);
}

TEST(ParseJson, RefusesWhatIsNoJson) {
  for (const char* text : {"", "{", "{\"a\": NaN}", "[1e999]", "{\"a\": 1} x", "\xff"}) {
    try {
      (void)parseJson(text, "some.json");
      ADD_FAILURE() << text;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("some.json"), std::string::npos);
    }
  }
}

class TempFile {
 public:
  explicit TempFile(const std::string& content) {
    path_ = testing::TempDir() + "dlsd_dataset_test_" +
            testing::UnitTest::GetInstance()->current_test_info()->name();
    std::ofstream(path_, std::ios::binary) << content;
  }
  ~TempFile() { std::filesystem::remove(path_); }
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

TEST(Detections, ReadFromJsonLines) {
  DetectionRecord record;
  record.image = "a.png";
  record.camera = "c.yaml";
  record.width = 10;
  record.height = 20;
  record.frame = 7;
  record.stamp_s = 0.28;
  record.time_ms = 1.5;
  DetectionLine line;
  line.points = {{1, 2}, {3, 4}};
  line.normal = Eigen::Vector3d(0, 0, 1);
  line.end_rays_in_cam = {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)};
  line.normal_cov = Eigen::Matrix3d::Identity();
  line.rms_px = 0.25;
  line.max_px = 0.5;
  line.angle_rad = 0.1;
  line.score = -2.5;
  line.polarity = -1;
  record.lines = {line};
  const std::string full = toJson(record).dump();
  const TempFile file(
      full + "\n\n  \r\n{\"image\": \"b.png\", \"lines\": [{\"points\": [[0, 0], [1, 1]]}]}");
  const auto records = readDetections(file.path());
  ASSERT_EQ(records.size(), 2U);
  EXPECT_EQ(toJson(records[0]).dump(), full);
  EXPECT_EQ(records[1].image, "b.png");
  EXPECT_FALSE(records[1].lines[0].score.has_value());
}

TEST(Detections, RefusalsNameTheLine) {
  for (const char* bad :
       {"{\"image\": \"b\", \"lines\": [{\"points\": [[0, 0]]}]}",
        "{\"image\": \"b\"}",
        "{\"lines\": []}",
        "{\"image\": \"b\", \"lines\": [{\"points\": [[0, 0], [1, 1]], \"polarity\": 0}]}",
        "{\"image\": \"b\", \"lines\": [{\"points\": [[0, 0], [1, \"1\"]]}]}",
        "{\"image\": \"b\", \"format\": \"x\", \"lines\": []}",
        "{\"image\": \"b\", \"lines\": ["}) {
    const TempFile file(std::string("{\"image\": \"a\", \"lines\": []}\n") + bad + "\n");
    try {
      (void)readDetections(file.path());
      ADD_FAILURE() << bad;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(file.path() + " line 2"), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW((void)readDetections("/nonexistent/x.jsonl"), InputError);
}

TEST(Images, SurvivePng) {
  for (const int bits : {8, 16}) {
    for (const int channels : {1, 3, 4}) {
      Image image{7, 5, channels, bits, {}};
      image.bytes.resize(static_cast<size_t>(7 * 5 * channels * bits / 8));
      for (size_t i = 0; i < image.bytes.size(); ++i)
        image.bytes[i] = static_cast<uint8_t>(i * 37 + 11);
      const std::string png = encodePng(image);
      EXPECT_EQ(png, encodePng(image));
      const TempFile file(png);
      const Image back = readImage(file.path());
      EXPECT_EQ(back.width, 7);
      EXPECT_EQ(back.height, 5);
      EXPECT_EQ(back.channels, channels);
      EXPECT_EQ(back.bits, bits);
      EXPECT_EQ(back.bytes, image.bytes);
    }
  }
}

TEST(Images, RefuseWhatIsNone) {
  EXPECT_THROW((void)readImage("/nonexistent/x.png"), InputError);
  for (const char* content : {"", "no image", "\x89PNG\r\n\x1a\n"}) {
    const TempFile file(content);
    try {
      (void)readImage(file.path());
      ADD_FAILURE();
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(file.path()), std::string::npos);
    }
  }
}

/// Whether readImage takes the bytes; a refusal must name the file in one line.
bool reads(const std::string& content) {
  const TempFile file(content);
  try {
    (void)readImage(file.path());
    return true;
  } catch (const InputError& e) {
    const std::string message = e.what();
    EXPECT_NE(message.find(file.path()), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return false;
  }
}

TEST(Images, RefusePngThatIsNotWhole) {
  Image image{40, 30, 3, 8, std::vector<uint8_t>(40 * 30 * 3)};
  for (size_t i = 0; i < image.bytes.size(); ++i) image.bytes[i] = static_cast<uint8_t>(i * i);
  const std::string png = encodePng(image);
  EXPECT_TRUE(reads(png));
  EXPECT_TRUE(reads(png + "something after it"));
  testing::internal::CaptureStderr();
  for (size_t size = 0; size < png.size(); size += 7) EXPECT_FALSE(reads(png.substr(0, size)));
  for (size_t at = 0; at < png.size(); at += 11) {
    std::string damaged = png;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    EXPECT_FALSE(reads(damaged)) << at;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Images, RefuseTruncatedJpeg) {
  cv::Mat picture(60, 80, CV_8UC1);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      picture.at<uint8_t>(y, x) = static_cast<uint8_t>(x * 3 + (x * x * 7 + y * y * 13) % 50);
    }
  }
  for (const int progressive : {0, 1}) {
    std::vector<uint8_t> encoded;
    ASSERT_TRUE(cv::imencode(".jpg",
                             picture,
                             encoded,
                             {cv::IMWRITE_JPEG_PROGRESSIVE,
                              progressive,
                              cv::IMWRITE_JPEG_RST_INTERVAL,
                              progressive == 0 ? 2 : 0}));
    const std::string jpeg(encoded.begin(), encoded.end());
    EXPECT_TRUE(reads(jpeg));
    EXPECT_TRUE(reads(jpeg + std::string(5000, 'x')));
    testing::internal::CaptureStderr();
    for (size_t size = 0; size < jpeg.size(); size += 13) {
      EXPECT_FALSE(reads(jpeg.substr(0, size))) << size;
    }
    EXPECT_FALSE(reads(jpeg.substr(0, jpeg.size() - 1)));
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  }
}

// A folder that somebody else made: a record must be of the image that the manifest names, and of
// its camera's size.
TEST(DatasetFolder, RefusesRecordsThatDoNotFit) {
  namespace fs = std::filesystem;
  const std::string folder = testing::TempDir() + "dlsd_dataset_test_folder";
  fs::remove_all(folder);
  for (const char* name : {"images", "labels", "cameras"})
    fs::create_directories(folder + "/" + name);
  const std::array<double, 4> params{300, 300, 319.5, 239.5};
  const Camera camera = makeCamera("pinhole", params, 640, 480);
  LabelRecord record = sampleRecord();
  writeFileAtomically(folder + "/" + record.camera, kalibrYaml({{"cam0", camera}}));
  writeFileAtomically(folder + "/" + record.image, "never read");
  writeFileAtomically(folder + "/manifest.json",
                      json{{"format", kDatasetFormat},
                           {"cameras", {{{"file", record.camera}}}},
                           {"frames", {{{"image", record.image}, {"labels", "labels/7.json"}}}}}
                          .dump());
  const auto says = [&](const LabelRecord& r) -> std::string {
    writeFileAtomically(folder + "/labels/7.json", toJson(r).dump());
    const Dataset data(folder);
    try {
      (void)data.labels(0);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(says(record), "accepted");
  LabelRecord other = record;
  other.image = "../../etc/passwd";
  EXPECT_NE(says(other).find("7.json: image = \"../../etc/passwd\" must be"), std::string::npos);
  other = record;
  other.height = 481;
  EXPECT_NE(says(other).find("640x481 must be those of the camera, 640x480"), std::string::npos);
  fs::remove_all(folder);
}

TEST(Sha256, IsTheStandardOne) {
  EXPECT_EQ(sha256Hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

LabelLine straight(int id, Eigen::Vector2d a, Eigen::Vector2d b) {
  LabelLine line;
  line.id = id;
  line.points = {a, b};
  line.length_px = (b - a).norm();
  line.ends = {EndKind::kVertex, EndKind::kOccluder};
  line.contrast = 10 * (id + 1);
  return line;
}

TEST(Statistics, CountNeighboursAndEnds) {
  LabelRecord record;
  // Two parallel lines 8 px apart, one 8 px from their ends only, one far away.
  record.lines = {straight(0, {0, 0}, {100, 0}),
                  straight(1, {0, 8}, {100, 8}),
                  straight(2, {106, 0}, {200, 0}),
                  straight(3, {0, 50}, {100, 50})};
  const LabelStatistics s = labelStatistics({record, LabelRecord{}});
  EXPECT_EQ(s.frames, 2U);
  EXPECT_EQ(s.lines, 4U);
  EXPECT_EQ(s.crowded_lines, 2U);
  EXPECT_EQ(s.touching_lines, 3U);
  EXPECT_EQ(s.median_lines_per_frame, 2);
  EXPECT_EQ(s.max_lines_per_frame, 4U);
  EXPECT_DOUBLE_EQ(s.cutEndShare(), 0.5);
  EXPECT_DOUBLE_EQ(s.median_contrast, 25);
  const LabelStatistics none = labelStatistics({});
  EXPECT_EQ(none.lines, 0U);
  EXPECT_EQ(none.cutEndShare(), 0);
}

}  // namespace
}  // namespace dlsd
