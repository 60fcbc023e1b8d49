#pragma once
// One camera in the terms of another model: the parameters that project the same rays to the same
// pixels best.

#include <optional>
#include <string_view>
#include <vector>

#include "cameras/camera.h"

namespace dlsd {

/// Distances in the image between a pixel and the other camera's projection of its ray, over all
/// pixels (their centres) whose rays have a field angle in a range.
struct ResidualBand {
  double from_rad, to_rad;  ///< Field angle of the source's ray, [from, to).
  size_t compared = 0;      ///< Pixels with a ray that the other camera projects.
  size_t lost = 0;          ///< Pixels with a ray that it does not project.
  double rms_px = 0, max_px = 0;
};

struct ConversionResidual {
  ResidualBand all;                 ///< From 0 to max_field_angle_rad, this one included.
  std::vector<ResidualBand> bands;  /// Of 10 degrees each, from 0 to the last with a pixel in it.
  Eigen::Vector2d worst_px{0, 0};   ///< The pixel of all.max_px; (0, 0) if none was compared.
};

/// Compares two cameras over the source's image; pixels without a ray or with a larger field angle
/// are left out.
[[nodiscard]] ConversionResidual conversionResidual(const Camera& source,
                                                    const Camera& other,
                                                    double max_field_angle_rad = M_PI);

struct Conversion {
  Camera camera;
  ConversionResidual residual;
};

/// Fits the model `model_name` to the source: least squares, over a grid of pixels of the image, of
/// the distance between the pixel and the projection of its ray (Levenberg-Marquardt within the
/// admissible range of the parameters, from several starts, from the axis outwards and at once;
/// never worse than any of the starts). Only rays with a field angle up to max_field_angle_rad
/// count. Distances that are not small against the image's diagonal D count less, d^2 / (1 + d^2 /
/// D^2), and a ray that the model does not project D^2.
///
/// Where the model can express the source exactly, so it does to rounding (<= 1e-9 px); the
/// source's own model is returned as it is. The result has the size of the source and looks no
/// farther than it: if pixels of the source have no ray, or a larger field angle than allowed, then
/// the source's bound of the field angle becomes a limit of the result's. No value if no pixel has
/// a ray within max_field_angle_rad, or no start projects any. Throws std::invalid_argument for an
/// unknown model and a max_field_angle_rad outside (0, pi].
[[nodiscard]] std::optional<Conversion> convertCamera(const Camera& source,
                                                      std::string_view model_name,
                                                      double max_field_angle_rad = M_PI);

}  // namespace dlsd
