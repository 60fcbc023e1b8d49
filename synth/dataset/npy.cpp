#include "synth/dataset/npy.h"

#include <bit>

namespace dlsd {

static_assert(std::endian::native == std::endian::little, "values are written as they are");

std::string npyBytes(std::string_view type,
                     std::span<const size_t> shape,
                     std::span<const std::byte> values) {
  std::string header = "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (";
  for (const size_t n : shape) {
    header += std::to_string(n);
    header += ", ";
  }
  if (shape.size() > 1) header.resize(header.size() - 2);
  header += "), }";
  // Magic, version and length take 10 bytes; the values start at a multiple of 64.
  header.append(63 - (10 + header.size()) % 64, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() % 256);
  bytes += static_cast<char>(header.size() / 256);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size());
  return bytes;
}

}  // namespace dlsd
