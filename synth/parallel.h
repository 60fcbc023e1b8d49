#pragma once
// Work on bands of image rows, by as many threads as the caller's task arena has.

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace dlsd {

inline constexpr int kBandRows = 32;

[[nodiscard]] constexpr int bandCount(int rows) {
  return (rows + kBandRows - 1) / kBandRows;
}

/// Calls function(band, first_row, end_row) for every band of kBandRows rows: for every one, also
/// if the caller is part of work that is being cancelled. A thread that waits for the others takes
/// up no work from outside, so frames in flight don't pile up.
template <class Function>
void forEachBand(int rows, const Function& function) {
  tbb::this_task_arena::isolate([&] {
    tbb::task_group_context context(tbb::task_group_context::isolated);
    tbb::parallel_for(
        0,
        bandCount(rows),
        [&](int band) {
          const int first = band * kBandRows;
          function(band, first, std::min(rows, first + kBandRows));
        },
        context);
  });
}

}  // namespace dlsd
