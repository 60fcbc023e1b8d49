#include "detector/detector.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>

#include "cameras/ray_table.h"
#include "detector/options.h"
#include "detector/paper_detector.h"
#include "detector/plane_detector.h"
#include "detector/stop_watch.h"
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

void checkView(const ImageView& image, const Camera& camera) {
  if (image.width != camera.width() || image.height != camera.height()) {
    throw std::invalid_argument("image is " + std::to_string(image.width) + " x " +
                                std::to_string(image.height) + " but the camera is " +
                                std::to_string(camera.width()) + " x " +
                                std::to_string(camera.height()));
  }
  if (image.data == nullptr) throw std::invalid_argument("image has no data");
  if (image.channels != 1 && image.channels != 3 && image.channels != 4) {
    throw std::invalid_argument("image has " + std::to_string(image.channels) +
                                " channels: allowed are 1, 3 and 4");
  }
  const int value_bytes = bytesPerValue(image.type);
  const ptrdiff_t row_bytes = ptrdiff_t{image.width} * image.channels * value_bytes;
  // A single row needs no stride; rows may also run upwards in memory.
  if (image.height > 1 && std::abs(image.stride_bytes) < row_bytes) {
    throw std::invalid_argument("image stride of " + std::to_string(image.stride_bytes) +
                                " bytes is shorter than a row of " + std::to_string(row_bytes));
  }
  if (reinterpret_cast<uintptr_t>(image.data) % static_cast<uintptr_t>(value_bytes) != 0 ||
      image.stride_bytes % value_bytes != 0) {
    throw std::invalid_argument("image rows are not aligned to their pixel type");
  }
}

}  // namespace

struct Detector::Impl {
  Impl(const Camera& the_camera, const DetectorOptions& the_options)
      : rays((the_options.check(), the_camera)), usable(the_camera) {
    if (the_options.method == DetectorOptions::Method::kConvexPolygons) {
      paper.emplace(rays, the_options);
    } else {
      planes.emplace(rays, the_options);
    }
  }

  RayTable rays;
  UsableMask usable;
  std::optional<PaperDetector> paper;
  std::optional<PlaneDetector> planes;
  std::vector<DetectedLine> lines;
  StageTimes times;
};

Detector::Detector(const Camera& camera) : Detector(camera, DetectorOptions{}) {}
Detector::Detector(const Camera& camera, const DetectorOptions& options)
    : impl_(std::make_unique<Impl>(camera, options)) {}
Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

const std::vector<DetectedLine>& Detector::detect(const ImageView& image) {
  Impl& d = *impl_;
  checkView(image, camera());
  d.times = {};
  d.lines.clear();
  const StopWatch watch(&d.times.total);
  if (d.paper) {
    d.paper->detect(image, d.usable.bits(), &d.lines, &d.times);
  } else {
    d.planes->detect(image, d.usable.bits(), &d.lines, &d.times);
  }
  std::erase_if(d.lines, [&](DetectedLine& line) {
    const auto from_px = camera().project(line.arc.from), to_px = camera().project(line.arc.to);
    if (!from_px || !to_px) return true;
    line.from_px = *from_px;
    line.to_px = *to_px;
    return false;
  });
  std::sort(d.lines.begin(), d.lines.end(), [](const DetectedLine& a, const DetectedLine& b) {
    const auto position = [](const DetectedLine& l) {
      return std::make_tuple(l.from_px.x(), l.from_px.y(), l.to_px.x(), l.to_px.y());
    };
    return a.score != b.score ? a.score > b.score : position(a) < position(b);
  });
  return d.lines;
}

const StageTimes& Detector::times() const {
  return impl_->times;
}
const Camera& Detector::camera() const {
  return impl_->rays.camera();
}

}  // namespace dlsd
