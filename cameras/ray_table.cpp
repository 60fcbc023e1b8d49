#include "cameras/ray_table.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <stdexcept>

#include "cameras/batch.h"
#include "cameras/mutant.h"

namespace dlsd {
namespace {

/// Where a cell is measured. The error of the interpolation is largest in the middle of the cell;
/// the other two tell apart what happens to be right there.
constexpr std::array<std::array<double, 2>, 3> kProbes = {{{0.5, 0.5}, {0.25, 0.7}, {0.8, 0.3}}};
/// Between the probes the error may be larger.
constexpr double kSafety = 4;

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

  RayRow probes(static_cast<size_t>(columns_) * kProbes.size());
  for (int y = 0; y < rows_; ++y) {
    size_t k = 0;
    for (int x = 0; x < columns_; ++x) {
      for (const auto& probe : kProbes) {
        probes.u[k] = (x + probe[0]) * kStepPx - 0.5;
        probes.v[k++] = (y + probe[1]) * kStepPx - 0.5;
      }
    }
    probes.unproject(camera_);
    k = 0;
    for (int x = 0; x < columns_; ++x) {
      const size_t node = static_cast<size_t>(y) * nodes_per_row_ + static_cast<size_t>(x);
      bool smooth = true;
      for (size_t j = 0; j < 4; ++j) {
        for (size_t i = 0; i < 4; ++i) {
          smooth = smooth && has_ray[node + j * nodes_per_row_ + i] != 0;
        }
      }
      for (const auto& probe : kProbes) {
        const size_t here = k++;
        if (!smooth) continue;
        if (probes.valid[here] == 0) {
          smooth = false;
          continue;
        }
        const RaySample sample =
            interpolate({0, node, static_cast<float>(probe[0]), static_cast<float>(probe[1])});
        const Eigen::Vector3d exact(probes.x[here], probes.y[here], probes.z[here]);
        const double err_px = (sample.ray - exact).norm() * sample.pxPerRad();
        const auto J = camera_.jacobian(exact);
        smooth = !DLSD_MUTANT("invalid-ray-table") && J &&
                 (err_px * kSafety <= kMaxErrPx || DLSD_MUTANT("ray-table-smooth"));
        if (!smooth) continue;
        Eigen::Matrix<double, 3, 2> D;
        D << sample.du, sample.dv;
        smooth = (*J * D - Eigen::Matrix2d::Identity()).norm() * kSafety <= kMaxErrPx ||
                 DLSD_MUTANT("ray-table-smooth");
      }
      smooth_[static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x)] =
          static_cast<uint8_t>(smooth);
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
