// What must hold for every camera model: a new model is tested as soon as CameraModelVariant has it
// (and oracle.cpp its equation). Each case draws one camera and many rays or pixels; the worst
// errors seen are printed in units of what is allowed.

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <tuple>

#include "cameras/arc.h"
#include "cameras/batch.h"
#include "cameras/calibration/calibration.h"
#include "cameras/calibration/files.h"
#include "properties/gen.h"
#include "properties/holds.h"
#include "properties/oracle.h"
#include "properties/worst.h"
#ifdef DLSD_HAVE_CALIB3D
#include <opencv2/calib3d.hpp>
#endif
#ifdef DLSD_HAVE_CCALIB
#include <opencv2/ccalib/omnidir.hpp>
#endif

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// --- Tolerances, all in one place ---

/// pixel -> ray -> pixel inside the image, px.
constexpr double kPixelRoundTrip = 1e-10;
/// ray -> pixel -> ray, in ulps of the largest of |u|, |v|, |cx|, |cy| over the smallest singular
/// value of the projection's Jacobian: what the pixel's own resolution allows.
constexpr double kRayRoundTripUlps = 8;
/// Resolution of a unit ray's own coordinates, added where the pixel is outside the image: far out,
/// a pixel can be finer than any double ray.
constexpr double kRayResolution = 2 * std::numeric_limits<double>::epsilon();
/// The same for the way back from a pixel: the field angle rounds, and the inverse of the double
/// sphere takes two steps, each of which rounds.
double inverseResolution(const Camera& camera, const Vector3d& ray) {
  const double angle = fieldAngle(ray);
  const double ulp = std::nextafter(angle, 4) - angle;
  const double steps = std::holds_alternative<DoubleSphere>(camera.model()) ? 1.5 : 1;
  return std::max(steps * kRayResolution, 2 * ulp);
}
/// Relative band at the bounds of the domain inside which either answer is right.
constexpr double kBand = 1e-12;
/// Relative error of a Jacobian, over the angle to the bound of the domain relative to the field
/// angle.
constexpr double kJacobian = 128 * std::numeric_limits<double>::epsilon();
/// Number of rays or pixels drawn for each camera. DLSD_DRAWS makes it another: few rays of very
/// many cameras take as long as many rays of some.
const size_t kMany = [] {
  const char* text = std::getenv("DLSD_DRAWS");
  if (text == nullptr) return 64UL;
  char* end = nullptr;
  const unsigned long draws = std::strtoul(text, &end, 10);
  if (end == text || *end != '\0' || draws < 4 || draws > 1000000) {
    std::cerr << "DLSD_DRAWS = \"" << text << "\": allowed is 4 to 1000000\n";
    std::exit(2);
  }
  return draws;
}();

/// As many of this camera's draws as these are of 64.
long ofDraws(long count) {
  return count * static_cast<long>(kMany) / 64;
}

// --- Helpers ---

double ulp(double x) {
  x = std::abs(x);
  return std::nextafter(x, std::numeric_limits<double>::infinity()) - x;
}

/// Of the largest of |u|, |v|, |cx|, |cy| and, which is larger outside the image only, |u - cx| and
/// |v - cy|.
double pixelUlp(const Camera& camera, const Vector2d& pixel) {
  const Vector2d c = principalPoint(camera);
  return ulp(std::max(
      {pixel.cwiseAbs().maxCoeff(), c.cwiseAbs().maxCoeff(), (pixel - c).cwiseAbs().maxCoeff()}));
}

/// Whether validity is up to rounding. There, values are not measured either: at -z, and where the
/// image of the sphere folds, the Jacobian is not even finite. Nor is it at the poles of a
/// panorama.
bool atBound(const Camera& camera, const Vector3d& ray) {
  return !(fieldAngle(ray) < camera.maxFieldAngle() * (1 - kBand)) || !camera.jacobian(ray);
}
/// Whether a ray is at most this far from a pole of a panorama, rad.
bool atPole(const Camera& camera, const Vector3d& ray, double distance) {
  return std::holds_alternative<Equirectangular>(camera.model()) &&
         std::hypot(ray.x(), ray.z()) <= distance;
}
/// Whether rounding decides on which side of a panorama's image a ray is (or, at a pole, where).
bool atSeam(const Camera& camera, const Vector3d& ray) {
  if (atPole(camera, ray, 2e-8)) return true;
  return std::holds_alternative<Equirectangular>(camera.model()) && ray.z() < 0 &&
         std::abs(ray.x()) <= 1e-12;
}

/// Sum of the absolute terms of a camera's radial polynomial over their sum, >= 1: where they
/// cancel, the radius is of more ulp than itself.
double cancellation(const Camera& camera, double theta) {
  const auto ratio = [&](std::initializer_list<double> coefficients, double first, double step) {
    double sum = 0, terms = 0, power = first;
    for (const double k : coefficients) {
      sum += k * power;
      terms += std::abs(k * power);
      power *= step;
    }
    return terms / std::abs(sum);
  };
  const auto& model = camera.model();
  if (const auto* m = std::get_if<KannalaBrandt>(&model)) {
    return ratio({1, m->k1, m->k2, m->k3, m->k4}, theta, theta * theta);
  }
  if (const auto* m = std::get_if<ThetaPolynomial>(&model)) {
    return ratio({m->k1, m->k2, m->k3, m->k4}, theta, theta);
  }
  return 1;
}

/// What an error that to first order is error_rad becomes at this distance from a fold, to which
/// the radius rises as a parabola does to its vertex.
double nearFold(double error_rad, double to_fold_rad) {
  const double rest = 1 - 2 * error_rad / to_fold_rad;
  return rest > 0 ? to_fold_rad * (1 - std::sqrt(rest)) : std::max(to_fold_rad, error_rad);
}

double angleBetween(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

struct Singular {
  double largest, smallest;
};
Singular singularValues(const ProjectionJacobian& J) {
  const Eigen::JacobiSVD<ProjectionJacobian> svd(J);
  return {svd.singularValues()(0), svd.singularValues()(1)};
}

/// Many draws of one generator. Only cameras shrink, and failures name the one ray or pixel:
/// shrinking and printing all of them takes longer than it helps.
template <class T>
struct Batch {
  std::vector<T> values;
};
template <class T>
void showValue(const Batch<T>& batch, std::ostream& out) {
  out << batch.values.size() << " draws";
}
template <class T>
std::vector<T> draw(size_t count, const rc::Gen<T>& gen) {
  return (*rc::gen::noShrink(
              rc::gen::map(rc::gen::container<std::vector<T>>(count, gen),
                           [](std::vector<T> values) { return Batch<T>{std::move(values)}; })))
      .values;
}
template <class T>
std::vector<T> many(const rc::Gen<T>& gen) {
  return draw(kMany, gen);
}

/// What a pixel's offset from the principal point, in the model's plane, loses to rounding relative
/// to its length: not the model's doing.
double offsetRounding(const Camera& camera, const Vector2d& pixel) {
  const Eigen::Matrix2d plane_from_pixel = pixelFromPlane(camera).inverse();
  const Vector2d c = principalPoint(camera);
  const Vector2d ulps(ulp(std::max(std::abs(pixel.x()), std::abs(c.x()))),
                      ulp(std::max(std::abs(pixel.y()), std::abs(c.y()))));
  return 4 * (plane_from_pixel.cwiseAbs() * ulps).norm() / (plane_from_pixel * (pixel - c)).norm();
}

/// The pixel moved towards the principal point, out of the band in which validity is up to
/// rounding. Of a panorama its ray is moved towards the axis besides, which is another direction.
Vector2d pulledIn(const Camera& camera, const Vector2d& pixel) {
  const double share = kBand + offsetRounding(camera, pixel);
  const Vector2d c = principalPoint(camera);
  const Vector2d inner = share < 1 ? Vector2d(c + (pixel - c) * (1 - share)) : c;
  const Camera whole(camera.model(), camera.width(), camera.height());
  const auto ray = whole.unproject(inner);
  if (!std::holds_alternative<Equirectangular>(camera.model()) || !ray) return inner;
  const double theta = fieldAngle(*ray) * (1 - share);
  const Vector2d across = ray->head<2>().normalized() * std::sin(theta);
  return whole.project({across.x(), across.y(), std::cos(theta)}).value_or(inner);
}

std::string describe(const Camera& camera, const Vector3d& ray) {
  std::ostringstream text;
  text << std::setprecision(17) << camera << ", ray " << ray.transpose() << " at "
       << fieldAngle(ray) << " rad of " << camera.maxFieldAngle();
  return text.str();
}
std::string describe(const Camera& camera, const Vector2d& pixel) {
  std::ostringstream text;
  text << std::setprecision(17) << camera << ", pixel " << pixel.transpose();
  return text.str();
}

/// By model name.
class CameraSuite : public ::testing::TestWithParam<std::string_view> {};
INSTANTIATE_TEST_SUITE_P(,
                         CameraSuite,
                         ::testing::ValuesIn(cameraModelNames()),
                         [](const auto& test) { return std::string(test.param); });

/// Where a camera comes from. Its worst errors are kept apart.
enum Kind : size_t { kRealistic, kAdmissible, kFixture };
const std::vector<std::string_view> kKinds{"realistic", "admissible", "fixtures"};

struct Drawn {
  Camera camera;
  Kind kind;
};
void showValue(const Drawn& drawn, std::ostream& out) {
  out << drawn.camera;
}

/// One of the model's table: the middle of each realistic range.
Camera exampleCamera(std::string_view model) {
  std::vector<double> params;
  for (const ParamSpec& spec : paramSpecsOf(model)) {
    params.push_back((spec.realistic_min + spec.realistic_max) / 2);
  }
  return makeCamera(model, params, 10, 10);
}

/// The cameras of one model in fixtures/calibrations.
const std::vector<Camera>& fixtureCameras(std::string_view model) {
  static const std::map<std::string, std::vector<Camera>, std::less<>> all = [] {
    std::map<std::string, std::vector<Camera>, std::less<>> result;
    namespace fs = std::filesystem;
    for (const auto& entry : fs::recursive_directory_iterator(std::string(DLSD_SOURCE_DIR) +
                                                              "/fixtures/calibrations")) {
      if (!entry.is_regular_file()) continue;
      for (const NamedCamera& named : loadCalibration(entry.path().string()).cameras) {
        std::vector<Camera>& same = result[std::string(named.camera.modelName())];
        if (std::find(same.begin(), same.end(), named.camera) == same.end()) {
          same.push_back(named.camera);
        }
      }
    }
    return result;
  }();
  static const std::vector<Camera> none;
  const auto found = all.find(model);
  return found == all.end() ? none : found->second;
}

/// One in four an admissible one, one in eight one from a calibration file.
rc::Gen<Drawn> genDrawn(std::string_view model) {
  return rc::gen::mapcat(genInt(0, 7), [model](int draw) -> rc::Gen<Drawn> {
    const std::vector<Camera>& fixtures = fixtureCameras(model);
    if (draw == 1 && !fixtures.empty()) {
      return rc::gen::map(genInt(0, static_cast<int>(fixtures.size()) - 1), [&fixtures](int i) {
        return Drawn{fixtures[static_cast<size_t>(i)], kFixture};
      });
    }
    const Kind kind = draw == 2 || draw == 3 ? kAdmissible : kRealistic;
    return rc::gen::map(
        genCamera(model, kind == kAdmissible ? Range::kAdmissible : Range::kRealistic),
        [kind](const Camera& camera) {
          return Drawn{camera, kind};
        });
  });
}

// --- Round trips ---

TEST_P(CameraSuite, PixelsInsideTheImageComeBack) {
  Worst worst("pixel -> ray -> pixel, px", kKinds);
  Worst unresolved("the same where rays and pixels do not resolve 1e-10 px, over what they resolve",
                   kKinds);
  long seen = 0, drawn = 0;
  holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const Kind kind = from.kind;
    for (const Vector2d& pixel :
         many(rc::gen::oneOf(genPixelInImage(camera), genPixelOnBorder(camera)))) {
      ++drawn;
      const auto ray = camera.unproject(pixel);
      if (!ray) continue;
      ++seen;
      const auto back = camera.project(*ray);
      if (!back) {
        // Only where the pixel is within rounding of the rim.
        if (camera.project(*camera.unproject(pulledIn(camera, pixel)))) continue;
        RC_FAIL("no way back: " + describe(camera, pixel));
      }
      const double error = (*back - pixel).norm();
      double allowed = kPixelRoundTrip;
      if (kind == kAdmissible || std::holds_alternative<Ocam>(camera.model())) {
        // Some show so small a piece of the sphere, or (OCam) fold it so, that neighbouring rays of
        // doubles are further apart, in pixels, than that; or have their principal point so far off
        // that neighbouring pixels are.
        const auto J = camera.jacobian(*ray);
        if (!J) continue;
        const double resolution = 8 * pixelUlp(camera, pixel) +
                                  singularValues(*J).largest * inverseResolution(camera, *ray);
        if (!(resolution <= kPixelRoundTrip)) {
          allowed = resolution;
          unresolved.see(error / allowed, kind);
        }
      }
      if (allowed == kPixelRoundTrip) worst.see(error, kind);
      if (!(error <= allowed)) RC_FAIL(describe(camera, pixel));
    }
  });
  EXPECT_GE(seen, drawn / 2);
  EXPECT_GE(worst.count() + unresolved.count(), seen * 99 / 100);
  EXPECT_GE(worst.count(), seen / 2);
}

TEST_P(CameraSuite, RaysComeBack) {
  Worst worst("ray -> pixel -> ray, in units of 8 ulp(px) / smallest singular value", kKinds);
  Worst worst_far("the same outside the image or in odd cameras, whose polynomials cancel and fold",
                  kKinds);
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const Kind kind = from.kind;
    for (const Vector3d& ray : many(genRayFor(camera))) {
      const auto pixel = camera.project(ray);
      if (!pixel) continue;
      const auto back = camera.unproject(*pixel);
      if (!back) continue;  // ValidOneWayImpliesValidBack looks at these.
      if (atBound(camera, ray)) continue;
      const auto [largest, smallest] = singularValues(*camera.jacobian(ray));
      // The decomposition knows the smallest one to rounding of the largest.
      if (!(smallest > kBand * largest)) continue;
      const double error = angleBetween(ray, *back);
      double allowed = kRayRoundTripUlps * pixelUlp(camera, *pixel) / smallest;
      const bool ordinary = kind != kAdmissible && camera.inImage(*pixel);
      if (!ordinary) {
        const double theta = fieldAngle(ray);
        const double ulps = kRayRoundTripUlps + cancellation(camera, theta) - 1;
        allowed =
            nearFold(ulps * pixelUlp(camera, *pixel) / smallest, camera.maxFieldAngle() - theta) +
            inverseResolution(camera, ray);
      }
      (ordinary ? worst : worst_far).see(error / allowed, kind);
      if (!(error <= allowed)) {
        std::ostringstream text;
        text << error << " > " << allowed << ": ";
        RC_FAIL(text.str() + describe(camera, ray));
      }
    }
  });
  EXPECT_GT(worst.count(), cases * ofDraws(5));
  EXPECT_GT(worst_far.count(), cases * ofDraws(5));
}

// --- Validity ---

TEST_P(CameraSuite, ValidOneWayImpliesValidBack) {
  long rays = 0, pixels = 0;
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    for (const Vector3d& ray : many(genRayFor(camera))) {
      const auto pixel = camera.project(ray);
      if (!pixel) continue;
      ++rays;
      // At a fold, the pixel is within rounding of the bound long before the ray is.
      if (!camera.unproject(*pixel) && !camera.unproject(pulledIn(camera, *pixel))) {
        // A pixel of the oddest cameras is too coarse to tell the ray from the bound.
        const auto J = camera.jacobian(ray);
        const double resolution =
            J ? 8 * pixelUlp(camera, *pixel) / singularValues(*J).smallest : 0.0;
        if (camera.maxFieldAngle() - fieldAngle(ray) <= resolution) continue;
        RC_FAIL(describe(camera, ray));
      }
    }
    for (const Vector2d& pixel : many(genPixelFor(camera))) {
      const auto ray = camera.unproject(pixel);
      if (!ray) continue;
      ++pixels;
      if (!camera.project(*ray)) {
        // Where the field angle itself folds (OCam), rays are within rounding of the bound long
        // before pixels are.
        if (!(fieldAngle(*ray) < camera.maxFieldAngle() * (1 - kBand))) continue;
        const auto inner = camera.unproject(pulledIn(camera, pixel));
        if (!inner || !camera.project(*inner)) RC_FAIL(describe(camera, pixel));
      }
    }
  });
  EXPECT_GT(rays, cases * ofDraws(10));
  EXPECT_GT(pixels, cases * ofDraws(10));
}

TEST_P(CameraSuite, RaysAreValidExactlyInsideTheDomain) {
  long inside = 0, outside = 0;
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const CameraModelVariant& model = camera.model();
    const auto limit = static_cast<long double>(camera.maxFieldAngleLimit());
    const long double bound = std::min(oracleMaxFieldAngle(model), limit);
    const double uncertainty = oracleBoundUncertainty(model);
    const auto band = static_cast<long double>(std::max(kBand, uncertainty));
    RC_ASSERT(std::abs(static_cast<double>(camera.maxFieldAngle() / bound - 1)) <= uncertainty);
    for (const Vector3d& ray : many(rc::gen::oneOf(genRayFor(camera), genRayNearBound(camera)))) {
      const long double theta = std::atan2(
          std::hypot(static_cast<long double>(ray.x()), static_cast<long double>(ray.y())),
          static_cast<long double>(ray.z()));
      const bool valid = camera.project(ray).has_value();
      if (theta > bound * (1 + band)) {
        ++outside;
        if (valid) RC_FAIL("valid outside the domain: " + describe(camera, ray));
      } else if (theta < bound * (1 - band)) {
        const auto p = oracleProject(model, ray.x(), ray.y(), ray.z());
        RC_ASSERT(p.has_value());
        const auto size = static_cast<double>(std::max(std::abs((*p)[0]), std::abs((*p)[1])));
        if (size > kMaxPixel * (1 + kBand)) {
          if (valid) RC_FAIL("valid beyond the largest pixel: " + describe(camera, ray));
        } else if (size < kMaxPixel * (1 - kBand)) {
          ++inside;
          if (!valid) RC_FAIL("not valid inside the domain: " + describe(camera, ray));
        }
      }
    }
  });
  EXPECT_GT(inside, cases * ofDraws(15));
  EXPECT_GT(outside, cases * ofDraws(2));
}

TEST_P(CameraSuite, PixelsAreValidExactlyInsideTheDomain) {
  long inside = 0, outside = 0;
  const long cases = holds(1, [&] {
    const Camera drawn = (*genDrawn(GetParam())).camera;
    // The limit of the field angle is a bound on rays; here it is the model's own bound that
    // counts.
    const Camera camera(drawn.model(), drawn.width(), drawn.height());
    const CameraModelVariant& model = camera.model();
    const Vector2d centre = principalPoint(camera);
    const Eigen::Matrix2d A = pixelFromPlane(camera), inverse = A.inverse();
    const double uncertainty = oracleBoundUncertainty(model);
    for (const Vector2d& pixel :
         many(rc::gen::oneOf(genPixelFor(camera), genPixelNearBound(camera)))) {
      const double size = pixel.cwiseAbs().maxCoeff();
      // Either answer is right where it changes within the band.
      const double band = std::max(kBand, uncertainty) + offsetRounding(camera, pixel);
      if (!(band < 1)) continue;
      const Vector2d offset = inverse * (pixel - centre);
      const Vector2d across(-offset.y(), offset.x());
      int having = 0;
      for (const Vector2d& step : {offset, across}) {
        for (const double side : {-band, band}) {
          const Vector2d near = A * (side * step);
          having += static_cast<int>(oracleHasRay(model,
                                                  static_cast<long double>(pixel.x()) + near.x(),
                                                  static_cast<long double>(pixel.y()) + near.y()));
        }
      }
      const bool valid = camera.unproject(pixel).has_value();
      if (having == 0 || size > kMaxPixel) {
        ++outside;
        if (valid) RC_FAIL("valid outside the domain: " + describe(camera, pixel));
      } else if (having == 4) {
        ++inside;
        if (!valid) RC_FAIL("not valid inside the domain: " + describe(camera, pixel));
      }
    }
  });
  EXPECT_GT(inside, cases * ofDraws(10));
  EXPECT_GT(outside, cases * ofDraws(16) / 64);
}

TEST_P(CameraSuite, ValidImpliesFiniteAndUnit) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> hostile{0.0,    -0.0,   kNan,   kInf,    -kInf, 1.0,   -1.0,    5e-324,
                                    1e-300, 1e-160, 1e-100, -1e-100, 1e100, 1e160, 1.7e308, 1e9,
                                    1e-9,   -1e9,   1e-17,  -1e-17,  1e-8,  640.0};
  Worst worst("| |ray| - 1 |, in ulp(1)", kKinds);
  long accepted = 0;
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const Kind kind = from.kind;
    const auto checkRay = [&](const Vector3d& ray) {
      const auto pixel = camera.project(ray);
      const auto J = camera.jacobian(ray);
      // A focal length over this is beyond doubles.
      const bool infinite = atPole(camera, ray, 1e-300);
      if (pixel.has_value() != J.has_value() && !(pixel && infinite)) {
        RC_FAIL("jacobian: " + describe(camera, ray));
      }
      if (!pixel) return;
      ++accepted;
      if (!pixel->allFinite() || (J && !J->allFinite()) || !ray.allFinite()) {
        RC_FAIL(describe(camera, ray));
      }
    };
    const auto checkPixel = [&](const Vector2d& pixel) {
      const auto ray = camera.unproject(pixel);
      if (!ray) return;
      ++accepted;
      const double off = std::abs(ray->norm() - 1);
      worst.see(off / std::numeric_limits<double>::epsilon(), kind);
      if (!pixel.allFinite() || !(off <= 4 * std::numeric_limits<double>::epsilon())) {
        RC_FAIL(describe(camera, pixel));
      }
    };
    const auto special = draw(3 * kMany, rc::gen::elementOf(hostile));
    for (size_t i = 0; i < special.size(); i += 3) {
      checkRay({special[i], special[i + 1], special[i + 2]});
      checkPixel({special[i], special[i + 1]});
    }
    for (const Vector3d& ray : many(genRayFor(camera))) checkRay(ray);
    for (const Vector2d& pixel : many(genPixelFor(camera))) checkPixel(pixel);
  });
  EXPECT_GT(accepted, cases * ofDraws(25));
  const Camera camera = exampleCamera(GetParam());
  for (const double bad : {kNan, kInf, -kInf}) {
    EXPECT_FALSE(camera.project({bad, 0, 1}));
    EXPECT_FALSE(camera.project({0, bad, 1}));
    EXPECT_FALSE(camera.project({0, 0, bad}));
    EXPECT_FALSE(camera.unproject({bad, 0}));
    EXPECT_FALSE(camera.unproject({0, bad}));
  }
  EXPECT_FALSE(camera.project({0, 0, 0}));
  EXPECT_FALSE(camera.project({0, 0, -0.0}));
}

TEST_P(CameraSuite, TheLengthOfARayDoesNotMatter) {
  Worst worst("difference, in units of 8 ulp(px) + 2 * largest singular value * ray resolution",
              kKinds);
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const Kind kind = from.kind;
    const double scale = *genLogReal(1e-95, 1e95);
    for (const Vector3d& ray : many(genRayFor(camera))) {
      const auto a = camera.project(ray), b = camera.project(scale * ray);
      if (a.has_value() != b.has_value()) {
        const double off = std::abs(fieldAngle(ray) / camera.maxFieldAngle() - 1);
        const double size = (a ? *a : *b).cwiseAbs().maxCoeff();
        if (!(off <= kBand) && !(size > kMaxPixel * (1 - 1e-6))) RC_FAIL(describe(camera, ray));
      }
      if (!a || !b || atBound(camera, ray)) continue;
      const double largest = singularValues(*camera.jacobian(ray)).largest;
      // Scaling rounds the ray itself, too.
      const double allowed = 8 * pixelUlp(camera, *a) + 2 * largest * kRayResolution;
      worst.see((*a - *b).norm() / allowed, kind);
      if (!((*a - *b).norm() <= allowed)) RC_FAIL(describe(camera, ray));
    }
  });
  EXPECT_GT(worst.count(), cases * ofDraws(10));
}

// --- Right ---

TEST_P(CameraSuite, AgreesWithTheTextbookInLongDouble) {
  Worst worst("difference, in units of 8 ulp(px) + largest singular value * ray resolution",
              kKinds);
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const Kind kind = from.kind;
    const CameraModelVariant& model = camera.model();
    for (const Vector3d& ray : many(genRayFor(camera))) {
      const auto pixel = camera.project(ray);
      const auto exact = oracleProject(model, ray.x(), ray.y(), ray.z());
      if (!pixel || !exact || atBound(camera, ray)) continue;
      const double error = std::hypot(static_cast<double>(pixel->x() - (*exact)[0]),
                                      static_cast<double>(pixel->y() - (*exact)[1]));
      const double largest = singularValues(*camera.jacobian(ray)).largest;
      const double allowed = 8 * pixelUlp(camera, *pixel) + largest * kRayResolution;
      worst.see(error / allowed, kind);
      if (!(error <= allowed)) RC_FAIL(describe(camera, ray));
    }
  });
  EXPECT_GT(worst.count(), cases * ofDraws(10));
}

TEST_P(CameraSuite, TheJacobianIsTheDerivative) {
  Worst worst("against automatic differentiation, in what is allowed", kKinds);
  Worst euler("|J ray| / |J|, in ulp(1)", kKinds);
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const Kind kind = from.kind;
    const auto bound = static_cast<double>(oracleMaxFieldAngle(camera.model()));
    for (const Vector3d& ray : many(genRayFor(camera))) {
      const auto J = camera.jacobian(ray);
      if (!J) continue;
      // Projection does not depend on the length of a ray, so it is homogeneous of degree 0.
      const double along = (*J * ray).norm() / J->norm();
      euler.see(along / std::numeric_limits<double>::epsilon(), kind);
      if (!(along <= 8 * std::numeric_limits<double>::epsilon())) {
        RC_FAIL("Euler: " + describe(camera, ray));
      }
      // On the axis the formulas are 0 / 0; TheImageIsContinuousAcrossTheAxis looks there.
      if (ray.x() == 0 && ray.y() == 0) continue;
      const OracleJacobian exact = oracleJacobian(camera.model(), ray.x(), ray.y(), ray.z());
      const auto error =
          static_cast<double>((J->cast<long double>() - exact).norm() / exact.norm());
      // A ray of doubles is as far from its neighbours as this share of its way to the bound.
      const double theta = fieldAngle(ray);
      const double room = std::abs(bound - theta) / theta;
      worst.see(error / (kJacobian / std::min(1.0, room)), kind);
      if (!(error <= kJacobian / std::min(1.0, room))) RC_FAIL(describe(camera, ray));
    }
  });
  EXPECT_GT(euler.count(), cases * ofDraws(10));
  EXPECT_GT(worst.count(), cases * ofDraws(5));
}

TEST_P(CameraSuite, TheImageIsContinuousAcrossTheAxis) {
  Worst worst("deviation from J * offset, in units of 4 ulp(px)", kKinds);
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const Kind kind = from.kind;
    const Vector2d centre = principalPoint(camera);
    const auto axis = camera.project({0, 0, 1});
    RC_ASSERT(axis.has_value());
    RC_ASSERT(*axis == centre);
    const auto J = camera.jacobian({0, 0, 1});
    RC_ASSERT(J.has_value());
    const double bend = oracleBendAtAxis(camera.model());
    for (const Vector3d& ray : many(genRayAt(
             rc::gen::map(genReal(12, 320), [](double k) { return std::pow(10.0, -k); })))) {
      // Beyond 1e-12 rad the second order shows in the tolerance for some admissible camera.
      const double angle = fieldAngle(ray);
      const auto pixel = camera.project(ray);
      RC_ASSERT(pixel.has_value());
      const double off = (*pixel - centre - *J * Vector3d(ray.x(), ray.y(), 0)).norm();
      const double second = 1e-15 + bend * angle;
      const double allowed = 4 * pixelUlp(camera, *pixel) + second * J->norm() * angle;
      worst.see(off / allowed, kind);
      if (!(off <= allowed)) RC_FAIL(describe(camera, ray));

      const Vector2d near = centre + *J * Vector3d(ray.x(), ray.y(), 0);
      const auto back = camera.unproject(near);
      RC_ASSERT(back.has_value());
      const double smallest = singularValues(*J).smallest;
      if (!((*back - Vector3d(ray.x(), ray.y(), 1)).norm() <=
            8 * pixelUlp(camera, near) / smallest + second * angle)) {
        RC_FAIL("unproject: " + describe(camera, ray));
      }
    }
  });
  EXPECT_GT(worst.count(), cases * ofDraws(25));
}

// --- Batches, files, arcs ---

TEST_P(CameraSuite, BatchesEqualSinglePoints) {
  long compared = 0;
  const long cases = holds(1, [&] {
    const Drawn from = *genDrawn(GetParam());
    const Camera& camera = from.camera;
    const size_t n = *rc::gen::elementOf(std::vector<size_t>{0, 1, 2, 3, 4, 5, 7, 8, 9, 31, 64});
    const auto rays = draw(n, genRayFor(camera));
    const auto pixels = draw(n, genPixelFor(camera));
    std::vector<double> x(n), y(n), z(n), u(n), v(n);
    std::vector<uint8_t> valid(n, 7);
    for (size_t i = 0; i < n; ++i) {
      x[i] = rays[i].x();
      y[i] = rays[i].y();
      z[i] = rays[i].z();
    }
    projectAll(camera, x, y, z, u, v, valid);
    for (size_t i = 0; i < n; ++i) {
      ++compared;
      const auto pixel = camera.project(rays[i]);
      RC_ASSERT(valid[i] == (pixel ? 1 : 0));
      if (pixel) RC_ASSERT(*pixel == Vector2d(u[i], v[i]));
    }
    for (size_t i = 0; i < n; ++i) {
      u[i] = pixels[i].x();
      v[i] = pixels[i].y();
    }
    unprojectAll(camera, u, v, x, y, z, valid);
    for (size_t i = 0; i < n; ++i) {
      const auto ray = camera.unproject(pixels[i]);
      RC_ASSERT(valid[i] == (ray ? 1 : 0));
      if (ray) RC_ASSERT(*ray == Vector3d(x[i], y[i], z[i]));
    }
  });
  EXPECT_GT(compared, cases / 2);
}

TEST_P(CameraSuite, KalibrFilesGiveBackTheSameCamera) {
  const std::string path = ::testing::TempDir() + "dlsd_camera_suite_" + std::string(GetParam()) +
                           std::to_string(::getpid()) + ".yaml";
  holds(1, [&] {
    const Camera a = (*genDrawn(GetParam())).camera;
    const Camera b = *genAnyCamera(Range::kAdmissible);
    saveCameras(path, {{"cam0", a}, {"cam1", b}});
    const auto read = loadCameras(path);
    RC_ASSERT(read.size() == 2U);
    RC_ASSERT(read[0].camera == a);
    RC_ASSERT(read[1].camera == b);
    RC_ASSERT(loadCamera(path + ":cam1") == b);
  });
  std::remove(path.c_str());
}

/// Any arc, a short one across the view, or one past a point near the image border.
Arc drawArc(const Camera& camera) {
  for (;;) {
    Vector3d from = *genRayFor(camera), to = *genRayFor(camera);
    const int kind = *genInt(0, 3);
    if (kind < 2) to = (from + 0.7 * to).normalized();
    if (kind == 3) {
      const Vector2d border = *genPixelOnBorder(camera), off{*genReal(-9, 9), *genReal(-9, 9)};
      const Vector2d near = border + off;
      const double azimuth = *genReal(0, 2 * M_PI), length = *genReal(5, 300);
      const Vector2d step = length * Vector2d(std::cos(azimuth), std::sin(azimuth));
      from = camera.unproject(near - step).value_or(from);
      to = camera.unproject(near + step).value_or(to);
    }
    if (const auto arc = arcBetween(from, to)) return *arc;
  }
}

double distanceToSegment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * (b - a)).norm();
}

TEST_P(CameraSuite, TheImageOfAPlaneStaysOnItsArc) {
  const bool panorama = GetParam() == Equirectangular::kName;
  Worst worst(
      "angle to the plane, in units of 8 ulp(px) / smallest singular value + ray resolution");
  Worst chord("distance of the curve to its chords, in units of 0.01 px");
  Worst across("angle of the chords to the plane, in units of 0.01 px / smallest singular value");
  long samples = 0;
  const long cases = holds(1, [&] {
    const Camera camera = *genCamera(GetParam(), Range::kRealistic);
    for (int n = 0; n < 4; ++n) {
      const Arc arc = drawArc(camera);
      RC_ASSERT(std::abs(arc.normal.norm() - 1) <= 4 * std::numeric_limits<double>::epsilon());
      for (const ImageSpan& span : imageSpans(camera, arc)) {
        const auto points = imageCurve(camera, arc, span.t0, span.t1);
        for (size_t k = 0; k < points.size(); ++k) {
          const auto ray = camera.unproject(points[k]);
          if (!ray) continue;  // Within rounding of the rim.
          const auto J = camera.jacobian(*ray);
          if (!J) continue;
          const double smallest = singularValues(*J).smallest;
          const double allowed = 8 * pixelUlp(camera, points[k]) / smallest + 2 * kRayResolution;
          const double off = std::abs(arc.angleToPlane(*ray));
          worst.see(off / allowed);
          if (!(off <= allowed)) RC_FAIL(describe(camera, points[k]));
        }
        RC_ASSERT(points.size() >= 2U);
        // The drawn line of a panorama is nowhere further from the curve than was asked for:
        // nothing is drawn across the seam.
        for (size_t k = 1; panorama && k < points.size(); ++k) {
          for (const double s : {0.25, 0.5, 0.75}) {
            const Vector2d drawn = points[k - 1] + s * (points[k] - points[k - 1]);
            const auto ray = camera.unproject(drawn);
            const auto J = ray ? camera.jacobian(*ray) : std::nullopt;
            if (!J) continue;
            // Moved by 0.01 px, a pixel's ray turns by no more than this.
            const double allowed = 0.0101 / singularValues(*J).smallest;
            const double off = std::abs(arc.angleToPlane(*ray));
            across.see(off / allowed);
            if (!(off <= allowed)) RC_FAIL("drawn across: " + describe(camera, drawn));
          }
        }
        // Densely sampled, the curve is nowhere further from its chords than was asked for.
        constexpr int kSamples = 300;
        for (int i = 0; i <= kSamples; ++i) {
          const Vector3d ray = arc.at(span.t0 + (span.t1 - span.t0) * i / kSamples);
          const auto p = camera.project(ray);
          if (!p || atSeam(camera, ray)) continue;
          double nearest = std::numeric_limits<double>::infinity();
          for (size_t k = 1; k < points.size(); ++k) {
            nearest = std::min(nearest, distanceToSegment(*p, points[k - 1], points[k]));
          }
          ++samples;
          chord.see(nearest / 0.01);
          if (!(nearest <= 0.01)) RC_FAIL("chord: " + describe(camera, *p));
        }
      }
    }
  });
  EXPECT_GT(worst.count(), cases * 10);
  EXPECT_GT(samples, cases * 100);
}

TEST_P(CameraSuite, SpansAreThoseOfADenseSampling) {
  const bool panorama = GetParam() == Equirectangular::kName;
  long spans_seen = 0, with_gap = 0, rims = 0, seams = 0;
  const long cases = holds(1, [&] {
    const Camera camera = *genCamera(GetParam(), Range::kRealistic);
    for (int n = 0; n < 6; ++n) {
      const Arc arc = drawArc(camera);
      const auto spans = imageSpans(camera, arc);
      spans_seen += static_cast<long>(spans.size());
      with_gap += static_cast<long>(spans.size() > 1);
      double previous = -1;
      for (const ImageSpan& span : spans) {
        // The pieces on both sides of a seam share its place.
        RC_ASSERT(span.t0 > previous || (span.t0 == previous && span.end0 == ImageEnd::kSeam));
        RC_ASSERT(span.t1 >= span.t0);
        RC_ASSERT((span.end0 == ImageEnd::kArcEnd) == (span.t0 == 0));
        RC_ASSERT((span.end1 == ImageEnd::kArcEnd) == (span.t1 == 1));
        rims += static_cast<long>(span.end0 == ImageEnd::kRim) +
                static_cast<long>(span.end1 == ImageEnd::kRim);
        seams += static_cast<long>(span.end0 == ImageEnd::kSeam) +
                 static_cast<long>(span.end1 == ImageEnd::kSeam);
        previous = span.t1;
      }
      const auto inSpan = [&](double t) {
        return std::any_of(spans.begin(), spans.end(), [&](const ImageSpan& s) {
          return t >= s.t0 - 1e-12 && t <= s.t1 + 1e-12;
        });
      };
      // Arcs along the border are inside and outside by rounding: 1e-9 px to either side decide
      // nothing, nor does the band at the bound of the domain.
      enum class Seen { kInside, kOutside, kBorderline };
      const auto seenAt = [&](double t) {
        const Vector3d ray = arc.at(t);
        const auto pixel = camera.project(ray);
        if (std::abs(fieldAngle(ray) / camera.maxFieldAngle() - 1) <= kBand) {
          return Seen::kBorderline;
        }
        if (!pixel) return Seen::kOutside;
        const double inner = std::min({pixel->x() + 0.5,
                                       camera.width() - 0.5 - pixel->x(),
                                       pixel->y() + 0.5,
                                       camera.height() - 0.5 - pixel->y()});
        return inner > 1e-9 ? Seen::kInside : inner < -1e-9 ? Seen::kOutside : Seen::kBorderline;
      };
      // Steps of 0.02 degrees; a run of wrong answers longer than 0.1 degrees is a missed piece or
      // gap.
      const int count = static_cast<int>(std::ceil(arc.angle() / (0.02 * M_PI / 180))) + 1;
      int wrong = 0;
      for (int i = 0; i <= count; ++i) {
        const double t = static_cast<double>(i) / count;
        wrong = seenAt(t) == (inSpan(t) ? Seen::kOutside : Seen::kInside) ? wrong + 1 : 0;
        if (wrong > 6) {
          std::ostringstream text;
          text << std::setprecision(17) << camera << " from " << arc.from.transpose() << " to "
               << arc.to.transpose() << " at " << t;
          RC_FAIL(text.str());
        }
      }
      // Ends are where they are said to be.
      for (const ImageSpan& span : spans) {
        const double step = 1e-12 + 4e-16 / arc.angle();
        for (const auto& [end, t, beyond] : {std::tuple(span.end0, span.t0, span.t0 - step),
                                             std::tuple(span.end1, span.t1, span.t1 + step)}) {
          const Vector3d ray = arc.at(t);
          if (end == ImageEnd::kSeam) {
            // A border within 1e-9 rad of the seam counts as it.
            RC_ASSERT(panorama);
            RC_ASSERT(atSeam(camera, ray) || (ray.z() < 0 && std::abs(ray.x()) <= 1.1e-9));
            continue;
          }
          if (atSeam(camera, ray)) continue;
          // Of a panorama, Arc::at differs from where the cut was sought by rounding.
          const bool inside =
              panorama ? seenAt(t) != Seen::kOutside : camera.inImage(camera.project(ray).value());
          const bool ended = end == ImageEnd::kArcEnd || seenAt(beyond) != Seen::kInside;
          if (!inside || !ended) {
            std::ostringstream text;
            text << std::setprecision(17) << (inside ? "goes on: " : "ends outside: ") << camera
                 << " from " << arc.from.transpose() << " to " << arc.to.transpose() << " normal "
                 << arc.normal.transpose() << " at " << t << ", end of kind " << int(end);
            RC_FAIL(text.str());
          }
        }
      }
    }
  });
  EXPECT_GT(spans_seen, cases * 2);
  EXPECT_GE(seams, panorama ? cases / 4 : 0);
  std::cout << "    spans " << spans_seen << ", arcs with a gap " << with_gap
            << ", ends at the rim " << rims << ", at a seam " << seams << "\n";
}

TEST_P(CameraSuite, TheDocumentedParametersAreThose) {
  const std::string docs = readFile(std::string(DLSD_SOURCE_DIR) + "/docs/cameras.md");
  for (const ParamSpec& spec : paramSpecsOf(GetParam())) {
    std::ostringstream row;
    row << "| " << GetParam() << " | " << spec.name << " | " << spec.unit << " | " << spec.min
        << " ... " << spec.max << " | " << spec.realistic_min << " ... " << spec.realistic_max
        << " |";
    EXPECT_NE(docs.find(row.str()), std::string::npos) << "docs/cameras.md lacks the row\n"
                                                       << row.str();
  }
}

// --- Identities ---

/// Two cameras that should be the same one, over all rays and pixels.
void expectSameImages(const std::function<std::pair<Camera, Camera>()>& draw_pair) {
  Worst worst("difference, in units of 1e-9 px");
  long pixels_seen = 0;
  const long cases = holds(1, [&] {
    const auto [a, b] = draw_pair();
    for (const Vector3d& ray : many(genRayFor(a))) {
      if (atBound(a, ray)) continue;
      const auto pa = a.project(ray), pb = b.project(ray);
      if (pa && pa->cwiseAbs().maxCoeff() > 1e4) continue;
      if (pa.has_value() != pb.has_value()) RC_FAIL(describe(a, ray) + "\n" + describe(b, ray));
      if (!pa) continue;
      const double error = (*pa - *pb).norm();
      worst.see(error / 1e-9);
      if (!(error <= 1e-9)) RC_FAIL(describe(a, ray) + "\n" + describe(b, ray));
    }
    for (const Vector2d& pixel : many(genPixelInImage(a))) {
      const auto ra = a.unproject(pixel), rb = b.unproject(pixel);
      if (ra.has_value() != rb.has_value()) {
        const auto inner = b.unproject(pulledIn(b, pixel));
        if (ra || !inner || !atBound(b, *inner)) RC_FAIL(describe(a, pixel));
      }
      if (!ra || !rb || atBound(a, *ra)) continue;
      ++pixels_seen;
      const auto J = a.jacobian(*ra);
      if (!J) continue;
      const double error = (*ra - *rb).norm() * singularValues(*J).smallest;
      if (!(error <= 1e-9)) RC_FAIL(describe(a, pixel));
    }
  });
  EXPECT_GT(worst.count(), cases * ofDraws(10));
  EXPECT_GT(pixels_seen, cases * ofDraws(10));
}

Camera sameSize(const Camera& camera, std::string_view model, std::vector<double> params) {
  return makeCamera(model, params, camera.width(), camera.height(), camera.maxFieldAngleLimit());
}

TEST(Identities, PinholeRadtanWithoutDistortionIsThePinhole) {
  expectSameImages([] {
    const Camera a = *genCamera<Pinhole>(Range::kRealistic);
    std::vector<double> p = a.params();
    p.resize(9, 0);
    return std::pair(a, sameSize(a, "pinhole_radtan", p));
  });
}

TEST(Identities, OmniRadtanWithoutDistortionIsTheUnifiedModel) {
  expectSameImages([] {
    const Camera a = *genCamera<UnifiedOmni>(Range::kRealistic);
    std::vector<double> p = a.params();
    p.resize(10, 0);
    return std::pair(a, sameSize(a, "omni_radtan", p));
  });
}

TEST(Identities, OmniRadtanWithXiZeroIsPinholeRadtan) {
  expectSameImages([] {
    const Camera a = *genCamera<PinholeRadtan>(Range::kRealistic);
    std::vector<double> p = a.params();
    p[8] = 0;
    std::vector<double> q = p;
    q.insert(q.begin(), 0);
    q[9] = 0;
    return std::pair(sameSize(a, "pinhole_radtan", p), sameSize(a, "omni_radtan", q));
  });
}

TEST(Identities, OddThetaPolynomialsAreKannalaBrandt) {
  expectSameImages([] {
    const Camera drawn = *genCamera<KannalaBrandt>(Range::kRealistic);
    std::vector<double> p = drawn.params();
    // Equidistant, 1 in 4.
    if (*genInt(0, 3) == 0) p[4] = 0;
    p[5] = p[6] = p[7] = 0;
    return std::pair(
        sameSize(drawn, "kannala_brandt", p),
        sameSize(drawn, "theta_polynomial", {p[0], 0, p[0] * p[4], 0, p[1] / p[0], p[2], p[3]}));
  });
}

TEST(Identities, AParabolicMirrorIsAnOCamOfDegreeTwo) {
  expectSameImages([] {
    const Camera drawn = *genCamera<UnifiedOmni>(Range::kRealistic);
    std::vector<double> p = drawn.params();
    p[0] = 1;
    p[2] = p[1];
    // 2 f tan(theta / 2) = rho: tan(theta) = rho / (f - rho^2 / (4 f)), fx = 2 f.
    std::vector<double> q(14, 0);
    q[0] = -p[1] / 2;
    q[2] = 1 / (2 * p[1]);
    q[9] = p[3];
    q[10] = p[4];
    q[11] = 1;
    return std::pair(sameSize(drawn, "omni", p), sameSize(drawn, "ocam", q));
  });
}

// --- OpenCV ---

/// Rays of an image's pixels within an angle of the axis, as OpenCV points.
#if defined(DLSD_HAVE_CALIB3D) || defined(DLSD_HAVE_CCALIB)
template <class M>
void agreesWithOpenCv(
    const std::function<std::vector<cv::Point2d>(const M&, const std::vector<cv::Point3d>&)>&
        projectPoints,
    double max_angle) {
  Worst worst("difference to OpenCV, in units of 1e-9 px");
  const long cases = holds(1, [&] {
    const Camera camera = *genCamera<M>(Range::kRealistic);
    std::vector<cv::Point3d> points;
    std::vector<Vector2d> ours;
    for (const Vector3d& ray : many(genRayFor(camera))) {
      if (!(fieldAngle(ray) < max_angle)) continue;
      const auto pixel = camera.project(ray);
      if (!pixel || pixel->cwiseAbs().maxCoeff() > 1e4) continue;
      const double depth = 0.5 + static_cast<double>(points.size());
      points.emplace_back(depth * ray.x(), depth * ray.y(), depth * ray.z());
      ours.push_back(*pixel);
    }
    if (points.empty()) return;
    const auto theirs = projectPoints(std::get<M>(camera.model()), points);
    RC_ASSERT(theirs.size() == ours.size());
    for (size_t i = 0; i < ours.size(); ++i) {
      const double error = std::hypot(theirs[i].x - ours[i].x(), theirs[i].y - ours[i].y());
      worst.see(error / 1e-9);
      if (!(error <= 1e-9)) RC_FAIL(describe(camera, Vector2d(ours[i])));
    }
  });
  EXPECT_GT(worst.count(), cases * ofDraws(10));
}

template <class M>
cv::Matx33d cameraMatrix(const M& m) {
  return {m.fx, 0, m.cx, 0, m.fy, m.cy, 0, 0, 1};
}
#endif

TEST(OpenCv, ProjectPointsIsOurPinhole) {
#ifdef DLSD_HAVE_CALIB3D
  agreesWithOpenCv<Pinhole>(
      [](const Pinhole& m, const std::vector<cv::Point3d>& points) {
        std::vector<cv::Point2d> pixels;
        cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), cameraMatrix(m), cv::noArray(), pixels);
        return pixels;
      },
      M_PI / 2);
#else
  GTEST_SKIP() << "built without OpenCV's calib3d";
#endif
}

TEST(OpenCv, ProjectPointsWithFiveCoefficientsIsOurPinholeRadtan) {
#ifdef DLSD_HAVE_CALIB3D
  agreesWithOpenCv<PinholeRadtan>(
      [](const PinholeRadtan& m, const std::vector<cv::Point3d>& points) {
        std::vector<cv::Point2d> pixels;
        const Radtan& d = m.radtan;
        cv::projectPoints(points,
                          cv::Vec3d(),
                          cv::Vec3d(),
                          cameraMatrix(m),
                          cv::Vec<double, 5>(d.k1, d.k2, d.p1, d.p2, d.k3),
                          pixels);
        return pixels;
      },
      M_PI / 2);
#else
  GTEST_SKIP() << "built without OpenCV's calib3d";
#endif
}

TEST(OpenCv, FisheyeIsOurKannalaBrandtBelow90Degrees) {
#ifdef DLSD_HAVE_CALIB3D
  // OpenCV divides by z first, and so loses digits towards 90 degrees and is wrong beyond.
  agreesWithOpenCv<KannalaBrandt>(
      [](const KannalaBrandt& m, const std::vector<cv::Point3d>& points) {
        std::vector<cv::Point2d> pixels;
        cv::fisheye::projectPoints(
            points, pixels, cv::Affine3d(), cameraMatrix(m), cv::Vec4d(m.k1, m.k2, m.k3, m.k4));
        return pixels;
      },
      89.9 * M_PI / 180);
#else
  GTEST_SKIP() << "built without OpenCV's calib3d";
#endif
}

TEST(OpenCv, OmnidirIsOurUnifiedOmni) {
#ifdef DLSD_HAVE_CCALIB
  agreesWithOpenCv<UnifiedOmni>(
      [](const UnifiedOmni& m, const std::vector<cv::Point3d>& points) {
        std::vector<cv::Point2d> pixels;
        cv::omnidir::projectPoints(
            points, pixels, cv::Vec3d(), cv::Vec3d(), cameraMatrix(m), m.xi, cv::Vec4d());
        return pixels;
      },
      M_PI);
#else
  GTEST_SKIP() << "built without OpenCV's ccalib";
#endif
}

TEST(OpenCv, OmnidirWithDistortionAndSkewIsOurOmniRadtan) {
#ifdef DLSD_HAVE_CCALIB
  agreesWithOpenCv<OmniRadtan>(
      [](const OmniRadtan& m, const std::vector<cv::Point3d>& points) {
        std::vector<cv::Point2d> pixels;
        cv::Matx33d K = cameraMatrix(m);
        K(0, 1) = m.skew;
        const Radtan& d = m.radtan;
        cv::omnidir::projectPoints(
            points, pixels, cv::Vec3d(), cv::Vec3d(), K, m.xi, cv::Vec4d(d.k1, d.k2, d.p1, d.p2));
        return pixels;
      },
      M_PI);
#else
  GTEST_SKIP() << "built without OpenCV's ccalib";
#endif
}

}  // namespace
}  // namespace dlsd
