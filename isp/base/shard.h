#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace lowlux {

/// Selects every count-th of numbered pieces of work, beginning with the number-th: the share of one of `count` tasks.
struct Shard {
  std::uint64_t number = 1;  // 1..count
  std::uint64_t count = 1;   // up to 2^63

  /// Removes the pieces that are not in it, and keeps the order of the others.
  template <class Piece>
  void select(std::vector<Piece>& pieces) const {
    std::vector<Piece> chosen;
    for (std::uint64_t i = number - 1; i < pieces.size(); i += count) {
      chosen.push_back(std::move(pieces[static_cast<std::size_t>(i)]));
    }
    pieces = std::move(chosen);
  }
};

}  // namespace lowlux
