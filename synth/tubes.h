#pragma once
// Geometry of the round things whose outlines have no closed form or depend on the place they are
// seen from: tubes (tori, sagging wires) and cylinders. All in double.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "synth/scene.h"

namespace dlsd {

// --- Tubes ---

/// Ends of the spine's parameter.
[[nodiscard]] std::array<double, 2> spineRange(const Tube& tube);
[[nodiscard]] Eigen::Vector3d spineAt(const Tube& tube, double t);
/// Its derivative.
[[nodiscard]] Eigen::Vector3d spineTangent(const Tube& tube, double t);
/// Parameter of the point of the spine that is nearest to `p`, in closed form.
[[nodiscard]] double nearestOnSpine(const Tube& tube, const Eigen::Vector3d& p);

/// The tube as seen from a turned and moved frame.
[[nodiscard]] Tube transformed(const Tube& tube,
                               const Eigen::Matrix3d& rotation,
                               const Eigen::Vector3d& origin);

/// Boxes around `pieces` pieces of equal parameter, a little wider than they need be.
[[nodiscard]] std::vector<Eigen::AlignedBox3d> boxesOf(const Tube& tube, int pieces);

/// First distance in (near, far) at which a ray with unit direction comes within 1e-7 m of the
/// tube. The distance to the spine has a closed form, so the ray goes forward by its distance to
/// the tube, which never jumps over anything (J. C. Hart, Sphere tracing, 1996).
[[nodiscard]] std::optional<double> enterTube(const Tube& tube,
                                              const Eigen::Vector3d& origin,
                                              const Eigen::Vector3d& direction,
                                              double near,
                                              double far);

/// The outline as seen from `eye`, hidden or not: curves of points on the tube at which lines of
/// sight touch it, `pieces` steps along the spine. At a spine point c with the unit tangent w they
/// are c + radius m, with the unit vectors m square to w for which m . (eye - c) = radius. The
/// round ends of strings bring their whole circles.
[[nodiscard]] std::vector<std::vector<Eigen::Vector3d>> outlineOf(const Tube& tube,
                                                                  const Eigen::Vector3d& eye,
                                                                  int pieces);

/// Ranges of the spine's parameter in which its balls touch the plane normal . p = height.
[[nodiscard]] std::vector<std::array<double, 2>> spineNearPlane(const Tube& tube,
                                                                const Eigen::Vector3d& normal,
                                                                double height);

/// Where a tube may begin or end to cover what lies in a plane through the eye. `covered(centre)`
/// says which interval {lo, hi} a ball around `centre` that touches the plane covers, in a
/// parameter of the directions in that plane; the tube covers the union of its balls' intervals,
/// which over each piece of the spine that is near the plane is [least lo, greatest hi]. Both are
/// found among samples of the spine and refined by golden sections; `add` gets them, and other
/// values where several are local extremes.
template <class Covered, class Add>
void addTubeEvents(const Tube& tube,
                   const Eigen::Vector3d& normal,
                   double height,
                   const Covered& covered,
                   const Add& add) {
  constexpr size_t kSamples = 33;
  constexpr int kRefinements = 44;  // 0.618^44 = 6e-10 of two samples' distance.
  constexpr double kGolden = 0.6180339887498949;
  for (const auto& [t0, t1] : spineNearPlane(tube, normal, height)) {
    std::array<double, kSamples> t;
    std::array<std::array<double, 2>, kSamples> value;
    for (size_t k = 0; k < kSamples; ++k) {
      // Denser at the ends, where intervals grow from nothing.
      const double c = std::cos(M_PI * static_cast<double>(k) / (kSamples - 1));
      t[k] = (t0 + t1) / 2 - (t1 - t0) / 2 * c;
      value[k] = covered(spineAt(tube, t[k]));
    }
    for (size_t side = 0; side < 2; ++side) {
      const double sign = side == 0 ? 1 : -1;  // Times which it is a minimum.
      for (size_t k = 0; k < kSamples; ++k) {
        const size_t left = k > 0 ? k - 1 : 0, right = std::min(k + 1, kSamples - 1);
        if (sign * value[k][side] > sign * value[left][side] ||
            sign * value[k][side] > sign * value[right][side]) {
          continue;
        }
        double a = t[left], b = t[right], best = value[k][side];
        double p = b - kGolden * (b - a), q = a + kGolden * (b - a);
        double at_p = covered(spineAt(tube, p))[side], at_q = covered(spineAt(tube, q))[side];
        for (int i = 0; i < kRefinements; ++i) {
          if (sign * at_p < sign * at_q) {
            b = q;
            q = p;
            at_q = at_p;
            p = b - kGolden * (b - a);
            at_p = covered(spineAt(tube, p))[side];
          } else {
            a = p;
            p = q;
            at_p = at_q;
            q = a + kGolden * (b - a);
            at_q = covered(spineAt(tube, q))[side];
          }
        }
        for (const double x : {at_p, at_q}) {
          if (sign * x < sign * best) best = x;
        }
        add(best);
      }
    }
  }
}

// --- Cylinders ---

/// First distance in (near, far) at which a ray meets the side of a round rod from outside.
[[nodiscard]] std::optional<double> enterCylinder(const Rod& rod,
                                                  const Eigen::Vector3d& origin,
                                                  const Eigen::Vector3d& direction,
                                                  double near,
                                                  double far);

[[nodiscard]] Eigen::AlignedBox3d boxOf(const Rod& rod);

/// The two straight lines on a round rod at which lines of sight from `eye` touch it, along the
/// rod's direction; the sun's rays for a sun. None from inside of the endless cylinder.
[[nodiscard]] std::vector<std::array<Eigen::Vector3d, 2>> sidesFrom(const Rod& rod,
                                                                    const Eigen::Vector3d& eye);
[[nodiscard]] std::vector<std::array<Eigen::Vector3d, 2>> sidesFromSun(
    const Rod& rod, const Eigen::Vector3d& direction);

/// Appends the sides of all round rods as seen from `eye` to the scene's edges and numbers the
/// carriers anew. Call once for each view.
void addRodSides(const Eigen::Vector3d& eye, Scene* scene);

}  // namespace dlsd
