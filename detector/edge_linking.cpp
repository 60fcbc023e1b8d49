#include "detector/edge_linking.h"

#include <bit>
#include <cstring>

namespace dlsd {
namespace {

static_assert(std::endian::native == std::endian::little, "rows of bits are read as bytes");

/// Bits x - 2 ... x + 2 of a row in bits 0 ... 4: what the next step of an edge may reach.
uint32_t fiveAround(const uint64_t* row, int x) {
  static_assert(UsableMask::kBorderPx >= 2);
  const auto first = static_cast<unsigned>(x) - 2;
  uint32_t word = 0;
  std::memcpy(&word, reinterpret_cast<const uint8_t*>(row) + first / 8, sizeof word);
  return word >> (first % 8) & 31;
}

constexpr uint32_t kCentre = 1U << 2;

/// Offset of the set bit that is nearest to the middle; to the left among equals, or to the right
/// if so preferred.
int nearestOffset(uint32_t bits, int preferred) {
  for (int distance = 1; distance <= 2; ++distance) {
    const uint32_t left = kCentre >> distance, right = kCentre << distance;
    if ((bits & (left | right)) == 0) continue;
    if ((bits & left) == 0) return distance;
    if ((bits & right) == 0) return -distance;
    return preferred > 0 ? distance : -distance;
  }
  return 0;
}

}  // namespace

EdgeLinker::EdgeLinker(int width, const EdgeDrawingOptions& options)
    : options_(options), rows_of_column_(static_cast<size_t>(width)) {}

void EdgeLinker::keep(
    const BitRows& strong, uint32_t first, int start, bool crosses_rows, CrestChains* out) {
  const size_t size = out->across.size() - first;
  if (size >= static_cast<size_t>(options_.min_chain_px)) {
    for (size_t i = 0; i < size; ++i) {
      const int along = start + static_cast<int>(i), across = out->across[first + i];
      if (crosses_rows ? strong.test(across, along) : strong.test(along, across)) {
        out->chains.push_back(
            {first, static_cast<uint32_t>(size), static_cast<uint16_t>(start), crosses_rows});
        return;
      }
    }
  }
  out->across.resize(first);
}

void EdgeLinker::linkRows(const BitRows& strong, BitRows* crests, CrestChains* out) {
  const int height = crests->height;
  for (int y0 = 0; y0 < height; ++y0) {
    for (size_t word = 0; word < crests->words_per_row; ++word) {
      // What starts here has no crest above that leads to it: that one would have taken it.
      for (uint64_t bits = crests->row(y0)[word]; bits != 0; bits = crests->row(y0)[word]) {
        int x = static_cast<int>(64 * word) + std::countr_zero(bits);
        crests->clear(x, y0);
        const auto first = static_cast<uint32_t>(out->across.size());
        out->across.push_back(static_cast<uint16_t>(x));
        int last_step = 0;
        for (int y = y0 + 1; y < height; ++y) {
          uint32_t next = fiveAround(crests->row(y), x);
          if ((next & kCentre) != 0) {
            last_step = 0;
          } else if (next != 0) {
            last_step = nearestOffset(next, last_step);
          } else {
            // A gap of one row.
            if (y + 1 >= height) break;
            next = fiveAround(crests->row(y + 1), x);
            if (next == 0) break;
            const int step = (next & kCentre) != 0 ? 0 : nearestOffset(next, last_step);
            out->across.push_back(static_cast<uint16_t>(x + step / 2));
            last_step = step - step / 2;
            x += step / 2;
            ++y;
          }
          x += last_step;
          crests->clear(x, y);
          out->across.push_back(static_cast<uint16_t>(x));
        }
        keep(strong, first, y0, true, out);
      }
    }
  }
}

void EdgeLinker::linkColumns(const BitRows& strong, BitRows* crests, CrestChains* out) {
  const int width = crests->width, height = crests->height;
  // One step along x; false where the chain ends.
  const auto step = [&](int* x, int* y, int direction, int* last_step) {
    for (int gap = 0; gap < 2; ++gap) {
      const int next = *x + direction * (1 + gap);
      if (next < 0 || next >= width) return false;
      const size_t word = static_cast<size_t>(next) / 64;
      const unsigned shift = static_cast<unsigned>(next) % 64;
      const uint64_t* column = crests->row(0) + word;
      const size_t stride = crests->words_per_row;
      const auto bit = [&](int row) {
        return static_cast<uint32_t>(column[static_cast<size_t>(row) * stride] >> shift & 1);
      };
      // Crests are UsableMask::kBorderPx from the border, hence *y - 2 and *y + 2 exist.
      uint32_t around = bit(*y) << 2;
      if (around == 0) around = bit(*y - 1) << 1 | bit(*y + 1) << 3;
      if (around == 0) around = bit(*y - 2) | bit(*y + 2) << 4;
      if (around == 0) continue;
      const int offset = (around & kCentre) != 0 ? 0 : nearestOffset(around, *last_step);
      if (gap != 0) {
        rows_of_column_[static_cast<size_t>(*x + direction)] =
            static_cast<uint16_t>(*y + offset / 2);
      }
      *x = next;
      *y += offset;
      *last_step = gap != 0 ? offset - offset / 2 : offset;
      crests->clear(*x, *y);
      rows_of_column_[static_cast<size_t>(*x)] = static_cast<uint16_t>(*y);
      return true;
    }
    return false;
  };
  for (int y0 = 0; y0 < height; ++y0) {
    for (size_t word = 0; word < crests->words_per_row; ++word) {
      for (uint64_t bits = crests->row(y0)[word]; bits != 0; bits = crests->row(y0)[word]) {
        const int x0 = static_cast<int>(64 * word) + std::countr_zero(bits);
        crests->clear(x0, y0);
        rows_of_column_[static_cast<size_t>(x0)] = static_cast<uint16_t>(y0);
        int begin = x0, end = x0, y = y0, last_step = 0;
        while (step(&begin, &y, -1, &last_step)) {
        }
        y = y0;
        last_step = 0;
        while (step(&end, &y, +1, &last_step)) {
        }
        const auto first = static_cast<uint32_t>(out->across.size());
        out->across.insert(
            out->across.end(), rows_of_column_.begin() + begin, rows_of_column_.begin() + end + 1);
        keep(strong, first, begin, false, out);
      }
    }
  }
}

void EdgeLinker::link(EdgeMap* map, CrestChains* chains) {
  chains->chains.clear();
  chains->across.clear();
  for (const CrestPlane plane : {kRight, kLeft}) linkRows(map->strong, &map->crests[plane], chains);
  for (const CrestPlane plane : {kDown, kUp}) linkColumns(map->strong, &map->crests[plane], chains);
}

}  // namespace dlsd
