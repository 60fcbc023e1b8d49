#include "synth/render.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "cameras/batch.h"
#include "synth/dataset/random.h"

namespace dlsd {
namespace {

/// Surface indices of corners without a hit and without a ray.
constexpr int kNoRay = -2;

/// Marks all pixels that a curve passes, and those it passes within kMargin.
class PixelMask {
 public:
  PixelMask(int width, int height)
      : width_(width),
        height_(height),
        marked_(static_cast<size_t>(width) * static_cast<size_t>(height), 0) {}

  void markCurve(const std::vector<Eigen::Vector2d>& curve) {
    // Steps of a quarter pixel: between two of them a curve clips at most 1/8 px of a pixel's
    // corner, which the margin covers.
    for (size_t i = 1; i < curve.size(); ++i) {
      const Eigen::Vector2d d = curve[i] - curve[i - 1];
      const int steps = std::max(1, static_cast<int>(std::ceil(4 * d.norm())));
      for (int k = 0; k <= steps; ++k) markAround(curve[i - 1] + d * k / steps, kMargin);
    }
  }

  void markAround(const Eigen::Vector2d& p, double margin) {
    const int x0 = std::max(0, pixelOf(p.x() - margin));
    const int x1 = std::min(width_ - 1, pixelOf(p.x() + margin));
    const int y0 = std::max(0, pixelOf(p.y() - margin));
    const int y1 = std::min(height_ - 1, pixelOf(p.y() + margin));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        marked_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)] = 1;
      }
    }
  }

  [[nodiscard]] bool marked(size_t pixel) const { return marked_[pixel] != 0; }

 private:
  static constexpr double kMargin = 0.15;
  static int pixelOf(double x) {
    return static_cast<int>(std::floor(std::clamp(x, -2.0, 1e6) + 0.5));
  }

  int width_, height_;
  std::vector<uint8_t> marked_;
};

/// Round things so small in the image that all corners may miss them are marked whole.
void markSmallRounds(const Scene& scene, const Camera& camera, const Pose& pose, PixelMask* mask) {
  constexpr double kSmallPx = 4;
  const auto mark = [&](const Eigen::Vector3d& centre, double radius) {
    const Eigen::Vector3d c = pose.toCam(centre);
    const auto pixel = camera.project(c);
    const auto J = camera.jacobian(c);
    if (!pixel || !J || !(pixel->norm() < 1e6)) return;
    const double radius_px = J->norm() * radius;
    if (radius_px < kSmallPx) mask->markAround(*pixel, radius_px + 1);
  };
  for (const Sphere& s : scene.spheres) {
    mark(s.centre.cast<double>(), static_cast<double>(s.radius));
  }
  for (const Disc& d : scene.discs) {
    mark(d.centre.cast<double>(), static_cast<double>(d.radius));
  }
  for (const Face& face : scene.faces) {
    for (const Decal& d : face.decals) {
      if (d.shape == DecalShape::kEllipse) mark(face.at(d.centre), d.half.maxCoeff());
    }
  }
}

/// Casts rays from one point in packets and shades them.
class RayGun {
 public:
  RayGun(const Raycaster& raycaster, const Shader& shader, const Pose& pose)
      : raycaster_(raycaster),
        shader_(shader),
        origin_(pose.position_in_world),
        origin_f_(pose.position_in_world.cast<float>()),
        world_from_cam_(pose.cam_from_world.transpose().cast<float>()) {}

  void add(const Eigen::Vector3f& ray_in_cam) {
    const Eigen::Vector3f d = (world_from_cam_ * ray_in_cam).normalized();
    x_[count_] = d.x();
    y_[count_] = d.y();
    z_[count_] = d.z();
    ++count_;
  }
  [[nodiscard]] bool full() const { return count_ == Raycaster::kPacket; }
  [[nodiscard]] size_t count() const { return count_; }

  /// Casts what was added; then hits are read by index, until the next add after clear().
  void fire() {
    if (count_ > 0) {
      raycaster_.castPacket(origin_f_, x_.data(), y_.data(), z_.data(), count_, hits_.data());
    }
  }
  void clear() { count_ = 0; }

  [[nodiscard]] int surface(size_t i) const {
    return shader_.surfaceAt(hits_[i], origin_, direction(i));
  }
  [[nodiscard]] float radiance(size_t i, int surface) const {
    return shader_.radiance(hits_[i], origin_, direction(i), surface);
  }
  /// Shading varies slowly over a pixel, so one sample may speak for its surface.
  [[nodiscard]] bool isFlat(size_t i) const { return hits_[i].kind != HitKind::kSphere; }

 private:
  [[nodiscard]] Eigen::Vector3d direction(size_t i) const {
    return Eigen::Vector3f(x_[i], y_[i], z_[i]).cast<double>();
  }

  const Raycaster& raycaster_;
  const Shader& shader_;
  Eigen::Vector3d origin_;
  Eigen::Vector3f origin_f_;
  Eigen::Matrix3f world_from_cam_;
  size_t count_ = 0;
  alignas(64) std::array<float, Raycaster::kPacket> x_{}, y_{}, z_{};
  std::array<Hit, Raycaster::kPacket> hits_{};
};

struct CornerRow {
  std::vector<int> surface;
  std::vector<float> radiance;
};

void castCorners(const CameraRays& rays, int j, RayGun* gun, CornerRow* row) {
  const int columns = rays.width() + 1;
  row->surface.resize(static_cast<size_t>(columns));
  row->radiance.resize(static_cast<size_t>(columns));
  std::array<size_t, Raycaster::kPacket> slots{};
  const auto flush = [&] {
    gun->fire();
    for (size_t k = 0; k < gun->count(); ++k) {
      const int surface = gun->surface(k);
      row->surface[slots[k]] = surface;
      row->radiance[slots[k]] = gun->radiance(k, surface);
    }
    gun->clear();
  };
  gun->clear();
  for (int i = 0; i < columns; ++i) {
    const auto slot = static_cast<size_t>(i);
    if (!rays.cornerValid(i, j)) {
      row->surface[slot] = kNoRay;
      row->radiance[slot] = 0;
      continue;
    }
    slots[gun->count()] = slot;
    gun->add(rays.cornerRay(i, j));
    if (gun->full()) flush();
  }
  flush();
}

/// Sample k of the lattice comes as number m, so that any first few are spread over the pixel.
constexpr std::array<int, kFineSamples> bitReversedOrder() {
  std::array<int, kFineSamples> order{};
  for (int m = 0; m < kFineSamples; ++m) {
    int k = 0;
    for (int bit = 1, rest = m; bit < kFineSamples; bit *= 2, rest /= 2) k = 2 * k + rest % 2;
    order[static_cast<size_t>(m)] = k;
  }
  return order;
}

/// Radiance of one surface within a pixel: shaded at its first `limit` samples, counted at all.
struct SurfaceShare {
  int surface;
  int samples, shaded;
  double sum;
  [[nodiscard]] double mean() const { return sum / shaded; }
};

/// Mean over the pixel's square of kFineSamples samples.
float finePixel(
    const CameraRays& rays, int i, int j, uint64_t shift_bits, int shade_limit, RayGun* gun) {
  // Rank-1 lattice: both projections hit each of the 64 strata once, so edges along the axes are as
  // fine as 1/64 px, and 19 keeps the points apart in between (the best generator for 64).
  constexpr int kGenerator = 19;
  static constexpr std::array<int, kFineSamples> kOrder = bitReversedOrder();
  const double shift_u = static_cast<double>(shift_bits >> 40) * 0x1p-24;
  const double shift_v = static_cast<double>((shift_bits >> 8) & 0xffffffU) * 0x1p-24;
  const bool exact = rays.isExact(i, j);
  std::array<Eigen::Vector3f, 4> corners;
  if (!exact) {
    corners = {rays.cornerRay(i, j),
               rays.cornerRay(i + 1, j),
               rays.cornerRay(i, j + 1),
               rays.cornerRay(i + 1, j + 1)};
  }
  std::array<SurfaceShare, kFineSamples> shares;
  size_t share_count = 0;
  int samples = 0;
  gun->clear();
  for (int m = 0; m < kFineSamples; ++m) {
    const int k = kOrder[static_cast<size_t>(m)];
    double u = (k + 0.5) / kFineSamples + shift_u;
    double v = ((k * kGenerator) % kFineSamples + 0.5) / kFineSamples + shift_v;
    u -= std::floor(u);
    v -= std::floor(v);
    if (exact) {
      const auto ray = rays.camera().unproject({i - 0.5 + u, j - 0.5 + v});
      if (ray) gun->add(ray->cast<float>());
    } else {
      const auto a = static_cast<float>(u), b = static_cast<float>(v);
      gun->add((1 - b) * ((1 - a) * corners[0] + a * corners[1]) +
               b * ((1 - a) * corners[2] + a * corners[3]));
    }
    if (!gun->full() && m + 1 < kFineSamples) continue;
    gun->fire();
    for (size_t s = 0; s < gun->count(); ++s) {
      const int surface = gun->surface(s);
      size_t at = 0;
      while (at < share_count && shares[at].surface != surface) ++at;
      if (at == share_count) shares[share_count++] = {surface, 0, 0, 0};
      SurfaceShare& share = shares[at];
      ++share.samples;
      if (share.shaded < shade_limit || !gun->isFlat(s)) {
        share.sum += static_cast<double>(gun->radiance(s, surface));
        ++share.shaded;
      }
    }
    samples += static_cast<int>(gun->count());
    gun->clear();
  }
  if (samples == 0) return 0;
  double sum = 0;
  for (size_t k = 0; k < share_count; ++k) sum += shares[k].samples * shares[k].mean();
  return static_cast<float>(sum / samples);
}

}  // namespace

CameraRays::CameraRays(const Camera& camera) : camera_(camera) {
  const auto columns = static_cast<size_t>(width() + 1), rows = static_cast<size_t>(height() + 1);
  for (auto* plane : {&x_, &y_, &z_}) plane->resize(columns * rows);
  valid_.resize(columns * rows);
  exact_.resize((columns - 1) * (rows - 1));
  std::vector<double> u(columns), v(columns), x(columns), y(columns), z(columns);
  for (size_t j = 0; j < rows; ++j) {
    for (size_t i = 0; i < columns; ++i) {
      u[i] = static_cast<double>(i) - 0.5;
      v[i] = static_cast<double>(j) - 0.5;
    }
    const std::span<uint8_t> valid(valid_.data() + j * columns, columns);
    unprojectAll(camera_, u, v, x, y, z, valid);
    for (size_t i = 0; i < columns; ++i) {
      const bool ok = valid[i] != 0;
      x_[j * columns + i] = ok ? static_cast<float>(x[i]) : 0;
      y_[j * columns + i] = ok ? static_cast<float>(y[i]) : 0;
      z_[j * columns + i] = ok ? static_cast<float>(z[i]) : 1;
    }
  }
  // The interpolated ray of each pixel's centre must project back onto it.
  std::vector<uint8_t> valid(columns);
  for (size_t j = 0; j + 1 < rows; ++j) {
    const int jj = static_cast<int>(j);
    for (size_t i = 0; i + 1 < columns; ++i) {
      const int ii = static_cast<int>(i);
      const Eigen::Vector3d centre = (cornerRay(ii, jj) + cornerRay(ii + 1, jj) +
                                      cornerRay(ii, jj + 1) + cornerRay(ii + 1, jj + 1))
                                         .cast<double>();
      x[i] = centre.x();
      y[i] = centre.y();
      z[i] = centre.z();
    }
    projectAll(camera_, x, y, z, u, v, valid);
    for (size_t i = 0; i + 1 < columns; ++i) {
      const int ii = static_cast<int>(i);
      const bool corners_valid = cornerValid(ii, jj) && cornerValid(ii + 1, jj) &&
                                 cornerValid(ii, jj + 1) && cornerValid(ii + 1, jj + 1);
      const double err = std::hypot(u[i] - static_cast<double>(i), v[i] - static_cast<double>(j));
      const bool interpolates = corners_valid && valid[i] != 0 && err <= kMaxErrPx;
      exact_[j * (columns - 1) + i] = interpolates ? 0 : 1;
    }
  }
}

size_t CameraRays::exactCount() const {
  return static_cast<size_t>(std::count(exact_.begin(), exact_.end(), uint8_t{1}));
}

Rendering renderRadiance(const Scene& scene,
                         const Raycaster& raycaster,
                         const Shader& shader,
                         const CameraRays& rays,
                         const Pose& pose,
                         const std::vector<EdgeSpan>& spans,
                         uint64_t key,
                         Sampling sampling) {
  const int width = rays.width(), height = rays.height();
  PixelMask mask(width, height);
  if (sampling == Sampling::kAdaptive) {
    for (const EdgeSpan& span : spans) mask.markCurve(span.curve);
    markSmallRounds(scene, rays.camera(), pose, &mask);
  }
  // Shading varies slowly within a pixel: four spread samples of a surface speak for all of them.
  const int shade_limit = sampling == Sampling::kAdaptive ? 4 : kFineSamples;
  Rendering rendering;
  rendering.radiance.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
  RayGun gun(raycaster, shader, pose);
  CornerRow above, below;
  castCorners(rays, 0, &gun, &above);
  for (int j = 0; j < height; ++j) {
    castCorners(rays, j + 1, &gun, &below);
    for (int i = 0; i < width; ++i) {
      const auto c = static_cast<size_t>(i);
      const size_t pixel = static_cast<size_t>(j) * static_cast<size_t>(width) + c;
      const int s = above.surface[c];
      const bool one_surface =
          s == above.surface[c + 1] && s == below.surface[c] && s == below.surface[c + 1];
      float& out = rendering.radiance[pixel];
      if (sampling == Sampling::kEverywhere || !one_surface || mask.marked(pixel)) {
        out = finePixel(rays, i, j, hashCounters({key, pixel}), shade_limit, &gun);
        ++rendering.fine_pixels;
      } else {
        out = (above.radiance[c] + above.radiance[c + 1] + below.radiance[c] +
               below.radiance[c + 1]) /
              4;
      }
    }
    std::swap(above, below);
  }
  return rendering;
}

}  // namespace dlsd
