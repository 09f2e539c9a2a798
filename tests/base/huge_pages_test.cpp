#include "isp/base/memory.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace lowlux {
namespace {

TEST(HugePages, AreAWishThatLeavesMemoryAsItIs) {
  std::vector<std::uint8_t> memory(std::size_t{9} << 20);
  for (std::size_t i = 0; i < memory.size(); ++i) memory[i] = static_cast<std::uint8_t>(i * 31 >> 3);
  const std::vector<std::uint8_t> before = memory;
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, std::size_t{4} << 20, memory.size() - 77}) {
    prefer_huge_pages(memory.data() + 77, bytes);
    EXPECT_EQ(memory, before) << bytes;
  }
  prefer_huge_pages(nullptr, 0);
}

}  // namespace
}  // namespace lowlux
