#pragma once
// RapidCheck generators for cameras, rays and pixels. Ranges of parameters come from the models'
// kParams tables, so a new model is drawn without a line here.
//
// Everything is made of genReal, so everything shrinks: reals towards their lower bound by
// bisection, rays towards the optical axis, images towards small ones, and what was drawn special
// (at a bound, near the axis, near the rim) towards what was not.

#include <rapidcheck.h>

#include <Eigen/Core>
#include <iosfwd>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// Real in [lo, hi], both included and exact, from a lattice of 2^52 steps. 1 draw in 8 is one of
/// the two bounds or their lattice neighbours. Shrinks to the least failing lattice point.
[[nodiscard]] rc::Gen<double> genReal(double lo, double hi);

/// 0 < lo < hi: uniform in the logarithm, bounds exact, shrinks to lo.
[[nodiscard]] rc::Gen<double> genLogReal(double lo, double hi);

/// Integer in [lo, hi], bounds as genReal, shrinks to lo.
[[nodiscard]] rc::Gen<int> genInt(int lo, int hi);

enum class Range {
  kRealistic,   ///< A camera one could buy: its image mostly inside the domain.
  kAdmissible,  ///< Anything the model accepts, most often near its limits.
};

/// A value of one parameter. Realistic: uniform. Admissible: uniform, log-uniform or realistic.
[[nodiscard]] rc::Gen<double> genParam(const ParamSpec& spec, Range range);

/// A camera of the model of this name. Realistic: the image's half diagonal looks 0.3 rad ... 2 rad
/// away from the axis (less where the domain ends before), the corners of some images lie outside
/// the domain, pixels are nearly square, the principal point is near the centre; 1 in 4 has a limit
/// of the field angle. Parameters that depend on the size of the image are those of the table for
/// a camera of usual size (the geometric mean of the range of fx), scaled to the drawn one. Joint
/// conditions come out as the model's domain, which is at least 0.7 rad. Panoramas are of the whole
/// sphere, of a little more or less or, 1 in 4, such a piece of it.
[[nodiscard]] rc::Gen<Camera> genCamera(std::string_view model_name, Range range);

template <class Model>
[[nodiscard]] rc::Gen<Camera> genCamera(Range range) {
  return genCamera(Model::kName, range);
}

/// kName of every model.
[[nodiscard]] std::vector<std::string_view> cameraModelNames();

/// Any model.
[[nodiscard]] rc::Gen<Camera> genAnyCamera(Range range);

/// Unit ray at this angle to +z (rad) and any azimuth, each azimuth alike and 1 in 8 on an image
/// axis.
[[nodiscard]] rc::Gen<Eigen::Vector3d> genRayAt(rc::Gen<double> angle_rad);

/// Unit ray, uniform on the sphere. Shrinks to +z.
[[nodiscard]] rc::Gen<Eigen::Vector3d> genRay();

/// Unit ray 1e-17 ... 0.1 rad from +z (or, 1 in 8, from -z).
[[nodiscard]] rc::Gen<Eigen::Vector3d> genRayNearAxis();

/// Unit ray at the bound of the camera's domain times (1 +- 10^-k), k in 1 ... 15, or exactly
/// there.
[[nodiscard]] rc::Gen<Eigen::Vector3d> genRayNearBound(const Camera& camera);

/// A mix: half of them rays of the image's pixels, the others from the three above.
[[nodiscard]] rc::Gen<Eigen::Vector3d> genRayFor(const Camera& camera);

/// Pixel in the image, border included.
[[nodiscard]] rc::Gen<Eigen::Vector2d> genPixelInImage(const Camera& camera);

/// Pixel on the border of the image.
[[nodiscard]] rc::Gen<Eigen::Vector2d> genPixelOnBorder(const Camera& camera);

/// Pixel at the bound of the domain in the image plane (where rays near the bound of the domain go;
/// for domains that reach to infinity, far out) times (1 +- 10^-k) from the principal point. For
/// panoramas, on one side of their rectangle times that.
[[nodiscard]] rc::Gen<Eigen::Vector2d> genPixelNearBound(const Camera& camera);

/// A mix of the three above, pixels near the principal point, and pixels up to 1e9 px away.
[[nodiscard]] rc::Gen<Eigen::Vector2d> genPixelFor(const Camera& camera);

/// Principal point, by the names cx and cy in kParams.
[[nodiscard]] Eigen::Vector2d principalPoint(const Camera& camera);

/// The linear map from a model's plane to pixels relative to the principal point, by the names in
/// kParams: of focal lengths and skew, or of aspect ratio and shear.
[[nodiscard]] Eigen::Matrix2d pixelFromPlane(const Camera& camera);

/// The camera of the same lens with a sensor of other pixels: 1 px of it is `factor` px of the new
/// one, which has this size.
[[nodiscard]] Camera scaledCamera(const Camera& camera, double factor, int width, int height);

/// One line: model, parameters with 17 digits, size, limit.
std::ostream& operator<<(std::ostream& out, const Camera& camera);
inline void showValue(const Camera& camera, std::ostream& out) {
  out << camera;
}

}  // namespace dlsd
