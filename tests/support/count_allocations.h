#pragma once

#include <atomic>

#include "isp/base/memory.h"

// Memory that operator new does not allocate is counted too, where no sanitizer has malloc and its relatives.
#if !defined(LOWLUX_SANITIZED) && defined(__GLIBC__)
#define LOWLUX_COUNTS_MALLOC 1
#endif
// clang's thread sanitizer has operators that no program can replace; it calls hooks.
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define LOWLUX_COUNTS_BY_HOOKS 1
#endif
#endif

/// These count what a program of which count_allocations.cpp is a source allocates, in any thread, and the bytes it
/// holds at once.
namespace lowlux::test {

extern std::atomic<long> allocations;
extern std::atomic<long> held_bytes;
extern std::atomic<long> max_held_bytes;  // since it was last set

}  // namespace lowlux::test
