#include "synth/scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "synth/presets.h"

namespace dlsd {

Eigen::Matrix4d Pose::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = cam_from_world;
  m.topRightCorner<3, 1>() = -cam_from_world * position_in_world;
  return m;
}

Eigen::Vector3d roundToFloat(const Eigen::Vector3d& p) {
  // Through a variable: Eigen 3.4 evaluates a chain of two casts of an expression without rounding.
  const Eigen::Vector3f rounded = p.cast<float>();
  return rounded.cast<double>();
}

Pose lookAt(const Eigen::Vector3d& position, const Eigen::Vector3d& target, double roll_rad) {
  Pose pose;
  pose.position_in_world = roundToFloat(position);
  const Eigen::Vector3d z = (target - pose.position_in_world).normalized();
  Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ());
  // Straight up or down there is no level; any x will do.
  x = x.norm() > 1e-9 ? x.normalized() : z.unitOrthogonal();
  const Eigen::Vector3d y = z.cross(x);
  Eigen::Matrix3d level;
  level.row(0) = x;
  level.row(1) = y;
  level.row(2) = z;
  pose.cam_from_world =
      Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() * level;
  return pose;
}

const std::vector<std::string>& scenePresets() {
  static const std::vector<std::string> names{"room", "paper"};
  return names;
}

std::string presetVersion(std::string_view preset) {
  if (preset == "room") return std::string(kRoomVersion);
  if (preset == "paper") return std::string(kPaperVersion);
  throw std::invalid_argument("scene = \"" + std::string(preset) +
                              "\" is unknown: allowed are room, paper");
}

SceneView makeSceneView(std::string_view preset, uint64_t seed, uint64_t index) {
  if (presetVersion(preset) == kRoomVersion) return makeRoom(seed, index);
  return makePaper(seed, index);
}

}  // namespace dlsd
