// Any bytes as an image with its size, type, stride, camera and options: the detector must answer
// with finite, consistent lines, the same ones twice. Only a camera or options out of range may be
// refused, with std::invalid_argument.
//
// By libFuzzer, with DLSD_FUZZ=ON and clang (fuzz/README.md); fuzz/replay.cpp runs the same over
// saved inputs with any compiler.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "cameras/camera.h"
#include "detector/detector.h"
#include "detector/options.h"

namespace dlsd {
namespace {

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "%s\n", what.c_str());
  std::abort();
}

/// Takes values off the front of the input; zeros when it has ended.
class Bytes {
 public:
  Bytes(const uint8_t* data, size_t size) : data_(data), left_(size) {}

  uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  int below(int count) {
    const int low = byte(), high = byte();
    return (low | high << 8) % count;
  }
  /// In [lo, hi].
  double real(double lo, double hi) { return lo + (hi - lo) * below(65536) / 65535; }
  /// Fills the memory with what is left, over and over.
  void fill(std::vector<uint8_t>* memory) {
    for (size_t i = 0; i < memory->size(); ++i) (*memory)[i] = left_ > 0 ? data_[i % left_] : 0;
  }

 private:
  const uint8_t* data_;
  size_t left_;
};

/// A camera of any model, near a usual one in some parameters and anywhere in others.
Camera takeCamera(Bytes* bytes, int width, int height) {
  constexpr size_t kModels = std::variant_size_v<CameraModelVariant>;
  const auto model = [&]<size_t... I>(std::index_sequence<I...>, size_t which) {
    std::string_view name;
    ((I == which ? void(name = std::variant_alternative_t<I, CameraModelVariant>::kName) : void()),
     ...);
    return name;
  }
  (std::make_index_sequence<kModels>(), static_cast<size_t>(bytes->below(kModels)));
  std::vector<double> params;
  for (const ParamSpec& spec : paramSpecsOf(model)) {
    const bool wild = bytes->byte() % 8 == 0;
    params.push_back(wild ? bytes->real(std::max(spec.min, -1e6), std::min(spec.max, 1e6))
                          : bytes->real(spec.realistic_min, spec.realistic_max));
    if (spec.name == "cx") params.back() = bytes->real(-0.2, 1.2) * width;
    if (spec.name == "cy") params.back() = bytes->real(-0.2, 1.2) * height;
    if (spec.name == "fx" || spec.name == "fy") params.back() = bytes->real(0.1, 2) * width;
  }
  return makeCamera(
      model, params, width, height, bytes->byte() % 4 == 0 ? bytes->real(0.05, M_PI) : M_PI);
}

DetectorOptions takeOptions(Bytes* bytes) {
  DetectorOptions options = bytes->byte() % 4 == 0 ? DetectorOptions::paper() : DetectorOptions{};
  if (bytes->byte() % 2 == 0) return options;
  options.edges.anchor_gradient = bytes->real(0, 20);
  options.edges.min_gradient = options.edges.anchor_gradient * bytes->real(0, 1);
  options.edges.anchor_noise_ratio = bytes->real(0, 10);
  options.edges.min_noise_ratio = bytes->real(0, 10);
  options.edges.anchor_interval_px = 1 + bytes->below(64);
  options.edges.min_chain_px = 2 + bytes->below(40);
  options.polygons.max_line_err_px = bytes->real(0.1, 10);
  options.polygons.min_line_px = 3 + bytes->below(40);
  options.planes.seed_px = 4 + bytes->below(40);
  options.planes.max_err_px = bytes->real(0.1, 10);
  options.validation.rho_px = bytes->real(0.1, 10);
  options.validation.tight_rho_px = options.validation.rho_px * bytes->real(0.1, 1);
  options.validation.max_gap_px = bytes->below(100);
  options.validation.min_bend_radius_px = bytes->real(0, 2000);
  options.validation.min_length_px = bytes->real(2, 50);
  options.validation.min_score = bytes->real(-100, 20);
  return options;
}

void checkLines(const Camera& camera, const std::vector<DetectedLine>& lines) {
  for (const DetectedLine& line : lines) {
    const bool finite =
        line.arc.normal.allFinite() && line.arc.from.allFinite() && line.arc.to.allFinite() &&
        line.from_px.allFinite() && line.to_px.allFinite() && line.normal_cov.allFinite() &&
        std::isfinite(line.rms_px) && std::isfinite(line.max_px) && std::isfinite(line.length_px) &&
        std::isfinite(line.score) && std::isfinite(line.contrast);
    if (!finite) fail("a value that is no finite number");
    if (!(std::abs(line.arc.normal.norm() - 1) <= 1e-12)) fail("a normal that is no unit vector");
    if (!camera.inImage(line.from_px) || !camera.inImage(line.to_px)) fail("an end off the image");
    if (!(line.rms_px <= line.max_px)) fail("rms > max");
    if (!(line.length_px > 0)) fail("no length");
  }
}

bool same(const DetectedLine& a, const DetectedLine& b) {
  return a.arc.normal == b.arc.normal && a.arc.from == b.arc.from && a.arc.to == b.arc.to &&
         a.from_px == b.from_px && a.to_px == b.to_px && a.normal_cov == b.normal_cov &&
         a.rms_px == b.rms_px && a.max_px == b.max_px && a.length_px == b.length_px &&
         a.score == b.score && a.contrast == b.contrast && a.polarity == b.polarity;
}

void checkDetection(Bytes bytes) {
  // The time of an input goes with its area. Wider than the 64 pixels of a word of bits, though.
  const int width = 1 + bytes.below(96), height = 1 + bytes.below(std::min(96, 2304 / width));
  constexpr int kChannels[] = {1, 3, 4, 1};
  ImageView view;
  view.width = width;
  view.height = height;
  view.channels = kChannels[bytes.byte() % 4];
  view.type = static_cast<PixelType>(bytes.byte() % 3);
  view.bgr = bytes.byte() % 2 == 1;
  const size_t value = view.type == PixelType::kU8 ? 1 : view.type == PixelType::kU16 ? 2 : 4;
  view.stride_bytes = static_cast<ptrdiff_t>(
      value * (static_cast<size_t>(view.channels) * static_cast<size_t>(width) + bytes.byte() % 9));
  const DetectorOptions options = takeOptions(&bytes);
  const bool masked = bytes.byte() % 4 == 0;
  std::optional<Camera> camera;
  std::optional<Detector> detector;
  try {
    camera.emplace(takeCamera(&bytes, width, height));
    detector.emplace(*camera, options);
  } catch (const std::invalid_argument&) {
    return;
  }

  std::vector<uint8_t> pixels(static_cast<size_t>(view.stride_bytes) * static_cast<size_t>(height));
  bytes.fill(&pixels);
  // No byte beyond the last pixel belongs to the image.
  pixels.resize(pixels.size() - static_cast<size_t>(view.stride_bytes) +
                value * static_cast<size_t>(view.channels) * static_cast<size_t>(width));
  pixels.shrink_to_fit();
  std::vector<uint8_t> mask(static_cast<size_t>(width) * static_cast<size_t>(height));
  bytes.fill(&mask);
  view.data = pixels.data();
  const ImageView mask_view{
      .data = mask.data(), .width = width, .height = height, .channels = 1, .stride_bytes = width};
  const auto detect = [&] {
    return masked ? detector->detect(view, mask_view) : detector->detect(view);
  };
  const std::vector<DetectedLine> first = detect(), second = detect();
  checkLines(*camera, first);
  if (first.size() != second.size()) fail("other lines the second time");
  for (size_t i = 0; i < first.size(); ++i) {
    if (!same(first[i], second[i])) fail("another line the second time");
  }
}

}  // namespace
}  // namespace dlsd

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  dlsd::checkDetection({data, size});
  return 0;
}
