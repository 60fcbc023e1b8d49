#include "evaluation/peers/peers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "cameras/arc.h"
#include "cameras/calibration/files.h"
#include "evaluation/peers/ximgproc_module.h"
#include "synth/dataset/module.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;

using Segments = std::vector<cv::Vec4f>;

const XimgprocDetectors& ximgproc() {
  static const auto& detectors =
      *static_cast<const XimgprocDetectors*>(moduleTable("ximgproc", "dlsd_ximgproc_detectors"));
  return detectors;
}

double nowMs() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double, std::milli>(Clock::now().time_since_epoch()).count();
}

/// 8-bit grey, as all three take.
cv::Mat greyOf(const Image& image) {
  const int type = CV_MAKETYPE(image.bits == 16 ? CV_16U : CV_8U, image.channels);
  cv::Mat grey(image.height, image.width, type, const_cast<uint8_t*>(image.bytes.data()));
  if (image.bits == 16) {
    cv::Mat eight;
    grey.convertTo(eight, CV_8U, 1.0 / 257);
    grey = eight;
  }
  if (image.channels > 1) {
    cv::Mat one;
    cv::cvtColor(grey, one, image.channels == 4 ? cv::COLOR_RGBA2GRAY : cv::COLOR_RGB2GRAY);
    grey = one;
  }
  return grey;
}

}  // namespace

struct PeerDetector::Impl {
  Camera camera;
  VirtualView view;
  ViewMaps maps;
  cv::Ptr<cv::LineSegmentDetector> lsd;
  cv::Ptr<cv::ximgproc::EdgeDrawing> edge_drawing;
  cv::Ptr<cv::ximgproc::FastLineDetector> fld;
  cv::Mat rectified;
  Segments segments;

  Impl(const Camera& its_camera, const std::string& name) : camera(its_camera) {
    cv::setNumThreads(1);
    if (name == "lsd") {
      lsd = cv::createLineSegmentDetector();
    } else if (name == "edlines") {
      edge_drawing = ximgproc().edgeDrawing();
    } else if (name == "fld") {
      fld = ximgproc().fastLineDetector();
    } else {
      throw InputError(fmt::format(
          "peer \"{}\" is unknown, there are {}", name, fmt::join(peerDetectors(), ", ")));
    }
    const Crop crop = cropView(camera,
                               {.kind = ViewKind::kPinhole,
                                .width = camera.width(),
                                .height = camera.height(),
                                .fov_rad = kPeerMaxFieldRad});
    if (!crop.view) {
      throw InputError("the camera's image does not show its optical axis: nothing to rectify");
    }
    view = *crop.view;
    maps = viewMaps(camera, view);
  }

  void rectify(const cv::Mat& grey) {
    const cv::Mat u(maps.height, maps.width, CV_32F, maps.u.data());
    const cv::Mat v(maps.height, maps.width, CV_32F, maps.v.data());
    cv::remap(grey, rectified, u, v, cv::INTER_LINEAR);
  }

  void detect() {
    segments.clear();
    if (lsd) {
      lsd->detect(rectified, segments);
    } else if (edge_drawing) {
      edge_drawing->detectEdges(rectified);
      edge_drawing->detectLines(segments);
    } else {
      fld->detect(rectified, segments);
    }
  }

  /// A straight segment of the view as curves of the original image: one, unless it leaves the
  /// image and comes back.
  void mapBack(const cv::Vec4f& segment, std::vector<DetectionLine>& lines) const {
    const auto from = view.rayInCam({double(segment[0]), double(segment[1])});
    const auto to = view.rayInCam({double(segment[2]), double(segment[3])});
    const auto arc = from && to ? arcBetween(*from, *to) : std::nullopt;
    if (!arc) {
      return;
    }
    for (const ImageSpan& span : imageSpans(camera, *arc)) {
      DetectionLine line;
      line.points = imageCurve(camera, *arc, span.t0, span.t1);
      if (line.points.size() < 2 || line.points.front() == line.points.back()) {
        continue;
      }
      line.normal = arc->normal;
      line.end_rays_in_cam = {arc->at(span.t0), arc->at(span.t1)};
      line.angle_rad = (span.t1 - span.t0) * arc->angle();
      lines.push_back(std::move(line));
    }
  }
};

const std::vector<std::string>& peerDetectors() {
  static const std::vector<std::string> names{"lsd", "edlines", "fld"};
  return names;
}

PeerDetector::PeerDetector(const Camera& camera, const std::string& name)
    : impl_(std::make_unique<Impl>(camera, name)) {}
PeerDetector::~PeerDetector() = default;
PeerDetector::PeerDetector(PeerDetector&&) noexcept = default;
PeerDetector& PeerDetector::operator=(PeerDetector&&) noexcept = default;

const VirtualView& PeerDetector::view() const {
  return impl_->view;
}

Detections PeerDetector::detect(const Image& image) {
  Impl& impl = *impl_;
  if (image.width != impl.camera.width() || image.height != impl.camera.height()) {
    throw std::invalid_argument(fmt::format("image is {}x{} px, its camera {}x{} px",
                                            image.width,
                                            image.height,
                                            impl.camera.width(),
                                            impl.camera.height()));
  }
  const cv::Mat grey = greyOf(image);
  const double start = nowMs();
  impl.rectify(grey);
  const double rectified = nowMs();
  impl.detect();
  Detections detections;
  detections.time_ms = nowMs() - rectified;
  detections.rectification_ms = rectified - start;
  for (const cv::Vec4f& segment : impl.segments) {
    impl.mapBack(segment, detections.lines);
  }
  return detections;
}

DetectionSource detectionsOfPeer(const Dataset& dataset, const std::string& name, bool timed) {
  if (std::find(peerDetectors().begin(), peerDetectors().end(), name) == peerDetectors().end()) {
    throw InputError(fmt::format(
        "peer \"{}\" is unknown, there are {}", name, fmt::join(peerDetectors(), ", ")));
  }
  return [&dataset, name, timed]() -> FrameDetections {
    const auto detectors = std::make_shared<std::map<std::string, PeerDetector>>();
    return [&dataset, name, timed, detectors](size_t, const LabelRecord& labels) {
      auto it = detectors->find(labels.camera);
      if (it == detectors->end()) {
        it = detectors->emplace(labels.camera, PeerDetector(dataset.camera(labels), name)).first;
      }
      Detections detections = it->second.detect(dataset.image(labels));
      if (!timed) {
        detections.time_ms = detections.rectification_ms = std::nullopt;
      }
      return detections;
    };
  };
}

}  // namespace dlsd
