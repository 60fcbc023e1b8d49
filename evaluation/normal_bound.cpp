#include "evaluation/normal_bound.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "cameras/arc.h"
#include "cameras/mutant.h"

namespace dlsd {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Nodes of the midpoint rule along a label's arc.
constexpr int kNodes = 48;

/// Fisher information of the offset across an edge of contrast 1, per px of its length.
double informationPerPx(const ImageNoise& noise) {
  const double blur_px = std::sqrt(noise.blur_px * noise.blur_px + 1.0 / 12);
  const double noise2 =
      noise.noise_levels * noise.noise_levels + (DLSD_MUTANT("bound-rounding") ? 0 : 1.0 / 12);
  return 1 / (2 * std::sqrt(M_PI) * blur_px * noise2);
}

}  // namespace

std::optional<ImageNoise> imageNoise(const LabelRecord& record) {
  const auto& sensor = record.sensor;
  ImageNoise noise;
  for (const char* key : {"psf_sigma_px", "read_noise_levels", "encoding"}) {
    if (!sensor.is_object() || !sensor.contains(key)) {
      return std::nullopt;
    }
  }
  for (const auto& [key, value] : sensor.items()) {
    if (key == "psf_sigma_px" && value.is_number()) {
      noise.blur_px = value.get<double>();
    } else if (key == "read_noise_levels" && value.is_number()) {
      noise.noise_levels = value.get<double>();
    } else if (key == "encoding" && value == "linear") {
    } else if (key == "exposure" || key == "read_noise_seed" || (key == "bits" && value == 8)) {
    } else if (value.is_null() || value == 0 || value == false) {  // switched off
    } else {
      return std::nullopt;
    }
  }
  return noise;
}

double offsetBoundPx(const ImageNoise& noise, double contrast, double length_px) {
  return 1 / std::sqrt(informationPerPx(noise) * contrast * contrast * length_px);
}

std::optional<Matrix3d> normalInformation(const Camera& camera,
                                          const LabelLine& label,
                                          const ImageNoise& noise) {
  const std::optional<Arc> arc =
      arcOnPlane(label.normal, label.points_in_cam[0], label.points_in_cam[1]);
  if (label.kind == LineKind::kWire || !(label.contrast > 0) || !arc) {
    return std::nullopt;
  }
  const double per_px = informationPerPx(noise) * label.contrast * label.contrast;
  const double step_rad = arc->angle() / kNodes;
  Matrix3d information = Matrix3d::Zero();
  for (int k = 0; k < kNodes; ++k) {
    const Vector3d ray = arc->at((k + 0.5) / kNodes);
    const auto jacobian = camera.jacobian(ray);
    if (!jacobian) {
      return std::nullopt;
    }
    // A change d of the normal moves the line's ray by -(d . ray) normal.
    const Vector2d along = *jacobian * arc->normal.cross(ray);
    const Vector2d moved = *jacobian * arc->normal;
    const double px_per_rad = along.norm();
    const double across = (along.x() * moved.y() - along.y() * moved.x()) / px_per_rad;
    information += per_px * px_per_rad * step_rad * across *
                   (DLSD_MUTANT("bound-across") ? px_per_rad : across) * ray * ray.transpose();
  }
  return information.allFinite() ? std::optional(information) : std::nullopt;
}

std::optional<NormalErrorInSigmas> normalErrorInSigmas(const Matrix3d& information,
                                                       const Vector3d& true_normal,
                                                       const Vector3d& normal) {
  // In the plane of the two directions that a unit normal can move in.
  const Vector3d e1 = true_normal.unitOrthogonal();
  const Vector3d e2 = true_normal.cross(e1);
  Eigen::Matrix<double, 3, 2> basis;
  basis << e1, e2;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(basis.transpose() * information *
                                                             basis);
  if (!(eigen.eigenvalues()(0) > 0)) {
    return std::nullopt;
  }
  const double sign = normal.dot(true_normal) < 0 ? -1 : 1;
  const Vector2d change = eigen.eigenvectors().transpose() * basis.transpose() * (sign * normal);
  const Vector2d root = eigen.eigenvalues().cwiseSqrt();
  NormalErrorInSigmas error;
  error.offset = std::abs(change(1)) * root(1);
  error.roll = std::abs(change(0)) * root(0);
  error.bound_rad = std::sqrt(1 / (root(0) * root(0)) + 1 / (root(1) * root(1)));
  error.angle = angleBetweenPlanes(true_normal, normal) / error.bound_rad;
  return error;
}

}  // namespace dlsd
