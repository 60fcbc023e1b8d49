#include "cameras/rectification.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "cameras/batch.h"
#include "cameras/mutant.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

[[noreturn]] void fail(const char* name, double value, const char* allowed) {
  std::ostringstream message;
  message << name << " = " << value << " is out of range: allowed is " << allowed;
  throw std::invalid_argument(message.str());
}

void check(const ViewRequest& request, int min_size) {
  const auto check_size = [&](const char* name, int size) {
    if (size < min_size || size > Camera::kMaxImageSize) {
      fail(name, size, min_size == 1 ? "[1, 65535]" : "[2, 65535]");
    }
  };
  static_assert(Camera::kMaxImageSize == 65535);
  check_size("view width", request.width);
  check_size("view height", request.height);
  if (request.fov_rad) {
    const double fov = *request.fov_rad;
    if (request.kind == ViewKind::kPinhole) {
      if (!(fov > 0 && fov < M_PI)) fail("fov_rad of a pinhole view", fov, "(0, pi) rad");
    } else if (!(fov > 0 && fov <= 2 * M_PI)) {
      fail("fov_rad", fov, "(0, 2 pi] rad");
    }
  }
  const Eigen::Matrix3d& r = request.cam_from_view;
  if (!((r * r.transpose() - Eigen::Matrix3d::Identity()).norm() <= 1e-9 && r.determinant() > 0)) {
    throw std::invalid_argument("cam_from_view is no rotation");
  }
}

constexpr double kSeamPx = 0.05;  ///< How far an image may miss the seam and still go around.

/// Whether the top and bottom borders of a panorama's image are the poles.
bool reachesPoles(const Camera& camera) {
  const auto* const sphere = std::get_if<Equirectangular>(&camera.model());
  return sphere != nullptr && std::abs(M_PI * sphere->fy - camera.height()) <= kSeamPx &&
         std::abs(sphere->cy - (camera.height() - 1) / 2.0) <= kSeamPx;
}

/// Unit ray in the view's frame.
std::optional<Vector3d> rayOfPlane(ViewKind kind, double s, double t) {
  if (kind == ViewKind::kPinhole) return Vector3d(s, t, 1).normalized();
  if (!(std::abs(s) <= M_PI)) return std::nullopt;
  if (kind == ViewKind::kCylindrical) return Vector3d(std::sin(s), t, std::cos(s)).normalized();
  if (!(std::abs(t) <= M_PI / 2)) return std::nullopt;
  return Vector3d(std::sin(s) * std::cos(t), std::sin(t), std::cos(s) * std::cos(t));
}

/// Which parts of a source's image may be interpolated.
class Source {
 public:
  explicit Source(const Camera& camera)
      : camera_(camera),
        width_(size_t(camera.width())),
        height_(size_t(camera.height())),
        around_(goesAround(camera)),
        has_poles_(around_ && reachesPoles(camera)) {
    std::vector<double> u(width_), v(width_), x(width_), y(width_), z(width_);
    for (size_t i = 0; i < width_; ++i) u[i] = double(i);
    has_ray_.resize(width_ * height_);
    for (size_t row = 0; row < height_; ++row) {
      std::fill(v.begin(), v.end(), double(row));
      const std::span<uint8_t> valid(&has_ray_[row * width_], width_);
      unprojectAll(camera, u, v, x, y, z, valid);
    }
  }

  [[nodiscard]] const Camera& camera() const { return camera_; }

  /// Where to interpolate for a projected ray: there, or within half a pixel of a pole in the row
  /// next to it. No value unless the pixels around, across the seam too, are in the image and have
  /// rays.
  [[nodiscard]] std::optional<Vector2d> shown(double u, double v) const {
    const auto last_column = double(width_ - 1), last_row = double(height_ - 1);
    const double beyond = around_ ? 0.5 + kSeamPx : 0;
    if (has_poles_ && v >= -0.5 - kSeamPx && v <= last_row + 0.5 + kSeamPx) {
      v = std::clamp(v, 0.0, last_row);
    }
    if (!(u >= -beyond && v >= 0 && u <= last_column + beyond && v <= last_row)) {
      return std::nullopt;
    }
    const double left = std::floor(u);
    const auto y = size_t(v);
    const size_t x0 = left < 0 ? width_ - 1 : size_t(left);
    const size_t x1 = u > left ? (x0 + 1) % width_ : x0;
    const uint8_t* row = &has_ray_[y * width_];
    const uint8_t* below = v > double(y) ? row + width_ : row;
    if ((row[x0] & row[x1] & below[x0] & below[x1]) == 0) return std::nullopt;
    return Vector2d(u, v);
  }

  /// The pixel of a ray that may be interpolated.
  [[nodiscard]] std::optional<Vector2d> pixelOf(const Vector3d& ray_in_cam) const {
    const std::optional<Vector2d> pixel = camera_.project(ray_in_cam);
    return pixel ? shown(pixel->x(), pixel->y()) : std::nullopt;
  }

  /// From one pixel to another, across the seam where that is the shorter way.
  [[nodiscard]] Vector2d step(const Vector2d& from, const Vector2d& to) const {
    Vector2d d = to - from;
    if (around_) d.x() -= double(width_) * std::round(d.x() / double(width_));
    return d;
  }

 private:
  const Camera& camera_;
  size_t width_, height_;
  bool around_, has_poles_;
  std::vector<uint8_t> has_ray_;
};

ViewMaps mapsOf(const Source& source, const VirtualView& view) {
  ViewMaps maps;
  maps.width = view.width;
  maps.height = view.height;
  const auto width = size_t(view.width), height = size_t(view.height);
  maps.u.resize(width * height);
  maps.v.resize(width * height);
  maps.valid.resize(width * height);
  std::vector<double> x(width), y(width), z(width), u(width), v(width);
  std::vector<uint8_t> valid(width);
  for (size_t row = 0; row < height; ++row) {
    for (size_t i = 0; i < width; ++i) {
      // No ray: a zero vector, which does not project.
      const Vector3d ray =
          view.rayInCam({double(i), double(row)}).value_or(Vector3d(Vector3d::Zero()));
      x[i] = ray.x();
      y[i] = ray.y();
      z[i] = ray.z();
    }
    projectAll(source.camera(), x, y, z, u, v, valid);
    for (size_t i = 0; i < width; ++i) {
      const std::optional<Vector2d> pixel = valid[i] != 0 ? source.shown(u[i], v[i]) : std::nullopt;
      if (!pixel) continue;
      const size_t at = row * width + i;
      maps.u[at] = float(pixel->x() + (DLSD_MUTANT("rectify-shift") ? 0.01 : 0));
      maps.v[at] = float(pixel->y());
      maps.valid[at] = 1;
    }
  }
  return maps;
}

/// Search for the crop. Rectangles are in angles (a, b), which are finite for every view:
/// s = tan a for a pinhole, else a; t = b for the equirectangular view, else tan b.
class CropSearch {
 public:
  struct Rectangle {
    double a0, a1, b0, b1;
  };

  CropSearch(const Source& source, const ViewRequest& request)
      : source_(source), request_(request) {
    const bool pinhole = request.kind == ViewKind::kPinhole;
    const double half = request.fov_rad.value_or(pinhole ? kPinholeCropFovRad : 2 * M_PI) / 2;
    constexpr double kFlat = M_PI / 2 - 1e-3;  // tan is 1000
    max_a_ = std::min(half, pinhole ? kFlat : M_PI);
    max_b_ = std::min(half, request.kind == ViewKind::kEquirectangular ? M_PI / 2 : kFlat);
  }

  [[nodiscard]] Crop run() const {
    std::optional<Rectangle> best = coarse();
    if (!best) return {};
    Rectangle r = *best;
    for (int round = 0; round < 2; ++round) {
      grow(&r, &Rectangle::a0, -max_a_);
      grow(&r, &Rectangle::a1, max_a_);
      grow(&r, &Rectangle::b0, -max_b_);
      grow(&r, &Rectangle::b1, max_b_);
    }
    const auto at = [](double value, double bound) { return std::abs(value - bound) < 1e-9; };
    Crop crop;
    crop.cut_by_fov =
        at(r.a0, -max_a_) || at(r.a1, max_a_) || at(r.b0, -max_b_) || at(r.b1, max_b_);
    // The sides were looked at; now every pixel.
    for (int trial = 0; trial < 200; ++trial) {
      const VirtualView view = viewOf(r);
      const ViewMaps maps = mapsOf(source_, view);
      if (std::find(maps.valid.begin(), maps.valid.end(), 0) == maps.valid.end()) {
        crop.view = view;
        return crop;
      }
      const double shrink = 1 - 1e-4 * (1 + trial);
      r = {r.a0 * shrink, r.a1 * shrink, r.b0 * shrink, r.b1 * shrink};
    }
    return {};
  }

 private:
  static constexpr int kHalf = 180;  // cells on each side of the axis

  [[nodiscard]] double planeS(double a) const {
    return request_.kind == ViewKind::kPinhole ? std::tan(a) : a;
  }
  [[nodiscard]] double planeT(double b) const {
    return request_.kind == ViewKind::kEquirectangular ? b : std::tan(b);
  }

  [[nodiscard]] std::optional<Vector2d> pixelOf(double a, double b) const {
    const std::optional<Vector3d> ray = rayOfPlane(request_.kind, planeS(a), planeT(b));
    return ray ? source_.pixelOf(request_.cam_from_view * *ray) : std::nullopt;
  }

  /// The best rectangle of whole cells around the axis.
  [[nodiscard]] std::optional<Rectangle> coarse() const {
    constexpr int kCells = 2 * kHalf;
    const double da = max_a_ / kHalf, db = max_b_ / kHalf;
    std::vector<std::optional<Vector2d>> nodes;
    for (int row = 0; row <= kCells; ++row) {
      for (int column = 0; column <= kCells; ++column) {
        nodes.push_back(pixelOf((column - kHalf) * da, (row - kHalf) * db));
      }
    }
    const auto node = [&](int row, int column) -> const std::optional<Vector2d>& {
      return nodes[size_t(row * (kCells + 1) + column)];
    };
    // Area in the source's image, summed over the cells above and to the left; reach: how many
    // cells of a row from the axis on are inside.
    std::vector<double> sums(nodes.size());
    const auto sum = [&](int row, int column) -> double& {
      return sums[size_t(row * (kCells + 1) + column)];
    };
    std::vector<int> left(kCells, 0), right(kCells, 0);
    for (int row = 0; row < kCells; ++row) {
      const auto inside = [&](int column) {
        return node(row, column) && node(row, column + 1) && node(row + 1, column) &&
               node(row + 1, column + 1);
      };
      for (int column = 0; column < kCells; ++column) {
        double area = 0;
        if (inside(column)) {
          const Vector2d p = source_.step(*node(row, column), *node(row + 1, column + 1));
          const Vector2d q = source_.step(*node(row, column + 1), *node(row + 1, column));
          area = std::abs(p.x() * q.y() - p.y() * q.x()) / 2;
        }
        sum(row + 1, column + 1) =
            area + sum(row, column + 1) + sum(row + 1, column) - sum(row, column);
      }
      auto& l = left[size_t(row)];
      auto& r = right[size_t(row)];
      while (l < kHalf && inside(kHalf - 1 - l)) ++l;
      while (r < kHalf && inside(kHalf + r)) ++r;
    }
    double best_area = 0;
    std::optional<Rectangle> best;
    int l_top = kHalf, r_top = kHalf;
    for (int top = kHalf - 1; top >= 0; --top) {
      l_top = std::min(l_top, left[size_t(top)]);
      r_top = std::min(r_top, right[size_t(top)]);
      int l = l_top, r = r_top;
      for (int bottom = kHalf; bottom < kCells; ++bottom) {
        l = std::min(l, left[size_t(bottom)]);
        r = std::min(r, right[size_t(bottom)]);
        const double area = sum(bottom + 1, kHalf + r) - sum(top, kHalf + r) -
                            sum(bottom + 1, kHalf - l) + sum(top, kHalf - l);
        if (l > 0 && r > 0 && area > best_area) {
          best_area = area;
          best = {-l * da, r * da, (top - kHalf) * db, (bottom + 1 - kHalf) * db};
        }
      }
    }
    return best;
  }

  [[nodiscard]] bool sidesInside(const Rectangle& r) const {
    constexpr int kPoints = 512;
    for (int i = 0; i <= kPoints; ++i) {
      const double f = double(i) / kPoints;
      const double a = r.a0 + f * (r.a1 - r.a0), b = r.b0 + f * (r.b1 - r.b0);
      if (!pixelOf(a, r.b0) || !pixelOf(a, r.b1) || !pixelOf(r.a0, b) || !pixelOf(r.a1, b)) {
        return false;
      }
    }
    return true;
  }

  /// Moves one side out, by at most two cells.
  void grow(Rectangle* r, double Rectangle::*side, double bound) const {
    double inside = r->*side;
    double outside = inside + std::clamp(bound - inside, -2 * max_a_ / kHalf, 2 * max_a_ / kHalf);
    Rectangle moved = *r;
    moved.*side = outside;
    if (sidesInside(moved)) {
      inside = outside;
    }
    while (std::abs(outside - inside) > 1e-6) {
      moved.*side = (inside + outside) / 2;
      (sidesInside(moved) ? inside : outside) = moved.*side;
    }
    r->*side = inside;
  }

  [[nodiscard]] VirtualView viewOf(const Rectangle& r) const {
    const double s0 = planeS(r.a0), s1 = planeS(r.a1), t0 = planeT(r.b0), t1 = planeT(r.b1);
    VirtualView view;
    view.kind = request_.kind;
    view.width = request_.width;
    view.height = request_.height;
    view.cam_from_view = request_.cam_from_view;
    view.fx = (view.width - 1) / (s1 - s0);
    view.fy = (view.height - 1) / (t1 - t0);
    view.cx = -s0 * view.fx;
    view.cy = -t0 * view.fy;
    return view;
  }

  const Source& source_;
  const ViewRequest& request_;
  double max_a_, max_b_;
};

}  // namespace

bool goesAround(const Camera& camera) {
  const auto* const sphere = std::get_if<Equirectangular>(&camera.model());
  return sphere != nullptr && std::abs(2 * M_PI * sphere->fx - camera.width()) <= kSeamPx &&
         std::abs(sphere->cx - (camera.width() - 1) / 2.0) <= kSeamPx;
}

std::optional<Vector3d> VirtualView::rayInCam(const Vector2d& pixel) const {
  const std::optional<Vector3d> ray =
      rayOfPlane(kind, (pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!ray) return std::nullopt;
  return Vector3d(cam_from_view * *ray);
}

std::optional<Vector2d> VirtualView::pixelOf(const Vector3d& ray_in_cam) const {
  const Vector3d ray = cam_from_view.transpose() * ray_in_cam;
  if (!norm2InRange(ray.squaredNorm())) return std::nullopt;
  double s = 0, t = 0;
  if (kind == ViewKind::kPinhole) {
    if (!(ray.z() > 0)) return std::nullopt;
    s = ray.x() / ray.z();
    t = ray.y() / ray.z();
  } else {
    const double r = std::hypot(ray.x(), ray.z());
    if (kind == ViewKind::kCylindrical && !(r > 0)) return std::nullopt;
    s = std::atan2(ray.x(), ray.z());
    t = kind == ViewKind::kCylindrical ? ray.y() / r : std::atan2(ray.y(), r);
  }
  const Vector2d pixel(fx * s + cx, fy * t + cy);
  if (!pixelInRange(pixel.x(), pixel.y())) return std::nullopt;
  return pixel;
}

std::optional<Camera> VirtualView::camera() const {
  if (kind == ViewKind::kCylindrical) return std::nullopt;
  return makeCamera(kind == ViewKind::kPinhole ? Pinhole::kName : Equirectangular::kName,
                    std::array{fx, fy, cx, cy},
                    width,
                    height);
}

VirtualView centredView(const ViewRequest& request) {
  check(request, 1);
  if (!request.fov_rad) throw std::invalid_argument("a centred view needs fov_rad");
  VirtualView view;
  view.kind = request.kind;
  view.width = request.width;
  view.height = request.height;
  view.cam_from_view = request.cam_from_view;
  const double half = *request.fov_rad / 2;
  view.fx = view.width / 2.0 / (request.kind == ViewKind::kPinhole ? std::tan(half) : half);
  view.fy = view.fx;
  view.cx = (view.width - 1) / 2.0;
  view.cy = (view.height - 1) / 2.0;
  return view;
}

Crop cropView(const Camera& source, const ViewRequest& request) {
  check(request, 2);
  return CropSearch(Source(source), request).run();
}

ViewMaps viewMaps(const Camera& source, const VirtualView& view) {
  return mapsOf(Source(source), view);
}

}  // namespace dlsd
