#include "detector/line_tracer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace dlsd {
namespace {

/// A 3D line subtends less than pi; beyond this the tracer is going round a great circle.
constexpr double kMaxAngleRad = 3.1;
/// tan(pi / 8), the widest angle between gradient and curve normal at an edge.
constexpr double kMaxTangent = 0.41421356237309503;
/// Misses in a row that make a gap rather than a flaw.
constexpr int kGapPx = 3;

}  // namespace

LineTracer::LineTracer(const RayTable& rays, const ValidationOptions& options)
    : rays_(rays), options_(options) {}

/// Looks for a crest along the dominant axis of the curve's normal, through the row (or column) of
/// pixels nearest to the position. False where the image or the usable part of it ends.
bool LineTracer::evaluate(const GradientField& field,
                          uint16_t min_magnitude,
                          double bound_px,
                          const Eigen::Vector2d& position,
                          const CurveOffset& curve,
                          Step* step) const {
  const Eigen::Vector2d& e = curve.normal;
  const bool along_x = std::abs(e.x()) >= std::abs(e.y());
  const int axis = along_x ? 0 : 1;
  // Where the curve, here a straight line, crosses that row.
  const double row = std::floor(position[1 - axis] + 0.5);
  const double crossing = position[axis] + (position[1 - axis] - row) * e[1 - axis] / e[axis];
  const int centre = static_cast<int>(std::floor(crossing + 0.5));
  const int x = along_x ? centre : static_cast<int>(row);
  const int y = along_x ? static_cast<int>(row) : centre;
  if (!rays_.isUsable(x, y)) return false;

  step->curve_px = position;
  step->is_edge = false;
  step->nx = static_cast<float>(e.x());
  step->ny = static_cast<float>(e.y());
  const size_t stride = along_x ? 1 : static_cast<size_t>(field.width);
  const size_t middle = field.at(x, y);
  step->gx = field.gx[middle];
  step->gy = field.gy[middle];

  const auto component = [&](size_t i) { return field.gx[i] * e.x() + field.gy[i] * e.y(); };
  // Usable pixels are 2 px from the border, so all five exist.
  const size_t first = middle - 2 * stride;
  std::array<double, 5> profile{};
  for (size_t k = 0; k < 5; ++k) profile[k] = component(first + k * stride);
  double best_distance = bound_px;
  for (size_t k = 1; k < 4; ++k) {
    const double sign = profile[k] < 0 ? -1 : 1;
    const double before = sign * profile[k - 1], here = sign * profile[k];
    const double after = sign * profile[k + 1];
    if (!(here > before && here >= after)) continue;
    const size_t i = first + k * stride;
    if (field.magnitude[i] < min_magnitude) continue;
    const double across = std::abs(field.gx[i] * e.y() - field.gy[i] * e.x());
    if (!(across <= kMaxTangent * here)) continue;
    const double offset = 0.5 * (before - after) / (before - 2 * here + after);
    const double along_axis = centre + (static_cast<double>(k) - 2) + offset - crossing;
    const double distance = std::abs(along_axis * e[axis]);
    if (!(distance <= best_distance)) continue;
    best_distance = distance;
    step->is_edge = true;
    step->along_x = along_x;
    step->polarity = static_cast<int8_t>(sign);
    step->pixel = static_cast<uint32_t>(i);
    step->crest_px[axis] = crossing + along_axis;
    step->crest_px[1 - axis] = row;
  }
  if (step->is_edge) {
    step->ray = rays_.at(step->crest_px.x(), step->crest_px.y()).ray;
    step->px_per_rad = 1 / curve.rad_per_px;
  }
  return true;
}

bool LineTracer::refit() {
  const auto fit = fitPlane(moments_);
  if (!fit) return false;
  normal_ = fit->normal.dot(normal_) < 0 ? Eigen::Vector3d(-fit->normal) : fit->normal;
  points_at_fit_ = points_;
  return true;
}

void LineTracer::extend(const GradientField& field,
                        uint16_t min_magnitude,
                        double bound_px,
                        int direction,
                        std::vector<Step>* steps,
                        Front* front) {
  int misses = 0;
  for (size_t i = steps->size(); i-- > 0 && !(*steps)[i].is_edge;) ++misses;
  Eigen::Vector2d position = front->position;
  Eigen::Vector2d normal = front->normal;
  Eigen::Vector3d last_ray = rays_.at(position.x(), position.y()).ray;
  while (!front->ended && misses <= options_.max_gap_px) {
    // One step along the curve, and back onto it: one Newton step leaves errors of second order in
    // the curve's turn over a pixel.
    Eigen::Vector2d next = position + direction * Eigen::Vector2d(-normal.y(), normal.x());
    const int x = static_cast<int>(std::floor(next.x() + 0.5));
    const int y = static_cast<int>(std::floor(next.y() + 0.5));
    if (!rays_.isUsable(x, y)) {
      front->ended = front->at_border = true;
      break;
    }
    const RaySample sample = rays_.at(next.x(), next.y());
    const CurveOffset curve = curveOffset(sample, normal_);
    angle_rad_ += (sample.ray - last_ray).norm();
    if (!(curve.rad_per_px > 0) || !(std::abs(curve.offset_px) < 1) || angle_rad_ > kMaxAngleRad) {
      front->ended = true;
      break;
    }
    next -= curve.offset_px * curve.normal;
    Step step{};
    if (!evaluate(field, min_magnitude, bound_px, next, curve, &step)) {
      front->ended = front->at_border = true;
      break;
    }
    last_ray = sample.ray;
    position = next;
    normal = curve.normal;
    steps->push_back(step);
    if (step.is_edge) {
      misses = 0;
      moments_.add(step.ray, step.px_per_rad * step.px_per_rad);
      ++points_;
      if (points_ >= points_at_fit_ + std::max(8, points_at_fit_ / 4)) {
        if (!refit()) front->ended = true;
      }
    } else {
      ++misses;
    }
  }
  front->position = position;
  front->normal = normal;
}

/// Cuts what lies beyond the last step that is an edge, and runs shorter than kMinRunPx that are
/// only reached across a gap.
void LineTracer::cutTail(std::vector<Step>* steps) {
  for (;;) {
    while (!steps->empty() && !steps->back().is_edge) steps->pop_back();
    int run = 0, misses = 0;
    for (size_t i = steps->size(); i-- > 0 && misses < kGapPx;) {
      if ((*steps)[i].is_edge) {
        ++run;
        misses = 0;
        if (run >= kMinRunPx) return;
      } else {
        ++misses;
      }
    }
    if (misses < kGapPx) return;
    for (int edges = 0; edges < run;) {
      edges += (*steps).back().is_edge ? 1 : 0;
      steps->pop_back();
    }
  }
}

/// Residuals of an arc of radius r and length l against its best plane are a parabola of height
/// (sagitta) l^2 / (8 r), which is fitted here.
bool LineTracer::isArc(const std::vector<Step>& steps, const Eigen::Vector3d& normal) const {
  // Corners round the last pixels off.
  constexpr size_t kEndPx = 3;
  // What the crests of edges without noise leave.
  constexpr double kFloorPx = 0.15;
  if (steps.size() < 2 * kEndPx + 8) return false;
  const double half_length_px = 0.5 * static_cast<double>(steps.size() - 1 - 2 * kEndPx);
  double n = 0, sum_r = 0, sum_q = 0, sum_qq = 0, sum_qr = 0, sum_rr = 0;
  for (size_t i = kEndPx; i + kEndPx < steps.size(); ++i) {
    const Step& s = steps[i];
    if (!s.is_edge) continue;
    const double t = static_cast<double>(i - kEndPx) / half_length_px - 1;  // -1 ... 1
    const double q = t * t, r = s.ray.dot(normal) * s.px_per_rad;
    n += 1;
    sum_r += r;
    sum_q += q;
    sum_qq += q * q;
    sum_qr += q * r;
    sum_rr += r * r;
  }
  if (n < 8) return false;
  const double qq = sum_qq - sum_q * sum_q / n;
  const double qr = sum_qr - sum_q * sum_r / n;
  const double rr = sum_rr - sum_r * sum_r / n;
  if (!(qq > 0)) return false;
  const double sagitta_px = std::abs(qr) / qq;
  const double variance = std::max(0.0, rr - qr * qr / qq) / (n - 3);
  const double sigma_px = std::sqrt(variance / qq * AlignmentCounter::kCorrelatedPx);
  return sagitta_px > kFloorPx + 3 * sigma_px &&
         half_length_px * half_length_px < 2 * sagitta_px * options_.min_bend_radius_px;
}

LineTracer::End LineTracer::endOf(const Step& last, int direction, bool at_border) const {
  End end{last.crest_px, last.ray};
  if (!at_border) return end;
  Eigen::Vector2d position = last.curve_px;
  for (int i = 0; i < options_.max_gap_px; ++i) {
    const CurveOffset here = curveOffset(rays_.at(position.x(), position.y()), normal_);
    position += direction * Eigen::Vector2d(-here.normal.y(), here.normal.x()) -
                here.offset_px * here.normal;
    if (!(here.rad_per_px > 0) || !rays_.covers(position.x(), position.y())) break;
    end = {position, rays_.at(position.x(), position.y()).ray};
  }
  return end;
}

std::optional<TracedLine> LineTracer::trace(const GradientField& field,
                                            const EdgeThresholds& thresholds,
                                            double noise,
                                            const TraceSeed& seed) {
  forward_.clear();
  backward_.clear();
  moments_ = seed.moments;
  normal_ = seed.normal;
  points_ = points_at_fit_ = seed.points;
  angle_rad_ = 0;

  // The vertex of a parabola through a crest of height P scatters by about 2 noise / P px.
  const double expected_rms_px = 2 * noise * kGradientUnit / std::max(seed.gradient, 1.0);
  const double bound_px =
      std::clamp(options_.max_residual_sigmas * std::max(seed.rms_px, expected_rms_px),
                 options_.tight_rho_px,
                 options_.rho_px);

  const CurveOffset at_start = curveOffset(rays_.at(seed.start_px.x(), seed.start_px.y()), normal_);
  if (!(at_start.rad_per_px > 0) || !(std::abs(at_start.offset_px) < 2)) return std::nullopt;
  Front front;
  front.normal = at_start.normal;
  front.position = seed.start_px - at_start.offset_px * at_start.normal;
  if (!rays_.isUsable(static_cast<int>(std::floor(front.position.x() + 0.5)),
                      static_cast<int>(std::floor(front.position.y() + 0.5)))) {
    return std::nullopt;
  }
  Front back = front;
  // Twice each way: what one end adds to the plane may let the other one go on.
  for (int round = 0; round < 2; ++round) {
    extend(field, thresholds.chain, bound_px, +1, &forward_, &front);
    extend(field, thresholds.chain, bound_px, -1, &backward_, &back);
    if (!refit()) return std::nullopt;
  }
  // One sequence from the backward end to the forward end.
  std::reverse(backward_.begin(), backward_.end());
  backward_.insert(backward_.end(), forward_.begin(), forward_.end());
  // Cut as a whole: what is left of the start may be no more than a short run beyond a gap.
  const auto cutEnd = [&](Front* end) {
    const size_t size = backward_.size();
    cutTail(&backward_);
    // A cut by more than a flaw means that the edge had ended before the border.
    end->at_border = end->at_border && backward_.size() + kGapPx > size;
  };
  cutEnd(&front);
  std::reverse(backward_.begin(), backward_.end());
  cutEnd(&back);
  std::reverse(backward_.begin(), backward_.end());
  const std::vector<Step>& steps = backward_;  // first and last are edges
  if (steps.size() < 2 || static_cast<double>(steps.size()) < options_.min_length_px) {
    return std::nullopt;
  }

  moments_ = {};
  AlignmentCounter alignment;
  long polarity = 0;
  const auto min_gradient = static_cast<float>(thresholds.chain);
  crest_pixels_.clear();
  crest_along_x_.clear();
  for (const Step& s : steps) {
    const bool has_gradient = s.gx * s.gx + s.gy * s.gy >= min_gradient * min_gradient;
    alignment.add(static_cast<double>(s.gx),
                  static_cast<double>(s.gy),
                  {static_cast<double>(s.nx), static_cast<double>(s.ny)},
                  has_gradient);
    if (!s.is_edge) continue;
    moments_.add(s.ray, s.px_per_rad * s.px_per_rad);
    crest_pixels_.push_back(s.pixel);
    crest_along_x_.push_back(static_cast<uint8_t>(s.along_x));
  }
  const auto fit = fitPlane(moments_);
  if (!fit) return std::nullopt;

  TracedLine line;
  line.fit = *fit;
  line.score = alignment.score(field.width, field.height);
  double sum2 = 0;
  line.max_px = 0;
  line.length_px = 0;
  for (size_t i = 0; i < steps.size(); ++i) {
    const Step& s = steps[i];
    if (i > 0) line.length_px += (s.curve_px - steps[i - 1].curve_px).norm();
    if (!s.is_edge) continue;
    const RaySample sample = rays_.at(s.crest_px.x(), s.crest_px.y());
    const double err = reprojectionErrorFirstOrder(sample, fit->normal);
    sum2 += err * err;
    line.max_px = std::max(line.max_px, err);
    const double nx = static_cast<double>(s.nx), ny = static_cast<double>(s.ny);
    const double side = sample.du.dot(fit->normal) * nx + sample.dv.dot(fit->normal) * ny;
    polarity += side < 0 ? -s.polarity : s.polarity;
  }
  line.edge_points = static_cast<int>(crest_pixels_.size());
  line.rms_px = std::sqrt(sum2 / line.edge_points);
  line.is_arc = isArc(steps, fit->normal);
  line.polarity = polarity < 0 ? -1 : 1;
  normal_ = normal_.dot(fit->normal) < 0 ? Eigen::Vector3d(-fit->normal) : fit->normal;
  const End from = endOf(steps.front(), -1, back.at_border);
  const End to = endOf(steps.back(), +1, front.at_border);
  line.from_ray = from.ray;
  line.to_ray = to.ray;
  line.from_px = from.px;
  line.to_px = to.px;
  line.middle_ray =
      rays_.at(steps[steps.size() / 2].curve_px.x(), steps[steps.size() / 2].curve_px.y()).ray;
  line.length_px +=
      (from.px - steps.front().crest_px).norm() + (to.px - steps.back().crest_px).norm();
  return line;
}

}  // namespace dlsd
