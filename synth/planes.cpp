#include "synth/planes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <type_traits>

#include "cameras/batch.h"
#include "synth/dataset/nearest_line.h"
#include "synth/dataset/npy.h"
#include "synth/parallel.h"
#include "synth/tubes.h"

namespace dlsd {
namespace {

constexpr std::array<std::pair<PlaneKind, std::string_view>, 5> kNames{
    {{PlaneKind::kDepth, "depth"},
     {PlaneKind::kNormal, "normal"},
     {PlaneKind::kInstance, "instance"},
     {PlaneKind::kEdge, "edge"},
     {PlaneKind::kDistanceField, "df"}}};

/// Body of each face, by connected components of faces that share vertices or edges, numbered in
/// the order of their first faces.
struct Bodies {
  explicit Bodies(const Scene& scene) : of_face(scene.faces.size()) {
    std::vector<int> parent(scene.faces.size());
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](int face) {
      auto f = static_cast<size_t>(face);
      while (parent[f] != static_cast<int>(f)) {
        parent[f] = parent[static_cast<size_t>(parent[f])];
        f = static_cast<size_t>(parent[f]);
      }
      return static_cast<int>(f);
    };
    const auto join = [&](int face, int other) {
      const int a = root(face), b = root(other);
      parent[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
    };
    std::vector<int> face_at(scene.vertices.size(), -1);
    for (const Triangle& triangle : scene.triangles) {
      for (const int v : triangle.vertices) {
        int& other = face_at[static_cast<size_t>(v)];
        if (other < 0) other = triangle.face;
        join(other, triangle.face);
      }
    }
    for (const Edge& edge : scene.edges) {
      if (edge.source == EdgeSource::kFaces) join(edge.face0, edge.face1);
    }
    for (size_t f = 0; f < of_face.size(); ++f) {
      const int r = root(static_cast<int>(f));
      of_face[f] = r == static_cast<int>(f) ? count++ : of_face[static_cast<size_t>(r)];
    }
    for (size_t d = 0; d < scene.discs.size(); ++d) {
      of_disc.push_back(count + static_cast<int>(scene.spheres.size() + d));
    }
    for (const Rod& rod : scene.rods) {
      if (!rod.isRound()) continue;
      const auto cap = static_cast<size_t>(rod.first_disc);
      of_disc[cap + 1] = of_disc[cap];
    }
    first_tube = count + static_cast<int>(scene.spheres.size() + scene.discs.size());
  }

  std::vector<int> of_face;
  int count = 0;             ///< Of the faces; spheres follow, then discs and tubes.
  std::vector<int> of_disc;  ///< A cylinder's caps have one number, which is its own.
  int first_tube = 0;
};

/// What the rays through the pixels' centres meet.
class Centres {
 public:
  Centres(const Scene& scene, const Raycaster& raycaster, const Camera& camera, const Pose& pose)
      : scene_(scene), raycaster_(raycaster), camera_(camera), pose_(pose), bodies_(scene) {}

  struct Seen {
    double depth = 0;
    Eigen::Vector3d normal_in_cam{0, 0, 0};
    int body = -1;
  };

  /// Calls function(pixel, seen) for all pixels.
  template <class Function>
  void forEach(const Function& function) const {
    const auto w = static_cast<size_t>(camera_.width());
    const Eigen::Matrix3d world_from_cam = pose_.cam_from_world.transpose();
    const Eigen::Vector3f origin = pose_.position_in_world.cast<float>();
    forEachBand(camera_.height(), [&](int /*band*/, int first, int end) {
      std::vector<double> u(w), v(w), x(w), y(w), z(w);
      std::vector<uint8_t> valid(w);
      std::array<float, Raycaster::kPacket> dx, dy, dz;
      std::array<Eigen::Vector3d, Raycaster::kPacket> rays;
      std::array<size_t, Raycaster::kPacket> slots{};
      std::array<Hit, Raycaster::kPacket> hits;
      for (int j = first; j < end; ++j) {
        for (size_t i = 0; i < w; ++i) {
          u[i] = static_cast<double>(i);
          v[i] = j;
        }
        unprojectAll(camera_, u, v, x, y, z, valid);
        size_t count = 0;
        for (size_t i = 0; i < w; ++i) {
          const size_t pixel = static_cast<size_t>(j) * w + i;
          if (valid[i] != 0) {
            rays[count] = world_from_cam * Eigen::Vector3d(x[i], y[i], z[i]);
            dx[count] = static_cast<float>(rays[count].x());
            dy[count] = static_cast<float>(rays[count].y());
            dz[count] = static_cast<float>(rays[count].z());
            slots[count++] = pixel;
          } else {
            function(pixel, Seen());
          }
          if (count < Raycaster::kPacket && i + 1 < w) continue;
          raycaster_.castPacket(origin, dx.data(), dy.data(), dz.data(), count, hits.data());
          for (size_t k = 0; k < count; ++k) function(slots[k], see(hits[k], rays[k]));
          count = 0;
        }
      }
    });
  }

 private:
  [[nodiscard]] Seen see(const Hit& hit, const Eigen::Vector3d& ray) const {
    Seen seen;
    const auto index = static_cast<size_t>(hit.index);
    const Eigen::Vector3d& origin = pose_.position_in_world;
    seen.depth = static_cast<double>(hit.distance);
    Eigen::Vector3d normal(0, 0, 0);
    switch (hit.kind) {
      case HitKind::kNothing:
        return Seen();
      case HitKind::kFace: {
        const Face& face = scene_.faces[index];
        normal = face.normal;
        const double cosine = normal.dot(ray);
        // The plane is more exact than the caster's float, unless seen along itself.
        if (std::abs(cosine) > 1e-6) seen.depth = normal.dot(face.origin - origin) / cosine;
        seen.body = bodies_.of_face[index];
        break;
      }
      case HitKind::kSphere:
        normal =
            (origin + seen.depth * ray - scene_.spheres[index].centre.cast<double>()).normalized();
        seen.body = bodies_.count + hit.index;
        break;
      case HitKind::kDisc:
        normal = scene_.discs[index].normal.cast<double>().normalized();
        seen.body = bodies_.of_disc[index];
        break;
      case HitKind::kTube: {
        const Tube& tube = scene_.tubes[index];
        const Eigen::Vector3d point = origin + seen.depth * ray;
        normal = (point - spineAt(tube, nearestOnSpine(tube, point))).normalized();
        seen.body = bodies_.first_tube + hit.index;
        break;
      }
      case HitKind::kRod: {
        const Rod& rod = scene_.rods[index];
        const Eigen::Vector3d axis = (rod.to - rod.from).normalized();
        const Eigen::Vector3d m = origin + seen.depth * ray - rod.from;
        normal = (m - axis * axis.dot(m)).normalized();
        seen.body = bodies_.of_disc[static_cast<size_t>(rod.first_disc)];
        break;
      }
    }
    if (normal.dot(ray) > 0) normal = -normal;
    seen.normal_in_cam = pose_.cam_from_world * normal;
    return seen;
  }

  const Scene& scene_;
  const Raycaster& raycaster_;
  const Camera& camera_;
  const Pose& pose_;
  Bodies bodies_;
};

}  // namespace

std::string_view toString(PlaneKind kind) {
  for (const auto& [value, name] : kNames) {
    if (value == kind) return name;
  }
  return "";
}

std::optional<PlaneKind> planeFromName(std::string_view wanted) {
  for (const auto& [value, name] : kNames) {
    if (name == wanted) return value;
  }
  return std::nullopt;
}

const std::vector<std::string>& planeNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& [value, name] : kNames) all.emplace_back(name);
    return all;
  }();
  return names;
}

std::vector<Plane> renderPlanes(const Scene& scene,
                                const Raycaster& raycaster,
                                const Camera& camera,
                                const Pose& pose,
                                const std::vector<LabelLine>& lines,
                                const std::vector<PlaneKind>& kinds) {
  const size_t pixels = static_cast<size_t>(camera.width()) * static_cast<size_t>(camera.height());
  std::vector<Plane> planes;
  // Where each kind goes, or nullptr.
  std::vector<float>*depth = nullptr, *normal = nullptr, *field = nullptr;
  std::vector<int32_t>*instance = nullptr, *edge = nullptr;
  planes.reserve(kinds.size());
  for (const PlaneKind kind : kinds) {
    Plane& plane = planes.emplace_back(Plane{kind, camera.width(), camera.height(), 1, {}});
    switch (kind) {
      case PlaneKind::kDepth:
        depth = &plane.values.emplace<std::vector<float>>(pixels, 0.0F);
        break;
      case PlaneKind::kNormal:
        plane.channels = 3;
        normal = &plane.values.emplace<std::vector<float>>(3 * pixels, 0.0F);
        break;
      case PlaneKind::kInstance:
        instance = &plane.values.emplace<std::vector<int32_t>>(pixels, -1);
        break;
      case PlaneKind::kEdge:
        edge = &plane.values.emplace<std::vector<int32_t>>(pixels, -1);
        break;
      case PlaneKind::kDistanceField:
        plane.channels = 4;
        field = &plane.values.emplace<std::vector<float>>(4 * pixels, 0.0F);
        for (size_t i = 0; i < pixels; ++i) (*field)[4 * i] = -1;
        break;
    }
  }
  if (depth != nullptr || normal != nullptr || instance != nullptr) {
    Centres(scene, raycaster, camera, pose).forEach([&](size_t pixel, const Centres::Seen& seen) {
      if (depth != nullptr) (*depth)[pixel] = static_cast<float>(seen.depth);
      if (instance != nullptr) (*instance)[pixel] = seen.body;
      if (normal == nullptr) return;
      for (size_t k = 0; k < 3; ++k) {
        (*normal)[3 * pixel + k] = static_cast<float>(seen.normal_in_cam[static_cast<int>(k)]);
      }
    });
  }
  if (edge != nullptr || field != nullptr) {
    const NearestLine nearest_line(lines);
    const auto width = static_cast<size_t>(camera.width());
    forEachBand(camera.height(), [&](int /*band*/, int first, int end) {
      nearest_line.forEach(
          0, first, camera.width(), end, [&](int x, int y, const NearestLine::Nearest& nearest) {
            const size_t pixel = static_cast<size_t>(y) * width + static_cast<size_t>(x);
            if (edge != nullptr && nearest.distance <= kEdgePlanePx) (*edge)[pixel] = nearest.label;
            if (field == nullptr) return;
            float* out = field->data() + 4 * pixel;
            out[0] = static_cast<float>(nearest.distance);
            out[1] = directionAngle(nearest.along);
            out[2] = static_cast<float>(nearest.point.x());
            out[3] = static_cast<float>(nearest.point.y());
          });
    });
  }
  return planes;
}

std::string encodeNpy(const Plane& plane) {
  std::vector<size_t> shape{static_cast<size_t>(plane.height), static_cast<size_t>(plane.width)};
  if (plane.channels > 1) shape.push_back(static_cast<size_t>(plane.channels));
  return std::visit(
      [&](const auto& values) {
        return npyBytes<typename std::decay_t<decltype(values)>::value_type>(shape, values);
      },
      plane.values);
}

}  // namespace dlsd
