#include "isp/base/memory.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <vector>

namespace lowlux {
namespace {

/// Scratch memory of 256 bytes with its guard.
struct Owned {
  Owned() { close_scratch(scratch); }
  ~Owned() { const ScratchUse open(scratch); }  // the vector's own destructor may look at its bytes
  std::vector<std::byte> memory{256 + scratch_guard_bytes};
  Scratch scratch{memory.data(), 256};
};

TEST(Scratch, BeginsAsZerosWhateverTheUseBeforeLeft) {
  const Owned owned;
  for (int use = 0; use < 3; ++use) {
    const ScratchUse open(owned.scratch);
    auto* const bytes = static_cast<unsigned char*>(owned.scratch.data);
    for (std::size_t i = 0; i < owned.scratch.bytes; ++i) ASSERT_EQ(bytes[i], 0);
    std::memset(bytes, 0xff, owned.scratch.bytes);
  }
}

#ifndef NDEBUG
TEST(ScratchDeathTest, WritingBehindItEndsTheProgram) {
  const Owned owned;
  EXPECT_DEATH(
      {
        const ScratchUse open(owned.scratch);
        static_cast<volatile char*>(owned.scratch.data)[owned.scratch.bytes] = 1;
      },
      "is_guard_marked|use-after-poison");
}
#endif

#if defined(LOWLUX_ADDRESS_SANITIZED)
TEST(ScratchDeathTest, ReadingItOutsideOfAUseEndsTheProgram) {
  const Owned owned;
  EXPECT_DEATH(static_cast<volatile char*>(owned.scratch.data)[7], "use-after-poison");
}
#endif

}  // namespace
}  // namespace lowlux
