// `dlsd camera show | check | convert | rectify` as a user meets them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cameras/calibration/calibration.h"
#include "cli/cli_fixture.h"
#include "synth/dataset/image.h"

namespace {

using dlsd::cli::test::contentOf;
using dlsd::cli::test::Result;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

struct CameraCli : dlsd::cli::test::Cli {
  void SetUp() override {
    Cli::SetUp();
    write("flat.yaml",
          "cam0:\n"
          "  camera_model: pinhole\n"
          "  distortion_model: none\n"
          "  intrinsics: [80.0, 80.0, 79.5, 59.5]\n"
          "  distortion_coeffs: []\n"
          "  resolution: [160, 120]\n");
    write("rig.yaml",
          std::string(kWide) +
              "cam1:\n"
              "  camera_model: omni\n"
              "  distortion_model: none\n"
              "  intrinsics: [1.4, 60.0, 60.0, 79.5, 59.5]\n"
              "  distortion_coeffs: []\n"
              "  max_field_angle: 1.7\n"
              "  resolution: [160, 120]\n");
  }

  /// A PGM or PPM of 160 x 120 px with values that tell the place.
  void writeImage(const std::string& name, int channels, int bits) const {
    std::string content = channels == 3 ? "P6 160 120 " : "P5 160 120 ";
    content += bits == 16 ? "65535\n" : "255\n";
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 160; ++x) {
        for (int c = 0; c < channels; ++c) {
          const int value = valueAt(x, y, c, bits);
          if (bits == 16) {
            content += char(value / 256);
          }
          content += char(value % 256);
        }
      }
    }
    write(name, content);
  }
  static int valueAt(int x, int y, int c, int bits) {
    return bits == 16 ? 300 * x + 100 * y + 1000 * c : x + y / 2 + 10 * c;
  }
  static int valueOf(const dlsd::Image& image, int x, int y, int c) {
    const size_t i =
        (size_t(y) * size_t(image.width) + size_t(x)) * size_t(image.channels) + size_t(c);
    if (image.bits == 8) {
      return image.bytes[i];
    }
    uint16_t value = 0;
    std::memcpy(&value, &image.bytes[2 * i], sizeof value);
    return value;
  }
  [[nodiscard]] dlsd::Image image(const std::string& name) const {
    return dlsd::readImage((folder / name).string());
  }
};

TEST_F(CameraCli, HelpShowsExamples) {
  for (const char* command : {"show", "check", "convert", "rectify"}) {
    const Result result = dlsd(std::string("camera ") + command + " --help");
    EXPECT_EQ(result.code, 0);
    EXPECT_THAT(result.out, HasSubstr(std::string("\n  dlsd camera ") + command));
  }
}

TEST_F(CameraCli, ShowTellsEachCameraOfAFile) {
  const Result all = dlsd("camera show rig.yaml");
  EXPECT_EQ(all.code, 0) << all.err;
  EXPECT_THAT(all.out, AllOf(HasSubstr("== cam0 =="), HasSubstr("== cam1 ==")));
  EXPECT_THAT(all.out, HasSubstr("kalibr"));
  const Result one = dlsd("camera show rig.yaml:cam1");
  EXPECT_THAT(one.out, AllOf(HasSubstr("omni"), Not(HasSubstr("fov"))));
  // 60 sin(1.7) / (cos(1.7) + 1.4) = 46.81
  EXPECT_THAT(one.out, HasSubstr("the domain ends 46.8"));
  EXPECT_THAT(one.out, HasSubstr("all around inside the image"));
  EXPECT_THAT(one.out, HasSubstr("97.4028 deg"));
  EXPECT_THAT(one.out, HasSubstr("0.436 x 0.436 px/deg at the centre"));  // 60 / 2.4 px/rad
  expectRefused("camera show rig.yaml:cam2", 2, "cam0, cam1");
  expectRefused("camera show rig.yaml --format colmap", 2, "rig.yaml");
  expectRefused("camera show rig.yaml --format punch-card", 2, "kalibr");
}

TEST_F(CameraCli, ShowSpeaksJson) {
  const Result result = dlsd("camera show rig.yaml --json");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("calibration_format"), "kalibr");
  ASSERT_EQ(json.at("cameras").size(), 2U);
  const auto& wide = json.at("cameras").at(0);
  EXPECT_EQ(wide.at("model"), "fov");
  EXPECT_EQ(wide.at("params").at("omega"), 0.93);
  EXPECT_EQ(wide.at("pixels_with_ray"), 160 * 120);
  EXPECT_TRUE(wide.at("valid_circle").is_null());
  // Both sides are 80 px = tan(80 / 56 omega) / (2 tan(omega / 2)) from the axis.
  const double half = std::atan2(std::tan(80 / 56.0 * 0.93), 2 * std::tan(0.465));
  EXPECT_NEAR(wide.at("horizontal_view").at("total_deg"), 2 * half * 180 / M_PI, 1e-9);
  const auto& mirror = json.at("cameras").at(1);
  EXPECT_EQ(mirror.at("valid_circle").at("complete"), true);
  EXPECT_NEAR(mirror.at("max_field_angle_deg"), 1.7 * 180 / M_PI, 1e-12);
  EXPECT_EQ(mirror.at("horizontal_view").at("cut_by_domain"), true);
}

TEST_F(CameraCli, ShowPlots) {
  ASSERT_EQ(dlsd("camera show rig.yaml:cam1 --plot plot.png").code, 0);
  const dlsd::Image plot = image("plot.png");
  EXPECT_EQ(plot.channels, 3);
  EXPECT_GT(plot.width, 1000);
  expectRefused("camera show rig.yaml --plot plot.png", 2, "rig.yaml:cam1");
  expectRefused("camera show rig.yaml:cam0 --plot rig.yaml", 2, "is the input");
  expectRefused("camera show rig.yaml:cam0 --plot nowhere/plot.png", 2, "nowhere");
}

// At its poles a panorama has no scale.
TEST_F(CameraCli, ShowTellsOfPanoramasOffTheirPoles) {
  write("sphere.yaml", "model: equirectangular\nresolution: [160, 80]\n");
  const Result result = dlsd("camera show sphere.yaml --json");
  ASSERT_EQ(result.code, 0) << result.err;
  const auto rim = nlohmann::json::parse(result.out).at("cameras").at(0).at("scale_at_rim");
  EXPECT_GT(rim.at("tangential_px_per_deg"), 1);
  EXPECT_LT(rim.at("tangential_px_per_deg"), 160);
  EXPECT_LT(rim.at("radial_px_per_deg"), 160);
  EXPECT_EQ(dlsd("camera show sphere.yaml --plot sphere.png").code, 0);
}

// cv::fisheye or the pinhole model, the file does not say.
TEST_F(CameraCli, EveryCommandTakesTheFormat) {
  write(
      "four.yml",
      "%YAML:1.0\n---\nimage_width: 160\nimage_height: 120\ncamera_matrix: !!opencv-matrix\n  "
      "rows: 3\n  cols: 3\n  dt: d\n  data: [56., 0., 79.5, 0., 56., 59.5, 0., 0., 1.]\n"
      "distortion_coefficients: !!opencv-matrix\n  rows: 1\n  cols: 4\n  dt: d\n  data: [0.01, 0., "
      "0., 0.]\n");
  writeImage("a.pgm", 1, 8);
  for (const std::string command : {"camera show four.yml",
                                    "camera check four.yml",
                                    "detect --camera four.yml a.pgm --out d.jsonl",
                                    "generate --camera four.yml --count 1 --out g"}) {
    expectRefused(command, 2, "opencv-fisheye or opencv-pinhole");
    EXPECT_EQ(dlsd(command + " --format opencv-fisheye").code, 0) << command;
  }
  EXPECT_EQ(dlsd::loadCamera((folder / "g/cameras/four.yaml").string()).modelName(),
            "kannala_brandt");
  expectRefused("detect --data g --format kalibr", 2, "--format");
  expectRefused("detect --camera four.yml a.pgm --format punch-card", 2, "kalibr");
}

TEST_F(CameraCli, CheckGoesThroughEveryPixel) {
  const Result result = dlsd("camera check rig.yaml");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("0/19200 0.00 %"));  // cam0 has a ray everywhere
  EXPECT_THAT(result.out, HasSubstr("passed: at most 1e-06 px"));
  // A camera that sees nothing of what it should.
  std::string aside = kWide;
  aside.replace(aside.find("79.5, 59.5"), 10, "9000.0, 59.5");
  write("aside.yaml", aside);
  const Result nothing = dlsd("camera check aside.yaml");
  EXPECT_EQ(nothing.code, 1);
  EXPECT_EQ(nothing.err, "dlsd: aside.yaml (cam0): no pixel has a ray\n");
  const Result strict = dlsd("camera check rig.yaml:cam0 --max-px 0");
  EXPECT_EQ(strict.code, 1);
  EXPECT_EQ(strict.err, "dlsd: rig.yaml:cam0 (cam0): the round trip is worse than 0 px\n");
  EXPECT_THAT(strict.out, HasSubstr("failed"));
  expectRefused("camera check wide.yaml --max-px nan", 2, "--max-px");
  expectRefused("camera check wide.yaml --max-px -1", 2, "--max-px");
  expectRefused("camera check wide.yaml --image missing.png", 2, "missing.png");
  writeImage("small.pgm", 1, 8);
  write("larger.yaml",
        "cam0: {camera_model: pinhole, distortion_model: none, intrinsics: [80.0, "
        "80.0, 79.5, 59.5], distortion_coeffs: [], resolution: [161, 120]}\n");
  expectRefused("camera check larger.yaml --image small.pgm", 2, "161x120");
  expectRefused("camera check rig.yaml --image small.pgm", 2, "rig.yaml:cam1");
}

// The calibrations of the repository, one file of each camera.
TEST_F(CameraCli, CheckPassesEveryFixture) {
  int checked = 0;
  for (const char* sub : {"", "/formats"}) {
    for (const auto& entry :
         fs::directory_iterator(DLSD_SOURCE_DIR "/fixtures/calibrations" + std::string(sub))) {
      const std::string path = entry.path().string();
      if (!path.ends_with(".kalibr.yaml") && (*sub != 0 || !path.ends_with(".yaml"))) {
        continue;
      }
      const Result result = dlsd("camera check '" + path + "'");
      EXPECT_EQ(result.code, 0) << path << "\n" << result.out;
      EXPECT_EQ(result.err, "") << path;
      EXPECT_EQ(result.out.find("none: a panorama is not radial") != std::string::npos,
                path.ends_with("/sphere.kalibr.yaml"))
          << path;
      ++checked;
    }
  }
  EXPECT_GE(checked, 17);
}

TEST_F(CameraCli, CheckWithAnImageWithoutLinesGivesNoVerdict) {
  write("grey.pgm", "P5 160 120 255\n" + std::string(160 * 120, 'x'));
  const Result result = dlsd("camera check wide.yaml --image grey.pgm");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("straightness: no lines, no verdict"));
}

// The true calibration and one with another focal length, on images that show the difference.
TEST_F(CameraCli, CheckTellsAWrongCalibrationByThePhotographs) {
  const auto fisheye = [&](double f) {
    std::ostringstream text;
    text
        << "cam0:\n  camera_model: pinhole\n  distortion_model: equidistant\n  intrinsics: [" << f
        << ", " << f
        << ", 255.5, 255.5]\n  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n  resolution: [512, 512]\n";
    return text.str();
  };
  write("true.yaml", fisheye(190.5));
  write("long.yaml", fisheye(190.5 * 1.03));
  write("short.yaml", fisheye(190.5 * 0.97));
  ASSERT_EQ(dlsd("generate --camera true.yaml --count 3 --seed 5 --out d").code, 0);
  const std::string images =
      " --image d/images/000000.png --image d/images/000001.png --image d/images/000002.png";
  const Result good = dlsd("camera check true.yaml" + images);
  EXPECT_EQ(good.code, 0) << good.err;
  EXPECT_THAT(good.out, HasSubstr("3 images: "));
  EXPECT_THAT(good.out, HasSubstr(" 50 - 60  deg"));
  EXPECT_THAT(good.out, HasSubstr("straightness: consistent with the calibration"));
  // Too long a focal length: the true radius is smaller.
  EXPECT_THAT(
      dlsd("camera check long.yaml" + images).out,
      testing::ContainsRegex("the calibration is off; .* \\+0\\.[0-9]* .*should be smaller"));
  EXPECT_THAT(dlsd("camera check short.yaml" + images).out,
              testing::ContainsRegex("the calibration is off; .* -0\\.[0-9]* .*should be larger"));
}

TEST_F(CameraCli, CheckTakesEachPhotographOnce) {
  write("a.pgm", "P5 160 120 255\n" + std::string(160 * 120, 'x'));
  write("b.pgm", "P5 160 120 255\n" + std::string(160 * 120, 'y'));
  fs::copy_file(folder / "a.pgm", folder / "c.pgm");
  EXPECT_EQ(dlsd("camera check wide.yaml --image a.pgm --image b.pgm").code, 0);
  expectRefused("camera check wide.yaml --image a.pgm --image b.pgm --image c.pgm",
                2,
                "c.pgm: is the same picture as a.pgm");
}

// The lens ends in the image, at 95 degrees, and the calibration does not say so. The
// circle is nearly the image of a line there.
TEST_F(CameraCli, CheckDoesNotTakeTheImageCircleForABowedEdge) {
  const std::string camera =
      "cam0:\n  camera_model: pinhole\n  distortion_model: equidistant\n  intrinsics: [140.0, "
      "140.0, "
      "255.5, 255.5]\n  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n  resolution: [512, 512]\n";
  write("open.yaml", camera);
  write("circle.yaml", camera + "  max_field_angle: 1.658\n");
  ASSERT_EQ(dlsd("generate --camera circle.yaml --count 2 --seed 5 --out d").code, 0);
  const std::string images = " --image d/images/000000.png --image d/images/000001.png";
  const Result good = dlsd("camera check open.yaml" + images);
  EXPECT_EQ(good.code, 0) << good.err;
  EXPECT_THAT(good.out, HasSubstr("straightness: consistent with the calibration")) << good.out;
}

// In a real one, of which the calibration is good.
TEST_F(CameraCli, CheckAcquitsTheCalibrationOfAPhotographWithACircle) {
  const std::string photo = DLSD_SOURCE_DIR "/../shared/photos/matsuren_ds_building";
  if (!fs::exists(photo + ".jpg")) {
    GTEST_SKIP() << "no folder with photographs";
  }
  const Result result =
      dlsd("camera check '" + photo + ".kalibr.yaml' --image '" + photo + ".jpg'");
  EXPECT_EQ(result.code, 0) << result.err;
  // All that was found between 90 and 100 degrees is the circle.
  EXPECT_THAT(result.out, testing::ContainsRegex(" 90 - 100 deg +0 +0\n")) << result.out;
  EXPECT_THAT(result.out, Not(HasSubstr("the calibration is off"))) << result.out;
}

TEST_F(CameraCli, ConvertFitsAModelAndWritesIt) {
  const Result result =
      dlsd("camera convert wide.yaml --to kannala_brandt --out kb.yaml --max-px 0.1");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("from            fov"), HasSubstr("k4"), HasSubstr("worst at")));
  const dlsd::Camera kb = dlsd::loadCamera((folder / "kb.yaml").string());
  EXPECT_EQ(kb.modelName(), "kannala_brandt");
  const dlsd::Camera wide = dlsd::loadCamera((folder / "wide.yaml").string());
  const Eigen::Vector2d pixel(10, 20);
  EXPECT_LE((*kb.project(*wide.unproject(pixel)) - pixel).norm(), 0.1);
  EXPECT_EQ(dlsd("camera check kb.yaml").code, 0);

  // Exact, and back.
  ASSERT_EQ(dlsd("camera convert flat.yaml --to omni --out omni.yaml --max-px 1e-9").code, 0);
  ASSERT_EQ(dlsd("camera convert omni.yaml --to pinhole --out back.yaml --max-px 1e-9").code, 0);
  EXPECT_EQ(dlsd::loadCamera((folder / "back.yaml").string()).modelName(), "pinhole");

  // All cameras of a file.
  ASSERT_EQ(dlsd("camera convert rig.yaml --to kannala_brandt --out rig_kb.yaml").code, 0);
  EXPECT_EQ(dlsd::loadCameras((folder / "rig_kb.yaml").string()).size(), 2U);
}

TEST_F(CameraCli, ConvertChangesTheFileFormat) {
  ASSERT_EQ(dlsd("camera convert wide.yaml --out wide.json --to-format basalt").code, 0);
  const auto loaded = dlsd::loadCalibration((folder / "wide.json").string());
  EXPECT_EQ(loaded.format, "basalt");
  ASSERT_EQ(dlsd("camera convert wide.json --out again.yaml").code, 0);
  EXPECT_EQ(dlsd::loadCamera((folder / "again.yaml").string()),
            dlsd::loadCamera((folder / "wide.yaml").string()));
}

TEST_F(CameraCli, ConvertSaysWhenTheModelCannotFollow) {
  // Pinholes see no 97 degrees.
  const Result poor = dlsd("camera convert rig.yaml:cam1 --to pinhole --out p.yaml");
  EXPECT_EQ(poor.code, 0);
  EXPECT_EQ(std::count(poor.err.begin(), poor.err.end(), '\n'), 1) << poor.err;
  EXPECT_THAT(poor.err,
              AllOf(HasSubstr("dlsd: rig.yaml:cam1 (cam1): pinhole does not fit this camera well"),
                    HasSubstr("pixels do not project"),
                    HasSubstr("--max-angle"),
                    HasSubstr("--max-px")));
  EXPECT_TRUE(fs::exists(folder / "p.yaml"));
  EXPECT_EQ(dlsd("camera convert wide.yaml --to kannala_brandt").err, "");
  // Who gives a bound has been told.
  EXPECT_EQ(dlsd("camera convert wide.yaml --to pinhole --max-angle 20 --max-px 9").err, "");
}

TEST_F(CameraCli, ConvertLeavesOutALimitThatTheFormatCannotSay) {
  // The pixels beyond 40 degrees are left out, which is a limit of the result.
  const Result result = dlsd(
      "camera convert wide.yaml --to kannala_brandt --max-angle 40 --out kb.txt --to-format "
      "colmap");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("is not in the file: colmap has no word for it"));
  const dlsd::Camera kb = dlsd::loadCamera((folder / "kb.txt").string());
  EXPECT_EQ(kb.modelName(), "kannala_brandt");
  EXPECT_EQ(kb.maxFieldAngleLimit(), M_PI);
  // A limit of the source is the user's, and not dropped.
  write("limited.yaml", std::string(kWide) + "  max_field_angle: 0.7\n");
  expectRefused("camera convert limited.yaml --out l.txt --to-format colmap", 2, "max_field_angle");
  // Where the format can say it, it stays.
  ASSERT_EQ(dlsd("camera convert wide.yaml --max-angle 40 --out l.json --to-format basalt").code,
            0);
  EXPECT_NEAR(
      dlsd::loadCamera((folder / "l.json").string()).maxFieldAngleLimit(), 40 * M_PI / 180, 1e-12);
}

TEST_F(CameraCli, ConvertNumbersCamerasAsKalibrReadsThem) {
  write("cameras.txt", "1 PINHOLE 160 120 80 80 80 60\n7 PINHOLE 160 120 90 90 80 60\n");
  const Result result = dlsd("camera convert cameras.txt --out chain.yaml");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("in the file cam1 is cam0, cam7 is cam1\n"));
  const auto cameras = dlsd::loadCameras((folder / "chain.yaml").string());
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].name, "cam0");
  EXPECT_EQ(cameras[1].name, "cam1");
  EXPECT_EQ(cameras[1].camera.params()[0], 90);
  EXPECT_THAT(dlsd("camera convert cameras.txt:cam7 --out one.yaml").out,
              HasSubstr("in the file cam7 is cam0\n"));
  EXPECT_THAT(dlsd("camera convert rig.yaml --out rig2.yaml").out, Not(HasSubstr("in the file")));
}

TEST_F(CameraCli, ConvertRefusesWhatIsNotGoodEnough) {
  // Pinholes see no 97 degrees.
  const std::string convert = "camera convert rig.yaml:cam1 --to pinhole --out p.yaml ";
  Result result = dlsd(convert + "--max-px 1");
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.err, AllOf(HasSubstr("rig.yaml:cam1"), HasSubstr("more than --max-px 1")));
  EXPECT_FALSE(fs::exists(folder / "p.yaml"));
  result = dlsd("camera convert wide.yaml --to pinhole --max-angle 20");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("20.000000 deg, as far as the source goes"));
  expectRefused("camera convert wide.yaml", 2, "--to MODEL");
  expectRefused("camera convert wide.yaml --to pinhoel", 2, "pinhole, fov");
  expectRefused("camera convert wide.yaml --to pinhole --max-angle 181", 2, "--max-angle");
  expectRefused(
      "camera convert wide.yaml --to pinhole --max-angle 0.0001", 2, "no pixel has a ray");
  expectRefused("camera convert wide.yaml --to omni --max-px -1", 2, "--max-px");
  expectRefused("camera convert wide.yaml --to omni --out wide.yaml", 2, "is the input");
  expectRefused("camera convert wide.yaml --to omni --out nowhere/x.yaml", 2, "nowhere");
  expectRefused("camera convert wide.yaml --to fov --out x --to-format papyrus", 2, "papyrus");
}

// A view like the camera itself shows the image as it is, whatever its type.
TEST_F(CameraCli, RectifyKeepsDepthAndChannels) {
  for (const int bits : {8, 16}) {
    for (const int channels : {1, 3}) {
      SCOPED_TRACE(testing::Message() << bits << " bit, channels " << channels);
      const std::string name = std::to_string(10 * bits + channels);
      writeImage(name + ".ppm", channels, bits);
      ASSERT_EQ(dlsd("camera rectify flat.yaml " + name + ".ppm --fov 90 --out views").code, 0);
      const dlsd::Image view = image("views/" + name + ".png");
      EXPECT_EQ(view.width, 160);
      EXPECT_EQ(view.height, 120);
      EXPECT_EQ(view.channels, channels);
      EXPECT_EQ(view.bits, bits);
      int compared = 0;
      for (int y = 1; y < 119; ++y) {
        for (int x = 1; x < 159; ++x) {
          for (int c = 0; c < channels; ++c) {
            ASSERT_NEAR(valueOf(view, x, y, c), valueAt(x, y, c, bits), bits == 16 ? 10 : 1);
            ++compared;
          }
        }
      }
      EXPECT_EQ(compared, 118 * 158 * channels);
    }
  }
}

TEST_F(CameraCli, RectifyWritesViewsMapsMaskAndCamera) {
  writeImage("a.pgm", 1, 8);
  const Result result = dlsd(
      "camera rectify wide.yaml a.pgm --fov 150 --size 100x80 --rotate 20,10,5 --out v --maps "
      "m.npy "
      "--mask mask.png --out-camera view.yaml");
  ASSERT_EQ(result.code, 0) << result.err;
  const dlsd::Camera source = dlsd::loadCamera((folder / "wide.yaml").string());
  const dlsd::Camera view = dlsd::loadCamera((folder / "view.yaml").string());
  EXPECT_EQ(view.modelName(), "pinhole");
  EXPECT_NEAR(view.params()[0], 50 / std::tan(75 * M_PI / 180), 1e-12);

  // Rows of cam_from_view from the text.
  Eigen::Matrix3d cam_from_view;
  std::istringstream text(result.out.substr(result.out.find("cam_from_view") + 13));
  for (int i = 0; i < 9; ++i) {
    text >> cam_from_view(i / 3, i % 3);
  }
  // To the right (+x) and up (-y).
  EXPECT_NEAR(cam_from_view(0, 2), std::sin(20 * M_PI / 180) * std::cos(10 * M_PI / 180), 1e-6);
  EXPECT_NEAR(cam_from_view(1, 2), -std::sin(10 * M_PI / 180), 1e-6);
  // Clockwise: what was right is now further down.
  EXPECT_GT(cam_from_view(1, 0), 0);

  const std::string maps = contentOf(folder / "m.npy");
  ASSERT_EQ(maps.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const size_t header = 10 + uint8_t(maps[8]) + 256 * size_t(uint8_t(maps[9]));
  EXPECT_EQ(header % 64, 0U);
  EXPECT_THAT(maps.substr(10, header - 10),
              AllOf(HasSubstr("'descr': '<f4'"), HasSubstr("'shape': (80, 100, 2)")));
  ASSERT_EQ(maps.size(), header + 80 * 100 * 2 * 4);
  const dlsd::Image mask = image("mask.png"), shown = image("v/a.png");
  int valid = 0, invalid = 0;
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 100; ++x) {
      float pair[2];
      std::memcpy(pair, &maps[header + size_t(y * 100 + x) * 8], 8);
      const auto ray = view.unproject({double(x), double(y)});
      const auto pixel = source.project(cam_from_view * *ray);
      if (valueOf(mask, x, y, 0) == 255) {
        ++valid;
        ASSERT_TRUE(pixel);
        EXPECT_LE((Eigen::Vector2d(pair[0], pair[1]) - *pixel).norm(), 1e-3);
        EXPECT_NEAR(valueOf(shown, x, y, 0), pixel->x() + pixel->y() / 2, 1.6);
      } else {
        ++invalid;
        EXPECT_EQ(valueOf(mask, x, y, 0), 0);
        EXPECT_EQ(valueOf(shown, x, y, 0), 0);
        EXPECT_EQ(pair[0], -2);
        EXPECT_EQ(pair[1], -2);
      }
    }
  }
  EXPECT_GT(valid, 1000);
  EXPECT_GT(invalid, 1000);
}

TEST_F(CameraCli, RectifyCropsWithoutBorders) {
  for (const char* view : {"pinhole --fov 140", "cylindrical", "equirectangular"}) {
    SCOPED_TRACE(view);
    const Result result =
        dlsd(std::string("camera rectify wide.yaml --crop --mask mask.png --view ") + view);
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("100.00 % of the view's pixels"));
  }
  // The mirror sees 97 degrees to each side.
  const std::string mirror = "camera rectify rig.yaml:cam1 --crop --mask mask2.png ";
  expectRefused(mirror, 2, "give one by --fov");
  EXPECT_EQ(dlsd(mirror + "--fov 100").code, 0);
  expectRefused(mirror + "--rotate 180,0,0 --fov 100", 2, "axis of the view");
}

TEST_F(CameraCli, RectifyCropsToSquarePixelsUnlessASizeIsGiven) {
  const std::string crop = "camera rectify wide.yaml --crop --fov 140 --out-camera c.yaml";
  const auto focal = [&] {
    const dlsd::Camera camera = dlsd::loadCamera((folder / "c.yaml").string());
    EXPECT_LE(camera.width(), 160);
    EXPECT_LE(camera.height(), 120);
    EXPECT_EQ(std::max(camera.width() / 160.0, camera.height() / 120.0), 1);
    return std::pair(camera.params()[0], camera.params()[1]);
  };
  ASSERT_EQ(dlsd(crop).code, 0);
  const auto [fx, fy] = focal();
  EXPECT_NEAR(fx / fy, 1, 0.5 / 80);  // half of some 87 pixels
  ASSERT_EQ(dlsd(crop + " --size 160x120").code, 0);
  const auto [wide_fx, wide_fy] = focal();
  EXPECT_GE(std::abs(wide_fx / wide_fy - 1), 0.02);
}

TEST_F(CameraCli, RectifyMakesNothingIfNoImageIsGood) {
  write("small.pgm", "P5 2 2 255\nabcd");
  fs::create_directories(folder / "v");
  expectRefused("camera rectify wide.yaml small.pgm --out v --out-camera c.yaml --maps m.npy",
                2,
                "small.pgm: is 2x2 px, the camera is 160x120 px");
}

TEST_F(CameraCli, RectifyMakesTheCameraOfAPanorama) {
  ASSERT_EQ(dlsd("camera rectify wide.yaml --view equirectangular --fov 180 --size 90x45 "
                 "--out-camera view.yaml")
                .code,
            0);
  const dlsd::Camera view = dlsd::loadCamera((folder / "view.yaml").string());
  EXPECT_EQ(view.modelName(), "equirectangular");
  const Eigen::Vector3d right = *view.unproject({89.5, 22.0});
  EXPECT_LE((right - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  // A view of it: a panorama of the pinhole's image, seen by that pinhole.
  writeImage("a.pgm", 1, 8);
  ASSERT_EQ(dlsd("camera rectify flat.yaml a.pgm --view equirectangular --fov 100 --size 400x340 "
                 "--out pano --out-camera pano.yaml")
                .code,
            0);
  ASSERT_EQ(dlsd("camera rectify pano.yaml pano/a.png --fov 80 --size 100x80 --out back").code, 0);
  const dlsd::Image back = image("back/a.png");
  const double f = 50 / std::tan(40 * M_PI / 180);
  for (int y = 10; y < 70; ++y) {
    for (int x = 10; x < 90; ++x) {
      const double u = (x - 49.5) / f * 80 + 79.5, v = (y - 39.5) / f * 80 + 59.5;
      EXPECT_NEAR(valueOf(back, x, y, 0), u + v / 2, 2);
    }
  }
}

// Backwards through the seam: no line there, linear or cubic.
TEST_F(CameraCli, RectifyGoesAcrossTheSeam) {
  write("sphere.yaml", "model: equirectangular\nresolution: [160, 120]\n");
  std::string content = "P5 160 120 255\n";
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      content += char(std::lround(128 + 100 * std::cos((x + 0.5) / 160 * 2 * M_PI)));
    }
  }
  write("s.pgm", content);
  for (const char* interpolation : {"linear", "cubic"}) {
    const Result result = dlsd(std::string("camera rectify sphere.yaml s.pgm --rotate 180,0,0 ") +
                               "--fov 90 --size 80x60 --out v --interpolation " + interpolation);
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("100.00 % of the view's pixels"));
    const dlsd::Image view = image("v/s.png");
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 80; ++x) {
        // The longitude from the seam on.
        const double longitude = std::atan((x - 39.5) / 40);
        EXPECT_NEAR(valueOf(view, x, y, 0), 128 + 100 * std::cos(longitude), 1.5) << x << " " << y;
      }
    }
  }
  for (const char* view : {"equirectangular", "pinhole --fov 100"}) {
    const Result crop = dlsd(std::string("camera rectify sphere.yaml --crop --rotate 180,0,0 ") +
                             "--mask m.png --view " + view);
    EXPECT_EQ(crop.code, 0) << crop.err;
  }
}

TEST_F(CameraCli, RectifyRefusesWithASentence) {
  writeImage("a.pgm", 1, 8);
  const std::string rectify = "camera rectify wide.yaml a.pgm --out v ";
  expectRefused(rectify + "--fov 180", 2, "less than 180 degrees");
  expectRefused(rectify + "--fov 0", 2, "allowed are degrees in (0, 180)\n");
  expectRefused(rectify + "--view cylindrical --fov 361", 2, "(0, 360]");
  expectRefused(rectify + "--size 100", 2, "WxH");
  expectRefused(rectify + "--size 0x10", 2, "0x10");
  expectRefused(rectify + "--size 40000x10", 2, "32766");
  expectRefused(rectify + "--rotate 10,20", 2, "yaw,pitch,roll");
  expectRefused(rectify + "--rotate 10,20,nan", 2, "yaw,pitch,roll");
  expectRefused(rectify + "--view fisheye", 2, "fisheye");
  expectRefused(rectify + "--interpolation sinc", 2, "sinc");
  expectRefused("camera rectify wide.yaml a.pgm", 2, "--out");
  expectRefused("camera rectify wide.yaml", 2, "needs images");
  expectRefused("camera rectify rig.yaml a.pgm --out v", 2, "rig.yaml:cam0");
  expectRefused(
      "camera rectify wide.yaml --view cylindrical --out-camera c.yaml", 2, "no camera model");
  expectRefused(rectify + "--view cylindrical --out-camera c.yaml", 2, "no camera model");
  expectRefused("camera rectify rig.yaml:cam1 a.pgm --out v --crop", 2, "give one by --fov");
  expectRefused("camera rectify wide.yaml --maps wide.yaml", 2, "is the input");
  // One bad image among many.
  write("bad.png", "no image");
  const Result result = dlsd(rectify + "bad.png");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, HasSubstr("bad.png"));
  EXPECT_TRUE(fs::exists(folder / "v/a.png"));
  EXPECT_FALSE(fs::exists(folder / "v/bad.png"));
}

}  // namespace
