#include "isp/merge/placement_rows.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#if defined(__aarch64__)  // NEON only, as everywhere
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/merge/placement_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

// The bits are the same on every processor: no fused products, no estimates, sums in one order for all vector lengths.
HWY_BEFORE_NAMESPACE();
namespace lowlux::merge::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int max_lanes = 8;
using Floats = hn::CappedTag<float, max_lanes>;
using Ints = hn::RebindToSigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;
using MF = hn::Mask<Floats>;
using MI = hn::Mask<Ints>;

constexpr float far_px = 1e6F;  // of places that no plane contains

HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }
HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }
HWY_INLINE VI whole(int x) { return hn::Set(Ints(), x); }
HWY_INLINE VF load(const float* from) { return hn::LoadU(Floats(), from); }
HWY_INLINE VF missing() { return constant(std::numeric_limits<float>::quiet_NaN()); }
HWY_INLINE MI of_ints(MF mask) { return hn::RebindMask(Ints(), mask); }
HWY_INLINE MF of_floats(MI mask) { return hn::RebindMask(Floats(), mask); }

/// Returns displacements that fit into integers, with NaN far outside.
HWY_INLINE VF bounded(VF d) {
  const VF known = hn::IfThenElse(hn::Eq(d, d), d, constant(far_px));
  return hn::Min(hn::Max(known, constant(-far_px)), constant(far_px));
}

/// Calls work(x, dx, dy) for each vector of pixels of a row, and stores what it returns.
template <class Work>
HWY_INLINE void for_pixels(const DisplacedRow& at, const Work& work) {
  int x = 0;
  for (; x + lanes() <= at.count; x += lanes()) work(x, bounded(load(at.dx + x)), bounded(load(at.dy + x)), lanes());
  if (x == at.count) return;
  HWY_ALIGN float dx[max_lanes], dy[max_lanes];
  std::fill_n(dx, max_lanes, far_px);
  std::fill_n(dy, max_lanes, far_px);
  const auto left = static_cast<std::size_t>(at.count - x);
  std::memcpy(dx, at.dx + x, left * sizeof(float));
  std::memcpy(dy, at.dy + x, left * sizeof(float));
  work(x, bounded(load(dx)), bounded(load(dy)), at.count - x);
}

HWY_INLINE void store(VF v, int count, float* out) {
  if (count == lanes()) return hn::StoreU(v, Floats(), out);
  HWY_ALIGN float all[max_lanes];
  hn::Store(v, Floats(), all);
  std::memcpy(out, all, static_cast<std::size_t>(count) * sizeof(float));
}

/// Calls work(first_column, row, mask) for each group of pixels among `pending` with one whole displacement, where the
/// first lane takes the sample (first_column, row) and each other one the next.
template <class Work>
HWY_INLINE void for_groups(int x, int y, VI column_shift, VI row_shift, MI pending, const Work& work) {
  const Ints s32;
  while (!hn::AllFalse(s32, pending)) {
    const auto lane = static_cast<std::size_t>(hn::FindKnownFirstTrue(s32, pending));
    const int across = hn::ExtractLane(column_shift, lane), down = hn::ExtractLane(row_shift, lane);
    const MI same = hn::And(hn::Eq(column_shift, whole(across)), hn::Eq(row_shift, whole(down)));
    const MI group = hn::And(pending, same);
    work(x + across, y + down, group);
    pending = hn::AndNot(group, pending);
  }
}

/// Returns whether all samples of a vector from (column, row) exist, with a number of columns and rows around them.
HWY_INLINE bool all_exist(const Samples& s, int column, int row, int before, int after) {
  return column >= before && row >= before && column + lanes() + after <= s.width && row + 1 + after <= s.height;
}

/// Returns the weights of four neighbours for the fraction t in 0..1 between the second and the third.
struct CubicWeights {
  VF w[4];
};

HWY_INLINE CubicWeights cubic_weights(VF t) {
  const VF t2 = hn::Mul(t, t), t3 = hn::Mul(t2, t), half = constant(0.5F);
  return {{hn::Sub(hn::Sub(t2, hn::Mul(half, t3)), hn::Mul(half, t)),
           hn::Add(hn::Sub(hn::Mul(constant(1.5F), t3), hn::Mul(constant(2.5F), t2)), constant(1)),
           hn::Add(hn::Sub(hn::Mul(constant(2), t2), hn::Mul(constant(1.5F), t3)), hn::Mul(half, t)),
           hn::Mul(half, hn::Sub(t3, t2))}};
}

/// Interpolates a vector. `sample(i, j)` returns those i - 1 columns and j - 1 rows after the places' whole parts.
template <class Sample>
HWY_INLINE VF interpolate(const CubicWeights& across, const CubicWeights& down, const Sample& sample) {
  VF sum = hn::Zero(Floats());
  for (int j = 0; j < 4; ++j) {
    const VF left = hn::Add(hn::Mul(across.w[0], sample(0, j)), hn::Mul(across.w[1], sample(1, j)));
    const VF right = hn::Add(hn::Mul(across.w[2], sample(2, j)), hn::Mul(across.w[3], sample(3, j)));
    sum = hn::Add(sum, hn::Mul(down.w[j], hn::Add(left, right)));
  }
  return sum;
}

/// Returns one sample for each lane, those of the border beyond it.
HWY_INLINE VF clamped(const Samples& even, const Samples& odd, int column, int row) {
  HWY_ALIGN float out[max_lanes];
  const std::ptrdiff_t line = even.stride * std::clamp(row, 0, even.height - 1);
  for (int lane = 0; lane < lanes(); ++lane) {
    const float* const data = (lane & 1) != 0 ? odd.data : even.data;
    out[lane] = data[line + std::clamp(column + lane, 0, even.width - 1)];
  }
  return hn::Load(Floats(), out);
}

void InterpolateRow(const Samples& even, const Samples& odd, const DisplacedRow& at, float* out) {
  for_pixels(at, [&](int x, VF dx, VF dy, int count) HWY_ATTR {
    const Ints s32;
    const VF floor_x = hn::Floor(dx), floor_y = hn::Floor(dy);
    const VF fraction_x = hn::Sub(dx, floor_x), fraction_y = hn::Sub(dy, floor_y);
    const VI column_shift = hn::ConvertTo(s32, floor_x), row_shift = hn::ConvertTo(s32, floor_y);
    const VI column = hn::Add(column_shift, hn::Iota(s32, x)), row = hn::Add(row_shift, whole(at.y));
    // A place on the last column or row needs no sample beyond it.
    const auto within = [=](VI first, VF fraction, int size) HWY_ATTR {
      const VI more = hn::VecFromMask(s32, of_ints(hn::Gt(fraction, hn::Zero(Floats()))));  // -1 or 0
      return hn::And(hn::Gt(first, whole(-1)), hn::Lt(hn::Sub(first, more), whole(size)));
    };
    const MI inside = hn::And(within(column, fraction_x, even.width), within(row, fraction_y, even.height));
    const CubicWeights across = cubic_weights(fraction_x), down = cubic_weights(fraction_y);
    VF all = missing();
    for_groups(x, at.y, column_shift, row_shift, inside, [&](int first, int line, MI group) HWY_ATTR {
      VF found;
      if (all_exist(even, first, line, 1, 2)) {
        const std::ptrdiff_t corner = (line - 1) * even.stride + first - 1;
        found = interpolate(across, down, [&](int i, int j) HWY_ATTR {
          const std::ptrdiff_t offset = corner + j * even.stride + i;
          return hn::OddEven(load(odd.data + offset), load(even.data + offset));
        });
      } else {
        found = interpolate(across, down,
                            [&](int i, int j) HWY_ATTR { return clamped(even, odd, first - 1 + i, line - 1 + j); });
      }
      all = hn::IfThenElse(of_floats(group), found, all);
    });
    store(all, count, out + x);
  });
}

/// Returns one sample for each lane, NaN beyond the border.
HWY_INLINE VF existing(const Samples& s, int column, int row) {
  if (all_exist(s, column, row, 0, 0)) return load(s.data + row * s.stride + column);
  HWY_ALIGN float out[max_lanes];
  for (int lane = 0; lane < lanes(); ++lane) {
    const bool exists = row >= 0 && row < s.height && column + lane >= 0 && column + lane < s.width;
    out[lane] = exists ? s.data[row * s.stride + column + lane] : std::numeric_limits<float>::quiet_NaN();
  }
  return hn::Load(Floats(), out);
}

void NearestRow(const Samples& samples, const DisplacedRow& at, float* out) {
  for_pixels(at, [&](int x, VF dx, VF dy, int count) HWY_ATTR {
    const auto whole_cells = [](VF d) HWY_ATTR { return hn::ShiftLeft<1>(hn::NearestInt(hn::Mul(constant(0.5F), d))); };
    VF all = missing();
    const MI everywhere = hn::Eq(whole(0), whole(0));
    for_groups(x, at.y, whole_cells(dx), whole_cells(dy), everywhere, [&](int first, int line, MI group) HWY_ATTR {
      all = hn::IfThenElse(of_floats(group), existing(samples, first, line), all);
    });
    store(all, count, out + x);
  });
}

/// Returns whether two sites of a 2x2 cell, counted from red, have the same colour.
HWY_INLINE bool same_colour(int x, int y, int other_x, int other_y) {
  return (x == other_x && y == other_y) || (x != y && other_x != other_y);
}

/// A sample of a drop, relative to the whole part of its place: -1..2, since a radius of 2 reaches no farther.
struct Tap {
  int i;
  int j;
  int lanes;  // whose colour it has: 0 even ones, 1 odd ones, 2 all
};

/// Lists the samples of a drop.
struct Taps {
  int count = 0;
  Tap tap[8];  // half of 16 have one of a row's two colours
};

/// Returns the samples of drops in row `y` where the first lane's place lies in a column and a row of a parity.
HWY_INLINE Taps taps_of(const Mosaic& mosaic, int y, int column_parity, int row_parity, const DropRadius& of) {
  Taps out;
  const float radius = of.even > of.odd ? of.even : of.odd;
  const int y_from_red = (y ^ mosaic.red_row) & 1, first = radius > 1 ? -1 : 0, last = radius > 1 ? 2 : 1;
  for (int j = first; j <= last; ++j) {
    for (int i = first; i <= last; ++i) {
      const int u = (column_parity + i + mosaic.red_column) & 1, v = (row_parity + j + mosaic.red_row) & 1;
      const bool at_even = same_colour(mosaic.red_column, y_from_red, u, v);
      const bool at_odd = same_colour(mosaic.red_column ^ 1, y_from_red, u ^ 1, v);
      if (at_even || at_odd) out.tap[out.count++] = {i, j, at_even && at_odd ? 2 : at_odd ? 1 : 0};
    }
  }
  return out;
}

/// The weights max(1 - |d| / radius, 0) of the samples -1..2 along one axis.
struct Tents {
  VF w[4];
};

HWY_INLINE Tents tents(VF fraction, VF per_radius) {
  const auto weight = [=](float place) HWY_ATTR {
    const VF distance = hn::Abs(hn::Sub(constant(place), fraction));
    return hn::Max(hn::Sub(constant(1), hn::Mul(distance, per_radius)), hn::Zero(Floats()));
  };
  return {{weight(-1), weight(0), weight(1), weight(2)}};
}

struct DropSums {
  VF value;
  VF weight;
};

/// Adds up the samples of a vector of drops. `sample(i, j)` returns those i columns and j rows after the places' whole
/// parts.
template <class Sample>
HWY_INLINE DropSums add_taps(const Taps& taps, const MF (&colours)[3], const Tents& across, const Tents& down,
                             const Sample& sample) {
  DropSums out{hn::Zero(Floats()), hn::Zero(Floats())};
  for (int k = 0; k < taps.count; ++k) {
    const Tap& tap = taps.tap[k];
    const VF d = sample(tap.i, tap.j);
    const MF counts = hn::And(colours[tap.lanes], hn::Eq(d, d));
    const VF t = hn::IfThenElseZero(counts, hn::Mul(down.w[tap.j + 1], across.w[tap.i + 1]));
    out.value = hn::Add(out.value, hn::Mul(t, hn::IfThenElseZero(counts, d)));
    out.weight = hn::Add(out.weight, t);
  }
  return out;
}

void DropRow(const Mosaic& mosaic, const DisplacedRow& at, const DropRadius& radius, float* value, float* weight) {
  const Samples& samples = mosaic.samples;
  const MF all = hn::Eq(hn::Zero(Floats()), hn::Zero(Floats()));
  const MF odd = of_floats(hn::Ne(hn::And(hn::Iota(Ints(), 0), whole(1)), whole(0)));
  const MF colours[3] = {hn::Not(odd), odd, all};
  const VF per_radius = hn::OddEven(constant(1 / radius.odd), constant(1 / radius.even));
  Taps taps[2][2];
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) taps[row][column] = taps_of(mosaic, at.y, column, row, radius);
  }
  for_pixels(at, [&](int x, VF dx, VF dy, int count) HWY_ATTR {
    const Ints s32;
    const VF floor_x = hn::Floor(dx), floor_y = hn::Floor(dy);
    const Tents across = tents(hn::Sub(dx, floor_x), per_radius), down = tents(hn::Sub(dy, floor_y), per_radius);
    DropSums sums{hn::Zero(Floats()), hn::Zero(Floats())};
    const auto add_group = [&](int first, int line, MI group) HWY_ATTR {
      if (first + lanes() < -1 || first > samples.width || line < -2 || line > samples.height) return;
      const Taps& own = taps[line & 1][first & 1];
      const float* const corner = samples.data + line * samples.stride + first;
      const auto inside = [&](int i, int j) HWY_ATTR { return load(corner + j * samples.stride + i); };
      const auto anywhere = [&](int i, int j) HWY_ATTR { return existing(samples, first + i, line + j); };
      const DropSums found = all_exist(samples, first, line, 1, 2) ? add_taps(own, colours, across, down, inside)
                                                                   : add_taps(own, colours, across, down, anywhere);
      sums.value = hn::IfThenElse(of_floats(group), found.value, sums.value);
      sums.weight = hn::IfThenElse(of_floats(group), found.weight, sums.weight);
    };
    for_groups(x, at.y, hn::ConvertTo(s32, floor_x), hn::ConvertTo(s32, floor_y), of_ints(all), add_group);
    const MF any = hn::Gt(sums.weight, hn::Zero(Floats()));
    const VF mean = hn::Div(sums.value, hn::IfThenElse(any, sums.weight, constant(1)));
    store(hn::IfThenElse(any, mean, missing()), count, value + x);
    store(sums.weight, count, weight + x);
  });
}

/// The weights of the samples 0 and 1 along one axis.
struct NearTents {
  VF w[2];
};

HWY_INLINE NearTents near_tents(VF fraction, float radius) {
  const Tents all = tents(fraction, constant(1 / radius));
  return {{all.w[1], all.w[2]}};
}

/// Adds up weighted samples where they exist.
HWY_INLINE DropSums add_sample(const DropSums& sums, VF d, VF tent) {
  constexpr float steps = 256;
  const VF t =
      hn::IfThenElseZero(hn::Eq(d, d), hn::Mul(hn::Round(hn::Mul(tent, constant(steps))), constant(1 / steps)));
  const VF known = hn::IfThenElseZero(hn::Eq(d, d), d);
  return {hn::Add(sums.value, hn::Mul(t, known)), hn::Add(sums.weight, t)};
}

void ColourRowOf(const Mosaic& mosaic, const DisplacedRow& at, const ColourRadius& radius, const ColourRow& out) {
  const Samples& samples = mosaic.samples;
  const MI everywhere = hn::Eq(whole(0), whole(0));
  for_pixels(at, [&](int x, VF dx, VF dy, int count) HWY_ATTR {
    const Ints s32;
    const VF floor_x = hn::Floor(dx), floor_y = hn::Floor(dy);
    const VF fraction_x = hn::Sub(dx, floor_x), fraction_y = hn::Sub(dy, floor_y);
    const NearTents green_across = near_tents(fraction_x, radius.green),
                    green_down = near_tents(fraction_y, radius.green);
    const NearTents across = near_tents(fraction_x, radius.red_blue), down = near_tents(fraction_y, radius.red_blue);
    const DropSums none{hn::Zero(Floats()), hn::Zero(Floats())};
    DropSums sums[3] = {none, none, none};
    // Of the 2x2 samples around each place one is red, two are green and one is blue.
    const auto add_group = [&](int first, int line, MI group) HWY_ATTR {
      if (first + lanes() < -1 || first > samples.width || line < -2 || line > samples.height) return;
      const int red_row = (line ^ mosaic.red_row) & 1;
      const int red_column = (first ^ mosaic.red_column) & 1;  // at even lanes
      const auto in_red_column = [=](const VF(&v)[2])
                                     HWY_ATTR { return hn::OddEven(v[1 - red_column], v[red_column]); };
      const auto beside = [=](const VF(&v)[2]) HWY_ATTR { return hn::OddEven(v[red_column], v[1 - red_column]); };
      const bool inside = all_exist(samples, first, line, 0, 1);
      const auto sample = [&](int i, int j) HWY_ATTR {
        return inside ? load(samples.data + (line + j) * samples.stride + first + i)
                      : existing(samples, first + i, line + j);
      };
      const VF red_line[2] = {sample(0, red_row), sample(1, red_row)};
      const VF blue_line[2] = {sample(0, 1 - red_row), sample(1, 1 - red_row)};
      const DropSums red = add_sample(none, in_red_column(red_line), hn::Mul(down.w[red_row], in_red_column(across.w)));
      const DropSums blue = add_sample(none, beside(blue_line), hn::Mul(down.w[1 - red_row], beside(across.w)));
      DropSums green = add_sample(none, beside(red_line), hn::Mul(green_down.w[red_row], beside(green_across.w)));
      green = add_sample(green, in_red_column(blue_line),
                         hn::Mul(green_down.w[1 - red_row], in_red_column(green_across.w)));
      const DropSums found[3] = {red, green, blue};
      for (int c = 0; c < 3; ++c) {
        sums[c].value = hn::IfThenElse(of_floats(group), found[c].value, sums[c].value);
        sums[c].weight = hn::IfThenElse(of_floats(group), found[c].weight, sums[c].weight);
      }
    };
    for_groups(x, at.y, hn::ConvertTo(s32, floor_x), hn::ConvertTo(s32, floor_y), everywhere, add_group);
    for (int c = 0; c < 3; ++c) {
      store(sums[c].value, count, out.value[c] + x);
      store(sums[c].weight, count, out.weight[c] + x);
    }
  });
}

}  // namespace lowlux::merge::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::merge::rows {

HWY_EXPORT(ColourRowOf);
HWY_EXPORT(DropRow);
HWY_EXPORT(InterpolateRow);
HWY_EXPORT(NearestRow);

void interpolate_row(const Samples& even, const Samples& odd, const DisplacedRow& at, float* out) {
  HWY_DYNAMIC_DISPATCH(InterpolateRow)(even, odd, at, out);
}
void nearest_row(const Samples& samples, const DisplacedRow& at, float* out) {
  HWY_DYNAMIC_DISPATCH(NearestRow)(samples, at, out);
}
void drop_row(const Mosaic& mosaic, const DisplacedRow& at, const DropRadius& radius, float* value, float* weight) {
  HWY_DYNAMIC_DISPATCH(DropRow)(mosaic, at, radius, value, weight);
}
void colour_row(const Mosaic& mosaic, const DisplacedRow& at, const ColourRadius& radius, const ColourRow& out) {
  HWY_DYNAMIC_DISPATCH(ColourRowOf)(mosaic, at, radius, out);
}

}  // namespace lowlux::merge::rows
#endif
