#include "synth/pixel_response.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "cameras/mutant.h"
#include "synth/parallel.h"

namespace dlsd {
namespace {

/// The ramp max(0, t), blurred by a Gaussian that is cut at 4 sigma and normalised.
double blurredRamp(double t, double sigma) {
  if (!(std::abs(t) < 4 * sigma)) return std::max(0.0, t);
  const auto cumulative = [](double x) { return std::erfc(-x / std::sqrt(2.0)) / 2; };
  const auto density = [](double x) { return std::exp(-0.5 * x * x) / std::sqrt(2 * M_PI); };
  const double x = t / sigma, cut = cumulative(-4);
  return sigma * (x * cumulative(x) + density(x) - density(4) - x * cut) / (1 - 2 * cut);
}

/// Square of 1 px convolved with a Gaussian and with the mean over `cell` px, in one dimension.
double blurredBox(double x, double sigma, double cell) {
  if (cell > 0) {
    const double a = (1 + cell) / 2, b = (1 - cell) / 2;
    return (blurredRamp(x + a, sigma) - blurredRamp(x + b, sigma) - blurredRamp(x - b, sigma) +
            blurredRamp(x - a, sigma)) /
           cell;
  }
  if (!(sigma > 0)) return std::abs(x) < 0.5 ? 1 : (std::abs(x) == 0.5 ? 0.5 : 0);
  const double mass = std::erf(4 / std::sqrt(2.0));
  const auto cumulative = [&](double t) {
    return std::erf(std::clamp(t / sigma, -4.0, 4.0) / std::sqrt(2.0)) / mass / 2;
  };
  return cumulative(x + 0.5) - cumulative(x - 0.5);
}

/// Terms of the defocus disc smeared by the blurred box: f_r(x) = sum_j box(x - x_j) g_jr.
struct DiscTerms {
  double cell = 0;             ///< Side of the disc's grid cells, px; 0 without a disc.
  std::vector<double> places;  ///< x_j, the cells' centres.
  Eigen::MatrixXd weights;     ///< g_jr
  std::vector<double> signs;
};

/// The disc convolved with the blurred box on both axes, as a sum of separable terms. In the cells
/// of a grid the disc is a symmetric matrix D, its convolution K = A D A^T at the grid points. K's
/// eigenvectors f of eigenvalue lambda are A g with g = D A^T f / lambda, so that f is known
/// between the grid points too.
DiscTerms discTerms(double sigma, double radius) {
  if (!(radius > 0)) return {0, {0}, Eigen::MatrixXd::Ones(1, 1), {1}};
  // As fine as 256 cells across the response allow. The disc's rim is smeared by that much, which
  // only shows without any Gaussian.
  const double reach = radius + 0.5 + 4 * sigma;
  const double step = std::clamp(std::exp2(std::ceil(std::log2(reach / 128))), 1.0 / 64, 1.0 / 8);
  const auto half_disc = static_cast<Eigen::Index>(std::ceil(radius / step));
  const auto half_grid = static_cast<Eigen::Index>(std::ceil(reach / step));
  const Eigen::Index n = 2 * half_disc + 1, m = 2 * half_grid + 1;
  // Shares of the disc's area in the grid's cells: widths of the disc at 16 heights of each row.
  Eigen::MatrixXd disc = Eigen::MatrixXd::Zero(n, n);
  constexpr int kHeights = 16;
  for (Eigen::Index j = 0; j < n; ++j) {
    for (int k = 0; k < kHeights; ++k) {
      const double y = (static_cast<double>(j - half_disc) + (k + 0.5) / kHeights - 0.5) * step;
      const double width2 = radius * radius - y * y;
      if (!(width2 > 0)) continue;
      const double half_width = std::sqrt(width2) / step;
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto x = static_cast<double>(i - half_disc);
        disc(j, i) += std::max(0.0, std::min(x + 0.5, half_width) - std::max(x - 0.5, -half_width));
      }
    }
  }
  disc = (disc + disc.transpose()).eval();
  disc /= disc.sum();
  Eigen::MatrixXd box(m, n);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto offset = static_cast<double>((i - half_grid) - (j - half_disc));
      box(i, j) = blurredBox(offset * step, sigma, step);
    }
  }
  const Eigen::MatrixXd response = box * disc * box.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(response);
  const Eigen::VectorXd& lambda = eigen.eigenvalues();
  std::vector<Eigen::Index> order(static_cast<size_t>(m));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::abs(lambda[a]) > std::abs(lambda[b]);
  });
  const double tolerance = PixelResponse::kMaxTermError * response.maxCoeff();
  Eigen::MatrixXd left = response;  // After the terms so far.
  DiscTerms terms;
  terms.cell = step;
  for (Eigen::Index j = 0; j < n; ++j) {
    terms.places.push_back(static_cast<double>(j - half_disc) * step);
  }
  terms.weights.resize(n, m);
  Eigen::Index count = 0;
  for (size_t k = 0; k < order.size() && left.cwiseAbs().maxCoeff() > tolerance; ++k) {
    const double value = lambda[order[k]];
    const Eigen::VectorXd f = eigen.eigenvectors().col(order[k]);
    left -= value * f * f.transpose();
    terms.weights.col(count++) = disc * (box.transpose() * f) / std::sqrt(std::abs(value));
    terms.signs.push_back(value > 0 ? 1.0 : -1.0);
  }
  terms.weights.conservativeResize(n, count);
  return terms;
}

/// Convolution of rows and columns with one kernel, added to `out` with a sign. Border pixels
/// continue the image.
void convolveSeparably(const std::vector<float>& kernel,
                       float sign,
                       int width,
                       int height,
                       const std::vector<float>& in,
                       std::vector<float>* out) {
  const auto w = static_cast<size_t>(width), taps = kernel.size();
  const int radius = static_cast<int>(taps / 2);
  forEachBand(height, [&](int /*band*/, int first, int end) {
    // The rows that the band's columns reach, convolved along the row.
    const auto clamped = [&](int y) { return static_cast<size_t>(std::clamp(y, 0, height - 1)); };
    std::vector<float> rows(w * static_cast<size_t>(end - first + 2 * radius), 0.0F);
    std::vector<float> padded(w + 2 * static_cast<size_t>(radius));
    for (int y = first - radius; y < end + radius; ++y) {
      const float* source = in.data() + clamped(y) * w;
      std::fill_n(padded.begin(), radius, source[0]);
      std::copy(source, source + w, padded.begin() + radius);
      std::fill_n(padded.rbegin(), radius, source[w - 1]);
      float* row = rows.data() + static_cast<size_t>(y - first + radius) * w;
      for (size_t k = 0; k < taps; ++k) {
        const float weight = kernel[k];
        const float* shifted = padded.data() + k;
        for (size_t x = 0; x < w; ++x) row[x] += weight * shifted[x];
      }
    }
    for (int y = first; y < end; ++y) {
      float* result = out->data() + static_cast<size_t>(y) * w;
      for (size_t k = 0; k < taps; ++k) {
        const float weight = sign * kernel[k];
        const float* row = rows.data() + (static_cast<size_t>(y - first) + k) * w;
        for (size_t x = 0; x < w; ++x) result[x] += weight * row[x];
      }
    }
  });
}

}  // namespace

PixelResponse::PixelResponse(double sigma_px, double defocus_radius_px) {
  double sigma = sigma_px;
  if (sigma_px > kMaxSplatSigmaPx) {
    sigma = kSplitSigmaPx;
    const double rest = std::sqrt(sigma_px * sigma_px - sigma * sigma);
    const int radius = static_cast<int>(std::ceil(4 * rest));
    double sum = 0;
    for (int k = -radius; k <= radius; ++k) sum += std::exp(-0.5 * (k / rest) * (k / rest));
    for (int k = -radius; k <= radius; ++k) {
      rest_.push_back(static_cast<float>(std::exp(-0.5 * (k / rest) * (k / rest)) / sum));
    }
  }
  radius_ = static_cast<int>(std::ceil(4 * sigma + defocus_radius_px));
  const auto taps = static_cast<size_t>(2 * radius_ + 1);
  stride_ = (taps + 7) / 8 * 8;

  const DiscTerms disc = discTerms(sigma, defocus_radius_px);
  const auto terms = disc.signs.size();
  const auto rows = static_cast<Eigen::Index>(kPositions * taps);
  Eigen::MatrixXd values(rows, static_cast<Eigen::Index>(terms));
  Eigen::RowVectorXd boxes(static_cast<Eigen::Index>(disc.places.size()));
  for (Eigen::Index row = 0; row < rows; ++row) {
    const auto tap = static_cast<double>(row % static_cast<Eigen::Index>(taps));
    const auto position = static_cast<double>(row / static_cast<Eigen::Index>(taps));
    const double x = (position + (DLSD_MUTANT("response-shift") ? 0.0 : 0.5)) / kPositions - 0.5 -
                     (tap - radius_);
    for (size_t j = 0; j < disc.places.size(); ++j) {
      boxes[static_cast<Eigen::Index>(j)] = blurredBox(x - disc.places[j], sigma, disc.cell);
    }
    values.row(row) = boxes * disc.weights;
  }
  double integral = 0;
  for (size_t r = 0; r < terms; ++r) {
    const double sum = values.col(static_cast<Eigen::Index>(r)).sum() / kPositions;
    integral += disc.signs[r] * sum * sum;
  }
  values /= std::sqrt(integral);
  for (size_t r = 0; r < terms; ++r) {
    Term term{static_cast<float>(disc.signs[r]),
              std::vector<float>(kPositions * stride_),
              std::vector<float>(taps)};
    std::vector<double> means(taps);
    for (size_t k = 0; k < kPositions; ++k) {
      for (size_t t = 0; t < taps; ++t) {
        const double f =
            values(static_cast<Eigen::Index>(k * taps + t), static_cast<Eigen::Index>(r));
        term.taps[k * stride_ + t] = static_cast<float>(f);
        means[t] += f / kPositions;
      }
    }
    for (size_t t = 0; t < taps; ++t) term.cell[t] = static_cast<float>(means[t]);
    terms_.push_back(std::move(term));
  }
}

void PixelResponse::convolve(int width,
                             int height,
                             const std::vector<float>& in,
                             std::vector<float>* out) const {
  if (radius_ == 0) {
    *out = in;
    return;
  }
  out->assign(in.size(), 0.0F);
  for (const Term& term : terms_) {
    convolveSeparably(term.cell, term.sign, width, height, in, out);
  }
}

void PixelResponse::blurRest(int width, int height, std::vector<float>* image) const {
  if (rest_.empty()) return;
  const std::vector<float> in = *image;
  image->assign(in.size(), 0.0F);
  convolveSeparably(rest_, 1, width, height, in, image);
}

}  // namespace dlsd
