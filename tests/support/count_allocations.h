#pragma once

#include <malloc.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

/// These functions count what a program allocates, and the bytes it holds at once. One file of the program includes
/// this header: operator new can be replaced once.
namespace lowlux::test {

inline std::atomic<long> allocations{0};
inline std::atomic<long> held_bytes{0};
inline std::atomic<long> max_held_bytes{0};  // since it was last set

/// Counts a block of memory as held from now on.
inline void hold(void* memory) noexcept {
  const auto bytes = static_cast<long>(malloc_usable_size(memory));
  const long held = held_bytes.fetch_add(bytes) + bytes;
  long most = max_held_bytes.load();
  while (most < held && !max_held_bytes.compare_exchange_weak(most, held)) continue;
}

inline void* counted_or_null(std::size_t size) noexcept {
  ++allocations;
  void* const memory = std::malloc(size);
  hold(memory);
  return memory;
}

inline void given_back(void* memory) noexcept {
  held_bytes -= static_cast<long>(malloc_usable_size(memory));
  std::free(memory);
}

inline void* counted(std::size_t size) {
  if (void* memory = counted_or_null(size)) return memory;
  throw std::bad_alloc();
}

}  // namespace lowlux::test

// Every allocation of the program, of any thread, passes here.
void* operator new(std::size_t size) { return lowlux::test::counted(size); }
void* operator new[](std::size_t size) { return lowlux::test::counted(size); }
void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  return lowlux::test::counted_or_null(size);
}
void* operator new[](std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  return lowlux::test::counted_or_null(size);
}
void operator delete(void* memory) noexcept { lowlux::test::given_back(memory); }
void operator delete[](void* memory) noexcept { lowlux::test::given_back(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { lowlux::test::given_back(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { lowlux::test::given_back(memory); }
