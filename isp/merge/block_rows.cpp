#include "isp/merge/block_rows.h"

#include <cmath>
#include <limits>

#if defined(__aarch64__)  // NEON only, as everywhere
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/merge/block_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

// The bits are the same on every processor: no fused products, no estimates, sums of columns in one order for all sizes
// of vectors.
HWY_BEFORE_NAMESPACE();
namespace lowlux::merge::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int side = 8;                  // of a block
constexpr float unexplained_excess = 3;  // standard deviations of a site's mean that its block's mean explains
using Floats = hn::CappedTag<float, side>;
using VF = hn::Vec<Floats>;
using MF = hn::Mask<Floats>;

HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }
HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }
HWY_INLINE VF load(const float* from) { return hn::LoadU(Floats(), from); }
HWY_INLINE VF non_negative(VF v) { return hn::Max(v, hn::Zero(Floats())); }
/// Returns the figures of the sites in even and in odd columns.
HWY_INLINE VF of_sites(float even, float odd) { return hn::OddEven(constant(odd), constant(even)); }

/// Adds eight columns' sums of each parity in a fixed order.
HWY_INLINE void add_columns(const float (&columns)[side], float& even, float& odd) {
  even = (columns[0] + columns[2]) + (columns[4] + columns[6]);
  odd = (columns[1] + columns[3]) + (columns[5] + columns[7]);
}

/// How the values of a site are combined by the inverse of their variances, at the mean signal of the block.
struct Mean {
  float mu;                  // mean signal, not negative
  float reference_fraction;  // weight of a site's two values
  float frame_fraction;
  float excess;  // what the mean of the block explains of that of a site
};

HWY_INLINE Mean mean_of(const BlockNoise& noise, int site, float reference, float frame, float count) {
  const auto shares = [&](float level, float& of_reference, float& of_frame) {
    const float r = noise.reference_slope * level + noise.reference_offset[site];
    const float f = noise.frame_slope * level + noise.frame_offset[site];
    const bool noisy = r + f > 0;
    of_reference = noisy ? f / (r + f) : noise.frame_slope / noise.slope;
    of_frame = noisy ? r / (r + f) : noise.reference_slope / noise.slope;
    return noisy ? r * f / (r + f) : 0;
  };
  Mean out{};
  shares(0, out.reference_fraction, out.frame_fraction);
  const float mean = count > 0 ? (reference * out.reference_fraction + frame * out.frame_fraction) / count : 0;
  out.mu = mean > 0 ? mean : 0;
  out.excess = unexplained_excess * std::sqrt(shares(out.mu, out.reference_fraction, out.frame_fraction));
  return out;
}

/// Finds the mean of both mosaics at each site of the cell.
HWY_INLINE void find_means(const float* reference, std::ptrdiff_t stride, const float* frame,
                           std::ptrdiff_t frame_stride, const BlockNoise& noise, Mean (&out)[4]) {
  for (int parity = 0; parity < 2; ++parity) {
    HWY_ALIGN float columns[3][side];
    for (int i = 0; i < side; i += lanes()) {
      VF r = hn::Zero(Floats()), f = r, n = r;
      for (int y = parity; y < side; y += 2) {
        const VF a = load(reference + y * stride + i), b = load(frame + y * frame_stride + i);
        const MF both = hn::And(hn::Eq(a, a), hn::Eq(b, b));
        r = hn::Add(r, hn::IfThenElseZero(both, a));
        f = hn::Add(f, hn::IfThenElseZero(both, b));
        n = hn::Add(n, hn::IfThenElseZero(both, constant(1)));
      }
      hn::Store(r, Floats(), columns[0] + i);
      hn::Store(f, Floats(), columns[1] + i);
      hn::Store(n, Floats(), columns[2] + i);
    }
    float sums[3][2];
    for (int k = 0; k < 3; ++k) add_columns(columns[k], sums[k][0], sums[k][1]);
    for (int odd = 0; odd < 2; ++odd) {
      out[2 * parity + odd] = mean_of(noise, 2 * parity + odd, sums[0][odd], sums[1][odd], sums[2][odd]);
    }
  }
}

/// Returns the variance that an error of the displacement adds: its square times that of the slope, which is the larger
/// difference to neighbours of the same colour, less what noise explains.
HWY_INLINE VF detail(const float* at, std::ptrdiff_t stride, VF centre, VF variance, float displacement_variance_px2) {
  const auto square = [=](std::ptrdiff_t offset) HWY_ATTR {
    const VF d = hn::Sub(load(at + offset), centre);
    return hn::IfThenElseZero(hn::Eq(d, d), hn::Mul(d, d));
  };
  const VF slopes = hn::Add(hn::Max(square(-2), square(2)), hn::Max(square(-2 * stride), square(2 * stride)));
  return hn::Mul(constant(displacement_variance_px2 / 4),
                 non_negative(hn::Sub(slopes, hn::Mul(constant(8), variance))));
}

/// Returns which differences are beyond the quantiles, corrected for skewness (Cornish and Fisher 1937).
HWY_INLINE MF outliers_of(VF d, VF v, VF mu, float third, float z) {
  const VF sigma = hn::Sqrt(v), skewness = hn::Div(hn::Mul(constant(third), mu), hn::Mul(v, sigma));
  const VF shift = hn::Mul(constant((z * z - 1) / 6), skewness), zero = hn::Zero(Floats());
  const VF above = hn::Mul(hn::Add(constant(z), hn::Max(shift, zero)), sigma);
  const VF below = hn::Mul(hn::Sub(hn::Min(shift, zero), constant(z)), sigma);
  return hn::Or(hn::Gt(d, above), hn::Lt(d, below));
}

/// Sums of a vector of columns. The last three are kept for even and odd rows.
struct ColumnSums {
  VF spread, spread_variance, count;
  VF d[2], v[2], fourth[2];
};

/// The figures of a row's sites.
struct SiteRow {
  VF mu, reference_fraction, frame_fraction, excess, reference_offset, offset;
};

HWY_INLINE SiteRow site_row(const BlockNoise& noise, const Mean (&mean)[4], int parity) {
  const Mean &even = mean[2 * parity], &odd = mean[2 * parity + 1];
  return {of_sites(even.mu, odd.mu),
          of_sites(even.reference_fraction, odd.reference_fraction),
          of_sites(even.frame_fraction, odd.frame_fraction),
          of_sites(even.excess, odd.excess),
          of_sites(noise.reference_offset[2 * parity], noise.reference_offset[2 * parity + 1]),
          of_sites(noise.offset[2 * parity], noise.offset[2 * parity + 1])};
}

/// Adds one row of a vector of columns. @return the number of outliers, which become NaN in the frame
HWY_INLINE int add_row(const float* reference, std::ptrdiff_t stride, float* frame, const SiteRow& site, int parity,
                       const BlockNoise& noise, const BlockLimits& limits, ColumnSums& sums) {
  const VF r = load(reference), f = load(frame), d = hn::Sub(f, r);
  const VF own = hn::Add(hn::Mul(r, site.reference_fraction), hn::Mul(f, site.frame_fraction));
  const VF mu = hn::Add(site.mu, non_negative(hn::Sub(hn::Sub(own, site.mu), site.excess)));
  VF v = hn::Add(hn::Mul(constant(noise.slope), mu), site.offset);
  if (limits.displacement_variance_px2 > 0) {
    const VF variance = hn::Add(hn::Mul(constant(noise.reference_slope), mu), site.reference_offset);
    v = hn::Add(v, detail(reference, stride, r, variance, limits.displacement_variance_px2));
  }
  MF counts = hn::And(hn::Eq(d, d), hn::Gt(v, hn::Zero(Floats())));
  int outliers = 0;
  if (limits.site_deviate > 0) {
    const MF far = hn::And(counts, outliers_of(d, v, mu, noise.third, limits.site_deviate));
    outliers = static_cast<int>(hn::CountTrue(Floats(), far));
    if (outliers > 0) {
      const VF missing = constant(std::numeric_limits<float>::quiet_NaN());
      hn::StoreU(hn::IfThenElse(far, missing, f), Floats(), frame);
      counts = hn::AndNot(far, counts);
    }
  }
  const auto add = [&](VF& sum, VF value) HWY_ATTR { sum = hn::Add(sum, hn::IfThenElseZero(counts, value)); };
  const VF per_v = hn::Div(constant(1), hn::IfThenElse(counts, v, constant(1)));
  const VF fourth = hn::Mul(constant(noise.fourth), mu);
  add(sums.spread, hn::Mul(hn::Mul(d, d), per_v));
  add(sums.spread_variance, hn::Add(constant(2), hn::Mul(hn::Mul(fourth, per_v), per_v)));
  add(sums.count, constant(1));
  add(sums.d[parity], d);
  add(sums.v[parity], v);
  add(sums.fourth[parity], fourth);
  return outliers;
}

BlockSums AddBlock(const float* reference, std::ptrdiff_t stride, float* frame, std::ptrdiff_t frame_stride,
                   const BlockNoise& noise, const BlockLimits& limits) {
  Mean mean[4];
  find_means(reference, stride, frame, frame_stride, noise, mean);
  const SiteRow site[2] = {site_row(noise, mean, 0), site_row(noise, mean, 1)};
  BlockSums out{};
  HWY_ALIGN float columns[9][side];
  for (int i = 0; i < side; i += lanes()) {
    const VF zero = hn::Zero(Floats());
    ColumnSums sums{zero, zero, zero, {zero, zero}, {zero, zero}, {zero, zero}};
    for (int y = 0; y < side; ++y) {
      out.outliers += add_row(reference + y * stride + i, stride, frame + y * frame_stride + i, site[y & 1], y & 1,
                              noise, limits, sums);
    }
    const VF all[9] = {sums.spread, sums.spread_variance, sums.count,    sums.d[0], sums.d[1], sums.v[0],
                       sums.v[1],   sums.fourth[0],       sums.fourth[1]};
    for (int k = 0; k < 9; ++k) hn::Store(all[k], Floats(), columns[k] + i);
  }
  const auto total = [&](int k) {
    float even, odd;
    add_columns(columns[k], even, odd);
    return even + odd;
  };
  out.spread = total(0);
  out.spread_variance = total(1);
  out.count = total(2);
  for (int p = 0; p < 2; ++p) {
    add_columns(columns[3 + p], out.d[2 * p], out.d[2 * p + 1]);
    add_columns(columns[5 + p], out.v[2 * p], out.v[2 * p + 1]);
    add_columns(columns[7 + p], out.fourth[2 * p], out.fourth[2 * p + 1]);
  }
  return out;
}

}  // namespace lowlux::merge::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::merge::rows {

HWY_EXPORT(AddBlock);

BlockSums add_block(const float* reference, std::ptrdiff_t stride, float* frame, std::ptrdiff_t frame_stride,
                    const BlockNoise& noise, const BlockLimits& limits) {
  return HWY_DYNAMIC_DISPATCH(AddBlock)(reference, stride, frame, frame_stride, noise, limits);
}

}  // namespace lowlux::merge::rows
#endif
