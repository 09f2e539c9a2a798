#include "denoise/lines/line_rows.h"

#include <algorithm>
#include <array>

#if defined(__aarch64__)  // NEON only, as in the other kernels
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/lines/line_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#ifndef LOWLUX_DENOISE_LINE_ROWS
#define LOWLUX_DENOISE_LINE_ROWS
namespace lowlux::denoise::rows {

constexpr int values = 16;
struct Step {
  int first;
  int second;
};

/// The steps of Batcher's odd-even merge sort (K. Batcher, AFIPS Spring Joint Computer Conf. 32 (1968) 307). They do
/// not depend on the values, so that each lane sorts its own.
constexpr auto sorting_steps = [] {
  std::array<Step, 63> steps{};
  std::size_t count = 0;
  for (int run = 1; run < values; run *= 2) {
    for (int step = run; step >= 1; step /= 2) {
      for (int from = step % run; from + step < values; from += 2 * step) {
        for (int i = from; i < std::min(from + step, values - step); ++i) {
          if (i / (2 * run) == (i + step) / (2 * run)) steps[count++] = {i, i + step};
        }
      }
    }
  }
  return steps;
}();

}  // namespace lowlux::denoise::rows
#endif

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

int MedianDifferences(const double* means, std::ptrdiff_t stride, int distance, int count, double* out) {
  const hn::ScalableTag<double> d;
  const int n = static_cast<int>(hn::Lanes(d));
  const auto half = hn::Set(d, 0.5);
  int i = 0;
  for (; i + n <= count; i += n) {
    hn::Vec<decltype(d)> value[values];
    for (int g = 0; g < values; ++g) {
      const double* const at = means + g * stride + i;
      value[g] = hn::Sub(hn::LoadU(d, at + distance), hn::LoadU(d, at));
    }
    for (const Step& step : sorting_steps) {
      const auto low = hn::Min(value[step.first], value[step.second]);
      value[step.second] = hn::Max(value[step.first], value[step.second]);
      value[step.first] = low;
    }
    hn::StoreU(hn::Mul(hn::Add(value[values / 2], value[values / 2 - 1]), half), d, out + i);
  }
  return i;
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {
HWY_EXPORT(MedianDifferences);

int median_differences(const double* means, std::ptrdiff_t stride, int distance, int count, double* out) {
  return HWY_DYNAMIC_DISPATCH(MedianDifferences)(means, stride, distance, count, out);
}

}  // namespace lowlux::denoise::rows
#endif
