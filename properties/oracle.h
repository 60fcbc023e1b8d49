#pragma once
// The camera models once more, straight from their textbook equations in long double libm, for
// tests to compare with. Shares no code with cameras/: no rewriting against cancellation, no
// Horner, no Newton, no derived values; 11 more bits make up for it.

#include <array>
#include <cmath>
#include <optional>

#include "cameras/camera.h"

namespace dlsd {

using Oracle2 = std::array<long double, 2>;

/// Pixel of a ray of any length. No value outside the model's domain; no limit on pixel
/// coordinates.
[[nodiscard]] std::optional<Oracle2> oracleProject(const Pinhole& m,
                                                   long double x,
                                                   long double y,
                                                   long double z);
[[nodiscard]] std::optional<Oracle2> oracleProject(const Fov& m,
                                                   long double x,
                                                   long double y,
                                                   long double z);
[[nodiscard]] std::optional<Oracle2> oracleProject(const KannalaBrandt& m,
                                                   long double x,
                                                   long double y,
                                                   long double z);
[[nodiscard]] std::optional<Oracle2> oracleProject(const UnifiedOmni& m,
                                                   long double x,
                                                   long double y,
                                                   long double z);
[[nodiscard]] std::optional<Oracle2> oracleProject(const PinholeRadtan& m,
                                                   long double x,
                                                   long double y,
                                                   long double z);
[[nodiscard]] std::optional<Oracle2> oracleProject(const Eucm& m,
                                                   long double x,
                                                   long double y,
                                                   long double z);
[[nodiscard]] std::optional<Oracle2> oracleProject(const DoubleSphere& m,
                                                   long double x,
                                                   long double y,
                                                   long double z);

/// Supremum of the field angle of rays that project, rad.
[[nodiscard]] long double oracleMaxFieldAngle(const Pinhole& m);
[[nodiscard]] long double oracleMaxFieldAngle(const Fov& m);
[[nodiscard]] long double oracleMaxFieldAngle(const KannalaBrandt& m);
[[nodiscard]] long double oracleMaxFieldAngle(const UnifiedOmni& m);
[[nodiscard]] long double oracleMaxFieldAngle(const PinholeRadtan& m);
[[nodiscard]] long double oracleMaxFieldAngle(const Eucm& m);
[[nodiscard]] long double oracleMaxFieldAngle(const DoubleSphere& m);

/// Relative uncertainty of that angle when it is found in double: large where the fold is flat.
[[nodiscard]] double oracleBoundUncertainty(const CameraModelVariant& model);

/// By which share, per rad, the derivative of a projection changes where it leaves the axis. 0 for
/// even functions of the field angle.
[[nodiscard]] double oracleBendAtAxis(const CameraModelVariant& model);

/// Supremum of the length of ((u - cx) / fx, (v - cy) / fy) of pixels that have a ray; infinite if
/// all.
[[nodiscard]] long double oracleMaxRadius(const Pinhole& m);
[[nodiscard]] long double oracleMaxRadius(const Fov& m);
[[nodiscard]] long double oracleMaxRadius(const KannalaBrandt& m);
[[nodiscard]] long double oracleMaxRadius(const UnifiedOmni& m);
[[nodiscard]] long double oracleMaxRadius(const Eucm& m);
[[nodiscard]] long double oracleMaxRadius(const DoubleSphere& m);

/// Whether a pixel has a ray.
template <class M>
[[nodiscard]] bool oracleHasRay(const M& m, long double u, long double v) {
  return std::hypot((u - m.cx) / m.fx, (v - m.cy) / m.fy) < oracleMaxRadius(m);
}
[[nodiscard]] bool oracleHasRay(const PinholeRadtan& m, long double u, long double v);

}  // namespace dlsd
