#pragma once
// Painted scenes for the detector's tests, independent of synth: shapes on the unit sphere (convex
// polygons of great circles, and cones as curved distractors), painted one over the other, rendered
// through any camera by supersampling, with labels from the shapes themselves. For tests only.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "cameras/arc.h"
#include "cameras/batch.h"
#include "cameras/camera.h"
#include "detector/detector.h"

namespace dlsd::test {

/// Uniform in [0, 1), a function of (seed, index): splitmix64's finaliser.
inline double uniform(uint64_t seed, uint64_t index) {
  uint64_t z = seed * 0x9e3779b97f4a7c15ULL + index * 0xbf58476d1ce4e5b9ULL + 0x94d049bb133111ebULL;
  for (int i = 0; i < 2; ++i) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    z ^= z >> 31;
  }
  return static_cast<double>(z >> 11) * 0x1p-53;
}

inline double gaussian(uint64_t seed, uint64_t index) {
  const double a = 1 - uniform(seed, 2 * index), b = uniform(seed, 2 * index + 1);
  return std::sqrt(-2 * std::log(a)) * std::cos(2 * M_PI * b);
}

struct Shape {
  std::vector<Eigen::Vector3d> vertices;  ///< Convex polygon, or empty for a cone.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double cos_radius = 1;  ///< Of the cone.
  double grey = 0;

  [[nodiscard]] bool contains(const Eigen::Vector3d& ray) const {
    if (vertices.empty()) return ray.dot(axis) >= cos_radius;
    for (size_t i = 0; i < vertices.size(); ++i) {
      const auto& a = vertices[i];
      const auto& b = vertices[(i + 1) % vertices.size()];
      if (a.cross(b).dot(ray) < 0) return false;
    }
    return ray.dot(axis) > 0;
  }
};

/// Vertices on the cone of that radius (rad, < pi / 2) around the axis.
inline Shape polygon(const Eigen::Vector3d& axis,
                     double radius_rad,
                     const std::vector<double>& angles_rad,
                     double grey) {
  Shape shape;
  shape.axis = axis.normalized();
  const Eigen::Vector3d a = shape.axis.unitOrthogonal(), b = shape.axis.cross(a);
  for (const double t : angles_rad) {
    shape.vertices.push_back(std::cos(radius_rad) * shape.axis +
                             std::sin(radius_rad) * (std::cos(t) * a + std::sin(t) * b));
  }
  shape.grey = grey;
  return shape;
}

inline Shape cone(const Eigen::Vector3d& axis, double radius_rad, double grey) {
  Shape shape;
  shape.axis = axis.normalized();
  shape.cos_radius = std::cos(radius_rad);
  shape.grey = grey;
  return shape;
}

struct Scene {
  double background = 60;
  std::vector<Shape> shapes;  ///< Later ones cover earlier ones.

  [[nodiscard]] int shapeAt(const Eigen::Vector3d& ray) const {
    for (size_t i = shapes.size(); i-- > 0;) {
      if (shapes[i].contains(ray)) return static_cast<int>(i);
    }
    return -1;
  }
  [[nodiscard]] double greyOf(int shape) const {
    return shape < 0 ? background : shapes[static_cast<size_t>(shape)].grey;
  }
};

/// Saved cases carry it: raised with each change after which a seed paints another picture.
inline constexpr const char* kSceneVersion = "painted/1";

/// Random convex polygons (and cones) over the field of view up to `max_angle_rad` from +z.
inline Scene randomScene(uint64_t seed, int polygons, int cones, double max_angle_rad) {
  Scene scene;
  uint64_t k = 0;
  const auto u = [&] { return uniform(seed, k++); };
  scene.background = 40 + 60 * u();
  for (int i = 0; i < polygons + cones; ++i) {
    const double theta = max_angle_rad * std::sqrt(u()), phi = 2 * M_PI * u();
    const Eigen::Vector3d axis(
        std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    const double radius = (6 + 26 * u()) * M_PI / 180;
    const double grey = 255 * u();
    if (i >= polygons) {
      scene.shapes.push_back(cone(axis, radius / 2, grey));
      continue;
    }
    const int corners = 3 + static_cast<int>(3 * u());
    std::vector<double> angles;
    const double start = 2 * M_PI * u();
    for (int c = 0; c < corners; ++c) {
      angles.push_back(start + 2 * M_PI * (c + 0.5 * u()) / corners);
    }
    scene.shapes.push_back(polygon(axis, radius, angles, grey));
  }
  return scene;
}

/// Which shapes the camera sees at pixels; buffers for as many as are asked for at once.
class ShapeFinder {
 public:
  static constexpr int kNoRay = -2;

  ShapeFinder(const Scene& scene, const Camera& camera) : scene_(scene), camera_(camera) {}

  /// One per pixel: the index of a shape, -1 for the background, kNoRay.
  void find(const std::vector<double>& u, const std::vector<double>& v, std::vector<int>* shapes) {
    const size_t n = u.size();
    for (std::vector<double>* axis : {&x_, &y_, &z_}) axis->resize(n);
    valid_.resize(n);
    shapes->resize(n);
    unprojectAll(camera_, u, v, x_, y_, z_, valid_);
    for (size_t i = 0; i < n; ++i) {
      (*shapes)[i] = valid_[i] != 0 ? scene_.shapeAt({x_[i], y_[i], z_[i]}) : kNoRay;
    }
  }

  [[nodiscard]] double greyOf(int shape) const {
    return shape == kNoRay ? 0.0 : scene_.greyOf(shape);
  }

 private:
  const Scene& scene_;
  const Camera& camera_;
  std::vector<double> x_, y_, z_;
  std::vector<uint8_t> valid_;
};

/// Gaussian blur out to four standard deviations, borders repeated.
inline void blur(std::vector<float>* image, int width, int height, double blur_px) {
  if (!(blur_px > 0)) return;
  const int radius = static_cast<int>(std::ceil(4 * blur_px));
  std::vector<float> kernel;
  float total = 0;
  for (int i = -radius; i <= radius; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (blur_px * blur_px))));
    total += kernel.back();
  }
  for (float& k : kernel) k /= total;
  const size_t w = static_cast<size_t>(width), taps = kernel.size();
  std::vector<float> pass(image->size()), padded(w + taps - 1);
  for (size_t row = 0; row < image->size(); row += w) {
    for (size_t i = 0; i < padded.size(); ++i) {
      padded[i] = (*image)[row + static_cast<size_t>(
                                     std::clamp(static_cast<int>(i) - radius, 0, width - 1))];
    }
    for (size_t k = 0; k < taps; ++k) {
      for (size_t x = 0; x < w; ++x) pass[row + x] += kernel[k] * padded[x + k];
    }
  }
  std::fill(image->begin(), image->end(), 0.0F);
  for (int y = 0; y < height; ++y) {
    float* to = image->data() + static_cast<size_t>(y) * w;
    for (size_t k = 0; k < taps; ++k) {
      const int row = std::clamp(y + static_cast<int>(k) - radius, 0, height - 1);
      const float* from = pass.data() + static_cast<size_t>(row) * w;
      for (size_t x = 0; x < w; ++x) to[x] += kernel[k] * from[x];
    }
  }
}

/// Box filter over the pixel (8 x 8 samples where shapes meet), then optical blur. Pixels without
/// a ray are black.
inline std::vector<float> render(const Scene& scene, const Camera& camera, double blur_px = 0.7) {
  const int w = camera.width(), h = camera.height();
  const size_t width = static_cast<size_t>(w);
  ShapeFinder finder(scene, camera);
  std::vector<double> u(width), v(width);
  std::vector<int> row, shapes;
  for (size_t x = 0; x < width; ++x) u[x] = static_cast<double>(x);
  for (int y = 0; y < h; ++y) {
    std::fill(v.begin(), v.end(), y);
    finder.find(u, v, &row);
    shapes.insert(shapes.end(), row.begin(), row.end());
  }
  const auto at = [&](int x, int y) {
    return static_cast<size_t>(std::clamp(y, 0, h - 1)) * width +
           static_cast<size_t>(std::clamp(x, 0, w - 1));
  };
  constexpr int kSub = 8;
  std::vector<float> image(shapes.size());
  std::vector<size_t> mixed;
  for (int y = 0; y < h; ++y) {
    mixed.clear();
    u.clear();
    v.clear();
    for (int x = 0; x < w; ++x) {
      bool same = true;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx)
          same = same && shapes[at(x + dx, y + dy)] == shapes[at(x, y)];
      }
      image[at(x, y)] = static_cast<float>(finder.greyOf(shapes[at(x, y)]));
      if (same) continue;
      mixed.push_back(at(x, y));
      for (int j = 0; j < kSub; ++j) {
        for (int i = 0; i < kSub; ++i) {
          u.push_back(x + (i + 0.5) / kSub - 0.5);
          v.push_back(y + (j + 0.5) / kSub - 0.5);
        }
      }
    }
    finder.find(u, v, &row);
    for (size_t i = 0; i < mixed.size(); ++i) {
      double sum = 0;
      for (size_t k = i * kSub * kSub; k < (i + 1) * kSub * kSub; ++k) {
        sum += finder.greyOf(row[k]);
      }
      image[mixed[i]] = static_cast<float>(sum / (kSub * kSub));
    }
  }
  blur(&image, w, h, blur_px);
  return image;
}

inline std::vector<uint8_t> toU8(const std::vector<float>& image, double noise, uint64_t seed) {
  std::vector<uint8_t> out(image.size());
  for (size_t i = 0; i < image.size(); ++i) {
    const double v = static_cast<double>(image[i]) + (noise > 0 ? noise * gaussian(seed, i) : 0.0);
    out[i] = static_cast<uint8_t>(std::clamp(v + 0.5, 0.0, 255.0));
  }
  return out;
}

inline ImageView viewOf(const std::vector<uint8_t>& image, const Camera& camera) {
  return {.data = image.data(),
          .width = camera.width(),
          .height = camera.height(),
          .stride_bytes = camera.width()};
}

/// A visible piece of a polygon's side; points every 1 px or less along its image.
struct Label {
  int carrier = 0;
  std::vector<Eigen::Vector2d> points;
  std::vector<double> contrasts;
  double angle_rad = 0, length_px = 0, contrast = 0;
  double clearance_px = 1e9;  ///< Least distance to edges other than those that meet at its ends.
};

/// Edges of all shapes as sampled points, cones and the rim included: what a label must keep clear
/// of.
inline std::vector<Label> labelsOf(const Scene& scene, const Camera& camera) {
  std::vector<Label> labels;
  std::vector<Label> curves;  // distractors
  int carrier = 0;
  const double step_rad = 0.002;  // at most 1 px
  const auto greyBeside = [&](const Eigen::Vector3d& ray, const Eigen::Vector3d& side) {
    return scene.greyOf(scene.shapeAt((ray + side * (1.5 / 300)).normalized()));
  };
  for (size_t s = 0; s < scene.shapes.size(); ++s) {
    const Shape& shape = scene.shapes[s];
    const bool is_cone = shape.vertices.empty();
    const size_t sides = is_cone ? 1 : shape.vertices.size();
    for (size_t i = 0; i < sides; ++i, ++carrier) {
      std::optional<Arc> arc;
      const Eigen::Vector3d a = shape.axis.unitOrthogonal(), b = shape.axis.cross(a);
      double total = 2 * M_PI;
      if (!is_cone) {
        arc = arcBetween(shape.vertices[i], shape.vertices[(i + 1) % sides]);
        total = arc->angle();
      }
      const int count = static_cast<int>(total / step_rad) + 2;
      Label label;
      Eigen::Vector3d first, last;
      const auto finish = [&] {
        if (label.points.size() > 1) {
          label.carrier = carrier;
          label.angle_rad = std::acos(std::clamp(first.dot(last), -1.0, 1.0));
          for (size_t k = 1; k < label.points.size(); ++k) {
            label.length_px += (label.points[k] - label.points[k - 1]).norm();
          }
          // Robust to what lies under single points: the 10 % quantile.
          std::vector<double> sorted = label.contrasts;
          std::sort(sorted.begin(), sorted.end());
          label.contrast = sorted[sorted.size() / 10];
          (is_cone ? curves : labels).push_back(label);
        }
        label = Label{};
      };
      for (int k = 0; k <= count; ++k) {
        const double t = static_cast<double>(k) / count;
        Eigen::Vector3d ray, side;
        if (is_cone) {
          const double r = std::sqrt(1 - shape.cos_radius * shape.cos_radius);
          const Eigen::Vector3d radial = std::cos(2 * M_PI * t) * a + std::sin(2 * M_PI * t) * b;
          ray = shape.cos_radius * shape.axis + r * radial;
          side = shape.cos_radius * radial - r * shape.axis;
        } else {
          ray = arc->at(t);
          side = arc->normal;
        }
        bool visible = true;
        for (size_t c = s + 1; c < scene.shapes.size() && visible; ++c) {
          visible = !scene.shapes[c].contains(ray);
        }
        const auto pixel = camera.project(ray);
        visible = visible && pixel && camera.inImage(*pixel);
        if (!visible) {
          finish();
          continue;
        }
        if (label.points.empty()) first = ray;
        last = ray;
        label.points.push_back(*pixel);
        label.contrasts.push_back(std::abs(greyBeside(ray, side) - greyBeside(ray, -side)));
      }
      finish();
    }
  }
  // Clearance, sampled every few points.
  for (Label& label : labels) {
    const Eigen::Vector2d ends[2] = {label.points.front(), label.points.back()};
    const auto keepClear = [&](const Label& other) {
      // Edges that meet a label's end are its corner: left out within 15 px of the meeting point.
      for (size_t k = 0; k < other.points.size(); k += 2) {
        const Eigen::Vector2d& q = other.points[k];
        const bool near_end = (q - ends[0]).norm() < 15 || (q - ends[1]).norm() < 15;
        if (near_end) continue;
        for (size_t j = 0; j < label.points.size(); j += 3) {
          label.clearance_px = std::min(label.clearance_px, (q - label.points[j]).norm());
        }
      }
    };
    for (const Label& other : labels) {
      if (&other != &label) keepClear(other);
    }
    for (const Label& other : curves) keepClear(other);
  }
  return labels;
}

inline double distanceToPolyline(const Eigen::Vector2d& p,
                                 const std::vector<Eigen::Vector2d>& line) {
  double best = 1e18;
  for (size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector2d d = line[i + 1] - line[i];
    const double len2 = d.squaredNorm();
    const double s = len2 > 0 ? std::clamp((p - line[i]).dot(d) / len2, 0.0, 1.0) : 0.0;
    best = std::min(best, (p - line[i] - s * d).squaredNorm());
  }
  return std::sqrt(best);
}

inline std::vector<Eigen::Vector2d> curveOf(const Camera& camera, const DetectedLine& line) {
  return imageCurve(camera, line.arc, 0, 1, 0.02);
}

/// Share of the label's length, 3 px at each end left out, within rho of one detection: the
/// largest.
inline double coverage(const Label& label,
                       const std::vector<std::vector<Eigen::Vector2d>>& detections,
                       double rho_px) {
  const double point_px = label.length_px / static_cast<double>(label.points.size() - 1);
  const size_t skip = static_cast<size_t>(3 / point_px);
  double best = 0;
  for (const auto& curve : detections) {
    size_t inside = 0, total = 0;
    for (size_t i = skip; i + skip < label.points.size(); ++i) {
      inside += distanceToPolyline(label.points[i], curve) <= rho_px ? 1 : 0;
      ++total;
    }
    if (total > 0) best = std::max(best, static_cast<double>(inside) / static_cast<double>(total));
  }
  return best;
}

/// Share of a detection's curve within rho of labels of one carrier: the largest.
inline double rightness(const std::vector<Eigen::Vector2d>& curve,
                        const std::vector<Label>& labels,
                        double rho_px) {
  std::vector<Eigen::Vector2d> samples;
  for (size_t i = 0; i + 1 < curve.size(); ++i) {
    const Eigen::Vector2d d = curve[i + 1] - curve[i];
    const int steps = std::max(1, static_cast<int>(d.norm()));
    for (int k = 0; k < steps; ++k) samples.push_back(curve[i] + d * k / steps);
  }
  samples.push_back(curve.back());
  double best = 0;
  int carriers = 0;
  for (const Label& l : labels) carriers = std::max(carriers, l.carrier + 1);
  for (int c = 0; c < carriers; ++c) {
    size_t inside = 0;
    for (const auto& p : samples) {
      for (const Label& l : labels) {
        if (l.carrier != c || l.points.size() < 2) continue;
        if (distanceToPolyline(p, l.points) <= rho_px) {
          ++inside;
          break;
        }
      }
    }
    best = std::max(best, static_cast<double>(inside) / static_cast<double>(samples.size()));
  }
  return best;
}

/// Cameras of the four models; two of them see past 90 degrees of field angle.
struct NamedCamera {
  const char* name;
  Camera camera;
};

inline std::vector<NamedCamera> testCameras(int scale_percent = 100) {
  const double s = scale_percent / 100.0;
  const int w = static_cast<int>(640 * s), h = static_cast<int>(512 * s);
  const double cx = w / 2.0 - 0.5 + 3.2, cy = h / 2.0 - 0.5 - 2.7;
  return {
      {"pinhole", makeCamera("pinhole", std::array{320 * s, 321 * s, cx, cy}, w, h)},
      {"fov", makeCamera("fov", std::array{223 * s, 223.5 * s, cx, cy, 0.933271}, w, h)},
      {"kannala_brandt",
       makeCamera(
           "kannala_brandt",
           std::array{
               190 * s, 190 * s, cx, cy, 0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673},
           w,
           h,
           105 * M_PI / 180)},
      {"omni",
       makeCamera("omni", std::array{1.4, 420 * s, 421 * s, cx, cy}, w, h, 115 * M_PI / 180)},
  };
}

}  // namespace dlsd::test
