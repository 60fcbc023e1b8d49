#pragma once
// Where a lens's image ends in the dark inside the sensor: an edge of the picture, not of the
// world. A calibration does not say where that is, if its model goes on.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "cameras/camera.h"
#include "detector/detector.h"
#include "detector/grey_rows.h"

namespace dlsd {

/// A circle in the plane of (field angle) * (direction around the optical axis), rad.
struct ImageRim {
  Eigen::Vector2d centre;
  double radius;
};

class ImageRimFinder {
 public:
  explicit ImageRimFinder(const Camera& camera);

  /// Walks from the border of the image towards the optical axis, on kSpokes ways, until it is no
  /// longer as dark as at the border. A rim, if most of these ends lie on one circle around the
  /// axis, in directions all around.
  [[nodiscard]] std::optional<ImageRim> find(const GreyPixels& pixels);

  static constexpr int kSpokes = 128;
  /// Brighter surroundings are none, 8-bit grey levels.
  static constexpr double kDarkLevels = 48;

 private:
  struct Spoke {
    Eigen::Vector2d border, step;  // px
    int steps;
  };
  const Camera& camera_;
  std::vector<Spoke> spokes_;
  std::vector<Eigen::Vector2d> ends_, near_;
  std::vector<double> levels_, radii_;
};

/// Whether most of a line runs along the rim: nearer than the rim is sharp, and in its direction.
[[nodiscard]] bool isOnRim(const Arc& arc, const ImageRim& rim);

}  // namespace dlsd
