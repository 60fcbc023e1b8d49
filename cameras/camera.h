#pragma once
// Camera = model + image size (+ an optional limit of the field angle). The one type that the other
// modules take; the models behind it are a closed set, listed once in `CameraModelVariant`.

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "cameras/double_sphere.h"
#include "cameras/equirectangular.h"
#include "cameras/eucm.h"
#include "cameras/fov.h"
#include "cameras/kannala_brandt.h"
#include "cameras/ocam.h"
#include "cameras/omni_radtan.h"
#include "cameras/pinhole.h"
#include "cameras/pinhole_radtan.h"
#include "cameras/theta_polynomial.h"
#include "cameras/unified_omni.h"

namespace dlsd {

using CameraModelVariant = std::variant<Pinhole,
                                        Fov,
                                        KannalaBrandt,
                                        UnifiedOmni,
                                        PinholeRadtan,
                                        OmniRadtan,
                                        Ocam,
                                        ThetaPolynomial,
                                        Eucm,
                                        DoubleSphere,
                                        Equirectangular>;

/// A calibrated central camera. A value: cheap to copy, comparable, immutable.
class Camera {
 public:
  static constexpr int kMaxImageSize = 65535;  ///< px, of width and height.

  /// Takes over the model's parameters; what a model derives from them is derived again.
  /// @param max_field_angle_rad  Rays at a larger angle to +z do not project and pixels that look
  ///   there have no ray, for lenses and mirrors that end before their model does. In (0, pi].
  /// Throws std::invalid_argument naming the parameter, its value and the allowed range if a
  /// parameter is outside the model's admissible range or not finite, or a size outside [1, 65535].
  Camera(const CameraModelVariant& model, int width, int height, double max_field_angle_rad = M_PI);

  [[nodiscard]] const CameraModelVariant& model() const { return model_; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// As given to the constructor.
  [[nodiscard]] double maxFieldAngleLimit() const { return max_field_angle_rad_; }
  /// The same as a test of rays. Only for limits below pi.
  [[nodiscard]] const FieldAngleLimit& angleLimit() const { return angle_limit_; }
  /// Supremum of the angle to +z (rad) of rays that project: the smaller of model's and limit.
  [[nodiscard]] double maxFieldAngle() const;
  [[nodiscard]] std::string_view modelName() const;
  [[nodiscard]] std::span<const ParamSpec> paramSpecs() const;
  [[nodiscard]] std::vector<double> params() const;

  /// Pixel of a ray or point in the camera frame (any positive scale). No value outside the model's
  /// domain. The pixel may lie outside the image: ask inImage.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& ray_in_cam) const;

  /// Unit ray in the camera frame of a pixel, inside the image or not. No value outside the domain.
  [[nodiscard]] std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const;

  /// d(pixel) / d(ray) at a ray that projects. No value outside the domain, and where there is no
  /// derivative (at the poles of a panorama).
  [[nodiscard]] std::optional<ProjectionJacobian> jacobian(const Eigen::Vector3d& ray_in_cam) const;

  /// The image covers [-0.5, width - 0.5] x [-0.5, height - 0.5].
  [[nodiscard]] bool inImage(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= -0.5 && pixel.x() <= width_ - 0.5 && pixel.y() >= -0.5 &&
           pixel.y() <= height_ - 0.5;
  }

  bool operator==(const Camera&) const = default;

 private:
  CameraModelVariant model_;
  int width_, height_;
  double max_field_angle_rad_;
  FieldAngleLimit angle_limit_;
};

/// Angle of a ray of any length to +z, rad.
template <class Derived>
[[nodiscard]] double fieldAngle(const Eigen::MatrixBase<Derived>& ray_in_cam) {
  return std::atan2(std::hypot(ray_in_cam.x(), ray_in_cam.y()), ray_in_cam.z());
}

/// An angle to +z (rad) that no pixel of the image looks beyond; at most camera.maxFieldAngle().
[[nodiscard]] double imageFieldAngle(const Camera& camera);

/// Parameter table of a model by its kName. Throws std::invalid_argument for an unknown name.
[[nodiscard]] std::span<const ParamSpec> paramSpecsOf(std::string_view model_name);

/// Builds a camera from a model's name and its parameters in the order of its kParams.
/// Throws std::invalid_argument for an unknown name, a wrong number of parameters or a bad value.
[[nodiscard]] Camera makeCamera(std::string_view model_name,
                                std::span<const double> params,
                                int width,
                                int height,
                                double max_field_angle_rad = M_PI);

}  // namespace dlsd
