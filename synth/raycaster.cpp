#include "synth/raycaster.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "cameras/calibration/files.h"
#include "synth/tubes.h"

namespace dlsd {
namespace {

/// What Embree said last on this thread; it becomes an exception on our side of the C interface.
thread_local std::string last_error;

void onError(void* /*user*/, RTCError /*code*/, const char* text) {
  last_error = text != nullptr ? text : "unknown error";
}

/// One device for the process: it keeps Embree's own state, not ours.
RTCDevice device() {
  struct Holder {
    RTCDevice device = rtcNewDevice(nullptr);
    Holder() {
      if (device != nullptr) rtcSetDeviceErrorFunction(device, onError, nullptr);
    }
    ~Holder() {
      if (device != nullptr) rtcReleaseDevice(device);
    }
  };
  static const Holder holder;
  if (holder.device == nullptr) {
    throw SystemError("the ray caster could not start (Embree error " +
                      std::to_string(static_cast<int>(rtcGetDeviceError(nullptr))) + ")");
  }
  return holder.device;
}

template <class T>
T* newBuffer(
    RTCGeometry geometry, RTCBufferType type, RTCFormat format, size_t stride, size_t count) {
  void* data = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, count);
  if (data == nullptr) throw SystemError("the ray caster is out of memory");
  return static_cast<T*>(data);
}

constexpr unsigned kTriangles = 0, kSpheres = 1, kDiscs = 2, kTubes = 3, kRods = 4;

/// A piece of a tube, or a cylinder, in its box.
struct RoundPart {
  int index;  ///< Of the tube or rod.
  Eigen::AlignedBox3d box;
};

/// What Embree hands back to us: the shapes that we intersect ourselves, in double.
struct RoundParts {
  const Scene* scene;
  unsigned geometry;  ///< kTubes or kRods.
  std::vector<RoundPart> parts;

  /// Distance along the ray in (near, far) at which it enters the part, if it does.
  [[nodiscard]] std::optional<double> enter(const RoundPart& part,
                                            const Eigen::Vector3d& origin,
                                            const Eigen::Vector3d& direction,
                                            double near,
                                            double far) const {
    const auto index = static_cast<size_t>(part.index);
    if (geometry == kRods) return enterCylinder(scene->rods[index], origin, direction, near, far);
    for (int i = 0; i < 3; ++i) {
      if (direction[i] == 0) continue;
      const double a = (part.box.min()[i] - origin[i]) / direction[i];
      const double b = (part.box.max()[i] - origin[i]) / direction[i];
      near = std::max(near, std::min(a, b));
      far = std::min(far, std::max(a, b));
    }
    return enterTube(scene->tubes[index], origin, direction, near, far);
  }
};

/// The scene's shapes, as Embree numbers them.
struct Shapes {
  explicit Shapes(const Scene& scene) : tubes{&scene, kTubes, {}}, rods{&scene, kRods, {}} {}

  [[nodiscard]] Hit hitOf(unsigned geometry, unsigned primitive, float distance) const {
    switch (geometry) {
      case kTriangles:
        return {HitKind::kFace, triangle_faces[primitive], distance};
      case kSpheres:
        return {HitKind::kSphere, static_cast<int>(primitive), distance};
      case kDiscs:
        return {HitKind::kDisc, static_cast<int>(primitive), distance};
      case kTubes:
        return {HitKind::kTube, tubes.parts[primitive].index, distance};
      case kRods:
        return {HitKind::kRod, rods.parts[primitive].index, distance};
      default:
        return {};
    }
  }

  std::vector<int> triangle_faces;
  RoundParts tubes, rods;
};

/// What Embree hands back to us with each ray.
#if RTC_VERSION_MAJOR >= 4
using Context = RTCRayQueryContext;
constexpr RTCSceneFlags kFilterFlag = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
#else
using Context = RTCIntersectContext;
constexpr RTCSceneFlags kFilterFlag = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
#endif
struct Query : Context {
  const Shapes* shapes = nullptr;
  const Raycaster::Transparent* transparent = nullptr;  ///< Null if nothing is.

  [[nodiscard]] bool goesPast(unsigned geometry, unsigned primitive, float distance) const {
    return transparent != nullptr &&
           transparent->test(transparent->self, shapes->hitOf(geometry, primitive, distance));
  }
};

/// For shapes that Embree intersects; asked in casts of single rays only.
void filter(const RTCFilterFunctionNArguments* args) {
  const auto& query = *static_cast<const Query*>(args->context);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] != 0 && query.goesPast(RTCHitN_geomID(args->hit, args->N, i),
                                              RTCHitN_primID(args->hit, args->N, i),
                                              RTCRayN_tfar(args->ray, args->N, i))) {
      args->valid[i] = 0;
    }
  }
}

#if RTC_VERSION_MAJOR >= 4
void allowFilter(RTCGeometry geometry) {
  rtcSetGeometryEnableFilterFunctionFromArguments(geometry, true);
}
void intersect1(RTCScene scene, Query* query, RTCRayHit* ray) {
  rtcInitRayQueryContext(query);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = query;
  if (query->transparent != nullptr) arguments.filter = filter;
  rtcIntersect1(scene, ray, &arguments);
}
void intersect16(const int* valid, RTCScene scene, RTCRayHit16* rays) {
  Query query;
  rtcInitRayQueryContext(&query);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &query;
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, rays, &arguments);
}
#else
void allowFilter(RTCGeometry /*geometry*/) {}
void intersect1(RTCScene scene, Query* query, RTCRayHit* ray) {
  rtcInitIntersectContext(query);
  if (query->transparent != nullptr) query->filter = filter;
  rtcIntersect1(scene, query, ray);
}
void intersect16(const int* valid, RTCScene scene, RTCRayHit16* rays) {
  Query query;
  rtcInitIntersectContext(&query);
  query.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &query, rays);
}
#endif

void boundsOf(const RTCBoundsFunctionArguments* args) {
  const auto& shapes = *static_cast<const RoundParts*>(args->geometryUserPtr);
  const Eigen::AlignedBox3d& box = shapes.parts[args->primID].box;
  const Eigen::Vector3f lo = box.min().cast<float>(), hi = box.max().cast<float>();
  RTCBounds& bounds = *args->bounds_o;
  bounds.lower_x = lo.x();
  bounds.lower_y = lo.y();
  bounds.lower_z = lo.z();
  bounds.upper_x = hi.x();
  bounds.upper_y = hi.y();
  bounds.upper_z = hi.z();
}

void intersectRound(const RTCIntersectFunctionNArguments* args) {
  const auto& shapes = *static_cast<const RoundParts*>(args->geometryUserPtr);
  const RoundPart& part = shapes.parts[args->primID];
  const auto& query = *static_cast<const Query*>(args->context);
  const unsigned n = args->N;
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, n);
  RTCHitN* hits = RTCRayHitN_HitN(args->rayhit, n);
  for (unsigned i = 0; i < n; ++i) {
    if (args->valid[i] == 0) continue;
    const Eigen::Vector3d origin =
        Eigen::Vector3f(
            RTCRayN_org_x(rays, n, i), RTCRayN_org_y(rays, n, i), RTCRayN_org_z(rays, n, i))
            .cast<double>();
    const Eigen::Vector3d direction =
        Eigen::Vector3f(
            RTCRayN_dir_x(rays, n, i), RTCRayN_dir_y(rays, n, i), RTCRayN_dir_z(rays, n, i))
            .cast<double>();
    float& far = RTCRayN_tfar(rays, n, i);
    const auto distance = shapes.enter(part,
                                       origin,
                                       direction,
                                       static_cast<double>(RTCRayN_tnear(rays, n, i)),
                                       static_cast<double>(far));
    if (!distance) continue;
    const auto at = static_cast<float>(*distance);
    if (query.goesPast(shapes.geometry, args->primID, at)) continue;
    far = at;
    RTCHitN_geomID(hits, n, i) = shapes.geometry;
    RTCHitN_primID(hits, n, i) = args->primID;
    RTCHitN_instID(hits, n, i, 0) = RTC_INVALID_GEOMETRY_ID;
  }
}

}  // namespace

Eigen::Vector3f floatPointOnEdge(const Eigen::Vector3d& from,
                                 const Eigen::Vector3d& to,
                                 int i,
                                 int pieces) {
  constexpr int kTries = 16;
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double best_distance2 = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d axis = (to - from).normalized();
  for (int k = 0; k < kTries; ++k) {
    const Eigen::Vector3d exact = from + (to - from) * ((i + 0.002 * k) / pieces);
    const Eigen::Vector3d rounded = roundToFloat(exact);
    const double distance2 = axis.cross(rounded - exact).squaredNorm();
    if (distance2 < best_distance2) {
      best_distance2 = distance2;
      best = rounded;
    }
  }
  return best.cast<float>();
}

namespace {

struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Triangle> triangles;
};

/// The scene's triangles, with the sides of long rods cut across: boxes around the pieces are so
/// much smaller that rays get twice as fast.
class RodCutter {
 public:
  RodCutter(const Scene& scene, Mesh* mesh) : mesh_(mesh) { mesh_->vertices = scene.vertices; }

  /// A side with corners a, b at one end and c, d at the other (d beyond a).
  void addSide(const Triangle& abc, int d, int pieces) {
    const auto [a, b, c] = abc.vertices;
    const int left = cutsOf(a, d, pieces), right = cutsOf(b, c, pieces);
    const auto place = [&](int cuts, int from, int to, int i) {
      // Cuts are numbered from the end with the smaller vertex index.
      return i == 0 ? from : i == pieces ? to : cuts + (from < to ? i : pieces - i) - 1;
    };
    for (int i = 0; i < pieces; ++i) {
      const int p = place(left, a, d, i), q = place(right, b, c, i);
      const int r = place(right, b, c, i + 1), s = place(left, a, d, i + 1);
      mesh_->triangles.push_back({{p, q, r}, abc.face});
      mesh_->triangles.push_back({{p, r, s}, abc.face});
    }
  }

 private:
  /// Index of the first of pieces - 1 new vertices on an edge, which both of its sides share.
  int cutsOf(int v0, int v1, int pieces) {
    const auto [entry, is_new] = cuts_.try_emplace(std::minmax(v0, v1), 0);
    if (!is_new) return entry->second;
    entry->second = static_cast<int>(mesh_->vertices.size());
    const Eigen::Vector3d from = vertex(entry->first.first), to = vertex(entry->first.second);
    for (int i = 1; i < pieces; ++i) {
      mesh_->vertices.push_back(floatPointOnEdge(from, to, i, pieces));
    }
    return entry->second;
  }

  [[nodiscard]] Eigen::Vector3d vertex(int v) const {
    return mesh_->vertices[static_cast<size_t>(v)].cast<double>();
  }

  Mesh* mesh_;
  std::map<std::pair<int, int>, int> cuts_;
};

Mesh meshOf(const Scene& scene) {
  constexpr double kPieceMetres = 0.5;
  std::vector<int> pieces_of_face(scene.faces.size(), 1);
  for (const Rod& rod : scene.rods) {
    const int pieces = static_cast<int>(std::ceil((rod.to - rod.from).norm() / kPieceMetres));
    // The last two faces are the caps.
    std::fill_n(pieces_of_face.begin() + rod.first_face, rod.face_count - 2, pieces);
  }
  Mesh mesh;
  RodCutter cutter(scene, &mesh);
  for (size_t i = 0; i < scene.triangles.size(); ++i) {
    const Triangle& t = scene.triangles[i];
    const int pieces = pieces_of_face[static_cast<size_t>(t.face)];
    if (pieces == 1) {
      mesh.triangles.push_back(t);
      continue;
    }
    // Sides are pairs of triangles (a, b, c), (a, c, d).
    cutter.addSide(t, scene.triangles[++i].vertices[2], pieces);
  }
  return mesh;
}

}  // namespace

struct Raycaster::Impl {
  explicit Impl(const Scene& scene) : shapes(scene) {
    rtc_scene = rtcNewScene(device());
    if (rtc_scene == nullptr) throw SystemError("the ray caster is out of memory");
    rtcSetSceneFlags(rtc_scene, RTC_SCENE_FLAG_ROBUST | kFilterFlag);
    try {
      if (!scene.triangles.empty()) addTriangles(scene);
      if (!scene.spheres.empty()) addSpheres(scene);
      if (!scene.discs.empty()) addDiscs(scene);
      addRound(&shapes.tubes, tubeParts(scene));
      addRound(&shapes.rods, rodParts(scene));
      // An arena of one thread: the tree, and so the winner among equal distances, does not depend
      // on the number of threads, and this thread does not pick up another frame while it waits.
      tbb::task_arena(1).execute([&] { rtcCommitScene(rtc_scene); });
      if (rtcGetDeviceError(device()) != RTC_ERROR_NONE) {
        throw SystemError("the ray caster refused the scene (" + last_error + ")");
      }
    } catch (...) {
      rtcReleaseScene(rtc_scene);
      throw;
    }
  }
  ~Impl() { rtcReleaseScene(rtc_scene); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void attach(RTCGeometry geometry, unsigned id) const {
    allowFilter(geometry);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(rtc_scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }

  void addTriangles(const Scene& scene) {
    const Mesh mesh = meshOf(scene);
    const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = newBuffer<float>(geometry,
                                      RTC_BUFFER_TYPE_VERTEX,
                                      RTC_FORMAT_FLOAT3,
                                      3 * sizeof(float),
                                      mesh.vertices.size());
    for (const Eigen::Vector3f& v : mesh.vertices) {
      for (int i = 0; i < 3; ++i) *vertices++ = v[i];
    }
    auto* indices = newBuffer<unsigned>(geometry,
                                        RTC_BUFFER_TYPE_INDEX,
                                        RTC_FORMAT_UINT3,
                                        3 * sizeof(unsigned),
                                        mesh.triangles.size());
    shapes.triangle_faces.reserve(mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles) {
      for (const int v : triangle.vertices) *indices++ = static_cast<unsigned>(v);
      shapes.triangle_faces.push_back(triangle.face);
    }
    attach(geometry, kTriangles);
  }

  void addSpheres(const Scene& scene) const {
    const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_SPHERE_POINT);
    auto* points = newBuffer<float>(geometry,
                                    RTC_BUFFER_TYPE_VERTEX,
                                    RTC_FORMAT_FLOAT4,
                                    4 * sizeof(float),
                                    scene.spheres.size());
    for (const Sphere& s : scene.spheres) {
      for (int i = 0; i < 3; ++i) *points++ = s.centre[i];
      *points++ = s.radius;
    }
    attach(geometry, kSpheres);
  }

  void addDiscs(const Scene& scene) const {
    const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
    auto* points = newBuffer<float>(
        geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, 4 * sizeof(float), scene.discs.size());
    auto* normals = newBuffer<float>(
        geometry, RTC_BUFFER_TYPE_NORMAL, RTC_FORMAT_FLOAT3, 3 * sizeof(float), scene.discs.size());
    for (const Disc& d : scene.discs) {
      for (int i = 0; i < 3; ++i) *points++ = d.centre[i];
      *points++ = d.radius;
      for (int i = 0; i < 3; ++i) *normals++ = d.normal[i];
    }
    attach(geometry, kDiscs);
  }

  static std::vector<RoundPart> tubeParts(const Scene& scene) {
    constexpr int kPieces = 12;
    std::vector<RoundPart> parts;
    for (size_t k = 0; k < scene.tubes.size(); ++k) {
      for (const Eigen::AlignedBox3d& box : boxesOf(scene.tubes[k], kPieces)) {
        parts.push_back({static_cast<int>(k), box});
      }
    }
    return parts;
  }
  static std::vector<RoundPart> rodParts(const Scene& scene) {
    std::vector<RoundPart> parts;
    for (size_t k = 0; k < scene.rods.size(); ++k) {
      if (scene.rods[k].isRound()) parts.push_back({static_cast<int>(k), boxOf(scene.rods[k])});
    }
    return parts;
  }

  void addRound(RoundParts* round, std::vector<RoundPart> parts) const {
    round->parts = std::move(parts);
    if (round->parts.empty()) return;
    const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(round->parts.size()));
    rtcSetGeometryUserData(geometry, round);
    rtcSetGeometryBoundsFunction(geometry, boundsOf, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersectRound);
    attach(geometry, round->geometry);
  }

  RTCScene rtc_scene = nullptr;
  Shapes shapes;
};

Raycaster::Raycaster(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
Raycaster::~Raycaster() = default;
Raycaster::Raycaster(Raycaster&&) noexcept = default;
Raycaster& Raycaster::operator=(Raycaster&&) noexcept = default;

namespace {

/// What is the same for all rays: filled plainly, which compilers turn into a few wide stores.
void fillCommon(RTCRayHit16* rays) {
  constexpr size_t kPacket = Raycaster::kPacket;
  std::fill_n(rays->ray.time, kPacket, 0.0F);
  std::fill_n(rays->ray.mask, kPacket, 0xffffffffU);
  std::fill_n(rays->ray.id, kPacket, 0U);
  std::fill_n(rays->ray.flags, kPacket, 0U);
  std::fill_n(rays->hit.geomID, kPacket, RTC_INVALID_GEOMETRY_ID);
  std::fill_n(rays->hit.instID[0], kPacket, RTC_INVALID_GEOMETRY_ID);
}

}  // namespace

void Raycaster::castPacket(const Eigen::Vector3f& origin,
                           const float* x,
                           const float* y,
                           const float* z,
                           size_t count,
                           Hit* hits) const {
  alignas(64) std::array<int, kPacket> active{};
  std::fill_n(active.begin(), count, -1);
  RTCRayHit16 rays;
  fillCommon(&rays);
  std::fill_n(rays.ray.org_x, kPacket, origin.x());
  std::fill_n(rays.ray.org_y, kPacket, origin.y());
  std::fill_n(rays.ray.org_z, kPacket, origin.z());
  if (count == kPacket) {
    std::copy_n(x, kPacket, rays.ray.dir_x);
    std::copy_n(y, kPacket, rays.ray.dir_y);
    std::copy_n(z, kPacket, rays.ray.dir_z);
  } else {
    std::fill(std::copy_n(x, count, rays.ray.dir_x), rays.ray.dir_x + kPacket, 1.0F);
    std::fill(std::copy_n(y, count, rays.ray.dir_y), rays.ray.dir_y + kPacket, 1.0F);
    std::fill(std::copy_n(z, count, rays.ray.dir_z), rays.ray.dir_z + kPacket, 1.0F);
  }
  std::fill_n(rays.ray.tnear, kPacket, 0.0F);
  std::fill_n(rays.ray.tfar, kPacket, std::numeric_limits<float>::infinity());
  intersect16(active.data(), impl_->rtc_scene, &rays);
  for (size_t i = 0; i < count; ++i) {
    hits[i] = impl_->shapes.hitOf(rays.hit.geomID[i], rays.hit.primID[i], rays.ray.tfar[i]);
  }
}

void Raycaster::castPacket(const RayPacket& packet, size_t count, Hit* hits) const {
  alignas(64) std::array<int, kPacket> active{};
  std::fill_n(active.begin(), count, -1);
  RTCRayHit16 rays;
  fillCommon(&rays);
  std::copy_n(packet.origin_x.data(), kPacket, rays.ray.org_x);
  std::copy_n(packet.origin_y.data(), kPacket, rays.ray.org_y);
  std::copy_n(packet.origin_z.data(), kPacket, rays.ray.org_z);
  std::copy_n(packet.direction_x.data(), kPacket, rays.ray.dir_x);
  std::copy_n(packet.direction_y.data(), kPacket, rays.ray.dir_y);
  std::copy_n(packet.direction_z.data(), kPacket, rays.ray.dir_z);
  std::copy_n(packet.min_distance.data(), kPacket, rays.ray.tnear);
  std::copy_n(packet.max_distance.data(), kPacket, rays.ray.tfar);
  intersect16(active.data(), impl_->rtc_scene, &rays);
  for (size_t i = 0; i < count; ++i) {
    hits[i] = impl_->shapes.hitOf(rays.hit.geomID[i], rays.hit.primID[i], rays.ray.tfar[i]);
  }
}

Hit Raycaster::cast(const Eigen::Vector3f& origin,
                    const Eigen::Vector3f& direction,
                    float min_distance,
                    float max_distance) const {
  return castPast(origin, direction, min_distance, max_distance, nullptr);
}

Hit Raycaster::castPast(const Eigen::Vector3f& origin,
                        const Eigen::Vector3f& direction,
                        float min_distance,
                        float max_distance,
                        const Transparent* transparent) const {
  RTCRayHit ray;
  ray.ray.org_x = origin.x();
  ray.ray.org_y = origin.y();
  ray.ray.org_z = origin.z();
  ray.ray.dir_x = direction.x();
  ray.ray.dir_y = direction.y();
  ray.ray.dir_z = direction.z();
  ray.ray.tnear = min_distance;
  ray.ray.tfar = max_distance;
  ray.ray.time = 0;
  ray.ray.mask = 0xffffffffU;
  ray.ray.id = 0;
  ray.ray.flags = 0;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  Query query;
  query.shapes = &impl_->shapes;
  query.transparent = transparent;
  intersect1(impl_->rtc_scene, &query, &ray);
  return impl_->shapes.hitOf(ray.hit.geomID, ray.hit.primID, ray.ray.tfar);
}

}  // namespace dlsd
