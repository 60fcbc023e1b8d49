#include "detector/detector.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>

#include "cameras/mutant.h"
#include "cameras/ray_table.h"
#include "detector/joints.h"
#include "detector/options.h"
#include "detector/paper_detector.h"
#include "detector/plane_detector.h"
#include "detector/stop_watch.h"
#include "detector/thin_bars.h"
#include "detector/usable_mask.h"

namespace dlsd {
namespace {

int bytesPerValue(PixelType type) {
  switch (type) {
    case PixelType::kU8:
      return 1;
    case PixelType::kU16:
      return 2;
    case PixelType::kF32:
      return 4;
  }
  throw std::invalid_argument("image has an unknown pixel type");
}

void checkView(const ImageView& image, const Camera& camera, const std::string& what) {
  if (image.width != camera.width() || image.height != camera.height()) {
    throw std::invalid_argument(what + " is " + std::to_string(image.width) + " x " +
                                std::to_string(image.height) + " but the camera is " +
                                std::to_string(camera.width()) + " x " +
                                std::to_string(camera.height()));
  }
  if (image.data == nullptr) throw std::invalid_argument(what + " has no data");
  if (image.channels != 1 && image.channels != 3 && image.channels != 4) {
    throw std::invalid_argument(what + " has " + std::to_string(image.channels) +
                                " channels: allowed are 1, 3 and 4");
  }
  const int value_bytes = bytesPerValue(image.type);
  const ptrdiff_t row_bytes = ptrdiff_t{image.width} * image.channels * value_bytes;
  // A single row needs no stride; rows may also run upwards in memory.
  if (image.height > 1 && std::abs(image.stride_bytes) < row_bytes) {
    throw std::invalid_argument(what + " stride of " + std::to_string(image.stride_bytes) +
                                " bytes is shorter than a row of " + std::to_string(row_bytes));
  }
  if (reinterpret_cast<uintptr_t>(image.data) % static_cast<uintptr_t>(value_bytes) != 0 ||
      image.stride_bytes % value_bytes != 0) {
    throw std::invalid_argument(what + " rows are not aligned to their pixel type");
  }
}

/// Bits of a row where the mask is not 0, eight pixels at a time.
void packMaskRow(const uint8_t* mask, int width, uint64_t* words) {
  int x = 0;
  for (; x + 8 <= width; x += 8) {
    uint64_t eight = 0;
    std::memcpy(&eight, mask + x, sizeof eight);
    constexpr uint64_t kLow = 0x7f7f7f7f7f7f7f7f;
    const uint64_t flags = (((eight & kLow) + kLow) | eight) >> 7 & 0x0101010101010101;
    // The multiplication moves the flag of byte k to bit k of the top byte.
    const uint64_t bits = flags * 0x0102040810204080 >> 56;
    words[x / 64] |= bits << (x % 64);
  }
  for (; x < width; ++x) words[x / 64] |= static_cast<uint64_t>(mask[x] != 0) << (x % 64);
}

}  // namespace

struct Detector::Impl {
  Impl(const Camera& the_camera, const DetectorOptions& the_options)
      : rays((the_options.check(), the_camera)), usable(the_camera) {
    if (the_options.method == DetectorOptions::Method::kConvexPolygons) {
      paper.emplace(rays, the_options);
    } else {
      planes.emplace(rays, the_options);
      bars.emplace(rays);
      joints.emplace(rays, the_options.validation.min_length_px);
    }
  }

  void run(const ImageView& image, const BitRows& where);

  RayTable rays;
  UsableMask usable;
  BitRows masked;
  std::optional<PaperDetector> paper;
  std::optional<PlaneDetector> planes;
  std::optional<ThinBarMerger> bars;
  std::optional<JointCutter> joints;
  std::vector<DetectedLine> lines;
  StageTimes times;
};

Detector::Detector(const Camera& camera) : Detector(camera, DetectorOptions{}) {}
Detector::Detector(const Camera& camera, const DetectorOptions& options)
    : impl_(std::make_unique<Impl>(camera, options)) {}
Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

void Detector::Impl::run(const ImageView& image, const BitRows& where) {
  const Camera& camera = rays.camera();
  times = {};
  lines.clear();
  const StopWatch watch(&times.total);
  if (paper) {
    paper->detect(image, where, &lines, &times);
  } else {
    planes->detect(image, where, usable.bits(), &lines, &times);
  }
  std::erase_if(lines, [&](DetectedLine& line) {
    const auto from_px = camera.project(line.arc.from), to_px = camera.project(line.arc.to);
    if (!from_px || !to_px) return true;
    line.from_px = *from_px;
    line.to_px = *to_px;
    return false;
  });
  if (bars) {
    bars->merge(&lines);
    joints->cut(&lines);
    joints->meetAtCorners(where, &lines);
  }
  std::sort(lines.begin(), lines.end(), [](const DetectedLine& a, const DetectedLine& b) {
    const auto position = [](const DetectedLine& l) {
      return std::make_tuple(l.from_px.x(), l.from_px.y(), l.to_px.x(), l.to_px.y());
    };
    if (DLSD_MUTANT("line-order")) return position(a) < position(b);
    return a.score != b.score ? a.score > b.score : position(a) < position(b);
  });
}

const std::vector<DetectedLine>& Detector::detect(const ImageView& image) {
  checkView(image, camera(), "image");
  impl_->run(image, impl_->usable.bits());
  return impl_->lines;
}

const std::vector<DetectedLine>& Detector::detect(const ImageView& image, const ImageView& mask) {
  checkView(image, camera(), "image");
  checkView(mask, camera(), "mask");
  if (mask.channels != 1 || mask.type != PixelType::kU8) {
    throw std::invalid_argument("mask must have one channel of 8 bits");
  }
  Impl& d = *impl_;
  const BitRows& usable = d.usable.bits();
  if (d.masked.words.empty()) d.masked = BitRows(mask.width, mask.height);
  std::fill(d.masked.words.begin(), d.masked.words.end(), uint64_t{0});
  for (int y = 0; y < mask.height; ++y) {
    const auto* row = static_cast<const uint8_t*>(mask.data) + y * mask.stride_bytes;
    packMaskRow(row, mask.width, d.masked.row(y));
    for (size_t i = 0; i < usable.words_per_row; ++i) d.masked.row(y)[i] &= usable.row(y)[i];
  }
  d.run(image, d.masked);
  return d.lines;
}

const StageTimes& Detector::times() const {
  return impl_->times;
}
const Camera& Detector::camera() const {
  return impl_->rays.camera();
}

}  // namespace dlsd
