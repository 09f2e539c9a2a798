#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

/// Counts what a program allocates. To be included by one file of it: operator new can be replaced once.
namespace lowlux::test {

inline std::atomic<long> allocations{0};

inline void* counted_or_null(std::size_t size) noexcept {
  ++allocations;
  return std::malloc(size);
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
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
