#include "properties/oracle.h"

#include <algorithm>
#include <cmath>
#include <complex>
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

/// cos(theta) + xi. Near xi = +-1 long double is not enough to take the cosine from 1.
Real shiftedCosine(Real theta, Real xi) {
  const Real cosine = std::cos(theta / 2), sine = std::sin(theta / 2);
  return theta > kPi / 2 ? (xi - 1) + 2 * cosine * cosine : (xi + 1) - 2 * sine * sine;
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

/// The radial-tangential distortion of a point of the plane.
template <class S>
std::array<S, 2> distorted(const Radtan& d, S x, S y) {
  const S r2 = x * x + y * y;
  const S radial = 1 + d.k1 * r2 + d.k2 * (r2 * r2) + d.k3 * (r2 * r2 * r2);
  return {x * radial + 2 * d.p1 * (x * y) + d.p2 * (r2 + 2 * (x * x)),
          y * radial + d.p1 * (r2 + 2 * (y * y)) + 2 * d.p2 * (x * y)};
}

/// Least determinant of the Jacobian of the distortion over the azimuths at radius r, times a
/// positive number. From the entries of the Jacobian: the determinant is quadratic in the cosine of
/// the angle to (p2, p1), so three azimuths give it all.
Real leastDeterminant(const Radtan& d, Real r) {
  const Real length = std::hypot(static_cast<Real>(d.p1), static_cast<Real>(d.p2));
  const Real ex = length > 0 ? d.p2 / length : 1, ey = length > 0 ? d.p1 / length : 0;
  const auto at = [&](Real cosine, Real sine) {
    const Real x = r * (ex * cosine - ey * sine), y = r * (ey * cosine + ex * sine);
    const Real r2 = x * x + y * y;
    const Real radial = 1 + d.k1 * r2 + d.k2 * (r2 * r2) + d.k3 * (r2 * r2 * r2);
    const Real rise = d.k1 + 2 * d.k2 * r2 + 3 * d.k3 * (r2 * r2);  // By r2.
    const Real xx = radial + 2 * x * x * rise + 2 * d.p1 * y + 6 * d.p2 * x;
    const Real yy = radial + 2 * y * y * rise + 6 * d.p1 * y + 2 * d.p2 * x;
    const Real xy = 2 * x * y * rise + 2 * d.p1 * x + 2 * d.p2 * y;
    return xx * yy - xy * xy;
  };
  const Real ahead = at(1, 0), beside = at(0, 1), behind = at(-1, 0);
  const Real quadratic = (ahead + behind) / 2 - beside, linear = (ahead - behind) / 2;
  Real least = std::min(ahead, behind);
  if (quadratic > 0 && std::abs(linear) < 2 * quadratic) {
    least = std::min(least, beside - linear * linear / (4 * quadratic));
  }
  return least;
}

/// The first r in [from, to] at which a function that is positive at first falls below 0; infinite
/// if it does not. On a grid in the logarithm, and at the minima between its points.
template <class Function>
Real firstFall(const Function& function, Real from, Real to) {
  const int count = static_cast<int>(40 * std::log10(to / from));
  const auto grid = [&](int i) { return from * std::pow(to / from, static_cast<Real>(i) / count); };
  Real above = 0;  // Last place known with a value >= 0.
  for (int i = 1; i <= count; ++i) {
    Real r = grid(i);
    if (function(r) >= 0) {
      Real lo = grid(i - 1), hi = r;
      const Real step = (hi - lo) * 1e-6L;
      if (function(lo + step) < function(lo) && function(hi - step) < function(hi)) {
        for (int k = 0; k < 100; ++k) {
          const Real a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;
          if (function(a) < function(b)) {
            hi = b;
          } else {
            lo = a;
          }
        }
      }
      if (function(lo) >= 0) {
        above = r;
        continue;
      }
      r = lo;
    }
    Real below = r;
    for (int k = 0; k < 80; ++k) {
      const Real middle = (above + below) / 2;
      (function(middle) >= 0 ? above : below) = middle;
    }
    return below;
  }
  return kInfinity;
}

/// What a function of a camera's distortion last gave: tests ask for many rays of one camera in a
/// row, so one entry is enough.
template <class Key, class Function>
Real remembered(const Key& key, const Function& function) {
  thread_local Key known{};
  thread_local Real answer = function(known);
  if (!(key == known)) {
    known = key;
    answer = function(key);
  }
  return answer;
}

Real maxRadius(const Radtan& distortion) {
  return remembered(distortion, [](const Radtan& d) {
    return firstFall([&](Real r) { return leastDeterminant(d, r); }, 1e-4L, 1e15L);
  });
}

/// Relative uncertainty of a zero of a function that has this slope there, when its terms (of this
/// sum of absolute values) are added in double.
Real uncertainty(Real at, Real sum, Real slope) {
  return static_cast<Real>(std::numeric_limits<double>::epsilon()) * sum / std::abs(slope * at);
}

/// Of maxRadius, relative.
Real maxRadiusUncertainty(const Radtan& d) {
  const Real r = maxRadius(d);
  if (r == kInfinity) return 0;
  const Real r2 = r * r, p = std::hypot(static_cast<Real>(d.p1), static_cast<Real>(d.p2));
  const Real sum = 1 + std::abs(3 * d.k1 * r2) + std::abs(5 * d.k2 * r2 * r2) +
                   std::abs(7 * d.k3 * r2 * r2 * r2) + 8 * p * r;
  const Real h = r * 1e-6L;
  const Real slope = (leastDeterminant(d, r + h) - leastDeterminant(d, r - h)) / (2 * h);
  return uncertainty(r, sum * sum, slope);
}

/// Whether the distortion maps a point of the disc of this radius to (x, y). As complex numbers,
/// with f the radial part on the rim, P e^(i alpha) = p2 + i p1 and n = (x + i y - 2 p radius^2)
/// e^(-i alpha), the rim's image is f z + b z^2 = n, |z| = 1, b = P radius^2. It winds around n
/// once or not at all; by the argument principle as often as that equation has roots in |z| < 1,
/// and of its two roots the smaller one is 2 n / (f + sqrt(f^2 + 4 b n)).
bool hasSource(const Radtan& d, Real radius, Real x, Real y) {
  if (radius == kInfinity) return true;
  using Complex = std::complex<Real>;
  const Complex p(d.p2, d.p1);
  const Real length = std::abs(p), r2 = radius * radius;
  const Complex direction = length > 0 ? p / length : Complex(1);
  const Real f = radius * (1 + d.k1 * r2 + d.k2 * (r2 * r2) + d.k3 * (r2 * r2 * r2));
  const Complex n = (Complex(x, y) - p * (2 * r2)) * std::conj(direction);
  return std::abs(2.0L * n / (f + std::sqrt(f * f + 4 * length * r2 * n))) < 1;
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
  if (const auto* radtan = std::get_if<PinholeRadtan>(&model)) {
    return 4 * kEpsilon + static_cast<double>(maxRadiusUncertainty(radtan->radtan));
  }
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

double oracleBendAtAxis(const CameraModelVariant& model) {
  const auto tangential = [](const Radtan& d) { return 6 * std::hypot(d.p1, d.p2); };
  if (const auto* m = std::get_if<PinholeRadtan>(&model)) return tangential(m->radtan);
  return 0;
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

std::optional<Oracle2> oracleProject(const PinholeRadtan& m, Real x, Real y, Real z) {
  if (!(fieldAngle(x, y, z) < oracleMaxFieldAngle(m))) return std::nullopt;
  const auto [mx, my] = distorted(m.radtan, x / z, y / z);
  return Oracle2{m.fx * mx + m.cx, m.fy * my + m.cy};
}

Real oracleMaxFieldAngle(const PinholeRadtan& m) {
  return std::atan(maxRadius(m.radtan));
}
bool oracleHasRay(const PinholeRadtan& m, Real u, Real v) {
  return hasSource(m.radtan, maxRadius(m.radtan), (u - m.cx) / m.fx, (v - m.cy) / m.fy);
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

std::optional<Oracle2> oracleProject(const DoubleSphere& m, Real x, Real y, Real z) {
  const Real theta = fieldAngle(x, y, z);
  if (!(theta < oracleMaxFieldAngle(m))) return std::nullopt;
  const Real r2 = x * x + y * y;
  const Real z1 = std::sqrt(r2 + z * z) * shiftedCosine(theta, m.xi);
  const Real denom = m.alpha * std::sqrt(r2 + z1 * z1) + (1 - static_cast<Real>(m.alpha)) * z1;
  return Oracle2{m.fx * (x / denom) + m.cx, m.fy * (y / denom) + m.cy};
}

Real oracleMaxFieldAngle(const DoubleSphere& m) {
  // One entry is enough: tests ask for many rays of one camera in a row.
  thread_local DoubleSphere known{};
  thread_local Real known_answer = kPi / 2;
  if (m == known) return known_answer;
  known = m;
  if (m.xi >= 1) {
    known_answer = std::acos(-1 / static_cast<Real>(m.xi));
    return known_answer;
  }
  // The angle of the second sphere rises with the field angle: where it reaches that model's bound.
  const Real alpha = m.alpha;
  const Real second_bound = std::acos(alpha <= 0.5L ? -alpha / (1 - alpha) : -(1 - alpha) / alpha);
  Real inside = 0, outside = kPi;
  for (int k = 0; k < 80; ++k) {
    const Real theta = (inside + outside) / 2;
    (std::atan2(std::sin(theta), shiftedCosine(theta, m.xi)) < second_bound ? inside : outside) =
        theta;
  }
  known_answer = outside;
  return known_answer;
}
Real oracleMaxRadius(const DoubleSphere& m) {
  const Real alpha = m.alpha, xi = m.xi;
  if (xi >= 1) {
    const Real sine = 1 / xi;
    return sine / (alpha + (1 - alpha) * std::sqrt(1 - sine * sine));
  }
  return alpha <= 0.5L ? kInfinity : 1 / std::sqrt(2 * alpha - 1);
}

}  // namespace dlsd
