#include "synth/raycaster.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <tbb/task_arena.h>

#include <array>
#include <limits>
#include <string>

#include "cameras/calibration/files.h"

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

#if RTC_VERSION_MAJOR >= 4
void intersect1(RTCScene scene, RTCRayHit* ray) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  rtcIntersect1(scene, ray, &arguments);
}
void intersect16(const int* valid, RTCScene scene, RTCRayHit16* rays) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, rays, &arguments);
}
#else
void intersect1(RTCScene scene, RTCRayHit* ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, ray);
}
void intersect16(const int* valid, RTCScene scene, RTCRayHit16* rays) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &context, rays);
}
#endif

constexpr unsigned kTriangles = 0, kSpheres = 1, kDiscs = 2;

}  // namespace

struct Raycaster::Impl {
  explicit Impl(const Scene& scene) : triangle_faces(scene.triangles.size()) {
    rtc_scene = rtcNewScene(device());
    if (rtc_scene == nullptr) throw SystemError("the ray caster is out of memory");
    rtcSetSceneFlags(rtc_scene, RTC_SCENE_FLAG_ROBUST);
    try {
      if (!scene.triangles.empty()) addTriangles(scene);
      if (!scene.spheres.empty()) addSpheres(scene);
      if (!scene.discs.empty()) addDiscs(scene);
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
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(rtc_scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }

  void addTriangles(const Scene& scene) {
    const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = newBuffer<float>(geometry,
                                      RTC_BUFFER_TYPE_VERTEX,
                                      RTC_FORMAT_FLOAT3,
                                      3 * sizeof(float),
                                      scene.vertices.size());
    for (const Eigen::Vector3f& v : scene.vertices) {
      for (int i = 0; i < 3; ++i) *vertices++ = v[i];
    }
    auto* indices = newBuffer<unsigned>(geometry,
                                        RTC_BUFFER_TYPE_INDEX,
                                        RTC_FORMAT_UINT3,
                                        3 * sizeof(unsigned),
                                        scene.triangles.size());
    for (size_t i = 0; i < scene.triangles.size(); ++i) {
      for (const int v : scene.triangles[i].vertices) *indices++ = static_cast<unsigned>(v);
      triangle_faces[i] = scene.triangles[i].face;
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

  [[nodiscard]] Hit hitOf(unsigned geometry, unsigned primitive, float distance) const {
    switch (geometry) {
      case kTriangles:
        return {HitKind::kFace, triangle_faces[primitive], distance};
      case kSpheres:
        return {HitKind::kSphere, static_cast<int>(primitive), distance};
      case kDiscs:
        return {HitKind::kDisc, static_cast<int>(primitive), distance};
      default:
        return {};
    }
  }

  RTCScene rtc_scene = nullptr;
  std::vector<int> triangle_faces;
};

Raycaster::Raycaster(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
Raycaster::~Raycaster() = default;
Raycaster::Raycaster(Raycaster&&) noexcept = default;
Raycaster& Raycaster::operator=(Raycaster&&) noexcept = default;

void Raycaster::castPacket(const Eigen::Vector3f& origin,
                           const float* x,
                           const float* y,
                           const float* z,
                           size_t count,
                           Hit* hits) const {
  alignas(64) std::array<int, kPacket> active;
  RTCRayHit16 rays;
  for (size_t i = 0; i < kPacket; ++i) {
    active[i] = i < count ? -1 : 0;
    const size_t k = i < count ? i : 0;
    rays.ray.org_x[i] = origin.x();
    rays.ray.org_y[i] = origin.y();
    rays.ray.org_z[i] = origin.z();
    rays.ray.dir_x[i] = x[k];
    rays.ray.dir_y[i] = y[k];
    rays.ray.dir_z[i] = z[k];
    rays.ray.tnear[i] = 0;
    rays.ray.tfar[i] = std::numeric_limits<float>::infinity();
    rays.ray.time[i] = 0;
    rays.ray.mask[i] = 0xffffffffU;
    rays.ray.id[i] = 0;
    rays.ray.flags[i] = 0;
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  intersect16(active.data(), impl_->rtc_scene, &rays);
  for (size_t i = 0; i < count; ++i) {
    hits[i] = impl_->hitOf(rays.hit.geomID[i], rays.hit.primID[i], rays.ray.tfar[i]);
  }
}

Hit Raycaster::cast(const Eigen::Vector3f& origin,
                    const Eigen::Vector3f& direction,
                    float min_distance,
                    float max_distance) const {
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
  intersect1(impl_->rtc_scene, &ray);
  return impl_->hitOf(ray.hit.geomID, ray.hit.primID, ray.ray.tfar);
}

}  // namespace dlsd
