#pragma once
// NumPy's array files.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace dlsd {

/// Bytes of an .npy file (format 1.0, little endian): `type` as in "<f4"; `values` as in memory,
/// row-major.
[[nodiscard]] std::string npyBytes(std::string_view type,
                                   std::span<const size_t> shape,
                                   std::span<const std::byte> values);

template <class T>
[[nodiscard]] std::string npyBytes(std::span<const size_t> shape, std::span<const T> values) {
  static_assert(std::is_same_v<T, float> || std::is_same_v<T, int32_t>);
  return npyBytes(std::is_same_v<T, float> ? "<f4" : "<i4", shape, std::as_bytes(values));
}

}  // namespace dlsd
