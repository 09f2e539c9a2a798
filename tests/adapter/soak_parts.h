#pragma once

#include <dlfcn.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <type_traits>

#include "isp/adapter/lowlux_stage.h"

/// What the soak stands on: the loaded functions, and chance.
namespace lowlux {

// NOLINTNEXTLINE(bugprone-macro-parentheses): a member is declared
#define LOWLUX_FUNCTION(name) decltype(&lowlux_stage_##name) name = nullptr
/// The stage's functions, as a program that loads the library by name has them.
struct Functions {
  LOWLUX_FUNCTION(open);
  LOWLUX_FUNCTION(configure);
  LOWLUX_FUNCTION(process);
  LOWLUX_FUNCTION(reset);
  LOWLUX_FUNCTION(release);
  LOWLUX_FUNCTION(last_error);
};
#undef LOWLUX_FUNCTION

inline Functions load(const char* file) {
  void* const library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) std::fprintf(stderr, "%s\n", dlerror()), std::exit(2);
  Functions f;
  const auto find = [&](const char* name, auto& function) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
    if (function == nullptr) std::fprintf(stderr, "%s: no %s\n", file, name), std::exit(2);
  };
  find("lowlux_stage_open", f.open);
  find("lowlux_stage_configure", f.configure);
  find("lowlux_stage_process", f.process);
  find("lowlux_stage_reset", f.reset);
  find("lowlux_stage_release", f.release);
  find("lowlux_stage_last_error", f.last_error);
  return f;
}

/// splitmix64 (Steele, Lea and Flood 2014).
struct Chance {
  std::uint64_t state;
  std::uint64_t next() {
    std::uint64_t z = (state += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }
  int below(int n) { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }
  int from(int low, int high) { return low + below(high - low + 1); }
  bool one_in(int n) { return below(n) == 0; }
  double share() { return static_cast<double>(next() >> 11U) * 0x1p-53; }
};

}  // namespace lowlux
