#pragma once

#include <array>
#include <cstdint>

namespace lowlux {

/// Computes Philox4x32-10 (Salmon, Moraes, Dror, Shaw: "Parallel random numbers: as easy as 1, 2, 3", SC11): a
/// bijection of the 128-bit counter for each key, whose outputs serve as independent random words.
constexpr std::array<std::uint32_t, 4> philox4x32_10(std::array<std::uint32_t, 4> counter,
                                                     std::array<std::uint32_t, 2> key) {
  auto& [c0, c1, c2, c3] = counter;
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t p = 0xD2511F53ULL * c0, q = 0xCD9E8D57ULL * c2;
    c0 = static_cast<std::uint32_t>(q >> 32) ^ c1 ^ key[0];
    c1 = static_cast<std::uint32_t>(q);
    c2 = static_cast<std::uint32_t>(p >> 32) ^ c3 ^ key[1];
    c3 = static_cast<std::uint32_t>(p);
    key[0] += 0x9E3779B9U;
    key[1] += 0xBB67AE85U;
  }
  return counter;
}

}  // namespace lowlux
