#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>

#include "denoise/spatial/rows.h"

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/spatial/shrink_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "denoise/spatial/strip-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

/// Memory for one plane's row of blocks. Before the first block and after the last, weights are 0.
struct RowMemory {
  Strip* strip;
  float* cells;     // one row of half width
  float* variance;  // variance of each block
  float* weight;    // weights of each block
  float* residual;  // weight times remaining variance
};

std::size_t memory_row(int cells) { return (static_cast<std::size_t>(cells) + padding + 15) / 16 * 16; }

HWY_INLINE RowMemory row_memory(float* scratch, int row) {
  const auto size = static_cast<std::size_t>(row);
  float* const after = scratch + (sizeof(Strip) / sizeof(float) + 15) / 16 * 16;
  return {reinterpret_cast<Strip*>(scratch), after, after + size, after + 2 * size + 16, after + 3 * size + 16};
}

/// Computes the mean variance of each block, from four rows of half width whose values are a quarter of the mean over
/// 2x2 cells.
HWY_INLINE void block_variances(const float* from, std::ptrdiff_t stride, int blocks, const RowMemory& m) {
  const int cells = blocks + 3, n = lanes();
  for (int i = 0; i < cells; i += n) {
    const VF upper = hn::Add(load(from + i), load(from + stride + i));
    const VF lower = hn::Add(load(from + 2 * stride + i), load(from + 3 * stride + i));
    store(hn::Add(upper, lower), m.cells + i);
  }
  for (int i = 0; i < blocks; i += n) {
    const float* const at = m.cells + i;
    const VF four = hn::Add(hn::Add(load(at), load(at + 1)), hn::Add(load(at + 2), load(at + 3)));
    // Places after the last block hold arbitrary values; 1e-30 keeps every quotient finite there.
    store(hn::Max(hn::Mul(constant(0.25f), four), constant(1e-30f)), m.variance + i);
  }
}

/// Filters one plane of one strip: blocks first .. first + count - 1.
HWY_INLINE void shrink_strip(const BlockRow& in, int plane, int first, int count, const RowMemory& m,
                             const BlockSums& sums) {
  Strip& s = *m.strip;
  const Floats f;
  const int n = lanes();
  transform_columns(in.noisy[plane] + 2 * first, in.stride, count, s.noisy);
  if (in.pilot[0] != nullptr) {
    transform_columns(in.pilot[plane] + 2 * first, in.stride, count, s.pilot);
  }
  for (int i = 0; i < strip_blocks; i += n) store(hn::Zero(f), s.weight + lead + i);
  for (int i = 0; i < count; i += n) {
    const VF variance = load(m.variance + first + i);
    VF power;
    if (in.pilot[0] != nullptr) {
      power = plane == 0 ? wiener_luma(s, i, variance, in.pilot_power[0])
                         : wiener_chroma(s, i, variance, in.luma_shaped, in.pilot_power[1]);
    } else {
      power = plane == 0 ? threshold_luma(s, i, variance) : threshold_chroma(s, i, variance, in.luma_shaped);
    }
    const VF exists = hn::IfThenElseZero(
        hn::Lt(hn::Iota(f, static_cast<float>(i)), constant(static_cast<float>(count))), constant(1));
    const VF per_power = in.coarsest ? exists : hn::Div(exists, power);
    const rows::ResidualOfBlocks& shares = in.left[plane == 0 ? 0 : 1];
    const VF rest = hn::MulAdd(constant(shares.other), hn::Sub(constant(64), power), constant(shares.mean));
    const VF left = hn::MulAdd(constant(shares.kept), hn::Sub(power, constant(1)), rest);
    const VF weight = hn::Div(per_power, variance);
    store(weight, s.weight + lead + i);
    store(weight, m.weight + first + i);
    store(hn::Mul(per_power, left), m.residual + first + i);
  }
  add_columns(s, count, 2 * first, in.rows_apart, sums.value[plane]);
}

/// Adds one value of each block, times the window, to the four rows of half width that the block covers.
HWY_INLINE void add_blocks(const float* of_block, int blocks, int rows_apart, float* const (&rows)[4]) {
  const int n = lanes();
  for (int i = 0; i < blocks + 3; i += n) {
    VF sum = hn::Zero(Floats());
    for (int m = 0; m < 4; ++m) sum = hn::Add(load(of_block + i - m), sum);
    for (int y = 0; y < 4; ++y) {
      float* const to = rows[y] + i;
      store(hn::MulAdd(constant(window(rows_apart, 2 * y)), sum, load(to)), to);
    }
  }
}

HWY_INLINE void shrink_row(const BlockRow& in, const RowMemory& m, std::size_t row, const BlockSums& sums) {
  // Process strip by strip, and in each all planes: chroma depends on the luma coefficients that are kept.
  const int strips = (in.blocks + strip_blocks - 1) / strip_blocks;
  const int planes = in.chroma == nullptr ? 1 : 4;
  const auto of_plane = [&](int plane) HWY_ATTR {
    RowMemory own = m;
    own.variance += 4 * row * plane;
    own.weight += 4 * row * plane;
    own.residual += 4 * row * plane;
    return own;
  };
  for (int plane = 0; plane < planes; ++plane) {
    const RowMemory own = of_plane(plane);
    std::fill(own.weight - 16, own.weight + in.blocks + 48, 0.0f);
    std::fill(own.residual - 16, own.residual + in.blocks + 48, 0.0f);
    block_variances(in.variance[plane], in.variance_stride, in.blocks, own);
  }
  for (int strip = 0; strip < strips; ++strip) {
    const int first = strip * strip_blocks, count = std::min(strip_blocks, in.blocks - first);
    const int wanted = planes == 4 && in.chroma[strip] != 0 ? 4 : 1;
    for (int plane = 0; plane < wanted; ++plane) shrink_strip(in, plane, first, count, of_plane(plane), sums);
  }
  for (int plane = 0; plane < planes; ++plane) {
    const RowMemory own = of_plane(plane);
    add_blocks(own.weight, in.blocks, in.rows_apart, sums.weight[plane]);
    add_blocks(own.residual, in.blocks, in.rows_apart, sums.residual[plane]);
  }
}

std::size_t BlockScratch(int cells) {
  return (sizeof(Strip) / sizeof(float) + 15) / 16 * 16 + 17 * memory_row(cells + 4);
}

void ShrinkBlockRow(const BlockRow& in, float* scratch, const BlockSums& sums) {
  const std::size_t row = memory_row(2 * in.blocks + 8);
  shrink_row(in, row_memory(scratch, static_cast<int>(row)), row, sums);
}

void FinishRows(const SumRows& in, float* scratch, const FinishedRows& out) {
  const Floats f;
  const int n = lanes(), half = in.cells / 2;
  for (int i = 0; i < half; i += n) {
    const VF weight = load(in.weight + i);
    const VF per_weight = hn::IfThenElseZero(hn::Gt(weight, hn::Zero(f)), hn::Div(constant(1), weight));
    hn::StoreInterleaved2(per_weight, per_weight, f, scratch + 2 * i);
    store(hn::Mul(load(in.residual + i), per_weight), out.residual + i);
  }
  for (int i = 0; i < in.cells; i += n) {
    const VF per_weight = load(scratch + i);
    for (int y = 0; y < 2; ++y) store(hn::Mul(load(in.value[y] + i), per_weight), out.value[y] + i);
  }
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(BlockScratch);
HWY_EXPORT(ShrinkBlockRow);
HWY_EXPORT(FinishRows);

std::size_t block_scratch(int cells) { return HWY_DYNAMIC_DISPATCH(BlockScratch)(cells); }
void shrink_block_row(const BlockRow& in, const RowScratch& scratch, const BlockSums& sums) {
  assert(scratch.floats >= block_scratch(2 * (in.blocks - 1) + 8));
  HWY_DYNAMIC_DISPATCH(ShrinkBlockRow)(in, scratch.data, sums);
}
std::size_t finish_scratch(int cells) { return static_cast<std::size_t>(cells) + padding; }
void finish_rows(const SumRows& in, const RowScratch& scratch, const FinishedRows& out) {
  assert(scratch.floats >= finish_scratch(in.cells));
  HWY_DYNAMIC_DISPATCH(FinishRows)(in, scratch.data, out);
}

}  // namespace lowlux::denoise::rows
#endif
