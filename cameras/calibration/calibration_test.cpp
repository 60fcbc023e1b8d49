#include "cameras/calibration/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <numbers>

#include "cameras/calibration/files.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class Calibration : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "dlsd-calibration-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_ / name).string();
  }
  [[nodiscard]] std::string write(const std::string& content, const std::string& name = "c.yaml") {
    writeFileAtomically(path(name), content);
    return path(name);
  }
  /// Message of the InputError that loading this text gives. It must name the file.
  [[nodiscard]] std::string refusal(const std::string& content) {
    const std::string file = write(content);
    try {
      (void)loadCameras(file);
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), StartsWith(file + ": "));
      EXPECT_THAT(e.what(), Not(HasSubstr("\n")));
      return std::string(e.what()).substr(file.size() + 2);
    }
    ADD_FAILURE() << "accepted:\n" << content;
    return "";
  }

  fs::path folder_;
};

/// A camchain entry in which one line is replaced: `key` by `line` (dropped when empty).
std::string entryWith(const std::string& key = "", const std::string& line = "") {
  std::string text = "cam0:\n";
  for (const auto& [k, v] : std::initializer_list<std::pair<std::string, std::string>>{
           {"camera_model", "pinhole"},
           {"intrinsics", "[190.5, 191.5, 254.25, 256.75]"},
           {"distortion_model", "equidistant"},
           {"distortion_coeffs", "[0.003, 0.0007, -0.002, 0.0002]"},
           {"resolution", "[512, 480]"}}) {
    if (k != key) text += "  " + k + ": " + v + "\n";
  }
  if (!line.empty()) text += "  " + line + "\n";
  return text;
}

TEST_F(Calibration, ReadsEachModelOfKalibr) {
  const auto cameras = loadCameras(write(R"(
cam0:
  camera_model: pinhole
  intrinsics: [400.5, 401.5, 320, 240.0]
  distortion_model: none
  distortion_coeffs: []
  resolution: [640, 480]
cam1:
  camera_model: pinhole
  intrinsics: [400.5, 401.5, 320.25, 240.75]
  distortion_model: fov
  distortion_coeffs: [0.93]
  resolution: [640, 480]
cam2:
  camera_model: pinhole
  intrinsics: [190.5, 191.5, 254.25, 256.75]
  distortion_model: equidistant
  distortion_coeffs: [0.003, 7.0e-4, -.002, +0.0002]
  resolution: [512, 511]
cam3:
  camera_model: omni
  intrinsics: [1.8, 900.0, 901.0, 640.0, 512.0]
  distortion_model: none
  distortion_coeffs: []
  resolution: [1280, 1024]
  max_field_angle: 1.9
)"));
  ASSERT_EQ(cameras.size(), 4U);
  const std::array<Camera, 4> expected{
      Camera(Pinhole{400.5, 401.5, 320, 240}, 640, 480),
      Camera(Fov::fromParams({400.5, 401.5, 320.25, 240.75, 0.93}), 640, 480),
      Camera(KannalaBrandt::fromParams({190.5, 191.5, 254.25, 256.75, .003, 7e-4, -.002, .0002}),
             512,
             511),
      Camera(UnifiedOmni{1.8, 900, 901, 640, 512}, 1280, 1024, 1.9)};
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(cameras[i].name, "cam" + std::to_string(i));
    EXPECT_EQ(cameras[i].camera, expected[i]) << i;
  }
}

TEST_F(Calibration, KeysOfKalibrThatSayNothingAboutIntrinsicsAreIgnored) {
  const std::string extra = R"(  rostopic: /cam0/image_raw
  cam_overlaps: [1]
  timeshift_cam_imu: 0.0001
  line_delay: 1.0e-05
  T_imu_cam:
    - [1.0, 0.0, 0.0, 0.0]
    - [0.0, 1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0, 0.0]
    - [0.0, 0.0, 0.0, 1.0]
  T_cam_imu:
    - [1.0, 0.0, 0.0, 0.0]
    - [0.0, 1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0, 0.0]
    - [0.0, 0.0, 0.0, 1.0]
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, 0.0]
)";
  EXPECT_EQ(loadCamera(write(entryWith() + extra)), loadCamera(write(entryWith(), "plain.yaml")));
}

TEST_F(Calibration, WrittenTextIsWhatKalibrReads) {
  // Its YAML reader takes 500 for an integer and 1e-05 for a string, and then refuses.
  const std::string text = kalibrYaml(
      {{"cam0", Camera(KannalaBrandt::fromParams({500, 500.5, 1e6, 3, 1e-5, -2.5e-7, 0, 0}), 8, 6)},
       {"cam1", Camera(UnifiedOmni{2, 500, 500, 3, 3}, 8, 6, 1.5)}});
  EXPECT_EQ(text, R"(cam0:
  camera_model: pinhole
  intrinsics: [500.0, 500.5, 1.0e+06, 3.0]
  distortion_model: equidistant
  distortion_coeffs: [1.0e-05, -2.5e-07, 0.0, 0.0]
  resolution: [8, 6]
cam1:
  camera_model: omni
  intrinsics: [2.0, 500.0, 500.0, 3.0, 3.0]
  distortion_model: none
  distortion_coeffs: []
  max_field_angle: 1.5  # rad from the optical axis; an extension of dlsd, unknown to Kalibr
  resolution: [8, 6]
)");
}

TEST_F(Calibration, SavedCamerasCompareEqual) {
  const std::vector<NamedCamera> cameras{
      {"cam0", Camera(Pinhole{1.0 / 3, 2e6 / 7, -1e-300, std::nextafter(1e6, 0)}, 1, 65535)},
      {"cam7", Camera(UnifiedOmni{std::numbers::e, 1e-3, 1e7, 0.1, 0.2}, 65535, 1, 1e-9)}};
  saveCameras(path("out.yaml"), cameras);
  const auto read = loadCameras(path("out.yaml"));
  ASSERT_EQ(read.size(), 2U);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read[i].name, cameras[i].name);
    EXPECT_EQ(read[i].camera, cameras[i].camera);
  }
}

TEST_F(Calibration, CamerasThatACamchainCannotNameAreRefused) {
  const Camera camera(Pinhole{1, 1, 0, 0}, 4, 4);
  EXPECT_THROW((void)kalibrYaml({}), std::invalid_argument);
  EXPECT_THROW((void)kalibrYaml({{"left", camera}}), std::invalid_argument);
  EXPECT_THROW((void)kalibrYaml({{"cam0", camera}, {"cam0", camera}}), std::invalid_argument);
}

TEST_F(Calibration, AnUnwritablePathIsNamed) {
  const Camera camera(Pinhole{1, 1, 0, 0}, 4, 4);
  try {
    saveCameras(path("no/such.yaml"), {{"cam0", camera}});
    FAIL() << "nothing was thrown";
  } catch (const SystemError& e) {
    EXPECT_THAT(e.what(), StartsWith(path("no/such.yaml")));
  }
}

TEST_F(Calibration, AFileCutOffAnywhereIsRefused) {
  for (const Camera& camera :
       {Camera(Pinhole{1.25, 1, 0, 0}, 640, 480),
        Camera(UnifiedOmni{2, 1, 1, 0, 0}, 640, 480, 1.25),
        Camera(KannalaBrandt::fromParams({1, 1, 0, 0, .5, .25, .125, .01}), 640, 480)}) {
    const std::string text = kalibrYaml({{"cam0", camera}});
    ASSERT_EQ(text.substr(text.size() - 2), "]\n");
    for (size_t n = 0; n + 1 < text.size(); ++n) {
      EXPECT_FALSE(refusal(text.substr(0, n)).empty()) << n;
    }
  }
}

TEST_F(Calibration, FilesThatAreNoCamchainAreRefused) {
  EXPECT_THAT(refusal(""), HasSubstr("is empty"));
  EXPECT_THAT(refusal("\n# nothing\n"), HasSubstr("is empty"));
  EXPECT_THAT(refusal("{}"), HasSubstr("not a calibration file of a known format"));
  EXPECT_THAT(refusal("just words"), HasSubstr("not a calibration file of a known format"));
  EXPECT_THAT(refusal("- cam0\n- cam1\n"), HasSubstr("not a calibration file of a known format"));
  EXPECT_THAT(refusal("fx: 3\n"), AllOf(HasSubstr("\"fx\""), HasSubstr("known are kalibr")));
  EXPECT_THAT(refusal("cam01:\n  a: 1\n"), HasSubstr("\"cam01\""));
  EXPECT_THAT(refusal("[a, b]: 1\n"), HasSubstr("plain word"));
  EXPECT_THAT(refusal("cam0: 5\n"), HasSubstr("cam0 must be a map"));
  EXPECT_THAT(refusal("cam0: [1, 2]\n"), HasSubstr("cam0 must be a map"));
  EXPECT_THAT(refusal("cam0:\n"), HasSubstr("cam0 must be a map"));
  EXPECT_THAT(refusal("cam0:\n  [1]: 2\n"), HasSubstr("line 2, column 3: a list, a map"));
  EXPECT_THAT(refusal(entryWith() + "---\n" + entryWith()),
              HasSubstr("more than one YAML document"));
  EXPECT_THAT(refusal("cam0: {camera_model: pinhole"), HasSubstr("line 1, column"));
  EXPECT_THAT(refusal("cam0:\n\t- x: [}"), HasSubstr("YAML"));
  // JSON that ends too early, as yaml-cpp sees it.
  EXPECT_THAT(refusal("{\"value0\":\n {\"intrinsics\": [{\"camera_type\": \"ucm\""),
              AllOf(HasSubstr("line "), HasSubstr("column ")));
  EXPECT_FALSE(refusal(std::string(100'000, '[')).empty());
  EXPECT_THAT(refusal("cam0: " + std::string(40, '[') + std::string(40, ']')),
              HasSubstr("deeper than 32 levels"));
  std::string rubbish;
  for (unsigned i = 0, x = 1; i < 4096; ++i) {
    x = x * 1664525U + 1013904223U;
    rubbish += static_cast<char>(x >> 24U);
  }
  for (size_t n = 1; n <= rubbish.size(); n += 13)
    EXPECT_FALSE(refusal(rubbish.substr(0, n)).empty());
  EXPECT_FALSE(refusal(std::string(64, '\0')).empty());
}

TEST_F(Calibration, AbsentFileAndFolderAreNamed) {
  for (const std::string& p : {path("absent.yaml"), folder_.string(), path("absent.yaml:cam0")}) {
    try {
      (void)loadCamera(p);
      FAIL() << "accepted " << p;
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), StartsWith(p + ": "));
    }
  }
}

TEST_F(Calibration, KeysMustBeKnownPresentAndSingle) {
  for (const std::string key :
       {"camera_model", "intrinsics", "distortion_model", "distortion_coeffs", "resolution"}) {
    EXPECT_THAT(refusal(entryWith(key)), HasSubstr("cam0." + key + " is missing"));
    EXPECT_THAT(refusal(entryWith() + "  " + key + ": 1\n"),
                HasSubstr("cam0." + key + " is given twice"));
  }
  EXPECT_THAT(refusal(entryWith() + "  rostopic: a\n  rostopic: b\n"), HasSubstr("given twice"));
  EXPECT_THAT(refusal(entryWith() + entryWith()), HasSubstr("cam0 is given twice"));
  EXPECT_THAT(refusal(entryWith() + "  focal: 3\n"),
              AllOf(HasSubstr("unknown key \"focal\""), HasSubstr("max_field_angle")));
  EXPECT_THAT(refusal(entryWith() + "  <<: {a: 1}\n"), HasSubstr("unknown key"));
}

TEST_F(Calibration, ModelsThatWeDoNotHaveAreNamedWithThoseWeHave) {
  for (const auto& [camera_model, distortion_model] :
       std::initializer_list<std::pair<std::string, std::string>>{{"pinhole", "radtan8"},
                                                                  {"omni", "equidistant"},
                                                                  {"eucm", "radtan"},
                                                                  {"ds", "fov"},
                                                                  {"Pinhole", "none"},
                                                                  {"", ""}}) {
    EXPECT_THAT(refusal("cam0:\n  camera_model: '" + camera_model + "'\n  distortion_model: '" +
                        distortion_model +
                        "'\n  intrinsics: []\n  distortion_coeffs: []\n  resolution: []\n"),
                AllOf(HasSubstr("\"" + camera_model + "\" with"),
                      HasSubstr("\"" + distortion_model + "\" is not supported"),
                      HasSubstr("pinhole with none, pinhole with fov, pinhole with equidistant, "
                                "pinhole with radtan, omni with none")));
  }
  EXPECT_THAT(refusal(entryWith("camera_model", "camera_model: [pinhole]")), HasSubstr("one word"));
  EXPECT_THAT(refusal(entryWith("distortion_model", "distortion_model:")), HasSubstr("one word"));
}

TEST_F(Calibration, NumbersNameKeyValueAndRange) {
  const auto intrinsics = [&](const std::string& fx) {
    return refusal(entryWith("intrinsics", "intrinsics: [" + fx + ", 191.5, 254.25, 256.75]"));
  };
  EXPECT_THAT(intrinsics("-190.5"),
              AllOf(HasSubstr("cam0.intrinsics[0] (fx) = -190.5"), HasSubstr("[0.001, 1e+07] px")));
  for (const std::string text :
       {".nan", ".inf", "-.inf",   "nan",       "inf",  "infinity", "1e400", "1e-400",
        "abc",  "1.5x", "0x10",    "1_000",     "1,5",  "++1",      "+-1",   "~",
        "null", "\"\"", "'190.5'", "\"190.5\"", "true", "[1]",      "{a: 1}"}) {
    if (text == "1,5") continue;  // Five numbers: counted below.
    EXPECT_THAT(intrinsics(text),
                AllOf(HasSubstr("intrinsics[0] (fx)"), HasSubstr("[0.001, 1e+07]")))
        << text;
  }
  EXPECT_THAT(intrinsics("1,5"), HasSubstr("4 numbers [fx, fy, cx, cy], got 5"));
  EXPECT_THAT(refusal(entryWith("intrinsics", "intrinsics: [1, 2, 3]")), HasSubstr("got 3"));
  EXPECT_THAT(refusal(entryWith("intrinsics", "intrinsics: 190.5")), HasSubstr("a list of 4"));
  EXPECT_THAT(refusal(entryWith("intrinsics", "intrinsics: {fx: 1}")), HasSubstr("a list of 4"));
  EXPECT_THAT(
      refusal(entryWith("distortion_coeffs", "distortion_coeffs: [0.1]")),
      HasSubstr("cam0.distortion_coeffs must be a list of 4 numbers [k1, k2, k3, k4], got 1"));
  EXPECT_THAT(refusal(entryWith("distortion_coeffs", "distortion_coeffs: [0, 0, 101, 0]")),
              AllOf(HasSubstr("distortion_coeffs[2] (k3) = 101"), HasSubstr("[-100, 100] 1")));
}

TEST_F(Calibration, ResolutionIsTwoPositiveWholeNumbers) {
  for (const std::string text : {"-512",
                                 "0",
                                 "512.5",
                                 "512.0",
                                 "5e2",
                                 "65536",
                                 "99999999999999999999",
                                 "\"512\"",
                                 "wide",
                                 ".nan",
                                 "[512]"}) {
    EXPECT_THAT(refusal(entryWith("resolution", "resolution: [" + text + ", 480]")),
                AllOf(HasSubstr("resolution[0] (width)"), HasSubstr("[1, 65535]")))
        << text;
    EXPECT_THAT(refusal(entryWith("resolution", "resolution: [512, " + text + "]")),
                HasSubstr("resolution[1] (height)"))
        << text;
  }
  for (const std::string text : {"[512]", "[1, 2, 3]", "512", "512x480", "{w: 1, h: 2}", "[]"}) {
    EXPECT_THAT(refusal(entryWith("resolution", "resolution: " + text)),
                HasSubstr("a list of 2 whole numbers"))
        << text;
  }
}

TEST_F(Calibration, MaxFieldAngleIsInRange) {
  for (const std::string text : {"0", "-1", "3.1416", "90 deg", ".nan", "[1]"}) {
    EXPECT_THAT(refusal(entryWith("max_field_angle", "max_field_angle: " + text)),
                AllOf(HasSubstr("cam0.max_field_angle"), HasSubstr("(0, 3.14159")))
        << text;
  }
  const auto limit = [&](const std::string& text) {
    return loadCamera(write(entryWith("max_field_angle", "max_field_angle: " + text)))
        .maxFieldAngleLimit();
  };
  EXPECT_EQ(limit("1.25"), 1.25);
  EXPECT_EQ(limit("3.141592653589793"), M_PI);
}

TEST_F(Calibration, OneCameraIsChosenByName) {
  const Camera first(Pinhole{1, 1, 0, 0}, 4, 4), second(Pinhole{2, 2, 0, 0}, 4, 4);
  saveCameras(path("two.yaml"), {{"cam0", first}, {"cam1", second}});
  saveCameras(path("one.yaml"), {{"cam3", first}});
  EXPECT_EQ(loadCamera(path("two.yaml:cam0")), first);
  EXPECT_EQ(loadCamera(path("two.yaml:cam1")), second);
  EXPECT_EQ(loadCamera(path("one.yaml")), first);
  EXPECT_EQ(loadCamera(path("one.yaml:cam3")), first);
  const auto message = [](const std::string& p) -> std::string {
    try {
      (void)loadCamera(p);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message(path("two.yaml")), HasSubstr("holds 2 cameras, choose one of cam0, cam1"));
  EXPECT_THAT(message(path("two.yaml:cam2")),
              HasSubstr("holds no camera \"cam2\", allowed are cam0, cam1"));
  EXPECT_THAT(message(path("two.yaml:")), HasSubstr("holds no camera \"\""));
}

TEST_F(Calibration, ColonsMayBePartOfThePath) {
  const Camera first(Pinhole{1, 1, 0, 0}, 4, 4), second(Pinhole{2, 2, 0, 0}, 4, 4);
  makeFolders(path("a:b"));
  saveCameras(path("a:b/c:d.yaml"), {{"cam0", first}, {"cam1", second}});
  EXPECT_EQ(loadCamera(path("a:b/c:d.yaml:cam1")), second);
  // A file whose whole name looks like a choice is the file.
  saveCameras(path("a:b/c:d.yaml:cam1"), {{"cam0", first}});
  EXPECT_EQ(loadCamera(path("a:b/c:d.yaml:cam1")), first);
  saveCameras(path("x"), {{"cam0", first}});
  EXPECT_THROW((void)loadCamera(path("x:y/absent.yaml")), InputError);
}

TEST(CalibrationFixtures, AreCompleteAndLookAsFarAsTheyShould) {
  const std::string folder = std::string(DLSD_SOURCE_DIR) + "/fixtures/calibrations/";
  struct {
    std::string file, model;
    int width, height;
    double corner_deg;  // Field angle of the top-left corner; 0 where it has no ray.
  } const expected[] = {{"tum_mono_wide", "fov", 1280, 1024, 97.3},
                        {"tum_vi_cam0", "kannala_brandt", 512, 512, 115.2},
                        {"fisheye_180", "kannala_brandt", 1280, 1024, 0},
                        {"catadioptric", "omni", 1280, 1024, 0},
                        {"pinhole_90", "pinhole", 1280, 1024, 52.0}};
  size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    files += static_cast<size_t>(entry.path().extension() == ".yaml");
  }
  EXPECT_EQ(files, std::size(expected));
  for (const auto& e : expected) {
    const Camera camera = loadCamera(folder + e.file + ".yaml");
    EXPECT_EQ(camera.modelName(), e.model);
    EXPECT_EQ(camera.width(), e.width);
    EXPECT_EQ(camera.height(), e.height);
    const auto corner = camera.unproject({-0.5, -0.5});
    EXPECT_EQ(corner.has_value(), e.corner_deg > 0) << e.file;
    if (corner) {
      EXPECT_NEAR(std::acos(corner->z()) * 180 / M_PI, e.corner_deg, 0.05) << e.file;
    }
    // The image circle of the two that have one is complete in the image.
    if (camera.maxFieldAngleLimit() < M_PI) {
      const double limit = camera.maxFieldAngleLimit() * (1 - 1e-12);
      for (int i = 0; i < 360; ++i) {
        const double azimuth = i * M_PI / 180;
        const auto pixel = camera.project({std::sin(limit) * std::cos(azimuth),
                                           std::sin(limit) * std::sin(azimuth),
                                           std::cos(limit)});
        ASSERT_TRUE(pixel && camera.inImage(*pixel)) << e.file << " " << i;
      }
    }
  }
}

}  // namespace
}  // namespace dlsd
