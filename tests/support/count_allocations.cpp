#include "tests/support/count_allocations.h"

#include <malloc.h>

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
void hold(void* memory) noexcept {
  const auto bytes = static_cast<long>(malloc_usable_size(memory));
  const long held = held_bytes.fetch_add(bytes) + bytes;
  long most = max_held_bytes.load();
  while (most < held && !max_held_bytes.compare_exchange_weak(most, held)) continue;
}

void* counted_or_null(std::size_t size) noexcept {
  ++allocations;
  void* const memory = std::malloc(size);
  hold(memory);
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

}  // namespace
}  // namespace lowlux::test

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
  lowlux::test::hold(memory);  // for good: its release is not tracked
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
