#include "detector/image_rim.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace dlsd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A rim ends the dark when it is brighter than that by so many grey levels, for so many pixels.
constexpr double kBrighterLevels = 20;
constexpr int kBrightRun = 3;
/// Ends of the dark on one circle: within this share of its radius.
constexpr double kOnCircle = 0.03;
/// So many of them at least, of all that there are, with no larger gap between them.
constexpr size_t kLeastEnds = ImageRimFinder::kSpokes / 4;
constexpr double kLeastShare = 0.6;
constexpr double kLargestGapRad = 3.5;
/// A lens is not far off its own axis.
constexpr double kLargestOffset = 0.1;
/// Where the camera model ends just there, its edge is known: UsableMask.
constexpr double kBeforeModelEnds = 0.9;
/// How far inside and outside of the circle edges of the rim are found: vignetting.
constexpr double kInside = 0.06, kOutside = 0.03;
/// tan of the angle between a line and the rim.
constexpr double kAlong = 0.27;

Vector2d anglesOf(const Vector3d& ray) {
  const double r = std::hypot(ray.x(), ray.y());
  const double theta = std::atan2(r, ray.z());
  return r > 0 ? Vector2d(ray.x() * theta / r, ray.y() * theta / r) : Vector2d(0, 0);
}

/// Least squares of |p|^2 = 2 p c + k (Kasa): a circle through points all around it.
std::optional<ImageRim> fitCircle(const std::vector<Vector2d>& points) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const Vector2d& p : points) {
    const Vector3d row(2 * p.x(), 2 * p.y(), 1);
    a += row * row.transpose();
    b += row * p.squaredNorm();
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> solver(a);
  if (!solver.isInvertible()) return std::nullopt;
  const Vector3d x = solver.solve(b);
  const double radius2 = x[2] + x.head<2>().squaredNorm();
  if (!(radius2 > 0)) return std::nullopt;
  return ImageRim{x.head<2>(), std::sqrt(radius2)};
}

double largestGap(const std::vector<Vector2d>& points, const Vector2d& centre) {
  std::array<double, ImageRimFinder::kSpokes> angles{};
  for (size_t i = 0; i < points.size(); ++i) {
    angles[i] = std::atan2(points[i].y() - centre.y(), points[i].x() - centre.x());
  }
  const auto end = angles.begin() + static_cast<ptrdiff_t>(points.size());
  std::sort(angles.begin(), end);
  double gap = angles[0] + 2 * M_PI - *(end - 1);
  for (size_t i = 1; i < points.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
  return gap;
}

}  // namespace

ImageRimFinder::ImageRimFinder(const Camera& camera) : camera_(camera) {
  const auto axis = camera.project(Vector3d::UnitZ());
  if (!axis || !camera.inImage(*axis)) return;
  const double right = camera.width() - 1 - axis->x(), below = camera.height() - 1 - axis->y();
  for (int i = 0; i < kSpokes; ++i) {
    const double angle = 2 * M_PI * (i + 0.5) / kSpokes;
    const Vector2d out(std::cos(angle), std::sin(angle));
    const double length = std::min((out.x() > 0 ? right : -axis->x()) / out.x(),
                                   (out.y() > 0 ? below : -axis->y()) / out.y());
    // What is nearer to the axis than half the way is no rim.
    if (length >= 2) spokes_.push_back({*axis + length * out, -out, static_cast<int>(length / 2)});
  }
}

std::optional<ImageRim> ImageRimFinder::find(const GreyPixels& pixels) {
  const auto levelAt = [&](const Vector2d& p) {
    const auto x = static_cast<ptrdiff_t>(p.x() + 0.5), y = static_cast<ptrdiff_t>(p.y() + 0.5);
    const ptrdiff_t at = y * pixels.stride + x;
    return pixels.u8 != nullptr ? static_cast<double>(pixels.u8[at])
                                : static_cast<double>(pixels.fixed[at]) / kGreyUnit;
  };
  if (spokes_.size() < kLeastEnds) return std::nullopt;
  levels_.clear();
  for (const Spoke& spoke : spokes_) levels_.push_back(levelAt(spoke.border));
  const auto quarter = levels_.begin() + static_cast<ptrdiff_t>(levels_.size() / 4);
  std::nth_element(levels_.begin(), quarter, levels_.end());
  if (*quarter > kDarkLevels) return std::nullopt;
  const double bright = *quarter + kBrighterLevels;

  ends_.clear();
  radii_.clear();
  for (const Spoke& spoke : spokes_) {
    int run = 0, i = 0;
    for (; i < spoke.steps && run < kBrightRun; ++i) {
      run = levelAt(spoke.border + i * spoke.step) > bright ? run + 1 : 0;
    }
    if (run < kBrightRun || i == kBrightRun) continue;  // all dark, or bright up to the border
    const auto ray = camera_.unproject(spoke.border + (i - kBrightRun) * spoke.step);
    if (!ray) continue;
    ends_.push_back(anglesOf(*ray));
    radii_.push_back(ends_.back().norm());
  }
  if (ends_.size() < kLeastEnds) return std::nullopt;
  const auto middle = radii_.begin() + static_cast<ptrdiff_t>(radii_.size() / 2);
  std::nth_element(radii_.begin(), middle, radii_.end());
  ImageRim rim{Vector2d::Zero(), *middle};
  for (const double tolerance : {3 * kOnCircle, 1.5 * kOnCircle, kOnCircle}) {
    near_.clear();
    for (const Vector2d& p : ends_) {
      if (std::abs((p - rim.centre).norm() - rim.radius) <= tolerance * rim.radius) {
        near_.push_back(p);
      }
    }
    if (near_.size() < kLeastEnds) return std::nullopt;
    const auto fit = fitCircle(near_);
    if (!fit) return std::nullopt;
    rim = *fit;
  }
  const bool is_rim =
      static_cast<double>(near_.size()) >= kLeastShare * static_cast<double>(ends_.size()) &&
      rim.centre.norm() <= kLargestOffset * rim.radius &&
      rim.radius <= kBeforeModelEnds * camera_.maxFieldAngle() &&
      largestGap(near_, rim.centre) <= kLargestGapRad;
  return is_rim ? std::optional(rim) : std::nullopt;
}

bool isOnRim(const Arc& arc, const ImageRim& rim) {
  constexpr int kPieces = 8;
  int along = 0;
  Vector2d before = anglesOf(arc.from) - rim.centre;
  for (int i = 1; i <= kPieces; ++i) {
    const Vector2d p = anglesOf(arc.at(static_cast<double>(i) / kPieces)) - rim.centre;
    const Vector2d d = p - before, middle = 0.5 * (p + before);
    const double radius = middle.norm();
    const double outwards = std::abs(d.dot(middle)),
                 around = std::abs(d.x() * middle.y() - d.y() * middle.x());
    along += radius >= (1 - kInside) * rim.radius && radius <= (1 + kOutside) * rim.radius &&
             outwards <= kAlong * around;
    before = p;
  }
  return 2 * along > kPieces;
}

}  // namespace dlsd
