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
template <int kStep>
HWY_INLINE void block_variances(const float* from, std::ptrdiff_t stride, int blocks, const RowMemory& m) {
  const int cells = (blocks - 1) * kStep / 2 + 4, n = lanes();
  for (int i = 0; i < cells; i += n) {
    const VF upper = hn::Add(load(from + i), load(from + stride + i));
    const VF lower = hn::Add(load(from + 2 * stride + i), load(from + 3 * stride + i));
    store(hn::Add(upper, lower), m.cells + i);
  }
  for (int i = 0; i < blocks; i += n) {
    const float* const at = m.cells + i * kStep / 2;
    VF four;
    if constexpr (kStep == 2) {
      four = hn::Add(hn::Add(load(at), load(at + 1)), hn::Add(load(at + 2), load(at + 3)));
    } else {
      VF even0, odd0, even1, odd1;
      hn::LoadInterleaved2(Floats(), at, even0, odd0);
      hn::LoadInterleaved2(Floats(), at + 2, even1, odd1);
      four = hn::Add(hn::Add(even0, odd0), hn::Add(even1, odd1));
    }
    // Places after the last block hold arbitrary values; 1e-30 keeps every quotient finite there.
    store(hn::Max(hn::Mul(constant(0.25f), four), constant(1e-30f)), m.variance + i);
  }
}

/// Filters one plane of one strip: blocks first .. first + count - 1.
template <int kStep>
HWY_INLINE void shrink_strip(const BlockRow& in, int plane, int first, int count, const RowMemory& m,
                             const BlockSums& sums) {
  Strip& s = *m.strip;
  const Floats f;
  const int n = lanes();
  transform_columns<kStep>(in.noisy[plane] + kStep * first, in.stride, count, s.noisy);
  if (in.pilot[0] != nullptr) {
    transform_columns<kStep>(in.pilot[plane] + kStep * first, in.stride, count, s.pilot);
  }
  for (float* const weight : s.weight) {
    for (int i = 0; i < strip_blocks; i += n) store(hn::Zero(f), weight + lead + i);
  }
  for (int i = 0; i < count; i += n) {
    const VF variance = load(m.variance + first + i);
    VF power;
    if (in.pilot[0] != nullptr) {
      power = plane == 0 ? wiener_luma<kStep>(s, i, variance) : wiener_chroma<kStep>(s, i, variance, in.luma_shaped);
    } else {
      power =
          plane == 0 ? threshold_luma<kStep>(s, i, variance) : threshold_chroma<kStep>(s, i, variance, in.luma_shaped);
    }
    const VF exists = hn::IfThenElseZero(
        hn::Lt(hn::Iota(f, static_cast<float>(i)), constant(static_cast<float>(count))), constant(1));
    const VF per_power = in.coarsest ? exists : hn::Div(exists, power);
    const rows::ResidualOfBlocks& shares = in.left[plane == 0 ? 0 : 1];
    const VF rest = hn::MulAdd(constant(shares.other), hn::Sub(constant(64), power), constant(shares.mean));
    const VF left = hn::MulAdd(constant(shares.kept), hn::Sub(power, constant(1)), rest);
    const VF weight = hn::Div(per_power, variance);
    for (int k = 0; k < (kStep == 4 ? 2 : 1); ++k) {
      store(hn::Mul(constant(window<kStep>(2 * k)), weight), s.weight[k] + lead + i);
    }
    store(weight, m.weight + first + i);
    store(hn::Mul(per_power, left), m.residual + first + i);
  }
  add_columns<kStep>(s, count, kStep * first, sums.value[plane]);
}

/// Adds one value of each block, times the window, to the four rows of half width that the block covers.
template <int kStep>
HWY_INLINE void add_blocks(const float* of_block, int blocks, float* const (&rows)[4]) {
  constexpr int parts = kStep / 2;  // cells of half width from one block to the next
  const int n = lanes();
  for (int i = 0; i < blocks + 8 / kStep - 1; i += n) {
    HWY_ALIGN float row[parts * hn::MaxLanes(Floats())];
    VF sum[parts];
    for (int part = 0; part < parts; ++part) {
      sum[part] = hn::Zero(Floats());
      for (int m = 0; m < 8 / kStep; ++m) {
        const VF factor = constant(window<kStep>(2 * (part + parts * m)));
        sum[part] = hn::MulAdd(factor, load(of_block + i - m), sum[part]);
      }
    }
    Interleaved<parts>::store(sum, row);
    for (int y = 0; y < 4; ++y) {
      float* const to = rows[y] + parts * i;
      const VF factor = constant(window<kStep>(2 * y));
      for (int part = 0; part < parts; ++part) {
        store(hn::MulAdd(factor, load(row + part * n), load(to + part * n)), to + part * n);
      }
    }
  }
}

template <int kStep>
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
    block_variances<kStep>(in.variance[plane], in.variance_stride, in.blocks, own);
  }
  for (int strip = 0; strip < strips; ++strip) {
    const int first = strip * strip_blocks, count = std::min(strip_blocks, in.blocks - first);
    const int wanted = planes == 4 && in.chroma[strip] != 0 ? 4 : 1;
    for (int plane = 0; plane < wanted; ++plane) shrink_strip<kStep>(in, plane, first, count, of_plane(plane), sums);
  }
  for (int plane = 0; plane < planes; ++plane) {
    const RowMemory own = of_plane(plane);
    add_blocks<kStep>(own.weight, in.blocks, sums.weight[plane]);
    add_blocks<kStep>(own.residual, in.blocks, sums.residual[plane]);
  }
}

std::size_t BlockScratch(int cells) {
  return (sizeof(Strip) / sizeof(float) + 15) / 16 * 16 + 17 * memory_row(cells + 4);
}

void ShrinkBlockRow(const BlockRow& in, float* scratch, const BlockSums& sums) {
  const std::size_t row = memory_row(in.step * in.blocks + 8);
  const RowMemory m = row_memory(scratch, static_cast<int>(row));
  if (in.step == 2) {
    shrink_row<2>(in, m, row, sums);
  } else {
    shrink_row<4>(in, m, row, sums);
  }
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
  assert(scratch.floats >= block_scratch(in.step * (in.blocks - 1) + 8));
  HWY_DYNAMIC_DISPATCH(ShrinkBlockRow)(in, scratch.data, sums);
}
std::size_t finish_scratch(int cells) { return static_cast<std::size_t>(cells) + padding; }
void finish_rows(const SumRows& in, const RowScratch& scratch, const FinishedRows& out) {
  assert(scratch.floats >= finish_scratch(in.cells));
  HWY_DYNAMIC_DISPATCH(FinishRows)(in, scratch.data, out);
}

}  // namespace lowlux::denoise::rows
#endif
