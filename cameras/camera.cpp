#include "cameras/camera.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

[[noreturn]] void fail(std::string_view what, double value, std::string_view allowed) {
  std::ostringstream message;
  message.precision(17);
  message << what << " = " << value << " is out of range: allowed is " << allowed;
  throw std::invalid_argument(message.str());
}

std::string rangeText(double lo, double hi) {
  std::ostringstream text;
  text << "[" << lo << ", " << hi << "]";
  return text.str();
}

/// The model with these parameters, after a check that they are admissible.
template <class M>
M makeChecked(const std::array<double, M::kParams.size()>& values) {
  for (size_t i = 0; i < values.size(); ++i) {
    const ParamSpec& spec = M::kParams[i];
    if (!(values[i] >= spec.min && values[i] <= spec.max)) {
      fail(std::string(M::kName) + " parameter " + std::string(spec.name),
           values[i],
           rangeText(spec.min, spec.max));
    }
  }
  return M::fromParams(values);
}

template <size_t I = 0>
std::string modelNames() {
  if constexpr (I < std::variant_size_v<CameraModelVariant>) {
    using M = std::variant_alternative_t<I, CameraModelVariant>;
    return (I > 0 ? ", " : "") + std::string(M::kName) + modelNames<I + 1>();
  } else {
    return "";
  }
}

[[noreturn]] void failUnknownModel(std::string_view name) {
  throw std::invalid_argument("unknown camera model '" + std::string(name) + "': allowed are " +
                              modelNames());
}

template <size_t I = 0>
CameraModelVariant makeModel(std::string_view name, std::span<const double> params) {
  if constexpr (I < std::variant_size_v<CameraModelVariant>) {
    using M = std::variant_alternative_t<I, CameraModelVariant>;
    if (name != M::kName) return makeModel<I + 1>(name, params);
    constexpr size_t kCount = M::kParams.size();
    if (params.size() != kCount) {
      throw std::invalid_argument("model " + std::string(name) + " takes " +
                                  std::to_string(kCount) + " parameters, got " +
                                  std::to_string(params.size()));
    }
    std::array<double, kCount> values{};
    std::copy(params.begin(), params.end(), values.begin());
    return makeChecked<M>(values);
  } else {
    failUnknownModel(name);
  }
}

template <size_t I = 0>
std::span<const ParamSpec> findSpecs(std::string_view name) {
  if constexpr (I < std::variant_size_v<CameraModelVariant>) {
    using M = std::variant_alternative_t<I, CameraModelVariant>;
    return name == M::kName ? std::span<const ParamSpec>(M::kParams) : findSpecs<I + 1>(name);
  } else {
    failUnknownModel(name);
  }
}

}  // namespace

Camera::Camera(const CameraModelVariant& model, int width, int height, double max_field_angle_rad)
    : model_(std::visit(
          [](const auto& m) -> CameraModelVariant {
            return makeChecked<std::decay_t<decltype(m)>>(m.params());
          },
          model)),
      width_(width),
      height_(height),
      max_field_angle_rad_(max_field_angle_rad),
      angle_limit_(FieldAngleLimit::of(max_field_angle_rad)) {
  const std::string sizes = rangeText(1, kMaxImageSize);
  if (width < 1 || width > kMaxImageSize) fail("image width", width, sizes);
  if (height < 1 || height > kMaxImageSize) fail("image height", height, sizes);
  if (!(max_field_angle_rad > 0 && max_field_angle_rad <= M_PI)) {
    fail("max_field_angle", max_field_angle_rad, "(0, pi] rad");
  }
}

double Camera::maxFieldAngle() const {
  return std::visit(
      [&](const auto& m) { return std::min(m.maxFieldAngle(), max_field_angle_rad_); }, model_);
}

std::string_view Camera::modelName() const {
  return std::visit([](const auto& m) { return std::decay_t<decltype(m)>::kName; }, model_);
}

std::span<const ParamSpec> Camera::paramSpecs() const {
  return std::visit(
      [](const auto& m) -> std::span<const ParamSpec> {
        return std::decay_t<decltype(m)>::kParams;
      },
      model_);
}

std::vector<double> Camera::params() const {
  return std::visit(
      [](const auto& m) {
        const auto p = m.params();
        return std::vector<double>(p.begin(), p.end());
      },
      model_);
}

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& ray_in_cam) const {
  const Pixel<double> p = std::visit(
      [&](const auto& m) { return m.project(ray_in_cam.x(), ray_in_cam.y(), ray_in_cam.z()); },
      model_);
  if (!p.valid || DLSD_MUTANT("invalid-project")) return std::nullopt;
  if (max_field_angle_rad_ < M_PI &&
      !angle_limit_.admits(ray_in_cam.x(), ray_in_cam.y(), ray_in_cam.z())) {
    return std::nullopt;
  }
  return Eigen::Vector2d(p.u, p.v);
}

std::optional<Eigen::Vector3d> Camera::unproject(const Eigen::Vector2d& pixel) const {
  const Ray<double> r =
      std::visit([&](const auto& m) { return m.unproject(pixel.x(), pixel.y()); }, model_);
  if (!r.valid || DLSD_MUTANT("invalid-unproject")) return std::nullopt;
  const Eigen::Vector3d ray(r.x, r.y, r.z);
  if (max_field_angle_rad_ < M_PI && !angle_limit_.admits(r.x, r.y, r.z)) {
    return std::nullopt;
  }
  return ray;
}

std::optional<ProjectionJacobian> Camera::jacobian(const Eigen::Vector3d& ray_in_cam) const {
  if (!project(ray_in_cam)) return std::nullopt;
  const ProjectionJacobian J = std::visit(
      [&](const auto& m) { return m.jacobian(ray_in_cam.x(), ray_in_cam.y(), ray_in_cam.z()); },
      model_);
  return J.allFinite() && !DLSD_MUTANT("invalid-jacobian") ? std::optional(J) : std::nullopt;
}

double imageFieldAngle(const Camera& camera) {
  if (std::holds_alternative<Equirectangular>(camera.model())) return camera.maxFieldAngle();
  // The models turn away from the axis as a pixel gets further from the principal point, so the
  // corners look furthest; the slack is for tangential distortion, as of a tilted lens.
  constexpr double kSlack = 0.02;
  double largest = 0;
  for (const double u : {-0.5, camera.width() - 0.5}) {
    for (const double v : {-0.5, camera.height() - 0.5}) {
      const auto ray = camera.unproject({u, v});
      if (!ray) return camera.maxFieldAngle();
      largest = std::max(largest, fieldAngle(*ray));
    }
  }
  return std::min(camera.maxFieldAngle(), largest + kSlack);
}

std::span<const ParamSpec> paramSpecsOf(std::string_view model_name) {
  return findSpecs(model_name);
}

Camera makeCamera(std::string_view model_name,
                  std::span<const double> params,
                  int width,
                  int height,
                  double max_field_angle_rad) {
  return {makeModel(model_name, params), width, height, max_field_angle_rad};
}

}  // namespace dlsd
