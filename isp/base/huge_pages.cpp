#include "isp/base/huge_pages.h"

#include <cstdint>

#include <sys/mman.h>

namespace lowlux {

void prefer_huge_pages(void* memory, std::size_t bytes) noexcept {
  constexpr std::uintptr_t page = std::uintptr_t{2} << 20, least = 2 * page;
  if (bytes < least) return;
  // Only what lies in whole pages: what is beside it is someone else's.
  const std::uintptr_t before = (page - reinterpret_cast<std::uintptr_t>(memory) % page) % page;
  const std::uintptr_t whole = (bytes - before) / page * page;
  madvise(static_cast<std::byte*>(memory) + before, whole, MADV_HUGEPAGE);  // a wish: it may be refused
}

}  // namespace lowlux
