#include "tests/support/count_allocations.h"

#include <malloc.h>
#ifdef LOWLUX_COUNTS_BY_HOOKS
#include <sanitizer/allocator_interface.h>
#endif

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace lowlux::test {

std::atomic<long> allocations{0};
std::atomic<long> held_bytes{0};
std::atomic<long> max_held_bytes{0};

namespace {

/// Counts a block of memory as held from now on.
void hold(std::size_t size) noexcept {
  const auto bytes = static_cast<long>(size);
  const long held = held_bytes.fetch_add(bytes) + bytes;
  long most = max_held_bytes.load();
  while (most < held && !max_held_bytes.compare_exchange_weak(most, held)) continue;
}

#ifndef LOWLUX_COUNTS_BY_HOOKS
void* counted_or_null(std::size_t size) noexcept {
  ++allocations;
  void* const memory = std::malloc(size);
  hold(malloc_usable_size(memory));
  return memory;
}

void given_back(void* memory) noexcept {
  held_bytes -= static_cast<long>(malloc_usable_size(memory));
  std::free(memory);
}

void* counted(std::size_t size) {
  if (void* memory = counted_or_null(size)) return memory;
  throw std::bad_alloc();
}

#endif

}  // namespace
}  // namespace lowlux::test

#ifdef LOWLUX_COUNTS_BY_HOOKS
extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier): names of the sanitizers' interface
void __sanitizer_malloc_hook(const volatile void* /*memory*/, std::size_t size) {
  ++lowlux::test::allocations;
  lowlux::test::hold(size);
}
void __sanitizer_free_hook(const volatile void* memory) {
  lowlux::test::held_bytes -= static_cast<long>(__sanitizer_get_allocated_size(memory));
}
// NOLINTEND(bugprone-reserved-identifier)
}
#else
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
#endif

#ifdef LOWLUX_COUNTS_MALLOC
extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier): glibc's own names
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
// NOLINTEND(bugprone-reserved-identifier)

void* malloc(std::size_t size) {
  ++lowlux::test::allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t nmemb, std::size_t size) {
  ++lowlux::test::allocations;
  void* const memory = __libc_calloc(nmemb, size);
  lowlux::test::hold(malloc_usable_size(memory));  // for good: its release is not tracked
  return memory;
}
void* realloc(void* ptr, std::size_t size) {
  ++lowlux::test::allocations;
  return __libc_realloc(ptr, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++lowlux::test::allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memptr, std::size_t alignment, std::size_t size) {
  ++lowlux::test::allocations;
  *memptr = __libc_memalign(alignment, size);
  return *memptr != nullptr ? 0 : ENOMEM;
}
}
#endif
