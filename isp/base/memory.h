#pragma once

#include <cstddef>

/// LOWLUX_SANITIZED is defined if the address, thread or memory sanitizer manages the heap, and
/// LOWLUX_ADDRESS_SANITIZED if it is the address sanitizer. GCC and clang have different macros for this.
#if defined(__SANITIZE_ADDRESS__)
#define LOWLUX_ADDRESS_SANITIZED 1
#elif defined(__SANITIZE_THREAD__)
#define LOWLUX_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define LOWLUX_ADDRESS_SANITIZED 1
#elif __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define LOWLUX_SANITIZED 1
#endif
#endif
#if defined(LOWLUX_ADDRESS_SANITIZED)
#define LOWLUX_SANITIZED 1
#endif

namespace lowlux {

/// Describes scratch memory for one use by one thread: rows of kernels, intermediate sums. It holds nothing between
/// uses.
struct Scratch {
  void* data = nullptr;
  std::size_t bytes = 0;
};

/// Sets the number of bytes between two scratch areas, and after the last, that belong to neither.
inline constexpr std::size_t scratch_guard_bytes = 64;

/// Prepares newly allocated scratch memory, and its guard, for ScratchUse.
void close_scratch(const Scratch& scratch) noexcept;

/// Grants the use of scratch memory, which begins as zeros, so that data of earlier uses cannot matter. Outside of a
/// use the address sanitizer reports every access; debug builds check at its end that the guard is unchanged.
class ScratchUse {
 public:
  explicit ScratchUse(const Scratch& scratch) noexcept;
  ~ScratchUse();
  ScratchUse(const ScratchUse&) = delete;
  ScratchUse& operator=(const ScratchUse&) = delete;

 private:
  Scratch scratch_;
};

/// Asks the system for huge pages in large memory that has not been touched yet: with small pages, allocating and
/// freeing them takes much of the time of developing a frame. Has no effect on small memory, and where the system has
/// no huge pages.
void prefer_huge_pages(void* memory, std::size_t bytes) noexcept;

}  // namespace lowlux
