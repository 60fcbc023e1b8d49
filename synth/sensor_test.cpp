#include "synth/sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "cameras/calibration/files.h"

namespace dlsd {
namespace {

constexpr int kSide = 200;

/// Level i of an image, in 8-bit levels.
double levelAt(const Image& image, size_t i) {
  if (image.bits == 8) return image.bytes[i];
  uint16_t value = 0;
  std::memcpy(&value, image.bytes.data() + 2 * i, 2);
  return value / 257.0;
}

struct Moments {
  double mean = 0, variance = 0;
};

Moments momentsOf(const Image& image) {
  const size_t n = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  Moments m;
  for (size_t i = 0; i < n; ++i) m.mean += levelAt(image, i) / static_cast<double>(n);
  for (size_t i = 0; i < n; ++i) {
    m.variance += std::pow(levelAt(image, i) - m.mean, 2) / static_cast<double>(n);
  }
  return m;
}

Image exposeFlat(const SensorOptions& sensor, double radiance, uint64_t index = 2) {
  const std::vector<float> flat(kSide * kSide, static_cast<float>(radiance));
  return exposeImage(sensor, kSide, kSide, flat, 1, index);
}

// The standard error of a mean of n values is s / sqrt(n), of a variance s^2 sqrt(2 / n).
void expectMoments(const Image& image, double mean, double variance) {
  constexpr double kCount = kSide * kSide;
  const Moments m = momentsOf(image);
  EXPECT_NEAR(m.mean, mean, 4.5 * std::sqrt(variance / kCount) + 1e-6);
  EXPECT_NEAR(m.variance, variance, 4.5 * variance * std::sqrt(2 / kCount) + 0.003 * variance);
}

TEST(Sensor, ReadNoiseHasItsSigma) {
  SensorOptions sensor;
  for (const double sigma : {0.5, 3.0, 12.0}) {
    for (const int bits : {8, 16}) {
      sensor.read_noise_levels = sigma;
      sensor.bits = bits;
      const double step = bits == 8 ? 1 : 1 / 257.0;
      expectMoments(exposeFlat(sensor, 0.4983), 0.4983 * 255, sigma * sigma + step * step / 12);
    }
  }
}

// Each pixel has noise of its own: products of neighbours' noises have mean 0, within 4.5 standard
// errors.
TEST(Sensor, NeighboursHaveNoiseOfTheirOwn) {
  SensorOptions read, shot;
  read.read_noise_levels = 5;
  shot.full_well_electrons = 2000;
  for (SensorOptions sensor : {read, shot}) {
    sensor.bits = 16;
    const Image image = exposeFlat(sensor, 0.4983);
    const Moments m = momentsOf(image);
    for (const size_t apart : {size_t{1}, size_t{2}, size_t{kSide}, size_t{kSide} + 1}) {
      const size_t count = kSide * kSide - apart;
      double sum = 0;
      for (size_t i = 0; i < count; ++i) {
        sum += (levelAt(image, i) - m.mean) * (levelAt(image, i + apart) - m.mean);
      }
      EXPECT_NEAR(sum / static_cast<double>(count) / m.variance,
                  0,
                  4.5 / std::sqrt(static_cast<double>(count)))
          << apart;
    }
  }
}

TEST(Sensor, ShotNoiseIsPoisson) {
  SensorOptions sensor;
  sensor.bits = 16;
  int checked = 0;
  for (const double full_well : {20.0, 400.0, 20000.0}) {
    for (const double level : {0.02, 0.1, 0.35}) {
      sensor.full_well_electrons = full_well;
      const double variance = level / full_well * 255 * 255;
      expectMoments(exposeFlat(sensor, level), 255 * level, variance + std::pow(1 / 257.0, 2) / 12);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 9);
  // Few electrons are whole ones.
  sensor.full_well_electrons = 20;
  const Image image = exposeFlat(sensor, 0.1);
  for (size_t i = 0; i < kSide * kSide; ++i) {
    const double electrons = levelAt(image, i) / 255 * 20;
    ASSERT_NEAR(electrons, std::round(electrons), 1e-3);
  }
  EXPECT_EQ(momentsOf(exposeFlat(sensor, 0)).variance, 0);
}

TEST(Sensor, ReadAndShotNoiseAreIndependent) {
  SensorOptions sensor;
  sensor.bits = 16;
  sensor.full_well_electrons = 500;
  sensor.read_noise_levels = 4;
  expectMoments(exposeFlat(sensor, 0.5), 127.5, 16 + 0.5 / 500 * 255 * 255);
}

TEST(Sensor, NoiseIsAFunctionOfItsSeeds) {
  SensorOptions sensor;
  sensor.read_noise_levels = 3;
  sensor.full_well_electrons = 1000;
  const Image first = exposeFlat(sensor, 0.5);
  EXPECT_EQ(first.bytes, exposeFlat(sensor, 0.5).bytes);
  EXPECT_NE(first.bytes, exposeFlat(sensor, 0.5, 3).bytes);
  SensorOptions other = sensor;
  other.read_noise_seed = 1;
  EXPECT_NE(first.bytes, exposeFlat(other, 0.5).bytes);
  other = sensor;
  other.shot_noise_seed = 1;
  EXPECT_NE(first.bytes, exposeFlat(other, 0.5).bytes);
  // The seed of noise that is off changes nothing.
  sensor.full_well_electrons = other.full_well_electrons = 0;
  EXPECT_EQ(exposeFlat(sensor, 0.5).bytes, exposeFlat(other, 0.5).bytes);
}

TEST(Sensor, VignettingIsExact) {
  SensorOptions sensor;
  sensor.vignetting = 0.6;
  sensor.bits = 16;
  const int width = 64, height = 48;
  const std::vector<float> flat(static_cast<size_t>(width * height), 0.8F);
  const Image image = exposeImage(sensor, width, height, flat, 1, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dx = x + 0.5 - width / 2.0, dy = y + 0.5 - height / 2.0;
      const double left = 1 - 0.6 * (dx * dx + dy * dy) / (32.0 * 32 + 24 * 24);
      EXPECT_DOUBLE_EQ(vignettingAt(sensor, width, height, {x, y}), left);
      ASSERT_NEAR(levelAt(image, static_cast<size_t>(y * width + x)),
                  255 * static_cast<double>(0.8F) * left,
                  0.5 / 257 + 1e-9);
    }
  }
  // The image's very corner loses the whole share, its centre nothing.
  EXPECT_DOUBLE_EQ(vignettingAt(sensor, width, height, {-0.5, 47.5}), 0.4);
  EXPECT_DOUBLE_EQ(vignettingAt(sensor, width, height, {31.5, 23.5}), 1);
}

TEST(Sensor, QuantisationIsUnbiased) {
  for (const int bits : {8, 16}) {
    SensorOptions sensor;
    sensor.bits = bits;
    std::vector<float> ramp;
    for (int i = 0; i < kSide * kSide; ++i) {
      ramp.push_back(static_cast<float>((i + 0.5) / (kSide * kSide)));
    }
    const Image image = exposeImage(sensor, kSide, kSide, ramp, 1, 1);
    ASSERT_EQ(image.bits, bits);
    ASSERT_EQ(image.bytes.size(), ramp.size() * static_cast<size_t>(bits / 8));
    const double half_step = bits == 8 ? 0.5 : 0.5 / 257;
    double bias = 0;
    for (size_t i = 0; i < ramp.size(); ++i) {
      const double error = levelAt(image, i) - 255 * static_cast<double>(ramp[i]);
      ASSERT_LE(std::abs(error), half_step + 1e-9);
      bias += error / static_cast<double>(ramp.size());
    }
    EXPECT_NEAR(bias, 0, 1e-3);
  }
}

// With everything off, what remains is 255 x, rounded; each switch alone changes the picture.
TEST(Sensor, SwitchesAreOffByDefault) {
  const SensorOptions plain;
  std::vector<float> ramp;
  for (int i = 0; i < kSide * kSide; ++i) ramp.push_back(static_cast<float>(i % 256) / 255);
  const Image image = exposeImage(plain, kSide, kSide, ramp, 1, 1);
  for (size_t i = 0; i < ramp.size(); ++i) ASSERT_EQ(image.bytes[i], i % 256);
  const auto differs = [&](auto set) {
    SensorOptions sensor;
    set(&sensor);
    EXPECT_NE(toJson(sensor), toJson(plain));
    return exposeImage(sensor, kSide, kSide, ramp, 1, 1).bytes != image.bytes;
  };
  EXPECT_TRUE(differs([](SensorOptions* s) { s->vignetting = 0.1; }));
  EXPECT_TRUE(differs([](SensorOptions* s) { s->exposure = 0.9; }));
  EXPECT_TRUE(differs([](SensorOptions* s) { s->full_well_electrons = 1e4; }));
  EXPECT_TRUE(differs([](SensorOptions* s) { s->read_noise_levels = 1; }));
  EXPECT_TRUE(differs([](SensorOptions* s) { s->encoding = Encoding::kSrgb; }));
  EXPECT_TRUE(differs([](SensorOptions* s) { s->bits = 16; }));
}

TEST(Sensor, EncodingsAreMonotoneAndMeetAtTheEnds) {
  for (const Encoding encoding : {Encoding::kLinear, Encoding::kSrgb, Encoding::kGamma}) {
    SensorOptions sensor;
    sensor.encoding = encoding;
    EXPECT_EQ(greyLevel(sensor, 0), 0);
    EXPECT_NEAR(greyLevel(sensor, 1), 255, 1e-9);
    EXPECT_NEAR(greyLevel(sensor, 7), 255, 1e-9);
    for (int i = 1; i <= 1000; ++i) {
      EXPECT_GT(greyLevel(sensor, i / 1000.0), greyLevel(sensor, (i - 1) / 1000.0));
    }
  }
}

// Images are encoded through a table.
TEST(Sensor, ImagesHoldTheGreyLevelsOfTheirEncoding) {
  for (const Encoding encoding : {Encoding::kLinear, Encoding::kSrgb, Encoding::kGamma}) {
    SensorOptions sensor;
    sensor.encoding = encoding;
    sensor.gamma = 3.7;
    sensor.exposure = 1.3;
    sensor.bits = 16;
    std::vector<float> ramp;
    for (int i = 0; i < kSide * kSide; ++i) {
      ramp.push_back(static_cast<float>(1.1 * std::pow((i + 0.5) / (kSide * kSide), 3)));
    }
    const Image image = exposeImage(sensor, kSide, kSide, ramp, 1, 1);
    for (size_t i = 0; i < ramp.size(); ++i) {
      ASSERT_NEAR(
          levelAt(image, i), greyLevel(sensor, static_cast<double>(ramp[i])), 0.5 / 257 + 1e-3);
    }
  }
}

/// Everything is on, and unlike its default.
SensorOptions everything() {
  SensorOptions sensor;
  sensor.psf_sigma_px = 0.3;
  sensor.defocus_radius_px = 1.5;
  sensor.vignetting = 0.25;
  sensor.exposure = 1.25;
  sensor.full_well_electrons = 8000;
  sensor.shot_noise_seed = 11;
  sensor.read_noise_levels = 2;
  sensor.read_noise_seed = 0x8000000000000001ULL;
  sensor.encoding = Encoding::kGamma;
  sensor.gamma = 1.8;
  sensor.bits = 16;
  return sensor;
}

TEST(Sensor, SurvivesItsJson) {
  for (const Encoding encoding : {Encoding::kLinear, Encoding::kSrgb, Encoding::kGamma}) {
    EXPECT_EQ(encodingFromName(toString(encoding)), encoding);
    SensorOptions sensor = everything();
    sensor.encoding = encoding;
    const nlohmann::json json = toJson(sensor);
    const SensorOptions back = sensorFromJson(json, "x");
    EXPECT_EQ(toJson(back), toJson(sensor));
    EXPECT_EQ(exposeFlat(back, 0.3).bytes, exposeFlat(sensor, 0.3).bytes);
    for (const auto& [key, value] : json.items()) {
      nlohmann::json wrong = json;
      wrong[key] = -7;
      EXPECT_THROW((void)sensorFromJson(wrong, "x"), InputError) << key;
    }
  }
  EXPECT_FALSE(encodingFromName("rot13"));
}

// Records of the first version know fewer stages: those are off. Its own keys are required.
TEST(Sensor, ReadsOlderRecords) {
  const nlohmann::json older{{"psf_sigma_px", 0.7},
                             {"exposure", 1.0},
                             {"read_noise_levels", 2.0},
                             {"encoding", "linear"},
                             {"bits", 8}};
  const SensorOptions sensor = sensorFromJson(older, "x");
  EXPECT_EQ(sensor.defocus_radius_px, 0);
  EXPECT_EQ(sensor.vignetting, 0);
  EXPECT_EQ(sensor.full_well_electrons, 0);
  EXPECT_EQ(sensor.read_noise_seed, 0U);
  for (const auto& [key, value] : older.items()) {
    nlohmann::json missing = older;
    missing.erase(key);
    EXPECT_THROW((void)sensorFromJson(missing, "x"), InputError) << key;
  }
}

TEST(Sensor, RefusesWhatIsOutOfRange) {
  const auto refuses = [](auto set, const char* field) {
    SensorOptions sensor;
    set(&sensor);
    try {
      sensor.check();
      ADD_FAILURE() << field << " was accepted";
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(field), std::string::npos) << e.what();
    }
  };
  refuses([](SensorOptions* s) { s->psf_sigma_px = -1; }, "psf_sigma_px");
  refuses([](SensorOptions* s) { s->psf_sigma_px = std::nan(""); }, "psf_sigma_px");
  refuses([](SensorOptions* s) { s->defocus_radius_px = 10.1; }, "defocus_radius_px");
  refuses([](SensorOptions* s) { s->vignetting = 1.1; }, "vignetting");
  refuses([](SensorOptions* s) { s->exposure = 0; }, "exposure");
  refuses([](SensorOptions* s) { s->full_well_electrons = 0.5; }, "full_well_electrons");
  refuses([](SensorOptions* s) { s->full_well_electrons = std::nan(""); }, "full_well_electrons");
  refuses([](SensorOptions* s) { s->read_noise_levels = 101; }, "read_noise_levels");
  refuses([](SensorOptions* s) { s->gamma = 0.5; }, "gamma");
  refuses([](SensorOptions* s) { s->bits = 12; }, "bits");
  everything().check();
}

}  // namespace
}  // namespace dlsd
