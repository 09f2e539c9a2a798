#include <cassert>
#include <cstddef>

#include "denoise/spatial/rows.h"

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/spatial/pyramid_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "denoise/spatial/dct-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

/// Returns the sums of 2x2 cells.
HWY_INLINE VF sum4(const float* const rows[2], int i) {
  VF even0, odd0, even1, odd1;
  hn::LoadInterleaved2(Floats(), rows[0] + 2 * i, even0, odd0);
  hn::LoadInterleaved2(Floats(), rows[1] + 2 * i, even1, odd1);
  return hn::Add(hn::Add(even0, odd0), hn::Add(even1, odd1));
}

void Down2(const float* const in[2], int out_cells, float scale, float* out) {
  for (int i = 0; i < out_cells; i += lanes()) store(hn::Mul(constant(0.25f * scale), sum4(in, i)), out + i);
}

void Difference(const float* const fine[2], const float* coarse, int cells, float* out) {
  for (int i = 0; i < cells; i += lanes()) {
    store(hn::NegMulAdd(constant(0.25f), sum4(fine, i), load(coarse + i)), out + i);
  }
}

/// Repeats the ends of a row of cells: `row` can be read from -1 to cells.
HWY_INLINE void repeat_ends(float* row, int cells) {
  row[-1] = row[0];
  row[cells] = row[cells - 1];
}

/// Computes three quarters of each cell plus one quarter of its left or right neighbour.
template <bool kAdd>
HWY_INLINE void up_columns(const float* row, int cells, float* out) {
  const Floats f;
  for (int i = 0; i < cells; i += lanes()) {
    const VF three = hn::Mul(constant(0.75f), load(row + i)), quarter = constant(0.25f);
    VF even = hn::MulAdd(quarter, load(row + i - 1), three), odd = hn::MulAdd(quarter, load(row + i + 1), three);
    if constexpr (kAdd) {
      VF even_before, odd_before;
      hn::LoadInterleaved2(f, out + 2 * i, even_before, odd_before);
      even = hn::Add(even, even_before);
      odd = hn::Add(odd, odd_before);
    }
    hn::StoreInterleaved2(even, odd, f, out + 2 * i);
  }
}

HWY_INLINE VF binomial(VF before, VF at, VF after) {
  return hn::MulAdd(constant(0.5f), at, hn::Mul(constant(0.25f), hn::Add(before, after)));
}

void AddCorrection(const UpRow& in, float* scratch, float* inout) {
  float* const vertical = scratch + 16;
  float* const smooth = vertical + in.coarse_cells + padding;
  const int n = in.coarse_cells;
  for (int i = 0; i < n; i += lanes()) {
    const VF near = binomial(load(in.near[0] + i), load(in.near[1] + i), load(in.near[2] + i));
    const VF far = binomial(load(in.far[0] + i), load(in.far[1] + i), load(in.far[2] + i));
    store(hn::MulAdd(constant(0.75f), near, hn::Mul(constant(0.25f), far)), vertical + i);
  }
  repeat_ends(vertical, n);
  for (int i = 0; i < n; i += lanes()) {
    store(binomial(load(vertical + i - 1), load(vertical + i), load(vertical + i + 1)), smooth + i);
  }
  repeat_ends(smooth, n);
  up_columns<true>(smooth, n, inout);
}

void Smooth(const UpRow& in, float* scratch, float* out) {
  float* const vertical = scratch + 16;
  for (int i = 0; i < in.coarse_cells; i += lanes()) {
    store(hn::MulAdd(constant(0.75f), load(in.near[1] + i), hn::Mul(constant(0.25f), load(in.far[1] + i))),
          vertical + i);
  }
  repeat_ends(vertical, in.coarse_cells);
  up_columns<false>(vertical, in.coarse_cells, out);
}

void Blend(const float* coarse, const float* share, int cells, float* inout) {
  for (int i = 0; i < cells; i += lanes()) {
    const VF part = load(share + i), own = hn::Mul(hn::Sub(constant(1), part), load(inout + i));
    store(hn::MulAdd(part, load(coarse + i), own), inout + i);
  }
}

void AddResidual(const float* own, const float* share, int cells, float* inout) {
  for (int i = 0; i < cells; i += lanes()) {
    store(hn::MulAdd(hn::Sub(constant(1), load(share + i)), load(own + i), load(inout + i)), inout + i);
  }
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(Down2);
HWY_EXPORT(Difference);
HWY_EXPORT(AddCorrection);
HWY_EXPORT(Smooth);
HWY_EXPORT(Blend);
HWY_EXPORT(AddResidual);

void down2_row(const float* const in[2], int out_cells, float scale, float* out) {
  HWY_DYNAMIC_DISPATCH(Down2)(in, out_cells, scale, out);
}
void difference_row(const float* const fine[2], const float* coarse, int cells, float* out) {
  HWY_DYNAMIC_DISPATCH(Difference)(fine, coarse, cells, out);
}
std::size_t up_scratch(int coarse_cells) { return 16 + 2 * (static_cast<std::size_t>(coarse_cells) + padding); }
void add_correction_row(const UpRow& in, const RowScratch& scratch, float* inout) {
  assert(scratch.floats >= up_scratch(in.coarse_cells));
  HWY_DYNAMIC_DISPATCH(AddCorrection)(in, scratch.data, inout);
}
void smooth_row(const UpRow& in, const RowScratch& scratch, float* out) {
  assert(scratch.floats >= up_scratch(in.coarse_cells));
  HWY_DYNAMIC_DISPATCH(Smooth)(in, scratch.data, out);
}
void blend_row(const float* coarse, const float* share, int cells, float* inout) {
  HWY_DYNAMIC_DISPATCH(Blend)(coarse, share, cells, inout);
}
void add_residual_row(const float* own, const float* share, int cells, float* inout) {
  HWY_DYNAMIC_DISPATCH(AddResidual)(own, share, cells, inout);
}

}  // namespace lowlux::denoise::rows
#endif
