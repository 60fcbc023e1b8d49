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
  // GCC 12 from -O2 on vectorises two conversions to float and back and drops them (the remaining
  // one stays); what is volatile it must convert.
  Eigen::Vector3d rounded;
  for (int k = 0; k < 3; ++k) {
    const volatile auto coordinate = static_cast<float>(p[k]);
    rounded[k] = static_cast<double>(coordinate);
  }
  return rounded;
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

namespace {

struct Preset {
  std::string_view version;  ///< "name/number".
  SceneView (*make)(uint64_t seed, uint64_t index);
  [[nodiscard]] std::string_view name() const { return version.substr(0, version.find('/')); }
};

constexpr Preset kPresets[] = {
    {kRoomVersion, makeRoom},
    {kPaperVersion, makePaper},
    {kPolyhedraVersion, makePolyhedra},
    {kWiresVersion, makeWires},
    {kCorridorVersion, makeCorridor},
    {kFacadeVersion, makeFacade},
    {kCheckerboardVersion, makeCheckerboard},
};

const Preset& presetByName(std::string_view name) {
  std::string allowed;
  for (const Preset& preset : kPresets) {
    if (preset.name() == name) return preset;
    allowed += (allowed.empty() ? "" : ", ") + std::string(preset.name());
  }
  throw std::invalid_argument("scene = \"" + std::string(name) + "\" is unknown: allowed are " +
                              allowed);
}

}  // namespace

const std::vector<std::string>& scenePresets() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const Preset& preset : kPresets) list.emplace_back(preset.name());
    return list;
  }();
  return names;
}

std::string presetVersion(std::string_view preset) {
  return std::string(presetByName(preset).version);
}

SceneView makeSceneView(std::string_view preset, uint64_t seed, uint64_t index) {
  return presetByName(preset).make(seed, index);
}

}  // namespace dlsd
