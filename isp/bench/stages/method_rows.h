#pragma once

#include <span>
#include <string>
#include <vector>

#include "isp/bench/bench_stages.h"
#include "isp/bench/methods/method_score.h"

/// Rows of the stage `methods`.
namespace lowlux::isp {

/// One method in one light: means over the scenes.
struct MethodRow {
  std::string light;   // name_of(DenoiseLight)
  std::string method;  // name_of_noise_free and name_of_noisy are not methods
  std::string run_as;  // "program", "function"; empty: not run
  MethodScore score;
  double ms_per_mp = 0;      // wall clock; not a number where nothing was run
  double cpu_ms_per_mp = 0;  // of all threads
  double peak_mib = 0;       // largest resident memory; not a number where it is not known
  int rank = 0;              // by PSNR in its light, 1 the best; 0: the noise-free mosaic, which is not ranked
  bool undominated = false;  // no other method of its light is faster and as good in CIEDE2000, or better and as fast
};

inline constexpr const char* name_of_noise_free = "noise-free";  // the mean of the mosaic: the error of demosaicing
inline constexpr const char* name_of_noisy = "noisy";            // the raw frame as it is given to methods

/// Sorts each light's rows by rank, and sets rank and undominated.
void rank_methods(std::vector<MethodRow>& rows);

/// Returns the rows as a table.
BenchTable methods_table(std::span<const MethodRow> rows);

}  // namespace lowlux::isp
