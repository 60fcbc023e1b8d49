#include "synth/variety.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "cameras/calibration/files.h"
#include "synth/dataset/json_fields.h"
#include "synth/dataset/random.h"
#include "synth/random_shapes.h"
#include "synth/raycaster.h"
#include "synth/scene_builder.h"
#include "synth/tubes.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using nlohmann::ordered_json;

constexpr uint64_t kSceneStream = 0x7a51, kCameraStream = 0x7a5c;

void requireRange(const char* name, const VarietyRange& value, double lo, double hi) {
  if (value.lo >= lo && value.lo <= value.hi && value.hi <= hi) return;
  std::ostringstream message;
  message << name << " = [" << value.lo << ", " << value.hi
          << "] is out of range: allowed is [a, b]"
          << " with " << lo << " <= a <= b <= " << hi;
  throw std::invalid_argument(message.str());
}

double draw(Random* random, const VarietyRange& interval) {
  return random->next(interval.lo, interval.hi);
}

double distanceToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d d = b - a;
  return (a + std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) * d - p).norm();
}

double distanceToTriangle(const Vector3d& p, const std::array<Vector3d, 3>& corners) {
  const Vector3d n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  bool inside = true;
  double border = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k < 3; ++k) {
    const Vector3d &a = corners[k], &b = corners[(k + 1) % 3];
    inside = inside && n.dot((b - a).cross(p - a)) >= 0;
    border = std::min(border, distanceToSegment(p, a, b));
  }
  return inside ? std::abs(n.dot(p - corners[0])) : border;
}

/// Puts things where there is room for them.
class Decorator {
 public:
  Decorator(Random* random, SceneView* view)
      : random_(*random),
        view_(*view),
        builder_(std::move(view->scene)),
        scene_(builder_.scene),
        eye_(view->pose.position_in_world) {}
  /// Gives the scene back.
  ~Decorator() {
    builder_.finish();
    view_.scene = std::move(scene_);
  }
  Decorator(const Decorator&) = delete;

  void addClutter(int count, const VarietyRange& distance_m, const VarietyRange& length_m) {
    const Raycaster raycaster(scene_);
    for (int k = 0; k < count; ++k) {
      for (int tries = 0; tries < kTries; ++tries) {
        const auto place = drawPlace(raycaster, distance_m);
        const double length = draw(&random_, length_m);
        if (place && addClutterThing(*place, length)) break;
      }
    }
  }

  void addRoundThings(int count,
                      const VarietyRange& distance_m,
                      const std::vector<std::string>& kinds) {
    const Raycaster raycaster(scene_);
    for (int k = 0; k < count; ++k) {
      for (int tries = 0; tries < kTries; ++tries) {
        const auto place = drawPlace(raycaster, distance_m);
        const std::string& kind =
            kinds[static_cast<size_t>(random_.nextInt(0, static_cast<int>(kinds.size()) - 1))];
        if (place && addRoundThing(*place, kind)) break;
      }
    }
  }

  /// Patterns on surfaces that do not shine.
  void addTextures(double noise, double wood) {
    for (Surface& surface : scene_.surfaces) {
      const bool is_noise = random_.nextBool(noise), is_wood = random_.nextBool(wood);
      if (surface.emission > 0 || !(is_noise || is_wood)) continue;
      Texture texture;
      texture.kind = is_noise ? Texture::Kind::kNoise : Texture::Kind::kWood;
      texture.axes = drawRotation(&random_);
      texture.size_m = is_noise ? random_.next(0.05, 0.4) : random_.next(0.03, 0.12);
      texture.amplitude = is_noise ? random_.next(0.1, 0.4) : random_.next(0.08, 0.3);
      texture.seed = static_cast<uint64_t>(random_.nextInt(0, 1 << 30));
      surface.texture = static_cast<int>(scene_.textures.size());
      scene_.textures.push_back(texture);
    }
  }

  /// Prints on rectangles of two triangles without prints that are not a rod's.
  void addPrints(double share) {
    std::vector<char> of_rod(scene_.faces.size(), 0);
    for (const Rod& rod : scene_.rods) {
      std::fill_n(of_rod.begin() + rod.first_face, rod.face_count, 1);
    }
    std::vector<std::vector<size_t>> triangles(scene_.faces.size());
    for (size_t t = 0; t < scene_.triangles.size(); ++t) {
      triangles[static_cast<size_t>(scene_.triangles[t].face)].push_back(t);
    }
    for (size_t f = 0; f < scene_.faces.size(); ++f) {
      const bool wanted = random_.nextBool(share);
      if (!wanted || of_rod[f] != 0 || triangles[f].size() != 2 ||
          !scene_.faces[f].decals.empty()) {
        continue;
      }
      if (const auto size = rectangle(scene_.faces[f], triangles[f])) addPrint(f, *size);
    }
  }

 private:
  int addSurface(double albedo) {
    scene_.surfaces.push_back({albedo, 0});
    return static_cast<int>(scene_.surfaces.size()) - 1;
  }
  /// A free place, and how large a ball around it is free.
  struct Place {
    Vector3d centre;
    double distance, clearance;
  };

  std::optional<Place> drawPlace(const Raycaster& raycaster, const VarietyRange& distance_m) {
    const Vector3d direction = drawDirection(&random_);
    const Hit hit = raycaster.cast(eye_.cast<float>(), direction.cast<float>(), 0, 100);
    double farthest = distance_m.hi;
    if (hit.kind != HitKind::kNothing) {
      farthest = std::min(farthest, 0.85 * static_cast<double>(hit.distance));
    }
    const double distance = random_.next(distance_m.lo, farthest);
    if (farthest < distance_m.lo) return std::nullopt;
    const Vector3d centre = eye_ + distance * direction;
    return Place{centre, distance, 0.95 * clearance(centre)};
  }

  /// Distance to the nearest thing.
  [[nodiscard]] double clearance(const Vector3d& p) const {
    double nearest = (p - eye_).norm() - 0.1;
    for (const Triangle& triangle : scene_.triangles) {
      std::array<Vector3d, 3> corners;
      for (size_t k = 0; k < 3; ++k) {
        corners[k] = scene_.vertices[static_cast<size_t>(triangle.vertices[k])].cast<double>();
      }
      nearest = std::min(nearest, distanceToTriangle(p, corners));
    }
    for (const Sphere& s : scene_.spheres) {
      nearest =
          std::min(nearest, (p - s.centre.cast<double>()).norm() - static_cast<double>(s.radius));
    }
    for (const Disc& d : scene_.discs) {
      nearest =
          std::min(nearest, (p - d.centre.cast<double>()).norm() - static_cast<double>(d.radius));
    }
    for (const Tube& tube : scene_.tubes) {
      const Vector3d spine = spineAt(tube, nearestOnSpine(tube, p));
      nearest = std::min(nearest, (p - spine).norm() - tube.radius);
    }
    for (const Rod& rod : scene_.rods) {
      if (rod.isRound())
        nearest = std::min(nearest, distanceToSegment(p, rod.from, rod.to) - rod.radius);
    }
    for (const Light& light : scene_.lights) {
      if (light.kind == Light::Kind::kPoint)
        nearest = std::min(nearest, (p - light.place).norm() - 0.05);
    }
    return nearest;
  }

  bool addClutterThing(const Place& place, double length) {
    if (random_.nextBool(0.7)) {
      const Shape shape = drawShape(&random_);
      const double radius = length / shape.longestEdge();
      if (radius > place.clearance) return false;
      addRandomSolid(shape, place.centre, radius, &random_, &builder_);
      return true;
    }
    const double radius = length * random_.next(0.005, 0.04);
    const Vector3d half = length / 2 * drawDirection(&random_);
    const int sides = random_.nextBool(0.5) ? 4 : 8;
    const Surface surface{random_.next(0.05, 0.9), 0};
    if (half.norm() + radius > place.clearance) return false;
    builder_.addRod(place.centre - half, place.centre + half, radius, sides, surface);
    return true;
  }

  bool addRoundThing(const Place& place, const std::string& kind) {
    const double radius = std::min(place.clearance, random_.next(0.05, 0.25) * place.distance);
    const Surface surface{random_.next(0.05, 0.9), 0};
    const Eigen::Matrix3d axes = drawRotation(&random_);
    const double slimness = random_.next(0, 1), form = random_.next(0, 1);
    if (radius < 0.02 * place.distance) return false;
    if (kind == "ball") {
      builder_.addSphere(place.centre, radius, surface);
    } else if (kind == "disc") {
      builder_.addDisc(place.centre, axes.col(2), radius, surface);
    } else if (kind == "ring") {
      Tube tube;
      tube.kind = Tube::Kind::kRing;
      tube.centre = place.centre;
      tube.radius = radius * (0.12 + 0.23 * slimness);
      tube.x = axes.col(0) * (radius - tube.radius);
      tube.y = axes.col(1) * (radius - tube.radius);
      builder_.addTube(tube, surface);
    } else if (kind == "string") {
      // Hung up at two points that may differ in height.
      Tube tube;
      tube.kind = Tube::Kind::kString;
      tube.radius = radius * (0.015 + 0.035 * slimness);
      Vector3d along = axes.col(0);
      along.z() *= 0.3;
      tube.x = 0.8 * radius * along.normalized();
      tube.y = Vector3d::UnitZ() * (0.8 * radius * (0.2 + 0.4 * form));
      tube.centre = place.centre - tube.y / 2;
      builder_.addTube(tube, surface);
    } else {
      const double half = radius * (0.5 + 0.45 * form);
      const double thickness =
          std::min(radius * (0.03 + 0.37 * slimness), std::sqrt(radius * radius - half * half));
      const Vector3d end = axes.col(2) * half;
      builder_.addRoundRod(place.centre - end, place.centre + end, thickness, surface);
    }
    return true;
  }

  /// Width and height of a face that is a rectangle with one corner in its frame's origin and its
  /// sides along the frame's axes.
  [[nodiscard]] std::optional<Vector2d> rectangle(const Face& face,
                                                  const std::vector<size_t>& triangles) const {
    Vector2d hi(0, 0);
    std::vector<Vector2d> corners;
    for (const size_t t : triangles) {
      for (const int v : scene_.triangles[t].vertices) {
        const Vector3d d = scene_.vertices[static_cast<size_t>(v)].cast<double>() - face.origin;
        corners.emplace_back(face.e1.dot(d), face.e2.dot(d));
        hi = hi.cwiseMax(corners.back());
      }
    }
    for (const Vector2d& c : corners) {
      for (int k = 0; k < 2; ++k) {
        if (std::min(std::abs(c[k]), std::abs(c[k] - hi[k])) > 1e-5) return std::nullopt;
      }
    }
    if (hi.minCoeff() < 0.05) return std::nullopt;
    return hi;
  }

  void addEllipse(size_t face, const Vector2d& centre, const Vector2d& half, int surface) {
    scene_.faces[face].decals.push_back({DecalShape::kEllipse, centre, {1, 0}, half, surface});
  }

  void addPrint(size_t face, const Vector2d& size) {
    const double albedo = scene_.surfaces[static_cast<size_t>(scene_.faces[face].surface)].albedo;
    const int ink = addSurface(std::clamp(albedo * random_.next(0.3, 1.6), 0.02, 0.95));
    if (random_.nextBool(0.5)) {
      const int columns = random_.nextInt(2, 10), rows = random_.nextInt(2, 8);
      const Vector2d cell = size.cwiseQuotient(Vector2d(columns, rows));
      for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
          const double half_y = random_.next(0.1, 0.4), half_x = random_.next(0.1, 0.4);
          addEllipse(face,
                     cell.cwiseProduct(Vector2d(i + 0.5, j + 0.5)),
                     cell.cwiseProduct(Vector2d(half_x, half_y)),
                     ink);
        }
      }
      return;
    }
    // Rings around a knot, each inside the one before.
    const int paper = scene_.faces[face].surface, rings = random_.nextInt(3, 12);
    const double centre_y = random_.next(0.4, 0.6), centre_x = random_.next(0.4, 0.6);
    const Vector2d centre = size.cwiseProduct(Vector2d(centre_x, centre_y));
    Vector2d half = 0.95 * centre.cwiseMin(size - centre);
    for (int k = 0; k < 2 * rings; ++k) {
      addEllipse(face, centre, half, k % 2 == 0 ? ink : paper);
      half *= random_.next(0.85, 0.97);
    }
  }

  static constexpr int kTries = 8;
  Random& random_;
  SceneView& view_;
  SceneBuilder builder_;
  Scene& scene_;
  Vector3d eye_;
};

const std::vector<std::pair<const char*, VarietyRange SceneVariety::*>>& sceneFields() {
  static const std::vector<std::pair<const char*, VarietyRange SceneVariety::*>> fields{
      {"contrast", &SceneVariety::contrast},
      {"distractors", &SceneVariety::distractors},
      {"clutter", &SceneVariety::clutter},
      {"distance_m", &SceneVariety::distance_m},
      {"length_m", &SceneVariety::length_m},
      {"prints", &SceneVariety::prints},
      {"noise", &SceneVariety::noise},
      {"wood", &SceneVariety::wood}};
  return fields;
}

const std::vector<std::pair<const char*, VarietyRange CameraVariety::*>>& cameraFields() {
  static const std::vector<std::pair<const char*, VarietyRange CameraVariety::*>> fields{
      {"field_of_view_deg", &CameraVariety::field_of_view_deg},
      {"width_px", &CameraVariety::width_px},
      {"aspect", &CameraVariety::aspect},
      {"principal_offset", &CameraVariety::principal_offset},
      {"distortion", &CameraVariety::distortion}};
  return fields;
}

/// The intervals of `fields` that the object has; refuses keys that are neither these nor `more`.
template <class Variety, class Fields>
void readIntervals(const JsonField& json,
                   const Fields& fields,
                   std::set<std::string> more,
                   Variety* variety) {
  if (!json.raw().is_object()) json.fail("must be an object");
  for (const auto& [name, member] : fields) {
    more.insert(name);
    if (!json.has(name)) continue;
    const auto ends = json[name].array(2, 2);
    variety->*member = {ends[0].number(), ends[1].number()};
  }
  for (const auto& item : json.raw().items()) {
    if (!more.contains(item.key())) json[item.key().c_str()].fail("is unknown");
  }
}

}  // namespace

const std::vector<std::string>& distractorKinds() {
  static const std::vector<std::string> kinds{"ball", "disc", "ring", "string", "cylinder"};
  return kinds;
}

void SceneVariety::check() const {
  requireRange("scene.contrast", contrast, 0, 3);
  requireRange("scene.distractors", distractors, 0, 30);
  requireRange("scene.clutter", clutter, 0, 60);
  requireRange("scene.distance_m", distance_m, 0.1, 60);
  requireRange("scene.length_m", length_m, 0.01, 20);
  requireRange("scene.prints", prints, 0, 1);
  requireRange("scene.noise", noise, 0, 1);
  requireRange("scene.wood", wood, 0, 1);
  const auto& known = distractorKinds();
  for (const std::string& kind : distractor_kinds) {
    if (std::find(known.begin(), known.end(), kind) != known.end() &&
        std::count(distractor_kinds.begin(), distractor_kinds.end(), kind) == 1) {
      continue;
    }
    throw std::invalid_argument("scene.distractor_kinds has \"" + kind +
                                "\": allowed are ball, disc, ring, string, cylinder, each once");
  }
  if (distractor_kinds.empty()) {
    throw std::invalid_argument("scene.distractor_kinds is empty: allowed is one kind or more");
  }
  if (shadows == -1 || (shadows >= 0 && shadows <= 1)) return;
  throw std::invalid_argument("scene.shadows = " + std::to_string(shadows) +
                              " is out of range: allowed are [0, 1] and -1");
}

void CameraVariety::check() const {
  requireRange("camera.field_of_view_deg", field_of_view_deg, 20, 300);
  requireRange("camera.width_px", width_px, 64, 8192);
  requireRange("camera.aspect", aspect, 0.25, 4);
  requireRange("camera.principal_offset", principal_offset, 0, 0.3);
  requireRange("camera.distortion", distortion, 0, 1);
}

ordered_json toJson(const SceneVariety& variety) {
  ordered_json json;
  for (const auto& [name, member] : sceneFields()) {
    json[name] = {(variety.*member).lo, (variety.*member).hi};
  }
  json["distractor_kinds"] = variety.distractor_kinds;
  json["shadows"] = variety.shadows;
  return json;
}

ordered_json toJson(const CameraVariety& variety) {
  ordered_json json;
  for (const auto& [name, member] : cameraFields()) {
    json[name] = {(variety.*member).lo, (variety.*member).hi};
  }
  return json;
}

namespace {

/// `source` names the document in messages.
void applyVariety(const nlohmann::json& document,
                  const std::string& source,
                  SceneVariety* scene_out,
                  CameraVariety* camera_out) {
  SceneVariety scene = *scene_out;
  CameraVariety camera = *camera_out;
  const JsonField json(document, source);
  if (!document.is_object()) json.fail("must be an object");
  for (const auto& item : document.items()) {
    const JsonField part = json[item.key().c_str()];
    if (item.key() == "scene") {
      readIntervals(part, sceneFields(), {"shadows", "distractor_kinds"}, &scene);
      if (part.has("shadows")) scene.shadows = part["shadows"].number();
      if (part.has("distractor_kinds")) {
        scene.distractor_kinds.clear();
        for (const JsonField& kind : part["distractor_kinds"].array()) {
          scene.distractor_kinds.push_back(kind.text());
        }
      }
    } else if (item.key() == "camera") {
      readIntervals(part, cameraFields(), {}, &camera);
    } else {
      part.fail("is unknown, allowed are scene and camera");
    }
  }
  try {
    scene.check();
    camera.check();
  } catch (const std::invalid_argument& e) {
    throw InputError(source + ": " + e.what());
  }
  *scene_out = scene;
  *camera_out = camera;
}

/// "4,12" as an array of numbers; what is no number stays a text.
nlohmann::json valuesOf(const std::string& text) {
  nlohmann::json values = nlohmann::json::array();
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    double number = 0;
    const auto end = std::from_chars(part.data(), part.data() + part.size(), number);
    const bool is_number = end.ec == std::errc() && end.ptr == part.data() + part.size();
    values.push_back(is_number ? nlohmann::json(number) : nlohmann::json(part));
  }
  return values;
}

}  // namespace

void readVariety(const std::string& path, SceneVariety* scene, CameraVariety* camera) {
  applyVariety(parseJson(readFile(path), path), path, scene, camera);
}

void setVariety(const std::string& assignment, SceneVariety* scene, CameraVariety* camera) {
  const std::string source = "--set " + assignment;
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos) {
    throw InputError(source + ": has no '=', allowed is NAME=VALUE or NAME=LOW,HIGH");
  }
  const std::string name = assignment.substr(0, equals);
  const nlohmann::json values = valuesOf(assignment.substr(equals + 1));
  const auto& ranges = cameraFields();
  const bool of_camera = std::any_of(
      ranges.begin(), ranges.end(), [&](const auto& field) { return name == field.first; });
  nlohmann::json value = values;
  if (name == "shadows" && values.size() == 1) {
    value = values[0];
  } else if (name != "distractor_kinds" && values.size() == 1) {
    value = {values[0], values[0]};
  }
  nlohmann::json document;
  document[of_camera ? "camera" : "scene"][name] = value;
  applyVariety(document, source, scene, camera);
}

void addVariety(const SceneVariety& variety, uint64_t seed, uint64_t index, SceneView* view) {
  if (variety == SceneVariety()) return;
  Random random(hashCounters({seed, index}), kSceneStream);
  Scene& scene = view->scene;
  const double contrast = draw(&random, variety.contrast);
  const int things = static_cast<int>(std::lround(draw(&random, variety.distractors)));
  const int clutter = static_cast<int>(std::lround(draw(&random, variety.clutter)));
  const double prints = draw(&random, variety.prints);
  const double noise = draw(&random, variety.noise), wood = draw(&random, variety.wood);
  const bool shadows = random.nextBool(variety.shadows);
  {
    Decorator decorator(&random, view);
    if (prints > 0) decorator.addPrints(prints);
    if (clutter > 0) decorator.addClutter(clutter, variety.distance_m, variety.length_m);
    if (things > 0) {
      decorator.addRoundThings(things, variety.distance_m, variety.distractor_kinds);
    }
    if (noise > 0 || wood > 0) decorator.addTextures(noise, wood);
  }
  double mean = 0;
  for (const Surface& s : scene.surfaces)
    mean += s.albedo / static_cast<double>(scene.surfaces.size());
  if (contrast != 1) {
    for (Surface& s : scene.surfaces) {
      s.albedo = std::clamp(mean + contrast * (s.albedo - mean), 0.01, 0.98);
    }
  }
  if (variety.shadows < 0) return;
  for (Light& light : scene.lights) {
    const bool in_ball =
        light.kind == Light::Kind::kPoint &&
        std::any_of(scene.spheres.begin(), scene.spheres.end(), [&](const Sphere& s) {
          return (light.place - s.centre.cast<double>()).norm() <=
                 1.01 * static_cast<double>(s.radius);
        });
    light.casts_shadows = shadows && !in_ball;
  }
}

const std::vector<std::string>& randomCameraModels() {
  static const std::vector<std::string> names{"pinhole", "fov", "kb", "omni", "eucm", "ds"};
  return names;
}

Camera drawCamera(std::string_view model,
                  const CameraVariety& variety,
                  uint64_t seed,
                  uint64_t index) {
  uint64_t number = 0;
  for (const std::string& name : randomCameraModels()) {
    if (name == model) break;
    ++number;
  }
  Random random(hashCounters({seed, number, index}), kCameraStream);
  const double half_field = draw(&random, variety.field_of_view_deg) * M_PI / 360;
  const int width = static_cast<int>(std::lround(draw(&random, variety.width_px)));
  const int height = static_cast<int>(std::lround(width * draw(&random, variety.aspect)));
  const double offset = width * draw(&random, variety.principal_offset);
  const double azimuth = random.next(0, 2 * M_PI), strength = draw(&random, variety.distortion);
  const double cx = (width - 1) / 2.0 + offset * std::cos(azimuth);
  const double cy = (height - 1) / 2.0 + offset * std::sin(azimuth);
  const auto bend = [&](double most) { return strength * random.next(-most, most); };

  std::string name(model);
  std::vector<double> lens;  // Parameters besides fx, fy, cx, cy.
  bool lens_first = false;
  if (model == "fov") {
    lens = {0.2 + 1.1 * strength * random.next(0.5, 1)};
  } else if (model == "kb") {
    name = "kannala_brandt";
    lens = {bend(0.06), bend(0.02), bend(0.006), bend(0.001)};
  } else if (model == "omni") {
    lens = {0.1 + 1.9 * strength * random.next(0.4, 1)};
    lens_first = true;
  } else if (model == "eucm") {
    lens = {0.1 + 0.6 * strength, 1 + bend(0.3)};
    lens_first = true;
  } else if (model == "ds") {
    name = "double_sphere";
    lens = {bend(0.3), 0.1 + 0.55 * strength};
    lens_first = true;
  } else if (model != "pinhole") {
    throw std::invalid_argument("camera model \"" + std::string(model) +
                                "\" cannot be drawn: allowed are pinhole, fov, kb, omni, eucm, ds");
  }
  const auto make = [&](double f) {
    std::vector<double> params;
    if (lens_first) params = lens;
    for (const double value : {f, f, cx, cy}) params.push_back(value);
    if (!lens_first) params.insert(params.end(), lens.begin(), lens.end());
    return makeCamera(name, params, width, height);
  };
  // The focal length at which the field of view fills the width, or as much of it as the model
  // shows without stretching its border to more than kMaxStretch times the middle.
  constexpr double kTrial = 500, kMaxStretch = 4;
  const Camera trial = make(kTrial);
  const auto J_middle = trial.jacobian(Vector3d::UnitZ());
  const double in_middle = J_middle ? J_middle->col(0).norm() : kTrial;
  for (double angle = half_field; angle > 0.05; angle *= 0.97) {
    const Vector3d ray(std::sin(angle), 0, std::cos(angle));
    const auto pixel = trial.project(ray);
    const auto J = trial.jacobian(ray);
    if (!pixel || !J) continue;
    const double stretch = (*J * Vector3d(std::cos(angle), 0, -std::sin(angle))).norm();
    if (stretch <= kMaxStretch * in_middle) {
      return make(kTrial * (width / 2.0) / (pixel->x() - cx));
    }
  }
  return trial;
}

}  // namespace dlsd
