#include <cassert>
#include <cstddef>
#include <initializer_list>

#include "denoise/spatial/rows.h"

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/spatial/front_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "denoise/spatial/dct-inl.h"
#include "denoise/spatial/stabiliser-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

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
    for (VF& u : x) u = hn::Mul(constant(in.offset_e), stabilised(hn::Mul(constant(1 / in.offset_e), u)));
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

/// Rows of scratch memory: sums over rows of raw values, and of one colour the variance and the loss.
struct VarianceRows {
  float* sum[2];
  float* variance;
  float* loss;
};

/// Computes stabilised variances of colour k of each column of two rows, summed over the rows and divided by 16; and
/// where there is a ratio, what such noise takes from the mean of stabilised values, summed and divided by 4.
HWY_INLINE void colour_variance(const VarianceRow& in, int k, const VarianceRows& to) {
  const int n = lanes();
  for (int i = -16; i < in.cells + 4; i += n) {
    VF shared = load(in.raw_e[k][1] + i);
    for (int y = 2; y < 9; ++y) shared = hn::Add(shared, load(in.raw_e[k][y] + i));
    store(hn::Add(shared, load(in.raw_e[k][0] + i)), to.sum[0] + i);
    store(hn::Add(shared, load(in.raw_e[k][9] + i)), to.sum[1] + i);
  }
  const VF scale = constant(in.gain[k] * in.gain[k] / 16), steady = constant(in.variance_e2[k]);
  const VF least = constant(in.min_e[k]), dark = constant(in.dark_e[k]), one = constant(1);
  const VF light = constant(in.balance[k] / in.offset_e), edge = constant(linear_light);
  for (int i = 0; i < in.cells; i += n) {
    VF both = hn::Zero(Floats()), both_lost = both;
    for (const float* const sum : to.sum) {
      const VF mean = hn::Mul(constant(1.0f / 81), nine(sum + i)), x = hn::Mul(light, hn::Sub(mean, dark));
      const VF root = hn::Add(one, hn::Max(x, edge));
      const VF stated = hn::Div(hn::Add(hn::Max(mean, least), steady), root);
      both = hn::Add(both, stated);
      if (in.ratio == nullptr) continue;
      both_lost = hn::Add(both_lost, hn::IfThenElseZero(hn::Gt(x, edge), hn::Div(stated, hn::Sqrt(root))));
    }
    store(hn::Mul(scale, both), to.variance + i);
    if (in.ratio != nullptr) store(hn::Mul(hn::Mul(scale, constant(1 / in.offset_e)), both_lost), to.loss + i);
  }
}

/// Returns the sums of cells 2 i and 2 i + 1.
HWY_INLINE VF pairs(const float* from, int i) {
  VF even, odd;
  hn::LoadInterleaved2(Floats(), from + 2 * i, even, odd);
  return hn::Add(even, odd);
}

/// Subtracts from the planes what the noise of colour k took less from their means than noise of the largest ratio
/// would have.
HWY_INLINE void equalise_losses(const VarianceRow& in, int k, const float* loss) {
  constexpr float weight[3][3] = {{0.2f, 0.5f, per_root2}, {0.6f, -1, 0}, {0.2f, 0.5f, -per_root2}};  // k, plane
  const Floats f;
  for (int i = 0; i < in.cells / 2; i += lanes()) {
    const VF less = hn::Mul(hn::Sub(constant(in.max_ratio), load(in.ratio + i)), pairs(loss, i));
    for (int p = 0; p < 3; ++p) {
      const VF change = hn::Mul(constant(weight[k][p]), less);
      for (float* const row : in.plane[p]) {
        VF even, odd;
        hn::LoadInterleaved2(f, row + 2 * i, even, odd);
        hn::StoreInterleaved2(hn::Sub(even, change), hn::Sub(odd, change), f, row + 2 * i);
      }
    }
  }
}

void VarianceCells(const VarianceRow& in, const RowScratch& scratch, float* const out[4]) {
  const int row = (in.cells + padding) / 16 * 16;
  const VarianceRows rows{{scratch.data + 16, scratch.data + 16 + row}, scratch.data + 2 * row, scratch.data + 3 * row};
  float* const other = out[2];  // sum of R and B, in which neither comes first
  for (const int k : {0, 2, 1}) {
    colour_variance(in, k, rows);
    for (int i = 0; i < in.cells / 2; i += lanes()) {
      VF variance = pairs(rows.variance, i);
      if (in.ratio != nullptr) variance = hn::Mul(load(in.ratio + i), variance);
      if (k != 1) {
        store(k == 0 ? variance : hn::Add(load(other + i), variance), other + i);
        continue;
      }
      const VF both = load(other + i);
      store(hn::MulAdd(constant(0.18f), variance, hn::Mul(constant(0.04f), both)), out[0] + i);
      store(hn::MulAdd(constant(0.5f), variance, hn::Mul(constant(0.25f), both)), out[1] + i);
      store(hn::Mul(constant(0.5f), both), out[2] + i);
      store(hn::Mul(constant(2), variance), out[3] + i);
    }
    if (in.ratio != nullptr) equalise_losses(in, k, rows.loss);
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

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(PackCells);
HWY_EXPORT(VarianceCells);
HWY_EXPORT(SumOf);
HWY_EXPORT(TargetName);

void pack_row(const PackRow& in, const PackedRow& out) { HWY_DYNAMIC_DISPATCH(PackCells)(in, out); }
std::size_t variance_scratch(int cells) { return 4 * ((static_cast<std::size_t>(cells) + padding) / 16 * 16); }
void variance_row(const VarianceRow& in, const RowScratch& scratch, float* const out[4]) {
  assert(scratch.floats >= variance_scratch(in.cells));
  HWY_DYNAMIC_DISPATCH(VarianceCells)(in, scratch, out);
}
double sum_of(const float* in, int count) { return HWY_DYNAMIC_DISPATCH(SumOf)(in, count); }
const char* target_name() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace lowlux::denoise::rows
#endif
