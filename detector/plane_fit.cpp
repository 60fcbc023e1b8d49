#include "detector/plane_fit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "cameras/mutant.h"

namespace dlsd {
namespace {

/// Columns: axis and two unit vectors perpendicular to it.
Eigen::Matrix3d frameAround(const Eigen::Vector3d& axis) {
  int smallest = 0;
  axis.cwiseAbs().minCoeff(&smallest);
  const Eigen::Vector3d a = axis.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  Eigen::Matrix3d frame;
  frame << axis, a, axis.cross(a);
  return frame;
}

/// Fit in a frame whose axis 0 lies in or near the plane and along which M is large.
///
/// With M = [a k'; k B] and n = (n0, v), the rows of (M - lambda) n = 0 give n0 = -k.v / (a -
/// lambda) and (S(lambda) - lambda) v = 0, S = B - k k' / (a - lambda). S is 2x2, so its smaller
/// eigenvalue mu has a closed form, and lambda is the root of mu(lambda) = lambda. For rays near a
/// plane k.v is as small as their residuals and mu hardly depends on lambda: the first step from 0
/// is exact to rounding, further ones (Newton) serve rays far from any plane. Small eigenvalues
/// keep their relative accuracy, which the roots of the cubic characteristic polynomial would not.
std::optional<PlaneFit> fitInFrame(const Eigen::Matrix3d& M,
                                   const Eigen::Matrix3d& frame,
                                   double min_eigenvalue_ratio) {
  const double a = M(0, 0), k1 = M(0, 1), k2 = M(0, 2);
  double lambda = 0, larger = 0;
  Eigen::Vector3d n;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double d = a - lambda;
    if (!(d > 0)) return std::nullopt;
    const double s11 = M(1, 1) - k1 * k1 / d;
    const double s12 = M(1, 2) - k1 * k2 / d;
    const double s22 = M(2, 2) - k2 * k2 / d;
    const double half_sum = (s11 + s22) / 2, half_difference = (s11 - s22) / 2;
    const double radius = std::sqrt(half_difference * half_difference + s12 * s12);
    const double mu = half_sum - radius;
    larger = half_sum + radius;
    // Eigenvector of mu, from the row that does not cancel.
    double v1 = -s12, v2 = half_difference + radius;
    if (half_difference < 0) {
      v1 = radius - half_difference;
      v2 = -s12;
    }
    const double length = std::sqrt(v1 * v1 + v2 * v2);
    if (!(length > 0)) return std::nullopt;
    v1 /= length;
    v2 /= length;
    if (DLSD_MUTANT("plane-turned")) v2 *= 1 + 1e-6;
    const double n0 = -(k1 * v1 + k2 * v2) / d;
    n = {n0, v1, v2};
    const double step = (mu - lambda) / (1 + n0 * n0);
    const double previous = lambda;
    // The root lies below a; a step beyond it is cut in half.
    lambda = lambda + step < a ? std::max(0.0, lambda + step) : (lambda + a) / 2;
    const double tolerance = 4 * std::numeric_limits<double>::epsilon() * larger;
    if (!(std::abs(lambda - previous) > tolerance)) break;
  }
  if (!(larger > min_eigenvalue_ratio * a) || !std::isfinite(larger)) return std::nullopt;

  n.normalize();
  // In-plane directions: axis 0 as far as it lies in the plane, and across.
  Eigen::Vector3d along = Eigen::Vector3d::UnitX() - n.x() * n;
  if (!(along.squaredNorm() > 1e-6)) return std::nullopt;
  along.normalize();
  Eigen::Matrix<double, 3, 2> basis;
  basis << along, n.cross(along);
  const Eigen::Matrix2d in_plane = basis.transpose() * M * basis;
  const double determinant = in_plane(0, 0) * in_plane(1, 1) - in_plane(0, 1) * in_plane(1, 0);
  if (!(determinant > 0)) return std::nullopt;
  Eigen::Matrix2d inverse;
  inverse << in_plane(1, 1), -in_plane(0, 1), -in_plane(1, 0), in_plane(0, 0);
  inverse /= determinant;

  PlaneFit fit;
  fit.normal = frame * n;
  for (int i = 0; i < 3; ++i) {
    if (fit.normal[i] == 0) continue;
    if (fit.normal[i] < 0) fit.normal = -fit.normal;
    break;
  }
  fit.squared_residuals = lambda;
  const Eigen::Matrix<double, 3, 2> basis_out = frame * basis;
  fit.inverse_in_plane = basis_out * inverse * basis_out.transpose();
  return fit;
}

/// M in a frame in which nothing is known of it; the columns of `frame` are that frame's axes.
std::optional<PlaneFit> fitWithOwnAxis(const Eigen::Matrix3d& M, const Eigen::Matrix3d& frame) {
  const double trace = M.trace();
  if (!(trace > 0) || !std::isfinite(trace)) return std::nullopt;
  // Two steps of the power method from the largest column: within the plane, near the rays.
  int column = 0;
  M.diagonal().maxCoeff(&column);
  Eigen::Vector3d axis = M.col(column) / trace;
  axis = (M * axis) / trace;
  if (!(axis.norm() > 0)) return std::nullopt;
  const Eigen::Matrix3d turned = frameAround(axis.normalized());
  return fitInFrame(turned.transpose() * M * turned, frame * turned, 1e-13);
}

}  // namespace

std::optional<PlaneFit> fitPlane(const RayMoments& moments) {
  return fitWithOwnAxis(moments.matrix(), Eigen::Matrix3d::Identity());
}

std::optional<PlaneFit> fitPlane(std::span<const Eigen::Vector3d> rays) {
  if (rays.size() < 2) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& ray : rays) mean += ray;
  // Rays all around have no mean; any of them is then as good an axis.
  const double count = static_cast<double>(rays.size());
  const Eigen::Vector3d axis = mean.norm() > 0.3 * count ? mean.normalized() : rays.front();
  const Eigen::Matrix3d frame = frameAround(axis);
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& ray : rays) {
    // Perpendicular components from the difference, which is exact for rays near the axis.
    const Eigen::Vector3d offset = ray - axis;
    const Eigen::Vector3d local(
        frame.col(0).dot(ray), frame.col(1).dot(offset), frame.col(2).dot(offset));
    M += local * local.transpose();
  }
  if (!std::isfinite(M.trace())) return std::nullopt;
  const auto fit = fitInFrame(M, frame, 1e-18);
  if (fit && std::abs(fit->normal.dot(axis)) < 0.1) return fit;
  // Rays far from any plane: the mean may lie anywhere.
  return fitWithOwnAxis(M, frame);
}

std::optional<Eigen::Vector3d> refinePlane(const RayMoments& moments,
                                           const Eigen::Vector3d& normal) {
  const Eigen::Matrix3d M = moments.matrix();
  // Tangent directions: along the rays as far as that lies in the plane, and across.
  const Eigen::Vector3d column = M.col(0).squaredNorm() > M.col(1).squaredNorm()
                                     ? Eigen::Vector3d(M.col(0))
                                     : Eigen::Vector3d(M.col(1));
  const Eigen::Vector3d larger =
      column.squaredNorm() > M.col(2).squaredNorm() ? column : Eigen::Vector3d(M.col(2));
  Eigen::Vector3d a = larger - larger.dot(normal) * normal;
  const double length = a.norm();
  if (!(length > 0)) return std::nullopt;
  a /= length;
  const Eigen::Vector3d b = normal.cross(a);
  const Eigen::Vector3d Ma = M * a, Mb = M * b;
  const double aa = a.dot(Ma), ab = a.dot(Mb), bb = b.dot(Mb);
  const double determinant = aa * bb - ab * ab;
  if (!(determinant > 1e-13 * aa * aa)) return std::nullopt;
  const double an = normal.dot(Ma), bn = normal.dot(Mb);
  const double x = (ab * bn - bb * an) / determinant, y = (ab * an - aa * bn) / determinant;
  return (normal + x * a + (DLSD_MUTANT("refine-across") ? 0.9 : 1) * y * b).normalized();
}

}  // namespace dlsd
