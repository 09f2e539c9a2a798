#pragma once

#include <cstddef>

namespace lowlux {

/// Asks the system for huge pages in large memory that has not been touched yet: with small ones, much of the time of
/// developing a frame goes into handing them out and taking them back. Without effect on small memory, and where the
/// system has none.
void prefer_huge_pages(void* memory, std::size_t bytes) noexcept;

}  // namespace lowlux
