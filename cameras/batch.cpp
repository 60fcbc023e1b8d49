#include "cameras/batch.h"

#include <stdexcept>

namespace dlsd {
namespace {

void requireSameSize(size_t n, std::initializer_list<size_t> others) {
  for (const size_t m : others) {
    if (m != n) throw std::invalid_argument("batch arrays must all have the same length");
  }
}

}  // namespace

void projectAll(const Camera& camera,
                std::span<const double> x,
                std::span<const double> y,
                std::span<const double> z,
                std::span<double> u,
                std::span<double> v,
                std::span<uint8_t> valid) {
  const size_t n = x.size();
  requireSameSize(n, {y.size(), z.size(), u.size(), v.size(), valid.size()});
  const double limit = camera.maxFieldAngleLimit();
  std::visit(
      [&](const auto& m) {
        for (size_t i = 0; i < n; ++i) {
          const Pixel<double> p = m.project(x[i], y[i], z[i]);
          u[i] = p.u;
          v[i] = p.v;
          valid[i] = static_cast<uint8_t>(p.valid);
        }
      },
      camera.model());
  if (limit >= M_PI) return;
  for (size_t i = 0; i < n; ++i) {
    valid[i] &= static_cast<uint8_t>(std::atan2(std::hypot(x[i], y[i]), z[i]) <= limit);
  }
}

void unprojectAll(const Camera& camera,
                  std::span<const double> u,
                  std::span<const double> v,
                  std::span<double> x,
                  std::span<double> y,
                  std::span<double> z,
                  std::span<uint8_t> valid) {
  const size_t n = u.size();
  requireSameSize(n, {v.size(), x.size(), y.size(), z.size(), valid.size()});
  const double limit = camera.maxFieldAngleLimit();
  std::visit(
      [&](const auto& m) {
        for (size_t i = 0; i < n; ++i) {
          const Ray<double> r = m.unproject(u[i], v[i]);
          x[i] = r.x;
          y[i] = r.y;
          z[i] = r.z;
          valid[i] = static_cast<uint8_t>(r.valid);
        }
      },
      camera.model());
  if (limit >= M_PI) return;
  for (size_t i = 0; i < n; ++i) {
    valid[i] &= static_cast<uint8_t>(std::atan2(std::hypot(x[i], y[i]), z[i]) <= limit);
  }
}

}  // namespace dlsd
