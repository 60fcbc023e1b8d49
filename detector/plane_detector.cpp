#include "detector/plane_detector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "cameras/mutant.h"
#include "detector/stop_watch.h"
#include "detector/visible_arc.h"

namespace dlsd {
namespace {

/// A step of contrast c seen through little blur has a gradient of this times c in the edge map.
constexpr double kGradientPerContrast = 0.28;

const EdgeRowKernels& fastestEdgeRowKernels() {
  const EdgeRowKernels* avx2 = avx2EdgeRowKernels();
  return avx2 != nullptr ? *avx2 : portableEdgeRowKernels();
}

}  // namespace

PlaneDetector::PlaneDetector(const RayTable& rays, const DetectorOptions& options)
    : rays_(rays),
      options_(options),
      mapper_(
          rays.camera().width(), rays.camera().height(), options.edges, fastestEdgeRowKernels()),
      linker_(rays.camera().width(), options.edges),
      splitter_(rays, options.planes),
      tracer_(rays, options.validation),
      claimed_(rays.camera().width(), rays.camera().height()) {}

void PlaneDetector::loadPixels(const ImageView& image) {
  pixels_ = {};
  pixels_.width = image.width;
  pixels_.height = image.height;
  if (image.type == PixelType::kU8 && image.channels == 1) {
    pixels_.u8 = static_cast<const uint8_t*>(image.data);
    pixels_.stride = image.stride_bytes;
    return;
  }
  const size_t w = static_cast<size_t>(image.width);
  fixed_.resize(w * static_cast<size_t>(image.height));
  for (int y = 0; y < image.height; ++y) loadGreyRow(image, y, &fixed_[static_cast<size_t>(y) * w]);
  pixels_.fixed = fixed_.data();
  pixels_.stride = image.width;
}

/// Calls f(x, y) for the pixels on the curve in four rows.
template <class F>
void forRows(const LineTracer::Quad& quad, F&& f) {
  for (int i = 0; i < LineTracer::kQuadPx; ++i) {
    const float ahead = static_cast<float>(i) - 1.5F;
    const float x = quad.crosses_rows ? quad.x + ahead * quad.slope : quad.x + ahead;
    const float y = quad.crosses_rows ? quad.y + ahead : quad.y + ahead * quad.slope;
    f(static_cast<int>(x + 0.5F), static_cast<int>(y + 0.5F));
  }
}

bool PlaneDetector::isClaimed(const PlanarPiece& piece) const {
  uint32_t claimed = 0;
  for (uint32_t i = 0; i < piece.nodes; ++i) {
    const Eigen::Vector2f& p = splitter_.nodes()[piece.first_node + i];
    claimed += claimed_.contains(static_cast<int>(p.x() + 0.5F), static_cast<int>(p.y() + 0.5F));
  }
  return 2 * claimed >= piece.nodes;
}

size_t PlaneDetector::claimedQuads() const {
  size_t claimed = 0;
  for (const LineTracer::Quad& q : tracer_.quads()) {
    claimed += claimed_.contains(static_cast<int>(q.x + 0.5F), static_cast<int>(q.y + 0.5F));
  }
  return claimed;
}

/// Removes the lines of which an arc is the whole. What ends a line from one side, such as a speck
/// on the edge, a trace from the other side may cross.
bool PlaneDetector::removePartsOf(const Arc& whole, std::vector<DetectedLine>* lines) const {
  constexpr double kSamePx =
      0.05;  // Else it is another edge's, which goes on in much the same way.
  const Eigen::Vector3d axis = whole.from.cross(whole.to);
  const auto isPart = [&](const DetectedLine& line) {
    for (const Eigen::Vector3d& ray : {line.arc.from, line.arc.at(0.5), line.arc.to}) {
      const auto J = rays_.camera().jacobian(ray);
      if (!J) return false;
      const double px_per_rad = J->norm();
      const double off_px = std::abs(whole.angleToPlane(ray)) * px_per_rad;
      const double sigma_px = std::sqrt(ray.dot(line.normal_cov * ray)) * px_per_rad;
      const double phi =
          std::atan2(axis.normalized().dot(whole.from.cross(ray)), whole.from.dot(ray));
      const double slack_rad = LineTracer::kQuadPx / px_per_rad;
      const bool is_between = phi >= -slack_rad && phi <= whole.angle() + slack_rad;
      if (!(off_px <= kSamePx + 2 * sigma_px && is_between)) return false;
    }
    return true;
  };
  return std::erase_if(*lines, isPart) > 0;
}

void PlaneDetector::claim() {
  for (const LineTracer::Quad& q : tracer_.quads()) {
    if (!q.is_edge) continue;
    forRows(q, [&](int x, int y) {
      for (int side = -1; side <= 1; ++side) {
        const int cx = q.crosses_rows ? x + side : x, cy = q.crosses_rows ? y : y + side;
        if (cx >= 0 && cy >= 0 && cx < claimed_.width && cy < claimed_.height) {
          claimed_.set(cx, cy);
        }
      }
    });
  }
}

void PlaneDetector::traceAll(std::vector<DetectedLine>* lines) {
  std::fill(claimed_.words.begin(), claimed_.words.end(), uint64_t{0});
  while (!pieces_.empty()) {
    order_.resize(pieces_.size());
    for (size_t i = 0; i < pieces_.size(); ++i) order_[i] = static_cast<uint32_t>(i);
    std::sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) {
      const int length_a = pieces_[a].length_px, length_b = pieces_[b].length_px;
      return length_a != length_b ? length_a > length_b : a < b;
    });
    rest_.clear();
    for (const uint32_t index : order_) {
      const PlanarPiece& piece = pieces_[index];
      if (isClaimed(piece) && !DLSD_MUTANT("lines-twice")) continue;
      trace(piece, lines);
      keepRest(piece);
    }
    pieces_.swap(rest_);
  }
}

/// What a trace leaves of a piece is looked at again by itself: the calibration is never exact, and
/// a piece may bend by more than an edge may be off.
void PlaneDetector::keepRest(const PlanarPiece& piece) {
  constexpr float kBentPx = 0.3F;
  constexpr uint32_t kMinNodes = 3;
  const uint32_t end = piece.first_node + piece.nodes;
  const auto isFree = [&](uint32_t node) {
    const Eigen::Vector2f& p = splitter_.nodes()[node];
    return !claimed_.contains(static_cast<int>(p.x() + 0.5F), static_cast<int>(p.y() + 0.5F));
  };
  for (uint32_t first = piece.first_node; first < end; ++first) {
    if (!isFree(first)) continue;
    uint32_t last = first;
    while (last + 1 < end && isFree(last + 1)) ++last;
    if (last - first + 1 == piece.nodes) {
      if (piece.farthest_px < kBentPx) return;
      for (const auto& [a, b] :
           {std::pair(first, piece.farthest_node), std::pair(piece.farthest_node, last)}) {
        if (b - a + 1 < kMinNodes) continue;
        if (const auto part = splitter_.part(piece, a, b)) rest_.push_back(*part);
      }
      return;
    }
    if (last - first + 1 >= kMinNodes) {
      if (const auto part = splitter_.part(piece, first, last)) rest_.push_back(*part);
    }
    first = last;
  }
}

void PlaneDetector::trace(const PlanarPiece& piece, std::vector<DetectedLine>* lines) {
  const auto traced = tracer_.trace(piece, splitter_.nodes());
  if (!traced || (traced->is_arc && !DLSD_MUTANT("arcs-are-lines"))) return;
  const size_t quads = tracer_.quads().size(), claimed = claimedQuads();
  const bool is_known = 2 * claimed >= quads && !DLSD_MUTANT("lines-twice");
  if (is_known && quads - claimed < LineTracer::kMinQuads) return;
  const double off_rad = DLSD_MUTANT("line-offset") ? 2e-4 : 0;
  const auto arc = visibleArc(rays_.camera(),
                              (traced->fit.normal + off_rad * traced->middle_ray).normalized(),
                              traced->from_ray,
                              traced->middle_ray,
                              traced->to_ray,
                              traced->is_inside);
  if (!arc) return;
  if (is_known && (DLSD_MUTANT("parts-stay") || !removePartsOf(*arc, lines))) return;
  claim();
  DetectedLine& line = lines->emplace_back();
  line.arc = *arc;
  line.rms_px = traced->rms_px;
  line.max_px = traced->max_px;
  line.length_px = traced->length_px;
  line.score = traced->score;
  line.contrast = traced->contrast;
  line.polarity = DLSD_MUTANT("polarity") ? 1 : traced->polarity;
  line.normal_cov = traced->fit.inverse_in_plane * (DLSD_MUTANT("line-covariance") ? 0.25 : 1) *
                    traced->variance_factor;
}

void PlaneDetector::detect(const ImageView& image,
                           const BitRows& usable,
                           const BitRows& seen,
                           std::vector<DetectedLine>* lines,
                           StageTimes* times) {
  {
    const StopWatch stage(&times->gradient);
    loadPixels(image);
    mapper_.compute(pixels_, usable, &map_);
  }
  {
    const StopWatch stage(&times->linking);
    linker_.link(&map_, &chains_);
  }
  {
    const StopWatch stage(&times->planes);
    splitter_.split(chains_, &pieces_);
  }
  const StopWatch stage(&times->validation);
  tracer_.setImage(pixels_, usable, seen, options_.edges.min_gradient / kGradientPerContrast);
  tracer_.measureBlur(pieces_, splitter_.nodes());
  traceAll(lines);
}

}  // namespace dlsd
