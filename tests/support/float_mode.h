#pragma once

#if defined(__x86_64__)
#include <xmmintrin.h>
#elif !defined(__aarch64__)
#error "how this processor is told to flush denormals to zero is not known here"
#endif

#include <cstdint>
#include <utility>

#include "isp/base/executor.h"

namespace lowlux::test {

/// States whether numbers below the normal range are kept, as the standard requires, or count as 0 in operands and
/// results: many programs that run in real time switch to that, and a library gets what its caller has.
enum class Denormals : std::uint8_t { kept, flushed };

/// Sets the mode of the calling thread, for the lifetime of the object.
class DenormalsScope {
 public:
  explicit DenormalsScope(Denormals mode) : before_(control()) {
    set_control(mode == Denormals::flushed ? before_ | flush_bits : before_ & ~flush_bits);
  }
  ~DenormalsScope() { set_control(before_); }
  DenormalsScope(const DenormalsScope&) = delete;
  DenormalsScope& operator=(const DenormalsScope&) = delete;

 private:
#if defined(__x86_64__)
  static constexpr std::uint64_t flush_bits = 0x8040;  // MXCSR: results (FTZ) and operands (DAZ)
  static std::uint64_t control() { return _mm_getcsr(); }
  static void set_control(std::uint64_t bits) { _mm_setcsr(static_cast<unsigned>(bits)); }
#else
  static constexpr std::uint64_t flush_bits = 1U << 24;  // FPCR: FZ
  static std::uint64_t control() {
    std::uint64_t bits = 0;
    asm volatile("mrs %0, fpcr" : "=r"(bits));
    return bits;
  }
  static void set_control(std::uint64_t bits) { asm volatile("msr fpcr, %0" : : "r"(bits)); }
#endif
  std::uint64_t before_;
};

/// Runs another executor's threads in one mode: each of them sets it for each item of the work.
class ExecutorInMode final : public Executor {
 public:
  ExecutorInMode(Executor& threads, Denormals mode) : threads_(threads), mode_(mode) {}
  int width() const noexcept override { return threads_.width(); }
  void run(int n, void (*fn)(void* context, int index), void* context) noexcept override {
    struct Call {
      void (*fn)(void*, int);
      void* context;
      Denormals mode;
    } call{fn, context, mode_};
    threads_.run(
        n,
        [](void* of_call, int index) {
          const Call& c = *static_cast<Call*>(of_call);
          const DenormalsScope scope(c.mode);
          c.fn(c.context, index);
        },
        &call);
  }

 private:
  Executor& threads_;
  Denormals mode_;
};

/// Returns what `work` gives in one mode. What it is compared with is computed outside of it.
template <class Work>
auto in_mode(Denormals mode, Work&& work) {
  const DenormalsScope scope(mode);
  return std::forward<Work>(work)();
}

}  // namespace lowlux::test
