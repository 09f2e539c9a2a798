#pragma once

#include <cstddef>

namespace lowlux {

/// Scratch memory of one use by one thread: kernels' rows, sums on their way to a result. It holds nothing between
/// uses.
struct Scratch {
  void* data = nullptr;
  std::size_t bytes = 0;
};

/// Bytes between two pieces of scratch memory, and after the last, that belong to neither.
inline constexpr std::size_t scratch_guard_bytes = 64;

/// Makes scratch memory that was just allocated, and its guard, ready for ScratchUse.
void close_scratch(const Scratch& scratch) noexcept;

/// The right to use scratch memory, which begins as zeros: what another use left there cannot matter. Outside of it the
/// address sanitizer reports every access; debug builds check at its end that the guard is as it was.
class ScratchUse {
 public:
  explicit ScratchUse(const Scratch& scratch) noexcept;
  ~ScratchUse();
  ScratchUse(const ScratchUse&) = delete;
  ScratchUse& operator=(const ScratchUse&) = delete;

 private:
  Scratch scratch_;
};

}  // namespace lowlux
