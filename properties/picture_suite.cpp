// The detector on pictures: what must hold for any picture at all, and what must not change when a
// picture is turned, mirrored, shifted, brightened, inverted or seen through another camera.
//
// The pictures are painted by detector/test_scene.h, which shares no code with synth. A property
// tries a tenth of RC_PARAMS' number of cases (at least 10), because a case renders a picture or
// two.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <iostream>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "detector/detector.h"
#include "detector/options.h"
#include "detector/test_scene.h"
#include "properties/gen.h"
#include "properties/gen_image.h"
#include "properties/worst.h"
#include "synth/dataset/random.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Scene;

/// Side of the painted pictures, px.
constexpr int kSide = 360;

/// Runs a property on a share of RC_PARAMS' number of cases; returns how many there were.
template <class Property>
long holds(double share, const Property& property) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::seconds kMostShrinking(5);
  long cases = 0;
  std::string message;
  std::optional<Clock::time_point> first_failure;
  rc::detail::TestParams params = rc::detail::configuration().testParams;
  params.maxSuccess = std::max(10, static_cast<int>(params.maxSuccess * share));
  rc::detail::TestMetadata metadata;
  metadata.id = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  const auto result = rc::detail::checkTestable(
      [&] {
        // RapidCheck shrinks for as long as it likes: later candidates count as no failure.
        if (first_failure && Clock::now() - *first_failure > kMostShrinking) return;
        if (!first_failure) ++cases;
        try {
          property();
        } catch (const rc::detail::CaseResult& failure) {
          if (failure.type == rc::detail::CaseResult::Type::Failure) {
            message = failure.description;
            if (!first_failure) first_failure = Clock::now();
          }
          throw;
        }
      },
      metadata,
      params);
  std::ostringstream text;
  rc::detail::printResultMessage(result, text);
  EXPECT_TRUE(result.template is<rc::detail::SuccessResult>()) << text.str() << message;
  return cases;
}

class PictureSuite : public ::testing::TestWithParam<std::string_view> {};
INSTANTIATE_TEST_SUITE_P(,
                         PictureSuite,
                         ::testing::ValuesIn(cameraModelNames()),
                         [](const auto& test) { return std::string(test.param); });

// --- Any picture ---

/// What is wrong with the lines of a picture, if anything.
std::optional<std::string> defectOf(const Camera& camera,
                                    const DetectorOptions& options,
                                    const std::vector<DetectedLine>& lines) {
  double previous_score = std::numeric_limits<double>::infinity();
  for (const DetectedLine& line : lines) {
    const bool finite = line.arc.normal.allFinite() && line.arc.from.allFinite() &&
                        line.arc.to.allFinite() && line.from_px.allFinite() &&
                        line.to_px.allFinite() && line.normal_cov.allFinite() &&
                        std::isfinite(line.rms_px) && std::isfinite(line.max_px) &&
                        std::isfinite(line.length_px) && std::isfinite(line.score);
    if (!finite) return "a value that is no finite number";
    if (!(std::abs(line.arc.normal.norm() - 1) <= 1e-12)) return "a normal that is no unit vector";
    if (!(std::abs(line.arc.normal.dot(line.arc.from)) <= 1e-12)) return "a start off the plane";
    if (!(std::abs(line.arc.normal.dot(line.arc.to)) <= 1e-12)) return "an end off the plane";
    if (camera.project(line.arc.from) != line.from_px) return "a start that is not its ray's pixel";
    if (camera.project(line.arc.to) != line.to_px) return "an end that is not its ray's pixel";
    if (!camera.inImage(line.from_px) || !camera.inImage(line.to_px)) return "an end off the image";
    if (!(line.rms_px <= line.max_px)) return "rms > max";
    if (!(line.max_px <= 2 * options.validation.rho_px)) return "a residual of more than 2 rho";
    if (!(line.length_px > 0)) return "no length";
    if (line.polarity != 1 && line.polarity != -1) return "no polarity";
    if (!(line.score <= previous_score)) return "scores that rise";
    previous_score = line.score;
    if (imageSpans(camera, line.arc).size() != 1) return "an arc that leaves the image";
  }
  return std::nullopt;
}

bool same(const DetectedLine& a, const DetectedLine& b) {
  return a.arc.normal == b.arc.normal && a.arc.from == b.arc.from && a.arc.to == b.arc.to &&
         a.from_px == b.from_px && a.to_px == b.to_px && a.normal_cov == b.normal_cov &&
         a.rms_px == b.rms_px && a.max_px == b.max_px && a.length_px == b.length_px &&
         a.score == b.score && a.polarity == b.polarity;
}

// Any picture of any size and type, any valid camera: finite, consistent records, the same ones
// from the same detector and from another one, and the caller's bytes untouched.
TEST_P(PictureSuite, AnyPictureIsAnswered) {
  long lines_seen = 0;
  const long cases = holds(0.5, [&] {
    const TestImage image = *genTestImage(160);
    const bool odd = *genInt(0, 3) == 3;
    const Camera drawn = *genCamera(GetParam(), odd ? Range::kAdmissible : Range::kRealistic);
    const double factor = static_cast<double>(std::max(image.width, image.height)) /
                          std::max(drawn.width(), drawn.height());
    // Parameters in px that are scaled with their powers may leave their range.
    const bool scaled = !odd && GetParam() != Ocam::kName && *genInt(0, 1) == 0;
    const Camera camera =
        scaled ? scaledCamera(drawn, factor, image.width, image.height)
               : Camera(drawn.model(), image.width, image.height, drawn.maxFieldAngleLimit());
    const DetectorOptions options =
        *genInt(0, 3) == 3 ? DetectorOptions::paper() : DetectorOptions{};
    const TestImage before = image;
    Detector detector(camera, options);
    const std::vector<DetectedLine> first = detector.detect(image.view());
    const std::vector<DetectedLine> second = detector.detect(image.view());
    const std::vector<DetectedLine> third = Detector(camera, options).detect(image.view());
    RC_ASSERT(before.bytes == image.bytes);
    RC_ASSERT(first.size() == second.size() && first.size() == third.size());
    for (size_t i = 0; i < first.size(); ++i) {
      RC_ASSERT(same(first[i], second[i]) && same(first[i], third[i]));
    }
    if (const auto defect = defectOf(camera, options, first)) RC_FAIL(*defect);
    lines_seen += static_cast<long>(first.size());
  });
  std::cout << "    " << lines_seen << " lines in " << cases << " pictures\n";
  EXPECT_GT(lines_seen, cases / 4);
}

// At most one line of 40 px per picture on average, and no more than 3 of any length.
TEST(Pictures, NoiseIsNoLine) {
  long pictures = 0, lines = 0, long_lines = 0;
  holds(1, [&] {
    const Camera camera = *genSmallCamera(*rc::gen::elementOf(cameraModelNames()), 640);
    RC_PRE(camera.width() >= 60 && camera.height() >= 60);
    constexpr std::array<Fill, 3> kFills{
        Fill::kWhiteNoise, Fill::kBlurredNoise, Fill::kSaltAndPepper};
    const Fill fill = kFills[static_cast<size_t>(*genInt(0, 2))];
    const auto seed = static_cast<uint64_t>(*genInt(0, 1 << 30));
    // Below 0.3 grey levels, 8 bits leave contours of equal values and not noise.
    const double sigma = *genReal(0.3, 60), blur_px = *genReal(0, 1.5);
    const bool poisson = fill == Fill::kWhiteNoise && *genInt(0, 1) == 1;
    std::vector<float> grey = filled(fill, camera.width(), camera.height(), seed, sigma, blur_px);
    if (poisson) {
      // Shot noise of `sigma` electrons at 128, as good as normal there.
      const Random random(seed, 9);
      for (size_t i = 0; i < grey.size(); ++i) {
        grey[i] = static_cast<float>(
            std::clamp(128 + 128 / std::sqrt(sigma + 1) * random.normal(i), 0.0, 255.0));
      }
    }
    std::vector<uint8_t> bytes(grey.size());
    std::transform(grey.begin(), grey.end(), bytes.begin(), [](float value) {
      return static_cast<uint8_t>(std::lround(value));
    });
    Detector detector(camera);
    ++pictures;
    for (const DetectedLine& line : detector.detect(test::viewOf(bytes, camera))) {
      ++lines;
      long_lines += line.length_px >= 40 ? 1 : 0;
    }
  });
  std::cout << "    " << pictures << " pictures, " << lines << " lines, " << long_lines
            << " of 40 px\n";
  EXPECT_GE(pictures, 100);
  EXPECT_LE(long_lines, pictures);
  EXPECT_LE(lines, 3 * pictures);
}

// --- The same lines in a changed picture ---

/// A line and its image.
struct Seen {
  DetectedLine line;
  std::vector<Vector2d> curve;
};

std::vector<Seen> detectIn(const Camera& camera, const std::vector<float>& grey) {
  Detector detector(camera);
  const ImageView view{grey.data(),
                       camera.width(),
                       camera.height(),
                       1,
                       static_cast<ptrdiff_t>(sizeof(float)) * camera.width(),
                       PixelType::kF32,
                       false};
  std::vector<Seen> result;
  for (const DetectedLine& line : detector.detect(view)) {
    result.push_back({line, imageCurve(camera, line.arc, 0, 1, 0.02)});
  }
  return result;
}

float bilinear(const std::vector<float>& grey, int width, int height, const Vector2d& p) {
  const int x = std::clamp(static_cast<int>(std::floor(p.x())), 0, width - 2);
  const int y = std::clamp(static_cast<int>(std::floor(p.y())), 0, height - 2);
  const auto fx = static_cast<float>(p.x() - x), fy = static_cast<float>(p.y() - y);
  const float* row =
      grey.data() + static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  return (1 - fy) * ((1 - fx) * row[0] + fx * row[1]) +
         fy * ((1 - fx) * row[width] + fx * row[width + 1]);
}

/// Least contrast of the picture across a line, 3 px to each side, its ends left out.
double contrastAlong(const std::vector<float>& grey, const Camera& camera, const Arc& arc) {
  double least = std::numeric_limits<double>::infinity();
  for (const double t : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    const auto p = camera.project(arc.at(t)), q = camera.project(arc.at(t + 0.01));
    if (!p || !q) return 0;
    const Vector2d along = (*q - *p).normalized(), across(-along.y(), along.x());
    least = std::min(least,
                     static_cast<double>(std::abs(
                         bilinear(grey, camera.width(), camera.height(), *p + 3 * across) -
                         bilinear(grey, camera.width(), camera.height(), *p - 3 * across))));
  }
  return least;
}

/// Whether nothing disturbs a line: 60 px long, of 25 grey levels, 10 px from all other lines and
/// from border and rim, what is within 15 px of its own ends left out.
bool isIsolated(const Seen& seen,
                const std::vector<Seen>& all,
                const Camera& camera,
                const std::vector<float>& grey) {
  if (!(seen.line.length_px >= 60) || seen.curve.size() < 2) return false;
  constexpr double kClear = 10, kCorner = 15;
  const auto atEnd = [&](const Vector2d& p) {
    return std::min((p - seen.line.from_px).norm(), (p - seen.line.to_px).norm()) < kCorner;
  };
  std::vector<Vector2d> samples;
  const int count = static_cast<int>(seen.line.length_px / 4);
  for (int i = 0; i <= count; ++i) {
    if (const auto p = camera.project(seen.line.arc.at(static_cast<double>(i) / count))) {
      samples.push_back(*p);
    }
  }
  for (const Vector2d& p : samples) {
    for (int k = 0; k < 8; ++k) {
      const Vector2d q = p + kClear * Vector2d(std::cos(k * M_PI / 4), std::sin(k * M_PI / 4));
      if (!camera.inImage(q) || !camera.unproject(q)) return false;
    }
  }
  for (const Seen& other : all) {
    if (&other == &seen || other.curve.size() < 2) continue;
    for (const Vector2d& p : samples) {
      if (!atEnd(p) && !(test::distanceToPolyline(p, other.curve) >= kClear)) return false;
    }
  }
  return contrastAlong(grey, camera, seen.line.arc) >= 25;
}

/// How a picture was changed: where its pixels went.
using PixelMap = std::function<Vector2d(const Vector2d&)>;

struct Match {
  double across_px, ends_px;
  const Seen* line;
};

/// The line of the changed picture that is nearest to a line of the first, by the distance of 21
/// points of that one across, and of the ends.
Match nearest(const Seen& seen,
              const Camera& camera,
              const PixelMap& forward,
              const std::vector<Seen>& changed,
              const Camera& changed_camera) {
  Match best{std::numeric_limits<double>::infinity(), 0, nullptr};
  for (const Seen& candidate : changed) {
    double across = 0;
    for (int i = 0; i <= 20; ++i) {
      const auto p = camera.project(seen.line.arc.at(i / 20.0));
      const auto ray = p ? changed_camera.unproject(forward(*p)) : std::nullopt;
      const auto J = ray ? changed_camera.jacobian(*ray) : std::nullopt;
      if (!J) {
        across = std::numeric_limits<double>::infinity();
        break;
      }
      // Px per rad across the line: that of the direction of the normal.
      const Vector3d& n = candidate.line.arc.normal;
      const Vector3d tangent = n.cross(*ray).normalized(), side = ray->cross(tangent);
      const Vector2d along_px = (*J * tangent).normalized(), side_px = *J * side;
      const double scale = std::abs(side_px.x() * along_px.y() - side_px.y() * along_px.x());
      across = std::max(across, std::abs(candidate.line.arc.angleToPlane(*ray)) * scale);
    }
    if (!(across < best.across_px)) continue;
    const Vector2d a = forward(seen.line.from_px), b = forward(seen.line.to_px);
    const Vector2d &c = candidate.line.from_px, &d = candidate.line.to_px;
    const double ends = std::min(std::max((a - c).norm(), (b - d).norm()),
                                 std::max((a - d).norm(), (b - c).norm()));
    best = {across, ends, &candidate};
  }
  return best;
}

struct Tally {
  Worst across, ends;
  long isolated = 0, near_ends = 0;
  explicit Tally(const std::string& what)
      : across(what + ", across, px"), ends(what + ", at the ends, px") {}
};

/// The goal for the ends is 2 px for every line. It is not reached: which pixel a line ends at
/// before a corner depends on the direction in which the detector walked, so that of lines in
/// mirrored pictures about one in six is off by up to 4.4 px (in shifted, brighter or inverted
/// pictures nearly none).
constexpr double kAcrossPx = 0.1, kEndsPx = 2, kMostEndsPx = 5, kNearEnds = 0.7;

void expectEnough(const Tally& tally, long cases) {
  // Some views are too narrow for an isolated line of 60 px.
  EXPECT_GE(tally.isolated, std::max(1L, cases / 40));
  EXPECT_GE(static_cast<double>(tally.near_ends), kNearEnds * static_cast<double>(tally.isolated));
  std::cout << "    " << tally.near_ends << "/" << tally.isolated << " isolated lines end within "
            << kEndsPx << " px\n";
}

/// Every isolated line of the first picture is there in the changed one, and nothing but its place
/// has changed. `sign`: of the polarity.
void expectSameLines(const Camera& camera,
                     const std::vector<float>& grey,
                     const Camera& changed_camera,
                     const std::vector<float>& changed_grey,
                     const PixelMap& forward,
                     const std::function<Vector3d(const Vector3d&)>& turn,
                     int sign,
                     Tally* tally) {
  const std::vector<Seen> lines = detectIn(camera, grey);
  const std::vector<Seen> changed = detectIn(changed_camera, changed_grey);
  for (const Seen& seen : lines) {
    if (!isIsolated(seen, lines, camera, grey)) continue;
    ++tally->isolated;
    const Match match = nearest(seen, camera, forward, changed, changed_camera);
    std::ostringstream where;
    where << "line from " << seen.line.from_px.transpose() << " to " << seen.line.to_px.transpose()
          << ", " << match.across_px << " px across, " << match.ends_px << " px at the ends";
    if (match.line == nullptr || !(match.across_px <= kAcrossPx) ||
        !(match.ends_px <= kMostEndsPx)) {
      RC_FAIL(where.str());
    }
    tally->across.see(match.across_px);
    tally->ends.see(match.ends_px);
    tally->near_ends += match.ends_px <= kEndsPx ? 1 : 0;
    const double side = turn(seen.line.arc.normal).dot(match.line->line.arc.normal);
    const int polarity = side > 0 ? match.line->line.polarity : -match.line->line.polarity;
    if (polarity != sign * seen.line.polarity) RC_FAIL("polarity: " + where.str());
  }
}

Vector3d unchanged(const Vector3d& ray) {
  return ray;
}

struct Picture {
  Camera camera;
  std::vector<float> grey;
  uint64_t seed;
};
Scene sceneFor(const Camera& camera, uint64_t seed, int polygons = 4) {
  return test::randomScene(seed, polygons, 0, std::min(imageFieldAngle(camera), 1.75));
}

Picture drawPicture(const Camera& camera) {
  const auto seed = static_cast<uint64_t>(*genInt(0, 1 << 30));
  return {camera, test::render(sceneFor(camera, seed), camera), seed};
}

double& param(std::vector<double>& params, const Camera& camera, std::string_view name) {
  const auto specs = camera.paramSpecs();
  const auto found =
      std::find_if(specs.begin(), specs.end(), [&](const ParamSpec& s) { return s.name == name; });
  RC_ASSERT(found != specs.end());
  return params[static_cast<size_t>(found - specs.begin())];
}
bool hasParam(const Camera& camera, std::string_view name) {
  const auto specs = camera.paramSpecs();
  return std::any_of(
      specs.begin(), specs.end(), [&](const ParamSpec& s) { return s.name == name; });
}
Camera with(const Camera& camera, const std::vector<double>& params, int width, int height) {
  return makeCamera(camera.modelName(), params, width, height, camera.maxFieldAngleLimit());
}

/// The camera behind a mirror: column u becomes column width - 1 - u.
Camera mirrored(const Camera& camera) {
  std::vector<double> p = camera.params();
  double& cx = param(p, camera, "cx");
  cx = camera.width() - 1 - cx;
  for (const std::string_view odd : {"p2", "skew", "d", "e"}) {
    if (hasParam(camera, odd)) param(p, camera, odd) *= -1;
  }
  return with(camera, p, camera.width(), camera.height());
}

/// Without what has no counterpart when rows and columns change places.
Camera withoutShear(const Camera& camera) {
  std::vector<double> p = camera.params();
  for (const std::string_view name : {"skew", "d", "e"}) {
    if (hasParam(camera, name)) param(p, camera, name) = 0;
  }
  for (const std::string_view name : {"c", "aspect"}) {
    if (hasParam(camera, name)) param(p, camera, name) = 1;
  }
  return with(camera, p, camera.width(), camera.height());
}

/// Rows and columns have changed places.
Camera transposed(const Camera& camera) {
  std::vector<double> p = camera.params();
  std::swap(param(p, camera, "cx"), param(p, camera, "cy"));
  if (hasParam(camera, "fy")) std::swap(param(p, camera, "fx"), param(p, camera, "fy"));
  if (hasParam(camera, "p1")) std::swap(param(p, camera, "p1"), param(p, camera, "p2"));
  return with(camera, p, camera.height(), camera.width());
}

std::vector<float> remapped(const std::vector<float>& grey,
                            int width,
                            int height,
                            int new_width,
                            int new_height,
                            const PixelMap& forward) {
  std::vector<float> result(static_cast<size_t>(new_width) * static_cast<size_t>(new_height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vector2d p = forward(Vector2d(x, y));
      result[static_cast<size_t>(p.y()) * static_cast<size_t>(new_width) +
             static_cast<size_t>(p.x())] =
          grey[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
    }
  }
  return result;
}

// Isolated lines of a mirrored picture are the mirrored lines.
TEST_P(PictureSuite, AMirroredPictureHasTheMirroredLines) {
  Tally tally("mirrored");
  const long cases = holds(0.1, [&] {
    const Picture picture = drawPicture(*genSmallCamera(GetParam(), kSide));
    const Camera& camera = picture.camera;
    const int w = camera.width(), h = camera.height();
    const PixelMap forward = [w](const Vector2d& p) { return Vector2d(w - 1 - p.x(), p.y()); };
    expectSameLines(
        camera,
        picture.grey,
        mirrored(camera),
        remapped(picture.grey, w, h, w, h, forward),
        forward,
        [](const Vector3d& n) { return Vector3d(-n.x(), n.y(), n.z()); },
        1,
        &tally);
  });
  expectEnough(tally, cases);
}

// Isolated lines of a picture with rows and columns exchanged (with mirroring: of a picture turned
// by 90 degrees) are those lines. Not for panoramas, whose two directions differ.
TEST_P(PictureSuite, ATransposedPictureHasTheTransposedLines) {
  if (GetParam() == Equirectangular::kName) GTEST_SKIP() << "longitude is not latitude";
  Tally tally("transposed");
  const long cases = holds(0.1, [&] {
    const Picture picture = drawPicture(withoutShear(*genSmallCamera(GetParam(), kSide)));
    const Camera& camera = picture.camera;
    const int w = camera.width(), h = camera.height();
    const PixelMap forward = [](const Vector2d& p) { return Vector2d(p.y(), p.x()); };
    expectSameLines(
        camera,
        picture.grey,
        transposed(camera),
        remapped(picture.grey, w, h, h, w, forward),
        forward,
        [](const Vector3d& n) { return Vector3d(n.y(), n.x(), n.z()); },
        1,
        &tally);
  });
  expectEnough(tally, cases);
}

// A part of the picture, seen by the camera with its principal point moved, has the lines that lie
// in it.
TEST_P(PictureSuite, APartOfThePictureHasItsLines) {
  Tally tally("shifted");
  const long cases = holds(0.2, [&] {
    const Picture picture = drawPicture(*genSmallCamera(GetParam(), kSide));
    const Camera& camera = picture.camera;
    const int left = *genInt(0, camera.width() / 4), top = *genInt(0, camera.height() / 4);
    const int w = camera.width() - left, h = camera.height() - top;
    const PixelMap forward = [=](const Vector2d& p) { return Vector2d(p.x() - left, p.y() - top); };
    std::vector<float> part;
    for (int y = top; y < camera.height(); ++y) {
      const auto row = picture.grey.begin() + static_cast<ptrdiff_t>(y) * camera.width();
      part.insert(part.end(), row + left, row + camera.width());
    }
    // From the part to the whole: a line of the part that is isolated there has nothing near it in
    // the whole either, but what is cut off.
    const PixelMap backward = [=](const Vector2d& p) {
      return Vector2d(p.x() + left, p.y() + top);
    };
    expectSameLines(croppedCamera(camera, left, top, w, h),
                    part,
                    camera,
                    picture.grey,
                    backward,
                    unchanged,
                    1,
                    &tally);
  });
  expectEnough(tally, cases);
}

// Brighter or darker, of more or less contrast or inverted: the same isolated lines.
TEST_P(PictureSuite, BrightnessContrastAndInversionDoNotMatter) {
  Tally tally("other grey levels");
  const long cases = holds(0.1, [&] {
    const Picture picture = drawPicture(*genSmallCamera(GetParam(), kSide));
    const bool inverted = *genInt(0, 1) == 1;
    const auto gain = static_cast<float>(*genReal(0.6, 1));
    const auto offset = static_cast<float>(*genReal(0, 255 * (1 - static_cast<double>(gain))));
    std::vector<float> changed = picture.grey;
    for (float& value : changed) value = offset + gain * (inverted ? 255 - value : value);
    expectSameLines(
        picture.camera,
        picture.grey,
        picture.camera,
        changed,
        [](const Vector2d& p) { return p; },
        unchanged,
        inverted ? -1 : 1,
        &tally);
  });
  expectEnough(tally, cases);
}

// What is straight in a picture is so for every pinhole: another focal length and principal point
// give the same lines in pixels.
TEST(Pictures, AllPinholesSeeTheSameLines) {
  Tally tally("another pinhole");
  const long cases = holds(0.2, [&] {
    const Picture picture = drawPicture(*genSmallCamera("pinhole", kSide));
    const Camera& camera = picture.camera;
    const Camera other(Pinhole{*genReal(150, 2000),
                               *genReal(150, 2000),
                               *genReal(0, camera.width()),
                               *genReal(0, camera.height())},
                       camera.width(),
                       camera.height());
    const std::vector<Seen> lines = detectIn(camera, picture.grey);
    const std::vector<Seen> others = detectIn(other, picture.grey);
    for (const Seen& seen : lines) {
      if (!isIsolated(seen, lines, camera, picture.grey)) continue;
      ++tally.isolated;
      const Match match = nearest(
          seen, camera, [](const Vector2d& p) { return p; }, others, other);
      if (!(match.across_px <= kAcrossPx) || !(match.ends_px <= kMostEndsPx)) {
        std::ostringstream text;
        text << seen.line.from_px.transpose() << " to " << seen.line.to_px.transpose() << ": "
             << match.across_px << ", " << match.ends_px << " px, other camera " << other;
        RC_FAIL(text.str());
      }
      tally.across.see(match.across_px);
      tally.ends.see(match.ends_px);
      tally.near_ends += match.ends_px <= kEndsPx ? 1 : 0;
    }
  });
  expectEnough(tally, cases);
}

// The same scene from the same place through two cameras: each isolated line of the one is an arc
// of the other, where that one sees it whole.
TEST_P(PictureSuite, AnotherCameraSeesTheSameArcs) {
  Worst worst("angle to the other camera's plane, in units of 0.15 px of the coarser camera");
  long isolated = 0;
  const long cases = holds(0.2, [&] {
    const Camera first = *genSmallCamera(GetParam(), kSide);
    const Camera second = *genSmallCamera("kannala_brandt", kSide);
    const auto seed = static_cast<uint64_t>(*genInt(0, 1 << 30));
    const double angle = std::min({imageFieldAngle(first), imageFieldAngle(second), 1.75});
    const Scene scene = test::randomScene(seed, 4, 0, angle);
    const std::vector<float> a = test::render(scene, first), b = test::render(scene, second);
    const std::vector<Seen> lines = detectIn(first, a), others = detectIn(second, b);
    for (const Seen& seen : lines) {
      if (!isIsolated(seen, lines, first, a)) continue;
      const Arc& arc = seen.line.arc;
      const Vector3d forward = arc.from.cross(arc.to).normalized();
      const auto share = [&](const Vector3d& ray) {
        return std::atan2(arc.from.cross(ray).dot(forward), arc.from.dot(ray)) / arc.angle();
      };
      // The other camera's line along its middle half, if that has one.
      const Seen* there = nullptr;
      double best = std::numeric_limits<double>::infinity(), allowed = 0;
      for (const Seen& other : others) {
        if (other.line.length_px < 40) continue;
        double t0 = share(other.line.arc.from), t1 = share(other.line.arc.to);
        if (t0 > t1) std::swap(t0, t1);
        if (!(t0 < 0.25 && t1 > 0.75 && t1 - t0 < 1.5)) continue;
        double off = 0, coarsest = 0;
        for (const double t : {0.25, 0.5, 0.75}) {
          const Vector3d ray = arc.at(t);
          off = std::max(off, std::abs(other.line.arc.angleToPlane(ray)));
          for (const Camera* camera : {&first, &second}) {
            const auto J = camera->jacobian(ray);
            if (!J) continue;
            const Eigen::JacobiSVD<ProjectionJacobian> svd(*J);
            coarsest = std::max(coarsest, 1 / svd.singularValues()(1));
          }
        }
        if (off < best) {
          best = off;
          allowed = 0.15 * coarsest;
          there = &other;
        }
      }
      // Else it is a line of another edge, and this one is not seen there.
      if (there == nullptr || best > 20 * allowed) continue;
      ++isolated;
      worst.see(best / allowed);
      if (!(best <= allowed)) {
        std::ostringstream text;
        text << first << " and " << second << ", scene " << seed << ": " << best << " of "
             << allowed << " rad, line from " << seen.line.from_px.transpose() << " to "
             << seen.line.to_px.transpose();
        RC_FAIL(text.str());
      }
    }
  });
  EXPECT_GE(isolated, std::max(1L, cases / 40));
}

// --- What lines say ---

// Every line's whole curve lies on an edge of the picture: sought across the curve pixel by pixel
// without the detector's code, the slope of the grey levels has a maximum within rho, except over
// gaps of a tenth of the line. Lines of at least 60 px, 3 px from the border.
TEST_P(PictureSuite, EveryPixelOfALineKeepsEquation8) {
  Worst gaps("share of a line without an edge within rho");
  long points = 0;
  const long cases = holds(0.1, [&] {
    const Picture picture = drawPicture(*genSmallCamera(GetParam(), kSide));
    const Camera& camera = picture.camera;
    const double rho_px = DetectorOptions{}.validation.rho_px;
    const int w = camera.width(), h = camera.height();
    for (const Seen& seen : detectIn(camera, picture.grey)) {
      if (seen.line.length_px < 60) continue;  // Corners are much of the shorter ones.
      const int count = std::max(10, static_cast<int>(seen.line.length_px));
      int on_edge = 0, asked = 0;
      for (int i = 1; i < count; ++i) {
        const double t = static_cast<double>(i) / count;
        const auto p = camera.project(seen.line.arc.at(t));
        const auto q = camera.project(seen.line.arc.at(std::min(1.0, t + 0.2 / count)));
        if (!p || !q || (*q - *p).norm() == 0) continue;
        if (std::min({p->x(), p->y(), w - 1 - p->x(), h - 1 - p->y()}) < 3) continue;
        const Vector2d along = (*q - *p).normalized(), across(-along.y(), along.x());
        // The slope across has a maximum within rho.
        const auto slopeAt = [&](double shift) {
          return std::abs(
              static_cast<double>(bilinear(picture.grey, w, h, *p + (shift + 0.5) * across) -
                                  bilinear(picture.grey, w, h, *p + (shift - 0.5) * across)));
        };
        bool found = false;
        for (int k = -10; k <= 10 && !found; ++k) {
          const double shift = 0.1 * k * rho_px, here = slopeAt(shift);
          found = here > 0.5 && here >= slopeAt(shift - 0.7) && here >= slopeAt(shift + 0.7);
        }
        ++asked;
        on_edge += found ? 1 : 0;
      }
      if (asked == 0) continue;
      points += asked;
      const double off = 1 - static_cast<double>(on_edge) / asked;
      gaps.see(off);
      if (!(off <= 0.1)) {
        std::ostringstream text;
        text << off << " of the line from " << seen.line.from_px.transpose() << " to "
             << seen.line.to_px.transpose() << " has no edge within rho";
        RC_FAIL(text.str());
      }
    }
  });
  EXPECT_GE(points, cases * 100);
}

// A line that was found, painted alone as the edge between two grey levels, is found again.
TEST_P(PictureSuite, ALineThatIsPaintedAloneIsFoundAgain) {
  // A line ends some pixels before a corner, and the painted one has its corners where it ended.
  constexpr double kPaintedEnds = 0.15, kPaintedAcrossPx = 0.2;  // Share of its length.
  Tally tally("painted alone");
  const long cases = holds(0.1, [&] {
    const Picture picture = drawPicture(*genSmallCamera(GetParam(), kSide));
    const Camera& camera = picture.camera;
    const std::vector<Seen> lines = detectIn(camera, picture.grey);
    int painted = 0;
    for (const Seen& seen : lines) {
      if (!isIsolated(seen, lines, camera, picture.grey) || painted == 2) continue;
      ++painted;
      ++tally.isolated;
      // A triangle: the line, and a corner to one side of it.
      const Arc& arc = seen.line.arc;
      const Vector3d middle = arc.at(0.5);
      const double height = std::min(0.6 * arc.angle(), 0.5);
      Vector3d tip = (std::cos(height) * middle + std::sin(height) * arc.normal).normalized();
      std::vector<Vector3d> corners{arc.from, arc.to, tip};
      if (arc.from.cross(arc.to).dot(tip) < 0) std::swap(corners[0], corners[1]);
      Scene scene;
      scene.background = 60;
      scene.shapes.push_back({corners, (arc.from + arc.to + tip).normalized(), 1, 200});
      const std::vector<Seen> again = detectIn(camera, test::render(scene, camera));
      const Match match = nearest(
          seen, camera, [](const Vector2d& p) { return p; }, again, camera);
      if (!(match.across_px <= kPaintedAcrossPx) ||
          !(match.ends_px <= kPaintedEnds * seen.line.length_px)) {
        std::ostringstream text;
        text << seen.line.from_px.transpose() << " to " << seen.line.to_px.transpose() << ": "
             << match.across_px << ", " << match.ends_px << " px";
        RC_FAIL(text.str());
      }
      tally.across.see(match.across_px);
      tally.ends.see(match.ends_px);
      tally.near_ends += match.ends_px <= kEndsPx ? 1 : 0;
    }
  });
  EXPECT_GE(tally.isolated, std::max(1L, cases / 40));
}

// Discs and ellipses (cones through any camera) give no line longer than the longest arc of them
// that a great circle fits within 0.5 px.
TEST_P(PictureSuite, CurvedThingsGiveNoLongLines) {
  Worst worst("length over that of the longest arc that a plane fits within 0.5 px");
  long lines_seen = 0;
  const long cases = holds(0.1, [&] {
    const Camera camera = *genSmallCamera(GetParam(), kSide);
    const auto seed = static_cast<uint64_t>(*genInt(0, 1 << 30));
    Scene scene = test::randomScene(seed, 0, 1, std::min(imageFieldAngle(camera), 1.75));
    const test::Shape& cone = scene.shapes[0];
    RC_PRE(std::abs(cone.grey - scene.background) >= 25);
    const std::vector<Seen> lines = detectIn(camera, test::render(scene, camera));
    // The outline, and px per rad across it.
    constexpr int kPoints = 720;
    const Vector3d a = cone.axis.unitOrthogonal(), b = cone.axis.cross(a);
    const double sine = std::sqrt(1 - cone.cos_radius * cone.cos_radius);
    std::vector<Vector3d> rays;
    std::vector<std::optional<Vector2d>> pixels;
    std::vector<double> scales;
    for (int i = 0; i < kPoints; ++i) {
      const double t = 2 * M_PI * i / kPoints;
      rays.push_back(cone.cos_radius * cone.axis + sine * (std::cos(t) * a + std::sin(t) * b));
      auto p = camera.project(rays.back());
      const auto J = p ? camera.jacobian(rays.back()) : std::nullopt;
      scales.push_back(J ? Eigen::JacobiSVD<ProjectionJacobian>(*J).singularValues()(1) : 0.0);
      pixels.push_back(J && camera.inImage(*p) ? p : std::nullopt);
    }
    // The longest run of outline points that lie within 0.5 px of the plane through the run's
    // quarter points (which halves the sagitta), by two pointers.
    double longest = 0;
    for (int i = 0; i < kPoints; ++i) {
      double length = 0;
      for (int n = 1; n < kPoints; ++n) {
        const auto index = [&](int k) { return static_cast<size_t>((i + k) % kPoints); };
        if (!pixels[index(n - 1)] || !pixels[index(n)]) break;
        length += (*pixels[index(n)] - *pixels[index(n - 1)]).norm();
        if (n < 4) continue;
        // Between the chord's plane and the tangent plane in its middle.
        const Vector3d chord = rays[index(0)].cross(rays[index(n)]).normalized();
        const double sagitta =
            std::abs(std::asin(std::clamp(chord.dot(rays[index(n / 2)]), -1.0, 1.0))) *
            scales[index(n / 2)];
        if (sagitta > 2 * 0.5) break;
        longest = std::max(longest, length);
      }
    }
    for (const Seen& seen : lines) {
      ++lines_seen;
      // Shorter lines than the detector's least length of 15 px and a little say nothing.
      const double allowed = std::max(longest, 20.0);
      worst.see(seen.line.length_px / allowed);
      if (!(seen.line.length_px <= allowed)) {
        std::ostringstream text;
        text << camera << ", scene " << seed << ": " << seen.line.length_px << " px where "
             << longest << " are straight";
        RC_FAIL(text.str());
      }
    }
  });
  std::cout << "    " << lines_seen << " lines in " << cases << " pictures\n";
}

}  // namespace
}  // namespace dlsd
