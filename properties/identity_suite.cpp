// Models that are special cases of each other, and of projections with a name of their own: the
// same pixels and the same rays within 1e-9 px, wherever a realistic image has pixels.

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "properties/gen.h"
#include "properties/holds.h"

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTolerancePx = 1e-9;
/// Pixels of realistic images, and some way around them, are within.
constexpr double kImagePx = 5000;
/// Relative band at the bounds of the domain inside which either answer is right.
constexpr double kBand = 1e-12;
constexpr int kMany = 64;

double angleToAxis(const Vector3d& ray) {
  return std::atan2(std::hypot(ray.x(), ray.y()), ray.z());
}

/// A projection to compare a camera with.
struct Projection {
  std::string name;
  std::function<std::optional<Vector2d>(const Vector3d&)> project;
  std::function<std::optional<Vector3d>(const Vector2d&)> unproject;
};

Projection projectionOf(const Camera& camera) {
  std::ostringstream name;
  name << camera;
  return {name.str(),
          [camera](const Vector3d& ray) { return camera.project(ray); },
          [camera](const Vector2d& pixel) { return camera.unproject(pixel); }};
}

/// f * radius(theta), in long double; angle is the inverse of radius.
Projection projectionOf(const std::string& name,
                        double fx,
                        double fy,
                        const Vector2d& centre,
                        long double (*radius)(long double theta),
                        long double (*angle)(long double radius)) {
  return {name,
          [=](const Vector3d& ray) -> std::optional<Vector2d> {
            const long double x = ray.x(), y = ray.y(), r = std::hypot(x, y);
            if (r == 0) return ray.z() > 0 ? std::optional(centre) : std::nullopt;
            const long double rho = radius(std::atan2(r, static_cast<long double>(ray.z())));
            return Vector2d(static_cast<double>(fx * rho * x / r + centre.x()),
                            static_cast<double>(fy * rho * y / r + centre.y()));
          },
          [=](const Vector2d& pixel) -> std::optional<Vector3d> {
            const long double x = (static_cast<long double>(pixel.x()) - centre.x()) / fx;
            const long double y = (static_cast<long double>(pixel.y()) - centre.y()) / fy;
            const long double rho = std::hypot(x, y), theta = angle(rho);
            if (!(theta <= static_cast<long double>(M_PI))) return std::nullopt;
            const long double s = rho > 0 ? std::sin(theta) / rho : 1;
            return Vector3d(static_cast<double>(s * x),
                            static_cast<double>(s * y),
                            static_cast<double>(std::cos(theta)));
          }};
}

struct Pair {
  Camera camera;
  Projection same;
  double max_angle = M_PI;  ///< Rays beyond are not compared, rad.
};

/// Checks that camera and projection of each drawn pair are the same, both ways.
void areTheSame(const std::function<Pair()>& draw) {
  double worst_there = 0, worst_back = 0;
  long rays = 0, pixels = 0;
  const long cases = holds(1, [&] {
    const auto [camera, same, max_angle] = draw();
    const auto fail = [&, &drawn = camera, &other = same](const auto& at, double off) {
      std::ostringstream text;
      text << std::setprecision(17) << drawn << " and " << other.name << " differ by " << off
           << " px at " << at.transpose();
      RC_FAIL(text.str());
    };
    for (int n = 0; n < kMany; ++n) {
      const Vector3d ray = *rc::gen::noShrink(genRayFor(camera));
      const auto a = camera.project(ray), b = same.project(ray);
      const double theta = angleToAxis(ray);
      if (theta > max_angle) continue;
      const auto inImage = [](const std::optional<Vector2d>& p) {
        return p && p->cwiseAbs().maxCoeff() <= kImagePx;
      };
      if (!inImage(a) && !inImage(b)) continue;
      if (a.has_value() != b.has_value()) {
        if (std::abs(theta / camera.maxFieldAngle() - 1) <= kBand) continue;
        fail(ray, std::numeric_limits<double>::infinity());
      }
      ++rays;
      const double off = (*a - *b).norm();
      worst_there = std::max(worst_there, off);
      if (!(off <= kTolerancePx)) fail(ray, off);
    }
    for (int n = 0; n < kMany; ++n) {
      const Vector2d pixel = *rc::gen::noShrink(genPixelInImage(camera));
      const auto a = camera.unproject(pixel), b = same.unproject(pixel);
      if (a && angleToAxis(*a) > max_angle) continue;
      if (a.has_value() != b.has_value()) {
        // Only within rounding of the bound.
        const Vector2d centre = principalPoint(camera);
        const Vector2d inner = centre + (pixel - centre) * (1 - 1e-11);
        const Vector2d outer = centre + (pixel - centre) * (1 + 1e-11);
        if (camera.unproject(inner) && !camera.unproject(outer)) continue;
        fail(pixel, std::numeric_limits<double>::infinity());
      }
      if (!a) continue;
      const auto J = camera.jacobian(*a);
      if (!J) continue;
      ++pixels;
      // By how far the pixel would have to move.
      const double smallest = Eigen::JacobiSVD<ProjectionJacobian>(*J).singularValues()(1);
      const double off = (*a - *b).norm() * smallest;
      worst_back = std::max(worst_back, off);
      if (!(off <= kTolerancePx)) fail(pixel, off);
    }
  });
  EXPECT_GE(rays, cases * 20);
  EXPECT_GE(pixels, cases * 40);
  std::cout << "    worst of " << rays << " rays " << worst_there << " px, of " << pixels
            << " pixels " << worst_back << " px\n";
}

/// A realistic camera with these parameters set.
template <class M>
Camera drawWith(const std::vector<std::pair<std::string_view, double>>& values) {
  const Camera drawn = *genCamera<M>(Range::kRealistic);
  std::vector<double> params = drawn.params();
  for (const auto& [name, value] : values) {
    for (size_t i = 0; i < params.size(); ++i) {
      if (M::kParams[i].name == name) params[i] = value;
    }
  }
  return makeCamera(M::kName, params, drawn.width(), drawn.height(), drawn.maxFieldAngleLimit());
}

template <class M>
const M& modelOf(const Camera& camera) {
  return std::get<M>(camera.model());
}

/// The projection of another model, with the same size and limit.
template <class M>
Projection like(const Camera& camera, const M& model) {
  return projectionOf(Camera(model, camera.width(), camera.height(), camera.maxFieldAngleLimit()));
}

/// The camera without its limit of the field angle, which named projections do not have.
Camera unlimited(const Camera& camera) {
  return {camera.model(), camera.width(), camera.height()};
}

TEST(Identities, KannalaBrandtWithoutCoefficientsIsEquidistant) {
  areTheSame([] {
    const Camera camera =
        unlimited(drawWith<KannalaBrandt>({{"k1", 0}, {"k2", 0}, {"k3", 0}, {"k4", 0}}));
    const auto& m = modelOf<KannalaBrandt>(camera);
    return Pair{camera,
                projectionOf(
                    "equidistant",
                    m.fx,
                    m.fy,
                    {m.cx, m.cy},
                    [](long double theta) { return theta; },
                    [](long double rho) { return rho; })};
  });
}

TEST(Identities, UnifiedWithXiZeroIsThePinhole) {
  areTheSame([] {
    const Camera camera = drawWith<UnifiedOmni>({{"xi", 0}});
    const auto& m = modelOf<UnifiedOmni>(camera);
    return Pair{camera, like(camera, Pinhole{m.fx, m.fy, m.cx, m.cy})};
  });
}

TEST(Identities, UnifiedWithXiOneIsStereographic) {
  areTheSame([] {
    const Camera camera = unlimited(drawWith<UnifiedOmni>({{"xi", 1}}));
    const auto& m = modelOf<UnifiedOmni>(camera);
    return Pair{camera,
                projectionOf(
                    "stereographic",
                    m.fx,
                    m.fy,
                    {m.cx, m.cy},
                    [](long double theta) { return std::tan(theta / 2); },
                    [](long double rho) { return 2 * std::atan(rho); })};
  });
}

TEST(Identities, EucmWithBetaOneIsUnified) {
  areTheSame([] {
    const Camera camera = drawWith<UnifiedOmni>({});
    const auto& m = modelOf<UnifiedOmni>(camera);
    const double s = 1 + m.xi;
    return Pair{camera, like(camera, Eucm{m.xi / s, 1, m.fx / s, m.fy / s, m.cx, m.cy})};
  });
}

TEST(Identities, DoubleSphereWithXiZeroIsUnified) {
  areTheSame([] {
    const Camera camera = drawWith<UnifiedOmni>({});
    const auto& m = modelOf<UnifiedOmni>(camera);
    const double s = 1 + m.xi;
    return Pair{camera, like(camera, DoubleSphere{0, m.xi / s, m.fx / s, m.fy / s, m.cx, m.cy})};
  });
}

TEST(Identities, DoubleSphereWithAlphaZeroIsUnified) {
  // Only the first sphere is left: r / (z + xi d).
  areTheSame([] {
    const Camera camera = drawWith<UnifiedOmni>({});
    const auto& m = modelOf<UnifiedOmni>(camera);
    return Pair{camera, like(camera, DoubleSphere{m.xi, 0, m.fx, m.fy, m.cx, m.cy})};
  });
}

TEST(Identities, FovWithVanishingOmegaIsThePinhole) {
  // Up to 75 degrees: they differ by f omega^2 (m^3 / 3 - m / 12), which grows with tan^3.
  areTheSame([] {
    const Camera camera = drawWith<Pinhole>({});
    const auto& m = modelOf<Pinhole>(camera);
    const double omega = *genInt(0, 3) == 0 ? 0.0 : *genLogReal(1e-12, 1e-7);
    return Pair{
        camera, like(camera, Fov::fromParams({m.fx, m.fy, m.cx, m.cy, omega})), 75 * M_PI / 180};
  });
}

TEST(Identities, EquirectangularMeridianAndEquatorAreEquidistant) {
  // On the two axes of the image, longitude or latitude is the field angle.
  double worst = 0;
  long seen = 0;
  const long cases = holds(1, [&] {
    const Camera camera = unlimited(drawWith<Equirectangular>({}));
    const auto& m = modelOf<Equirectangular>(camera);
    const Camera equidistant(KannalaBrandt::fromParams({m.fx, m.fy, m.cx, m.cy, 0, 0, 0, 0}),
                             camera.width(),
                             camera.height());
    for (int n = 0; n < kMany; ++n) {
      const double theta = *rc::gen::noShrink(genReal(-M_PI / 2, M_PI / 2));
      for (const Vector3d& ray : {Vector3d(std::sin(2 * theta), 0, std::cos(2 * theta)),
                                  Vector3d(0, std::sin(theta), std::cos(theta))}) {
        const auto a = camera.project(ray), b = equidistant.project(ray);
        if (!b) continue;  // -z
        RC_ASSERT(a.has_value());
        ++seen;
        const double off = (*a - *b).norm();
        worst = std::max(worst, off);
        RC_ASSERT(off <= kTolerancePx);
      }
    }
  });
  EXPECT_GE(seen, cases * kMany);
  std::cout << "    worst of " << seen << " rays " << worst << " px\n";
}

}  // namespace
}  // namespace dlsd
