#include "isp/base/huge_pages.h"

#include <cstdint>

#include <sys/mman.h>

namespace lowlux {

void prefer_huge_pages(void* memory, std::size_t bytes) noexcept {
  constexpr std::uintptr_t page = std::uintptr_t{2} << 20, least = 2 * page;
  if (bytes < least) return;
  // Only what lies in whole pages: what is beside it is someone else's.
  const auto begin = reinterpret_cast<std::uintptr_t>(memory);
  const std::uintptr_t first = (begin + page - 1) / page * page, last = (begin + bytes) / page * page;
  madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);  // a wish: it may be refused
}

}  // namespace lowlux
