#pragma once
// The camera models once more, straight from their textbook equations in long double libm, for
// tests to compare with. Shares no code with cameras/: no rewriting against cancellation, no
// Horner, no Newton, no derived values; 11 more bits make up for it.
//
// A new model needs three overloads in oracle.cpp: imageOf (its equation, a template on the
// scalar), maxFieldAngle, and hasRay (or, where that is a question of the radius, maxRadius).

#include <array>
#include <optional>

#include "cameras/camera.h"

namespace dlsd {

using Oracle2 = std::array<long double, 2>;
using OracleJacobian = Eigen::Matrix<long double, 2, 3>;

/// Pixel of a ray of any length. No value outside the model's domain; no limit on pixel
/// coordinates.
[[nodiscard]] std::optional<Oracle2> oracleProject(const CameraModelVariant& model,
                                                   long double x,
                                                   long double y,
                                                   long double z);

/// d(pixel) / d(ray) of a ray inside the domain and off the axis, by automatic differentiation of
/// that equation.
[[nodiscard]] OracleJacobian oracleJacobian(const CameraModelVariant& model,
                                            long double x,
                                            long double y,
                                            long double z);

/// Supremum of the field angle of rays that project, rad.
[[nodiscard]] long double oracleMaxFieldAngle(const CameraModelVariant& model);

/// Whether a pixel of any size has a ray.
[[nodiscard]] bool oracleHasRay(const CameraModelVariant& model, long double u, long double v);

/// Relative uncertainty of the bound of the domain, on the sphere and in the image, when it is
/// found in double: large where the fold is flat.
[[nodiscard]] double oracleBoundUncertainty(const CameraModelVariant& model);

/// By which share, per rad, the derivative of a projection changes where it leaves the axis. 0 for
/// even functions of the field angle.
[[nodiscard]] double oracleBendAtAxis(const CameraModelVariant& model);

}  // namespace dlsd
