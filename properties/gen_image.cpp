#include "properties/gen_image.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "properties/gen.h"

namespace dlsd {

rc::Gen<TestImageSpec> genTestImage(int max_side) {
  return rc::gen::exec([max_side] {
    const auto side = [&] {
      return *genInt(0, 7) == 7 ? *genInt(1, std::min(20, max_side)) : *genInt(1, max_side);
    };
    constexpr std::array<int, 3> kChannels{1, 3, 4};
    const auto fill = static_cast<Fill>(*genInt(0, kFillCount - 1));
    const int width = side(), height = side();
    const int channels = kChannels[static_cast<size_t>(*genInt(0, 2))];
    const auto type = static_cast<PixelType>(*genInt(0, 2));
    const int padding = *genInt(0, 9);
    const bool bgr = *genInt(0, 1) == 1;
    const auto seed = static_cast<uint64_t>(*genInt(0, 1 << 30));
    const double noise_sigma = *genReal(0, 80), blur_px = *genReal(0, 1.5);
    return TestImageSpec{
        fill, width, height, channels, type, padding, bgr, seed, noise_sigma, blur_px};
  });
}

rc::Gen<TestImageSpec> genNoise(Fill kind, int width, int height) {
  return rc::gen::exec([=] {
    TestImageSpec image{.fill = kind, .width = width, .height = height};
    image.seed = static_cast<uint64_t>(*genInt(0, 1 << 30));
    image.noise_sigma = *genReal(0.3, 60);
    if (kind == Fill::kBlurredNoise) {
      image.blur_px = *genReal(0, 1.5);
      image.noise_sigma /= blurGain(image.blur_px);
    }
    if (kind == Fill::kShotNoise) image.noise_sigma = 128 / std::sqrt(*genReal(1, 60));
    return image;
  });
}

rc::Gen<Camera> genSmallCamera(std::string_view model, int max_side) {
  return rc::gen::map(genCamera(model, Range::kRealistic), [=](const Camera& camera) {
    const int longest = std::max(camera.width(), camera.height());
    if (longest <= max_side) return camera;
    const double factor = static_cast<double>(max_side) / longest;
    const auto side = [&](int px) { return std::max(1, static_cast<int>(px * factor)); };
    return scaledCamera(camera, factor, side(camera.width()), side(camera.height()));
  });
}

}  // namespace dlsd
