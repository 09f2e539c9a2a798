#include "denoise/temporal/temporal_rows.h"

#include <cstddef>

#if defined(__aarch64__)  // NEON only, as in isp/raw: arrays of vectors need vectors of known size
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "denoise/temporal/temporal_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

// Decisions must be identical on every processor: no fused products, no estimates.
HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;
using MF = hn::Mask<Floats>;

constexpr int cells_of_strip = sites_of_strip / 2;
static_assert(hn::MaxLanes(Floats()) <= blocks_of_strip);

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }
HWY_INLINE VF load(const float* from) { return hn::LoadU(Floats(), from); }
HWY_INLINE void store(VF v, float* to) { hn::StoreU(v, Floats(), to); }
HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }
HWY_INLINE VF limited(VF x) { return hn::Min(hn::Max(x, constant(-1e9f)), constant(1e9f)); }

/// Returns 0 for NaN, and otherwise x limited to +-1e9.
HWY_INLINE VF usable(VF x) { return limited(hn::IfThenElseZero(hn::Eq(x, x), x)); }

/// Statistics of each cell of a strip, whose sums over 4 cells are those of a block. Some are in threes: of R, G, B.
struct Sums {
  enum Figure {
    squares,
    bias,
    steady,
    change,
    weight = change + 3,
    poisson = weight + 3,
    count = poisson + 3,
    all = count + 3
  };
  float figure[all][cells_of_strip];
};

/// Sums of one colour in two rows of cells.
struct OfColour {
  VF squares;
  VF change;
  VF before;
  VF count;
};

/// Adds one site of each cell. A site that is saturated both in the frame and in the mean does not count.
HWY_INLINE void add_site(VF raw, VF before, float dark_e, float saturation_e, MF there, OfColour& sum) {
  const VF most = constant(saturation_e), y = hn::Min(hn::Sub(usable(raw), constant(dark_e)), most);
  const MF counts = hn::And(there, hn::Lt(hn::Min(y, before), most));
  const VF change = hn::IfThenElseZero(counts, hn::Sub(y, before));
  sum.squares = hn::Add(sum.squares, hn::Mul(change, change));
  sum.change = hn::Add(sum.change, change);
  sum.before = hn::Add(sum.before, hn::IfThenElseZero(counts, before));
  sum.count = hn::Add(sum.count, hn::IfThenElseZero(counts, constant(1)));
}

template <bool kRedIsOdd>
HWY_INLINE void add_cells(const MotionStrip& in, int pair, int i, OfColour (&sum)[3]) {
  const VF at = hn::Iota(Floats(), static_cast<float>(i));
  const int even_sites = (in.width + 1) / 2, odd_sites = in.width / 2;
  const MF even_there = hn::Lt(at, constant(static_cast<float>(even_sites)));
  const MF odd_there = hn::Lt(at, constant(static_cast<float>(odd_sites)));
  for (int r = 0; r < 2; ++r) {
    const int row = 2 * pair + r, even_colour = kRedIsOdd ? 1 + r : r, odd_colour = kRedIsOdd ? r : 1 + r;
    if (!in.inside[row]) continue;
    VF even, odd, even_before, odd_before;
    hn::LoadInterleaved2(Floats(), in.raw[row] + 2 * i, even, odd);
    hn::LoadInterleaved2(Floats(), in.mean_e[row] + 2 * i, even_before, odd_before);
    add_site(even, even_before, in.noise.dark_e[even_colour], in.noise.saturation_e[even_colour], even_there,
             sum[even_colour]);
    add_site(odd, odd_before, in.noise.dark_e[odd_colour], in.noise.saturation_e[odd_colour], odd_there,
             sum[odd_colour]);
  }
}

/// Adds the statistics of one colour in groups of 2 x 2 cells. A group has one variance x of its raw values, estimated
/// from the updated mean, with which a change is not correlated. Changes have weight 1 / x, and so have their squares.
HWY_INLINE void add_group(const SiteNoise& noise, int c, VF weight, const OfColour& own, VF (&sum)[Sums::all]) {
  const Floats f;
  const VF steady = constant(noise.variance_e2[c]), mean = hn::Add(own.before, hn::Mul(weight, own.change));
  const VF sites = hn::Add(own.count, hn::Reverse2(f, own.count));
  const VF told =
      hn::Add(hn::Add(mean, hn::Reverse2(f, mean)), hn::Mul(sites, constant(noise.dark_e[c] + noise.variance_e2[c])));
  const VF least = constant(noise.min_e2[c]), all = hn::Max(told, hn::Mul(hn::Max(sites, constant(1)), least));
  const VF by_all = hn::Div(constant(1), all), by_x = hn::Mul(sites, by_all);
  const VF weights = hn::Mul(own.count, by_x), counted = hn::Mul(weights, by_x);
  const VF read = hn::Mul(steady, counted);
  const auto add = [&sum](int figure, VF more) HWY_ATTR { sum[figure] = hn::Add(sum[figure], more); };
  add(Sums::squares, hn::Mul(by_x, own.squares));
  add(Sums::bias, hn::Mul(hn::Mul(steady, weights), by_all));
  add(Sums::steady, read);
  add(Sums::change + c, hn::Mul(by_x, own.change));
  add(Sums::weight + c, weights);
  add(Sums::poisson + c, hn::Max(hn::Sub(weights, read), hn::Zero(f)));  // (x - steady) / x^2
  add(Sums::count + c, own.count);
}

template <bool kRedIsOdd>
HWY_INLINE void sum_cells(const MotionStrip& in, const float* weights, Sums& out) {
  const VF zero = hn::Zero(Floats());
  for (int i = 0; i < cells_of_strip; i += lanes()) {
    VF sum[Sums::all];
    for (VF& s : sum) s = zero;
    for (int group = 0; group < 2; ++group) {
      OfColour colour[3] = {{zero, zero, zero, zero}, {zero, zero, zero, zero}, {zero, zero, zero, zero}};
      for (int pair = 2 * group; pair < 2 * group + 2; ++pair) add_cells<kRedIsOdd>(in, pair, i, colour);
      for (int c = 0; c < 3; ++c) add_group(in.noise, c, load(weights + i), colour[c], sum);
    }
    for (int k = 0; k < Sums::all; ++k) store(sum[k], out.figure[k] + i);
  }
}

/// Returns the sums over the cells of blocks.
HWY_INLINE VF of_blocks(const Sums& sums, int figure, int first) {
  VF a, b, c, d;
  hn::LoadInterleaved4(Floats(), sums.figure[figure] + 4 * first, a, b, c, d);
  return hn::Add(hn::Add(a, b), hn::Add(c, d));
}

/// Returns whether x exceeds the threshold of a gamma variable of this mean and variance.
HWY_INLINE MF exceeds(VF x, VF mean, VF variance, float z, VF few) {
  const VF positive = hn::Max(mean, constant(1e-6f));
  const VF by_shape = hn::Div(hn::Div(variance, positive), positive);
  const VF less = hn::Sub(constant(1), hn::Mul(constant(1.0f / 9), by_shape));
  const VF root = hn::Max(hn::Add(less, hn::Mul(constant(z / 3), hn::Sqrt(by_shape))), hn::Zero(Floats()));
  const VF threshold = hn::Mul(hn::Mul(few, positive), hn::Mul(root, hn::Mul(root, root)));
  return hn::And(hn::Gt(mean, hn::Zero(Floats())), hn::Gt(x, threshold));
}

/// The two statistics of blocks, each with its mean and variance.
struct Statistics {
  VF spread;
  VF spread_mean;
  VF spread_variance;
  VF step;
  VF step_mean;
  VF step_variance;
  VF change[3];  // sum of the differences over their variances without that of the mean, for R, G, B
  VF weight[3];  // and the variance of this sum, in the same way
  VF count[3];   // and the number of its sites
};

/// Returns the statistics of the blocks `first` and on.
/// @param s  variance ratio of the mean, before this frame
HWY_INLINE Statistics statistics_of(const Sums& sums, int first, VF s) {
  const Floats f;
  const VF one = constant(1), scale = hn::Div(one, hn::Add(one, s)), fresh = hn::Mul(s, scale), less = hn::Sub(one, s);
  const VF sharp = hn::Mul(scale, hn::Add(less, hn::Mul(s, s)));  // (1 + s^3) / (1 + s)^2
  VF change[3], weight[3], count[3];
  VF step = hn::Zero(f), colours = hn::Zero(f), sites = hn::Zero(f), poisson = hn::Zero(f), excess = hn::Zero(f);
  for (int c = 0; c < 3; ++c) {
    change[c] = of_blocks(sums, Sums::change + c, first), weight[c] = of_blocks(sums, Sums::weight + c, first);
    count[c] = of_blocks(sums, Sums::count + c, first);
    const VF own = of_blocks(sums, Sums::poisson + c, first);
    const MF any = hn::Gt(count[c], hn::Zero(f));
    const VF n = hn::Max(count[c], one);
    step = hn::Add(step, hn::Div(hn::Mul(change[c], change[c]), hn::IfThenElse(any, weight[c], one)));
    colours = hn::Add(colours, hn::IfThenElseZero(any, one));
    sites = hn::Add(sites, count[c]);
    poisson = hn::Add(poisson, own);
    excess = hn::Add(excess, hn::Div(own, hn::Mul(n, n)));
  }
  const VF all = hn::Mul(scale, of_blocks(sums, Sums::squares, first)), free = hn::Sub(sites, colours);
  step = hn::Mul(scale, step);
  const VF of_poisson = hn::Mul(hn::Mul(hn::Mul(less, less), scale), poisson);
  const VF of_steady = hn::Mul(fresh, of_blocks(sums, Sums::steady, first));
  return {
      hn::Sub(all, step),
      hn::Add(free, hn::Mul(hn::IfThenElseZero(hn::Gt(free, hn::Zero(f)), fresh), of_blocks(sums, Sums::bias, first))),
      hn::Add(hn::Add(free, free), hn::Add(of_poisson, of_steady)),
      step,
      colours,
      hn::Add(hn::Add(colours, colours), hn::Mul(sharp, excess)),
      {change[0], change[1], change[2]},
      {weight[0], weight[1], weight[2]},
      {count[0], count[1], count[2]}};
}

HWY_INLINE MF moved_at(const Statistics& s, const Threshold& at) {
  return hn::Or(exceeds(s.spread, s.spread_mean, s.spread_variance, at.z, constant(1)),
                exceeds(s.step, s.step_mean, s.step_variance, at.z, constant(at.few)));
}

void FindMotion(const MotionStrip& in, std::uint8_t* moved, BlockSteps& steps) {
  HWY_ALIGN float weights[cells_of_strip];
  for (int b = 0; b < blocks_of_strip; ++b) {
    const float best = in.share[b] / (1 + in.share[b]), weight = best > in.min_weight ? best : in.min_weight;
    for (int i = 4 * b; i < 4 * b + 4; ++i) weights[i] = weight;
  }
  Sums sums;
  if (in.red_is_odd) {
    sum_cells<true>(in, weights, sums);
  } else {
    sum_cells<false>(in, weights, sums);
  }
  HWY_ALIGN float level[blocks_of_strip];
  for (int b = 0; b < blocks_of_strip; b += lanes()) {
    const VF share = load(in.share + b);
    const Statistics s = statistics_of(sums, b, share);
    const VF beside = hn::IfThenElseZero(moved_at(s, in.beside), constant(1));
    const MF alone = moved_at(s, in.alone);
    store(hn::IfThenElse(alone, constant(2), beside), level + b);
    const VF scale = hn::IfThenZeroElse(alone, hn::Div(constant(1), hn::Add(constant(1), share)));
    for (int c = 0; c < 3; ++c) {
      store(hn::Mul(scale, s.change[c]), steps.sum[c] + b);
      store(hn::Mul(scale, s.weight[c]), steps.variance[c] + b);
      store(hn::Mul(scale, s.count[c]), steps.count[c] + b);
    }
  }
  for (int b = 0; b < blocks_of_strip; ++b) moved[b] = static_cast<std::uint8_t>(level[b]);
}

/// Returns a vector that alternates the values of even and of odd columns.
HWY_INLINE VF alternating(float even, float odd) { return hn::OddEven(constant(odd), constant(even)); }

void UpdateMean(const UpdateStrip& in) {
  HWY_ALIGN float weights[sites_of_strip];
  for (int i = 0; i < sites_of_strip; ++i) weights[i] = in.weight[i / motion_block];
  for (int row = 0; row < in.rows; ++row) {
    const int site = 2 * (row % 2);
    const VF dark = alternating(in.dark_e[site], in.dark_e[site + 1]);
    const VF most = alternating(in.saturation_e[site], in.saturation_e[site + 1]);
    for (int i = 0; i < sites_of_strip; i += lanes()) {
      const VF raw = usable(load(in.raw[row] + i)), weight = load(weights + i), before = load(in.before_e[row] + i);
      const VF signal = hn::Sub(raw, dark), y = hn::Min(signal, most);
      const MF starts = hn::Ge(weight, constant(1));
      const VF mean = hn::IfThenElse(starts, y, hn::Add(before, hn::Mul(weight, hn::Sub(y, before))));
      store(mean, in.mean_e[row] + i);
      store(hn::IfThenElse(hn::Or(starts, hn::Ge(signal, most)), raw, hn::Add(mean, dark)), in.out[row] + i);
    }
  }
}

void ScaleMean(const ScaleStrip& in, float (*sums)[sites_of_strip]) {
  const VF light = constant(in.light);
  for (int i = 0; i < sites_of_strip; i += lanes()) {
    VF sum[2] = {hn::Zero(Floats()), hn::Zero(Floats())};
    for (int row = 0; row < in.rows; ++row) {
      const int site = 2 * (row % 2);
      const VF most = alternating(in.saturation_e[site], in.saturation_e[site + 1]);
      const VF mean = hn::Min(limited(hn::Mul(light, load(in.mean_e[row] + i))), most);
      store(mean, in.mean_e[row] + i);
      sum[row % 2] = hn::Add(sum[row % 2], mean);
    }
    for (int r = 0; r < 2; ++r) store(sum[r], sums[r] + i);
  }
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::denoise::rows {

HWY_EXPORT(FindMotion);
HWY_EXPORT(ScaleMean);
HWY_EXPORT(UpdateMean);

void find_motion(const MotionStrip& in, std::uint8_t* moved, BlockSteps& steps) {
  HWY_DYNAMIC_DISPATCH(FindMotion)(in, moved, steps);
}
void scale_mean(const ScaleStrip& in, float (*sums)[sites_of_strip]) { HWY_DYNAMIC_DISPATCH(ScaleMean)(in, sums); }
void update_mean(const UpdateStrip& in) { HWY_DYNAMIC_DISPATCH(UpdateMean)(in); }

}  // namespace lowlux::denoise::rows
#endif
