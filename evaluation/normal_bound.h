#pragma once
// How well the plane of a line can be known from its edge in a noisy image: the Cramer-Rao bound.
// docs/evaluation.md derives it.

#include <Eigen/Core>
#include <optional>

#include "cameras/camera.h"
#include "synth/dataset/records.h"

namespace dlsd {

/// Optical blur and noise of an image, standard deviations.
struct ImageNoise {
  double blur_px = 0;       ///< Of the optics, without the pixel's own square.
  double noise_levels = 0;  ///< In 8-bit grey levels, without rounding to whole levels.
};

/// Noise and blur of a record's image. None if its sensor is not one that the bound holds for: grey
/// levels not linear in light, or anything switched on beyond blur, exposure and read noise.
[[nodiscard]] std::optional<ImageNoise> imageNoise(const LabelRecord& record);

/// Least standard deviation (px) of the offset across a straight edge of contrast c (grey levels)
/// and length L (px): sqrt(2 sqrt(pi) sigma_b sigma_n^2 / (c^2 L)), sigma_b^2 = blur^2 + 1/12,
/// sigma_n^2 = noise^2 + 1/12.
[[nodiscard]] double offsetBoundPx(const ImageNoise& noise, double contrast, double length_px);

/// Fisher information of the plane normal of a label, of rank 2: for a small change d of the unit
/// normal, d^T information d is the squared distance in standard deviations. None for wires (two
/// edges, not one), labels without contrast, and where the camera has no Jacobian.
[[nodiscard]] std::optional<Eigen::Matrix3d> normalInformation(const Camera& camera,
                                                               const LabelLine& label,
                                                               const ImageNoise& noise);

/// Size of an error of a plane normal relative to the bound: for an estimator that reaches it each
/// has root mean square 1.
struct NormalErrorInSigmas {
  double offset = 0;     ///< Along the direction that is known best: the curve moves across.
  double roll = 0;       ///< Along the one that is known worst: it turns about its middle.
  double angle = 0;      ///< Whole angle over the bound on its root mean square.
  double bound_rad = 0;  ///< That bound: sqrt(trace of the information's pseudo-inverse).
};

/// The signs of the two unit normals do not matter. None if the information has rank below 2.
[[nodiscard]] std::optional<NormalErrorInSigmas> normalErrorInSigmas(
    const Eigen::Matrix3d& information,
    const Eigen::Vector3d& true_normal,
    const Eigen::Vector3d& normal);

}  // namespace dlsd
