#include <algorithm>
#include <cstddef>
#include <initializer_list>

#include "denoise/spatial/rows.h"

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/spatial/unpack_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "denoise/spatial/dct-inl.h"
#include "denoise/spatial/stabiliser-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

/// The values of the sites of a vector of cells, of R, the G in its row, the G in the row of B, and B.
struct SiteValues {
  VF u[4];
};
HWY_INLINE SiteValues values_of(VF luma, VF chroma1, VF chroma2, VF chroma3) {
  const VF half = hn::MulAdd(constant(0.6f), chroma1, luma), skew = hn::Mul(constant(per_root2), chroma2);
  const VF green = hn::MulAdd(constant(-0.4f), chroma1, luma), maze = hn::Mul(constant(0.5f), chroma3);
  return {{hn::Add(half, skew), hn::Add(green, maze), hn::Sub(green, maze), hn::Sub(half, skew)}};
}

/// Returns the fraction of a stabilised value over the offset of light, and the raw variance there [e-^2].
struct RawVariance {
  VF fraction, e2;
};
HWY_INLINE RawVariance raw_variance(const UnpackRow& in, int k, VF u) {
  const VF fraction = light_of(u), light = hn::Mul(constant(in.offset_e * in.per_gain[k]), fraction);
  const VF raw = hn::Max(hn::Add(light, constant(in.dark_e[k])), constant(in.min_e[k]));
  return {fraction, hn::Div(hn::Add(raw, constant(in.variance_e2[k])), hn::Add(constant(1), fraction))};
}

/// Returns the covariance of what remains of the noise of L and C1, of the variances `own` and `left`, in cells whose
/// greens are one value: its correlation is that of L = (R + 3 G + B) / 5 and C1 = (R + B) / 2 - G.
HWY_INLINE VF covariance(const UnpackRow& in, const SiteValues& at, VF own, VF left) {
  const auto stabilised = [&](int k, int site) HWY_ATTR {
    const VF u = hn::Mul(constant(1 / in.offset_e), at.u[site]);
    return hn::Mul(constant(1 / (in.per_gain[k] * in.per_gain[k])), raw_variance(in, k, u).e2);
  };
  const VF others = hn::Add(stabilised(0, 0), stabilised(2, 3)), green = hn::Mul(constant(0.5f), stabilised(1, 1));
  const VF of_luma = hn::MulAdd(constant(0.04f), others, hn::Mul(constant(0.36f), green));
  const VF of_chroma = hn::MulAdd(constant(0.25f), others, green);
  const VF common = hn::MulAdd(constant(0.1f), others, hn::Mul(constant(-0.6f), green));
  return hn::Mul(common, hn::Sqrt(hn::Div(hn::Mul(own, left), hn::Mul(of_luma, of_chroma))));
}

/// Computes the remaining variance of the luma's light, and in R, G and B from that in C1 and C2.
HWY_INLINE void light_variances(const UnpackRow& in, const UnpackedRow& out, int i, VF luma, const SiteValues& at,
                                const VF (&left)[4]) {
  const VF per_offset = constant(1 / in.offset_e), own = load(in.residual[0] + i);
  const auto of_light = [&](VF u, VF variance) HWY_ATTR {
    const VF slope = slope_of_light(hn::Mul(per_offset, u));
    return hn::Mul(hn::Mul(slope, slope), variance);
  };
  store(of_light(luma, own), out.luma_variance_e2 + i);
  VF other = hn::MulAdd(constant(0.5f), left[2], hn::MulAdd(constant(0.36f), left[1], own));
  VF green = hn::MulAdd(constant(0.16f), left[1], own);
  if (in.sites_coincide) {
    const VF common = covariance(in, at, own, left[1]);
    other = hn::MulAdd(constant(1.2f), common, other);
    green = hn::MulAdd(constant(-0.8f), common, green);
  } else {
    green = hn::MulAdd(constant(0.25f), left[3], green);
  }
  const VF of_colour[3] = {other, green, other};
  const VF value[3] = {at.u[0], hn::Mul(constant(0.5f), hn::Add(at.u[1], at.u[2])), at.u[3]};
  for (int k = 0; k < 3; ++k) {
    const VF variance = hn::Mul(constant(in.per_gain[k] * in.per_gain[k]), of_light(value[k], of_colour[k]));
    store(variance, out.variance_e2[k] + i);
  }
}

/// Returns the light of stabilised values of colour k in electrons, white balance undone. The mean of the noise that
/// was removed is added, which is `removed` times the variance of RawNoise.
HWY_INLINE VF light_e(const UnpackRow& in, int k, VF value, VF removed) {
  const VF u = hn::Mul(constant(1 / in.offset_e), value);
  const RawVariance variance = raw_variance(in, k, u);
  const VF light = hn::Mul(constant(in.offset_e * in.per_gain[k]), variance.fraction);
  const VF mean = hn::Mul(constant(0.25f / (in.offset_e * in.per_gain[k])), hn::Mul(removed, variance.e2));
  return hn::Add(light, hn::IfThenElseZero(hn::Gt(u, constant(linear_value)), mean));
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
    add_slopes(in.neighbour_luma[0], in.plane[0], in.neighbour_luma[1], in.slopes, i, c[2], c[3]);
    const SiteValues at = values_of(luma, c[1], c[2], c[3]);
    light_variances(in, out, i, luma, at, left);
    const VF removed = load(in.removed + i);
    const VF r = light_e(in, 0, at.u[0], removed), g1 = light_e(in, 1, at.u[1], removed);
    const VF g2 = light_e(in, 1, at.u[2], removed), b = light_e(in, 2, at.u[3], removed);
    if (in.red_is_odd) {
      hn::StoreInterleaved2(g1, r, f, out.signal_e[0] + 2 * i);
      hn::StoreInterleaved2(b, g2, f, out.signal_e[1] + 2 * i);
    } else {
      hn::StoreInterleaved2(r, g1, f, out.signal_e[0] + 2 * i);
      hn::StoreInterleaved2(g2, b, f, out.signal_e[1] + 2 * i);
    }
  }
}

void UndoExcessive(const ChangedRow& in, float* signal_e) {
  const Floats f;
  const int n = lanes();
  const auto both = [f](const float(&of)[2]) HWY_ATTR { return hn::OddEven(hn::Set(f, of[1]), hn::Set(f, of[0])); };
  const VF dark = both(in.dark_e), least = both(in.min_e), steady = both(in.variance_e2);
  const VF scale = constant(25 * in.variance_scale), most = constant(1e9f);
  const auto undo = [&](const float* raw_e, int x) HWY_ATTR {
    const VF raw = load(raw_e), signal = load(signal_e + x), result = hn::Add(signal, dark);
    const VF value = hn::Min(hn::Max(raw, hn::Neg(most)), most), change = hn::Sub(result, value);
    const VF mean = hn::Max(hn::Max(value, result), least), square = hn::Mul(change, change);
    const VF limit = hn::Mul(hn::Mul(scale, load(in.ratio + x)), hn::Add(mean, steady));
    const auto exceeds = hn::And(hn::Gt(square, limit), hn::Eq(raw, raw));
    const VF rest = hn::MulAdd(constant(2), hn::Sqrt(hn::Div(limit, square)), constant(-1));
    const VF limited = hn::MulAdd(hn::Max(rest, hn::Zero(f)), change, hn::Sub(value, dark));
    store(hn::IfThenElse(exceeds, limited, signal), signal_e + x);
  };
  int x = 0;
  for (; x + n <= in.width; x += n) undo(in.raw_e + x, x);
  if (x == in.width) return;
  HWY_ALIGN float last[hn::MaxLanes(Floats())] = {};
  std::copy(in.raw_e + x, in.raw_e + in.width, last);
  undo(last, x);
}

/// Adds to the sums the removed and the stated variance of one site of a vector of cells.
HWY_INLINE void add_removed(VF noisy, VF value, VF variance, VF& removed, VF& stated) {
  const VF edge = constant(linear_value), limit = hn::Sqrt(hn::Mul(constant(25), variance));
  const VF change = hn::Min(hn::Max(hn::Sub(noisy, value), hn::Neg(limit)), limit);
  const VF root = hn::Max(hn::Add(value, change), edge);  // on the curved part
  const VF curved = hn::Sub(root, value), linear = hn::Sub(change, curved);
  const VF square = hn::Mul(curved, hn::MulAdd(constant(2), linear, curved));
  const auto counts = hn::Gt(value, edge);
  removed = hn::Add(removed, hn::IfThenElseZero(counts, square));
  stated = hn::Add(stated, hn::IfThenElseZero(counts, variance));
}

RemovedSums RemovedCells(const RemovedRow& in) {
  const Floats f;
  const int n = lanes();
  const VF scale = constant(1 / in.offset_e);
  VF removed = hn::Zero(f), stated = hn::Zero(f);
  for (int i = 0; i < in.cells; i += 2 * n) {
    VF noisy[2][4], value[2][4], variance[4];
    for (int p = 0; p < 4; ++p) {
      hn::LoadInterleaved2(f, in.noisy[p] + i, noisy[0][p], noisy[1][p]);
      hn::LoadInterleaved2(f, in.value[p] + i, value[0][p], value[1][p]);
    }
    const VF four = hn::Mul(constant(4), hn::Mul(scale, scale));  // a quarter is stored, see PyramidLevel
    for (int p = 2; p < 4; ++p) variance[p] = hn::Mul(four, load(in.variance[p] + i / 2));
    for (int odd = 0; odd < 2; ++odd) {
      const int rest = (in.cells - i - odd + 1) / 2;  // cells of this half of the pairs
      const auto inside = hn::FirstN(f, static_cast<std::size_t>(rest < n ? rest : n));
      const auto& a = noisy[odd];
      const auto& b = value[odd];
      const SiteValues before = values_of(a[0], a[1], a[2], a[3]), after = values_of(b[0], b[1], b[2], b[3]);
      for (const bool is_green : {false, true}) {  // sites in pairs, in which neither comes first: R and B, both G
        VF removed_here = hn::Zero(f), stated_here = removed_here;
        const VF of_site = is_green ? hn::Mul(constant(0.5f), variance[3]) : variance[2];
        for (const int k : {is_green ? 1 : 0, is_green ? 2 : 3}) {
          add_removed(hn::IfThenElseZero(inside, hn::Mul(scale, before.u[k])),
                      hn::IfThenElseZero(inside, hn::Mul(scale, after.u[k])), hn::IfThenElseZero(inside, of_site),
                      removed_here, stated_here);
        }
        removed = hn::Add(removed, removed_here);
        stated = hn::Add(stated, stated_here);
      }
    }
  }
  return {hn::GetLane(hn::SumOfLanes(f, removed)), hn::GetLane(hn::SumOfLanes(f, stated))};
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(AddSlopes);
HWY_EXPORT(UnpackCells);
HWY_EXPORT(UndoExcessive);
HWY_EXPORT(RemovedCells);

void add_slope_row(const float* const (&luma)[3], int cells, const Slopes& slopes, float* const (&chroma)[2]) {
  HWY_DYNAMIC_DISPATCH(AddSlopes)(luma, cells, slopes, chroma);
}
void unpack_row(const UnpackRow& in, const UnpackedRow& out) { HWY_DYNAMIC_DISPATCH(UnpackCells)(in, out); }
void undo_excessive_row(const ChangedRow& in, float* signal_e) { HWY_DYNAMIC_DISPATCH(UndoExcessive)(in, signal_e); }
RemovedSums removed_row(const RemovedRow& in) { return HWY_DYNAMIC_DISPATCH(RemovedCells)(in); }

}  // namespace lowlux::denoise::rows
#endif
