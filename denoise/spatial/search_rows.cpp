#include <cstddef>
#include <cstdint>

#include "denoise/spatial/rows.h"

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/spatial/search_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "denoise/spatial/dct-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

HWY_INLINE VF number(VF x) {
  const VF v = hn::IfThenElseZero(hn::Eq(x, x), x);
  return hn::Min(hn::Max(v, constant(-1e9f)), constant(1e9f));
}

void PairRow(const float* upper, const float* lower, int width, float* out) {
  const Floats f;
  const int n = lanes();
  int i = 0;
  for (; i + n <= width; i += n) store(hn::Add(number(load(upper + i)), number(load(lower + i))), out + i);
  if (i == width) return;
  HWY_ALIGN float last[2][hn::MaxLanes(Floats())] = {};
  for (int k = 0; i + k < width; ++k) {
    last[0][k] = upper[i + k];
    last[1][k] = lower[i + k];
  }
  store(hn::Add(number(hn::Load(f, last[0])), number(hn::Load(f, last[1]))), out + i);
}

/// Returns the largest of the eight windows one site away from those of columns x and on.
HWY_INLINE VF brightest_beside(const WindowRow& in, int x) {
  VF most = constant(-4e9f);
  for (const float* row : {in.above, in.pair[3], in.below}) {
    for (int i = -1; i <= 1; ++i) {
      if (row == in.pair[3] && i == 0) continue;
      most = hn::Max(most, hn::Add(load(row + x + i), load(row + x + i + 1)));
    }
  }
  return most;
}

int BrightWindows(const WindowRow& in, std::int32_t* columns) {
  const Floats f;
  for (int x = in.first - 6; x < in.last + 6; x += lanes()) {  // vertical sums of windows: the inner three, the others
    const auto two = [&](int k) HWY_ATTR { return hn::Add(load(in.pair[k] + x), load(in.pair[k] + x + 1)); };
    store(hn::Add(two(2), hn::Add(two(3), two(4))), in.inner + x);
    store(hn::Add(hn::Add(two(0), two(1)), hn::Add(two(5), two(6))), in.outer + x);
  }
  int found = 0;
  for (int x = in.first; x < in.last; x += lanes()) {
    VF ring = hn::Zero(f);
    for (int i = -6; i <= 6; i += 2) {
      ring = hn::Add(ring, load(in.outer + x + i));
      if (i < -2 || i > 2) ring = hn::Add(ring, load(in.inner + x + i));
    }
    const VF mean = hn::Mul(constant(1.0f / 40), ring);
    const VF own = hn::Add(load(in.pair[3] + x), load(in.pair[3] + x + 1));
    VF one = hn::Add(hn::Max(mean, constant(in.floor_e)), constant(in.variance_e2));
    if (in.ratio != nullptr) one = hn::Mul(load(in.ratio + x), one);
    const VF excess = hn::Max(hn::Sub(own, mean), hn::Zero(f));
    const auto bright = hn::Ge(hn::Mul(excess, excess), hn::Mul(constant(2 * 1.025f * in.significance), one));
    if (HWY_LIKELY(hn::AllFalse(f, bright))) continue;
    // Rounding of single precision does not matter: the caller decides in double.
    const auto slack = [](VF v) HWY_ATTR { return hn::Mul(constant(1e-5f), hn::Abs(v)); };
    const VF beside = brightest_beside(in, x);
    const auto peak = hn::Ge(hn::Add(own, slack(own)), hn::Sub(beside, slack(beside)));
    HWY_ALIGN float is_bright[hn::MaxLanes(Floats())];
    hn::Store(hn::IfThenElseZero(hn::And(bright, peak), constant(1)), f, is_bright);
    for (int k = 0; k < lanes() && x + k < in.last; ++k) {
      if (is_bright[k] != 0) columns[found++] = x + k;
    }
  }
  return found;
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(PairRow);
HWY_EXPORT(BrightWindows);

void pair_row(const float* upper, const float* lower, int width, float* out) {
  HWY_DYNAMIC_DISPATCH(PairRow)(upper, lower, width, out);
}
int bright_windows(const WindowRow& in, std::int32_t* columns) {
  return HWY_DYNAMIC_DISPATCH(BrightWindows)(in, columns);
}

}  // namespace lowlux::denoise::rows
#endif
