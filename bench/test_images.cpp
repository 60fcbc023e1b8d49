#include "bench/test_images.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "cameras/ray_table.h"
#include "detector/detector.h"
#include "detector/plane_curve.h"
#include "detector/plane_fit.h"
#include "evaluation/normal_bound.h"

namespace dlsd::bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// In [0, 1), a function of its arguments.
double uniform(uint64_t seed, uint64_t stream, uint64_t index) {
  uint64_t x = seed * 0x9e3779b97f4a7c15 + stream * 0xd1b54a32d192ed03 + index;
  for (int round = 0; round < 3; ++round) {
    x ^= x >> 32;
    x *= 0xd6e8feb86659fd93;
  }
  return static_cast<double>((x ^ x >> 32) >> 11) * 0x1p-53;
}

double gaussian(uint64_t seed, uint64_t stream, uint64_t index) {
  const double a = 1 - uniform(seed, stream, 2 * index), b = uniform(seed, stream, 2 * index + 1);
  return std::sqrt(-2 * std::log(a)) * std::cos(2 * M_PI * b);
}

/// The share of a pixel that is on the inner side of an edge d px inside of which its centre is,
/// with unit normal n, seen through the blur.
double shareInside(double d, const Vector2d& n, double blur_px) {
  if (blur_px > 0) {
    // Gauss-Legendre, three points along each axis of the pixel.
    constexpr std::array<double, 3> kAt{-0.3872983346207417, 0, 0.3872983346207417};
    constexpr std::array<double, 3> kWeight{5.0 / 18, 8.0 / 18, 5.0 / 18};
    double sum = 0;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = 0; j < 3; ++j) {
        const double at = d + kAt[i] * n.x() + kAt[j] * n.y();
        sum += kWeight[i] * kWeight[j] * 0.5 * std::erfc(-at / (std::sqrt(2.0) * blur_px));
      }
    }
    return sum;
  }
  // A half plane cuts a square: the integral of a trapezoid, two ramps of which subtract.
  const double a = std::max(std::abs(n.x()), std::abs(n.y()));
  const double b = std::max(1e-9, std::min(std::abs(n.x()), std::abs(n.y())));
  const auto square = [](double x) { return x > 0 ? x * x : 0; };
  const double lo = (a + b) / 2, hi = (a - b) / 2;
  return (square(d + lo) - square(d + hi) - square(d - hi) + square(d - lo)) / (2 * a * b);
}

/// Signed distance of a pixel to the image of a plane, positive where the plane's normal points to,
/// and the direction across.
struct Distance {
  double px;
  Vector2d normal;
};
Distance distanceTo(const RayTable& rays, const Vector2d& pixel, const Vector3d& plane) {
  const CurveOffset first = curveOffset(rays.at(pixel.x(), pixel.y()), plane);
  if (!(std::abs(first.offset_px) < 12)) return {first.offset_px, first.normal};
  double moved = 0;
  Vector2d foot = pixel;
  for (int i = 0; i < 3; ++i) {
    const auto ray = rays.camera().unproject(foot);
    if (!ray) break;
    const CurveOffset here =
        curveOffset(rays.at(std::clamp(foot.x(), -0.5, rays.camera().width() - 0.5),
                            std::clamp(foot.y(), -0.5, rays.camera().height() - 0.5)),
                    plane);
    const double step = ray->dot(plane) / here.rad_per_px;
    moved += step;
    foot = pixel - moved * first.normal;
  }
  return {moved, first.normal};
}

uint8_t greyLevel(double value) {
  return static_cast<uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
}

/// Cameras for the isolated lines, with what is expensive to make.
struct Setup {
  explicit Setup(const Camera& camera) : rays(camera), detector(camera) {}
  RayTable rays;
  Detector detector;
};
Setup& setupFor(int size, bool distorted) {
  static std::map<std::pair<int, bool>, std::unique_ptr<Setup>> setups;
  auto& setup = setups[{size, distorted}];
  if (!setup) {
    const double f = distorted ? 0.35 * size : size, c = 0.5 * size - 0.5;
    setup = std::make_unique<Setup>(
        distorted ? makeCamera("fov", std::array{f, f, c, c, 0.933271}, size, size)
                  : makeCamera("pinhole", std::array{f, f, c, c}, size, size));
  }
  return *setup;
}

}  // namespace

ImageView viewOf(const Pixels& image, const Camera& camera) {
  return {.data = image.data(),
          .width = camera.width(),
          .height = camera.height(),
          .stride_bytes = camera.width()};
}

LineErrors& LineErrors::operator+=(const LineErrors& other) {
  tried += other.tried;
  found += other.found;
  offset += other.offset;
  offset2 += other.offset2;
  offset_in_bounds2 += other.offset_in_bounds2;
  angle_in_bounds2 += other.angle_in_bounds2;
  own_sigmas2 += other.own_sigmas2;
  return *this;
}
double LineErrors::offsetInBounds() const {
  return std::sqrt(offset_in_bounds2 / found);
}
double LineErrors::angleInBounds() const {
  return std::sqrt(angle_in_bounds2 / found);
}
double LineErrors::ownSigmas() const {
  return std::sqrt(own_sigmas2 / found);
}

LineErrors detectIsolatedLine(const IsolatedLine& line, uint64_t seed) {
  const int size = static_cast<int>(line.has_corners ? 1.5 * line.length_px + 60 : line.length_px);
  Setup& setup = setupFor(size, line.distorted);
  const Camera& camera = setup.rays.camera();
  const auto draw = [&](uint64_t index) { return uniform(seed, 1, index); };

  // Corners counter-clockwise as seen in the image; side 0 is the line.
  const double turn = 2 * M_PI * draw(0);
  const Vector2d along(std::cos(turn), std::sin(turn)), across(-along.y(), along.x());
  Vector2d centre =
      Vector2d::Constant(0.5 * size - 0.5) + Vector2d(4 * draw(1) - 2, 4 * draw(2) - 2);
  const double half = line.length_px / 2;
  std::vector<Vector3d> planes;
  Vector2d from, to;
  if (line.has_corners) {
    const std::array<Vector2d, 4> corners{centre - half * along - half * across,
                                          centre + half * along - half * across,
                                          centre + half * along + half * across,
                                          centre - half * along + half * across};
    for (size_t i = 0; i < 4; ++i) {
      planes.push_back(camera.unproject(corners[i])
                           ->cross(*camera.unproject(corners[(i + 1) % 4]))
                           .normalized());
    }
    from = corners[0];
    to = corners[1];
  } else {
    // Farther out the camera would see more than half a great circle, which is no line.
    if (line.distorted) centre += 0.15 * size * across;
    // Two of its points; where it meets the border is found below.
    const Vector2d step = 0.2 * size * along;
    planes.push_back(
        camera.unproject(centre - step)->cross(*camera.unproject(centre + step)).normalized());
    const auto arc = arcBetween(*camera.unproject(centre - step), *camera.unproject(centre + step));
    const auto walk = [&](double direction) {
      Vector2d p = centre;
      for (;;) {
        Vector2d next = p + direction * 0.25 * along;
        if (!camera.inImage(next)) return p;
        const Distance d = distanceTo(setup.rays, next, arc->normal);
        next -= d.px * d.normal;
        if (!camera.inImage(next)) return p;
        p = next;
      }
    };
    from = walk(-1);
    to = walk(+1);
  }
  const double length_px = (to - from).norm();

  const double sign = draw(3) < 0.5 ? -1 : 1;
  const bool portable_side = distanceTo(setup.rays, centre, planes[0]).px >= 0;
  Pixels image(static_cast<size_t>(size * size));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      double inside = 1;
      for (const Vector3d& plane : planes) {
        const Distance d =
            distanceTo(setup.rays, {static_cast<double>(x), static_cast<double>(y)}, plane);
        const double px = line.has_corners && !portable_side ? -d.px : d.px;
        inside *= shareInside(px, d.normal, line.blur_px);
      }
      const auto i = static_cast<size_t>(y * size + x);
      image[i] = greyLevel(128 + sign * line.contrast * (inside - 0.5) +
                           line.noise * gaussian(seed, 2, i));
    }
  }

  LineErrors errors;
  errors.tried = 1;
  const Vector3d& normal = planes[0];
  const Vector2d middle = [&] {
    const Vector2d m = (from + to) / 2;
    const Distance d = distanceTo(setup.rays, m, normal);
    return Vector2d(m - d.px * d.normal);
  }();
  const auto offsetAt = [&](const Vector2d& pixel, const DetectedLine& detected) {
    const Vector2d inside(std::clamp(pixel.x(), -0.5, size - 0.5),
                          std::clamp(pixel.y(), -0.5, size - 0.5));
    const Distance detected_px = distanceTo(setup.rays, inside, detected.arc.normal);
    const Distance true_px = distanceTo(setup.rays, inside, normal);
    const double same = detected_px.normal.dot(true_px.normal) < 0 ? -1 : 1;
    return true_px.px - same * detected_px.px;
  };
  const DetectedLine* best = nullptr;
  for (const DetectedLine& detected : setup.detector.detect(viewOf(image, camera))) {
    if (detected.length_px < 0.5 * length_px) continue;
    if (!(std::abs(offsetAt(middle, detected)) < 2) || !(std::abs(offsetAt(from, detected)) < 4)) {
      continue;
    }
    if (best == nullptr || detected.length_px > best->length_px) best = &detected;
  }
  if (best == nullptr) return errors;
  errors.found = 1;
  // Positive: towards the brighter side.
  const bool plane_side = line.has_corners && !portable_side;
  const double offset = offsetAt(middle, *best) * sign * (plane_side ? -1 : 1);
  const double bound = offsetBoundPx({line.blur_px, line.noise}, line.contrast, length_px);
  errors.offset = offset;
  errors.offset2 = offset * offset;
  errors.offset_in_bounds2 = offset * offset / (bound * bound);
  const double turned = offsetAt(to, *best) - offsetAt(from, *best);
  errors.angle_in_bounds2 = turned * turned / (12 * bound * bound);
  const RaySample sample = setup.rays.at(middle.x(), middle.y());
  const double rad_per_px = curveOffset(sample, normal).rad_per_px;
  errors.own_sigmas2 =
      offset * offset * rad_per_px * rad_per_px / sample.ray.dot(best->normal_cov * sample.ray);
  return errors;
}

Pixels noiseImage(const Camera& camera, double sigma, double blur_px, uint64_t seed) {
  const int w = camera.width(), h = camera.height();
  const int radius = blur_px > 0 ? static_cast<int>(std::ceil(4 * blur_px)) : 0;
  std::vector<double> kernel(static_cast<size_t>(2 * radius + 1), 1);
  double sum2 = 0;
  for (int i = -radius; i <= radius && blur_px > 0; ++i) {
    kernel[static_cast<size_t>(i + radius)] = std::exp(-0.5 * i * i / (blur_px * blur_px));
  }
  for (const double k : kernel) sum2 += k * k;
  for (double& k : kernel) k /= std::sqrt(sum2);
  const int wide = w + 2 * radius, high = h + 2 * radius;
  std::vector<float> white(static_cast<size_t>(wide) * static_cast<size_t>(high));
  for (size_t i = 0; i < white.size(); ++i) white[i] = static_cast<float>(gaussian(seed, 3, i));
  std::vector<float> rows(static_cast<size_t>(w) * static_cast<size_t>(high));
  Pixels image(static_cast<size_t>(w) * static_cast<size_t>(h));
  for (int y = 0; y < high; ++y) {
    for (int x = 0; x < w; ++x) {
      double sum = 0;
      for (int i = 0; i <= 2 * radius; ++i) {
        sum += kernel[static_cast<size_t>(i)] *
               static_cast<double>(white[static_cast<size_t>(y * wide + x + i)]);
      }
      rows[static_cast<size_t>(y * w + x)] = static_cast<float>(sum);
    }
  }
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      double sum = 0;
      for (int i = 0; i <= 2 * radius; ++i) {
        sum += kernel[static_cast<size_t>(i)] *
               static_cast<double>(rows[static_cast<size_t>((y + i) * w + x)]);
      }
      image[static_cast<size_t>(y * w + x)] = greyLevel(127 + sigma * sum);
    }
  }
  return image;
}

DiscImage discImage(
    const Camera& camera, double radius_px, double noise, double blur_px, uint64_t seed) {
  const RayTable rays(camera);
  const int w = camera.width(), h = camera.height();
  // Around the image's middle, at random.
  const Vector2d centre((0.35 + 0.3 * uniform(seed, 4, 0)) * w,
                        (0.35 + 0.3 * uniform(seed, 4, 1)) * h);
  const RaySample at = rays.at(centre.x(), centre.y());
  const Vector3d axis = at.ray;
  const double cosine = std::cos(std::min(radius_px / at.pxPerRad(), 1.2));
  DiscImage disc;
  disc.image.resize(static_cast<size_t>(w) * static_cast<size_t>(h));
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const auto i = static_cast<size_t>(y * w + x);
      double inside = 0;
      if (rays.covers(x, y)) {
        const RaySample sample = rays.at(x, y);
        const Vector2d g(sample.du.dot(axis), sample.dv.dot(axis));
        const double slope = g.norm(), f = sample.ray.dot(axis) - cosine;
        const double d = slope > 1e-12 ? f / slope : (f > 0 ? 100.0 : -100.0);
        inside = std::abs(d) > 20 ? (d > 0 ? 1 : 0) : shareInside(d, g / slope, blur_px);
      }
      disc.image[i] = greyLevel(70 + 110 * inside + noise * gaussian(seed, 5, i));
    }
  }
  // The outline, every 2 px or less, as far as the image shows it.
  const Vector3d a = axis.unitOrthogonal(), b = axis.cross(a);
  const double sine = std::sqrt(1 - cosine * cosine);
  const int count = static_cast<int>(2 * M_PI * radius_px) + 16;
  std::vector<std::optional<Vector2d>> outline;
  for (int i = 0; i < 2 * count; ++i) {
    const double t = 2 * M_PI * i / count;
    const auto p = camera.project(cosine * axis + sine * (std::cos(t) * a + std::sin(t) * b));
    outline.push_back(p && camera.inImage(*p) && rays.covers(p->x(), p->y()) ? p : std::nullopt);
  }
  disc.longest_arc_px = 0;
  for (int begin = 0; begin < count; begin += 4) {
    std::vector<Vector3d> piece;
    double length = 0;
    for (int i = begin; i < begin + count && outline[static_cast<size_t>(i)]; ++i) {
      const Vector2d& p = *outline[static_cast<size_t>(i)];
      piece.push_back(*camera.unproject(p));
      if (i > begin) length += (p - *outline[static_cast<size_t>(i - 1)]).norm();
      if (piece.size() < 8 || length <= disc.longest_arc_px) continue;
      const auto fit = fitPlane(piece);
      if (!fit) continue;
      double largest = 0;
      for (int k = begin; k <= i; ++k) {
        const Vector2d& q = *outline[static_cast<size_t>(k)];
        largest =
            std::max(largest, std::abs(curveOffset(rays.at(q.x(), q.y()), fit->normal).offset_px));
      }
      if (largest > 0.5) break;
      disc.longest_arc_px = length;
    }
  }
  return disc;
}

}  // namespace dlsd::bench
