#include "detector/line_tracer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

/// A 3D line subtends less than pi. What goes on (a horizon) is cut here; the rest is a line of its
/// own.
constexpr double kMaxAngleRad = 3.04;
/// Rows that cross the curve, until it has turned this far beyond 45 degrees.
constexpr double kTurnRatio = 1.25;
/// Widest angle between an edge and the curve: tan(pi / 10).
constexpr float kMaxTangent = 0.325F;
/// Where four rows seen through the narrow filter scatter more than this, the wide one is used, if
/// the edge stands alone: its neighbours would be seen, too.
constexpr double kMaxNarrowSigmaPx = 0.2;
constexpr double kAloneRatio[2] = {0.85, 1.25};
/// Blur of edges whose own can't be measured, across them: optics of 0.7 px and the pixel.
constexpr double kUsualVariance = 0.7 * 0.7 + 1.0 / 12;
/// What a filter of fixed shape leaves of an edge of another blur, and of its neighbours.
constexpr float kModelVariance = 0.03F * 0.03F;
/// Wide over narrow response: 1 for a step, 1.2 for one of blur 1.5 px, 1.3 for two alike that are
/// 3 px apart, 1.7 for shading that rises evenly.
constexpr float kMaxWideRatio = 1.45F;
/// Runs whose level is less than this times the line's, or that much above ...
constexpr float kFaintLevel = 0.3F;
/// ... must be this long at its ends.
constexpr int kMinStrangeRunPx = 20;
constexpr int kMinFlippedRunPx = 12;
/// How fast the bound of the residuals follows them, from four rows to the next.
constexpr float kDriftRate = 0.3F;
/// Standard deviations of noise that the response of an edge exceeds.
constexpr float kEdgeSigmas = 2.5F;

/// What odd_narrow would be if the edge had been looked for where it is, relative to odd_wide.
double narrowLevel(const EdgeResponse& r) {
  const auto odd = static_cast<double>(r.odd_narrow), even = static_cast<double>(r.even_narrow);
  return odd == 0 ? 0 : std::abs(odd) * (1 + 0.15 * std::min(1.0, even * even / (odd * odd)));
}

/// The same for every camera.
const BarProfiles& barProfiles() {
  static const BarProfiles profiles{EdgeProfiler()};
  return profiles;
}

/// Nearest pixel, of positions not far outside the image.
int pixelOf(float position) {
  return static_cast<int>(position + 0.5F);
}

}  // namespace

LineTracer::LineTracer(const RayTable& rays, const ValidationOptions& options)
    : rays_(rays), options_(options), bars_(barProfiles()), blur_px2_(kUsualVariance) {}

void LineTracer::setImage(const GreyPixels& pixels,
                          const BitRows& usable,
                          const BitRows& seen,
                          double min_contrast) {
  pixels_ = pixels;
  usable_ = &usable;
  seen_ = &seen;
  profiler_.setPixels(pixels);
  measureNoise();
  const auto floor = static_cast<float>(min_contrast);
  min_odd_narrow_ = std::max(floor, kEdgeSigmas * noise_.odd_narrow);
  min_odd_wide_ = std::max(floor, kEdgeSigmas * noise_.odd_wide);
}

void LineTracer::measureNoise() {
  // The 25 % quantile of absolute values, which edges hardly touch, is 0.319 standard deviations.
  constexpr double kQuantile = 0.25, kSigmasAtQuantile = 0.3186;
  constexpr int kColumns = 32, kWindowRows = 24;
  std::array<std::array<float, 2 * kColumns * kWindowRows>, 4> values;
  size_t count = 0;
  std::array<EdgeResponse, EdgeProfiler::kRows> rows;
  // An image circle may be a small part of the image.
  const PixelBox where = usable_->bounds();
  for (int j = 0; j < kWindowRows; ++j) {
    for (int i = 0; i < kColumns; ++i) {
      const int x = where.x0 + (2 * i + 1) * where.width() / (2 * kColumns);
      const int y = where.y0 + (2 * j + 1) * where.height() / (2 * kWindowRows);
      if (!usable_->contains(x, y) || !usable_->contains(x - 8, y) ||
          !usable_->contains(x + 8, y) || !usable_->contains(x, y + 7)) {
        continue;
      }
      profiler_.measure({true, y, static_cast<double>(x), 0}, &rows);
      for (size_t half = 0; half < 2; ++half) {
        EdgeResponse sum{};
        for (size_t k = 4 * half; k < 4 * half + 4; ++k) {
          sum.odd_narrow += rows[k].odd_narrow;
          sum.even_narrow += rows[k].even_narrow;
          sum.odd_wide += rows[k].odd_wide;
          sum.even_wide += rows[k].even_wide;
        }
        values[0][count] = std::abs(sum.odd_narrow);
        values[1][count] = std::abs(sum.even_narrow);
        values[2][count] = std::abs(sum.odd_wide);
        values[3][count] = std::abs(sum.even_wide);
        ++count;
      }
    }
  }
  const auto sigma = [&](size_t i, double least) {
    if (count == 0) return static_cast<float>(least);
    const auto rank = static_cast<ptrdiff_t>(kQuantile * static_cast<double>(count));
    std::nth_element(values[i].begin(),
                     values[i].begin() + rank,
                     values[i].begin() + static_cast<ptrdiff_t>(count));
    const double value = static_cast<double>(values[i][static_cast<size_t>(rank)]) / 4;
    return static_cast<float>(std::max(least, value / kSigmasAtQuantile));
  };
  // Rounding to whole grey levels is noise, too.
  const EdgeResponse white = profiler_.whiteNoise();
  const double rounding = std::sqrt(1.0 / 12) / 2;
  noise_.odd_narrow = sigma(0, rounding * static_cast<double>(white.odd_narrow));
  noise_.even_narrow = sigma(1, rounding * static_cast<double>(white.even_narrow));
  noise_.odd_wide = sigma(2, rounding * static_cast<double>(white.odd_wide));
  noise_.even_wide = sigma(3, rounding * static_cast<double>(white.even_wide));
}

/// Whether the curve crosses rows or columns here, and how; moves the front to the border between
/// two of them. False where the camera ends.
bool LineTracer::orient(Front* front) const {
  Eigen::Vector2d& p = front->position;
  const Eigen::Vector2d inside(std::clamp(p.x(), 0.0, pixels_.width - 1.0),
                               std::clamp(p.y(), 0.0, pixels_.height - 1.0));
  if (!((p - inside).squaredNorm() <= 1) || !rays_.covers(inside.x(), inside.y())) return false;
  const RaySample sample = rays_.at(inside.x(), inside.y());
  const Eigen::Vector2d g(sample.du.dot(normal_), sample.dv.dot(normal_));
  front->crosses_rows = std::abs(g.x()) >= std::abs(g.y());
  const int a = front->crosses_rows ? 0 : 1;
  if (!(std::abs(g[a]) > 0)) return false;
  front->slope = -g[1 - a] / g[a];
  front->bend = 0;
  const double before = p[1 - a];
  p[1 - a] = std::floor(before) + 0.5;
  p[a] += (p[1 - a] - before) * front->slope;
  front->has_slope = true;
  return true;
}

/// The next eight rows (columns) that the curve crosses; false where the camera ends.
bool LineTracer::evaluate(Front* front, int direction, std::array<Quad, 2>* quads) const {
  constexpr double kHalf = EdgeProfiler::kRows / 2.0;
  Eigen::Vector2d p = front->position;
  if (!front->has_slope && !orient(front)) return false;
  p = front->position;
  const int a = front->crosses_rows ? 0 : 1;  // axis across the rows
  // Along the curve's tangent (-ny, nx) turned by `direction`: which way along the rows?
  const int first_row = static_cast<int>(p[1 - a] + 1) - (direction > 0 ? 0 : 8);
  const double centre = first_row + kHalf - 0.5;
  const double ahead = centre - p[1 - a];
  Eigen::Vector2d at;
  at[1 - a] = centre;
  at[a] = p[a] + ahead * (front->slope + 0.5 * ahead * front->bend);
  RaySample sample;
  Eigen::Vector2d g;
  for (int iteration = 0; iteration < 3; ++iteration) {
    const double u = std::clamp(at.x(), 0.0, pixels_.width - 1.0);
    const double v = std::clamp(at.y(), 0.0, pixels_.height - 1.0);
    if (std::abs(u - at.x()) + std::abs(v - at.y()) > 4 || !rays_.covers(u, v)) return false;
    sample = rays_.at(u, v);
    g = {sample.du.dot(normal_), sample.dv.dot(normal_)};
    if (!(std::abs(g[a]) * 4 > std::abs(g[1 - a]))) return false;
    const double f = sample.ray.dot(normal_) + (at.x() - u) * g.x() + (at.y() - v) * g.y();
    const double step = -f / g[a];
    if (!(std::abs(step) < 4)) return false;
    sample.ray += (at.x() - u) * sample.du + (at.y() - v) * sample.dv;
    sample.ray += step * (a == 0 ? sample.du : sample.dv);
    at[a] += step;
    if (std::abs(step) < 0.5) break;
  }
  const double slope = -g[1 - a] / g[a];
  const double bend = (slope - front->slope) / ahead;
  // The mean of a parabola over the eight rows.
  constexpr double kMeanSquare = 5.25;
  EdgeWindow window{front->crosses_rows, first_row, at[a] + 0.5 * bend * kMeanSquare, slope};
  std::array<EdgeResponse, EdgeProfiler::kRows> rows;
  profiler_.measure(window, &rows);

  const Eigen::Vector3d& across = a == 0 ? sample.du : sample.dv;
  const Eigen::Vector3d along = (a == 0 ? sample.dv : sample.du) + slope * across;  // in the plane
  const Eigen::Vector3d on_plane = sample.ray - sample.ray.dot(normal_) * normal_;
  const auto perpendicular = static_cast<float>(std::abs(g[a]) / std::sqrt(g.squaredNorm()));
  for (size_t half = 0; half < 2; ++half) {
    const size_t first = (direction > 0) == (half == 0) ? 0 : 4;
    Quad& q = (*quads)[half];
    const double ahead_of_centre = first == 0 ? -2 : 2;
    q.ray = on_plane + ahead_of_centre * along;
    q.across = across;
    const auto px_across = static_cast<float>(at[a] + ahead_of_centre * slope);
    const auto px_along = static_cast<float>(centre + ahead_of_centre);
    q.x = a == 0 ? px_across : px_along;
    q.y = a == 0 ? px_along : px_across;
    q.slope = static_cast<float>(slope);
    q.perpendicular = perpendicular;
    q.crosses_rows = front->crosses_rows;
    q.way = static_cast<int8_t>(direction);
    const auto row = [&](size_t k) {
      return Eigen::Map<const Eigen::Array4f, Eigen::Aligned16>(&rows[first + k].odd_narrow);
    };
    Eigen::Map<Eigen::Array4f, Eigen::Aligned16>(&q.mean.odd_narrow) =
        0.25F * ((row(0) + row(1)) + (row(2) + row(3)));
    const Eigen::Array4f turn = 0.3F * (row(3) - row(0)) + 0.1F * (row(2) - row(1));
    q.turn = turn[wide_ ? 3 : 1];
    for (size_t k = 0; k < 4; ++k) {
      const EdgeResponse& r = rows[first + k];
      q.odd[direction > 0 ? k : 3 - k] = wide_ ? r.odd_wide : r.odd_narrow;
    }
    judge(&q);
  }
  // On to the border behind the eight rows.
  const double rest = direction * kHalf;
  front->position[1 - a] = centre + rest;
  front->position[a] = at[a] + rest * (slope + 0.5 * rest * bend);
  front->slope = slope + rest * bend;
  front->bend = bend;
  if (!(std::abs(front->slope) < kTurnRatio)) front->has_slope = false;
  return true;
}

/// Eight rows around a point near the curve.
bool LineTracer::evaluateAround(const Eigen::Vector2f& px, std::array<Quad, 2>* quads) const {
  Front front;
  front.position = px.cast<double>();
  const RaySample sample = rays_.at(front.position.x(), front.position.y());
  const Eigen::Vector2d g(sample.du.dot(normal_), sample.dv.dot(normal_));
  const int a = std::abs(g.x()) >= std::abs(g.y()) ? 0 : 1;
  if (!(std::abs(g[a]) > 0)) return false;
  front.position[a] -= sample.ray.dot(normal_) / g[a];
  front.position[1 - a] -= 4;
  front.position[a] += 4 * g[1 - a] / g[a];
  return evaluate(&front, +1, quads);
}

/// How edges are judged of which nothing is known yet.
void LineTracer::forgetEdge() {
  wide_ = false;
  bound_px_ = widest_px_ = 1.5F;  // chains are whole pixels
  drift_px_ = 0;
  offset_gain_ = 1;
}

void LineTracer::measureBlur(const std::vector<PlanarPiece>& pieces,
                             const std::vector<Eigen::Vector2f>& nodes) {
  constexpr size_t kMaxPieces = 128;
  constexpr float kLeastSigmas = 20;   // of the level: the ratio of levels is good to 5 %
  constexpr float kMostApart = 0.15F;  // px between what the two filters see
  constexpr size_t kPrior = 3;
  std::array<double, kMaxPieces + kPrior> found;
  found.fill(kUsualVariance);
  size_t count = kPrior;
  forgetEdge();
  const size_t stride = pieces.size() / kMaxPieces + 1;
  for (size_t i = 0; i < pieces.size(); i += stride) {
    const PlanarPiece& piece = pieces[i];
    normal_ = piece.normal;
    std::array<Quad, 2> pair;
    if (!evaluateAround(nodes[piece.first_node + piece.nodes / 2], &pair)) continue;
    if (!pair[0].is_edge || !pair[1].is_edge) continue;
    const EdgeResponse &a = pair[0].mean, &b = pair[1].mean;
    const float level = a.odd_narrow + b.odd_narrow, wide_level = a.odd_wide + b.odd_wide;
    if (!(std::abs(level) >= kLeastSigmas * std::max(noise_.odd_narrow, noise_.odd_wide)) ||
        !(a.odd_narrow * b.odd_narrow > 0)) {
      continue;
    }
    const float apart =
        (a.even_wide + b.even_wide) / wide_level - (a.even_narrow + b.even_narrow) / level;
    if (!(std::abs(apart) <= kMostApart)) continue;
    const auto ratio = static_cast<double>(level / wide_level);
    if (!(ratio <= profiler_.sharpestRatio() && ratio >= profiler_.softestRatio())) continue;
    const auto across = static_cast<double>(pair[0].perpendicular);
    found[count++] = profiler_.blurVariance(ratio) * across * across;
  }
  const auto middle = found.begin() + static_cast<ptrdiff_t>(count / 2);
  std::nth_element(found.begin(), middle, found.begin() + static_cast<ptrdiff_t>(count));
  blur_px2_ = *middle;
}

void LineTracer::judge(Quad* quad) const {
  const float odd = wide_ ? quad->mean.odd_wide : quad->mean.odd_narrow;
  const float even = wide_ ? quad->mean.even_wide : quad->mean.even_narrow;
  const float noise = wide_ ? noise_.even_wide : noise_.even_narrow;
  const float gain = wide_ ? 1 : offset_gain_;
  // The offset's change from row to row, by least squares, scatters 2 / sqrt(5) as much as the
  // mean.
  constexpr float kTurnScatter = 0.894F;
  const float turn = std::abs(quad->turn) * quad->perpendicular * quad->perpendicular;
  const float distance = gain * even * sideOf(*quad);  // times odd
  quad->drift_px = drift_px_;
  quad->is_edge = std::abs(odd) >= (wide_ ? min_odd_wide_ : min_odd_narrow_) &&
                  std::abs(distance - drift_px_ * odd) <= bound_px_ * std::abs(odd) &&
                  std::abs(distance) <= widest_px_ * std::abs(odd) &&
                  turn <= kMaxTangent * std::abs(odd) + 2 * kTurnScatter * noise &&
                  std::abs(quad->mean.odd_wide) <=
                      kMaxWideRatio * std::abs(quad->mean.odd_narrow) + 2 * noise_.odd_wide;
  quad->offset_px = quad->is_edge ? gain * even / odd : 0;
  quad->variance_px2 = quad->is_edge ? noise * noise / (odd * odd) + kModelVariance : 0;
}

/// Distance towards the normal per px across.
float LineTracer::sideOf(const Quad& quad) const {
  return quad.across.dot(normal_) < 0 ? -quad.perpendicular : quad.perpendicular;
}

void LineTracer::add(const Quad& quad) {
  if (!quad.is_edge) return;
  const Eigen::Vector3d ray = quad.ray + static_cast<double>(quad.offset_px) * quad.across;
  const double rad_per_px = quad.across.dot(normal_);
  const double variance = rad_per_px * rad_per_px * static_cast<double>(quad.variance_px2);
  moments_.add(ray, 1 / variance);
  ++points_;
}

bool LineTracer::refit() {
  const auto normal = refinePlane(moments_, normal_);
  if (!normal) return false;
  normal_ = *normal;
  points_at_fit_ = points_;
  return true;
}

void LineTracer::extend(int direction, Front* front) {
  int misses = 0;
  drift_px_ = 0;
  std::array<Quad, 2> next;
  Eigen::Vector3d last_ray = quads_.empty() ? Eigen::Vector3d::Zero() : quads_.back().ray;
  while (!front->ended) {
    // The walk goes along the tangent; which way that is along the rows changes with them.
    int way = direction;
    if (!quads_.empty()) {
      const Quad& last = quads_.back();
      way = last.way;
      if (!front->has_slope && !orient(front)) {
        front->ended = front->at_border = true;
        break;
      }
      if (front->crosses_rows != last.crosses_rows) {
        // Rows become columns, or the other way round.
        way = last.slope * static_cast<float>(last.way) > 0 ? 1 : -1;
      }
    }
    if (!evaluate(front, way, &next)) {
      front->ended = front->at_border = true;
      break;
    }
    for (const Quad& q : next) {
      const int x = pixelOf(q.x), y = pixelOf(q.y);
      if (!usable_->contains(x, y)) {
        front->ended = true;
        front->at_border = !seen_->contains(x, y);
        break;
      }
      const double step_rad = last_ray.isZero() ? 0 : (q.ray - last_ray).norm();
      // From centre to centre; the ends reach half a step beyond.
      if (angle_rad_ + 2 * step_rad > (DLSD_MUTANT("half-turn") ? 4 : kMaxAngleRad)) {
        front->ended = front->at_limit = true;
        break;
      }
      angle_rad_ += step_rad;
      last_ray = q.ray;
      quads_.push_back(q);
      if (q.is_edge) {
        misses = 0;
        drift_px_ += drift_rate_ * (q.offset_px * sideOf(q) - drift_px_);
        add(q);
      } else if (++misses * kQuadPx > options_.max_gap_px) {
        front->ended = true;
        break;
      }
    }
    if (points_ >= points_at_fit_ + std::max(4, points_at_fit_ / 2) && !refit()) {
      front->ended = true;
    }
  }
}

/// How many quads from `tip` on, which is at an end of the line, don't belong to it: gaps, and runs
/// of one sign and strength too short to be believed. What is much fainter or stronger than the
/// line is mostly some other edge, that the curve happens to meet.
template <class Iterator>
ptrdiff_t LineTracer::looseQuads(Iterator tip, Iterator other_end) const {
  // Towards the normal: where rows become columns, a response may change its sign.
  const auto levelOf = [&](const Quad& q) {
    const float odd = wide_ ? q.mean.odd_wide : q.mean.odd_narrow;
    return sideOf(q) < 0 && !DLSD_MUTANT("level-side") ? -odd : odd;
  };
  float level = 0, balance = 0;
  int edges = 0;
  for (Iterator q = tip; q != other_end; ++q) {
    if (!q->is_edge) continue;
    level += std::abs(levelOf(*q));
    balance += levelOf(*q);
    ++edges;
  }
  level /= static_cast<float>(std::max(edges, 1));
  const auto differs = [&](float l) {
    return std::abs(l) < kFaintLevel * level || kFaintLevel * std::abs(l) > level;
  };
  Iterator at = tip;
  ptrdiff_t shared = 0;  // quads before `at` of which the line may hold a part
  for (;;) {
    while (at != other_end && !at->is_edge) {
      ++at;
      shared = 0;
    }
    if (at == other_end) return at - tip;
    const bool differs_here = differs(levelOf(*at));
    const bool rises = levelOf(*at) > 0;
    const int min_run_px = differs_here && !DLSD_MUTANT("strange-runs") ? kMinStrangeRunPx
                           : (balance > 0) == rises                     ? kMinRunPx
                                                                        : kMinFlippedRunPx;
    Iterator behind = at;
    int run_px = 0;
    while (behind != other_end && behind->is_edge && run_px < min_run_px &&
           differs(levelOf(*behind)) == differs_here && (levelOf(*behind) > 0) == rises) {
      run_px += kQuadPx;
      ++behind;
    }
    if (behind == other_end || run_px >= min_run_px) return at - tip - shared;
    shared = behind->is_edge && (levelOf(*behind) > 0) == rises ? 1 : 0;
    at = behind;
  }
}

/// Cuts the ends, which then are not at the border any more. False if too little remains.
bool LineTracer::cutEnds(Front* front, Front* back) {
  const ptrdiff_t behind = looseQuads(quads_.rbegin(), quads_.rend());
  quads_.resize(quads_.size() - static_cast<size_t>(behind));
  const ptrdiff_t before = looseQuads(quads_.begin(), quads_.end());
  quads_.erase(quads_.begin(), quads_.begin() + before);
  front->at_border = front->at_border && behind == 0;
  back->at_border = back->at_border && before == 0;
  return quads_.size() >= kMinQuads;
}

/// Residuals of an arc of radius r and length l against its best plane are a parabola of height
/// (sagitta) l^2 / (8 r), which is fitted here. A quad at an end that a corner moves looks the same
/// on a short line: where the quads between the ends say so, they alone must bend, too.
bool LineTracer::isArc(const Eigen::Vector3d& normal) const {
  // What the filters leave of edges without noise, and what corners move by more than that.
  constexpr double kFloorPx = 0.06, kMovedPx2 = 0.15 * 0.15;
  constexpr size_t kMinWithInside = 7;  // two ends, and five between them
  const size_t size = quads_.size();
  if (size < 4) return false;
  const double half_length = 0.5 * static_cast<double>(size - 1);
  double length_px = 0;  // from the middle of the first to that of the last
  for (size_t i = 1; i < size; ++i) {
    length_px += kQuadPx / static_cast<double>(quads_[i].perpendicular);
  }

  // t^2, with t from -1 to 1 along the whole line, and the residual in px.
  const auto place = [&](size_t i) {
    const Quad& s = quads_[i];
    const double t = static_cast<double>(i) / half_length - 1;
    const Eigen::Vector3d ray = s.ray + static_cast<double>(s.offset_px) * s.across;
    return Eigen::Vector2d(
        t * t, ray.dot(normal) / s.across.dot(normal) * static_cast<double>(s.perpendicular));
  };
  struct Parabola {  ///< level + height t^2
    double level_px, height_px, sigma_px;
  };
  const auto fit = [&](size_t begin, size_t end) -> std::optional<Parabola> {
    double n = 0, sum_r = 0, sum_q = 0, sum_qq = 0, sum_qr = 0, sum_rr = 0, noise = 0;
    for (size_t i = begin; i < end; ++i) {
      if (!quads_[i].is_edge) continue;
      const Eigen::Vector2d at = place(i);
      const double q = at.x(), r = at.y();
      n += 1;
      sum_r += r;
      sum_q += q;
      sum_qq += q * q;
      sum_qr += q * r;
      sum_rr += r * r;
      noise += static_cast<double>(quads_[i].variance_px2);
    }
    if (n < 4) return std::nullopt;
    const double qq = sum_qq - sum_q * sum_q / n;
    const double qr = sum_qr - sum_q * sum_r / n;
    const double rr = sum_rr - sum_r * sum_r / n;
    if (!(qq > 0)) return std::nullopt;
    const double variance = std::max(noise / n, std::max(0.0, rr - qr * qr / qq) / (n - 3));
    return Parabola{(sum_r - qr / qq * sum_q) / n, qr / qq, std::sqrt(variance / qq)};
  };
  const auto bends = [&](size_t begin, size_t end) {
    const auto parabola = fit(begin, end);
    if (!parabola) return false;
    const double share = static_cast<double>(end - begin - 1) / static_cast<double>(size - 1);
    const double sagitta_px = std::abs(parabola->height_px);
    const double half_px = length_px / 2;
    return sagitta_px * share * share > kFloorPx + 2.5 * parabola->sigma_px * share * share &&
           half_px * half_px < 2 * sagitta_px * options_.min_bend_radius_px;
  };
  if (!bends(0, size)) return false;
  if (size < kMinWithInside || DLSD_MUTANT("arc-ends")) return true;
  const auto inside = fit(1, size - 1);
  if (!inside) return true;
  const auto isMoved = [&](size_t i) {
    if (!quads_[i].is_edge) return false;
    const Eigen::Vector2d at = place(i);
    const double off_px = at.y() - inside->level_px - inside->height_px * at.x();
    return off_px * off_px > std::max(9 * static_cast<double>(quads_[i].variance_px2), kMovedPx2);
  };
  const size_t begin = isMoved(0) ? 1 : 0;
  const size_t end = isMoved(size - 1) ? size - 1 : size;
  return end - begin == size || bends(begin, end);
}

/// Under the background model, noise of the measured level alone, the squares of the responses add
/// up to a chi-square with a degree of freedom per four rows (fewer: neighbours are correlated if
/// the noise is). Its tail is bounded by Chernoff. One row of noise can't speak for many: a
/// response counts as kMaxSigmas at most. Tests: every pair of pixels as ends.
double LineTracer::scoreOf() const {
  constexpr double kCorrelated = 1.5, kMaxSigmas = 6;
  // Shading is subtracted as far as the line as a whole shows it.
  const auto narrow_ramp = static_cast<double>(profiler_.shading().odd_narrow);
  const auto wide_ramp = static_cast<double>(profiler_.shading().odd_wide);
  double narrow = 0, wide = 0;
  for (const Quad& q : quads_) {
    narrow += std::abs(static_cast<double>(q.mean.odd_narrow));
    wide += std::abs(static_cast<double>(q.mean.odd_wide));
  }
  const double count = static_cast<double>(quads_.size());
  const double ramp = std::max(0.0, wide - narrow) / (wide_ramp - narrow_ramp) / count;
  const double shading = ramp * (wide_ ? wide_ramp : narrow_ramp);
  const double sigma = static_cast<double>(wide_ ? noise_.odd_wide : noise_.odd_narrow);
  double n = 0, sum = 0;
  for (const Quad& q : quads_) {
    const double odd = std::abs(static_cast<double>(wide_ ? q.mean.odd_wide : q.mean.odd_narrow));
    const double t = std::max(0.0, odd - shading) / sigma;
    n += 1;
    if (q.is_edge) sum += std::min(t * t, kMaxSigmas * kMaxSigmas);
  }
  const double pixels = static_cast<double>(pixels_.width) * pixels_.height;
  const double log_tests = 2 * std::log10(pixels);
  if (!(sum > n)) return -log_tests;
  return (sum - n - n * std::log(sum / n)) / (2 * kCorrelated * std::log(10.0)) - log_tests;
}

/// Mean response around the end of the line at quad `last`; `first` is at the other one.
double LineTracer::levelAt(size_t first, size_t last, bool wide) const {
  double level = 0;
  int count = 0;
  const ptrdiff_t back = first < last ? -1 : 1;
  for (auto i = static_cast<ptrdiff_t>(last); count < 3; i += back) {
    const Quad& k = quads_[static_cast<size_t>(i)];
    if (k.is_edge) {
      level += std::abs(static_cast<double>(wide ? k.mean.odd_wide : k.mean.odd_narrow));
      ++count;
    }
    if (i == static_cast<ptrdiff_t>(first)) break;
  }
  return level / count;
}

/// How many rows of the last quad belong to the line (the first if it is the other one's turn),
/// counted from within: the cut that fits best to an edge before and nothing behind.
int LineTracer::rowsOfEnd(size_t first, size_t last) const {
  const Quad& q = quads_[last];
  const double level = levelAt(first, last, wide_);
  const double sign = (wide_ ? q.mean.odd_wide : q.mean.odd_narrow) < 0 ? -1 : 1;
  double best = 0, sum = 0;
  int rows = 0;
  for (int i = 0; i < kQuadPx; ++i) {
    const size_t row = static_cast<size_t>(first < last ? i : kQuadPx - 1 - i);
    sum += sign * static_cast<double>(q.odd[row]) - 0.5 * level;
    if (sum >= best) {
      best = sum;
      rows = i + 1;
    }
  }
  return rows;
}

/// Of the nearest pixel of a position in the image.
double LineTracer::greyAt(const Eigen::Vector2d& px) const {
  const ptrdiff_t at =
      pixelOf(static_cast<float>(px.y())) * pixels_.stride + pixelOf(static_cast<float>(px.x()));
  return pixels_.u8 != nullptr ? static_cast<double>(pixels_.u8[at])
                               : static_cast<double>(pixels_.fixed[at]) / kGreyUnit;
}

/// The end of the line at quad `last`; `first` is at the other one.
LineTracer::End LineTracer::endOf(size_t first, size_t last, bool at_border) const {
  const Quad& q = quads_[last];
  const int direction = first < last ? 1 : -1;
  const int rows_of_end = rowsOfEnd(first, last);
  at_border = at_border && 2 * rows_of_end > kQuadPx;
  const double rows = at_border ? kQuadPx : rows_of_end;
  const int a = q.crosses_rows ? 0 : 1;
  Eigen::Vector2d px(static_cast<double>(q.x), static_cast<double>(q.y));
  const double ahead = direction * q.way * (rows - 2);
  px[1 - a] += ahead;
  px[a] += ahead * static_cast<double>(q.slope);
  if (!rays_.covers(px.x(), px.y())) px = {static_cast<double>(q.x), static_cast<double>(q.y)};
  End end{px, rays_.at(px.x(), px.y()).ray};
  if (!at_border) return end;
  // Which filters can't see any more: as far as pixels beside the curve differ like those before.
  constexpr double kBesidePx = 1.5, kRimBlurPx = 2, kLeastShare = 0.35;
  constexpr int kMaxUnseen = 6;
  const double level = levelAt(first, last, false);
  const bool rises = q.mean.odd_narrow > 0;
  const double beside = kBesidePx / static_cast<double>(q.perpendicular);
  const int way = direction * q.way;
  double best = 0, sum = 0;
  int unseen = 0;
  for (int i = 0; i < options_.max_gap_px + kQuadPx; ++i) {
    const RaySample here = rays_.at(px.x(), px.y());
    const Eigen::Vector2d g(here.du.dot(normal_), here.dv.dot(normal_));
    if (!(std::abs(g[a]) > 0)) break;
    const double f = here.ray.dot(normal_);
    const Eigen::Vector2d before = px;
    px[a] -= f / g[a] + way * g[1 - a] / g[a];
    px[1 - a] += way;
    if (!rays_.covers(px.x(), px.y())) break;
    const Eigen::Vector2d middle = 0.5 * (before + px);
    const auto isClear = [&](double distance) {
      Eigen::Vector2d at = middle;
      at[a] = std::clamp(at[a] + distance, 0.0, (a == 0 ? pixels_.width : pixels_.height) - 1.0);
      return rays_.covers(at.x(), at.y());
    };
    const auto besideAt = [&](double distance) {
      Eigen::Vector2d at = middle;
      at[a] += distance;
      return at;
    };
    const Eigen::Vector2d low = besideAt(-beside), high = besideAt(beside);
    if (rays_.camera().inImage(low) && rays_.camera().inImage(high) &&
        isClear(-beside - kRimBlurPx) && isClear(beside + kRimBlurPx)) {
      const double step = greyAt(high) - greyAt(low);
      sum += (rises ? step : -step) - kLeastShare * level;
    } else if (++unseen > kMaxUnseen) {
      break;
    }
    if (sum >= best || DLSD_MUTANT("border-evidence")) {
      best = sum;
      end = {px, rays_.at(px.x(), px.y()).ray};
    }
  }
  return end;
}

/// The sides of a thin bar push each other apart: back to where they are, by what the responses
/// around each quad show.
void LineTracer::moveBarSides() {
  // For so many quads at a time, from them and as many on both sides together.
  constexpr size_t kBlock = 3;
  constexpr float kShare = 0.15F;  // of the shift, what may be wrong with it
  for (size_t begin = 0; begin < quads_.size(); begin += kBlock) {
    const size_t end = std::min(quads_.size(), begin + kBlock);
    const Quad& middle = quads_[(begin + end) / 2];
    EdgeResponse sum{};
    int count = 0;
    for (size_t k = begin - std::min(begin, kBlock); k < std::min(quads_.size(), end + kBlock);
         ++k) {
      const Quad& q = quads_[k];
      if (!q.is_edge || q.crosses_rows != middle.crosses_rows) continue;
      // Where the polarity changes, all four turn round.
      const float sign = q.mean.odd_narrow < 0 ? -1 : 1;
      sum.odd_narrow += sign * q.mean.odd_narrow;
      sum.even_narrow += sign * q.mean.even_narrow;
      sum.odd_wide += sign * q.mean.odd_wide;
      sum.even_wide += sign * q.mean.even_wide;
      ++count;
    }
    if (!(sum.odd_narrow > 0)) continue;
    const auto narrow = static_cast<double>(sum.odd_narrow);
    const double odd_ratio = static_cast<double>(sum.odd_wide) / narrow;
    // Where the narrow filters see the edge, which may be beside the curve.
    const double even_ratio =
        (static_cast<double>(sum.even_wide) - static_cast<double>(sum.even_narrow) * odd_ratio) /
        narrow;
    const auto across = static_cast<double>(middle.perpendicular);
    const auto shift_px =
        bars_.shiftPx(blur_px2_ / (across * across), odd_ratio, std::abs(even_ratio));
    if (!shift_px) continue;
    // An edge of another blur than assumed looks like a bar that is hardly there, as does noise.
    constexpr double kLeastEven = 0.1, kFadeEven = 0.2, kSigmas = 3;
    const double sigma = static_cast<double>(noise_.even_wide) * std::sqrt(count) / narrow;
    const double beyond = std::abs(even_ratio) - std::max(kLeastEven, kSigmas * sigma);
    const double fade = std::clamp(beyond / kFadeEven, 0.0, 1.0);
    const auto shift = static_cast<float>(std::copysign(fade * *shift_px, -even_ratio));
    for (size_t k = begin; k < end; ++k) {
      // Across columns it would be another direction.
      if (quads_[k].crosses_rows != middle.crosses_rows) continue;
      quads_[k].offset_px += shift;
      quads_[k].variance_px2 += kShare * kShare * shift * shift;
    }
  }
}

/// Offsets for the last fit: with the gain that belongs to the edge's own blur; from the wide
/// filters where the edge stands alone, which scatter less; measured again if the curve has moved
/// far.
void LineTracer::refine() {
  double narrow = 0, wide = 0, stretch = 0;
  int count = 0;
  for (const Quad& q : quads_) {
    if (!q.is_edge) continue;
    narrow += narrowLevel(q.mean);
    wide += std::abs(static_cast<double>(q.mean.odd_wide));
    stretch += 1 / static_cast<double>(q.perpendicular * q.perpendicular);
    ++count;
  }
  if (count < 2) return;
  stretch /= count;
  // The blur along rows is that across the edge, stretched.
  const double tolerance = 3 * static_cast<double>(noise_.odd_narrow) * std::sqrt(count);
  bool alone = narrow <= profiler_.sharpestRatio() * wide + tolerance &&
               narrow >= profiler_.softestRatio() * wide - tolerance;
  const double row_variance =
      alone ? profiler_.blurVariance(narrow / wide) : kUsualVariance * stretch;
  struct Sums {
    double w = 0, t = 0, tt = 0, d = 0, td = 0;
  } sums;
  size_t index = 0;
  int differing = 0;
  constexpr float kModelDifference = 0.02F;
  const auto half = 0.5 * static_cast<double>(quads_.size() - 1);
  const auto wideOffset = [&](const Quad& q, const StepGain& gain) {
    return gain.wide * q.mean.even_wide / q.mean.odd_wide;
  };
  // In steps of kSlant, one after the other mostly the same.
  constexpr float kSlant = 1.0F / 64;
  int slant = 0;
  StepGain slant_gain{};
  const auto gainOf = [&](const Quad& q) {
    const int its_slant = static_cast<int>(q.perpendicular * (1 / kSlant) + 0.5F);
    if (its_slant != slant) {
      slant = its_slant;
      const double p = static_cast<double>(kSlant) * slant;
      slant_gain = profiler_.gain(row_variance / stretch / (p * p));
    }
    return slant_gain;
  };
  const auto sigmaOf = [](float gain, float noise, float level) {
    return gain * noise / std::abs(level);
  };
  for (Quad& q : quads_) {
    const double t = static_cast<double>(index++) / half - 1;
    if (!q.is_edge) continue;
    const StepGain gain = gainOf(q);
    q.offset_px = gain.narrow * q.mean.even_narrow / q.mean.odd_narrow;
    const float sigma = sigmaOf(gain.narrow, noise_.even_narrow, q.mean.odd_narrow);
    q.variance_px2 = sigma * sigma + kModelVariance;
    const float scatter = static_cast<float>(options_.max_residual_sigmas) * sigma;
    const float distance = q.offset_px * sideOf(q);
    q.is_edge = std::isfinite(sigma) &&
                std::abs(distance - q.drift_px) <= std::max(bound_px_, scatter) &&
                std::abs(distance) <= std::max(widest_px_, scatter);
    if (!q.is_edge || !alone) continue;
    const float wide_sigma = sigmaOf(gain.wide, noise_.even_wide, q.mean.odd_wide);
    const float variance = std::max(0.0F, sigma * sigma - wide_sigma * wide_sigma) +
                           kModelDifference * kModelDifference;
    const float difference = wideOffset(q, gain) - q.offset_px;
    differing += difference * difference > 9 * variance;
    const double w = 1 / static_cast<double>(variance), d = static_cast<double>(difference);
    sums.w += w;
    sums.t += w * t;
    sums.tt += w * t * t;
    sums.d += w * d;
    sums.td += w * t * d;
  }
  alone = alone && sums.w > 0;
  // Neighbours move what the wider filter sees, as a whole or more and more along the line.
  constexpr double kSigmas2 = 9;
  const double trend2 = sums.tt - sums.t * sums.t / sums.w;
  const double trend = sums.td - sums.t * sums.d / sums.w;
  if (!alone || sums.d * sums.d > kSigmas2 * sums.w || trend * trend > kSigmas2 * trend2 ||
      10 * differing > count) {
    moveBarSides();
    return;
  }
  for (Quad& q : quads_) {
    if (!q.is_edge) continue;
    const StepGain gain = gainOf(q);
    const float offset = wideOffset(q, gain);
    const float sigma = sigmaOf(gain.wide, noise_.even_wide, q.mean.odd_wide);
    const float variance = sigma * sigma + kModelVariance;
    const float difference = offset - q.offset_px;
    if (difference * difference > 9 * q.variance_px2 || !(variance < q.variance_px2)) continue;
    q.offset_px = offset;
    q.variance_px2 = variance;
  }
}

std::optional<TracedLine> LineTracer::trace(const PlanarPiece& piece,
                                            const std::vector<Eigen::Vector2f>& nodes) {
  normal_ = piece.normal;
  moments_ = {};
  points_ = points_at_fit_ = 0;
  angle_rad_ = 0;
  forgetEdge();

  // The plane of the piece from a few of its rows: more of them if they scatter.
  constexpr uint32_t kProbes = 3;
  std::array<Quad, 2> pair;
  std::array<Quad, 2 * 2 * kProbes> probed;
  size_t count = 0;
  double level = 0, wide_level = 0;
  const auto probe = [&](uint32_t node) {
    if (!evaluateAround(nodes[piece.first_node + node], &pair)) return;
    for (const Quad& q : pair) {
      if (!q.is_edge) continue;
      probed[count++] = q;
      level += narrowLevel(q.mean);
      wide_level += std::abs(static_cast<double>(q.mean.odd_wide));
    }
  };
  const uint32_t probes = piece.nodes < 5 ? 2 : kProbes;
  for (uint32_t i = 0; i < probes; ++i) probe((2 * i + 1) * piece.nodes / (2 * probes));
  const auto narrowSigmaPx = [&] {
    return static_cast<double>(count) * static_cast<double>(noise_.even_narrow) / level;
  };
  if (piece.nodes >= 2 * kProbes && !(narrowSigmaPx() <= kMaxNarrowSigmaPx)) {
    for (uint32_t i = 0; i < kProbes; ++i) probe(i * piece.nodes / kProbes);
  }
  if (count < 2) return std::nullopt;
  // Of an edge sharper than the filters expect, offsets are smaller than they seem.
  offset_gain_ = std::min(1.0F, profiler_.gain(profiler_.blurVariance(level / wide_level)).narrow);
  for (size_t i = 0; i < count; ++i) {
    probed[i].offset_px *= offset_gain_;
    add(probed[i]);
  }
  if (!refit()) return std::nullopt;
  const double wide_tolerance =
      3 * static_cast<double>(noise_.odd_wide) * std::sqrt(static_cast<double>(count));
  if (wide_level > static_cast<double>(kMaxWideRatio) * level + wide_tolerance) return std::nullopt;
  const double tolerance = 2 * static_cast<double>(noise_.odd_narrow) * std::sqrt(points_);
  const bool stands_alone = wide_level >= kAloneRatio[0] * level - tolerance &&
                            wide_level <= kAloneRatio[1] * level + tolerance;
  const double narrow_sigma_px = narrowSigmaPx();
  const double wide_sigma_px =
      static_cast<double>(count) * static_cast<double>(noise_.even_wide) / level;
  wide_ = narrow_sigma_px > kMaxNarrowSigmaPx && stands_alone;
  bound_px_ = static_cast<float>(
      std::clamp(options_.max_residual_sigmas * (wide_ ? wide_sigma_px : narrow_sigma_px),
                 options_.tight_rho_px,
                 options_.rho_px));
  // Where noise makes the bound, there is no drift to be seen.
  const bool is_clear = static_cast<double>(bound_px_) <= options_.tight_rho_px;
  drift_rate_ = is_clear ? kDriftRate : 0;
  widest_px_ = is_clear ? static_cast<float>(options_.rho_px) : bound_px_;

  moments_ = {};
  points_ = points_at_fit_ = 0;
  quads_.clear();
  const Eigen::Vector2d start = piece.start_px;
  const RaySample sample = rays_.at(start.x(), start.y());
  const Eigen::Vector2d g(sample.du.dot(normal_), sample.dv.dot(normal_));
  if (!(g.norm() > 0)) return std::nullopt;
  const double f = sample.ray.dot(normal_) / g.norm();
  if (!(std::abs(f) < 3)) return std::nullopt;
  Front front;
  front.position = start - f * g.normalized();
  Front back = front;
  points_at_fit_ = 8;
  extend(-1, &back);
  const auto loose = static_cast<size_t>(looseQuads(quads_.rbegin(), quads_.rend()));
  quads_.resize(quads_.size() - loose);
  back.at_border = back.at_border && loose == 0;
  std::reverse(quads_.begin(), quads_.end());
  for (Quad& q : quads_) {
    q.way = static_cast<int8_t>(-q.way);
    std::reverse(q.odd.begin(), q.odd.end());
  }
  // From the same border between rows, the other way.
  extend(+1, &front);
  if (points_ < 2 || !refit()) return std::nullopt;
  // Then the other end is not taken on to the border, either.
  if (front.at_limit || back.at_limit) front.at_border = back.at_border = false;
  if (!cutEnds(&front, &back)) return std::nullopt;

  double narrow = 0, wide = 0;
  for (const Quad& q : quads_) {
    narrow += std::abs(static_cast<double>(q.mean.odd_narrow));
    wide += std::abs(static_cast<double>(q.mean.odd_wide));
  }
  if (!(wide <= static_cast<double>(kMaxWideRatio) * narrow)) return std::nullopt;
  TracedLine line{};
  line.score = scoreOf();
  line.contrast = narrow / static_cast<double>(quads_.size());
  if (!(line.score >= options_.min_score)) return std::nullopt;
  refine();
  if (!cutEnds(&front, &back)) return std::nullopt;

  // Near its ends an edge meets others, which move it: a line that has enough points is fitted
  // without, and then again with what agrees. Where the end turns away, another edge begins.
  constexpr size_t kEnoughQuads = 7;
  constexpr double kStrayPx2 = 0.35 * 0.35;
  size_t last = 0, begin = 0, end = 0;
  std::optional<PlaneFit> fit;
  for (int pass = 0; pass < 2; ++pass) {
    last = quads_.size() - 1;
    begin = 0;
    end = quads_.size();
    if (end >= kEnoughQuads) {
      begin = rowsOfEnd(last, 0) > 2 ? 1 : 2;
      end -= rowsOfEnd(0, last) > 2 ? 1 : 2;
    }
    moments_ = {};
    points_ = 0;
    for (size_t i = begin; i < end; ++i) add(quads_[i]);
    if (points_ < 2) return std::nullopt;
    fit = fitPlane(moments_);
    if (!fit) return std::nullopt;
    // Of the whole: without its ends an arc may pass for a line.
    line.is_arc = line.is_arc || (options_.min_bend_radius_px > 0 && isArc(fit->normal));
    if (pass == 1) break;
    const auto strays = [&](const Quad& q) {
      const Eigen::Vector3d ray = q.ray + static_cast<double>(q.offset_px) * q.across;
      const double across_px = ray.dot(fit->normal) / q.across.dot(fit->normal);
      return across_px * across_px > std::max(9 * static_cast<double>(q.variance_px2), kStrayPx2);
    };
    const size_t size = quads_.size();
    while (quads_.size() > 4 && strays(quads_.back())) {
      quads_.pop_back();
      front.at_border = false;
    }
    size_t cut_off = 0;
    while (quads_.size() > 4 + cut_off && strays(quads_[cut_off])) ++cut_off;
    if (cut_off > 0) {
      quads_.erase(quads_.begin(), quads_.begin() + static_cast<ptrdiff_t>(cut_off));
      back.at_border = false;
    }
    if (quads_.size() == size) break;
    if (!cutEnds(&front, &back)) return std::nullopt;
  }
  const auto agrees = [&](const Quad& q, bool is_whole) {
    const Eigen::Vector3d ray = q.ray + static_cast<double>(q.offset_px) * q.across;
    const double across_px = ray.dot(fit->normal) / q.across.dot(fit->normal);
    return q.is_edge && is_whole &&
           across_px * across_px <= 4 * static_cast<double>(q.variance_px2);
  };
  const int points = points_;
  while (begin > 0 && agrees(quads_[begin - 1], begin > 1 || rowsOfEnd(last, 0) == kQuadPx)) {
    add(quads_[--begin]);
  }
  while (end <= last && agrees(quads_[end], end < last || rowsOfEnd(0, last) == kQuadPx)) {
    add(quads_[end++]);
  }
  if (points_ > points) fit = fitPlane(moments_);
  if (!fit) return std::nullopt;
  normal_ = normal_.dot(fit->normal) < 0 ? Eigen::Vector3d(-fit->normal) : fit->normal;

  line.fit = *fit;
  double sum2 = 0, chi2 = 0, side = 0;
  line.max_px = 0;
  line.length_px = 0;
  for (size_t i = 0; i < quads_.size(); ++i) {
    const Quad& q = quads_[i];
    if (i > 0) {
      const auto dx = static_cast<double>(q.x - quads_[i - 1].x);
      const auto dy = static_cast<double>(q.y - quads_[i - 1].y);
      line.length_px += std::sqrt(dx * dx + dy * dy);
    }
    if (!q.is_edge || i < begin || i >= end) continue;
    const double rad_per_px = q.across.dot(fit->normal);
    const Eigen::Vector3d ray = q.ray + static_cast<double>(q.offset_px) * q.across;
    const double across_px = ray.dot(fit->normal) / rad_per_px;
    const double err_px = std::abs(across_px) * static_cast<double>(q.perpendicular);
    sum2 += err_px * err_px;
    chi2 += across_px * across_px / static_cast<double>(q.variance_px2);
    line.max_px = std::max(line.max_px, err_px);
    side += static_cast<double>(q.mean.odd_narrow) * rad_per_px > 0 ? 1 : -1;
  }
  line.rms_px = std::sqrt(sum2 / points_);
  // Few residuals say little: the measured noise counts as kPriorPoints of them.
  constexpr double kPriorPoints = 4;
  line.variance_factor = (chi2 + kPriorPoints) / (points_ - 2 + kPriorPoints);
  line.polarity = side < 0 ? -1 : 1;
  const End from = endOf(last, 0, back.at_border);
  const End to = endOf(0, last, front.at_border);
  // Each part of the curve is near a usable pixel.
  line.is_inside = !back.at_border && !front.at_border;
  line.from_ray = from.ray;
  line.to_ray = to.ray;
  line.middle_ray = quads_[quads_.size() / 2].ray;
  const auto centre = [](const Quad& q) {
    return Eigen::Vector2d(static_cast<double>(q.x), static_cast<double>(q.y));
  };
  const auto beyond = [&](const End& tip, size_t here, size_t before) {
    const Eigen::Vector2d d = tip.px - centre(quads_[here]);
    return d.dot(centre(quads_[here]) - centre(quads_[before])) < 0 ? -d.norm() : d.norm();
  };
  line.length_px += beyond(from, 0, 1) + beyond(to, last, last - 1);
  if (!(line.length_px >= options_.min_length_px)) return std::nullopt;
  return line;
}

}  // namespace dlsd
