#pragma once
// Draws that several presets share.
//
// Here and in the presets no two draws are arguments of one call: C++ leaves their order open. (Of
// the values in one pair of braces it does not.)

#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "synth/dataset/random.h"
#include "synth/scene.h"
#include "synth/scene_builder.h"

namespace dlsd {

/// Uniform on the unit sphere.
[[nodiscard]] inline Eigen::Vector3d drawDirection(Random* random) {
  const double z = random->next(-1, 1), a = random->next(0, 2 * M_PI);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

/// By any angle about any axis.
[[nodiscard]] inline Eigen::Matrix3d drawRotation(Random* random) {
  const Eigen::Vector3d axis = drawDirection(random);
  return Eigen::AngleAxisd(random->next(0, 2 * M_PI), axis).toRotationMatrix();
}

/// A viewpoint within 0.4 m of a place, along each axis.
[[nodiscard]] inline Eigen::Vector3d drawEyeNear(const Eigen::Vector3d& place, Random* random) {
  return roundToFloat(place + Eigen::Vector3d{random->next(-0.4, 0.4),
                                              random->next(-0.4, 0.4),
                                              random->next(-0.4, 0.4)});
}

/// A solid bounded by planar polygons, as SceneBuilder::addSolid takes it.
struct Shape {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::vector<int>> loops;

  /// Moves and scales it so that its bounding box fits the unit sphere.
  void fitUnitSphere();
  [[nodiscard]] double longestEdge() const;
};

/// A box, an L-shaped block, a prism or a pyramid that fits the unit sphere.
[[nodiscard]] Shape drawShape(Random* random);

/// Adds a shape that fits the unit sphere, turned and scaled, each face in a grey of its own.
void addRandomSolid(Shape shape,
                    const Eigen::Vector3d& centre,
                    double radius,
                    Random* random,
                    SceneBuilder* builder);

struct Bounds {
  double lo, hi;
};

/// The scene in the open, under the sky and a sun, seen from `eye` in any direction.
[[nodiscard]] inline SceneView viewUnderSun(SceneBuilder* builder,
                                            const Eigen::Vector3d& eye,
                                            const Bounds& ambient_down,
                                            const Bounds& sun_strength,
                                            Random* random) {
  builder->finish();
  Scene& scene = builder->scene;
  scene.ambient_up = random->next(0.6, 0.8);
  scene.ambient_down = random->next(ambient_down.lo, ambient_down.hi);
  Light sun;
  sun.place = drawDirection(random);
  sun.place.z() = std::abs(sun.place.z());
  sun.strength = random->next(sun_strength.lo, sun_strength.hi);
  scene.lights.push_back(sun);

  SceneView view;
  view.pose.position_in_world = eye;
  view.pose.cam_from_world = drawRotation(random);
  view.scene = std::move(scene);
  return view;
}

}  // namespace dlsd
