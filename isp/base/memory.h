#pragma once

#include <cstddef>

/// LOWLUX_SANITIZED is defined where the address, thread or memory sanitizer has the heap, and LOWLUX_ADDRESS_SANITIZED
/// where it is the first of them. GCC and clang say so in different words.
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

/// Asks the system for huge pages in large memory that has not been touched yet: with small ones, much of the time of
/// developing a frame goes into handing them out and taking them back. Without effect on small memory, and where the
/// system has none.
void prefer_huge_pages(void* memory, std::size_t bytes) noexcept;

}  // namespace lowlux
