#include "isp/base/memory.h"

#include <cassert>
#include <cstdint>
#include <cstring>

#include <sys/mman.h>

#if defined(LOWLUX_ADDRESS_SANITIZED)
#include <sanitizer/asan_interface.h>
#endif

namespace lowlux {
namespace {

#if defined(LOWLUX_ADDRESS_SANITIZED)
void poison(const Scratch& s) { ASAN_POISON_MEMORY_REGION(s.data, s.bytes + scratch_guard_bytes); }
void unpoison(const Scratch& s) { ASAN_UNPOISON_MEMORY_REGION(s.data, s.bytes); }
void mark_guard(const Scratch& /*s*/) {}
[[maybe_unused]] bool is_guard_marked(const Scratch& /*s*/) { return true; }
#else
constexpr unsigned char guard_mark = 0xA7;
void poison(const Scratch& /*s*/) {}
void unpoison(const Scratch& /*s*/) {}
unsigned char* guard_of(const Scratch& s) { return static_cast<unsigned char*>(s.data) + s.bytes; }
void mark_guard(const Scratch& s) { std::memset(guard_of(s), guard_mark, scratch_guard_bytes); }
[[maybe_unused]] bool is_guard_marked(const Scratch& s) {
  for (std::size_t i = 0; i < scratch_guard_bytes; ++i) {
    if (guard_of(s)[i] != guard_mark) return false;
  }
  return true;
}
#endif

}  // namespace

void close_scratch(const Scratch& scratch) noexcept {
  mark_guard(scratch);
  poison(scratch);
}

ScratchUse::ScratchUse(const Scratch& scratch) noexcept : scratch_(scratch) {
  unpoison(scratch);
  std::memset(scratch.data, 0, scratch.bytes);
}

ScratchUse::~ScratchUse() {
  assert(is_guard_marked(scratch_));
  poison(scratch_);
}

void prefer_huge_pages(void* memory, std::size_t bytes) noexcept {
  constexpr std::uintptr_t page = std::uintptr_t{2} << 20, least = 2 * page;
  if (bytes < least) return;
  // Only complete pages are advised: the memory next to them belongs to other allocations.
  const std::uintptr_t before = (page - reinterpret_cast<std::uintptr_t>(memory) % page) % page;
  const std::uintptr_t whole = (bytes - before) / page * page;
  madvise(static_cast<std::byte*>(memory) + before, whole, MADV_HUGEPAGE);  // a hint: the system may refuse it
}

}  // namespace lowlux
