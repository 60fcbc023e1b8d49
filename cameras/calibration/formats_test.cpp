// The formats of other programs, by example: fixtures/calibrations/formats holds one camera in
// several formats, as NAME.FORMAT.EXT. (Random cameras in all formats: properties/.)
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"

namespace dlsd {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// Message of the refusal; it must name the source and be one line.
std::string refusal(const std::string& text, std::string_view format = "") {
  try {
    (void)parseCalibration(text, "f", format);
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), StartsWith("f: "));
    EXPECT_THAT(e.what(), Not(HasSubstr("\n")));
    return std::string(e.what()).substr(3);
  }
  ADD_FAILURE() << "accepted:\n" << text;
  return "";
}

/// The one camera of a text.
Camera only(const std::string& text, std::string_view format = "") {
  const LoadedCalibration loaded = parseCalibration(text, "f", format);
  EXPECT_EQ(loaded.cameras.size(), 1U);
  return loaded.cameras.at(0).camera;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

struct Fixture {
  std::string path, name, format, text;
};

std::vector<Fixture> fixtures() {
  std::vector<Fixture> all;
  for (const auto& entry :
       fs::directory_iterator(DLSD_SOURCE_DIR "/fixtures/calibrations/formats")) {
    const std::string file = entry.path().filename().string();
    const size_t first = file.find('.');
    const size_t second = file.find('.', first + 1);
    all.push_back({entry.path().string(),
                   file.substr(0, first),
                   file.substr(first + 1, second - first - 1),
                   readFile(entry.path().string())});
  }
  std::sort(
      all.begin(), all.end(), [](const Fixture& a, const Fixture& b) { return a.path < b.path; });
  return all;
}

std::string fixture(const std::string& file) {
  return readFile(DLSD_SOURCE_DIR "/fixtures/calibrations/formats/" + file);
}

// The same camera from each format: the proof that conventions are read as they are meant.
TEST(FormatFixtures, HoldOneCameraInSeveralFormats) {
  const std::vector<Fixture> all = fixtures();
  EXPECT_EQ(all.size(), 50U);
  std::map<std::string, int> of_name, of_format, of_model;
  for (const Fixture& f : all) {
    const LoadedCalibration loaded = loadCalibration(f.path);
    EXPECT_EQ(loaded.format, f.format) << f.path;
    ASSERT_EQ(loaded.cameras.size(), 1U) << f.path;
    const Camera& camera = loaded.cameras[0].camera;
    const Camera reference =
        loadCamera(DLSD_SOURCE_DIR "/fixtures/calibrations/formats/" + f.name + ".kalibr.yaml");
    ++of_name[f.name];
    ++of_format[f.format];
    of_model[std::string(camera.modelName())] = 1;

    EXPECT_EQ(camera.modelName(), reference.modelName()) << f.path;
    EXPECT_EQ(camera.width(), reference.width()) << f.path;
    EXPECT_EQ(camera.height(), reference.height()) << f.path;
    EXPECT_EQ(camera.maxFieldAngleLimit(), reference.maxFieldAngleLimit()) << f.path;
    const std::vector<double> got = camera.params(), expected = reference.params();
    ASSERT_EQ(got.size(), expected.size()) << f.path;
    // Exact, except where the file has the numbers relative to the image size or in Basalt's ucm.
    const bool rounded = f.format == "tum" || (f.name == "unified" && f.format == "basalt");
    for (size_t i = 0; i < got.size(); ++i) {
      EXPECT_LE(std::abs(got[i] - expected[i]), rounded ? 1e-12 * std::abs(expected[i]) : 0)
          << f.path << " " << camera.paramSpecs()[i].name;
    }
    // The shift is said where it was done.
    const bool relative =
        f.path.ends_with("tum_mono.tum.txt") || f.path.ends_with("pinhole.tum.txt");
    EXPECT_EQ(loaded.pixel_convention.find("0.5 was subtracted") != std::string::npos,
              f.format == "colmap" || relative)
        << f.path;
  }
  for (const auto& [name, count] : of_name) EXPECT_GE(count, 2) << name;
  for (const CalibrationFormat& format : calibrationFormats()) {
    if (!format.recognised) continue;
    EXPECT_GE(of_format[std::string(format.name)], 1) << format.name;
  }
  EXPECT_EQ(of_model.size(), std::variant_size_v<CameraModelVariant>);
}

// Without any one of its lines, a file is refused or says the same: nothing is replaced by a
// default. Twice the same line is refused or, in a list of comments, the same.
TEST(FormatFixtures, NeedEachOfTheirLines) {
  size_t refused = 0;
  for (const Fixture& f : fixtures()) {
    const std::vector<NamedCamera> reference = parseCalibration(f.text, "f").cameras;
    for (size_t begin = 0; begin < f.text.size();) {
      const size_t end = std::min(f.text.find('\n', begin), f.text.size() - 1) + 1;
      const std::string line = f.text.substr(begin, end - begin);
      const std::string without = f.text.substr(0, begin) + f.text.substr(end);
      const std::string twice = f.text.substr(0, begin) + line + f.text.substr(begin);
      begin = end;
      // The one coefficient that a format lets away: ORB-SLAM3 takes it for 0.
      if (line.find("Camera1.k3") != std::string::npos && f.name == "webcam") continue;
      for (const std::string& text : {without, twice}) {
        try {
          const std::vector<NamedCamera> cameras = parseCalibration(text, "f").cameras;
          ASSERT_EQ(cameras.size(), reference.size()) << f.path << "\n" << text;
          EXPECT_EQ(cameras[0].camera, reference[0].camera) << f.path << "\n" << text;
        } catch (const InputError& e) {
          EXPECT_THAT(e.what(), AllOf(StartsWith("f: "), Not(HasSubstr("\n"))));
          ++refused;
        }
      }
    }
  }
  EXPECT_GE(refused, 600U);
}

// Each number in turn becomes something that is none, or far out of range: refused, or it was one
// that says nothing about the lens.
TEST(FormatFixtures, RefuseWhatIsNoNumberWhereTheyNeedOne) {
  const std::regex number(R"([-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)");
  size_t refused = 0;
  size_t same = 0;
  for (const Fixture& f : fixtures()) {
    const std::vector<NamedCamera> reference = parseCalibration(f.text, "f").cameras;
    for (std::sregex_iterator it(f.text.begin(), f.text.end(), number), end; it != end; ++it) {
      for (const std::string bad : {"nan", ".inf", "1e999", "1e8", "x", "-", "''"}) {
        std::string text = f.text;
        text.replace(static_cast<size_t>(it->position()), it->str().size(), bad);
        try {
          const std::vector<NamedCamera> cameras = parseCalibration(text, "f").cameras;
          ASSERT_EQ(cameras.size(), reference.size()) << f.path << "\n" << text;
          EXPECT_EQ(cameras[0].camera, reference[0].camera) << f.path << "\n" << text;
          ++same;
        } catch (const InputError& e) {
          EXPECT_THAT(e.what(), AllOf(StartsWith("f: "), Not(HasSubstr("\n"))));
          ++refused;
        }
      }
    }
  }
  EXPECT_GE(refused, 2500U) << same;
}

TEST(FormatFixtures, ReadTheSameWithWindowsLineEndsAndByteOrderMark) {
  for (const Fixture& f : fixtures()) {
    std::string windows = "\xef\xbb\xbf";
    for (const char c : f.text) windows += c == '\n' ? "\r\n" : std::string(1, c);
    EXPECT_EQ(only(windows), only(f.text)) << f.path;
  }
}

TEST(FormatFixtures, AreReadInTheirFormatAloneWhenItIsAskedFor) {
  for (const Fixture& f : fixtures()) {
    for (const CalibrationFormat& format : calibrationFormats()) {
      if (format.name == f.format) {
        EXPECT_EQ(only(f.text, format.name), only(f.text)) << f.path;
      } else if (!format.name.starts_with("opencv") || f.format != "opencv") {
        EXPECT_FALSE(refusal(f.text, format.name).empty()) << f.path << " as " << format.name;
      }
    }
  }
}

TEST(Formats, ThatAreUnknownAreRefusedWithTheKnownOnes) {
  EXPECT_THAT(refusal("a: 1\n", "exif"),
              AllOf(HasSubstr("\"exif\""), HasSubstr("kalibr, opencv, opencv-fisheye")));
  EXPECT_THAT(refusal("a: 1\n"), AllOf(HasSubstr("first key is \"a\""), HasSubstr("woodscape")));
}

TEST(Formats, ThatMayBeEitherAreRefusedWithBothNames) {
  EXPECT_THAT(refusal(fixture("tum_vi.kalibr.yaml") + "model_type: PINHOLE\n"),
              HasSubstr("may be kalibr or camodocal: please choose the format"));
  EXPECT_THAT(refusal("4 1 2 3 4\n640 480\n"), HasSubstr("may be tum or ocamcalib"));
  // Words that only begin as a camera's name are none.
  const std::string vins = fixture("tum_vi.camodocal.yaml");
  EXPECT_EQ(only(vins + "cam0_calib: \"cam0.yaml\"\ncam1_calib: \"cam1.yaml\"\n"), only(vins));
}

TEST(Formats, CutOffNumbersAreNotedByTheMissingLineEnd) {
  for (const std::string file : {"tum_vi.colmap.txt",
                                 "tum_vi.camodocal.yaml",
                                 "tum_vi.orbslam3.yaml",
                                 "euroc.tum.txt",
                                 "pal.ocamcalib.txt",
                                 "mirror.camodocal.yaml"}) {
    std::string text = fixture(file);
    text.erase(text.find_last_not_of("\n") + 1);
    EXPECT_THAT(refusal(text), HasSubstr("ends without a line break")) << file;
  }
}

TEST(Formats, WhatCannotBeCutOffNeedsNoLineEnd) {
  const std::string orb = fixture("tum_vi.orbslam3.yaml");
  const std::string line = "Camera.type: \"KannalaBrandt8\"\n";
  const std::string rest = replaced(orb, line, "");
  EXPECT_EQ(only(rest + "Camera.type: KannalaBrandt8"), only(orb));
  EXPECT_EQ(only(orb + "Camera.nFeatures: 1  # grey, 1 of 3"), only(orb));
  EXPECT_EQ(only(orb + "Camera.nFeatures: 1 "), only(orb));
  EXPECT_EQ(only(orb + "# 2021"), only(orb));
  EXPECT_THAT(refusal(orb + "Camera.nFeatures: 1"), HasSubstr("ends without a line break"));
  const std::string colmap = fixture("tum_vi.colmap.txt");
  EXPECT_EQ(only(colmap + "# 1 camera"), only(colmap));
  const std::string vins = fixture("tum_vi.camodocal.yaml");
  EXPECT_EQ(only(vins + "imu_topic: /imu0"), only(vins));
}

// Every prefix of everything that we write is refused.
TEST(Formats, FilesCutOffAnywhereAreRefused) {
  size_t texts = 0;
  for (const Fixture& f : fixtures()) {
    if (f.format != "kalibr") continue;
    for (const CalibrationFormat& format : calibrationFormats()) {
      if (!format.written) continue;
      std::string text;
      try {
        text = calibrationText(parseCalibration(f.text, "f").cameras, format.name);
      } catch (const std::invalid_argument&) {
        continue;
      }
      ++texts;
      const size_t end = text.find_last_not_of("\n");
      const bool closed = std::string("]}").find(text[end]) != std::string::npos;
      for (size_t n = 0; n < (closed ? end : text.size()); ++n) {
        EXPECT_FALSE(refusal(text.substr(0, n)).empty()) << format.name << " " << n;
      }
    }
  }
  EXPECT_GE(texts, 13U + 20U);
}

TEST(Formats, AreWrittenForTheModelsThatTheyKnow) {
  const std::map<std::string, std::set<std::string>> expected{
      {"kalibr",
       {"pinhole",
        "fov",
        "kannala_brandt",
        "omni",
        "pinhole_radtan",
        "omni_radtan",
        "eucm",
        "double_sphere",
        "ocam",
        "theta_polynomial",
        "equirectangular"}},
      {"opencv", {"pinhole", "pinhole_radtan", "kannala_brandt", "omni", "omni_radtan"}},
      {"opencv-fisheye", {"kannala_brandt"}},
      {"opencv-omnidir", {"omni", "omni_radtan"}},
      {"opencv-pinhole", {"pinhole", "pinhole_radtan"}},
      {"colmap", {"pinhole", "fov", "kannala_brandt", "pinhole_radtan", "eucm", "equirectangular"}},
      {"basalt", {"pinhole", "fov", "kannala_brandt", "omni", "eucm", "double_sphere"}},
      {"ros", {"pinhole", "pinhole_radtan", "kannala_brandt"}}};
  std::map<std::string, std::set<std::string>> got;
  for (const Fixture& f : fixtures()) {
    if (f.format != "kalibr") continue;
    const std::vector<NamedCamera> cameras = parseCalibration(f.text, "f").cameras;
    const std::string model(cameras[0].camera.modelName());
    for (const CalibrationFormat& format : calibrationFormats()) {
      try {
        const std::string text = calibrationText(cameras, format.name);
        got[std::string(format.name)].insert(model);
        // Recognised as itself, except that the forms of opencv have one name.
        const LoadedCalibration read = parseCalibration(text, "f");
        EXPECT_THAT(std::string(format.name), StartsWith(read.format)) << text;
      } catch (const std::invalid_argument& e) {
        if (format.written) {
          EXPECT_THAT(e.what(),
                      AllOf(HasSubstr("cam0: " + std::string(format.name) + " cannot say"),
                            HasSubstr(model),
                            HasSubstr("please convert")));
        } else {
          EXPECT_THAT(e.what(), AllOf(HasSubstr("cannot be written"), HasSubstr("kalibr, opencv")));
        }
      }
    }
  }
  EXPECT_EQ(got, expected);
}

TEST(Formats, RefuseToWriteWhatTheyCannotSay) {
  const auto message = [](const std::vector<NamedCamera>& cameras,
                          std::string_view format) -> std::string {
    try {
      (void)calibrationText(cameras, format);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "written";
  };
  const Camera camera(Pinhole{500, 500, 320, 240}, 640, 480);
  const Camera limited(Pinhole{500, 500, 320, 240}, 640, 480, 0.5);
  EXPECT_THAT(message({{"cam0", camera}, {"cam1", camera}}, "ros"),
              HasSubstr("holds one camera, got 2"));
  EXPECT_THAT(message({{"cam0", camera}, {"cam1", camera}}, "opencv"),
              HasSubstr("holds one camera, got 2"));
  EXPECT_THAT(message({{"cam0", limited}}, "colmap"), HasSubstr("max_field_angle = 0.5"));
  EXPECT_THAT(message({{"left", camera}}, "colmap"), HasSubstr("\"left\""));
  EXPECT_THAT(message({{"cam0", camera}}, "bundler"), HasSubstr("\"bundler\""));
  EXPECT_THAT(message({}, "ros"), HasSubstr("at least one camera"));
  const Camera half_panorama =
      makeCamera("equirectangular", std::vector<double>{100, 100, 200, 100}, 400, 200);
  EXPECT_THAT(message({{"cam0", half_panorama}}, "colmap"),
              HasSubstr("equirectangular over the whole image"));
}

// Basalt's ucm weighs by 1 - alpha and alpha what ours weighs by 1 and xi.
TEST(Basalt, UcmIsTheUnifiedModelWithOtherParameters) {
  for (const double xi : {0.0, 1e-12, 0.1, 1.0, 1.5, 30.0, 999.0}) {
    const Camera camera(UnifiedOmni{xi, 400 * (1 + xi), 401 * (1 + xi), 320, 240}, 640, 480);
    const std::string text = calibrationText({{"cam0", camera}}, "basalt");
    const std::vector<double> got = only(text).params(), expected = camera.params();
    for (size_t i = 0; i < got.size(); ++i) {
      EXPECT_LE(std::abs(got[i] - expected[i]), 1e-12 * std::abs(expected[i])) << text;
    }
  }
  const auto ucm = [](const std::string& alpha) {
    return replaced(fixture("unified.basalt.json"), "\"alpha\": 0.6", "\"alpha\": " + alpha);
  };
  // The closed form of Basalt's projection at one ray: u = fx x / (alpha d + (1 - alpha) z) + cx.
  const Eigen::Vector3d ray(0.3, -0.4, 0.5);
  const std::optional<Eigen::Vector2d> pixel = only(ucm("0.6")).project(ray);
  ASSERT_TRUE(pixel.has_value());
  const double weight = 0.6 * ray.norm() + 0.4 * ray.z();
  EXPECT_NEAR(pixel->x(), 240.0 * ray.x() / weight + 644.25, 1e-10);
  EXPECT_NEAR(pixel->y(), 240.5 * ray.y() / weight + 508.5, 1e-10);
  EXPECT_THAT(refusal(ucm("1.0")),
              AllOf(HasSubstr("alpha = 1 is out of range"), HasSubstr("[0, 0.99")));
  EXPECT_THAT(refusal(ucm("-0.1")), HasSubstr("alpha = -0.1 is out of range"));
}

TEST(Basalt, MayHaveComments) {
  const std::string text = fixture("tum_vi.basalt.json");
  EXPECT_EQ(only(replaced(text, "{", "{\"comment\": \"of the left one\", ")), only(text));
  EXPECT_EQ(only(replaced(text, "\"intrinsics\"", "\"comment\": \"x\", \"intrinsics\"")),
            only(text));
}

TEST(Basalt, NamesPlaces) {
  const std::string text = fixture("tum_vi.basalt.json");
  EXPECT_THAT(refusal(replaced(text, "\"kb4\"", "\"pinhole-radtan8\"")),
              AllOf(HasSubstr("value0.intrinsics[0].camera_type = \"pinhole-radtan8\""),
                    HasSubstr("pinhole, kb4, fov, eucm, ds, ucm")));
  EXPECT_THAT(
      refusal(replaced(text, "\"fx\": 190.97847715128717", "\"fx\": -3")),
      HasSubstr(
          "value0.intrinsics[0].intrinsics.fx = -3 is out of range, allowed is [0.001, 1e+07] px"));
  EXPECT_THAT(refusal(replaced(text, "\"k4\"", "\"k5\"")), HasSubstr("unknown key \"k5\""));
  EXPECT_THAT(refusal(replaced(text, "512,", "512000,")),
              HasSubstr("value0.resolution[0][0] (width) = \"512000\" is out of range"));
  EXPECT_THAT(refusal(replaced(text, "\"vignette\"", "\"lens\"")),
              HasSubstr("unknown key \"lens\""));
  EXPECT_THAT(refusal("{\"value0\": {\"intrinsics\": [], \"resolution\": []}}"),
              HasSubstr("at least one camera"));
  EXPECT_THAT(refusal("{\"value0\": {\"intrinsics\": [1], \"resolution\": []}}"),
              HasSubstr("a list of 1 [width, height]"));
}

TEST(Colmap, HoldsSeveralCamerasByTheirIds) {
  const std::string text =
      "# Number of cameras: 3\n3 SIMPLE_RADIAL 640 480 500 320.5 240.5 0.1\n\n7 RADIAL 640 480 500 "
      "320.5 240.5 0.1 -0.2\n"
      "12 RADIAL_FISHEYE 640 480 500 320.5 240.5 0.1 -0.2  # comment\n";
  const std::vector<NamedCamera> cameras = parseCalibration(text, "f").cameras;
  ASSERT_EQ(cameras.size(), 3U);
  EXPECT_EQ(cameras[0].name, "cam3");
  EXPECT_EQ(cameras[1].name, "cam7");
  EXPECT_EQ(cameras[2].name, "cam12");
  EXPECT_THAT(cameras[0].camera.params(), ElementsAre(500, 500, 320, 240, 0.1, 0, 0, 0, 0));
  EXPECT_THAT(cameras[1].camera.params(), ElementsAre(500, 500, 320, 240, 0.1, -0.2, 0, 0, 0));
  EXPECT_THAT(cameras[2].camera.params(), ElementsAre(500, 500, 320, 240, 0.1, -0.2, 0, 0));
  EXPECT_THAT(refusal(replaced(text, "cameras: 3", "cameras: 4")),
              HasSubstr("holds 3 cameras, but its header says \"4\""));
  EXPECT_THAT(refusal(replaced(text, "\n7 ", "\n3 ")), HasSubstr("CAMERA_ID 3 is given twice"));
}

TEST(Colmap, NamesLineModelAndParameter) {
  EXPECT_THAT(refusal("1 RAD_TAN_THIN_PRISM_FISHEYE 640 480 1 2 3\n"),
              AllOf(HasSubstr("line 1: MODEL = \"RAD_TAN_THIN_PRISM_FISHEYE\" is not supported"),
                    HasSubstr("PINHOLE, SIMPLE_PINHOLE, OPENCV, FULL_OPENCV")));
  EXPECT_THAT(refusal("# c\n1 PINHOLE 640 480 500 500 320\n"),
              HasSubstr("line 2 has 3 parameters, PINHOLE needs 4: fx, fy, cx, cy"));
  EXPECT_THAT(refusal("1 PINHOLE 640 480 500 500 320 240 1\n"), HasSubstr("has 5 parameters"));
  EXPECT_THAT(
      refusal("1 PINHOLE 640 480 500 500 2e6 240\n"),
      HasSubstr("line 1: cx = 2e+06 is out of range, allowed is [-999999.5, 1000000.5] px"));
  EXPECT_THAT(refusal("1 FULL_OPENCV 640 480 500 500 320 240 0 0 0 0 0 0.5 0 0\n"),
              HasSubstr("line 1: k4 = 0.5 is out of range, allowed is [0, 0]"));
  EXPECT_THAT(refusal("1 THIN_PRISM_FISHEYE 640 480 500 500 320 240 0 0 0.1 0 0 0 0 0\n"),
              HasSubstr("line 1: p1 = 0.1"));
  EXPECT_THAT(
      only("1 THIN_PRISM_FISHEYE 640 480 500 501 320.5 240.5 .1 .2 0 0 .3 .4 0 0\n").params(),
      ElementsAre(500, 501, 320, 240, .1, .2, .3, .4));
  EXPECT_THAT(refusal("1 EQUIRECTANGULAR 640 320 640 321\n"), HasSubstr("line 1: h"));
  EXPECT_THAT(refusal("1 PINHOLE 1000000000 480 500 500 320 240\n"), HasSubstr("WIDTH"));
  EXPECT_THAT(refusal("x PINHOLE 640 480 500 500 320 240\n", "colmap"), HasSubstr("CAMERA_ID"));
}

TEST(Opencv, FourCoefficientsWithoutAWordAreRefusedWithTheWayOut) {
  const std::string text =
      "K: [[500, 0, 320], [0, 501, 240], [0, 0, 1]]\nD: [0.1, 0.2, 0.01, 0.02]\n"
      "image_size: [640, 480]\n";
  EXPECT_THAT(refusal(text),
              AllOf(HasSubstr("D has 4 coefficients"),
                    HasSubstr("opencv-fisheye or opencv-pinhole"),
                    HasSubstr("fisheye_model: 1 or 0")));
  EXPECT_EQ(only(text, "opencv-fisheye").modelName(), "kannala_brandt");
  EXPECT_EQ(only(text, "opencv-pinhole").modelName(), "pinhole_radtan");
  EXPECT_EQ(only(text + "fisheye_model: 1\n"), only(text, "opencv-fisheye"));
  EXPECT_EQ(only(text + "fisheye_model: 0\n"), only(text, "opencv-pinhole"));
  EXPECT_THAT(refusal(text + "fisheye_model: 1\n", "opencv-pinhole"), HasSubstr("fisheye_model"));
  EXPECT_THAT(refusal(text + "fisheye_model: 2\n"), HasSubstr("fisheye_model = \"2\""));
  EXPECT_THAT(refusal(text, "opencv-omnidir"), HasSubstr("xi"));
  EXPECT_EQ(only(text + "xi: 1.5\n").modelName(), "omni_radtan");
  EXPECT_THAT(refusal(text + "xi: 1.5\nfisheye_model: 1\n"),
              HasSubstr("both xi and fisheye_model"));
}

TEST(Opencv, TheNumberOfCoefficientsDecidesWhereItCan) {
  const auto with = [](const std::string& d) {
    return "camera_matrix: [[500, 0, 320], [0, 501, 240], [0, 0, 1]]\nimage_width: "
           "640\nimage_height: 480\n" +
           d;
  };
  EXPECT_THAT(refusal(with("")), HasSubstr("distortion_coefficients (or D) is missing"));
  EXPECT_EQ(only(with("dist: []\n")).modelName(), "pinhole");
  EXPECT_EQ(only(with("dist: [0, 0, 0, 0, 0]\n")).modelName(), "pinhole");
  EXPECT_THAT(only(with("dist: [[.1, .2, .01, .02, .3]]\n")).params(),
              ElementsAre(500, 501, 320, 240, .1, .2, .01, .02, .3));
  EXPECT_THAT(only(with("dist: [.1, .2, .01, .02, .3, 0, 0, 0]\n")).params(),
              ElementsAre(500, 501, 320, 240, .1, .2, .01, .02, .3));
  EXPECT_THAT(refusal(with("dist: [.1, .2, .01, .02, .3, .4, 0, 0]\n")),
              AllOf(HasSubstr("dist[5] (k4) = .4"), HasSubstr("allowed is 0")));
  for (const std::string d :
       {"[.1]", "[.1, .2, .3]", "[1, 2, 3, 4, 5, 6]", "[[.1, .2], [.3, .4]]", "5", "{}"}) {
    EXPECT_THAT(refusal(with("dist: " + d + "\n")), HasSubstr("dist")) << d;
  }
  EXPECT_THAT(refusal(with("dist: [0, 0, 0, 0, 0]\nD: [0, 0, 0, 0, 0]\n")),
              HasSubstr("has both dist and D"));
}

TEST(Opencv, CameraMatrixIsCheckedWhole) {
  const auto with = [](const std::string& k) {
    return "D: []\nimage_width: 640\nimage_height: 480\nK: " + k + "\n";
  };
  EXPECT_EQ(only(with("[500, 0, 320, 0, 501, 240, 0, 0, 1]")).modelName(), "pinhole");
  EXPECT_THAT(refusal(with("[500, 2, 320, 0, 501, 240, 0, 0, 1]")), HasSubstr("skew 2"));
  EXPECT_THAT(refusal(with("[500, 0, 320, 1, 501, 240, 0, 0, 1]")), HasSubstr("K[3]"));
  EXPECT_THAT(refusal(with("[500, 0, 320, 0, 501, 240, 0, 0, 2]")), HasSubstr("K[8]"));
  EXPECT_THAT(refusal(with("[[500, 0, 320], [0, 501, 240]]")),
              HasSubstr("2 x 3, allowed is 3 x 3"));
  EXPECT_THAT(refusal(with("[[500, 0, 320], [0, 501]]")), HasSubstr("K[1]"));
  EXPECT_THAT(refusal(with("{rows: 3, cols: 3, dt: d, data: [500, 0, 320, 0, 501, 240, 0, 0]}")),
              HasSubstr("holds 8 numbers, but rows x cols is 3 x 3"));
  EXPECT_THAT(
      refusal(with("{rows: 3, cols: 3, dt: 3d, data: [500, 0, 320, 0, 501, 240, 0, 0, 1]}")),
      HasSubstr("K.dt = \"3d\""));
  EXPECT_THAT(refusal(with("{rows: 1000000000, cols: 1000000000, dt: d, data: [1]}")),
              HasSubstr("K.rows"));
  EXPECT_THAT(refusal("D: []\nK: [500, 0, 320, 0, 501, 240, 0, 0, 1]\n"), HasSubstr("image size"));
  EXPECT_THAT(refusal("D: []\nK: [500, 0, 320, 0, 501, 240, 0, 0, 1]\nimage_width: 640\n"),
              HasSubstr("image_height"));
  EXPECT_THAT(refusal(with("[500, 0, 320, 0, 501, 240, 0, 0, 1]\nlens: big")),
              HasSubstr("unknown key \"lens\""));
  EXPECT_THAT(refusal(with("[500, 0, 320, 0, 501, 240, 0, 0, 1]\nimage_size: [640, 480]")),
              HasSubstr("has both image_size and image_width"));
}

TEST(Opencv, SkewOfOmnidirIsKept) {
  const Camera camera =
      only(replaced(fixture("mirror.opencv.yaml"), "1150.25, 0., 644.25", "1150.25, 3.5, 644.25"));
  EXPECT_EQ(camera.params().back(), 3.5);
  EXPECT_EQ(only(calibrationText({{"cam0", camera}}, "opencv")), camera);
  EXPECT_EQ(only(calibrationText({{"cam0", camera}}, "kalibr")), camera);
}

TEST(Ros, NamesModels) {
  const std::string text = fixture("webcam.ros.yaml");
  EXPECT_THAT(refusal(replaced(text, "plumb_bob", "fisheye")),
              AllOf(HasSubstr("distortion_model = \"fisheye\""),
                    HasSubstr("plumb_bob, rational_polynomial, equidistant")));
  EXPECT_THAT(refusal(replaced(text, "distortion_model: plumb_bob\n", "")),
              HasSubstr("distortion_model is missing"));
  EXPECT_THAT(refusal(replaced(text, "plumb_bob", "equidistant")),
              HasSubstr("1 x 5, allowed are one row or column of 4 numbers"));
  const std::string rational =
      replaced(replaced(replaced(text, "plumb_bob", "rational_polynomial"), "cols: 5", "cols: 8"),
               "-0.0625]",
               "-0.0625, 0, 0, 0]");
  EXPECT_EQ(only(rational), only(text));
  EXPECT_THAT(refusal(replaced(rational, "-0.0625, 0, 0, 0]", "-0.0625, 0, 0.5, 0]")),
              HasSubstr("(k5) = 0.5"));
}

// As `rostopic echo -n1 /camera_info` and `ros2 topic echo --once /camera_info` print it.
TEST(Ros, ReadsMessages) {
  const std::string ros1 = R"(header: 
  seq: 12
  stamp: 
    secs: 1600000000
    nsecs:  12345678
  frame_id: "camera"
height: 480
width: 640
distortion_model: "plumb_bob"
D: [-0.25, 0.125, 0.001, -0.002, 0.0]
K: [500.0, 0.0, 320.5, 0.0, 501.0, 240.5, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [450.0, 0.0, 321.0, 0.0, 0.0, 451.0, 241.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi: 
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: False
---
)";
  const LoadedCalibration loaded = parseCalibration(ros1, "f");
  EXPECT_EQ(loaded.format, "ros");
  const Camera camera = loaded.cameras.at(0).camera;
  EXPECT_EQ(camera.modelName(), "pinhole_radtan");
  EXPECT_THAT(camera.params(), ElementsAre(500, 501, 320.5, 240.5, -0.25, 0.125, 0.001, -0.002, 0));
  EXPECT_EQ(camera.width(), 640);
  EXPECT_EQ(camera.height(), 480);

  std::string ros2 = ros1;
  for (const auto& [from, to] : {std::pair("\nD:", "\nd:"),
                                 {"\nK:", "\nk:"},
                                 {"\nR:", "\nr:"},
                                 {"\nP:", "\np:"},
                                 {"  seq: 12\n", ""},
                                 {"secs:", "sec:"},
                                 {"nsecs:", "nanosec:"},
                                 {"False", "false"}}) {
    ros2 = replaced(ros2, from, to);
  }
  EXPECT_EQ(only(ros2), camera);
  const std::string lists = replaced(
      ros2, "[-0.25, 0.125, 0.001, -0.002, 0.0]", "\n- -0.25\n- 0.125\n- 0.001\n- -0.002\n- 0.0");
  EXPECT_EQ(only(lists), camera);

  EXPECT_EQ(only(replaced(ros1, "binning_x: 0", "binning_x: 1")), camera);
  EXPECT_THAT(refusal(replaced(ros1, "binning_x: 0", "binning_x: 2")), HasSubstr("binning_x"));
  EXPECT_EQ(
      only(replaced(replaced(ros1, "  height: 0", "  height: 480"), "  width: 0", "  width: 640")),
      camera);
  EXPECT_THAT(refusal(replaced(ros1, "  height: 0", "  height: 100")),
              HasSubstr("roi is a part of 0 x 100 px"));
  EXPECT_THAT(refusal(replaced(ros1, "x_offset: 0", "x_offset: 8")), HasSubstr("roi.x_offset"));
  EXPECT_THAT(refusal(replaced(ros1, "\nK:", "\nk:")), HasSubstr("f"));
  EXPECT_THAT(refusal(ros1 + ros1), HasSubstr("more than one YAML document"));
  // The file form may have them, too.
  const std::string file = fixture("webcam.ros.yaml");
  EXPECT_EQ(only("binning_x: 1\n" + file), only(file));
  EXPECT_THAT(refusal("binning_y: 3\n" + file), HasSubstr("binning_y"));
}

TEST(Camodocal, NamesModelsAndParts) {
  const std::string text = fixture("tum_vi.camodocal.yaml");
  EXPECT_THAT(refusal(replaced(text, "KANNALA_BRANDT", "PINHOLE_FULL")),
              AllOf(HasSubstr("model_type = \"PINHOLE_FULL\""),
                    HasSubstr("KANNALA_BRANDT, MEI, PINHOLE, scaramuzza")));
  EXPECT_THAT(refusal(replaced(text, "KANNALA_BRANDT", "MEI")),
              HasSubstr("mirror_parameters is missing"));
  EXPECT_THAT(refusal(replaced(text, "   k5:", "   k6:")),
              HasSubstr("projection_parameters has the unknown key \"k6\""));
  EXPECT_THAT(refusal(text + "mirror_parameters:\n   xi: 1\n"),
              HasSubstr("unknown key \"mirror_parameters\""));
}

// u = ac x + ad y + cx, v = ae x + y + cy with the ray (x, y, -f(rho)): by camodocal's equations.
TEST(Camodocal, ScaramuzzasAffineMatrixScalesTheColumns) {
  const Camera camera =
      only(replaced(replaced(replaced(fixture("pal.camodocal.yaml"), "ac: 1.000000", "ac: 0.96"),
                             "ad: 0.000000",
                             "ad: -0.02"),
                    "ae: 0.000000",
                    "ae: 0.03"));
  for (const auto& [x, y] : std::initializer_list<std::pair<double, double>>{
           {0, 0}, {100, 0}, {0, 150}, {-250, 40}, {300, -200}}) {
    const double rho = std::hypot(x, y);
    const double f = -244.5 + rho * rho * (0.00175 + rho * (-1.75e-06 + rho * 4.5e-09));
    const std::optional<Eigen::Vector2d> pixel = camera.project({x, y, -f});
    ASSERT_TRUE(pixel.has_value());
    EXPECT_NEAR(pixel->x(), 0.96 * x - 0.02 * y + 645.125, 1e-9);
    EXPECT_NEAR(pixel->y(), 0.03 * x + y + 486.5, 1e-9);
  }
}

// OCamCalib: (row, column) = [c d; e 1] (x, y) + (xc, yc), x along the rows; looks along -z.
TEST(Ocamcalib, RowsAndColumnsAreNotMixedUp) {
  const Camera camera =
      only(replaced(fixture("pal.ocamcalib.txt"), "1.000000 0.000000 0.000000", "0.96 -0.02 0.03"));
  for (const auto& [x, y] : std::initializer_list<std::pair<double, double>>{
           {0, 0}, {100, 0}, {0, 150}, {-250, 40}, {300, -200}}) {
    const double rho = std::hypot(x, y);
    const double f = -244.5 + rho * rho * (0.00175 + rho * (-1.75e-06 + rho * 4.5e-09));
    const double row = 0.96 * x - 0.02 * y + 486.5;
    const double column = 0.03 * x + y + 645.125;
    const std::optional<Eigen::Vector2d> pixel = camera.project({y, x, -f});
    ASSERT_TRUE(pixel.has_value());
    EXPECT_NEAR(pixel->x(), column, 1e-9);
    EXPECT_NEAR(pixel->y(), row, 1e-9);
  }
}

TEST(Ocamcalib, NamesLineAndValue) {
  const std::string text = fixture("pal.ocamcalib.txt");
  EXPECT_THAT(refusal(replaced(text, "5 -2.4", "6 -2.4"), "ocamcalib"),
              HasSubstr("line 3 has 5 coefficients, but says 6"));
  EXPECT_THAT(refusal(replaced(text, "-2.445000e+02", "2.445000e+02")),
              HasSubstr("line 3: a0 = 244.5 is out of range"));
  EXPECT_THAT(refusal(replaced(text, "486.500000 645", "486.500000")), HasSubstr("line 11"));
  EXPECT_THAT(refusal(text.substr(0, text.find("960 1280"))),
              HasSubstr("ends before the line with height and width"));
  EXPECT_THAT(refusal(text + "1\n"), HasSubstr("one line more"));
}

TEST(OrbSlam3, HoldsOneOrTwoCameras) {
  const std::string text = fixture("tum_vi.orbslam3.yaml");
  const std::string second =
      "Camera2.fx: 190.5\nCamera2.fy: 190.25\nCamera2.cx: 252.5\nCamera2.cy: 255.0\n"
      "Camera2.k1: 0.003\nCamera2.k2: 0.0007\nCamera2.k3: -0.002\nCamera2.k4: 0.0002\n"
      "Camera2.overlappingBegin: 0\nStereo.T_c1_c2: [1]\n";
  const std::vector<NamedCamera> cameras = parseCalibration(text + second, "f").cameras;
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].name, "cam1");
  EXPECT_EQ(cameras[1].name, "cam2");
  EXPECT_EQ(cameras[0].camera, only(text));
  EXPECT_THAT(cameras[1].camera.params(),
              ElementsAre(190.5, 190.25, 252.5, 255.0, .003, .0007, -.002, .0002));
  EXPECT_THAT(refusal(text + "Camera2.fx: 190.5\n"), HasSubstr("Camera2.fy is missing"));
  EXPECT_THAT(refusal(text + "Camera.fx: 190.5\n"), HasSubstr("both Camera.fx and Camera1.fx"));
  EXPECT_THAT(refusal(text + "Camera1.k5: 190.5\n"), HasSubstr("unknown key \"Camera1.k5\""));
  EXPECT_THAT(refusal(text + "LEFT.K: 1\n"), HasSubstr("\"LEFT.K\""));
  EXPECT_THAT(refusal(replaced(text, "KannalaBrandt8", "Fisheye")),
              AllOf(HasSubstr("Camera.type = \"Fisheye\""),
                    HasSubstr("KannalaBrandt8, PinHole, Rectified")));
  EXPECT_EQ(only(text + "System.thFarPoints: 20.0\nthFarPoints: 20.0\n"), only(text));
  // Already rectified: a pinhole, and no distortion beside.
  EXPECT_THAT(refusal(replaced(text, "KannalaBrandt8", "Rectified")),
              HasSubstr("unknown key \"Camera1.k1\""));
  const Camera rectified = only(
      "File.version: \"1.0\"\nCamera.type: \"Rectified\"\nCamera1.fx: 435.25\nCamera1.fy: 435.5\n"
      "Camera1.cx: 367.5\nCamera1.cy: 252.25\nCamera.width: 752\nCamera.height: 480\n"
      "Stereo.b: 0.11\nStereo.ThDepth: 60.0\n");
  EXPECT_EQ(rectified.modelName(), "pinhole");
  EXPECT_THAT(rectified.params(), ElementsAre(435.25, 435.5, 367.5, 252.25));
}

TEST(Tum, AreRelativeOrAbsoluteAsCxAndCySay) {
  const auto file = [](const std::string& line) { return line + "\n640 480\ncrop\n640 480\n"; };
  EXPECT_THAT(only(file("0.5 0.75 0.5 0.5 0.9")).params(),
              ElementsAre(320, 360, 319.5, 239.5, 0.9));
  EXPECT_THAT(only(file("320 360 319.5 239.5 0.9")).params(),
              ElementsAre(320, 360, 319.5, 239.5, 0.9));
  EXPECT_THAT(only(file("FOV 320 360 319.5 239.5 0.9")).params(),
              ElementsAre(320, 360, 319.5, 239.5, 0.9));
  EXPECT_EQ(only(file("320 360 319.5 239.5 0")).modelName(), "pinhole");
  EXPECT_EQ(only(file("Pinhole 320 360 319.5 239.5 0")).modelName(), "pinhole");
  EXPECT_THAT(only(file("320 360 319.5 239.5 .1 .2 .01 .02")).params(),
              ElementsAre(320, 360, 319.5, 239.5, .1, .2, .01, .02, 0));
  EXPECT_THAT(only(file("EquiDistant 320 360 319.5 239.5 .1 .2 .01 .02")).params(),
              ElementsAre(320, 360, 319.5, 239.5, .1, .2, .01, .02));
  EXPECT_THAT(refusal(file("320 360 319.5 0.5 0.9")), HasSubstr("both relative to the image size"));
  EXPECT_THAT(refusal(file("Pinhole 320 360 319.5 239.5 0.9")), HasSubstr("fifth number = 0.9"));
  EXPECT_THAT(refusal(file("FOV 320 360 319.5 239.5")),
              HasSubstr("line 1 has 4 numbers, FOV needs 5"));
  EXPECT_THAT(refusal(file("0.5 0.75 0.5 0.5 4")), HasSubstr("line 1: omega = 4 is out of range"));
  EXPECT_THAT(refusal(file("Atan 1 2 3 4 5"), "tum"),
              HasSubstr("FOV, Pinhole, RadTan, EquiDistant, KannalaBrandt"));
  EXPECT_THAT(refusal("0.5 0.75 0.5 0.5 0.9\n640 480\nstretch\n640 480\n"),
              HasSubstr("crop, full, none"));
  EXPECT_THAT(refusal("0.5 0.75 0.5 0.5 0.9\n640 480\ncrop\n"),
              HasSubstr("ends before the line with width and height of the output"));
  EXPECT_THAT(refusal("0.5 0.75 0.5 0.5 0.9\n640\ncrop\n640 480\n"),
              HasSubstr("line 2 must be width and height"));
}

TEST(Woodscape, NamesKeys) {
  const std::string text = fixture("surround.woodscape.json");
  EXPECT_THAT(refusal(replaced(text, "radial_poly", "cylindrical")),
              HasSubstr("intrinsic.model = \"cylindrical\""));
  EXPECT_THAT(refusal(replaced(text, "\"poly_order\": 4", "\"poly_order\": 5")),
              HasSubstr("intrinsic.poly_order"));
  EXPECT_THAT(refusal(replaced(text, "966.0", "966.5")), HasSubstr("intrinsic.height = \"966.5\""));
  EXPECT_THAT(refusal(replaced(text, "\"k4\"", "\"k5\"")), HasSubstr("unknown key \"k5\""));
}

TEST(Panorama, CoversTheSphere) {
  const Camera camera = only("model: equirectangular\nresolution: [1920, 960]\n");
  // The pixel's longitude and elevation, by the words of docs/calibration-files.md.
  for (const auto& [x, y] : std::initializer_list<std::pair<double, double>>{
           {0, 0}, {959.5, 479.5}, {1919, 959}, {300, 700}}) {
    const double lon = ((x + 0.5) / 1920 - 0.5) * 2 * M_PI;
    const double up = (0.5 - (y + 0.5) / 960) * M_PI;
    const std::optional<Eigen::Vector3d> ray = camera.unproject({x, y});
    ASSERT_TRUE(ray.has_value());
    EXPECT_NEAR(ray->x(), std::sin(lon) * std::cos(up), 1e-12);
    EXPECT_NEAR(ray->y(), -std::sin(up), 1e-12);
    EXPECT_NEAR(ray->z(), std::cos(lon) * std::cos(up), 1e-12);
  }
  EXPECT_THAT(refusal("model: equirectangular\nresolution: [1920, 960]\nfov: 1\n"),
              HasSubstr("unknown key \"fov\""));
  EXPECT_THAT(refusal("model: equirectangular\n"), HasSubstr("resolution is missing"));
}

TEST(Kalibr, ExtensionsAreMarked) {
  const auto text = [](std::string_view model, const std::vector<double>& params) {
    return kalibrYaml({{"cam0", makeCamera(model, params, 640, 480)}});
  };
  for (const std::string& extended :
       {text("pinhole_radtan", {500, 500, 320, 240, .1, .2, .01, .02, .3}),
        text("omni_radtan", {1.5, 500, 500, 320, 240, .1, .2, .01, .02, 3}),
        text("theta_polynomial", {300, 0, 0, 0, 1, 320, 240}),
        text("equirectangular", {100, 100, 320, 240})}) {
    EXPECT_THAT(extended, HasSubstr("an extension of dlsd, unknown to Kalibr")) << extended;
  }
  for (const std::string& plain :
       {text("pinhole_radtan", {500, 500, 320, 240, .1, .2, .01, .02, 0}),
        text("omni_radtan", {1.5, 500, 500, 320, 240, .1, .2, .01, .02, 0}),
        text("eucm", {.5, 1, 500, 500, 320, 240}),
        text("double_sphere", {.1, .5, 500, 500, 320, 240})}) {
    EXPECT_THAT(plain, Not(HasSubstr("#"))) << plain;
  }
}

// A bomb costs no more than the text that it is made of.
TEST(Hostile, TextsAreRefusedInTime) {
  const auto times = [](size_t n, const std::string& text) {
    std::string out;
    for (size_t i = 0; i < n; ++i) out += text;
    return out;
  };
  std::string bomb = "a: &a [x,x,x,x,x,x,x,x,x]\n";
  for (char c = 'b'; c < 'l'; ++c) {
    const std::string alias = std::string("*") + static_cast<char>(c - 1);
    bomb += std::string(1, c) + ": &" + c + " [" + times(9, alias + ",") + alias + "]\n";
  }
  EXPECT_THAT(refusal(bomb), HasSubstr("anchor or alias"));
  EXPECT_THAT(refusal("\x89PNG\r\n\x1a\n"), HasSubstr("not a text file in UTF-8: byte 1 is 137"));
  EXPECT_THAT(refusal(std::string("c\0a\0m\0", 6)), HasSubstr("byte 2 is 0"));
  for (const std::string bad : {"\xc0\x80",
                                "\xe0\x80\x80",
                                "\xf0\x80\x80\x80",
                                "\xed\xa0\x80",
                                "\xf4\x90\x80\x80",
                                "\xe2\x82",
                                "\x80",
                                "\xff"}) {
    EXPECT_THAT(refusal("cam0: " + bad + "\n"), HasSubstr("byte 7 is"));
  }
  EXPECT_THAT(refusal("cam0: {\"\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80\": 1}\n"),
              HasSubstr("unknown key \"?????????\""));
  EXPECT_THAT(refusal(times((4 << 20) + 1, " ")), HasSubstr("larger than 4194304 bytes"));
  EXPECT_FALSE(refusal(times(1 << 20, "a: {")).empty());
  EXPECT_FALSE(refusal(times(1 << 20, "[")).empty());
  EXPECT_FALSE(refusal(times(1 << 20, "{\"a\":")).empty());
  EXPECT_FALSE(refusal(times(400'000, "- ")).empty());
  EXPECT_FALSE(refusal("<opencv_storage>" + times(1 << 20, "<a>")).empty());
  EXPECT_THAT(refusal(times(1 << 20, "1 ") + "\n"), HasSubstr("more than 500000 words"));
  EXPECT_THAT(refusal(times(400'000, "1 PINHOLE\n")), HasSubstr("more than 500000 words"));
  EXPECT_THAT(refusal("1 PINHOLE 640 480 " + times(100'000, "9") + " 1 1 1\n"),
              AllOf(HasSubstr("line 1: fx = \"9999"), HasSubstr("not a finite number")));
  try {
    (void)loadCalibration("/dev/zero");
    ADD_FAILURE() << "accepted";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("/dev/zero: is larger than"));
  }
}

TEST(SharedPhotos, CalibrationsLoad) {
  const std::string folder = std::string(DLSD_SOURCE_DIR) + "/../shared/photos";
  if (!fs::exists(folder)) GTEST_SKIP() << "no folder with photographs";
  const std::map<std::string, std::string> expected{
      {"equirect_2.yaml", "equirectangular"},
      {"gopro_corridor_66.kalibr.yaml", "pinhole_radtan"},
      {"matsuren_ds_building.kalibr.yaml", "double_sphere"},
      {"surround_back.kalibr.yaml", "kannala_brandt"}};
  std::map<std::string, std::string> got;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    const LoadedCalibration loaded = loadCalibration(entry.path().string());
    ASSERT_EQ(loaded.cameras.size(), 1U);
    got[entry.path().filename().string()] = loaded.cameras[0].camera.modelName();
  }
  EXPECT_EQ(got, expected);
}

}  // namespace
}  // namespace dlsd
