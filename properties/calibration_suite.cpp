// Any camera in every format of calibration files: what a format can say is read back as the same
// camera, what it cannot say is refused, and nothing in between.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "cameras/calibration/calibration.h"
#include "properties/gen.h"
#include "properties/holds.h"

namespace dlsd {
namespace {

/// The models that a format has words for (docs/calibration-files.md).
const std::map<std::string_view, std::vector<std::string_view>> kModels{
    {"opencv", {"pinhole", "pinhole_radtan", "kannala_brandt", "omni", "omni_radtan"}},
    {"opencv-fisheye", {"kannala_brandt"}},
    {"opencv-omnidir", {"omni", "omni_radtan"}},
    {"opencv-pinhole", {"pinhole", "pinhole_radtan"}},
    {"colmap", {"pinhole", "fov", "kannala_brandt", "pinhole_radtan", "eucm", "equirectangular"}},
    {"basalt", {"pinhole", "fov", "kannala_brandt", "omni", "eucm", "double_sphere"}},
    {"ros", {"pinhole", "pinhole_radtan", "kannala_brandt"}}};

/// A camera of this model whose parameters are, one in four, 0 where that is allowed: formats leave
/// zeros away, and read what is left away as zero.
Camera drawCamera(std::string_view model) {
  const Range range = *rc::gen::element(Range::kRealistic, Range::kAdmissible);
  const Camera camera = *genCamera(model, range);
  std::vector<double> params = camera.params();
  for (size_t i = 0; i < params.size(); ++i) {
    const ParamSpec& spec = camera.paramSpecs()[i];
    if (spec.min <= 0 && spec.max >= 0 && *rc::gen::inRange(0, 4) == 0) params[i] = 0;
  }
  const double limit = *rc::gen::inRange(0, 2) == 0 ? M_PI : *genReal(1e-3, M_PI);
  try {
    return makeCamera(model, params, camera.width(), camera.height(), limit);
  } catch (const std::invalid_argument&) {
    return camera;  // The zeros broke a joint condition.
  }
}

/// Equal, or the simpler model that the format has the same word for.
bool sameOrSimpler(const Camera& written, const Camera& read) {
  if (written == read) return true;
  if (written.modelName() != std::string(read.modelName()) + "_radtan" ||
      written.width() != read.width() || written.height() != read.height() ||
      written.maxFieldAngleLimit() != read.maxFieldAngleLimit()) {
    return false;
  }
  std::vector<double> padded = read.params();
  padded.resize(written.params().size(), 0);
  return padded == written.params();
}

bool equalTo(const Camera& a, const Camera& b, double relative) {
  if (a.modelName() != b.modelName() || a.width() != b.width() || a.height() != b.height() ||
      a.maxFieldAngleLimit() != b.maxFieldAngleLimit()) {
    return false;
  }
  for (size_t i = 0; i < a.params().size(); ++i) {
    if (!(std::abs(a.params()[i] - b.params()[i]) <= relative * std::abs(a.params()[i]))) {
      return false;
    }
  }
  return true;
}

class CalibrationSuite : public ::testing::TestWithParam<std::string_view> {};

TEST_P(CalibrationSuite, EachFormatGivesBackTheSameCameraOrRefuses) {
  const std::string_view model = GetParam();
  std::map<std::string_view, int> written, refused;
  const long draws = holds(1, [&] {
    const std::string name = "cam" + std::to_string(*rc::gen::inRange(0, 1'000'000'000));
    const Camera camera = drawCamera(model);
    for (const CalibrationFormat& format : calibrationFormats()) {
      std::string text;
      try {
        text = calibrationText({{name, camera}}, format.name);
      } catch (const std::invalid_argument&) {
        RC_ASSERT(format.name != "kalibr");
        ++refused[format.name];
        continue;
      }
      ++written[format.name];
      const LoadedCalibration loaded = parseCalibration(text, "f");
      RC_ASSERT(format.name.starts_with(loaded.format));
      RC_ASSERT(loaded.cameras.size() == 1U);
      const Camera& read = loaded.cameras[0].camera;
      if (format.name == "kalibr" || format.name == "colmap") {
        RC_ASSERT(loaded.cameras[0].name == name);
        RC_ASSERT(read == camera);
      } else if (format.name == "basalt" && model == "omni") {
        RC_ASSERT(equalTo(camera, read, 1e-12));
      } else {
        RC_ASSERT(sameOrSimpler(camera, read));
      }
    }
  });
  EXPECT_GE(draws, 40);
  for (const auto& [format, models] : kModels) {
    const bool has_words = std::find(models.begin(), models.end(), model) != models.end();
    // COLMAP alone has no words for a limit of the field angle, nor for parts of the sphere.
    if (format == "colmap" && model == "equirectangular") continue;
    if (!has_words) {
      EXPECT_EQ(written[format], 0) << format;
    } else if (format == "colmap") {
      EXPECT_GE(written[format], draws / 8) << format;
    } else {
      EXPECT_EQ(refused[format], 0) << format;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models,
                         CalibrationSuite,
                         ::testing::ValuesIn(cameraModelNames()),
                         [](const auto& model) { return std::string(model.param); });

// Several cameras keep their order and, where a format has them, their numbers.
TEST(CalibrationSuite, SeveralCamerasKeepTheirOrder) {
  holds(1, [] {
    const std::vector<std::string_view> all = cameraModelNames();
    std::vector<NamedCamera> cameras;
    const int count = *rc::gen::inRange(1, 8);
    for (int i = 0; i < count; ++i) {
      // Realistic ones without a limit: COLMAP and Basalt can say most of them.
      const Camera drawn = *genCamera(*rc::gen::elementOf(all), Range::kRealistic);
      cameras.push_back(
          {"cam" + std::to_string(3 * i + 1),
           makeCamera(drawn.modelName(), drawn.params(), drawn.width(), drawn.height())});
    }
    for (const std::string_view format : {"kalibr", "colmap", "basalt"}) {
      std::string text;
      try {
        text = calibrationText(cameras, format);
      } catch (const std::invalid_argument&) {
        RC_ASSERT(format != "kalibr");
        continue;
      }
      const std::vector<NamedCamera> read = parseCalibration(text, "f").cameras;
      RC_ASSERT(read.size() == cameras.size());
      for (size_t i = 0; i < read.size(); ++i) {
        RC_ASSERT(format == "basalt" || read[i].name == cameras[i].name);
        RC_ASSERT(equalTo(cameras[i].camera, read[i].camera, format == "basalt" ? 1e-12 : 0));
      }
    }
  });
}

}  // namespace
}  // namespace dlsd
