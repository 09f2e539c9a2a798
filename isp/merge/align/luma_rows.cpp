#include "isp/merge/align/luma_rows.h"

#include <cstddef>
#include <cstring>
#include <limits>

#if defined(__aarch64__)  // NEON only, as everywhere
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/merge/align/luma_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::merge::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;
using MF = hn::Mask<Floats>;

HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }
HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }

/// The four values of each of a vector of 2x2 squares.
struct Squares {
  VF a;
  VF b;
  VF c;
  VF d;
};

HWY_INLINE Squares load_squares(const float* upper, const float* lower) {
  VF a, b, c, d;
  hn::LoadInterleaved2(Floats(), upper, a, b);
  hn::LoadInterleaved2(Floats(), lower, c, d);
  return {a, b, c, d};
}

/// Calls work(squares) for all vectors of a pair of rows and stores its results. Nothing is read past the rows.
template <class Work>
HWY_INLINE void for_squares(const float* upper, const float* lower, int count, float* out, const Work& work) {
  int i = 0;
  for (; i + lanes() <= count; i += lanes()) {
    hn::StoreU(work(load_squares(upper + 2 * i, lower + 2 * i)), Floats(), out + i);
  }
  if (i == count) return;
  constexpr std::size_t longest = hn::MaxLanes(Floats());
  HWY_ALIGN float first[2 * longest] = {}, second[2 * longest] = {}, last[longest];
  const std::size_t left = static_cast<std::size_t>(count - i);
  std::memcpy(first, upper + 2 * i, 2 * left * sizeof(float));
  std::memcpy(second, lower + 2 * i, 2 * left * sizeof(float));
  hn::StoreU(work(load_squares(first, second)), Floats(), last);
  std::memcpy(out + i, last, left * sizeof(float));
}

template <bool kGreensOnDiagonal>
HWY_INLINE bool mean_cells_of(const float* upper, const float* lower, int count, float* out) {
  VF all = hn::Zero(Floats());
  for_squares(upper, lower, count, out, [&all](const Squares& s) HWY_ATTR {
    const VF first = kGreensOnDiagonal ? s.a : s.b, second = kGreensOnDiagonal ? s.d : s.c;
    const VF others = kGreensOnDiagonal ? hn::Add(s.b, s.c) : hn::Add(s.a, s.d);
    const VF green1 = hn::IfThenElse(hn::Eq(first, first), first, second);
    const VF green2 = hn::IfThenElse(hn::Eq(second, second), second, first);
    const VF mean = hn::Mul(constant(0.25F), hn::Add(others, hn::Add(green1, green2)));
    all = hn::Add(all, hn::Sub(mean, mean));  // 0, or NaN for ever
    return mean;
  });
  return hn::AllTrue(Floats(), hn::Eq(all, all));
}

bool MeanCells(const float* upper, const float* lower, bool greens_on_diagonal, int count, float* out) {
  return greens_on_diagonal ? mean_cells_of<true>(upper, lower, count, out)
                            : mean_cells_of<false>(upper, lower, count, out);
}

void HalveRow(const float* upper, const float* lower, int count, float* out) {
  const VF one = constant(1), missing = constant(std::numeric_limits<float>::quiet_NaN());
  for_squares(upper, lower, count, out, [=](const Squares& s) HWY_ATTR {
    const MF a = hn::Eq(s.a, s.a), b = hn::Eq(s.b, s.b), c = hn::Eq(s.c, s.c), d = hn::Eq(s.d, s.d);
    const VF n = hn::Add(hn::Add(hn::IfThenElseZero(a, one), hn::IfThenElseZero(b, one)),
                         hn::Add(hn::IfThenElseZero(c, one), hn::IfThenElseZero(d, one)));
    const VF sum = hn::Add(hn::Add(hn::IfThenElseZero(a, s.a), hn::IfThenElseZero(b, s.b)),
                           hn::Add(hn::IfThenElseZero(c, s.c), hn::IfThenElseZero(d, s.d)));
    return hn::IfThenElse(hn::Gt(n, constant(1.5F)), hn::Div(sum, hn::Max(n, one)), missing);
  });
}

}  // namespace lowlux::merge::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::merge::rows {

HWY_EXPORT(HalveRow);
HWY_EXPORT(MeanCells);

bool mean_cells(const float* upper, const float* lower, bool greens_on_diagonal, int count, float* out) {
  return HWY_DYNAMIC_DISPATCH(MeanCells)(upper, lower, greens_on_diagonal, count, out);
}
void halve_row(const float* upper, const float* lower, int count, float* out) {
  HWY_DYNAMIC_DISPATCH(HalveRow)(upper, lower, count, out);
}

}  // namespace lowlux::merge::rows
#endif
