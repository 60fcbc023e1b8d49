#include "properties/oracle.h"

#include <cmath>
#include <limits>

namespace dlsd {
namespace {

using Real = long double;
constexpr Real kPi = 3.14159265358979323846264338327950288L;
constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

/// Pixel at radius rho (in units of the focal lengths) in the direction of (x, y).
template <class M>
Oracle2 pixelAt(const M& m, Real rho, Real x, Real y) {
  const Real r = std::hypot(x, y);
  const Real cosine = r > 0 ? x / r : 1, sine = r > 0 ? y / r : 0;
  return {m.fx * (rho * cosine) + m.cx, m.fy * (rho * sine) + m.cy};
}

Real fieldAngle(Real x, Real y, Real z) {
  return std::atan2(std::hypot(x, y), z);
}

Real distortion(const KannalaBrandt& m, Real theta) {
  return theta + m.k1 * std::pow(theta, 3) + m.k2 * std::pow(theta, 5) + m.k3 * std::pow(theta, 7) +
         m.k4 * std::pow(theta, 9);
}

Real distortionSlope(const KannalaBrandt& m, Real theta) {
  const Real t = theta * theta;
  return 1 + 3 * m.k1 * t + 5 * m.k2 * (t * t) + 7 * m.k3 * (t * t * t) +
         9 * m.k4 * (t * t * t * t);
}

/// Where in [lo, hi], a small interval, the slope is least.
Real leastSlope(const KannalaBrandt& m, Real lo, Real hi) {
  const Real step = (hi - lo) * 1e-6L;
  if (distortionSlope(m, lo + step) >= distortionSlope(m, lo)) return lo;
  if (distortionSlope(m, hi - step) >= distortionSlope(m, hi)) return hi;
  for (int k = 0; k < 100; ++k) {
    const Real a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;
    if (distortionSlope(m, a) < distortionSlope(m, b)) {
      hi = b;
    } else {
      lo = a;
    }
  }
  return lo;
}

}  // namespace

std::optional<Oracle2> oracleProject(const Pinhole& m, Real x, Real y, Real z) {
  if (!(z > 0)) return std::nullopt;
  return pixelAt(m, std::hypot(x, y) / z, x, y);
}

Real oracleMaxFieldAngle(const Pinhole&) {
  return kPi / 2;
}
Real oracleMaxRadius(const Pinhole&) {
  return kInfinity;
}

std::optional<Oracle2> oracleProject(const Fov& m, Real x, Real y, Real z) {
  const Real r = std::hypot(x, y);
  if (m.omega < Fov::kPinholeOmega) {
    if (!(z > 0)) return std::nullopt;
    return pixelAt(m, r / z, x, y);
  }
  if (r == 0 && !(z > 0)) return std::nullopt;
  const Real omega = m.omega;
  const Real tangent = 2 * std::tan(omega / 2) * r / z;
  const Real r_d = z > 0   ? std::atan(tangent) / omega
                   : z < 0 ? (kPi + std::atan(tangent)) / omega
                           : kPi / 2 / omega;
  return pixelAt(m, r_d, x, y);
}

Real oracleMaxFieldAngle(const Fov& m) {
  return m.omega < Fov::kPinholeOmega ? kPi / 2 : kPi;
}
Real oracleMaxRadius(const Fov& m) {
  return m.omega < Fov::kPinholeOmega ? kInfinity : kPi / static_cast<Real>(m.omega);
}

std::optional<Oracle2> oracleProject(const KannalaBrandt& m, Real x, Real y, Real z) {
  const Real theta = fieldAngle(x, y, z);
  if (!(theta < oracleMaxFieldAngle(m))) return std::nullopt;
  return pixelAt(m, distortion(m, theta), x, y);
}

Real oracleMaxFieldAngle(const KannalaBrandt& m) {
  // One entry is enough: tests ask for many rays of one camera in a row.
  thread_local KannalaBrandt known{};
  thread_local Real known_answer = kPi;
  if (m == known) return known_answer;
  known = m;
  // First place where the slope falls below 0: on a grid and at the minima between its points, then
  // bisected.
  constexpr int kGrid = 1000;
  known_answer = kPi;
  Real above = 0;  // Last place known with a slope >= 0.
  for (int i = 1; i <= kGrid; ++i) {
    Real theta = kPi * i / kGrid;
    if (distortionSlope(m, theta) >= 0) {
      const Real dip = leastSlope(m, kPi * (i - 1) / kGrid, theta);
      if (distortionSlope(m, dip) >= 0) {
        above = theta;
        continue;
      }
      theta = dip;
    }
    Real below = theta;
    for (int k = 0; k < 80; ++k) {
      const Real middle = (above + below) / 2;
      (distortionSlope(m, middle) >= 0 ? above : below) = middle;
    }
    known_answer = below;
    break;
  }
  return known_answer;
}
double oracleBoundUncertainty(const CameraModelVariant& model) {
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  const auto* m = std::get_if<KannalaBrandt>(&model);
  if (m == nullptr || oracleMaxFieldAngle(*m) == kPi) return 4 * kEpsilon;
  const Real theta = oracleMaxFieldAngle(*m), t = theta * theta;
  const std::array<Real, 4> terms{
      3 * m->k1 * t, 5 * m->k2 * t * t, 7 * m->k3 * t * t * t, 9 * m->k4 * t * t * t * t};
  Real sum = 1, slope = 0;  // Of the absolute terms, and theta times the slope of d'.
  for (size_t i = 0; i < terms.size(); ++i) {
    sum += std::abs(terms[i]);
    slope += 2 * static_cast<Real>(i + 1) * terms[i];
  }
  return 4 * kEpsilon * (1 + static_cast<double>(sum / std::abs(slope)));
}
Real oracleMaxRadius(const KannalaBrandt& m) {
  return distortion(m, oracleMaxFieldAngle(m));
}

std::optional<Oracle2> oracleProject(const UnifiedOmni& m, Real x, Real y, Real z) {
  if (!(fieldAngle(x, y, z) < oracleMaxFieldAngle(m))) return std::nullopt;
  const Real d = std::sqrt(x * x + y * y + z * z);
  return Oracle2{m.fx * (x / (z + m.xi * d)) + m.cx, m.fy * (y / (z + m.xi * d)) + m.cy};
}

Real oracleMaxFieldAngle(const UnifiedOmni& m) {
  const Real xi = m.xi;
  return xi <= 1 ? std::acos(-xi) : std::acos(-1 / xi);
}
Real oracleMaxRadius(const UnifiedOmni& m) {
  const Real xi = m.xi;
  return xi <= 1 ? kInfinity : 1 / std::sqrt(xi * xi - 1);
}

std::optional<Oracle2> oracleProject(const Eucm& m, Real x, Real y, Real z) {
  if (!(fieldAngle(x, y, z) < oracleMaxFieldAngle(m))) return std::nullopt;
  const Real d = std::sqrt(m.beta * (x * x + y * y) + z * z);
  const Real denom = m.alpha * d + (1 - static_cast<Real>(m.alpha)) * z;
  return Oracle2{m.fx * (x / denom) + m.cx, m.fy * (y / denom) + m.cy};
}

Real oracleMaxFieldAngle(const Eucm& m) {
  const Real alpha = m.alpha;
  const Real cosine = alpha <= 0.5L ? -alpha / (1 - alpha) : -(1 - alpha) / alpha;
  const Real sine = std::sqrt(1 - cosine * cosine);  // Where d = 1.
  return std::atan2(sine / std::sqrt(static_cast<Real>(m.beta)), cosine);
}
Real oracleMaxRadius(const Eucm& m) {
  const Real alpha = m.alpha;
  return alpha <= 0.5L ? kInfinity : 1 / std::sqrt(m.beta * (2 * alpha - 1));
}

}  // namespace dlsd
