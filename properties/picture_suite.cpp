// The detector on pictures: what must hold for any picture at all, and what must not change when a
// picture is turned, mirrored, shifted, brightened, inverted or seen through another camera.
//
// Here cases are drawn; checks/picture.h judges them. A property tries a share of RC_PARAMS' number
// of cases (at least 10), because a case renders a picture or two. The smallest case that fails is
// saved as a folder, which `dlsd replay` understands.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include "cameras/calibration/files.h"
#include "detector/options.h"
#include "properties/checks/case.h"
#include "properties/checks/picture.h"
#include "properties/gen.h"
#include "properties/gen_image.h"
#include "properties/holds.h"
#include "properties/saved_cases.h"
#include "properties/worst.h"
#include "synth/dataset/json_fields.h"

namespace dlsd {
namespace {

/// Side of the painted pictures, px.
constexpr int kSide = 360;

class PictureSuite : public ::testing::TestWithParam<std::string_view> {};
INSTANTIATE_TEST_SUITE_P(,
                         PictureSuite,
                         ::testing::ValuesIn(cameraModelNames()),
                         [](const auto& test) { return std::string(test.param); });

/// Sums over the cases of a property.
struct Tally {
  long cases = 0, counted = 0, uncompared = 0, long_lines = 0;
  std::vector<double> across_px, ends_px, shares;
};

/// Draws cases, judges them, prints the worst figures, and saves the case if one fails.
Tally expectHolds(double share, const std::function<PictureCase()>& draw) {
  Tally tally;
  Worst seconds("processor time, share of what is allowed"), across("across, px"),
      ends("at the ends, px"), shares("share of what is allowed");
  const auto add = [](const std::vector<double>& values, Worst* worst, std::vector<double>* all) {
    for (const double value : values) worst->see(value);
    all->insert(all->end(), values.begin(), values.end());
  };
  tally.cases = holdsOrSaves(
      share,
      draw,
      [](const PictureCase& picture_case) { return checkPicture(picture_case); },
      [&](const PictureCase& picture_case, const PictureOutcome& outcome) {
        if (!outcome.applies) return;
        tally.counted += outcome.counted;
        tally.uncompared += outcome.uncompared;
        if (takesImage(picture_case.property)) seconds.see(outcome.seconds_share);
        tally.long_lines += outcome.long_lines;
        add(outcome.across_px, &across, &tally.across_px);
        add(outcome.ends_px, &ends, &tally.ends_px);
        add(outcome.shares, &shares, &tally.shares);
      });
  std::cout << "    " << tally.counted << " counted in " << tally.cases << " pictures, "
            << tally.uncompared << " of them not compared\n";
  return tally;
}

/// At least this share of the values is at most `bound`. Few values say little: three standard
/// deviations below what is asked for are no failure.
void expectMost(const std::vector<double>& values,
                double bound,
                double share,
                const std::string& what) {
  const auto within =
      std::count_if(values.begin(), values.end(), [&](double value) { return value <= bound; });
  const auto count = static_cast<double>(values.size());
  EXPECT_GE(values.size(), 1U) << what;
  EXPECT_GE(static_cast<double>(within), share * count - 3 * std::sqrt(share * (1 - share) * count))
      << what;
  std::cout << "    " << within << "/" << values.size() << " " << what << " within " << bound
            << "\n";
}

/// As many lines were judged as the pictures of that model have, and at least one.
/// @param per_picture  The fewest lines per picture that any model has: some views are too narrow
///   for an isolated line of 60 px, and in a panorama few sides are as long. Their number varies by
///   twice what independent lines would; three standard deviations less are no failure.
void expectEnough(long judged, const Tally& tally, double per_picture) {
  const double expected = per_picture * static_cast<double>(tally.cases);
  EXPECT_GE(static_cast<double>(judged), std::max(1.0, expected - 3 * std::sqrt(2 * expected)));
}

/// The ends of the isolated lines are where they were.
void expectSameEnds(const Tally& tally, double per_picture) {
  expectEnough(tally.counted, tally, per_picture);
  expectMost(tally.ends_px, kEndsPx, 0.9, "ends, px,");
  expectMost(tally.ends_px, 5, 0.98, "ends, px,");
}

uint64_t genSeed() {
  return static_cast<uint64_t>(*genInt(0, 1 << 30));
}

/// Polygons through a small camera. Shrinks to fewer polygons.
PictureCase drawCase(PictureProperty property, const Camera& camera) {
  PictureCase picture_case{.property = property, .camera = camera, .seed = genSeed()};
  picture_case.shapes = *rc::gen::shrink(rc::gen::just(15U), [](unsigned shapes) {
    std::vector<unsigned> fewer;
    for (unsigned bit = 1; bit < 16; bit *= 2) {
      if ((shapes & bit) != 0) fewer.push_back(shapes & ~bit);
    }
    return rc::seq::fromContainer(fewer);
  });
  return picture_case;
}
PictureCase drawCase(PictureProperty property, std::string_view model) {
  return drawCase(property, *genSmallCamera(model, kSide));
}

TEST_P(PictureSuite, AnyPictureIsAnswered) {
  const Tally tally = expectHolds(0.5, [] {
    const TestImageSpec image = *genTestImage(160);
    const bool odd = *genInt(0, 3) == 3;
    const Camera drawn = *genCamera(GetParam(), odd ? Range::kAdmissible : Range::kRealistic);
    const double factor = static_cast<double>(std::max(image.width, image.height)) /
                          std::max(drawn.width(), drawn.height());
    // Parameters in px that are scaled with their powers may leave their range.
    const bool scaled = !odd && GetParam() != Ocam::kName && *genInt(0, 1) == 0;
    PictureCase picture_case{
        .property = PictureProperty::kAnyPicture,
        .camera =
            scaled ? scaledCamera(drawn, factor, image.width, image.height)
                   : Camera(drawn.model(), image.width, image.height, drawn.maxFieldAngleLimit()),
        .image = image};
    if (*genInt(0, 3) == 3) picture_case.detector = "dlsd-paper";
    return picture_case;
  });
  expectEnough(tally.counted, tally, 0.08);
}

class NoiseSuite : public ::testing::TestWithParam<Fill> {};
INSTANTIATE_TEST_SUITE_P(, NoiseSuite, ::testing::ValuesIn(kNoiseFills), [](const auto& test) {
  std::string name(nameOf(test.param));
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

// Of each kind, at most one line of 40 px per picture on average, and one of any length.
TEST_P(NoiseSuite, NoiseIsNoLine) {
  const Tally tally = expectHolds(0.5, [] {
    Camera camera = *genSmallCamera(*rc::gen::elementOf(cameraModelNames()), 640);
    if (*genInt(0, 3) == 3) {  // A part of any size.
      const int width = *genInt(1, std::min(100, camera.width()));
      const int height = *genInt(1, std::min(100, camera.height()));
      camera = croppedCamera(
          camera, (camera.width() - width) / 2, (camera.height() - height) / 2, width, height);
    }
    const TestImageSpec image = *genNoise(GetParam(), camera.width(), camera.height());
    return PictureCase{.property = PictureProperty::kNoise, .camera = camera, .image = image};
  });
  EXPECT_GE(tally.cases, 10);
  EXPECT_LE(tally.long_lines, tally.cases);
  EXPECT_LE(tally.counted, tally.cases);
  std::cout << "    " << tally.long_lines << " lines of 40 px\n";
}

TEST_P(PictureSuite, AMirroredPictureHasTheMirroredLines) {
  expectSameEnds(expectHolds(0.1, [] { return drawCase(PictureProperty::kMirrored, GetParam()); }),
                 0.2);
}

// Together with mirroring: turns by 90 degrees. Not for panoramas, whose two directions differ.
TEST_P(PictureSuite, ATransposedPictureHasTheTransposedLines) {
  if (GetParam() == Equirectangular::kName) GTEST_SKIP() << "longitude is not latitude";
  expectSameEnds(
      expectHolds(0.1, [] { return drawCase(PictureProperty::kTransposed, GetParam()); }), 0.35);
}

TEST_P(PictureSuite, ASceneTurnedAboutTheAxisHasTheTurnedLines) {
  if (GetParam() == Equirectangular::kName) GTEST_SKIP() << "has its axis elsewhere";
  const Tally tally = expectHolds(0.1, [] {
    PictureCase picture_case = drawCase(PictureProperty::kTurned, GetParam());
    picture_case.amount = *genReal(0, 2 * M_PI);
    return picture_case;
  });
  expectEnough(tally.counted, tally, 0.3);
  expectMost(tally.ends_px, kEndsPx, 0.8, "ends, px,");
}

TEST_P(PictureSuite, APartOfThePictureHasItsLines) {
  expectSameEnds(expectHolds(0.1,
                             [] {
                               PictureCase picture_case =
                                   drawCase(PictureProperty::kPart, GetParam());
                               picture_case.left = *genInt(0, picture_case.camera.width() / 4);
                               picture_case.top = *genInt(0, picture_case.camera.height() / 4);
                               return picture_case;
                             }),
                 0.1);
}

TEST_P(PictureSuite, WithoutItsEmptyBorderAPictureHasTheSameLines) {
  const Tally tally = expectHolds(0.1, [] {
    PictureCase picture_case = drawCase(PictureProperty::kEmptyBorder, GetParam());
    picture_case.left = *genInt(16, 40);
    return picture_case;
  });
  expectEnough(tally.counted, tally, 5);
  // Isolated ones, whose places are compared.
  expectEnough(tally.counted - tally.uncompared, tally, 0.15);
  expectMost(tally.across_px, 0.01, 0.98, "across, px,");
}

TEST_P(PictureSuite, BrightnessContrastAndInversionDoNotMatter) {
  expectSameEnds(expectHolds(0.1,
                             [] {
                               PictureCase picture_case =
                                   drawCase(PictureProperty::kGreyLevels, GetParam());
                               picture_case.inverted = *genInt(0, 1) == 1;
                               picture_case.amount = *genReal(0.6, 1);
                               picture_case.offset = *genReal(0, 255 * (1 - picture_case.amount));
                               return picture_case;
                             }),
                 0.2);
}

TEST(Pictures, AllPinholesSeeTheSameLines) {
  expectSameEnds(expectHolds(0.2,
                             [] {
                               PictureCase picture_case =
                                   drawCase(PictureProperty::kOtherPinhole, "pinhole");
                               const int width = picture_case.camera.width(),
                                         height = picture_case.camera.height();
                               picture_case.other = Camera(Pinhole{*genReal(150, 2000),
                                                                   *genReal(150, 2000),
                                                                   *genReal(0, width),
                                                                   *genReal(0, height)},
                                                           width,
                                                           height);
                               return picture_case;
                             }),
                 0.5);
}

TEST(Pictures, LinesOfAPinholeAreStraight) {
  const Tally tally =
      expectHolds(0.2, [] { return drawCase(PictureProperty::kStraight, "pinhole"); });
  expectEnough(tally.counted, tally, 0.5);
  EXPECT_LE(tally.uncompared, 1 + tally.counted / 50) << "lines have no measured edge";
}

TEST_P(PictureSuite, AnotherCameraSeesTheSameArcs) {
  const Tally tally = expectHolds(0.1, [] {
    // Sides long enough in both pictures are rare in smaller ones.
    constexpr int kLargerSide = 480;
    PictureCase picture_case =
        drawCase(PictureProperty::kOtherCamera, *genSmallCamera(GetParam(), kLargerSide));
    picture_case.other = *genSmallCamera(*rc::gen::elementOf(cameraModelNames()), kLargerSide);
    return picture_case;
  });
  expectEnough(tally.counted, tally, 0.15);
  expectMost(tally.shares, 1, 0.995, "angles over 0.15 px");
}

TEST_P(PictureSuite, EveryPixelOfALineKeepsEquation8) {
  const Tally tally =
      expectHolds(0.1, [] { return drawCase(PictureProperty::kEquation8, GetParam()); });
  EXPECT_GE(tally.counted, tally.cases * 50);
  expectMost(tally.shares, 0.02, 0.98, "shares without an edge");
}

TEST_P(PictureSuite, ALineThatIsPaintedAloneIsFoundAgain) {
  const Tally tally =
      expectHolds(0.1, [] { return drawCase(PictureProperty::kPaintedAgain, GetParam()); });
  expectEnough(tally.counted, tally, 0.15);
  expectMost(tally.ends_px, 5, 0.9, "ends, px,");
}

TEST_P(PictureSuite, CurvedThingsGiveNoLongLines) {
  const Tally tally = expectHolds(0.5, [] {
    return PictureCase{.property = PictureProperty::kCurved,
                       .camera = *genSmallCamera(GetParam(), kSide),
                       .seed = genSeed()};
  });
  // Pieces of the outlines that are straight enough: few, but not none.
  expectEnough(tally.counted, tally, 0.03);
}

// NaN passes many a comparison: whatever a record holds must be seen to be wrong.
TEST(Pictures, DefectiveRecordsAreSeen) {
  const Camera camera = makeCamera("pinhole", std::array{200.0, 200.0, 159.5, 119.5}, 320, 240);
  std::vector<float> grey(320 * 240, 60);
  for (int y = 60; y < 180; ++y) std::fill_n(grey.begin() + y * 320 + 80, 160, 200.0F);
  const DetectorOptions options;
  const std::vector<DetectedLine> lines = Detector(camera, options)
                                              .detect({.data = grey.data(),
                                                       .width = 320,
                                                       .height = 240,
                                                       .stride_bytes = 320 * sizeof(float),
                                                       .type = PixelType::kF32});
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(defectOf(camera, options, lines), std::nullopt);
  const std::vector<std::function<double*(DetectedLine&)>> values{
      [](DetectedLine& line) { return &line.arc.normal.y(); },
      [](DetectedLine& line) { return &line.arc.from.x(); },
      [](DetectedLine& line) { return &line.arc.to.z(); },
      [](DetectedLine& line) { return &line.from_px.x(); },
      [](DetectedLine& line) { return &line.to_px.y(); },
      [](DetectedLine& line) { return &line.normal_cov(1, 1); },
      [](DetectedLine& line) { return &line.rms_px; },
      [](DetectedLine& line) { return &line.max_px; },
      [](DetectedLine& line) { return &line.length_px; },
      [](DetectedLine& line) { return &line.score; }};
  for (size_t i = 0; i < values.size(); ++i) {
    for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
      std::vector<DetectedLine> defective = lines;
      *values[i](defective[2]) = wrong;
      EXPECT_EQ(defectOf(camera, options, defective), "a value that is no finite number") << i;
    }
  }
  for (size_t i = 0; i < 5; ++i) {  // Those of the geometry fit each other.
    std::vector<DetectedLine> defective = lines;
    *values[i](defective[2]) += 1e-6;
    EXPECT_NE(defectOf(camera, options, defective), std::nullopt) << i;
  }
}

// What is saved is what failed.
TEST(Pictures, CasesRoundTripThroughJson) {
  holds(1, [] {
    const auto property = static_cast<PictureProperty>(*genInt(0, kPicturePropertyCount - 1));
    const TestImageSpec image = *genTestImage(100);
    const Camera drawn = *genAnyCamera(Range::kAdmissible);
    PictureCase c{
        .property = property,
        .camera = Camera(drawn.model(), image.width, image.height, drawn.maxFieldAngleLimit())};
    if (property == PictureProperty::kAnyPicture || property == PictureProperty::kNoise) {
      c.image = image;
    } else {
      c.seed = *rc::gen::arbitrary<uint64_t>();
      c.shapes = static_cast<unsigned>(*genInt(0, 15));
      c.left = *genInt(0, image.width - 1);
      c.amount = *genReal(-7, 7);
      c.inverted = *genInt(0, 1) == 1;
      c.other = *genAnyCamera(Range::kAdmissible);
    }
    const auto json = toJson(c);
    const PictureCase back = pictureCaseFromJson(parseJson(json.dump(), "case"), "case");
    RC_ASSERT(toJson(back) == json);
    RC_ASSERT(back.camera == c.camera && back.other == c.other);
  });
}

}  // namespace
}  // namespace dlsd
