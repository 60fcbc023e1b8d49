#include "properties/oracle.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <type_traits>

#include "properties/dual.h"

namespace dlsd {
namespace {

using std::atan;
using std::atan2;
using std::hypot;
using std::sqrt;

using Real = long double;
constexpr Real kPi = 3.14159265358979323846264338327950288L;
constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
constexpr Real kEpsilon = std::numeric_limits<double>::epsilon();

template <class S>
using Point = std::array<S, 2>;

// --- Tools ---

template <class S>
S pow(const S& x, int n) {
  S product(1);
  for (int i = 0; i < n; ++i) product = product * x;
  return product;
}

Real fieldAngle(Real x, Real y, Real z) {
  return atan2(hypot(x, y), z);
}

/// The point at radius rho in the direction of (x, y).
template <class S>
Point<S> pointAt(const S& rho, const S& x, const S& y) {
  const S r = hypot(x, y);
  if (!(r > S(0))) return {rho, S(0)};
  return {rho * (x / r), rho * (y / r)};
}

/// Of a point of a plane, by focal lengths and principal point.
template <class M, class S>
Point<S> pixelOf(const M& m, const Point<S>& p) {
  return {m.fx * p[0] + m.cx, m.fy * p[1] + m.cy};
}

/// What a function of a camera last gave: tests ask for many rays of one camera in a row, so one
/// entry is enough.
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

/// The first place in [from, to] at which a function that is positive at first falls below 0;
/// infinite if it does not. On a grid in the logarithm, and at the minima between its points.
template <class Function>
Real firstFall(const Function& function, Real from, Real to) {
  const int count = static_cast<int>(100 * std::log10(to / from));
  const auto grid = [&](int i) { return from * std::pow(to / from, static_cast<Real>(i) / count); };
  Real above = 0;  // Last place known with a value >= 0.
  for (int i = 1; i <= count; ++i) {
    const Real x = grid(i);
    Real least = x;
    if (function(x) >= 0) {
      Real lo = grid(i - 1), hi = x;
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
      least = lo;
    }
    if (function(least) >= 0) {
      above = x;
      continue;
    }
    Real below = least;
    for (int k = 0; k < 80; ++k) {
      const Real middle = (above + below) / 2;
      (function(middle) >= 0 ? above : below) = middle;
    }
    return below;
  }
  return kInfinity;
}

/// Relative uncertainty of a zero of a function with this slope there, when terms with this sum of
/// absolute values are added in double.
Real zeroUncertainty(Real at, Real sum, Real slope) {
  return kEpsilon * sum / std::abs(slope * at);
}

template <class M>
Real uncertaintyOf(const M&) {
  return 0;
}

template <class M>
Real bendOf(const M&) {
  return 0;
}

// --- Pinhole ---

template <class S>
Point<S> imageOf(const Pinhole& m, const S& x, const S& y, const S& z) {
  return pixelOf(m, Point<S>{x / z, y / z});
}
Real maxFieldAngle(const Pinhole&) {
  return kPi / 2;
}
Real maxRadius(const Pinhole&) {
  return kInfinity;
}

// --- FoV ---

template <class S>
Point<S> imageOf(const Fov& m, const S& x, const S& y, const S& z) {
  if (m.omega < Fov::kPinholeOmega) return pixelOf(m, Point<S>{x / z, y / z});
  const Real omega = m.omega;
  const S tangent = 2 * std::tan(omega / 2) * hypot(x, y);
  // atan with its arguments' signs: atan(t / z), that plus pi, or the one from pi / 2 down.
  const S angle = z > tangent    ? atan(tangent / z)
                  : z < -tangent ? kPi + atan(tangent / z)
                                 : kPi / 2 - atan(z / tangent);
  return pixelOf(m, pointAt(S(angle / omega), x, y));
}
Real maxFieldAngle(const Fov& m) {
  return m.omega < Fov::kPinholeOmega ? kPi / 2 : kPi;
}
Real maxRadius(const Fov& m) {
  return m.omega < Fov::kPinholeOmega ? kInfinity : kPi / static_cast<Real>(m.omega);
}

// --- Kannala-Brandt ---

template <class S>
S distortion(const KannalaBrandt& m, const S& theta) {
  return theta + m.k1 * pow(theta, 3) + m.k2 * pow(theta, 5) + m.k3 * pow(theta, 7) +
         m.k4 * pow(theta, 9);
}
template <class S>
Point<S> imageOf(const KannalaBrandt& m, const S& x, const S& y, const S& z) {
  return pixelOf(m, pointAt(distortion(m, S(atan2(hypot(x, y), z))), x, y));
}
Real maxFieldAngle(const KannalaBrandt& model) {
  return remembered(model, [](const KannalaBrandt& m) {
    const Real fold = firstFall(
        [&](Real theta) {
          return 1 + 3 * m.k1 * pow(theta, 2) + 5 * m.k2 * pow(theta, 4) +
                 7 * m.k3 * pow(theta, 6) + 9 * m.k4 * pow(theta, 8);
        },
        1e-3L,
        kPi);
    return std::min(fold, kPi);
  });
}
Real maxRadius(const KannalaBrandt& m) {
  return distortion(m, maxFieldAngle(m));
}
Real uncertaintyOf(const KannalaBrandt& m) {
  if (maxFieldAngle(m) == kPi) return 0;
  const Real t = pow(maxFieldAngle(m), 2);
  const std::array<Real, 4> terms{
      3 * m.k1 * t, 5 * m.k2 * pow(t, 2), 7 * m.k3 * pow(t, 3), 9 * m.k4 * pow(t, 4)};
  Real sum = 1, slope = 0;  // Slope: times theta.
  for (size_t i = 0; i < terms.size(); ++i) {
    sum += std::abs(terms[i]);
    slope += 2 * static_cast<Real>(i + 1) * terms[i];
  }
  return 4 * zeroUncertainty(1, sum, slope);
}

// --- Unified omni ---

template <class S>
Point<S> imageOf(const UnifiedOmni& m, const S& x, const S& y, const S& z) {
  const S denominator = z + m.xi * sqrt(x * x + y * y + z * z);
  return pixelOf(m, Point<S>{x / denominator, y / denominator});
}
/// Of the unified model and those made from it.
Real maxFieldAngleOfXi(Real xi) {
  return xi <= 1 ? std::acos(-xi) : std::acos(-1 / xi);
}
Real maxRadiusOfXi(Real xi) {
  return xi <= 1 ? kInfinity : 1 / sqrt(xi * xi - 1);
}
Real maxFieldAngle(const UnifiedOmni& m) {
  return maxFieldAngleOfXi(m.xi);
}
Real maxRadius(const UnifiedOmni& m) {
  return maxRadiusOfXi(m.xi);
}

// --- Radial-tangential distortion ---

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

/// Of the disc on which the distortion is one-to-one; infinite if all.
Real maxRadiusOf(const Radtan& distortion) {
  return remembered(distortion, [](const Radtan& d) {
    return firstFall([&](Real r) { return leastDeterminant(d, r); }, 1e-4L, 1e15L);
  });
}

/// Of that radius, relative.
Real maxRadiusUncertainty(const Radtan& d) {
  const Real r = maxRadiusOf(d);
  if (r == kInfinity) return 0;
  const Real r2 = r * r, p = std::hypot(static_cast<Real>(d.p1), static_cast<Real>(d.p2));
  const Real sum = 1 + std::abs(3 * d.k1 * r2) + std::abs(5 * d.k2 * r2 * r2) +
                   std::abs(7 * d.k3 * r2 * r2 * r2) + 8 * p * r;
  const Real h = r * 1e-6L;
  const Real slope = (leastDeterminant(d, r + h) - leastDeterminant(d, r - h)) / (2 * h);
  return zeroUncertainty(r, sum * sum, slope);
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

// --- Pinhole-radtan ---

template <class S>
Point<S> imageOf(const PinholeRadtan& m, const S& x, const S& y, const S& z) {
  return pixelOf(m, distorted(m.radtan, S(x / z), S(y / z)));
}
Real maxFieldAngle(const PinholeRadtan& m) {
  return atan(maxRadiusOf(m.radtan));
}
bool hasRay(const PinholeRadtan& m, Real u, Real v) {
  return hasSource(m.radtan, maxRadiusOf(m.radtan), (u - m.cx) / m.fx, (v - m.cy) / m.fy);
}
Real uncertaintyOf(const PinholeRadtan& m) {
  return maxRadiusUncertainty(m.radtan);
}
Real bendOf(const PinholeRadtan& m) {
  return 6 * hypot(m.radtan.p1, m.radtan.p2);
}

// --- Omni-radtan ---

template <class S>
Point<S> imageOf(const OmniRadtan& m, const S& x, const S& y, const S& z) {
  const S denominator = z + m.xi * sqrt(x * x + y * y + z * z);
  const Point<S> d = distorted(m.radtan, S(x / denominator), S(y / denominator));
  return {m.fx * d[0] + m.skew * d[1] + m.cx, m.fy * d[1] + m.cy};
}
Real maxFieldAngle(const OmniRadtan& m) {
  const Real radius = maxRadiusOf(m.radtan), xi = m.xi, most = maxFieldAngleOfXi(xi);
  if (radius >= maxRadiusOfXi(xi)) return most;
  Real lo = 0, hi = most;
  for (int k = 0; k < 80; ++k) {
    const Real theta = (lo + hi) / 2;
    (std::sin(theta) < radius * (std::cos(theta) + xi) ? lo : hi) = theta;
  }
  return hi;
}
bool hasRay(const OmniRadtan& m, Real u, Real v) {
  const Real y = (v - m.cy) / m.fy, x = (u - m.cx - m.skew * y) / m.fx;
  return hasSource(m.radtan, std::min(maxRadiusOf(m.radtan), maxRadiusOfXi(m.xi)), x, y);
}
Real uncertaintyOf(const OmniRadtan& m) {
  const Real radius = maxRadiusOf(m.radtan), xi = m.xi;
  if (radius >= maxRadiusOfXi(xi)) return 0;
  const Real theta = maxFieldAngle(m), cosine = std::cos(theta);
  const Real rise = (1 + xi * cosine) / pow(cosine + xi, 2);  // d radius / d theta
  const Real share = maxRadiusUncertainty(m.radtan) + 4 * kEpsilon;
  return share * std::max(Real(1), radius / (theta * rise));
}
Real bendOf(const OmniRadtan& m) {
  return 6 * hypot(m.radtan.p1, m.radtan.p2) / (1 + m.xi);
}

// --- OCam ---

/// f(rho), or that sum with each term times its power (rho f') or that less one (rho f' - f).
enum class OcamSum { kValue, kPowerTimes, kPowerLessOneTimes };
template <class S>
S ocamSum(const Ocam& m, const S& rho, OcamSum which) {
  S sum(0);
  for (int i = 0; i < 9; ++i) {
    const int factor = which == OcamSum::kValue ? 1 : which == OcamSum::kPowerTimes ? i : i - 1;
    sum = sum + S(static_cast<Real>(m.a[static_cast<size_t>(i)]) * factor) *
                    (i == 0 ? S(1) : pow(rho, i));
  }
  return sum;
}
/// Infinite if the field angle rises for ever.
Real maxRho(const Ocam& model) {
  return remembered(model, [](const Ocam& m) {
    return firstFall(
        [&](Real rho) { return ocamSum(m, rho, OcamSum::kPowerLessOneTimes); }, 1e-6L, 1e31L);
  });
}
/// rho of a field angle below the largest one, by bisection of the equation that defines it.
Real rhoAt(const Ocam& m, Real theta) {
  const auto angle = [&](Real rho) { return atan2(rho, -ocamSum(m, rho, OcamSum::kValue)); };
  const Real most = std::min(maxRho(m), Real(1e15));
  Real lo = 0, hi = std::min(most, -m.a[0] * theta);
  while (hi < most && angle(hi) < theta) {
    lo = hi;
    hi = std::min(most, 2 * hi);
  }
  for (int k = 0; k < 100; ++k) {
    const Real middle = (lo + hi) / 2;
    (angle(middle) < theta ? lo : hi) = middle;
  }
  return hi;
}
template <class S>
Point<S> imageOf(const Ocam& m, const S& x, const S& y, const S& z) {
  const S r = hypot(x, y);
  Real rho = 0;
  if constexpr (std::is_same_v<S, Dual>) {
    rho = rhoAt(m, atan2(r.value, z.value));
  } else {
    rho = rhoAt(m, atan2(r, z));
  }
  // One step of Newton's method on rho z + f r = 0 carries the derivatives of the ray over to rho.
  const S f(ocamSum(m, rho, OcamSum::kValue));
  const S slope(rho > 0 ? ocamSum(m, rho, OcamSum::kPowerTimes) / rho : Real(m.a[1]));
  const Point<S> p = pointAt(S(rho - (rho * z + f * r) / (z + slope * r)), x, y);
  return {p[0] + m.e * p[1] + m.cx, m.d * p[0] + m.c * p[1] + m.cy};
}
Real maxFieldAngle(const Ocam& m) {
  const Real rho = std::min(maxRho(m), Real(1e30));  // The latter gives the limit.
  return atan2(rho, -ocamSum(m, rho, OcamSum::kValue));
}
bool hasRay(const Ocam& m, Real u, Real v) {
  const Real du = u - m.cx, dv = v - m.cy, c = m.c, d = m.d, e = m.e;
  return hypot(c * du - e * dv, dv - d * du) / (c - d * e) < maxRho(m);
}
Real uncertaintyOf(const Ocam& m) {
  const Real rho = maxRho(m);
  if (rho == kInfinity) return 0;
  Real sum = 0, slope = 0;  // Of the terms of rho f' - f; slope: times rho.
  for (int i = 0; i < 9; ++i) {
    const Real term = m.a[static_cast<size_t>(i)] * pow(rho, i);
    sum += std::max(1, std::abs(i - 1)) * std::abs(term);
    slope += i * (i - 1) * term;
  }
  const Real norm = hypot(rho, ocamSum(m, rho, OcamSum::kValue));
  return 4 * (zeroUncertainty(1, sum, slope) + kEpsilon * sum / (norm * maxFieldAngle(m)));
}
Real bendOf(const Ocam& m) {
  return 2 * std::abs(m.a[1]);
}

// --- Theta polynomial ---

template <class S>
S radius(const ThetaPolynomial& m, const S& theta) {
  return m.k1 * theta + m.k2 * pow(theta, 2) + m.k3 * pow(theta, 3) + m.k4 * pow(theta, 4);
}
template <class S>
Point<S> imageOf(const ThetaPolynomial& m, const S& x, const S& y, const S& z) {
  const Point<S> p = pointAt(radius(m, S(atan2(hypot(x, y), z))), x, y);
  return {p[0] + m.cx, m.aspect * p[1] + m.cy};
}
Real maxFieldAngle(const ThetaPolynomial& model) {
  return remembered(model, [](const ThetaPolynomial& m) {
    const auto slope = [&](Real theta) {
      return m.k1 + 2 * m.k2 * theta + 3 * m.k3 * pow(theta, 2) + 4 * m.k4 * pow(theta, 3);
    };
    return std::min(firstFall(slope, 1e-12L, kPi), kPi);
  });
}
bool hasRay(const ThetaPolynomial& m, Real u, Real v) {
  return hypot(u - m.cx, (v - m.cy) / m.aspect) < radius(m, maxFieldAngle(m));
}
Real uncertaintyOf(const ThetaPolynomial& m) {
  const Real theta = maxFieldAngle(m);
  if (theta == kPi) return 0;
  const std::array<Real, 3> terms{
      2 * m.k2 * theta, 3 * m.k3 * pow(theta, 2), 4 * m.k4 * pow(theta, 3)};
  Real sum = m.k1, slope = 0;  // Slope: times theta.
  for (size_t i = 0; i < terms.size(); ++i) {
    sum += std::abs(terms[i]);
    slope += static_cast<Real>(i + 1) * terms[i];
  }
  return 4 * zeroUncertainty(1, sum, slope);
}
Real bendOf(const ThetaPolynomial& m) {
  return 2 * std::abs(m.k2) / m.k1;
}

// --- EUCM ---

template <class S>
Point<S> imageOf(const Eucm& m, const S& x, const S& y, const S& z) {
  const S d = sqrt(m.beta * (x * x + y * y) + z * z);
  const S denominator = m.alpha * d + (1 - static_cast<Real>(m.alpha)) * z;
  return pixelOf(m, Point<S>{x / denominator, y / denominator});
}
Real maxFieldAngle(const Eucm& m) {
  const Real alpha = m.alpha;
  const Real cosine = alpha <= 0.5L ? -alpha / (1 - alpha) : -(1 - alpha) / alpha;
  const Real sine = sqrt(1 - cosine * cosine);  // Where d = 1.
  return atan2(sine / sqrt(static_cast<Real>(m.beta)), cosine);
}
Real maxRadius(const Eucm& m) {
  const Real alpha = m.alpha;
  return alpha <= 0.5L ? kInfinity : 1 / sqrt(m.beta * (2 * alpha - 1));
}

// --- Double sphere ---

template <class S>
Point<S> imageOf(const DoubleSphere& m, const S& x, const S& y, const S& z) {
  const S r2 = x * x + y * y, d = sqrt(r2 + z * z);
  const Real xi = m.xi;
  // z + xi d, without what |xi| near 1 would lose near the axis.
  const S z1 = z < S(0) ? (xi - 1) * d + r2 / (d - z) : (xi + 1) * d - r2 / (d + z);
  const S denominator = m.alpha * sqrt(r2 + z1 * z1) + (1 - static_cast<Real>(m.alpha)) * z1;
  return pixelOf(m, Point<S>{x / denominator, y / denominator});
}
/// cos(theta) + xi, without what |xi| near 1 would lose near 0 and pi.
Real shiftedCosine(Real theta, Real xi) {
  const Real cosine = std::cos(theta / 2), sine = std::sin(theta / 2);
  return theta > kPi / 2 ? (xi - 1) + 2 * cosine * cosine : (xi + 1) - 2 * sine * sine;
}
Real maxFieldAngle(const DoubleSphere& m) {
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
Real maxRadius(const DoubleSphere& m) {
  const Real alpha = m.alpha, xi = m.xi;
  if (xi >= 1) {
    const Real sine = 1 / xi;
    return sine / (alpha + (1 - alpha) * std::sqrt(1 - sine * sine));
  }
  return alpha <= 0.5L ? kInfinity : 1 / std::sqrt(2 * alpha - 1);
}

// --- Equirectangular ---

template <class S>
Point<S> imageOf(const Equirectangular& m, const S& x, const S& y, const S& z) {
  S longitude = atan2(x, z);
  // Half-open: the seam itself has the longitude -pi.
  const bool on_seam = !(x < S(0)) && !(x > S(0)) && z < S(0);
  if (on_seam && longitude > S(0)) longitude = longitude - S(2 * kPi);
  return pixelOf(m, Point<S>{longitude, atan2(y, hypot(x, z))});
}
Real maxFieldAngle(const Equirectangular&) {
  return kPi;
}
bool hasRay(const Equirectangular& m, Real u, Real v) {
  const Real longitude = (u - m.cx) / m.fx, latitude = (v - m.cy) / m.fy;
  return -kPi <= longitude && longitude < kPi && std::abs(latitude) <= kPi / 2;
}

// --- Models whose bound in the image is a radius ---

template <class M>
bool hasRay(const M& m, Real u, Real v) {
  return hypot((u - m.cx) / m.fx, (v - m.cy) / m.fy) < maxRadius(m);
}

}  // namespace

std::optional<Oracle2> oracleProject(const CameraModelVariant& model, Real x, Real y, Real z) {
  return std::visit(
      [&](const auto& m) -> std::optional<Oracle2> {
        if (!(fieldAngle(x, y, z) < maxFieldAngle(m))) return std::nullopt;
        return imageOf(m, x, y, z);
      },
      model);
}

OracleJacobian oracleJacobian(const CameraModelVariant& model, Real x, Real y, Real z) {
  const Point<Dual> image = std::visit(
      [&](const auto& m) {
        return imageOf(m, Dual::input(x, 0), Dual::input(y, 1), Dual::input(z, 2));
      },
      model);
  OracleJacobian J;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 2; ++k) {
      J(k, i) = image[static_cast<size_t>(k)].slope[static_cast<size_t>(i)];
    }
  }
  return J;
}

Real oracleMaxFieldAngle(const CameraModelVariant& model) {
  return std::visit([](const auto& m) { return maxFieldAngle(m); }, model);
}

bool oracleHasRay(const CameraModelVariant& model, Real u, Real v) {
  return std::visit([&](const auto& m) { return hasRay(m, u, v); }, model);
}

double oracleBoundUncertainty(const CameraModelVariant& model) {
  return static_cast<double>(4 * kEpsilon +
                             std::visit([](const auto& m) { return uncertaintyOf(m); }, model));
}

double oracleBendAtAxis(const CameraModelVariant& model) {
  return static_cast<double>(std::visit([](const auto& m) { return Real(bendOf(m)); }, model));
}

}  // namespace dlsd
