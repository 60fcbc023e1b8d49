#include "properties/checks/test_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <ostream>

#include "synth/dataset/random.h"

namespace dlsd {
namespace {

constexpr std::array<std::string_view, kFillCount> kNames{"constant",
                                                          "ramp",
                                                          "stripes",
                                                          "checkerboard",
                                                          "disc",
                                                          "polygon",
                                                          "white noise",
                                                          "blurred noise",
                                                          "salt and pepper",
                                                          "random bytes",
                                                          "shot noise"};

size_t sizeOf(PixelType type) {
  return type == PixelType::kU8 ? 1 : type == PixelType::kU16 ? 2 : 4;
}

/// Samples of a Gaussian out to four standard deviations.
std::vector<float> kernelOf(double sigma_px) {
  if (!(sigma_px > 0)) return {1};
  const int radius = static_cast<int>(std::ceil(4 * sigma_px));
  std::vector<float> kernel;
  for (int i = -radius; i <= radius; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
  }
  return kernel;
}

/// Gaussian blur, borders repeated.
void blur(std::vector<float>* image, int width, int height, double sigma_px) {
  const std::vector<float> kernel = kernelOf(sigma_px);
  const int radius = static_cast<int>(kernel.size() / 2);
  const float sum = std::accumulate(kernel.begin(), kernel.end(), 0.0F);
  std::vector<float> pass(image->size());
  for (const bool along_x : {true, false}) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        float value = 0;
        for (int i = -radius; i <= radius; ++i) {
          const int xi = std::clamp(along_x ? x + i : x, 0, width - 1);
          const int yi = std::clamp(along_x ? y : y + i, 0, height - 1);
          value += kernel[static_cast<size_t>(i + radius)] *
                   (*image)[static_cast<size_t>(yi) * static_cast<size_t>(width) +
                            static_cast<size_t>(xi)];
        }
        pass[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)] =
            value / sum;
      }
    }
    image->swap(pass);
  }
}

/// The number of electrons whose cumulative Poisson probability first exceeds u in [0, 1).
int poissonQuantile(double mean, double u) {
  double probability = std::exp(-mean), cumulative = probability;
  int count = 0;
  // Sums of rounded probabilities may stay below u for ever: 1e-16 is left far before the bound.
  const int most = static_cast<int>(mean + 12 * std::sqrt(mean) + 30);
  while (u >= cumulative && count < most) {
    ++count;
    probability *= mean / count;
    cumulative += probability;
  }
  return count;
}

/// Grey level of a pixel in shot noise of this spread around 128.
double shotNoiseAt(const Random& noise, uint64_t i, double sigma) {
  constexpr double kMean = 128, kNormalFrom = 50;
  const double electrons = (kMean / sigma) * (kMean / sigma);
  if (!(electrons < kNormalFrom)) return kMean + sigma * noise.normal(i);
  return kMean / electrons * poissonQuantile(electrons, noise.uniform(i, 0, 1));
}

size_t indexOf(std::span<const ParamSpec> specs, std::string_view name) {
  return static_cast<size_t>(
      std::find_if(specs.begin(), specs.end(), [&](const ParamSpec& s) { return s.name == name; }) -
      specs.begin());
}

}  // namespace

std::string_view nameOf(Fill fill) {
  return kNames[static_cast<size_t>(fill)];
}

std::optional<Fill> fillFromName(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<Fill>(found - kNames.begin());
}

std::ostream& operator<<(std::ostream& out, const TestImageSpec& spec) {
  constexpr std::array<const char*, 3> kTypes{"8 bit", "16 bit", "float"};
  return out << nameOf(spec.fill) << ", " << spec.width << " x " << spec.height << " px, "
             << spec.channels << " x " << kTypes[static_cast<size_t>(spec.type)] << ", padding "
             << spec.padding << (spec.bgr ? ", bgr" : "") << ", seed " << spec.seed << ", noise "
             << spec.noise_sigma << ", blur " << spec.blur_px;
}

std::vector<float> filled(
    Fill fill, int width, int height, uint64_t seed, double noise_sigma, double blur_px) {
  const Random random(seed, 1), noise(seed, 2);
  const double low = random.uniform(0, 0, 120), high = random.uniform(1, 120, 255);
  const double angle = random.uniform(2, 0, M_PI), period = random.uniform(3, 3, 60);
  const double c = std::cos(angle), s = std::sin(angle);
  const double cx = random.uniform(4, 0, width), cy = random.uniform(5, 0, height);
  const double radius = random.uniform(6, 2, 0.6 * std::max(width, height) + 3);
  const double share = random.uniform(7, 0, 0.3);
  std::vector<float> grey(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
      const double a = (x - cx) * c + (y - cy) * s, b = (y - cy) * c - (x - cx) * s;
      // How much of a pixel is on the bright side of an edge at this signed distance.
      const auto cover = [](double d) { return std::clamp(d + 0.5, 0.0, 1.0); };
      const auto wave = [&](double t) {
        const double phase = t / period - std::floor(t / period);
        return cover(period * std::min(phase - 0.25, 0.75 - phase));
      };
      double value = low;
      switch (fill) {
        case Fill::kConstant:
        case Fill::kRandomBytes:
          break;
        case Fill::kRamp:
          value = low + (high - low) * std::clamp(0.5 + a / (width + height), 0.0, 1.0);
          break;
        case Fill::kStripes:
          value = low + (high - low) * wave(a);
          break;
        case Fill::kCheckerboard: {
          const double p = wave(a), q = wave(b);
          value = low + (high - low) * (p * q + (1 - p) * (1 - q));
          break;
        }
        case Fill::kDisc:
          value = low + (high - low) * cover(radius - std::hypot(x - cx, y - cy));
          break;
        case Fill::kPolygon:
          value = low + (high - low) * std::min({cover(radius - a),
                                                 cover(radius + a),
                                                 cover(radius / 2 - b),
                                                 cover(radius / 2 + b)});
          break;
        case Fill::kWhiteNoise:
        case Fill::kBlurredNoise:
          value = 128 + noise_sigma * noise.normal(i);
          break;
        case Fill::kShotNoise:
          value = shotNoiseAt(noise, i, noise_sigma);
          break;
        case Fill::kSaltAndPepper: {
          const double draw = noise.uniform(i, 0, 1);
          value = draw < share / 2 ? 0 : draw < share ? 255 : 128;
          break;
        }
      }
      grey[i] = static_cast<float>(value);
    }
  }
  if (fill == Fill::kBlurredNoise) blur(&grey, width, height, blur_px);
  for (float& value : grey) value = std::clamp(value, 0.0F, 255.0F);
  return grey;
}

double blurGain(double blur_px) {
  double sum = 0, squares = 0;
  for (const float value : kernelOf(blur_px)) {
    sum += static_cast<double>(value);
    squares += static_cast<double>(value) * static_cast<double>(value);
  }
  return squares / (sum * sum);  // Of two passes.
}

TestImage makeTestImage(const TestImageSpec& spec) {
  const auto [fill, width, height, channels, type, padding, bgr, seed, noise_sigma, blur_px] = spec;
  TestImage image{fill, width, height, channels, type, 0, bgr, {}};
  const size_t pixel = sizeOf(type) * static_cast<size_t>(channels);
  // Padding of whole values keeps them aligned.
  image.stride_bytes = static_cast<ptrdiff_t>(pixel * static_cast<size_t>(width) +
                                              sizeOf(type) * static_cast<size_t>(padding));
  image.bytes.resize(static_cast<size_t>(image.stride_bytes) * static_cast<size_t>(height));
  const Random random(seed, 0);
  if (fill == Fill::kRandomBytes) {
    // Floats made of them are of any size, infinite, or no numbers at all.
    for (size_t i = 0; i < image.bytes.size(); ++i) {
      image.bytes[i] = static_cast<std::byte>(random.bits(i) & 0xffU);
    }
    return image;
  }
  const std::vector<float> grey = filled(fill, width, height, seed, noise_sigma, blur_px);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float value =
          grey[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
      for (int c = 0; c < channels; ++c) {
        std::byte* at = image.bytes.data() + y * image.stride_bytes +
                        static_cast<ptrdiff_t>(static_cast<size_t>(x) * pixel +
                                               static_cast<size_t>(c) * sizeOf(type));
        if (type == PixelType::kU8) {
          const auto v = static_cast<uint8_t>(std::lround(value));
          std::memcpy(at, &v, 1);
        } else if (type == PixelType::kU16) {
          const auto v = static_cast<uint16_t>(std::lround(value * 257.0F));
          std::memcpy(at, &v, 2);
        } else {
          std::memcpy(at, &value, 4);
        }
      }
    }
  }
  return image;
}

Camera croppedCamera(const Camera& camera, int left, int top, int width, int height) {
  std::vector<double> params = camera.params();
  params[indexOf(camera.paramSpecs(), "cx")] -= left;
  params[indexOf(camera.paramSpecs(), "cy")] -= top;
  return makeCamera(camera.modelName(), params, width, height, camera.maxFieldAngleLimit());
}

Camera mirroredCamera(const Camera& camera) {
  std::vector<double> params = camera.params();
  const auto specs = camera.paramSpecs();
  for (size_t i = 0; i < params.size(); ++i) {
    const std::string_view name = specs[i].name;
    if (name == "cx") params[i] = camera.width() - 1 - params[i];
    if (name == "p2" || name == "skew" || name == "d" || name == "e") params[i] *= -1;
  }
  return makeCamera(
      camera.modelName(), params, camera.width(), camera.height(), camera.maxFieldAngleLimit());
}

}  // namespace dlsd
