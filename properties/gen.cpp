#include "properties/gen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <ostream>
#include <utility>

namespace dlsd {
namespace {

constexpr uint64_t kSteps = uint64_t{1} << 52U;

/// Index in [0, steps]; 1 in 8 at or next to an end. Shrinks towards 0.
rc::Gen<uint64_t> genIndex(uint64_t steps) {
  return [steps](const rc::Random& random, int) {
    rc::Random source(random);
    const uint64_t choice = source.next(), draw = source.next();
    uint64_t index = 0;
    if (choice % 8 == 0) {
      const std::array<uint64_t, 4> special{
          0, std::min<uint64_t>(1, steps), steps - std::min<uint64_t>(1, steps), steps};
      index = special[draw % special.size()];
    } else {
      index = draw % (steps + 1);
    }
    return rc::shrinkable::shrinkRecur(
        index, [](uint64_t i) { return rc::shrink::towards<uint64_t>(i, 0); });
  };
}

double latticePoint(double lo, double hi, uint64_t index) {
  if (index == kSteps) return hi;
  const double t = static_cast<double>(index) / static_cast<double>(kSteps);
  return std::clamp(lo + (hi - lo) * t, lo, hi);
}

bool isCentre(const ParamSpec& spec) {
  return spec.name == "cx" || spec.name == "cy";
}

/// n, if a parameter's unit is px^n: what a scaling of the image does to it. Read from its unit.
int powerOfPixels(const ParamSpec& spec) {
  if (spec.unit.starts_with("px")) return 1;
  if (spec.unit == "1/px") return -1;
  if (spec.unit.starts_with("1/px^")) return -(spec.unit.back() - '0');
  return 0;
}

/// The parameter that sets the scale of the image, px per rad on the axis up to a factor: the first
/// in px, centre apart, that is never zero.
size_t scaleIndex(std::span<const ParamSpec> specs) {
  const auto found = std::find_if(specs.begin(), specs.end(), [](const ParamSpec& spec) {
    return powerOfPixels(spec) == 1 && !isCentre(spec) &&
           spec.realistic_min * spec.realistic_max > 0;
  });
  return static_cast<size_t>(found - specs.begin());
}

size_t indexOf(std::span<const ParamSpec> specs, std::string_view name) {
  const auto found = std::find_if(
      specs.begin(), specs.end(), [&](const ParamSpec& spec) { return spec.name == name; });
  return static_cast<size_t>(found - specs.begin());
}

Eigen::Vector3d rayAt(double angle, double azimuth) {
  // Exact on the axes and at the poles, where the cosine of M_PI / 2 is not zero.
  const double quarter = azimuth / (M_PI / 2);
  double c = std::cos(azimuth), s = std::sin(azimuth);
  if (quarter == std::floor(quarter)) {
    c = std::round(c);
    s = std::round(s);
  }
  return {std::sin(angle) * c, std::sin(angle) * s, std::cos(angle)};
}

rc::Gen<double> genAzimuth() {
  return rc::gen::mapcat(genInt(0, 7), [](int kind) {
    return kind == 0 ? rc::gen::map(genInt(0, 3), [](int i) { return i * (M_PI / 2); })
                     : genReal(0, 2 * M_PI);
  });
}

/// 1, or 1 +- 10^-k. Shrinks to 1 - 10^-1.
rc::Gen<double> genNearOne() {
  return rc::gen::map(rc::gen::pair(genInt(0, 8), genReal(1, 15)), [](std::pair<int, double> draw) {
    const double offset = std::pow(10.0, -draw.second);
    return draw.first == 8 ? 1.0 : draw.first < 4 ? 1 - offset : 1 + offset;
  });
}

/// What a realistic camera is made of besides its model's own parameters.
struct Lens {
  int width, height;
  double corner_angle;      ///< Of the half diagonal, as a share of what the domain allows.
  double overshoot;         ///< > 1: the corners of the image look past corner_angle.
  double aspect;            ///< fy / fx
  double shift_x, shift_y;  ///< Of the principal point, in units of the image size.
  int limited;
  double limit;
};

/// A panorama of the whole sphere or, 1 in 3, of a little more or less.
Camera makePanorama(const Lens& lens) {
  const bool whole = lens.corner_angle < 0.75;
  const int width = std::max(400, lens.width), height = width / 2;
  const double share = whole ? 1 : lens.overshoot;
  const std::array<double, 4> params{width / (2 * M_PI * share),
                                     height / (M_PI * share),
                                     width * (0.5 + (whole ? 0 : lens.shift_x)) - 0.5,
                                     height * (0.5 + (whole ? 0 : lens.shift_y)) - 0.5};
  return makeCamera(
      Equirectangular::kName, params, width, height, lens.limited == 3 ? lens.limit : M_PI);
}

Camera makeRealistic(std::string_view model_name, std::vector<double> params, const Lens& lens) {
  if (model_name == Equirectangular::kName && lens.corner_angle > 0.25) return makePanorama(lens);
  const std::span<const ParamSpec> specs = paramSpecsOf(model_name);
  const auto set = [&](std::string_view name, double value) {
    const size_t i = indexOf(specs, name);
    params[i] = std::clamp(value, specs[i].realistic_min, specs[i].realistic_max);
  };
  const size_t fy = indexOf(specs, "fy"), scale = scaleIndex(specs);
  params[indexOf(specs, "cx")] = params[indexOf(specs, "cy")] = 0;
  // The shape of the lens, as the table gives it for a camera of usual size.
  const ParamSpec& size = specs[scale];
  params[scale] =
      std::copysign(std::sqrt(size.realistic_min * size.realistic_max), size.realistic_min);
  if (fy < specs.size()) params[fy] = params[scale];
  // Distortions that fold too early are weakened.
  Camera shape = makeCamera(model_name, params, 1, 1);
  while (shape.maxFieldAngle() < 0.7) {
    for (size_t i = 0; i < params.size(); ++i) {
      if (specs[i].realistic_min * specs[i].realistic_max <= 0) params[i] /= 2;
    }
    shape = makeCamera(model_name, params, 1, 1);
  }
  // Nobody builds a lens that stretches its rim 200 times as much as its centre (a pinhole's is 162
  // at 0.95 * 90 degrees).
  const auto stretch = [&](double angle) {
    const auto J = shape.jacobian({std::sin(angle), 0, std::cos(angle)});
    return J ? J->norm() : std::numeric_limits<double>::infinity();
  };
  double most = std::min(0.95 * shape.maxFieldAngle(), 2.0);
  while (stretch(most) > 200 * stretch(0)) most = 0.3 + 0.95 * (most - 0.3);
  const double angle = 0.3 + (most - 0.3) * lens.corner_angle;
  const double radius = shape.project({std::sin(angle), 0, std::cos(angle)}).value().x();
  const double half_diagonal = std::hypot(lens.width, lens.height) / 2;
  const double wanted = params[scale] * half_diagonal / (radius * lens.overshoot);
  const double factor = std::clamp(wanted, size.realistic_min, size.realistic_max) / params[scale];
  for (size_t i = 0; i < params.size(); ++i) {
    params[i] = std::clamp(
        params[i] * std::pow(factor, powerOfPixels(specs[i])), specs[i].min, specs[i].max);
  }
  if (fy < specs.size()) set("fy", params[fy] * lens.aspect);
  set("cx", lens.width * (0.5 + lens.shift_x) - 0.5);
  set("cy", lens.height * (0.5 + lens.shift_y) - 0.5);
  return makeCamera(
      model_name, params, lens.width, lens.height, lens.limited == 3 ? lens.limit : M_PI);
}

/// One generator for a list of parameters, each with its own range.
rc::Gen<std::vector<double>> genParams(std::span<const ParamSpec> specs, Range range) {
  std::vector<rc::Gen<double>> gens;
  for (const ParamSpec& spec : specs) gens.push_back(genParam(spec, range));
  return rc::gen::exec([gens] {
    std::vector<double> values;
    for (const auto& gen : gens) values.push_back(*gen);
    return values;
  });
}

template <class... Models>
std::vector<std::string_view> namesOf(const std::variant<Models...>*) {
  return {Models::kName...};
}

}  // namespace

rc::Gen<double> genReal(double lo, double hi) {
  return rc::gen::map(genIndex(kSteps), [lo, hi](uint64_t i) { return latticePoint(lo, hi, i); });
}

rc::Gen<double> genLogReal(double lo, double hi) {
  return rc::gen::map(genIndex(kSteps), [lo, hi](uint64_t i) {
    if (i == 0) return lo;
    if (i == kSteps) return hi;
    return std::clamp(std::exp(latticePoint(std::log(lo), std::log(hi), i)), lo, hi);
  });
}

rc::Gen<int> genInt(int lo, int hi) {
  return rc::gen::map(genIndex(static_cast<uint64_t>(int64_t{hi} - lo)),
                      [lo](uint64_t i) { return static_cast<int>(lo + static_cast<int64_t>(i)); });
}

rc::Gen<double> genParam(const ParamSpec& spec, Range range) {
  if (range == Range::kRealistic) return genReal(spec.realistic_min, spec.realistic_max);
  const rc::Gen<double> realistic = genReal(spec.realistic_min, spec.realistic_max);
  const rc::Gen<double> uniform = genReal(spec.min, spec.max);
  // On each side of 0 that the range has: uniform in the logarithm, down to 1e-12 of its bound.
  const rc::Gen<double> positive =
      spec.max > 0 ? genLogReal(std::max(spec.min, spec.max * 1e-12), spec.max) : uniform;
  const rc::Gen<double> negative =
      spec.min < 0 ? rc::gen::map(genLogReal(std::max(-spec.max, -spec.min * 1e-12), -spec.min),
                                  std::negate<>())
                   : positive;
  return rc::gen::mapcat(genInt(0, 3), [=](int kind) {
    return kind == 0 ? realistic : kind == 1 ? positive : kind == 2 ? negative : uniform;
  });
}

rc::Gen<Camera> genCamera(std::string_view model_name, Range range) {
  const std::span<const ParamSpec> specs = paramSpecsOf(model_name);
  const std::string name(model_name);
  if (range == Range::kAdmissible) {
    return rc::gen::map(
        rc::gen::tuple(genParams(specs, range),
                       genLogReal(1, Camera::kMaxImageSize),
                       genLogReal(1, Camera::kMaxImageSize),
                       genInt(0, 3),
                       genReal(1e-3, M_PI)),
        [name](const std::tuple<std::vector<double>, double, double, int, double>& draw) {
          const auto& [params, width, height, limited, limit] = draw;
          return makeCamera(name,
                            params,
                            static_cast<int>(width),
                            static_cast<int>(height),
                            limited == 3 ? limit : M_PI);
        });
  }
  // Braces draw from left to right.
  const rc::Gen<Lens> lens = rc::gen::exec([] {
    return Lens{*genInt(100, 4000),
                *genInt(100, 4000),
                *genReal(0, 1),
                *genReal(0.8, 1.2),
                *genReal(0.9, 1.1),
                *genReal(-0.05, 0.05),
                *genReal(-0.05, 0.05),
                *genInt(0, 3),
                *genReal(0.3, M_PI)};
  });
  return rc::gen::map(rc::gen::pair(genParams(specs, range), lens),
                      [name](const std::pair<std::vector<double>, Lens>& draw) {
                        return makeRealistic(name, draw.first, draw.second);
                      });
}

std::vector<std::string_view> cameraModelNames() {
  return namesOf(static_cast<const CameraModelVariant*>(nullptr));
}

rc::Gen<Camera> genAnyCamera(Range range) {
  const std::vector<std::string_view> names = cameraModelNames();
  return rc::gen::mapcat(genInt(0, static_cast<int>(names.size()) - 1), [names, range](int i) {
    return genCamera(names[static_cast<size_t>(i)], range);
  });
}

rc::Gen<Eigen::Vector3d> genRayAt(rc::Gen<double> angle_rad) {
  return rc::gen::map(
      rc::gen::pair(std::move(angle_rad), genAzimuth()),
      [](std::pair<double, double> draw) { return rayAt(draw.first, draw.second); });
}

rc::Gen<Eigen::Vector3d> genRay() {
  return genRayAt(rc::gen::map(genReal(0, 2), [](double t) { return std::acos(1 - t); }));
}

rc::Gen<Eigen::Vector3d> genRayNearAxis() {
  return genRayAt(
      rc::gen::map(rc::gen::pair(genInt(0, 7), genReal(1, 17)), [](std::pair<int, double> draw) {
        const double angle = std::pow(10.0, -draw.second);
        return draw.first == 7 ? M_PI - angle : angle;
      }));
}

rc::Gen<Eigen::Vector3d> genRayNearBound(const Camera& camera) {
  const double bound = camera.maxFieldAngle();
  return genRayAt(
      rc::gen::map(genNearOne(), [bound](double f) { return std::min(bound * f, M_PI); }));
}

rc::Gen<Eigen::Vector3d> genRayFor(const Camera& camera) {
  const rc::Gen<Eigen::Vector3d> in_image =
      rc::gen::map(genPixelInImage(camera), [camera](const Eigen::Vector2d& pixel) {
        // Pixels without a ray give the axis, which every model images.
        return camera.unproject(pixel).value_or(Eigen::Vector3d::UnitZ());
      });
  const rc::Gen<Eigen::Vector3d> anywhere = genRay(), axis = genRayNearAxis();
  const rc::Gen<Eigen::Vector3d> bound = genRayNearBound(camera);
  return rc::gen::mapcat(genInt(0, 7), [=](int kind) {
    return kind < 4 ? in_image : kind < 6 ? anywhere : kind == 6 ? axis : bound;
  });
}

rc::Gen<Eigen::Vector2d> genPixelInImage(const Camera& camera) {
  return rc::gen::map(
      rc::gen::pair(genReal(-0.5, camera.width() - 0.5), genReal(-0.5, camera.height() - 0.5)),
      [](std::pair<double, double> draw) { return Eigen::Vector2d(draw.first, draw.second); });
}

rc::Gen<Eigen::Vector2d> genPixelOnBorder(const Camera& camera) {
  const Eigen::Vector2d size(camera.width(), camera.height());
  return rc::gen::map(rc::gen::pair(genInt(0, 3), genReal(0, 1)),
                      [size](std::pair<int, double> draw) {
                        const auto [side, t] = draw;
                        Eigen::Vector2d pixel = t * size - Eigen::Vector2d(0.5, 0.5);
                        pixel[side % 2] = (side < 2 ? 0.0 : size[side % 2]) - 0.5;
                        return pixel;
                      });
}

rc::Gen<Eigen::Vector2d> genPixelNearBound(const Camera& camera) {
  const Eigen::Vector2d centre = principalPoint(camera);
  if (const auto* panorama = std::get_if<Equirectangular>(&camera.model())) {
    // Of a rectangle: one coordinate at its bound.
    const Eigen::Vector2d half(panorama->fx * M_PI, panorama->fy * M_PI / 2);
    return rc::gen::map(rc::gen::tuple(genInt(0, 3), genNearOne(), genReal(-1, 1)),
                        [centre, half](const std::tuple<int, double, double>& draw) {
                          const auto [side, near, along] = draw;
                          Eigen::Vector2d pixel = along * half;
                          pixel[side % 2] = (side < 2 ? -near : near) * half[side % 2];
                          return Eigen::Vector2d(centre + pixel);
                        });
  }
  return rc::gen::map(
      rc::gen::pair(genRayAt(rc::gen::just(camera.maxFieldAngle() * (1 - 1e-14))), genNearOne()),
      [camera, centre](const std::pair<Eigen::Vector3d, double>& draw) {
        // No pixel within range so near to the bound: it is at infinity.
        const Eigen::Vector2d far = centre + 1e8 * Eigen::Vector2d(draw.first.x(), draw.first.y());
        const Eigen::Vector2d pixel = camera.project(draw.first).value_or(far);
        return Eigen::Vector2d(centre + (pixel - centre) * draw.second);
      });
}

rc::Gen<Eigen::Vector2d> genPixelFor(const Camera& camera) {
  const Eigen::Vector2d centre = principalPoint(camera);
  const auto around = [centre](rc::Gen<double> exponent) {
    return rc::gen::map(
        rc::gen::pair(std::move(exponent), genAzimuth()), [centre](std::pair<double, double> draw) {
          const Eigen::Vector3d direction = rayAt(M_PI / 2, draw.second);
          return Eigen::Vector2d(centre + std::pow(10.0, draw.first) * direction.head<2>());
        });
  };
  const rc::Gen<Eigen::Vector2d> inside = genPixelInImage(camera),
                                 border = genPixelOnBorder(camera),
                                 bound = genPixelNearBound(camera), near = around(genReal(-20, 0)),
                                 far = around(genReal(2, 9.2));
  return rc::gen::mapcat(genInt(0, 7), [=](int kind) {
    return kind < 4 ? inside : kind == 4 ? border : kind == 5 ? near : kind == 6 ? far : bound;
  });
}

Eigen::Vector2d principalPoint(const Camera& camera) {
  const std::vector<double> params = camera.params();
  const std::span<const ParamSpec> specs = camera.paramSpecs();
  return {params[indexOf(specs, "cx")], params[indexOf(specs, "cy")]};
}

Eigen::Matrix2d pixelFromPlane(const Camera& camera) {
  const std::vector<double> params = camera.params();
  const std::span<const ParamSpec> specs = camera.paramSpecs();
  const auto get = [&](std::initializer_list<std::string_view> names, double otherwise) {
    for (const std::string_view name : names) {
      const size_t i = indexOf(specs, name);
      if (i < specs.size()) return params[i];
    }
    return otherwise;
  };
  Eigen::Matrix2d A;
  A << get({"fx"}, 1), get({"skew", "e"}, 0),  //
      get({"d"}, 0), get({"fy", "aspect", "c"}, 1);
  return A;
}

Camera scaledCamera(const Camera& camera, double factor, int width, int height) {
  std::vector<double> params = camera.params();
  const std::span<const ParamSpec> specs = camera.paramSpecs();
  for (size_t i = 0; i < params.size(); ++i) {
    if (isCentre(specs[i])) {
      params[i] = (params[i] + 0.5) * factor - 0.5;
    } else {
      params[i] *= std::pow(factor, powerOfPixels(specs[i]));
    }
  }
  return makeCamera(camera.modelName(), params, width, height, camera.maxFieldAngleLimit());
}

std::ostream& operator<<(std::ostream& out, const Camera& camera) {
  const auto precision = out.precision(17);
  out << camera.modelName() << "(";
  const std::vector<double> params = camera.params();
  for (size_t i = 0; i < params.size(); ++i) {
    out << (i > 0 ? ", " : "") << camera.paramSpecs()[i].name << " = " << params[i];
  }
  out << ") " << camera.width() << " x " << camera.height() << ", limit "
      << camera.maxFieldAngleLimit() << " rad";
  out.precision(precision);
  return out;
}

}  // namespace dlsd
