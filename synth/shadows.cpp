#include "synth/shadows.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "cameras/mutant.h"
#include "synth/scene_builder.h"
#include "synth/shading.h"
#include "synth/tubes.h"

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
  LightView(const Scene& scene, const Raycaster& raycaster, int light_index)
      : scene_(scene),
        raycaster_(raycaster),
        light_index_(light_index),
        light_(scene.lights[static_cast<size_t>(light_index)]),
        triangles_(scene.faces.size()) {
    for (size_t t = 0; t < scene.triangles.size(); ++t) {
      triangles_[static_cast<size_t>(scene.triangles[t].face)].push_back(t);
    }
    for (const Face& face : scene.faces) {
      looks_.push_back(face.normal.dot(toLight(face.origin)) > 0 ? 1 : 0);
    }
    for (size_t i = 0; i < scene.edges.size(); ++i) {
      const Edge& edge = scene.edges[i];
      const bool ends_face =
          edge.source == EdgeSource::kFaces && (looks(edge.face0) || looks(edge.face1));
      if (ends_face || isSideFromHere(edge)) {
        borders_.push_back({edge.from, edge.to, planeNormal(edge)});
      }
    }
  }

  [[nodiscard]] bool looks(int face) const { return looks_[static_cast<size_t>(face)] != 0; }

  /// Whether the edge casts a border: a solid ends there, as seen from the light; or the middle of
  /// a rod's shadow.
  [[nodiscard]] bool casts(const Edge& edge) const {
    if (edge.source == EdgeSource::kFaces) return looks(edge.face0) != looks(edge.face1);
    return edge.source == EdgeSource::kRodCentre || isSideFromHere(edge);
  }

  /// The edge's shadow borders, appended to `out`.
  void project(int index, std::vector<Edge>* out) const {
    const Edge& edge = scene_.edges[static_cast<size_t>(index)];
    const std::vector<double> cuts = cutsOf(edge);
    Hit last;
    double begin = 0, end = 0;
    const auto finish = [&] {
      if (last.kind == HitKind::kNothing) return;
      Edge border;
      border.source = EdgeSource::kShadow;
      (last.kind == HitKind::kFace ? border.face0 : border.disc) = last.index;
      border.rod = edge.rod;
      border.caster = index;
      border.light = light_index_;
      const LitPlane plane = litPlaneOf(scene_, border);
      const auto a = shadowOnPlane(light_, pointAt(edge, begin), plane);
      const auto b = shadowOnPlane(light_, pointAt(edge, end), plane);
      if (!a || !b || !((*a - *b).norm() > kShortest)) return;
      if (border.face0 >= 0 && liesOnBorder(border.face0, *a, *b)) return;
      border.from = *a;
      border.to = *b;
      out->push_back(border);
    };
    for (size_t k = 0; k + 1 < cuts.size(); ++k) {
      const Hit behind = planeBehind(edge, pointAt(edge, (cuts[k] + cuts[k + 1]) / 2));
      if (behind.kind != last.kind || behind.index != last.index) {
        finish();
        begin = cuts[k];
        last = behind;
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

  [[nodiscard]] bool isSideFromHere(const Edge& edge) const {
    return edge.source == EdgeSource::kRodSide && edge.light == light_index_;
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
    for (const Tube& tube : scene_.tubes) addTube(edge, tube, add);
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

  template <class Add>
  void addTube(const Edge& edge, const Tube& tube, const Add& add) const {
    const Vector3d normal = planeNormal(edge), d = edge.to - edge.from;
    if (isSun()) {
      // Fractions between which the edge's part square to the sun is within the ball's.
      const Vector3d d1 = d - light_.place * light_.place.dot(d);
      const auto covered = [&](const Vector3d& c) -> std::array<double, 2> {
        const Vector3d m = edge.from - c, m1 = m - light_.place * light_.place.dot(m);
        const double a = d1.squaredNorm(), at = -d1.dot(m1) / a;
        const double disc = at * at - (m1.squaredNorm() - tube.radius * tube.radius) / a;
        const double half = std::sqrt(std::max(0.0, disc));
        return {at - half, at + half};
      };
      if (d1.squaredNorm() > 0) {
        addTubeEvents(tube, normal, normal.dot(edge.from), covered, add);
      }
      return;
    }
    // Angles around the lamp, from the edge's middle; they jump behind the lamp.
    const Vector3d x = ((edge.from + edge.to) / 2 - light_.place).normalized(), y = normal.cross(x);
    const auto covered = [&](const Vector3d& centre) -> std::array<double, 2> {
      const Vector3d c = centre - light_.place;
      const double r = tube.radius * (DLSD_MUTANT("tube-shadow") ? 0.999 : 1);
      const double rest2 = c.squaredNorm() - r * r;
      const double ratio = std::sqrt(std::max(0.0, rest2)) / std::hypot(x.dot(c), y.dot(c));
      const double at = std::atan2(y.dot(c), x.dot(c)), half = std::acos(std::min(1.0, ratio));
      return {at - half, at + half};
    };
    addTubeEvents(tube, normal, normal.dot(light_.place), covered, [&](double phi) {
      add(fractionTowards(edge, light_.place + std::cos(phi) * x + std::sin(phi) * y));
    });
  }

  [[nodiscard]] bool belongsTo(const Hit& hit, const Edge& edge) const {
    if (edge.source == EdgeSource::kRodCentre || edge.source == EdgeSource::kRodSide) {
      return isOnRod(hit, scene_, edge.rod);
    }
    return hit.kind == HitKind::kFace && (hit.index == edge.face0 || hit.index == edge.face1);
  }
  [[nodiscard]] bool contains(int face, const Edge& edge) const {
    const Face& f = scene_.faces[static_cast<size_t>(face)];
    return std::abs(f.normal.dot(edge.from - f.origin)) < kInPlane &&
           std::abs(f.normal.dot(edge.to - f.origin)) < kInPlane;
  }

  /// Whether a segment lies along an edge in which the face ends: there, rounding decides which of
  /// two faces a ray hits, and for how long.
  [[nodiscard]] bool liesOnBorder(int face, const Vector3d& a, const Vector3d& b) const {
    return std::any_of(scene_.edges.begin(), scene_.edges.end(), [&](const Edge& edge) {
      if (edge.source != EdgeSource::kFaces || (edge.face0 != face && edge.face1 != face)) {
        return false;
      }
      const Vector3d d = (edge.to - edge.from).normalized();
      const double middle = d.dot((a + b) / 2 - edge.from);
      return d.cross(a - edge.from).norm() < kInPlane && d.cross(b - edge.from).norm() < kInPlane &&
             middle > 0 && middle < (edge.to - edge.from).norm();
    });
  }

  /// Whether the light ends right here, at a face of something else on which the edge lies.
  [[nodiscard]] bool standsOnFace(const Edge& edge, const Vector3d& point) const {
    for (size_t f = 0; f < scene_.faces.size(); ++f) {
      const int face = static_cast<int>(f);
      if (!looks(face) || belongsTo({HitKind::kFace, face, 0}, edge) || !contains(face, edge)) {
        continue;
      }
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

  /// The face or disc onto which a point of the edge casts its shadow; nothing if the point is in
  /// the dark, stands on the face behind it, or has something curved or nothing behind it.
  [[nodiscard]] Hit planeBehind(const Edge& edge, const Vector3d& point) const {
    const Vector3d start =
        roundToFloat(isSun() ? Vector3d(point + kSunDistance * light_.place) : light_.place);
    const Vector3d way = point - start;
    const double distance = way.norm();
    const Vector3d direction = way / distance;
    const double margin = 1e-5 + 1e-6 * distance;
    const auto first = [&](double from, double to, const auto& ignores) -> Hit {
      if (!(from < to)) return {};
      const auto isTransparent = [&](const Hit& hit) {
        return (hit.kind == HitKind::kFace && !looks(hit.index)) || ignores(hit);
      };
      return raycaster_.cast(start.cast<float>(),
                             direction.cast<float>(),
                             static_cast<float>(from),
                             static_cast<float>(to),
                             isTransparent);
    };
    // Faces through the edge don't hide it.
    const auto isHere = [&](const Hit& hit) {
      return belongsTo(hit, edge) || (hit.kind == HitKind::kFace && contains(hit.index, edge));
    };
    if (first(0, distance - margin, isHere).kind != HitKind::kNothing) return {};
    if (standsOnFace(edge, point)) return {};
    const auto isOwn = [&](const Hit& hit) { return belongsTo(hit, edge); };
    const Hit hit = first(distance + margin, std::numeric_limits<double>::infinity(), isOwn);
    return hit.kind == HitKind::kFace || hit.kind == HitKind::kDisc ? hit : Hit();
  }

  const Scene& scene_;
  const Raycaster& raycaster_;
  int light_index_;
  const Light& light_;
  std::vector<char> looks_;  ///< Per face: at the light.
  std::vector<Border> borders_;
  std::vector<std::vector<size_t>> triangles_;  ///< Of each face.
};

}  // namespace

LitPlane litPlaneOf(const Scene& scene, const Edge& shadow) {
  if (shadow.disc < 0) {
    const Face& face = scene.faces[static_cast<size_t>(shadow.face0)];
    return {face.origin, face.normal};
  }
  // Discs have two sides.
  const Disc& disc = scene.discs[static_cast<size_t>(shadow.disc)];
  const Light& light = scene.lights[static_cast<size_t>(shadow.light)];
  const Vector3d centre = disc.centre.cast<double>(), normal = disc.normal.cast<double>();
  const bool is_sun = light.kind == Light::Kind::kSun;
  const double height = normal.dot(is_sun ? light.place : Vector3d(light.place - centre));
  return {centre, height < 0 ? Vector3d(-normal) : normal};
}

std::optional<Vector3d> shadowOnPlane(const Light& light,
                                      const Vector3d& point,
                                      const LitPlane& plane) {
  const bool is_sun = light.kind == Light::Kind::kSun;
  const Vector3d way = is_sun ? Vector3d(-light.place) : Vector3d(point - light.place);
  const double cosine = -plane.normal.dot(way), height = plane.normal.dot(point - plane.origin);
  if (!(cosine > kGrazing * way.norm()) || !(height > -kInPlane)) return std::nullopt;
  return Vector3d(point + height / cosine * way);
}

void addRodSidesFromLights(Scene* scene) {
  for (size_t k = 0; k < scene->lights.size(); ++k) {
    const Light& light = scene->lights[k];
    if (!light.casts_shadows) continue;
    for (size_t r = 0; r < scene->rods.size(); ++r) {
      const Rod& rod = scene->rods[r];
      if (!rod.isRound()) continue;
      const bool is_sun = light.kind == Light::Kind::kSun;
      for (const auto& [from, to] :
           is_sun ? sidesFromSun(rod, light.place) : sidesFrom(rod, light.place)) {
        Edge edge;
        edge.from = from;
        edge.to = to;
        edge.source = EdgeSource::kRodSide;
        edge.rod = static_cast<int>(r);
        edge.light = static_cast<int>(k);
        scene->edges.push_back(edge);
      }
    }
  }
}

std::vector<Edge> shadowEdges(const Scene& scene, const Raycaster& raycaster) {
  std::vector<Edge> all;
  for (size_t k = 0; k < scene.lights.size(); ++k) {
    if (!scene.lights[k].casts_shadows) continue;
    const LightView view(scene, raycaster, static_cast<int>(k));
    for (size_t i = 0; i < scene.edges.size(); ++i) {
      if (view.casts(scene.edges[i])) view.project(static_cast<int>(i), &all);
    }
  }
  return all;
}

void addShadowEdges(const Raycaster& raycaster, Scene* scene) {
  addRodSidesFromLights(scene);
  const std::vector<Edge> shadows = shadowEdges(*scene, raycaster);
  if (shadows.empty()) return;
  scene->edges.insert(scene->edges.end(), shadows.begin(), shadows.end());
  numberCarriers(&scene->edges);
}

}  // namespace dlsd
