#include "isp/raw/kernel/residual_rows.h"

#if defined(__aarch64__)  // NEON only: the vectors of SVE have no size, so no structs can be made of them
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "isp/raw/kernel/residual_rows.cpp"
#include <hwy/foreach_target.h>  // compiles this file once more for each instruction set
#include <hwy/highway.h>

#include "isp/raw/kernel/encoding-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::isp::rows::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using VF = hn::Vec<Floats>;

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }
HWY_INLINE VF load(const float* from) { return hn::LoadU(Floats(), from); }
HWY_INLINE void store(VF v, float* to) { hn::StoreU(v, Floats(), to); }
HWY_INLINE VF sum_of(const float* a, const float* b) { return hn::Add(load(a), load(b)); }

/// Calls work(i) for vectors that cover the pairs -run_margin to pairs + run_margin - 1.
template <class Work>
HWY_INLINE void for_each_vector(int pairs, const Work& work) {
  const auto lanes = static_cast<int>(hn::Lanes(Floats()));
  for (int i = -run_margin; i < pairs + run_margin; i += lanes) work(i);
}

void EncodeRow(const float* in, float clip, const Encoding& encoding, int n, float* out) {
  const EncodingVectors code(encoding);
  const VF low = constant(encoding_min), high = hn::Min(constant(clip), constant(encoding_max));
  const auto lanes = static_cast<int>(hn::Lanes(Floats()));
  for (int i = 0; i < n; i += lanes) store(code.encode(hn::Max(hn::Min(load(in + i), high), low)), out + i);
}

/// Returns 1/2 (near_a + near_b) - 1/4 (far_a + far_b) - 1/2 own.
HWY_INLINE VF difference_to(VF near, VF far, VF own) {
  return hn::NegMulAdd(constant(0.25f), far, hn::Mul(constant(0.5f), hn::Sub(near, own)));
}

void DifferenceRow(const DifferenceRows& in, int pairs) {
  const float *const own = in.u[2].own, *const green = in.u[2].green;
  const float *const green_left = green - 1 + in.shift, *const own_left = own - in.shift;
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const VF at_own = load(own + i), at_green = load(green + i), zero = constant(0);
    store(difference_to(sum_of(green_left + i, green_left + i + 1), sum_of(own + i - 1, own + i + 1), at_own),
          in.horizontal.own + i);
    store(hn::Sub(zero, difference_to(sum_of(own_left + i, own_left + i + 1), sum_of(green + i - 1, green + i + 1),
                                      at_green)),
          in.horizontal.green + i);
    store(difference_to(sum_of(in.u[1].green + i, in.u[3].green + i), sum_of(in.u[0].own + i, in.u[4].own + i), at_own),
          in.vertical.own + i);
    store(hn::Sub(zero, difference_to(sum_of(in.u[1].own + i, in.u[3].own + i),
                                      sum_of(in.u[0].green + i, in.u[4].green + i), at_green)),
          in.vertical.green + i);
  });
}

HWY_INLINE VF distance(const float* a, const float* b) { return hn::Abs(hn::Sub(load(a), load(b))); }

void GradientRow(const GradientRows& in, int pairs) {
  const float* const green_left = in.horizontal.green - 1 + in.shift;
  const float* const own_left = in.horizontal.own - in.shift;
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    store(distance(green_left + i + 1, green_left + i), in.gradient_h.own + i);
    store(distance(own_left + i + 1, own_left + i), in.gradient_h.green + i);
    store(distance(in.below.green + i, in.above.green + i), in.gradient_v.own + i);
    store(distance(in.below.own + i, in.above.own + i), in.gradient_v.green + i);
  });
}

/// Returns the 3x3 sum around own[i] of rows y - 1 to y + 1.
HWY_INLINE VF sum_around(const ConstSiteRow (&row)[3], int shift, int i) {
  const auto column = [&](int j) HWY_ATTR {  // of green sites of row y
    return hn::Add(load(row[1].green + j), sum_of(row[0].own + j, row[2].own + j));
  };
  const VF middle = hn::Add(load(row[1].own + i), sum_of(row[0].green + i, row[2].green + i));
  return hn::Add(middle, hn::Add(column(i - 1 + shift), column(i + shift)));
}

void GradientSumRow(const GradientSumRows& in, int pairs) {
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    store(sum_around(in.gradient_h, in.shift, i), in.sum_h + i);
    store(sum_around(in.gradient_v, in.shift, i), in.sum_v + i);
  });
}

void DetailRow(const DetailRows& in, int pairs) {
  const VF half = constant(0.5f), quarter = constant(0.25f);
  const int left = in.shift - 1;
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const auto difference = [](const float* a, const float* b) HWY_ATTR { return hn::Sub(load(a), load(b)); };
    const auto greens = [&](int row, int of) HWY_ATTR {  // left and right of a site of the own colour
      return sum_of(in.u[row].green + of + left, in.u[row].green + of + left + 1);
    };
    const auto column = [&](int of) HWY_ATTR { return sum_of(in.u[1].green + of, in.u[3].green + of); };
    const VF own_h = difference(in.u[2].own + i + 1, in.u[2].own + i - 1);
    const VF own_v = difference(in.u[4].own + i, in.u[0].own + i);
    const VF beside = difference(in.u[2].green + i + left + 1, in.u[2].green + i + left);
    const VF above = difference(in.u[3].green + i, in.u[1].green + i);
    const VF green_h = hn::MulAdd(quarter, hn::Sub(column(i + 1), column(i - 1)), hn::Mul(half, beside));
    const VF green_v = hn::MulAdd(quarter, hn::Sub(greens(4, i), greens(0, i)), hn::Mul(half, above));
    store(hn::MulAdd(own_h, own_h, hn::Mul(own_v, own_v)), in.detail.own + i);
    store(hn::MulAdd(green_h, green_h, hn::Mul(green_v, green_v)), in.detail.green + i);
    store(hn::MulAdd(own_h, green_h, hn::Mul(own_v, green_v)), in.detail.both + i);
    const VF fine = hn::Sub(greens(2, i), column(i));
    store(hn::Mul(fine, fine), in.detail.fine + i);
  });
}

void SharedDetailRow(const SharedDetailRows& in, int pairs) {
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const auto column = [&](const float* a, const float* b, const float* c)
                            HWY_ATTR { return hn::Add(load(b + i), sum_of(a + i, c + i)); };
    store(column(in.detail[0].own, in.detail[1].own, in.detail[2].own), in.sum[0] + i);
    store(column(in.detail[0].green, in.detail[1].green, in.detail[2].green), in.sum[1] + i);
    store(column(in.detail[0].both, in.detail[1].both, in.detail[2].both), in.sum[2] + i);
    store(column(in.detail[0].fine, in.detail[1].fine, in.detail[2].fine), in.sum[3] + i);
  });
  // The second loop reads one more pair at each end than the first writes: its results there are not read.
  const VF ninth = constant(1.0f / 9), floor = constant(in.floor), one = constant(1);
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const auto mean = [&](const float* sum)
                          HWY_ATTR { return hn::Mul(ninth, hn::Add(load(sum + i), sum_of(sum + i - 1, sum + i + 1))); };
    const VF own = mean(in.sum[0]), green = mean(in.sum[1]), both = mean(in.sum[2]), fine = mean(in.sum[3]);
    const VF size = hn::Sqrt(hn::Mul(own, green));
    const VF excess = hn::NegMulAdd(constant(1.25f), size, hn::Add(both, both));
    const VF alike = hn::Add(one, hn::Div(excess, hn::MulAdd(constant(4), floor, size)));
    const VF over_own = hn::Div(one, hn::Add(own, floor));
    const VF ratio = hn::Mul(hn::MulAdd(constant(2.5f), green, floor), over_own);
    const VF shared = hn::Min(alike, ratio);
    store(hn::Min(hn::Max(shared, hn::Mul(hn::Mul(constant(4), fine), over_own)), one), in.shared + i);
  });
}

void GreenRow(const GreenRows& in, int pairs) {
  const VF floor = constant(in.floor), fifth = constant(0.2f), half = constant(0.5f);
  const float *const left = in.horizontal.green - 1 + in.shift, *const green_left = in.u[1].green - 1 + in.shift;
  const auto squared = [&](const float* sum) HWY_ATTR {
    const VF root = hn::Add(floor, load(sum));
    return hn::Mul(root, root);
  };
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const VF at_h = load(in.horizontal.own + i), at_v = load(in.vertical[4].own + i);
    // These are sums of five differences to the left, to the right, upwards, downwards.
    const VF west = hn::Add(hn::Add(at_h, sum_of(in.horizontal.own + i - 2, in.horizontal.own + i - 1)),
                            sum_of(left + i - 1, left + i));
    const VF east = hn::Add(hn::Add(at_h, sum_of(in.horizontal.own + i + 2, in.horizontal.own + i + 1)),
                            sum_of(left + i + 2, left + i + 1));
    const VF north = hn::Add(hn::Add(at_v, sum_of(in.vertical[0].own + i, in.vertical[2].own + i)),
                             sum_of(in.vertical[1].green + i, in.vertical[3].green + i));
    const VF south = hn::Add(hn::Add(at_v, sum_of(in.vertical[8].own + i, in.vertical[6].own + i)),
                             sum_of(in.vertical[7].green + i, in.vertical[5].green + i));
    const VF w = squared(in.sum_h + i - 1), e = squared(in.sum_h + i + 1);
    const VF n = squared(in.sum_above + i), s = squared(in.sum_below + i);
    // These are the means weighted by 1/w, 1/e, 1/n, 1/s with all fractions brought to one denominator.
    const VF we = hn::Mul(w, e), ns = hn::Mul(n, s);
    const VF weight_h = hn::Mul(hn::Add(w, e), ns), weight_v = hn::Mul(hn::Add(n, s), we);
    const VF along = hn::MulAdd(west, e, hn::Mul(east, w)), across = hn::MulAdd(north, s, hn::Mul(south, n));
    const VF by_differences = hn::Mul(fifth, hn::MulAdd(along, ns, hn::Mul(across, we)));
    const VF own = load(in.u[1].own + i);
    const VF beside = hn::MulSub(half, sum_of(green_left + i, green_left + i + 1), own);
    const VF above = hn::MulSub(half, sum_of(in.u[0].green + i, in.u[2].green + i), own);
    const VF by_neighbours = hn::MulAdd(weight_h, beside, hn::Mul(weight_v, above));
    const VF sum = hn::MulAdd(load(in.shared + i), hn::Sub(by_differences, by_neighbours), by_neighbours);
    const VF difference = hn::Div(sum, hn::Add(weight_h, weight_v));
    store(hn::Add(own, difference), in.green + i);
    store(hn::Sub(constant(0), difference), in.difference + i);
  });
}

void SlopeRow(const SlopeRows& in, int pairs) {
  // Sums along columns of green, difference, and their products, then along the row. The second loop reads one more
  // pair at each end than the first writes: their results there are not read.
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const VF g0 = load(in.green[0] + i), g1 = load(in.green[1] + i), g2 = load(in.green[2] + i);
    const VF d0 = load(in.difference[0] + i), d1 = load(in.difference[1] + i), d2 = load(in.difference[2] + i);
    store(hn::Add(g0, hn::Add(g1, g2)), in.sum[0] + i);
    store(hn::Add(d0, hn::Add(d1, d2)), in.sum[1] + i);
    store(hn::MulAdd(g0, g0, hn::MulAdd(g1, g1, hn::Mul(g2, g2))), in.sum[2] + i);
    store(hn::MulAdd(g0, d0, hn::MulAdd(g1, d1, hn::Mul(g2, d2))), in.sum[3] + i);
  });
  const VF ninth = constant(1.0f / 9), ridge = constant(9 * in.ridge), zero = constant(0);
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const auto sum = [&](int k) HWY_ATTR {
      const float* const run = in.sum[k] + i;
      return hn::Add(load(run), sum_of(run - 1, run + 1));
    };
    const VF green = sum(0), difference = sum(1);
    const VF mean = hn::Mul(ninth, green);
    const VF variance = hn::Max(hn::NegMulAdd(mean, green, sum(2)), zero);
    store(hn::Div(hn::NegMulAdd(mean, difference, sum(3)), hn::Add(variance, ridge)), in.slope + i);
  });
}

void RestRow(const RestRows& in, int pairs) {
  const VF ninth = constant(1.0f / 9);
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const auto column = [&](int j) HWY_ATTR {
      return hn::Add(load(in.slope[1] + j), sum_of(in.slope[0] + j, in.slope[2] + j));
    };
    const VF slope = hn::Mul(ninth, hn::Add(column(i), hn::Add(column(i - 1), column(i + 1))));
    store(slope, in.mean_slope + i);
    store(hn::NegMulAdd(slope, load(in.green + i), load(in.difference + i)), in.rest + i);
  });
}

void ColourDifferenceRow(const ColourDifferenceRows& in, int pairs) {
  const VF half = constant(0.5f);
  for_each_vector(pairs, [&](int i) HWY_ATTR {
    const VF green = load(in.green + i);
    const auto between =
        [&](const float* slope_a, const float* slope_b, const float* rest_a, const float* rest_b)
            HWY_ATTR { return hn::Mul(half, hn::MulAdd(sum_of(slope_a, slope_b), green, sum_of(rest_a, rest_b))); };
    const int left = i - in.shift, beside = i - 1 + in.shift;
    store(between(in.slope[1] + left, in.slope[1] + left + 1, in.rest[1] + left, in.rest[1] + left + 1),
          in.own_at_green + i);
    store(between(in.slope[0] + i, in.slope[2] + i, in.rest[0] + i, in.rest[2] + i), in.other.green + i);
    const auto diagonal = [&](const float* const(&of)[3]) HWY_ATTR {
      return hn::Add(sum_of(of[0] + beside, of[2] + beside), sum_of(of[0] + beside + 1, of[2] + beside + 1));
    };
    store(hn::Mul(constant(0.25f), hn::MulAdd(diagonal(in.slope), load(in.green_at_own + i), diagonal(in.rest))),
          in.other.own + i);
  });
}

HWY_INLINE void order(VF& a, VF& b) {
  const VF low = hn::Min(a, b);
  b = hn::Max(a, b);
  a = low;
}

/// Returns the median of three columns of three values each: that of the greatest low, the middle of the middle, and
/// the least high values of the ordered columns.
HWY_INLINE VF median_of(const float* const (&a)[3], const float* const (&b)[3], const float* const (&c)[3], int i_a,
                        int i_b, int i_c) {
  VF v[3][3] = {{load(a[0] + i_a), load(a[1] + i_a), load(a[2] + i_a)},
                {load(b[0] + i_b), load(b[1] + i_b), load(b[2] + i_b)},
                {load(c[0] + i_c), load(c[1] + i_c), load(c[2] + i_c)}};
  for (auto& column : v) {
    order(column[0], column[1]);
    order(column[1], column[2]);
    order(column[0], column[1]);
  }
  const VF low = hn::Max(v[0][0], hn::Max(v[1][0], v[2][0])), high = hn::Min(v[0][2], hn::Min(v[1][2], v[2][2]));
  const auto middle_of = [](VF x, VF y, VF z) HWY_ATTR { return hn::Max(hn::Min(x, y), hn::Min(hn::Max(x, y), z)); };
  return middle_of(low, middle_of(v[0][1], v[1][1], v[2][1]), high);
}

template <bool kMedian>
HWY_INLINE void finish(const FinishRows& in, const Encoding& encoding, int pairs) {
  const EncodingVectors code(encoding);
  const auto lanes = static_cast<int>(hn::Lanes(Floats()));
  const int left = -in.shift, beside = in.shift - 1;
  for (int i = 0; i < pairs; i += lanes) {
    const VF green_at_own = load(in.green_at_own + i), green = load(in.green + i);
    const auto at_green = [&](const DifferenceColumns& of) HWY_ATTR {
      if constexpr (kMedian) {
        return median_of(of.green, of.own, of.own, i, i + left, i + left + 1);
      } else {
        return load(of.green[1] + i);
      }
    };
    const auto at_own = [&](const DifferenceColumns& of) HWY_ATTR {
      if constexpr (kMedian) {
        return median_of(of.own, of.green, of.green, i, i + beside, i + beside + 1);
      } else {
        return load(of.own[1] + i);
      }
    };
    store(load(in.linear.own + i), in.at_own.own + i);
    store(code.decode(green_at_own), in.at_own.green + i);
    store(code.decode(hn::Add(green_at_own, at_own(in.other))), in.at_own.other + i);
    store(code.decode(hn::Add(green, at_green(in.own))), in.at_green.own + i);
    store(load(in.linear.green + i), in.at_green.green + i);
    store(code.decode(hn::Add(green, at_green(in.other))), in.at_green.other + i);
  }
}

void FinishRow(const FinishRows& in, const Encoding& encoding, int pairs) {
  if (in.median) {
    finish<true>(in, encoding, pairs);
  } else {
    finish<false>(in, encoding, pairs);
  }
}

}  // namespace lowlux::isp::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lowlux::isp::rows {

HWY_EXPORT(EncodeRow);
HWY_EXPORT(DifferenceRow);
HWY_EXPORT(GradientRow);
HWY_EXPORT(GradientSumRow);
HWY_EXPORT(DetailRow);
HWY_EXPORT(SharedDetailRow);
HWY_EXPORT(GreenRow);
HWY_EXPORT(SlopeRow);
HWY_EXPORT(RestRow);
HWY_EXPORT(ColourDifferenceRow);
HWY_EXPORT(FinishRow);

void encode_row(const float* in, float clip, const Encoding& encoding, int n, float* out) {
  HWY_DYNAMIC_DISPATCH(EncodeRow)(in, clip, encoding, n, out);
}
void difference_row(const DifferenceRows& in, int pairs) { HWY_DYNAMIC_DISPATCH(DifferenceRow)(in, pairs); }
void gradient_row(const GradientRows& in, int pairs) { HWY_DYNAMIC_DISPATCH(GradientRow)(in, pairs); }
void gradient_sum_row(const GradientSumRows& in, int pairs) { HWY_DYNAMIC_DISPATCH(GradientSumRow)(in, pairs); }
void detail_row(const DetailRows& in, int pairs) { HWY_DYNAMIC_DISPATCH(DetailRow)(in, pairs); }
void shared_detail_row(const SharedDetailRows& in, int pairs) { HWY_DYNAMIC_DISPATCH(SharedDetailRow)(in, pairs); }
void green_row(const GreenRows& in, int pairs) { HWY_DYNAMIC_DISPATCH(GreenRow)(in, pairs); }
void slope_row(const SlopeRows& in, int pairs) { HWY_DYNAMIC_DISPATCH(SlopeRow)(in, pairs); }
void rest_row(const RestRows& in, int pairs) { HWY_DYNAMIC_DISPATCH(RestRow)(in, pairs); }
void colour_difference_row(const ColourDifferenceRows& in, int pairs) {
  HWY_DYNAMIC_DISPATCH(ColourDifferenceRow)(in, pairs);
}
void finish_row(const FinishRows& in, const Encoding& encoding, int pairs) {
  HWY_DYNAMIC_DISPATCH(FinishRow)(in, encoding, pairs);
}

}  // namespace lowlux::isp::rows
#endif
