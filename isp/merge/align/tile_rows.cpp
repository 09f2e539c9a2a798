#include "isp/merge/align/tile_rows.h"

#include <cstdint>
#include <cstring>

#if defined(__aarch64__)  // NEON only, as everywhere
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/merge/align/tile_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

// The bits are the same on every processor: no fused products, no estimates, sums of columns in one order for all sizes
// of vectors.
HWY_BEFORE_NAMESPACE();
namespace lowlux::merge::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int columns = 8;  // of a call of add_tile
using Floats = hn::CappedTag<float, columns>;
using Ints = hn::RebindToSigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;
using MF = hn::Mask<Floats>;

HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Floats())); }
HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }
HWY_INLINE VI whole(int x) { return hn::Set(Ints(), x); }
HWY_INLINE VF load(const float* from) { return hn::LoadU(Floats(), from); }

/// Weights of the cells -1, 0, 1, 2 for a position at a fraction 0..1 after cell 0.
struct Weights {
  VF w[4];
};

HWY_INLINE Weights lagrange(VF a) {
  const VF one = constant(1), before = hn::Add(a, one), after = hn::Sub(one, a), far = hn::Sub(constant(2), a);
  const VF inner = hn::Mul(a, after), outer = hn::Mul(before, far);
  const VF sixth = constant(1.0F / 6), half = constant(0.5F);
  return {{hn::Neg(hn::Mul(sixth, hn::Mul(inner, far))), hn::Mul(half, hn::Mul(outer, after)),
           hn::Mul(half, hn::Mul(outer, a)), hn::Neg(hn::Mul(sixth, hn::Mul(inner, before)))}};
}

/// Interpolates a vector of positions.
/// @param column, line  whole parts of the positions, inside of the level and its borders
template <class Load>
HWY_INLINE VF interpolate(const Weights& wx, const Weights& wy, std::ptrdiff_t stride, const Load& load_at) {
  VF sum = hn::Zero(Floats());
  for (int j = 0; j < 4; ++j) {
    const std::ptrdiff_t row = (j - 1) * stride;
    const VF left = hn::Add(hn::Mul(wx.w[0], load_at(row - 1)), hn::Mul(wx.w[1], load_at(row)));
    const VF right = hn::Add(hn::Mul(wx.w[2], load_at(row + 1)), hn::Mul(wx.w[3], load_at(row + 2)));
    sum = hn::Add(sum, hn::Mul(wy.w[j], hn::Add(left, right)));
  }
  return sum;
}

HWY_INLINE VF sample(const Samples& level, int x, int y, VF dx, VF dy) {
  const Floats f;
  const Ints s32;
  const VF floor_x = hn::Floor(dx), floor_y = hn::Floor(dy);
  const Weights wx = lagrange(hn::Sub(dx, floor_x)), wy = lagrange(hn::Sub(dy, floor_y));
  const VI at_x = hn::Add(hn::ConvertTo(s32, floor_x), hn::Iota(s32, x));
  const VI at_y = hn::Add(hn::ConvertTo(s32, floor_y), whole(y));
  // Positions farther out than the interpolation reaches are moved to where no cell exists.
  const VI column = hn::Min(hn::Max(at_x, whole(-3)), whole(level.width + 1));
  const VI line = hn::Min(hn::Max(at_y, whole(-2)), whole(level.height + 1));
  const int first_column = hn::GetLane(column), first_line = hn::GetLane(line);
  const VI straight = hn::Iota(s32, first_column);
  if (hn::AllTrue(s32, hn::And(hn::Eq(column, straight), hn::Eq(line, whole(first_line))))) {
    const float* const from = level.data + first_line * level.stride + first_column;
    return interpolate(wx, wy, level.stride, [=](std::ptrdiff_t offset) HWY_ATTR { return load(from + offset); });
  }
  const VI at = hn::Add(hn::Mul(line, whole(static_cast<int>(level.stride))), column);
  return interpolate(wx, wy, level.stride,
                     [=](std::ptrdiff_t offset) HWY_ATTR { return hn::GatherIndex(f, level.data + offset, at); });
}

void SampleRow(const Samples& level, int x0, int y, const float* dx, const float* dy, int count, float* out) {
  int i = 0;
  for (; i + lanes() <= count; i += lanes()) {
    hn::StoreU(sample(level, x0 + i, y, load(dx + i), load(dy + i)), Floats(), out + i);
  }
  if (i == count) return;
  const std::size_t left = static_cast<std::size_t>(count - i) * sizeof(float);
  HWY_ALIGN float last_x[columns] = {}, last_y[columns] = {}, last[columns];
  std::memcpy(last_x, dx + i, left);
  std::memcpy(last_y, dy + i, left);
  hn::StoreU(sample(level, x0 + i, y, load(last_x), load(last_y)), Floats(), last);
  std::memcpy(out + i, last, left);
}

/// A cell and its four neighbours.
struct Cross {
  VF centre;
  VF left;
  VF right;
  VF upper;
  VF lower;
};

HWY_INLINE Cross load_cross(const float* at, std::ptrdiff_t stride) {
  return {load(at), load(at - 1), load(at + 1), load(at - stride), load(at + stride)};
}

HWY_INLINE VF around(const Cross& c) { return hn::Add(hn::Add(c.left, c.right), hn::Add(c.upper, c.lower)); }

/// Returns the product of the slopes of two runs of three cells: with one-sided differences o and central ones c,
/// (o o' + c c') / 2. For a wave of frequency omega that is (4 sin^2(omega / 2) + sin^2(omega)) / 2, within 4 % of
/// omega sin(omega), the derivative of c d, up to a frequency of 2.
HWY_INLINE VF slope_product(VF before, VF at, VF after, VF other_before, VF other_at, VF other_after) {
  const VF first = hn::Sub(at, before), last = hn::Sub(after, at);
  const VF other_first = hn::Sub(other_at, other_before), other_last = hn::Sub(other_after, other_at);
  const VF one_sided = hn::Add(hn::Mul(first, other_first), hn::Mul(last, other_last));
  const VF central = hn::Mul(hn::Add(first, last), hn::Add(other_first, other_last));
  return hn::Add(hn::Mul(constant(0.25F), one_sided), hn::Mul(constant(0.125F), central));
}

/// Adds one row of a vector of columns.
HWY_INLINE void add_cells(const Cross& r, const Cross& f, const CellNoise& noise, VF (&sum)[sums]) {
  const VF light = constant(noise.light), half = constant(0.5F);
  const VF d = hn::Sub(f.centre, hn::Mul(light, r.centre));
  const VF any = hn::Add(hn::Add(d, around(r)), around(f));  // NaN if one of the values is missing
  const MF there = hn::Eq(any, any);
  const auto known = [=](VF v) HWY_ATTR { return hn::IfThenElseZero(there, v); };
  const VF difference = known(d), reference = known(r.centre);
  const VF across = known(hn::Sub(r.right, r.left)), down = known(hn::Sub(r.lower, r.upper));
  const VF gx = hn::Mul(light, hn::Mul(half, across)), gy = hn::Mul(light, hn::Mul(half, down));
  const VF frame_across = known(hn::Sub(f.right, f.left)), frame_down = known(hn::Sub(f.lower, f.upper));
  const VF mixed = hn::Mul(constant(0.25F), hn::Add(hn::Mul(gx, frame_down), hn::Mul(gy, frame_across)));
  const VF xx = known(slope_product(r.left, r.centre, r.right, f.left, f.centre, f.right));
  const VF yy = known(slope_product(r.upper, r.centre, r.lower, f.upper, f.centre, f.lower));
  const VF mean = hn::Max(hn::Mul(constant(0.25F), known(around(r))), constant(noise.min_mean_e));
  const VF own = hn::Add(hn::Mul(constant(noise.reference_slope), mean), constant(noise.reference_steady_e2));
  const VF gxx = hn::Mul(gx, gx), gyy = hn::Mul(gy, gy);
  const VF warp = hn::Mul(constant(noise.warp_variance_cells), hn::Add(gxx, gyy));
  const VF variance = hn::Add(hn::Add(hn::Mul(constant(noise.slope), mean), constant(noise.steady_e2)), warp);
  const VF dd = hn::Mul(difference, difference);
  const VF w = known(hn::Div(constant(1), hn::Add(variance, hn::Mul(constant(1 / student), dd))));
  const auto add = [&sum](int figure, VF v) HWY_ATTR { sum[figure] = hn::Add(sum[figure], v); };
  const VF wd = hn::Mul(w, difference), w_light = hn::Mul(w, light);
  add(score_x, hn::Mul(gx, wd));
  add(score_y, hn::Mul(gy, wd));
  add(gradient_xx, hn::Mul(w, gxx));
  add(gradient_xy, hn::Mul(w, hn::Mul(gx, gy)));
  add(gradient_yy, hn::Mul(w, gyy));
  add(slope_xx, hn::Mul(w_light, xx));
  add(slope_xy, hn::Mul(w, mixed));
  add(slope_yy, hn::Mul(w_light, yy));
  add(TileSum::noise, hn::Mul(w, own));
  add(square, hn::Mul(w, dd));
  add(light_score, hn::Mul(wd, reference));
  add(light_info, hn::Mul(w, hn::Mul(reference, reference)));
  add(count, known(constant(1)));
}

void AddTile(const float* reference, std::ptrdiff_t stride, const float* frame, std::ptrdiff_t frame_stride, int rows,
             const CellNoise& noise, float* out) {
  HWY_ALIGN float of_columns[sums][columns];
  for (int i = 0; i < columns; i += lanes()) {
    VF sum[sums];
    for (VF& s : sum) s = hn::Zero(Floats());
    for (int y = 0; y < rows; ++y) {
      add_cells(load_cross(reference + y * stride + i, stride), load_cross(frame + y * frame_stride + i, frame_stride),
                noise, sum);
    }
    for (int k = 0; k < sums; ++k) hn::StoreU(sum[k], Floats(), of_columns[k] + i);
  }
  for (int k = 0; k < sums; ++k) {
    const float* const s = of_columns[k];
    const float total = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    out[k] += k <= score_y ? -total : total;
  }
}

float CappedCost(const float* frame, const CostRow& cost, float max_cost, int count) {
  HWY_ALIGN float of_columns[columns];
  HWY_ALIGN float last[4][columns] = {};
  const int left = count % columns, first_left = count - left;
  const float* const from[4] = {frame, cost.constant, cost.linear, cost.square};
  for (int k = 0; k < 4; ++k)
    std::memcpy(last[k], from[k] + first_left, static_cast<std::size_t>(left) * sizeof(float));
  for (int i = 0; i < columns; i += lanes()) {
    VF sum = hn::Zero(Floats());
    const auto add = [&sum, max_cost](const float* f, const float* c, const float* l, const float* s) HWY_ATTR {
      const VF v = load(f), of_cell = hn::Add(load(c), hn::Mul(v, hn::Sub(hn::Mul(load(s), v), load(l))));
      sum = hn::Add(sum, hn::IfThenElseZero(hn::Eq(v, v), hn::Min(of_cell, constant(max_cost))));
    };
    for (int x = i; x < first_left; x += columns) {
      add(frame + x, cost.constant + x, cost.linear + x, cost.square + x);
    }
    add(last[0] + i, last[1] + i, last[2] + i, last[3] + i);
    hn::StoreU(sum, Floats(), of_columns + i);
  }
  const float* const s = of_columns;
  return ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
}

}  // namespace lowlux::merge::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::merge::rows {

HWY_EXPORT(AddTile);
HWY_EXPORT(CappedCost);
HWY_EXPORT(SampleRow);

void add_tile(const float* reference, std::ptrdiff_t stride, const float* frame, std::ptrdiff_t frame_stride, int rows,
              const CellNoise& noise, float* out) {
  HWY_DYNAMIC_DISPATCH(AddTile)(reference, stride, frame, frame_stride, rows, noise, out);
}
float capped_cost(const float* frame, const CostRow& cost, float max_cost, int count) {
  return HWY_DYNAMIC_DISPATCH(CappedCost)(frame, cost, max_cost, count);
}
void sample_row(const Samples& level, int x0, int y, const float* dx, const float* dy, int count, float* out) {
  HWY_DYNAMIC_DISPATCH(SampleRow)(level, x0, y, dx, dy, count, out);
}

}  // namespace lowlux::merge::rows
#endif
