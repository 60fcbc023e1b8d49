#include "evaluation/structural_ap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "cameras/mutant.h"
#include "synth/dataset/statistics.h"

namespace dlsd {

using Eigen::Vector2d;

namespace {

void scale(StructuralCurve& curve, int width, int height) {
  for (Vector2d& point : curve) {
    point.x() *= kStructuralSizePx / width;
    point.y() *= kStructuralSizePx / height;
  }
}

}  // namespace

StructuralCurve structuralCurve(const std::vector<Vector2d>& polyline, int width, int height) {
  StructuralCurve curve;
  const std::vector<Vector2d> points = equalArcPoints(polyline, kStructuralPoints);
  std::copy(points.begin(), points.end(), curve.begin());
  scale(curve, width, height);
  return curve;
}

StructuralCurve structuralCurveOfBezier(std::span<const Vector2d> points, int width, int height) {
  StructuralCurve curve;
  for (size_t k = 0; k < kStructuralPoints; ++k) {
    curve[k] = interpolatingBezier(points, double(k) / double(kStructuralPoints - 1));
  }
  scale(curve, width, height);
  return curve;
}

Vector2d interpolatingBezier(std::span<const Vector2d> points, double t) {
  // A Bezier curve of order n is a polynomial of degree n, and there is one through n + 1 points:
  // Lagrange's form of it needs no control points.
  const auto order = double(points.size() - 1);
  Vector2d sum = Vector2d::Zero();
  for (size_t i = 0; i < points.size(); ++i) {
    double weight = 1;
    for (size_t j = 0; j < points.size(); ++j) {
      if (j != i) {
        weight *= (t * order - double(j)) / (double(i) - double(j));
      }
    }
    sum += weight * points[i];
  }
  return sum;
}

double structuralDistance(const StructuralCurve& a, const StructuralCurve& b, bool chord) {
  const size_t step = chord ? kStructuralPoints - 1 : 1;
  double forward = 0, reversed = 0;
  for (size_t k = 0; k < kStructuralPoints; k += step) {
    forward += (a[k] - b[k]).squaredNorm();
    reversed += (a[k] - b[kStructuralPoints - 1 - k]).squaredNorm();
  }
  return (DLSD_MUTANT("ap-direction") ? forward : std::min(forward, reversed)) *
         (chord ? 1 : 2.0 / double(kStructuralPoints));
}

StructuralOutcome matchStructure(const std::vector<StructuralCurve>& labels,
                                 const std::vector<bool>& counts,
                                 const std::vector<StructuralCurve>& detections,
                                 const std::vector<double>& scores,
                                 bool chord) {
  StructuralOutcome outcome;
  outcome.labels = std::count(counts.begin(), counts.end(), true);
  std::vector<size_t> order(detections.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(
      order.begin(), order.end(), [&](size_t a, size_t b) { return scores[a] > scores[b]; });
  std::vector<std::array<bool, kStructuralThresholds.size()>> taken(labels.size());
  for (const size_t d : order) {
    size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < labels.size(); ++i) {
      const double distance = structuralDistance(labels[i], detections[d], chord);
      if (distance < least) {
        least = distance;
        nearest = i;
      }
    }
    StructuralDetection& result = outcome.detections.emplace_back();
    result.score = scores[d];
    for (size_t t = 0; t < kStructuralThresholds.size(); ++t) {
      if (!(least < kStructuralThresholds[t])) {
        continue;
      }
      if (!counts[nearest] && !DLSD_MUTANT("ap-ignored")) {
        result.matches[t] = StructuralMatch::kIgnored;
      } else if (!taken[nearest][t]) {
        taken[nearest][t] = true;
        result.matches[t] = StructuralMatch::kTrue;
      }
    }
  }
  return outcome;
}

StructuralAp::StructuralAp(std::span<const StructuralOutcome> images) {
  for (size_t i = 0; i < images.size(); ++i) {
    labels_.push_back(images[i].labels);
    for (const StructuralDetection& detection : images[i].detections) {
      entries_.push_back({detection.score, i, detection.matches});
    }
  }
  std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.score > b.score;
  });
}

double StructuralAp::averagePrecision(size_t threshold, std::span<const uint8_t> weights) const {
  long total = 0;
  for (size_t i = 0; i < labels_.size(); ++i) {
    total += labels_[i] * (weights.empty() ? 1 : weights[i]);
  }
  if (total == 0) {
    return 0;
  }
  // Precision where recall rises; between two rises it only falls, which the envelope never sees.
  // Detections of one score come in together: their order is chance.
  struct Step {
    double gained, precision;
  };
  std::vector<Step> steps;
  double right = 0, all = 0, gained = 0;
  for (size_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    const double weight = weights.empty() ? 1 : weights[entry.image];
    const StructuralMatch match = entry.matches[threshold];
    all += match == StructuralMatch::kIgnored ? 0 : weight;
    gained += match == StructuralMatch::kTrue ? weight : 0;
    if (gained > 0 && (i + 1 == entries_.size() || entries_[i + 1].score != entry.score)) {
      right += gained;
      steps.push_back({gained, right / all});
      gained = 0;
    }
  }
  double area = 0, envelope = 0;
  for (size_t i = steps.size(); i-- > 0;) {
    envelope =
        DLSD_MUTANT("ap-envelope") ? steps[i].precision : std::max(envelope, steps[i].precision);
    area += steps[i].gained * envelope;
  }
  return area / double(total);
}

}  // namespace dlsd
