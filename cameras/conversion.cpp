#include "cameras/conversion.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>

#include "cameras/batch.h"
#include "cameras/mutant.h"

namespace dlsd {
namespace {

using Eigen::VectorXd;

constexpr double kBandRad = M_PI / 18;

double fieldAngle(double x, double y, double z) {
  return std::atan2(std::hypot(x, y), z);
}

/// Pixels and their rays, as the batches take them.
struct Samples {
  std::vector<double> u, v, x, y, z, angle;

  [[nodiscard]] size_t size() const { return u.size(); }
  void add(double pu, double pv, const Eigen::Vector3d& ray) {
    u.push_back(pu);
    v.push_back(pv);
    x.push_back(ray.x());
    y.push_back(ray.y());
    z.push_back(ray.z());
    angle.push_back(fieldAngle(ray.x(), ray.y(), ray.z()));
  }
};

/// At most `count` along each side of the image, the outermost pixels among them.
Samples sampleImage(const Camera& source, int count, double max_angle) {
  const int columns = std::min(count, source.width()), rows = std::min(count, source.height());
  const auto at = [](int i, int n, int size) { return n > 1 ? i * (size - 1.0) / (n - 1) : 0.0; };
  Samples samples;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double u = at(column, columns, source.width()), v = at(row, rows, source.height());
      const std::optional<Eigen::Vector3d> ray = source.unproject({u, v});
      if (ray && fieldAngle(ray->x(), ray->y(), ray->z()) <= max_angle) samples.add(u, v, *ray);
    }
  }
  return samples;
}

Samples upToAngle(const Samples& all, double max_angle) {
  Samples samples;
  for (size_t i = 0; i < all.size(); ++i) {
    if (all.angle[i] <= max_angle) samples.add(all.u[i], all.v[i], {all.x[i], all.y[i], all.z[i]});
  }
  return samples;
}

/// The fit's cost: over the rays d^2 / (1 + d^2 / D^2), which is the squared distance d^2 as long
/// as that is small against the image's diagonal D; what is far beyond the image (rays near 90
/// degrees under a pinhole) has no more say than that. A ray that does not project costs D^2, the
/// most.
class Fit {
 public:
  Fit(std::string_view model, const Camera& source, const Samples& samples)
      : model_(model),
        specs_(paramSpecsOf(model)),
        samples_(samples),
        width_(source.width()),
        height_(source.height()),
        lost_cost_(std::pow(width_, 2) + std::pow(height_, 2)),
        u_(samples.size()),
        v_(samples.size()),
        valid_(samples.size()) {}

  struct Value {
    double cost = std::numeric_limits<double>::infinity();
    VectorXd residual;  ///< Weighted distances in u and v by turns; 0 for what does not project.
    std::vector<double> weight;  ///< Of u and v; 0 for rays that do not project.
    VectorXd pixels;             ///< u and v by turns.
  };

  [[nodiscard]] Value at(const VectorXd& params) {
    Value value;
    std::optional<Camera> camera;
    try {
      camera = makeCamera(model_, {params.data(), size_t(params.size())}, width_, height_);
    } catch (const std::invalid_argument&) {
      return value;  // parameters that the model does not admit
    }
    projectAll(*camera, samples_.x, samples_.y, samples_.z, u_, v_, valid_);
    value.residual.setZero(Eigen::Index(2 * samples_.size()));
    value.pixels.setZero(value.residual.size());
    value.weight.assign(samples_.size(), 0);
    value.cost = 0;
    for (size_t i = 0; i < samples_.size(); ++i) {
      if (valid_[i] == 0) {
        value.cost += lost_cost_;
        continue;
      }
      const double du = u_[i] - samples_.u[i], dv = v_[i] - samples_.v[i];
      const double square = du * du + dv * dv;
      const double weight = 1 / (1 + square / lost_cost_);
      const auto row = Eigen::Index(2 * i);
      value.cost += weight * square;
      value.weight[i] = weight;
      value.pixels.segment<2>(row) << u_[i], v_[i];
      value.residual.segment<2>(row) << weight * du,
          (DLSD_MUTANT("convert-weights") ? 2 : 1) * weight * dv;
    }
    return value;
  }

  /// The parameters with the smallest cost that steps from `params` lead to.
  [[nodiscard]] VectorXd minimise(VectorXd params, int max_steps) {
    const Eigen::Index n = params.size();
    for (Eigen::Index i = 0; i < n; ++i) params[i] = clamped(i, params[i]);
    Value value = at(params);
    if (!std::isfinite(value.cost)) return params;
    double damping = 1e-4;
    int idle = 0;
    for (int step = 0; step < max_steps && idle < 3; ++step) {
      const Eigen::MatrixXd jacobian = derivatives(params, value);
      const VectorXd gradient = jacobian.transpose() * value.residual;
      bool better = false;
      while (!better && damping < 1e12) {
        const VectorXd next = stepFrom(params, jacobian, gradient, value.residual, damping);
        Value there = at(next);
        better = there.cost < value.cost;
        if (better) {
          idle = there.cost < 0.999999 * value.cost ? 0 : idle + 1;
          params = next;
          value = std::move(there);
          damping *= 0.1;
        } else {
          damping = std::max(1e-12, 10 * damping);
        }
      }
      if (!better) break;
    }
    return snapped(params, value.cost);
  }

 private:
  [[nodiscard]] double clamped(Eigen::Index i, double value) const {
    const ParamSpec& spec = specs_[size_t(i)];
    return std::clamp(value, spec.min, spec.max);
  }

  /// With each parameter at a bound or 0 where that is no worse: there a model often degenerates to
  /// a simpler one (omega = 0), which steps approach but never reach.
  [[nodiscard]] VectorXd snapped(VectorXd params, double cost) {
    for (Eigen::Index i = 0; i < params.size(); ++i) {
      const ParamSpec& spec = specs_[size_t(i)];
      for (const double special : {0.0, spec.min, spec.max}) {
        VectorXd there = params;
        there[i] = clamped(i, special);
        const double cost_there = at(there).cost;
        if (cost_there <= cost) {
          params = there;
          cost = cost_there;
        }
      }
    }
    return params;
  }

  /// d(residual) / d(parameter) by central differences (one-sided at a bound), with steps that move
  /// pixels by about kMovePx: large against rounding, small against what bends.
  Eigen::MatrixXd derivatives(const VectorXd& params, const Value& value) {
    constexpr double kMovePx = 0.01;
    const Eigen::Index n = params.size();
    steps_.resize(size_t(n), 0);
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(value.residual.size(), n);
    for (Eigen::Index i = 0; i < n; ++i) {
      double& step = steps_[size_t(i)];
      if (step == 0) {
        const ParamSpec& spec = specs_[size_t(i)];
        step = 1e-4 * (spec.realistic_max - spec.realistic_min);
      }
      for (int trial = 0; trial < 40; ++trial) {
        VectorXd up = params, down = params;
        up[i] = clamped(i, params[i] + step);
        down[i] = clamped(i, params[i] - step);
        const Value a = at(up), b = at(down);
        if (!std::isfinite(a.cost) || !std::isfinite(b.cost)) {
          step /= 10;
          continue;
        }
        double moved = 0;
        size_t lost = 0;
        for (size_t k = 0; k < value.weight.size(); ++k) {
          const auto row = Eigen::Index(2 * k);
          const bool valid = value.weight[k] > 0 && a.weight[k] > 0 && b.weight[k] > 0;
          lost += value.weight[k] > 0 && !valid ? 1 : 0;
          const Eigen::Vector2d move =
              valid ? Eigen::Vector2d(a.pixels.segment<2>(row) - b.pixels.segment<2>(row))
                    : Eigen::Vector2d(0, 0);
          moved = std::max(moved, move.lpNorm<Eigen::Infinity>());
          jacobian.block<2, 1>(row, i) = value.weight[k] / (up[i] - down[i]) * move;
        }
        if (moved == 0 && lost > 0) {
          step /= 1e3;
          continue;
        }
        if (moved > kMovePx * 100) {
          step *= kMovePx / moved;
        } else if (moved < kMovePx / 100 && step < specs_[size_t(i)].max - specs_[size_t(i)].min) {
          step *= moved > 0 ? std::min(kMovePx / moved, 1e3) : 1e3;
        } else {
          break;
        }
      }
    }
    return jacobian;
  }

  /// Damped Gauss-Newton step; parameters that it would push through their bounds stay there, and
  /// the others take their best step without them.
  [[nodiscard]] VectorXd stepFrom(const VectorXd& params,
                                  const Eigen::MatrixXd& jacobian,
                                  const VectorXd& gradient,
                                  const VectorXd& residual,
                                  double damping) const {
    const Eigen::Index n = params.size();
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < n; ++i) {
      const ParamSpec& spec = specs_[size_t(i)];
      const bool stuck =
          (params[i] <= spec.min && gradient[i] > 0) || (params[i] >= spec.max && gradient[i] < 0);
      if (!stuck && jacobian.col(i).squaredNorm() > 0) free.push_back(i);
    }
    VectorXd next = params;
    while (!free.empty()) {
      const auto m = Eigen::Index(free.size());
      Eigen::MatrixXd a(jacobian.rows() + m, m);
      VectorXd b = VectorXd::Zero(jacobian.rows() + m);
      b.head(jacobian.rows()) = -residual;
      VectorXd scale(m);
      a.bottomRows(m).setZero();
      for (Eigen::Index k = 0; k < m; ++k) {
        scale[k] = 1 / jacobian.col(free[size_t(k)]).norm();
        a.col(k).head(jacobian.rows()) = scale[k] * jacobian.col(free[size_t(k)]);
        a(jacobian.rows() + k, k) = std::sqrt(damping);
      }
      const VectorXd step = a.colPivHouseholderQr().solve(b);
      next = params;
      std::vector<Eigen::Index> inside;
      for (Eigen::Index k = 0; k < m; ++k) {
        const Eigen::Index i = free[size_t(k)];
        const double wanted = params[i] + scale[k] * step[k];
        next[i] = clamped(i, wanted);
        if (next[i] == wanted) inside.push_back(i);
      }
      const bool all_inside = inside.size() == free.size();
      // A parameter on its way to the bound may get there; one that is there already is held.
      std::vector<Eigen::Index> rest;
      for (const Eigen::Index i : free) {
        if (next[i] != params[i]) rest.push_back(i);
      }
      if (all_inside || rest.size() == free.size()) break;
      free = std::move(rest);
    }
    return next;
  }

  std::string_view model_;
  std::span<const ParamSpec> specs_;
  const Samples& samples_;
  int width_, height_;
  double lost_cost_;
  std::vector<double> u_, v_;
  std::vector<uint8_t> valid_;
  std::vector<double> steps_;  // of the differences, by parameter
};

/// Parameters that shape the radial curve of a model without being coefficients of a series, which
/// start at 0: where the search for them starts.
struct ShapeStarts {
  std::string_view name;
  std::vector<double> values;
};
const std::array<ShapeStarts, 4> kShapeStarts{{{"omega", {0.1, 0.5, 0.9, 1.4}},
                                               {"xi", {0.01, 0.6, 1, 2}},
                                               {"alpha", {0.05, 0.4, 0.6, 0.8}},
                                               {"beta", {0.5, 1, 2}}}};

/// Starting points of the fit: for each combination of kShapeStarts the parameters that agree with
/// the source at the optical axis in position and scale.
class Starts {
 public:
  Starts(const Camera& source, std::string_view model, double max_angle)
      : specs_(paramSpecsOf(model)), max_angle_(max_angle) {
    const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
    const std::optional<Eigen::Vector2d> centre = source.project(axis);
    const Eigen::Vector2d middle((source.width() - 1) / 2.0, (source.height() - 1) / 2.0);
    centre_ = centre.value_or(middle);
    const std::optional<ProjectionJacobian> scale = source.jacobian(axis);
    scale_ = scale ? Eigen::Vector2d((*scale)(0, 0), (*scale)(1, 1))
                   : Eigen::Vector2d(source.width(), source.width());
    VectorXd params(Eigen::Index(specs_.size()));
    for (size_t i = 0; i < specs_.size(); ++i) {
      params[Eigen::Index(i)] = std::clamp(0.0, specs_[i].min, specs_[i].max);
    }
    set("cx", centre_.x(), &params);
    set("cy", centre_.y(), &params);
    set("aspect", scale_.y() / scale_.x(), &params);
    if (find("a0") >= 0) {
      starts_.push_back({ocamStart(source, params), true});
    } else {
      combine(model, 0, params);
    }
  }

  struct Start {
    VectorXd params;
    bool whole = false;  ///< Good over the whole image, not only near the axis.
  };
  [[nodiscard]] const std::vector<Start>& all() const { return starts_; }

 private:
  [[nodiscard]] Eigen::Index find(std::string_view name) const {
    for (size_t i = 0; i < specs_.size(); ++i) {
      if (specs_[i].name == name) return Eigen::Index(i);
    }
    return -1;
  }
  void set(std::string_view name, double value, VectorXd* params) const {
    const Eigen::Index i = find(name);
    if (i >= 0) (*params)[i] = value;
  }

  void combine(std::string_view model, size_t shape, VectorXd params) {
    if (shape < kShapeStarts.size()) {
      const Eigen::Index i = find(kShapeStarts[shape].name);
      if (i < 0) return combine(model, shape + 1, params);
      for (const double value : kShapeStarts[shape].values) {
        params[i] = std::clamp(value, specs_[size_t(i)].min, specs_[size_t(i)].max);
        combine(model, shape + 1, params);
      }
      return;
    }
    if (find("fx") >= 0) {
      // The scale at the axis is proportional to fx and fy.
      set("fx", 1, &params);
      set("fy", 1, &params);
      const Camera unit = makeCamera(model, {params.data(), specs_.size()}, 1, 1);
      const std::optional<ProjectionJacobian> jacobian = unit.jacobian(Eigen::Vector3d::UnitZ());
      if (!jacobian) return;
      set("fx", scale_.x() / (*jacobian)(0, 0), &params);
      set("fy", scale_.y() / (*jacobian)(1, 1), &params);
      starts_.push_back({params});
    } else {
      set("k1", scale_.x(), &params);  // radius in px = k1 theta + ...
      starts_.push_back({params});
    }
  }

  /// OCam is defined from pixels to rays, (rho, -f(rho)) along (sin, cos) of the field angle, and
  /// linear in its polynomial f: solved by least squares.
  [[nodiscard]] VectorXd ocamStart(const Camera& source, VectorXd params) const {
    set("c", scale_.y() / scale_.x(), &params);
    const Samples samples = sampleImage(source, 48, max_angle_);
    const double range = std::hypot(source.width(), source.height());
    constexpr Eigen::Index kTerms = 9;
    Eigen::MatrixXd a(Eigen::Index(samples.size()), kTerms);
    VectorXd b(a.rows());
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      const auto k = size_t(i);
      const double rho = std::hypot(samples.u[k] - centre_.x(),
                                    (samples.v[k] - centre_.y()) * scale_.x() / scale_.y());
      const double weight = 1 / (1 + rho);
      for (Eigen::Index term = 0; term < kTerms; ++term) {
        a(i, term) = weight * std::sin(samples.angle[k]) * std::pow(rho / range, double(term));
      }
      b[i] = -weight * rho * std::cos(samples.angle[k]);
    }
    const VectorXd polynomial = a.colPivHouseholderQr().solve(b);
    for (Eigen::Index term = 0; term < kTerms; ++term) {
      params[find("a0") + term] = polynomial[term] / std::pow(range, double(term));
    }
    return params;
  }

  std::span<const ParamSpec> specs_;
  double max_angle_;
  Eigen::Vector2d centre_, scale_;
  std::vector<Start> starts_;
};

/// Whether pixels of the source's image have no ray or a larger field angle.
bool endsInImage(const Camera& source, double max_angle) {
  constexpr int kPerSide = 200;
  const Samples samples = sampleImage(source, kPerSide, max_angle);
  const auto along = [](int size) { return std::min(size_t(size), size_t{kPerSide}); };
  return samples.size() < along(source.width()) * along(source.height());
}

std::optional<Camera> fitCamera(const Camera& source, std::string_view model, double max_angle) {
  constexpr int kCoarse = 20, kFine = 48;
  const Samples coarse = sampleImage(source, kCoarse, max_angle);
  const Samples fine = sampleImage(source, kFine, max_angle);
  if (fine.size() == 0) return std::nullopt;
  const double widest = *std::max_element(fine.angle.begin(), fine.angle.end());

  // From the axis outwards: each step starts where the fit so far is good, so that a series finds
  // its coefficients, and a model that can't see that far does not lose its way.
  struct Candidate {
    double cost;
    VectorXd params;
  };
  std::vector<Candidate> candidates;
  const Starts starts(source, model, max_angle);
  for (const auto& [start, whole] : starts.all()) {
    VectorXd params = start;
    for (double angle = M_PI / 6; !whole && angle < widest; angle += M_PI / 18) {
      const Samples inner = upToAngle(coarse, angle);
      if (inner.size() >= 20) params = Fit(model, source, inner).minimise(params, 20);
    }
    const auto try_from = [&](const VectorXd& from) {
      Fit fit(model, source, coarse);
      const VectorXd there = fit.minimise(from, 60);
      candidates.push_back({fit.at(there).cost, there});
    };
    try_from(params);
    // Where the model cannot follow, the way outwards may lead astray.
    if (!whole) try_from(start);
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.cost < b.cost;
  });
  if (candidates.size() > 2) candidates.resize(2);

  Fit fit(model, source, fine);
  Candidate best{std::numeric_limits<double>::infinity(), {}};
  const auto improve_from = [&](const VectorXd& from) {
    const VectorXd params = fit.minimise(from, 200);
    const Fit::Value value = fit.at(params);
    const bool projects =
        std::any_of(value.weight.begin(), value.weight.end(), [](double w) { return w > 0; });
    if (projects && value.cost < best.cost) best = {value.cost, params};
  };
  for (const Candidate& candidate : candidates) improve_from(candidate.params);
  for (const auto& [start, whole] : starts.all()) {
    if (fit.at(start).cost < best.cost) improve_from(start);
  }
  if (best.params.size() == 0) return std::nullopt;
  return makeCamera(
      model, {best.params.data(), size_t(best.params.size())}, source.width(), source.height());
}

}  // namespace

ConversionResidual conversionResidual(const Camera& source,
                                      const Camera& other,
                                      double max_field_angle_rad) {
  const auto width = size_t(source.width());
  std::vector<double> u(width), v(width), x(width), y(width), z(width), pu(width), pv(width);
  std::vector<uint8_t> has_ray(width), projects(width);
  for (size_t i = 0; i < width; ++i) u[i] = double(i);
  ConversionResidual result;
  result.all = {0, max_field_angle_rad};
  const auto add = [](ResidualBand* band, bool projected, double square) {
    if (!projected) {
      ++band->lost;
      return;
    }
    ++band->compared;
    band->rms_px += square;  // the sum until the end
    band->max_px = std::max(band->max_px, square);
  };
  for (int row = 0; row < source.height(); ++row) {
    std::fill(v.begin(), v.end(), double(row));
    unprojectAll(source, u, v, x, y, z, has_ray);
    projectAll(other, x, y, z, pu, pv, projects);
    for (size_t i = 0; i < width; ++i) {
      if (has_ray[i] == 0) continue;
      const double angle = fieldAngle(x[i], y[i], z[i]);
      if (!(angle <= max_field_angle_rad)) continue;
      const auto band = size_t(angle / kBandRad);
      while (result.bands.size() <= band) {
        const auto k = double(result.bands.size());
        result.bands.push_back({k * kBandRad, (k + 1) * kBandRad});
      }
      const bool projected = projects[i] != 0;
      const double square = projected ? std::pow(pu[i] - u[i], 2) + std::pow(pv[i] - v[i], 2) : 0;
      if (projected && square > result.all.max_px) result.worst_px = {u[i], v[i]};
      add(&result.all, projected, square);
      add(&result.bands[band], projected, square);
    }
  }
  const auto finish = [](ResidualBand* band) {
    band->rms_px = band->compared > 0 ? std::sqrt(band->rms_px / double(band->compared)) : 0;
    band->max_px = std::sqrt(band->max_px);
  };
  finish(&result.all);
  for (ResidualBand& band : result.bands) finish(&band);
  return result;
}

std::optional<Conversion> convertCamera(const Camera& source,
                                        std::string_view model_name,
                                        double max_field_angle_rad) {
  if (!(max_field_angle_rad > 0 && max_field_angle_rad <= M_PI)) {
    throw std::invalid_argument("max_field_angle_rad = " + std::to_string(max_field_angle_rad) +
                                " is out of range: allowed is (0, pi] rad");
  }
  (void)paramSpecsOf(model_name);
  const bool same = model_name == source.modelName();
  std::optional<Camera> fitted = same ? source : fitCamera(source, model_name, max_field_angle_rad);
  if (!fitted) return std::nullopt;
  const double bound = std::min(source.maxFieldAngle(), max_field_angle_rad);
  if (fitted->maxFieldAngle() > bound && endsInImage(source, bound)) {
    fitted = Camera(fitted->model(), source.width(), source.height(), bound);
  }
  ConversionResidual residual = conversionResidual(source, *fitted, max_field_angle_rad);
  if (residual.all.compared == 0) return std::nullopt;
  return Conversion{*std::move(fitted), std::move(residual)};
}

}  // namespace dlsd
