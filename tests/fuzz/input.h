#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

/// The function of a fuzz target: libFuzzer calls one by its own name, fuzz_replay holds all of them.
#ifdef LOWLUX_FUZZ_REPLAY
#define LOWLUX_FUZZ_TARGET(name) extern "C" int name##_fuzz_input
#else
#define LOWLUX_FUZZ_TARGET(name) extern "C" int LLVMFuzzerTestOneInput
#endif

namespace lowlux::test {

inline void require(bool good) {
  if (!good) std::abort();
}

/// A fuzzer's input as figures, one after the other; what is left at its end is zeros.
struct FuzzInput {
  const std::uint8_t* data;
  std::size_t left;

  void copy(void* to, std::size_t bytes) {
    const std::size_t n = std::min(left, bytes);
    if (n > 0) std::memcpy(to, data, n);
    data += n;
    left -= n;
  }
  template <class T>
  T take() {
    T out{};
    copy(&out, sizeof out);
    return out;
  }
  /// 0 to n - 1.
  int below(int n) { return take<std::uint8_t>() % n; }
};

}  // namespace lowlux::test
