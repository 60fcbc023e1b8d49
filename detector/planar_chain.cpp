#include "detector/planar_chain.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace dlsd {

void splitPlanar(const ChainRays& chain,
                 const PlanarChainOptions& options,
                 std::vector<PlanarPiece>* pieces) {
  pieces->clear();
  const int size = chain.size();
  int previous_end = 0;
  for (int begin = 0; begin + options.seed_px <= size;) {
    int end = begin + options.seed_px;
    std::optional<PlaneFit> fit = fitPlane(chain.moments.interval(begin, end));
    bool planar = fit.has_value();
    for (int i = begin; planar && i < end; ++i) {
      planar = chain.errPx(i, fit->normal) <= options.max_err_px;
    }
    if (!planar) {
      begin += 2;
      continue;
    }
    // Refit each time the piece has grown by a quarter, and once more where it stops.
    int fitted_end = end;
    for (;;) {
      const int refit_at = fitted_end + std::max(4, (fitted_end - begin) / 4);
      int next = end;
      for (int misses = 0; next < std::min(size, refit_at) && misses <= options.max_outliers;
           ++next) {
        if (chain.errPx(next, fit->normal) <= options.max_err_px) {
          end = next + 1;
          misses = 0;
        } else {
          ++misses;
        }
      }
      if (end == fitted_end) break;
      fit = fitPlane(chain.moments.interval(begin, end));
      if (!fit) break;
      fitted_end = end;
    }
    // Backwards into what earlier seeds skipped.
    if (fit) {
      const int seed_begin = begin;
      while (begin > previous_end && chain.errPx(begin - 1, fit->normal) <= options.max_err_px) {
        --begin;
      }
      if (begin < seed_begin) fit = fitPlane(chain.moments.interval(begin, end));
    }
    if (fit) {
      const double weight = end - begin;
      pieces->push_back({begin, end, fit->normal, std::sqrt(fit->squared_residuals / weight)});
    }
    previous_end = end;
    begin = end;
  }
}

}  // namespace dlsd
