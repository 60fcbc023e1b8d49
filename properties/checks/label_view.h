#pragma once
// What the predicates of labels.h look at, and the predicates themselves, one for each property or
// two. For labels*.cpp alone.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "properties/checks/labels.h"
#include "synth/labels.h"
#include "synth/raycaster.h"
#include "synth/shading.h"

namespace dlsd {

/// Contrast is stated from this many places spread evenly over a label's angle.
inline constexpr int kContrastPlaces = 11;

/// A scene with its shadows, and what a camera sees of it.
struct Viewed {
  Scene scene;
  Pose pose;
  Raycaster raycaster;
  std::vector<EdgeSpan> spans;
  Labels labels;

  Viewed(Scene s, const Pose& p, const Camera& camera);
  Viewed(const Viewed&) = delete;
  Viewed& operator=(const Viewed&) = delete;

  [[nodiscard]] std::vector<float> render(const Camera& camera) const;
  /// The picture with its labels.
  [[nodiscard]] ShownPicture shown(const Camera& camera) const;
};

/// Whether the label is the middle of a bar or of its shadow.
[[nodiscard]] bool isMiddle(const Scene& scene, const LabelLine& line);

/// What the picture shows at a place, by rays alone.
class Eye {
 public:
  Eye(const Viewed& seen, const Camera& camera);

  struct Look {
    Hit hit;
    Sight sight = -1;
    Eigen::Vector3d direction{0, 0, 0};  ///< In world.
    [[nodiscard]] bool isSame(const Look& o) const {
      return hit.kind == o.hit.kind && hit.index == o.hit.index && sight == o.sight;
    }
  };
  [[nodiscard]] Look along(const Eigen::Vector3d& ray) const;
  [[nodiscard]] double grey(const Look& look) const;
  /// Looks at pixels, a packet of rays at a time; none where the camera has no ray.
  void at(const std::vector<Eigen::Vector2d>& pixels,
          std::vector<std::optional<Look>>* looks) const;

 private:
  const Viewed& seen_;
  const Camera& camera_;
  Shader shader_;
  Eigen::Matrix3d world_from_cam_;
};

[[nodiscard]] double distanceTo(const Eigen::Vector2d& from,
                                const Eigen::Vector2d& to,
                                const Eigen::Vector2d& p);

/// "(12.3, 4.5)"
[[nodiscard]] std::string textOf(const Eigen::Vector2d& pixel);

/// A small red cross.
void addCross(const Eigen::Vector2d& pixel, ShownPicture* shown);

[[nodiscard]] LabelsOutcome checkOnBorders(const LabelCase& c, bool with_shown);
[[nodiscard]] LabelsOutcome checkVisible(const LabelCase& c, bool with_shown);
[[nodiscard]] LabelsOutcome checkComplete(const LabelCase& c, bool with_shown);
[[nodiscard]] LabelsOutcome checkOtherLens(const LabelCase& c, bool with_shown);
[[nodiscard]] LabelsOutcome checkTurned(const LabelCase& c, bool with_shown);
[[nodiscard]] LabelsOutcome checkMirrored(const LabelCase& c, bool with_shown);

}  // namespace dlsd
