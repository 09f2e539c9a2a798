#pragma once

#include <cerrno>

#include "isp/base/memory.h"
#include "tests/support/count_allocations.h"

// Memory that operator new does not allocate is counted too, where no sanitizer has these functions.
#if !defined(LOWLUX_SANITIZED) && defined(__GLIBC__)
#define LOWLUX_COUNTS_MALLOC 1
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++lowlux::test::allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++lowlux::test::allocations;
  void* const memory = __libc_calloc(count, size);
  lowlux::test::hold(memory);  // for good: its release is not tracked
  return memory;
}
void* realloc(void* memory, std::size_t size) {
  ++lowlux::test::allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++lowlux::test::allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  ++lowlux::test::allocations;
  *memory = __libc_memalign(alignment, size);
  return *memory != nullptr ? 0 : ENOMEM;
}
}
#endif
