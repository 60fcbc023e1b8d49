#include "detector/detector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>

#include "detector/edge_drawing.h"
#include "detector/gradient.h"
#include "detector/line_tracer.h"
#include "detector/options.h"
#include "detector/planar_chain.h"
#include "detector/plane_fit.h"
#include "detector/polygonal_chain.h"
#include "detector/ray_table.h"
#include "detector/validation.h"

namespace dlsd {
namespace {

using Clock = std::chrono::steady_clock;

/// Adds the time between construction and destruction to a counter of seconds.
class StopWatch {
 public:
  explicit StopWatch(double* seconds) : seconds_(seconds), start_(Clock::now()) {}
  ~StopWatch() { *seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  StopWatch(const StopWatch&) = delete;
  StopWatch& operator=(const StopWatch&) = delete;

 private:
  double* seconds_;
  Clock::time_point start_;
};

/// Residuals of neighbouring edge points are correlated by the smoothing along the edge (kernel
/// variance 1.5 px^2), so N points are worth N / sqrt(4 pi 1.5).
constexpr double kPointsPerIndependentPoint = 4.34;

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

double curveLengthPx(const Camera& camera, const Arc& arc) {
  constexpr int kSamples = 32;
  double length = 0;
  std::optional<Eigen::Vector2d> previous = camera.project(arc.from);
  for (int i = 1; i <= kSamples; ++i) {
    const auto pixel = camera.project(arc.at(static_cast<double>(i) / kSamples));
    if (previous && pixel) length += (*pixel - *previous).norm();
    previous = pixel;
  }
  return length;
}

/// Whether the ray's projection onto the arc's plane is on the arc itself, not on the rest of the
/// great circle.
bool isOnArc(const Arc& arc, const Eigen::Vector3d& ray) {
  const double way = arc.normal.dot(arc.from.cross(arc.to)) < 0 ? -1 : 1;
  return way * arc.normal.dot(arc.from.cross(ray)) >= 0 &&
         way * arc.normal.dot(ray.cross(arc.to)) >= 0;
}

/// How far an arc stays in image and domain when walked from fraction t_from, which is inside,
/// towards t_to. Steps are short against the distance to the image border, at least kStepPx.
double lastInside(const Camera& camera, const Arc& arc, double t_from, double t_to) {
  constexpr double kStepPx = 1;
  constexpr double kSmallestStep = 1e-9;
  const auto inside = [&](double t) {
    const auto pixel = camera.project(arc.at(t));
    return pixel && camera.inImage(*pixel) ? pixel : std::nullopt;
  };
  std::optional<Eigen::Vector2d> here = inside(t_from);
  double t = t_from, step = (t_to - t_from) / 8;
  while (here && t != t_to) {
    if (std::abs(step) >= std::abs(t_to - t)) step = t_to - t;
    const double next_t = step == t_to - t ? t_to : t + step;
    const auto next = inside(next_t);
    const double border_px = std::min({here->x() + 0.5,
                                       camera.width() - 0.5 - here->x(),
                                       here->y() + 0.5,
                                       camera.height() - 0.5 - here->y()});
    if (next && (*next - *here).norm() <= std::max(kStepPx, border_px / 2)) {
      t = next_t;
      here = next;
      step *= 2;
    } else {
      step /= 2;
      if (!(std::abs(step) > kSmallestStep)) break;
    }
  }
  return t;
}

/// The part of the arc around its middle whose image stays in image and domain. No value if there
/// is none.
std::optional<Arc> clippedToImage(const Camera& camera, const Arc& arc) {
  constexpr double kMiddle = 0.5;
  const double t0 = lastInside(camera, arc, kMiddle, 0), t1 = lastInside(camera, arc, kMiddle, 1);
  if (!(t1 > t0)) return std::nullopt;
  Arc clipped = arc;
  if (t0 > 0) clipped.from = arc.at(t0);
  if (t1 < 1) clipped.to = arc.at(t1);
  return clipped;
}

}  // namespace

struct Detector::Impl {
  Impl(const Camera& the_camera, const DetectorOptions& the_options)
      : camera((the_options.check(), the_camera)),
        options(the_options),
        rays(camera),
        filter(camera.width(), camera.height(), rays.usable()),
        drawer(camera.width(), camera.height(), options.edges),
        tracer(rays, options.validation),
        claimed(rays.usable().size()) {}

  struct Seed {
    TraceSeed trace;
    uint32_t begin, end;  // in chains.pixels
  };

  void detectConvexPolygons();
  void detectPlanarPieces();
  void collectSeeds();
  void traceSeeds();
  void addPolygon(std::span<const Eigen::Vector2d> pixels, std::span<const StraightPiece> group);
  /// Appends a line for the caller to complete: what the image shows of the fitted plane from end
  /// to end by way of the middle ray. Null if that is nothing, or a half turn or more: no 3D line.
  DetectedLine* addLine(const PlaneFit& fit,
                        const Eigen::Vector3d& from_ray,
                        const Eigen::Vector3d& middle_ray,
                        const Eigen::Vector3d& to_ray);
  [[nodiscard]] bool isClaimed(ChainPixel p) const { return claimed[field.at(p.x, p.y)] != 0; }
  void claim(const std::vector<uint32_t>& pixels, const std::vector<uint8_t>& along_x);

  Camera camera;
  DetectorOptions options;
  RayTable rays;
  GradientFilter filter;
  EdgeDrawer drawer;
  LineTracer tracer;

  GradientField field;
  EdgeThresholds thresholds;
  double noise = 0;
  EdgeChains chains;
  std::vector<DetectedLine> lines;
  StageTimes times;

  std::vector<Eigen::Vector2d> points;
  std::vector<StraightPiece> straight;
  std::vector<ConvexGroup> groups;
  std::vector<Eigen::Vector3d> group_rays;
  ChainRays chain_rays;
  std::vector<PlanarPiece> planar;
  std::vector<Seed> seeds;
  std::vector<uint32_t> seed_order;
  std::vector<uint8_t> claimed;  // one byte per pixel
};

DetectedLine* Detector::Impl::addLine(const PlaneFit& fit,
                                      const Eigen::Vector3d& from_ray,
                                      const Eigen::Vector3d& middle_ray,
                                      const Eigen::Vector3d& to_ray) {
  const auto traced = arcOnPlane(fit.normal, from_ray, to_ray);
  if (!traced || !isOnArc(*traced, middle_ray)) return nullptr;
  const auto arc = clippedToImage(camera, *traced);
  if (!arc) return nullptr;
  const auto from_px = camera.project(arc->from), to_px = camera.project(arc->to);
  if (!from_px || !to_px) return nullptr;
  DetectedLine& line = lines.emplace_back();
  line.arc = *arc;
  line.from_px = *from_px;
  line.to_px = *to_px;
  return &line;
}

void Detector::Impl::addPolygon(std::span<const Eigen::Vector2d> pixels,
                                std::span<const StraightPiece> group) {
  const int begin = group.front().begin, end = group.back().end;
  if (group.size() == 1 && end - begin < options.polygons.min_single_px) return;

  const auto pixel = [&](int i) -> const Eigen::Vector2d& {
    return pixels[static_cast<size_t>(i)];
  };
  const auto x = [&](int i) { return static_cast<int>(std::lround(pixel(i).x())); };
  const auto y = [&](int i) { return static_cast<int>(std::lround(pixel(i).y())); };
  std::optional<PlaneFit> fit;
  {
    const StopWatch watch(&times.planes);
    group_rays.clear();
    for (int i = begin; i < end; ++i) group_rays.push_back(rays.at(x(i), y(i)));
    fit = fitPlane(group_rays);
  }
  if (!fit) return;

  const StopWatch watch(&times.validation);
  for (const StraightPiece& piece : group) {
    for (const int i : {piece.begin, piece.end - 1}) {
      const auto err = reprojectionErrorPx(camera, pixel(i), fit->normal);
      if (!err || !(*err <= options.validation.rho_px)) return;
    }
  }
  AlignmentCounter alignment;
  double sum2 = 0, max_px = 0, fit_sum2 = 0, side = 0;
  for (int i = begin; i < end; ++i) {
    const RaySample sample = rays.at(pixel(i).x(), pixel(i).y());
    const CurveOffset curve = curveOffset(sample, fit->normal);
    const double err = reprojectionErrorFirstOrder(sample, fit->normal);
    sum2 += err * err;
    max_px = std::max(max_px, err);
    const double f = sample.ray.dot(fit->normal);
    fit_sum2 += f * f;
    const size_t k = field.at(x(i), y(i));
    const double gx = field.gx[k], gy = field.gy[k];
    alignment.add(gx, gy, curve.normal, true);
    side += gx * curve.normal.x() + gy * curve.normal.y();
  }
  DetectedLine* line =
      addLine(*fit, group_rays.front(), group_rays[group_rays.size() / 2], group_rays.back());
  if (line == nullptr) return;
  const double count = end - begin;
  line->rms_px = std::sqrt(sum2 / count);
  line->max_px = max_px;
  line->length_px = curveLengthPx(camera, line->arc);
  line->score = alignment.score(field.width, field.height);
  line->polarity = side < 0 ? -1 : 1;
  line->normal_cov = fit->inverse_in_plane * (fit_sum2 / count * kPointsPerIndependentPoint);
}

void Detector::Impl::detectConvexPolygons() {
  for (size_t c = 0; c < chains.count(); ++c) {
    {
      const StopWatch watch(&times.chains);
      points.clear();
      for (uint32_t i = chains.starts[c]; i < chains.starts[c + 1]; ++i) {
        points.emplace_back(chains.pixels[i].x, chains.pixels[i].y);
      }
      splitStraight(points, options.polygons, &straight);
      groupConvex(straight, options.polygons, &groups);
    }
    for (const ConvexGroup& g : groups) {
      const auto pieces = std::span<const StraightPiece>(straight);
      addPolygon(
          points,
          pieces.subspan(static_cast<size_t>(g.first), static_cast<size_t>(g.last - g.first)));
    }
  }
}

void Detector::Impl::collectSeeds() {
  seeds.clear();
  for (size_t c = 0; c < chains.count(); ++c) {
    const uint32_t begin = chains.starts[c], end = chains.starts[c + 1];
    {
      const StopWatch watch(&times.chains);
      chain_rays.clear();
      points.clear();
      for (uint32_t i = begin; i < end; ++i) {
        const ChainPixel p = chains.pixels[i];
        CrestOffset offset{0, 0};
        if (options.edges.subpixel) offset = crestOffset(field, p.x, p.y);
        points.emplace_back(p.x + offset.dx, p.y + offset.dy);
        const RaySample sample = rays.at(points.back().x(), points.back().y());
        chain_rays.add(sample.ray, sample.pxPerRad());
      }
    }
    const StopWatch watch(&times.planes);
    splitPlanar(chain_rays, options.planes, &planar);
    for (const PlanarPiece& piece : planar) {
      Seed seed;
      seed.begin = begin + static_cast<uint32_t>(piece.begin);
      seed.end = begin + static_cast<uint32_t>(piece.end);
      double magnitude = 0;
      for (uint32_t i = seed.begin; i < seed.end; ++i) {
        magnitude += field.magnitude[field.at(chains.pixels[i].x, chains.pixels[i].y)];
      }
      seed.trace.normal = piece.normal;
      seed.trace.moments = chain_rays.moments.interval(piece.begin, piece.end);
      seed.trace.points = piece.end - piece.begin;
      seed.trace.rms_px = piece.rms_px;
      seed.trace.gradient = magnitude / (piece.end - piece.begin);
      seed.trace.start_px = points[static_cast<size_t>((piece.begin + piece.end) / 2)];
      seeds.push_back(seed);
    }
  }
  seed_order.resize(seeds.size());
  for (size_t i = 0; i < seeds.size(); ++i) seed_order[i] = static_cast<uint32_t>(i);
  std::sort(seed_order.begin(), seed_order.end(), [&](uint32_t a, uint32_t b) {
    const uint32_t length_a = seeds[a].end - seeds[a].begin;
    const uint32_t length_b = seeds[b].end - seeds[b].begin;
    return length_a != length_b ? length_a > length_b : a < b;
  });
}

void Detector::Impl::claim(const std::vector<uint32_t>& pixels,
                           const std::vector<uint8_t>& along_x) {
  for (size_t i = 0; i < pixels.size(); ++i) {
    const size_t across = along_x[i] != 0 ? 1 : static_cast<size_t>(field.width);
    claimed[pixels[i] - across] = claimed[pixels[i]] = claimed[pixels[i] + across] = 1;
  }
}

void Detector::Impl::traceSeeds() {
  const StopWatch watch(&times.validation);
  std::fill(claimed.begin(), claimed.end(), uint8_t{0});
  const ValidationOptions& v = options.validation;
  for (const uint32_t index : seed_order) {
    const Seed& seed = seeds[index];
    uint32_t taken = 0;
    for (uint32_t i = seed.begin; i < seed.end; ++i) taken += isClaimed(chains.pixels[i]) ? 1 : 0;
    if (2 * taken >= seed.end - seed.begin) continue;

    const auto traced = tracer.trace(field, thresholds, noise, seed.trace);
    if (!traced) continue;
    if (traced->length_px < v.min_length_px || traced->score < v.min_score) continue;
    if (traced->is_arc) continue;
    size_t shared = 0;
    for (const uint32_t pixel : tracer.crestPixels()) shared += claimed[pixel];
    if (2 * shared >= tracer.crestPixels().size()) continue;
    DetectedLine* line = addLine(traced->fit, traced->from_ray, traced->middle_ray, traced->to_ray);
    if (line == nullptr) continue;
    claim(tracer.crestPixels(), tracer.crestAlongX());
    line->rms_px = traced->rms_px;
    line->max_px = traced->max_px;
    line->length_px = traced->length_px;
    line->score = traced->score;
    line->polarity = traced->polarity;
    // Two parameters are fitted.
    const double degrees = std::max(traced->edge_points - 2, 1);
    line->normal_cov = traced->fit.inverse_in_plane *
                       (traced->fit.squared_residuals / degrees * kPointsPerIndependentPoint);
  }
}

void Detector::Impl::detectPlanarPieces() {
  collectSeeds();
  traceSeeds();
}

Detector::Detector(const Camera& camera) : Detector(camera, DetectorOptions{}) {}
Detector::Detector(const Camera& camera, const DetectorOptions& options)
    : impl_(std::make_unique<Impl>(camera, options)) {}
Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

const std::vector<DetectedLine>& Detector::detect(const ImageView& image) {
  Impl& d = *impl_;
  checkView(image, d.camera);
  d.times = {};
  d.lines.clear();
  const StopWatch watch(&d.times.total);
  {
    const StopWatch stage(&d.times.gradient);
    d.filter.compute(image, &d.field);
    const bool measures_noise =
        d.options.edges.anchor_noise_ratio > 0 || d.options.edges.min_noise_ratio > 0;
    d.noise = measures_noise ? d.filter.noise(d.field) : 0;
    d.thresholds = edgeThresholds(d.options.edges, d.noise);
  }
  {
    const StopWatch stage(&d.times.anchors);
    d.drawer.findAnchors(d.field, d.thresholds);
  }
  {
    const StopWatch stage(&d.times.linking);
    d.drawer.link(d.field, d.thresholds, &d.chains);
  }
  if (d.options.method == DetectorOptions::Method::kConvexPolygons) {
    d.detectConvexPolygons();
  } else {
    d.detectPlanarPieces();
  }
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
  return impl_->camera;
}

}  // namespace dlsd
