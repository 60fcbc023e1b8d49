#pragma once
// A scene: planar faces with printed decals, rods, spheres, discs, tubes, lights, and the straight
// edges that belong to labels. World frame: metres, z up. Vertices are rounded to float when they
// are added, and labels are computed in double from these very vertices, which are also what the
// ray caster gets.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dlsd {

/// What a face, decal, sphere, disc, tube or round rod looks like. Each has a surface of its own,
/// so that the surface index tells pixels apart.
struct Surface {
  double albedo = 0.5;  ///< Of the diffuse reflection, in [0, 1].
  double emission = 0;  ///< Radiance added to it.
  int texture = -1;     ///< In Scene::textures; -1: plain.
};

/// A smooth pattern in space that changes the albedo: without steps, so without edges.
struct Texture {
  enum class Kind {
    kNoise,  ///< Blotches of three sizes: value noise, each octave half as large and strong.
    kWood,   ///< Rings around an axis (its z), uneven and drawn out along it.
  } kind = Kind::kNoise;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< Rows: unit axes.
  double size_m = 0.1;     ///< Of the largest blotches; distance of rings. > 0.
  double amplitude = 0.3;  ///< The albedo is multiplied by 1 - amplitude to 1 + amplitude.
  uint64_t seed = 0;
};

enum class DecalShape { kRectangle, kEllipse };

/// A printed shape in the plane of a face, in the face's 2D frame (metres). Decals of one face are
/// disjoint or nested, the later one inside; the last one that contains a point wins.
struct Decal {
  DecalShape shape = DecalShape::kRectangle;
  Eigen::Vector2d centre{0, 0};
  Eigen::Vector2d axis{1, 0};  ///< Unit direction of the shape's own x axis.
  Eigen::Vector2d half{0, 0};  ///< Half sizes along its own axes.
  int surface = 0;

  [[nodiscard]] bool contains(const Eigen::Vector2d& point) const {
    const Eigen::Vector2d d = point - centre;
    const double x = std::abs(axis.dot(d)) / half.x();
    const double y = std::abs(axis.x() * d.y() - axis.y() * d.x()) / half.y();
    return shape == DecalShape::kRectangle ? x <= 1 && y <= 1 : x * x + y * y <= 1;
  }
};

/// A planar region, not necessarily convex, made of triangles. Seen from the front only (solids are
/// closed): the normal points to free space.
struct Face {
  Eigen::Vector3d origin, e1, e2, normal;  ///< Orthonormal 2D frame; origin is the first vertex.
  int surface = 0;
  std::vector<Decal> decals;

  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector2d& p) const {
    return origin + e1 * p.x() + e2 * p.y();
  }
};

struct Triangle {
  std::array<int, 3> vertices;
  int face;
};

struct Sphere {
  Eigen::Vector3f centre;
  float radius;
  int surface;
};

/// Free-standing, without thickness, seen from both sides.
struct Disc {
  Eigen::Vector3f centre, normal;
  float radius;
  int surface;
};

/// All balls of one radius whose centres lie on a smooth curve, its spine. Nothing of it is
/// straight.
struct Tube {
  enum class Kind {
    kRing,  ///< A torus: centre + cos(t) x + sin(t) y, t in [-pi, pi]; x, y square, of one length.
    kString,  ///< A sagging wire, a parabola: centre + t x + t^2 y, t in [-1, 1]. Its ends are
              ///< round.
  } kind = Kind::kRing;
  Eigen::Vector3d centre{0, 0, 0}, x{1, 0, 0}, y{0, 1, 0};
  double radius = 0.1;  ///< Less than the spine's least radius of curvature.
  int surface = -1;
};

/// A prism with square or octagonal section, or a cylinder. A prism's long edges and caps are
/// ordinary edges and faces; a cylinder's caps are discs, and its sides as seen from somewhere
/// become edges by addRodSides. labels.h says when a view is labelled by the centre line in their
/// place.
struct Rod {
  Eigen::Vector3d from, to;  ///< Centre line.
  double radius;             ///< Of the section's corners.
  int first_face, face_count;
  int surface = -1;     ///< Of a cylinder's side; -1: a prism.
  int first_disc = -1;  ///< Of a cylinder's two caps.

  [[nodiscard]] bool isRound() const { return surface >= 0; }
};

enum class EdgeSource {
  kFaces,      ///< Where two faces meet.
  kDecal,      ///< Straight border of a decal.
  kRodCentre,  ///< Centre line of a rod.
  kShadow,     ///< Border of a shadow on a face or disc (shadows.h); of rods also its middle.
  kRodSide,    ///< Side of a cylinder as seen from the camera, or from a light (light >= 0).
};

/// A straight edge that labels may show.
struct Edge {
  Eigen::Vector3d from, to;
  EdgeSource source = EdgeSource::kFaces;
  /// kFaces: both; kDecal, kShadow on a face: face0; else none.
  int face0 = -1, face1 = -1;
  int rod = -1;     ///< The rod that it belongs to (kShadow: that casts it), or -1.
  int carrier = 0;  ///< Edges on one infinite line share it.
  int caster = -1;  ///< kShadow: the edge whose shadow it is.
  int light = -1;   ///< kShadow: the light. kRodSide: see there.
  int disc = -1;    ///< kShadow: the disc that it lies on, if not on face0.
};

/// A light for Lambert surfaces.
struct Light {
  enum class Kind { kSun, kPoint } kind = Kind::kSun;
  Eigen::Vector3d place{0, 0, 1};  ///< kSun: unit direction to the light. kPoint: position.
  double strength = 0;             ///< Irradiance / pi at normal incidence; kPoint: at no distance.
  double half_distance = 1;        ///< kPoint: strength / (1 + (d / half_distance)^2).
  /// Whether faces that look at the light (not their backs: a sun shines into a room from outside),
  /// and round things keep it from what is behind them. At most 7 lights of a scene.
  bool casts_shadows = false;
};

/// A convex piece of a solid, for checks that solids do not enter each other.
struct SolidPiece {
  Eigen::Vector3d centre;
  Eigen::Matrix3d axes;  ///< Columns: unit axes.
  Eigen::Vector3d half;
  int solid;  ///< Pieces of one solid share it.
};

struct Scene {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Triangle> triangles;
  std::vector<Face> faces;
  std::vector<Surface> surfaces;
  std::vector<Texture> textures;
  std::vector<Sphere> spheres;
  std::vector<Disc> discs;
  std::vector<Tube> tubes;
  std::vector<Rod> rods;
  std::vector<Edge> edges;
  std::vector<Light> lights;
  double ambient_up = 0.3, ambient_down = 0.2;  ///< On faces that look up and down; linear between.
  std::vector<SolidPiece> pieces;
};

/// Where the camera stands. The position is exactly representable in float, so that labels and the
/// ray caster start from the same point.
struct Pose {
  Eigen::Matrix3d cam_from_world = Eigen::Matrix3d::Identity();  ///< Rotation.
  Eigen::Vector3d position_in_world{0, 0, 0};

  [[nodiscard]] Eigen::Vector3d toCam(const Eigen::Vector3d& point_in_world) const {
    return cam_from_world * (point_in_world - position_in_world);
  }
  [[nodiscard]] Eigen::Matrix4d matrix() const;
};

/// The nearest point whose coordinates are floats.
[[nodiscard]] Eigen::Vector3d roundToFloat(const Eigen::Vector3d& p);

/// Pose at a position (rounded to float) that looks at a target, turned about the view direction by
/// roll_rad; at 0 the image's down is the world's down.
[[nodiscard]] Pose lookAt(const Eigen::Vector3d& position,
                          const Eigen::Vector3d& target,
                          double roll_rad);

struct SceneView {
  Scene scene;
  Pose pose;
};

/// Names of the presets.
[[nodiscard]] const std::vector<std::string>& scenePresets();
/// "room/2": changes whenever the same seed gives another scene.
[[nodiscard]] std::string presetVersion(std::string_view preset);
/// Frame `index` of a preset, a function of its arguments only. `paper`: one table per seed, index
/// is time at 10 Hz along a smooth path; all others: another scene each index. Throws
/// std::invalid_argument for an unknown preset.
[[nodiscard]] SceneView makeSceneView(std::string_view preset, uint64_t seed, uint64_t index);

}  // namespace dlsd
