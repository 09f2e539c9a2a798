#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "isp/base/random/random.h"

namespace lowlux::test {

/// Returns the FNV-1a hash, 64 bits, over the bytes of a row. Rows are chained by passing the hash on.
template <class T>
std::uint64_t hash_of(std::span<const T> row, std::uint64_t hash = 0xcbf29ce484222325ULL) {
  for (const T& element : row) {
    unsigned char bytes[sizeof(T)];
    std::memcpy(bytes, &element, sizeof(T));
    for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001b3ULL;
  }
  return hash;
}

/// Returns means from 1e-3 to 1e5 in no order, made without rounding: the same bits everywhere.
inline std::vector<float> scattered_means(std::uint32_t y, std::size_t size) {
  std::vector<float> means(size);
  for (std::uint32_t i = 0; i < size; ++i) {
    const PhiloxWords w = words_at({.seed = 99}, i, y);
    const auto mantissa = static_cast<float>((w[0] & 0x7fffff) + 0x800000);  // 2^23 to 2^24
    means[i] = std::ldexp(mantissa, static_cast<int>(w[1] % 27) - 33);       // 2^-10 to 2^17
  }
  return means;
}

}  // namespace lowlux::test
