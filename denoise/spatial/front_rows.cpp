#include <cassert>
#include <cstddef>

#include "denoise/spatial/rows.h"

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/spatial/front_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "denoise/spatial/dct-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

constexpr float per_root2 = 0.707106781187f;

/// Returns 0 for NaN, and otherwise x limited to +-1e9.
HWY_INLINE VF usable(VF x) {
  const VF number = hn::IfThenElseZero(hn::Eq(x, x), x);
  return hn::Min(hn::Max(number, constant(-1e9f)), constant(1e9f));
}

/// The sites of a vector of cells: R, the G in its row, the G in the row of B, and B.
struct Sites {
  VF e[4];
};
HWY_INLINE Sites sites_of_cells(const PackRow& in, int i) {
  VF even[2], odd[2];
  for (int row = 0; row < 2; ++row) hn::LoadInterleaved2(Floats(), in.raw[row] + 2 * i, even[row], odd[row]);
  if (in.red_is_odd) return {{usable(odd[0]), usable(even[0]), usable(odd[1]), usable(even[1])}};
  return {{usable(even[0]), usable(odd[0]), usable(even[1]), usable(odd[1])}};
}

void PackCells(const PackRow& in, const PackedRow& out) {
  const Floats f;
  const float dark[4] = {in.dark_e[0], in.dark_e[1], in.dark_e[1], in.dark_e[2]};
  const float gain[4] = {in.gain[0], in.gain[1], in.gain[1], in.gain[2]};
  const float saturation[4] = {in.saturation_e[0], in.saturation_e[1], in.saturation_e[1], in.saturation_e[2]};
  for (int i = 0; i < in.cells; i += lanes()) {
    const Sites y = sites_of_cells(in, i);
    store(y.e[0], out.raw_e[0] + i);
    store(hn::Mul(constant(0.5f), hn::Add(y.e[1], y.e[2])), out.raw_e[1] + i);
    store(y.e[3], out.raw_e[2] + i);
    if (out.plane[0] == nullptr) continue;
    VF x[4], most = constant(-1e30f), any = hn::Zero(f);
    for (int k = 0; k < 4; ++k) {
      x[k] = hn::Mul(constant(gain[k]), hn::Sub(y.e[k], constant(dark[k])));
      most = hn::Max(most, x[k]);
    }
    for (int k = 0; k < 4; ++k) {
      const auto saturated = hn::Ge(y.e[k], constant(saturation[k]));
      x[k] = hn::IfThenElse(saturated, most, x[k]);
      any = hn::IfThenElse(saturated, constant(1), any);
    }
    const VF green = hn::Add(x[1], x[2]), other = hn::Add(x[0], x[3]);
    store(any, out.saturated + i);
    store(hn::MulAdd(constant(0.3f), green, hn::Mul(constant(0.2f), other)), out.plane[0] + i);
    store(hn::Mul(constant(0.5f), hn::Sub(other, green)), out.plane[1] + i);
    store(hn::Mul(constant(per_root2), hn::Sub(x[0], x[3])), out.plane[2] + i);
    store(hn::Sub(x[1], x[2]), out.plane[3] + i);
  }
}

/// Returns the sum of nine adjacent numbers.
HWY_INLINE VF nine(const float* from) {
  VF sum = load(from - 4);
  for (int i = -3; i <= 4; ++i) sum = hn::Add(sum, load(from + i));
  return sum;
}

/// Computes variances of R, G, B of each column of two rows, summed over the rows and divided by 16.
/// @param scratch two rows
HWY_INLINE void colour_variances(const VarianceRow& in, float* scratch, int row, float* const (&variance)[3]) {
  const int n = lanes();
  float* const sums[2] = {scratch + 16, scratch + 16 + row};
  for (int k = 0; k < 3; ++k) {
    for (int i = -16; i < in.cells + 4; i += n) {
      VF shared = load(in.raw_e[k][1] + i);
      for (int y = 2; y < 9; ++y) shared = hn::Add(shared, load(in.raw_e[k][y] + i));
      store(hn::Add(shared, load(in.raw_e[k][0] + i)), sums[0] + i);
      store(hn::Add(shared, load(in.raw_e[k][9] + i)), sums[1] + i);
    }
    const VF scale = constant(in.gain[k] * in.gain[k] / 16), steady = constant(in.variance_e2[k]);
    const VF least = constant(in.min_e[k]);
    for (int i = 0; i < in.cells; i += n) {
      VF both = hn::Zero(Floats());
      for (const float* const sum : sums) {
        both = hn::Add(both, hn::Add(hn::Max(hn::Mul(constant(1.0f / 81), nine(sum + i)), least), steady));
      }
      store(hn::Mul(scale, both), variance[k] + i);
    }
  }
}

/// Returns the sums of cells 2 i and 2 i + 1.
HWY_INLINE VF pairs(const float* from, int i) {
  VF even, odd;
  hn::LoadInterleaved2(Floats(), from + 2 * i, even, odd);
  return hn::Add(even, odd);
}

void VarianceCells(const VarianceRow& in, float* scratch, float* const out[4]) {
  const int row = (in.cells + padding) / 16 * 16;
  float* const variance[3] = {scratch + 2 * row, scratch + 3 * row, scratch + 4 * row};
  colour_variances(in, scratch, row, variance);
  for (int i = 0; i < in.cells / 2; i += lanes()) {
    const VF green = pairs(variance[1], i), other = hn::Add(pairs(variance[0], i), pairs(variance[2], i));
    store(hn::MulAdd(constant(0.18f), green, hn::Mul(constant(0.04f), other)), out[0] + i);
    store(hn::MulAdd(constant(0.5f), green, hn::Mul(constant(0.25f), other)), out[1] + i);
    store(hn::Mul(constant(0.5f), other), out[2] + i);
    store(hn::Mul(constant(2), green), out[3] + i);
  }
  if (in.ratio == nullptr) return;
  for (int p = 0; p < 4; ++p) {
    for (int i = 0; i < in.cells / 2; i += lanes()) {
      store(hn::Mul(load(in.ratio + i), load(out[p] + i)), out[p] + i);
    }
  }
}

double SumOf(const float* in, int count) {
  const Floats f;
  const int n = lanes();
  VF sum = hn::Zero(f);
  int i = 0;
  for (; i + n <= count; i += n) sum = hn::Add(sum, usable(load(in + i)));
  HWY_ALIGN float rest[hn::MaxLanes(Floats())] = {};
  for (int k = 0; i < count; ++i, ++k) rest[k] = in[i];
  HWY_ALIGN float parts[hn::MaxLanes(Floats())];
  hn::Store(hn::Add(sum, usable(hn::Load(f, rest))), f, parts);
  double total = 0;
  for (int k = 0; k < n; ++k) total += static_cast<double>(parts[k]);
  return total;
}

/// Computes the remaining variance in R, G and B from that in C1 and C2.
HWY_INLINE void site_variances(const UnpackRow& in, const UnpackedRow& out, int i, const VF (&left)[4]) {
  const VF luma = load(in.residual[0] + i);
  const VF other = hn::MulAdd(constant(0.5f), left[2], hn::MulAdd(constant(0.36f), left[1], luma));
  const VF green = hn::MulAdd(constant(0.25f), left[3], hn::MulAdd(constant(0.16f), left[1], luma));
  const VF of_colour[3] = {other, green, other};
  for (int k = 0; k < 3; ++k) {
    if (out.variance_e2[k] == nullptr) continue;
    store(hn::Mul(constant(in.per_gain[k] * in.per_gain[k]), of_colour[k]), out.variance_e2[k] + i);
  }
}

/// Returns the harmonic mean of the differences before and after a cell, 0 where they differ in sign (van Leer).
HWY_INLINE VF slope(VF before, VF after) {
  const Floats f;
  const VF product = hn::Mul(before, after), sum = hn::Add(before, after);
  const VF safe = hn::IfThenElse(hn::Gt(product, hn::Zero(f)), sum, constant(1));
  return hn::Div(hn::Mul(constant(2), hn::Max(product, hn::Zero(f))), safe);
}

/// Adds the slopes of the luma at cell i to C2 and C3.
HWY_INLINE void add_slopes(const float* above, const float* own, const float* below, const Slopes& s, int i,
                           VF& blue_red, VF& greens) {
  const VF here = load(own + i);
  const VF gx = slope(hn::Sub(here, load(own + i - 1)), hn::Sub(load(own + i + 1), here));
  const VF gy = slope(hn::Sub(here, load(above + i)), hn::Sub(load(below + i), here));
  blue_red = hn::MulAdd(constant(s.c2_x), gx, hn::MulAdd(constant(s.c2_y), gy, blue_red));
  greens = hn::MulAdd(constant(s.c3_x), gx, hn::MulAdd(constant(s.c3_y), gy, greens));
}

void AddSlopes(const float* const (&luma)[3], int cells, const Slopes& slopes, float* const (&chroma)[2]) {
  for (int i = 0; i < cells; i += lanes()) {
    VF blue_red = load(chroma[0] + i), greens = load(chroma[1] + i);
    add_slopes(luma[0], luma[1], luma[2], slopes, i, blue_red, greens);
    store(blue_red, chroma[0] + i);
    store(greens, chroma[1] + i);
  }
}

void UnpackCells(const UnpackRow& in, const UnpackedRow& out) {
  const Floats f;
  const bool prior = in.rho >= 0;
  for (int i = 0; i < in.cells; i += lanes()) {
    const VF luma = load(in.plane[0] + i);
    const VF root = hn::Mul(constant(in.rho), hn::Max(luma, hn::Zero(f))), power = hn::Mul(root, root);
    const VF seen = load(in.seen + i);
    const auto factor = [&](VF residual) HWY_ATTR {  // residual > 0
      return prior ? hn::Mul(seen, hn::Div(power, hn::Add(power, residual))) : seen;
    };
    VF c[4], residual[4], share[4], left[4];
    for (int p = 1; p < 4; ++p) {
      residual[p] = hn::Max(load(in.residual[p] + i), constant(1e-30f));
      share[p] = factor(residual[p]);
      c[p] = hn::Mul(load(in.plane[p] + i), share[p]);
      left[p] = hn::Mul(hn::Mul(share[p], share[p]), residual[p]);
    }
    store(factor(hn::Mul(constant(0.5f), hn::Add(residual[1], residual[2]))), out.confidence + i);
    site_variances(in, out, i, left);
    add_slopes(in.luma_beside[0], in.plane[0], in.luma_beside[1], in.slopes, i, c[2], c[3]);
    const VF half = hn::MulAdd(constant(0.6f), c[1], luma), skew = hn::Mul(constant(per_root2), c[2]);
    const VF green = hn::MulAdd(constant(-0.4f), c[1], luma), maze = hn::Mul(constant(0.5f), c[3]);
    const VF r = hn::Mul(constant(in.per_gain[0]), hn::Add(half, skew));
    const VF g1 = hn::Mul(constant(in.per_gain[1]), hn::Add(green, maze));
    const VF g2 = hn::Mul(constant(in.per_gain[1]), hn::Sub(green, maze));
    const VF b = hn::Mul(constant(in.per_gain[2]), hn::Sub(half, skew));
    if (in.red_is_odd) {
      hn::StoreInterleaved2(g1, r, f, out.signal_e[0] + 2 * i);
      hn::StoreInterleaved2(b, g2, f, out.signal_e[1] + 2 * i);
    } else {
      hn::StoreInterleaved2(r, g1, f, out.signal_e[0] + 2 * i);
      hn::StoreInterleaved2(g2, b, f, out.signal_e[1] + 2 * i);
    }
  }
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(PackCells);
HWY_EXPORT(VarianceCells);
HWY_EXPORT(SumOf);
HWY_EXPORT(AddSlopes);
HWY_EXPORT(UnpackCells);
HWY_EXPORT(TargetName);

void pack_row(const PackRow& in, const PackedRow& out) { HWY_DYNAMIC_DISPATCH(PackCells)(in, out); }
std::size_t variance_scratch(int cells) { return 5 * ((static_cast<std::size_t>(cells) + padding) / 16 * 16); }
void variance_row(const VarianceRow& in, const RowScratch& scratch, float* const out[4]) {
  assert(scratch.floats >= variance_scratch(in.cells));
  HWY_DYNAMIC_DISPATCH(VarianceCells)(in, scratch.data, out);
}
double sum_of(const float* in, int count) { return HWY_DYNAMIC_DISPATCH(SumOf)(in, count); }
void add_slope_row(const float* const (&luma)[3], int cells, const Slopes& slopes, float* const (&chroma)[2]) {
  HWY_DYNAMIC_DISPATCH(AddSlopes)(luma, cells, slopes, chroma);
}
void unpack_row(const UnpackRow& in, const UnpackedRow& out) { HWY_DYNAMIC_DISPATCH(UnpackCells)(in, out); }
const char* target_name() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace lowlux::denoise::rows
#endif
