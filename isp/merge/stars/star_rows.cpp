#include "isp/merge/stars/star_rows.h"

#include <cstddef>
#include <cstdint>

#if defined(__aarch64__)  // NEON only, as in isp/raw
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/merge/stars/star_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lowlux::merge::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;
using MF = hn::Mask<Floats>;

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }
HWY_INLINE VF load(const float* from) { return hn::LoadU(Floats(), from); }
HWY_INLINE void store(VF v, float* to) { hn::StoreU(v, Floats(), to); }
HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }

/// Values linear in the column: those of even and odd columns in turn.
struct Line {
  VF at_node;
  VF slope;

  HWY_INLINE VF at(VF offset) const { return hn::MulAdd(offset, slope, at_node); }
};

/// Returns the line through two nodes; `flat` for the value of the first only.
HWY_INLINE Line line_of(const float* const (&values)[2], int node, int other, float distance, bool flat) {
  const auto slope = [&](int parity) HWY_ATTR {
    return flat || node == other ? 0.0f : (values[parity][other] - values[parity][node]) / distance;
  };
  return {hn::OddEven(constant(values[1][node]), constant(values[0][node])),
          hn::OddEven(constant(slope(1)), constant(slope(0)))};
}

/// Writes scores from an even column on; vectors reach beyond the end. Returns the lanes in which something is missing.
HWY_INLINE MF score_columns(const ScoreRow& in, int first, int last, int node_px, const Line& level,
                            const Line& per_std) {
  const Floats f;
  MF missing = hn::Ne(hn::Zero(f), hn::Zero(f));
  for (int x = first; x < last; x += lanes()) {
    VF signal;
    if (HWY_LIKELY(x + lanes() <= in.width)) {
      signal = load(in.signal_e + x);
    } else {
      HWY_ALIGN float rest[hn::MaxLanes(Floats())] = {};
      for (int k = 0; x + k < in.width; ++k) rest[k] = in.signal_e[x + k];
      signal = hn::Load(f, rest);
    }
    const VF offset = hn::Iota(f, static_cast<float>(x - node_px));
    const VF score = hn::Mul(hn::Sub(signal, level.at(offset)), per_std.at(offset));
    const MF there = hn::Lt(hn::Abs(score), constant(1e9f));  // false for NaN
    missing = hn::Or(missing, hn::Not(there));
    store(hn::IfThenElseZero(there, score), in.score + x);
  }
  return missing;
}

bool ScoreRowOf(const ScoreRow& in) {
  MF missing = hn::Ne(hn::Zero(Floats()), hn::Zero(Floats()));
  for (int segment = 0; segment <= in.nodes; ++segment) {
    const int node = segment == 0 ? 0 : segment - 1;
    const int other = segment == 0 ? (in.nodes > 1 ? 1 : 0) : segment < in.nodes ? segment : (node > 0 ? node - 1 : 0);
    const int first = segment == 0 ? 0 : in.node_px[node], last = segment < in.nodes ? in.node_px[segment] : in.width;
    const auto distance = static_cast<float>(in.node_px[other] - in.node_px[node]);
    const bool outside = segment == 0 || segment == in.nodes;
    const Line level = line_of(in.level_e, node, other, distance, false);
    const Line per_std = line_of(in.per_std, node, other, distance, outside);
    missing = hn::Or(missing, score_columns(in, first, last, in.node_px[node], level, per_std));
  }
  for (int k = 0; k < row_padding; ++k) in.score[in.width + k] = 0;
  return !hn::AllFalse(Floats(), missing);
}

void FilterRowOf(const FilterRow& in) {
  const int radius = in.radius;
  for (int x = 0; x < in.width; x += lanes()) {
    VF sum = hn::Mul(constant(in.taps[0]), load(in.rows[radius] + x));
    for (int j = 1; j <= radius; ++j) {
      const VF pair = hn::Add(load(in.rows[radius - j] + x), load(in.rows[radius + j] + x));
      sum = hn::MulAdd(constant(in.taps[j]), pair, sum);
    }
    store(sum, in.vertical + x);
  }
  for (int x = 0; x < in.width; x += lanes()) {
    VF sum = hn::Mul(constant(in.taps[0]), load(in.vertical + x));
    for (int i = 1; i <= radius; ++i) {
      const VF pair = hn::Add(load(in.vertical + x - i), load(in.vertical + x + i));
      sum = hn::MulAdd(constant(in.taps[i]), pair, sum);
    }
    store(sum, in.out + x);
  }
}

int BrightColumns(const float* row, int width, float limit, std::int32_t* columns) {
  const Floats f;
  int found = 0;
  int x = 0;
  for (; x + lanes() <= width; x += lanes()) {
    if (HWY_LIKELY(hn::AllFalse(f, hn::Gt(load(row + x), constant(limit))))) continue;
    for (int k = x; k < x + lanes(); ++k) {
      if (row[k] > limit) columns[found++] = k;
    }
  }
  for (; x < width; ++x) {
    if (row[x] > limit) columns[found++] = x;
  }
  return found;
}

}  // namespace lowlux::merge::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::merge::rows {

HWY_EXPORT(ScoreRowOf);
HWY_EXPORT(FilterRowOf);
HWY_EXPORT(BrightColumns);

bool score_row(const ScoreRow& in) { return HWY_DYNAMIC_DISPATCH(ScoreRowOf)(in); }
void filter_row(const FilterRow& in) { HWY_DYNAMIC_DISPATCH(FilterRowOf)(in); }
int bright_columns(const float* row, int width, float limit, std::int32_t* columns) {
  return HWY_DYNAMIC_DISPATCH(BrightColumns)(row, width, limit, columns);
}

}  // namespace lowlux::merge::rows
#endif
