#include "synth/shadows.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "synth/scene_builder.h"

namespace dlsd {
namespace {

using Eigen::Vector3d;

/// Ends of an edge lie this near to the plane of a face that contains it, m (see labels.cpp).
constexpr double kInPlane = 5e-6;
/// Cosine between light and normal below which a face gets no light (as in Shader).
constexpr double kGrazing = 1e-4;
/// Fractions of an edge nearer than this are one.
constexpr double kSameFraction = 1e-9;
/// m. Shorter borders are left out.
constexpr double kShortest = 1e-5;

/// What an edge looks like from a light.
class LightView {
 public:
  LightView(const Scene& scene, const Raycaster& raycaster, const Light& light)
      : scene_(scene), raycaster_(raycaster), light_(light), triangles_(scene.faces.size()) {
    for (size_t t = 0; t < scene.triangles.size(); ++t) {
      triangles_[static_cast<size_t>(scene.triangles[t].face)].push_back(t);
    }
    for (const Face& face : scene.faces) {
      looks_.push_back(face.normal.dot(toLight(face.origin)) > 0 ? 1 : 0);
    }
    for (size_t i = 0; i < scene.edges.size(); ++i) {
      const Edge& edge = scene.edges[i];
      if (edge.source == EdgeSource::kFaces && (looks(edge.face0) || looks(edge.face1))) {
        borders_.push_back({edge.from, edge.to, planeNormal(edge)});
      }
    }
  }

  [[nodiscard]] bool looks(int face) const { return looks_[static_cast<size_t>(face)] != 0; }

  /// The edge's shadow borders, appended to `out`.
  void project(int index, int light_index, std::vector<Edge>* out) const {
    const Edge& edge = scene_.edges[static_cast<size_t>(index)];
    const std::vector<double> cuts = cutsOf(edge);
    int last_face = -1;
    double begin = 0, end = 0;
    const auto finish = [&] {
      if (last_face < 0) return;
      const Face& face = scene_.faces[static_cast<size_t>(last_face)];
      const auto a = shadowOnFace(light_, pointAt(edge, begin), face);
      const auto b = shadowOnFace(light_, pointAt(edge, end), face);
      if (!a || !b || !((*a - *b).norm() > kShortest)) return;
      Edge border;
      border.from = *a;
      border.to = *b;
      border.source = EdgeSource::kShadow;
      border.face0 = last_face;
      border.rod = edge.rod;
      border.caster = index;
      border.light = light_index;
      out->push_back(border);
    };
    for (size_t k = 0; k + 1 < cuts.size(); ++k) {
      const int face = faceBehind(edge, pointAt(edge, (cuts[k] + cuts[k + 1]) / 2));
      if (face != last_face) {
        finish();
        begin = cuts[k];
        last_face = face;
      }
      end = cuts[k + 1];
    }
    finish();
  }

 private:
  struct Border {
    Vector3d from, to;
    Vector3d normal;  ///< Of the plane through the light.
  };

  static Vector3d pointAt(const Edge& edge, double s) {
    return edge.from + s * (edge.to - edge.from);
  }

  [[nodiscard]] bool isSun() const { return light_.kind == Light::Kind::kSun; }
  /// Not of unit length for lamps.
  [[nodiscard]] Vector3d toLight(const Vector3d& point) const {
    return isSun() ? light_.place : Vector3d(light_.place - point);
  }
  [[nodiscard]] Vector3d planeNormal(const Edge& edge) const {
    return isSun()
               ? Vector3d((edge.to - edge.from).cross(light_.place).normalized())
               : Vector3d((edge.from - light_.place).cross(edge.to - light_.place).normalized());
  }

  /// Fractions of the edge, from 0 to 1, at which something may change.
  [[nodiscard]] std::vector<double> cutsOf(const Edge& edge) const {
    std::vector<double> cuts;
    const auto add = [&](double s) {
      if (s > 0 && s < 1) cuts.push_back(s);
    };
    const Vector3d normal = planeNormal(edge);
    for (const Border& other : borders_) {
      const double b0 = normal.dot(other.from - edge.from), b1 = normal.dot(other.to - edge.from);
      if (b0 * b1 > 0 && std::min(std::abs(b0), std::abs(b1)) > 1e-9) continue;
      const double a0 = other.normal.dot(edge.from - other.from);
      const double a1 = other.normal.dot(edge.to - other.from);
      if (std::max(std::abs(a0), std::abs(a1)) < 1e-7) {
        // In one plane with the light: they overlap or not, the ends say it all.
        add(fractionTowards(edge, other.from));
        add(fractionTowards(edge, other.to));
        continue;
      }
      const double s = a0 / (a0 - a1);
      if (!(s > 0 && s < 1)) continue;
      // A lamp sees the other one on its far side, too.
      if (!isSun()) {
        const double t = b0 == b1 ? 0.5 : std::clamp(b0 / (b0 - b1), 0.0, 1.0);
        const Vector3d place = other.from + t * (other.to - other.from);
        if (toLight(place).dot(toLight(pointAt(edge, s))) < 0) continue;
      }
      add(s);
    }
    for (const Sphere& sphere : scene_.spheres) {
      addSphere(edge, sphere.centre.cast<double>(), static_cast<double>(sphere.radius), add);
    }
    for (const Disc& disc : scene_.discs) addDisc(edge, disc, add);
    cuts.push_back(0);
    cuts.push_back(1);
    std::sort(cuts.begin(), cuts.end());
    cuts.erase(
        std::unique(
            cuts.begin(), cuts.end(), [](double a, double b) { return b - a < kSameFraction; }),
        cuts.end());
    cuts.back() = 1;
    return cuts;
  }

  /// The fraction of the edge that the light sees in the direction of a point in its plane.
  [[nodiscard]] double fractionTowards(const Edge& edge, const Vector3d& point) const {
    const Vector3d ray = toLight(point), d = edge.to - edge.from;
    const Vector3d across = planeNormal(edge).cross(ray);  // In the plane, square to the ray.
    return across.dot(point - edge.from) / across.dot(d);
  }

  template <class Add>
  static void addRoots(double a, double b, double c, const Add& add) {  // a s^2 + 2 b s + c = 0
    const double disc = b * b - a * c;
    if (!(disc >= 0) || a == 0) return;
    add((-b + std::sqrt(disc)) / a);
    add((-b - std::sqrt(disc)) / a);
  }

  template <class Add>
  void addSphere(const Edge& edge, const Vector3d& centre, double radius, const Add& add) const {
    const Vector3d d = edge.to - edge.from;
    // The edge enters the sphere.
    const Vector3d m = edge.from - centre;
    addRoots(d.squaredNorm(), d.dot(m), m.squaredNorm() - radius * radius, add);
    if (isSun()) {
      // |its part square to the sun| = radius
      const Vector3d d1 = d - light_.place * light_.place.dot(d);
      const Vector3d m1 = m - light_.place * light_.place.dot(m);
      addRoots(d1.squaredNorm(), d1.dot(m1), m1.squaredNorm() - radius * radius, add);
      return;
    }
    // On the cone of rays that touch the sphere: (p . c)^2 = |p|^2 (|c|^2 - radius^2).
    const Vector3d c = centre - light_.place, p = edge.from - light_.place;
    const double k = c.squaredNorm() - radius * radius;
    addRoots(d.dot(c) * d.dot(c) - k * d.squaredNorm(),
             d.dot(c) * p.dot(c) - k * d.dot(p),
             p.dot(c) * p.dot(c) - k * p.squaredNorm(),
             add);
  }

  template <class Add>
  void addDisc(const Edge& edge, const Disc& disc, const Add& add) const {
    // The shadow v(s) / w(s) on the disc's plane, from its centre: |v|^2 = radius^2 w^2.
    const Vector3d n = disc.normal.cast<double>(), centre = disc.centre.cast<double>();
    const auto radius = static_cast<double>(disc.radius);
    const Vector3d d = edge.to - edge.from;
    Vector3d v0, v1;
    double w0 = 1, w1 = 0;
    if (isSun()) {
      const double cosine = n.dot(light_.place);
      if (std::abs(cosine) < 1e-9) return;
      const Vector3d m = edge.from - centre;
      v0 = m - light_.place * (n.dot(m) / cosine);
      v1 = d - light_.place * (n.dot(d) / cosine);
    } else {
      const Vector3d c = centre - light_.place, p = edge.from - light_.place;
      w0 = n.dot(p);
      w1 = n.dot(d);
      v0 = p * n.dot(c) - c * w0;
      v1 = d * n.dot(c) - c * w1;
    }
    const double r2 = radius * radius;
    addRoots(v1.squaredNorm() - r2 * w1 * w1,
             v0.dot(v1) - r2 * w0 * w1,
             v0.squaredNorm() - r2 * w0 * w0,
             add);
  }

  [[nodiscard]] bool belongsTo(int face, const Edge& edge) const {
    if (edge.source == EdgeSource::kRodCentre) {
      const Rod& rod = scene_.rods[static_cast<size_t>(edge.rod)];
      return face >= rod.first_face && face < rod.first_face + rod.face_count;
    }
    return face == edge.face0 || face == edge.face1;
  }
  [[nodiscard]] bool contains(int face, const Edge& edge) const {
    const Face& f = scene_.faces[static_cast<size_t>(face)];
    return std::abs(f.normal.dot(edge.from - f.origin)) < kInPlane &&
           std::abs(f.normal.dot(edge.to - f.origin)) < kInPlane;
  }

  /// Whether the light ends right here, at a face of something else on which the edge lies.
  [[nodiscard]] bool standsOnFace(const Edge& edge, const Vector3d& point) const {
    for (size_t f = 0; f < scene_.faces.size(); ++f) {
      const int face = static_cast<int>(f);
      if (!looks(face) || belongsTo(face, edge) || !contains(face, edge)) continue;
      const Vector3d& normal = scene_.faces[f].normal;
      for (const size_t t : triangles_[f]) {
        bool inside = true;
        for (size_t k = 0; k < 3; ++k) {
          const Vector3d a = vertex(t, k), b = vertex(t, (k + 1) % 3);
          inside = inside && normal.dot((b - a).cross(point - a)) >= -kInPlane * (b - a).norm();
        }
        if (inside) return true;
      }
    }
    return false;
  }
  [[nodiscard]] Vector3d vertex(size_t triangle, size_t corner) const {
    const int v = scene_.triangles[triangle].vertices[corner];
    return scene_.vertices[static_cast<size_t>(v)].cast<double>();
  }

  /// The face onto which a point of the edge casts its shadow, -1 if there is none: the point is in
  /// the dark, or stands on the face behind it.
  [[nodiscard]] int faceBehind(const Edge& edge, const Vector3d& point) const {
    constexpr double kSunDistance = 64;  // m, as in Shader.
    const Vector3d start =
        roundToFloat(isSun() ? Vector3d(point + kSunDistance * light_.place) : light_.place);
    const Vector3d way = point - start;
    const double distance = way.norm();
    const Vector3d direction = way / distance;
    const double margin = 1e-5 + 1e-6 * distance;
    const auto first = [&](double from, double to, const auto& ignores) -> Hit {
      auto begin = static_cast<float>(from);
      const auto end = static_cast<float>(to);
      while (begin < end) {
        const Hit hit = raycaster_.cast(start.cast<float>(), direction.cast<float>(), begin, end);
        const bool skip = hit.kind == HitKind::kFace && (!looks(hit.index) || ignores(hit.index));
        if (!skip) return hit;
        begin = std::max(hit.distance * (1 + 1e-6F),
                         std::nextafter(hit.distance, std::numeric_limits<float>::infinity()));
      }
      return {};
    };
    // Faces through the edge don't hide it.
    const auto isHere = [&](int face) { return belongsTo(face, edge) || contains(face, edge); };
    if (first(0, distance - margin, isHere).kind != HitKind::kNothing) return -1;
    if (standsOnFace(edge, point)) return -1;
    const auto isOwn = [&](int face) { return belongsTo(face, edge); };
    const Hit hit = first(distance + margin, std::numeric_limits<double>::infinity(), isOwn);
    return hit.kind == HitKind::kFace ? hit.index : -1;
  }

  const Scene& scene_;
  const Raycaster& raycaster_;
  const Light& light_;
  std::vector<char> looks_;  ///< Per face: at the light.
  std::vector<Border> borders_;
  std::vector<std::vector<size_t>> triangles_;  ///< Of each face.
};

}  // namespace

std::optional<Vector3d> shadowOnFace(const Light& light, const Vector3d& point, const Face& face) {
  const bool is_sun = light.kind == Light::Kind::kSun;
  const Vector3d way = is_sun ? Vector3d(-light.place) : Vector3d(point - light.place);
  const double cosine = -face.normal.dot(way), height = face.normal.dot(point - face.origin);
  if (!(cosine > kGrazing * way.norm()) || !(height > -kInPlane)) return std::nullopt;
  return Vector3d(point + height / cosine * way);
}

std::vector<Edge> shadowEdges(const Scene& scene, const Raycaster& raycaster) {
  std::vector<Edge> all;
  for (size_t k = 0; k < scene.lights.size(); ++k) {
    const Light& light = scene.lights[k];
    if (!light.casts_shadows) continue;
    const LightView view(scene, raycaster, light);
    for (size_t i = 0; i < scene.edges.size(); ++i) {
      const Edge& edge = scene.edges[i];
      const bool ends_solid =
          edge.source == EdgeSource::kFaces && view.looks(edge.face0) != view.looks(edge.face1);
      if (!ends_solid && edge.source != EdgeSource::kRodCentre) continue;
      view.project(static_cast<int>(i), static_cast<int>(k), &all);
    }
  }
  return all;
}

void addShadowEdges(const Raycaster& raycaster, Scene* scene) {
  const std::vector<Edge> shadows = shadowEdges(*scene, raycaster);
  if (shadows.empty()) return;
  scene->edges.insert(scene->edges.end(), shadows.begin(), shadows.end());
  numberCarriers(&scene->edges);
}

}  // namespace dlsd
