#include "cameras/ray_table.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "cameras/batch.h"
#include "cameras/mutant.h"

namespace dlsd {
namespace {

/// A cell is measured in the middle of its four sides. To leading order the error is A(a) g(b) +
/// B(b) g(a) with g(t) = t (1 - t) (1 + t) (2 - t): on a side one of the two is alone, and A and B,
/// of opposite signs or changing theirs within the cell, cancel nowhere. (In its middle they may.)
/// Inside, both add, and higher orders come on top.
constexpr double kSafety = 3;

/// Rays of a row of positions.
struct RayRow {
  std::vector<double> u, v, x, y, z;
  std::vector<uint8_t> valid;

  explicit RayRow(size_t size) : u(size), v(size), x(size), y(size), z(size), valid(size) {}
  void unproject(const Camera& camera) { unprojectAll(camera, u, v, x, y, z, valid); }
};

}  // namespace

RayTable::RayTable(const Camera& camera)
    : camera_(camera),
      columns_((camera.width() + kStepPx - 1) / kStepPx),
      rows_((camera.height() + kStepPx - 1) / kStepPx),
      nodes_per_row_(static_cast<size_t>(columns_) + 3),
      nodes_(nodes_per_row_ * (static_cast<size_t>(rows_) + 3), Eigen::Vector4f::Zero()),
      smooth_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_)) {
  std::vector<uint8_t> has_ray(nodes_.size());
  RayRow row(nodes_per_row_);
  for (int j = 0; j < rows_ + 3; ++j) {
    const size_t offset = static_cast<size_t>(j) * nodes_per_row_;
    for (size_t i = 0; i < nodes_per_row_; ++i) {
      row.u[i] = (static_cast<double>(i) - 1) * kStepPx - 0.5;
      row.v[i] = (j - 1) * kStepPx - 0.5;
    }
    row.unproject(camera_);
    for (size_t i = 0; i < nodes_per_row_; ++i) {
      has_ray[offset + i] = row.valid[i];
      if (row.valid[i] == 0) continue;
      nodes_[offset + i] = Eigen::Vector4d(row.x[i], row.y[i], row.z[i], 0).cast<float>();
    }
  }

  const auto good = [&](const RayRow& probes, size_t probe, size_t node, float a, float b) {
    if (probes.valid[probe] == 0) return false;
    const RaySample sample = interpolate({0, node, a, b});
    const Eigen::Vector3d exact(probes.x[probe], probes.y[probe], probes.z[probe]);
    const double err_px = (sample.ray - exact).norm() * sample.pxPerRad();
    const auto J = camera_.jacobian(exact);
    if (DLSD_MUTANT("invalid-ray-table") || !J) return false;
    if (DLSD_MUTANT("ray-table-smooth")) return true;
    Eigen::Matrix<double, 3, 2> D;
    D << sample.du, sample.dv;
    return err_px * kSafety <= kMaxErrPx &&
           (*J * D - Eigen::Matrix2d::Identity()).norm() * kSafety <= kMaxErrPx;
  };
  // Neighbours share the rays in the middle of their side, not what they interpolate there.
  const auto columns = static_cast<size_t>(columns_);
  RayRow beside(columns + 1), above(columns), below(columns);
  const auto unprojectSides = [&](int y, RayRow* sides) {
    for (size_t x = 0; x < columns; ++x) {
      sides->u[x] = (static_cast<double>(x) + 0.5) * kStepPx - 0.5;
      sides->v[x] = y * kStepPx - 0.5;
    }
    sides->unproject(camera_);
  };
  unprojectSides(0, &below);
  for (int y = 0; y < rows_; ++y) {
    std::swap(above, below);
    unprojectSides(y + 1, &below);
    for (size_t x = 0; x <= columns; ++x) {
      beside.u[x] = static_cast<double>(x) * kStepPx - 0.5;
      beside.v[x] = (y + 0.5) * kStepPx - 0.5;
    }
    beside.unproject(camera_);
    for (size_t x = 0; x < columns; ++x) {
      const size_t node = static_cast<size_t>(y) * nodes_per_row_ + x;
      bool smooth = true;
      for (size_t j = 0; j < 4; ++j) {
        for (size_t i = 0; i < 4; ++i) {
          smooth = smooth && has_ray[node + j * nodes_per_row_ + i] != 0;
        }
      }
      smooth = smooth && good(beside, x, node, 0, 0.5F) && good(beside, x + 1, node, 1, 0.5F) &&
               good(above, x, node, 0.5F, 0) && good(below, x, node, 0.5F, 1);
      smooth_[static_cast<size_t>(y) * columns + x] = static_cast<uint8_t>(smooth);
    }
  }
}

RaySample RayTable::exactSample(double u, double v) const {
  const auto ray = camera_.unproject({u, v});
  if (!ray) throw std::out_of_range("the position has no ray");
  RaySample sample{*ray, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  const auto J = camera_.jacobian(*ray);
  if (!J) return sample;
  // The tangents that project to unit vectors; at a fold of the model there are none.
  const Eigen::Matrix2d square = *J * J->transpose();
  const double determinant = square(0, 0) * square(1, 1) - square(0, 1) * square(1, 0);
  if (!(determinant > 0) || !std::isfinite(determinant)) return sample;
  Eigen::Matrix2d adjugate;
  adjugate << square(1, 1), -square(0, 1), -square(1, 0), square(0, 0);
  const Eigen::Matrix<double, 3, 2> D = J->transpose() * adjugate / determinant;
  sample.du = D.col(0);
  sample.dv = D.col(1);
  return sample;
}

}  // namespace dlsd
