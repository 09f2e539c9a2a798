#pragma once

#include <cstdint>

namespace lowlux {

/// Selects every count-th of numbered pieces of work, beginning with the number-th: the share of one of `count` tasks.
struct Shard {
  std::uint64_t number = 1;  // 1..count
  std::uint64_t count = 1;   // up to 2^63

  /// Returns whether a piece is in it. @param index  0 for the first piece
  bool has(std::uint64_t index) const { return index % count == number - 1; }
};

}  // namespace lowlux
