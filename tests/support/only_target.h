#pragma once

#include <hwy/highway.h>

#include <cstdint>
#include <vector>

namespace lowlux::test {

/// Restricts vector kernels to one instruction set, for the lifetime of the object.
class OnlyTarget {
 public:
  explicit OnlyTarget(std::int64_t target) { choose(target); }
  ~OnlyTarget() { choose(0); }
  OnlyTarget(const OnlyTarget&) = delete;
  OnlyTarget& operator=(const OnlyTarget&) = delete;

 private:
  static void choose(std::int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

/// Returns the processor's instruction sets that the kernels are compiled for, best first: SSSE3 and better on x86.
/// Highway has the better one in the lower bit, and newer versions have more of them.
inline std::vector<std::int64_t> kernel_targets() {
  std::vector<std::int64_t> out;
  for (std::int64_t target = 1; target <= HWY_SSSE3; target *= 2) {
    if ((hwy::SupportedTargets() & HWY_TARGETS & target) != 0) out.push_back(target);
  }
  return out;
}

}  // namespace lowlux::test
