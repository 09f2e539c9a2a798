// Random draws for kernels of any folder: Philox words, normal and Poisson quantiles of a vector of pixels. The file is
// included once for each instruction set: hence a guard that toggles instead of #pragma once. See docs/kernels.md.
//
// Every bit is the same on every processor, on one condition: the including source is listed in
// lowlux_exact_kernel_sources() in CMake. Only correctly rounded operations are used, in a fixed order: no MulAdd, no
// estimates of reciprocals.
#if defined(LOWLUX_ISP_BASE_RANDOM_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LOWLUX_ISP_BASE_RANDOM_INL_H
#undef LOWLUX_ISP_BASE_RANDOM_INL_H
#else
#define LOWLUX_ISP_BASE_RANDOM_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "isp/base/random/exact_draw.h"
#include "isp/base/random/random_rows.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::draws::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::RebindToSigned<Floats>;
using Words = hn::RebindToUnsigned<Floats>;
using Halves = hn::RepartitionToWide<Words>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;
using VU = hn::Vec<Words>;
using VU64 = hn::Vec<Halves>;
using MF = hn::Mask<Floats>;

HWY_INLINE VF constant(float x) { return hn::Set(Floats(), x); }

/// Evaluates c[0] + c[1] x + c[2] x^2 ... by Estrin's scheme: pairs, pairs of pairs. Kernels are limited by latency
/// rather than throughput, and Horner's rule is a single dependency chain.
template <std::size_t kCount>
HWY_INLINE VF polynomial(const float (&c)[kCount], VF x) {
  VF terms[(kCount + 1) / 2];
  for (std::size_t i = 0; i + 1 < kCount; i += 2) {
    terms[i / 2] = hn::Add(constant(c[i]), hn::Mul(constant(c[i + 1]), x));
  }
  if (kCount % 2 == 1) terms[kCount / 2] = constant(c[kCount - 1]);
  for (std::size_t count = (kCount + 1) / 2; count > 1; count = (count + 1) / 2) {
    x = hn::Mul(x, x);
    for (std::size_t i = 0; i + 1 < count; i += 2) terms[i / 2] = hn::Add(terms[i], hn::Mul(terms[i + 1], x));
    if (count % 2 == 1) terms[count / 2] = terms[count - 1];
  }
  return terms[0];
}

/// Loads a full vector, or the last `left` elements of a row with zeros after them.
template <class Tag>
HWY_INLINE hn::Vec<Tag> load(Tag tag, const hn::TFromD<Tag>* from, std::size_t left) {
  if (HWY_LIKELY(left >= hn::Lanes(tag))) return hn::LoadU(tag, from);
  HWY_ALIGN hn::TFromD<Tag> rest[hn::MaxLanes(Tag())] = {};
  std::memcpy(rest, from, left * sizeof(*from));
  return hn::Load(tag, rest);
}

template <class Tag>
HWY_INLINE void store(Tag tag, hn::Vec<Tag> v, hn::TFromD<Tag>* to, std::size_t left) {
  if (HWY_LIKELY(left >= hn::Lanes(tag))) return hn::StoreU(v, tag, to);
  HWY_ALIGN hn::TFromD<Tag> rest[hn::MaxLanes(Tag())];
  hn::Store(v, tag, rest);
  std::memcpy(to, rest, left * sizeof(*to));
}

struct FourWords {
  VU word[4];
};

/// Returns Philox4x32-10 (random.h) of the pixels (x, row.y), with x a vector of columns. Even and odd lanes pass the
/// rounds separately, as 64-bit lanes: a word is the low half, and the next round ignores the high half.
HWY_INLINE FourWords words_of(const Row& row, VU x) {
  const Words w;
  const Halves h;
  const VU m0 = hn::Set(w, 0xD2511F53U), m1 = hn::Set(w, 0xCD9E8D57U);
  const VU64 both = hn::BitCast(h, x), y = hn::Set(h, row.y), frame = hn::Set(h, row.frame);
  const VU64 purpose = hn::Set(h, row.purpose);
  VU64 c[2][4] = {{both, y, frame, purpose}, {hn::ShiftRight<32>(both), y, frame, purpose}};
  std::uint32_t k0 = row.key[0], k1 = row.key[1];
  for (int round = 0; round < 10; ++round, k0 += 0x9E3779B9U, k1 += 0xBB67AE85U) {
    for (VU64* s : {c[0], c[1]}) {
      const VU64 p = hn::MulEven(hn::BitCast(w, s[0]), m0), q = hn::MulEven(hn::BitCast(w, s[2]), m1);
      s[0] = hn::Xor(hn::Xor(hn::ShiftRight<32>(q), s[1]), hn::Set(h, k0));
      s[1] = q;
      s[2] = hn::Xor(hn::Xor(hn::ShiftRight<32>(p), s[3]), hn::Set(h, k1));
      s[3] = p;
    }
  }
  const auto joined = [&](int i) HWY_ATTR {
    return hn::OddEven(hn::BitCast(w, hn::ShiftLeft<32>(c[1][i])), hn::BitCast(w, c[0][i]));
  };
  return {{joined(0), joined(1), joined(2), joined(3)}};
}

/// Returns the natural logarithm of normal positive numbers, error about 1e-7 (relative, or absolute near 1).
HWY_INLINE VF log_of(VF x) {
  const Floats f;
  const Ints s32;
  const VI bits = hn::BitCast(s32, x);
  const VI exponent = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(s32, 0x3f3504f3)));  // sqrt(1/2): mantissa 0.7..1.4
  const VF above_one = hn::Sub(hn::BitCast(f, hn::Sub(bits, hn::ShiftLeft<23>(exponent))), constant(1));
  // ln m = 2 artanh(s)
  const VF s = hn::Div(above_one, hn::Add(constant(2), above_one)), s2 = hn::Mul(s, s);
  const VF series = hn::Mul(hn::Mul(s, s2), polynomial({2.0f / 3, 2.0f / 5, 2.0f / 7, 2.0f / 9}, s2));
  const VF powers = hn::Mul(hn::ConvertTo(f, exponent), constant(0.693147181f));
  return hn::Add(hn::Add(powers, hn::Add(s, s)), series);
}

/// Returns the standard normal quantile of (r + 1/2) / 2^32: z P(w) / Q(w) with z = 2u - 1 and w = -ln(1 - z^2). P and
/// Q are a minimax fit of quantile / z over w in 0..21.6 (a weighted least-squares fit, its weights adapted until the
/// error levelled at 1.0e-8); with rounding, 4e-7.
HWY_INLINE VF normal_of(VU r) {
  const Floats f;
  const Ints s32;
  const VI word = hn::BitCast(s32, r);
  const VI centred = hn::Xor(word, hn::Set(s32, INT32_MIN));
  const VF z = hn::Mul(hn::Add(hn::ConvertTo(f, centred), constant(0.5f)), constant(0x1p-31f));
  // p is the nearer tail, 0..1/2, because 1 - z^2 of the rounded z would be wrong there.
  const VI folded = hn::Xor(word, hn::ShiftRight<31>(word));
  const VF p = hn::Mul(hn::Add(hn::ConvertTo(f, folded), constant(0.5f)), constant(0x1p-32f));
  const VF w = hn::Sub(hn::Zero(f), log_of(hn::Mul(hn::Mul(constant(4), p), hn::Sub(constant(1), p))));
  const VF above = polynomial({1.2533141251f, 0.44745332857f, 0.091010784584f, 0.012525197581f, 1.1383759937e-3f,
                               5.9378103919e-5f, 1.9161539078e-7f},
                              w);
  const VF below =
      polynomial({1.0f, 0.095216431109f, 0.034657760061f, 2.3120644624e-3f, 2.4859308607e-4f, 3.7440786095e-6f}, w);
  return hn::Mul(z, hn::Div(above, below));
}

/// Returns e^-x for x in 0..12, relative error about 2e-7.
HWY_INLINE VF exp_of_minus(VF x) {
  const Floats f;
  const Ints s32;
  const VI halvings = hn::NearestInt(hn::Mul(x, constant(1.44269504f)));
  const VF n = hn::ConvertTo(f, halvings);
  const VF rest = hn::Sub(hn::Sub(hn::Mul(n, constant(0.693359375f)), x), hn::Mul(n, constant(2.12194440e-4f)));
  const VF series = polynomial({1.0f, 1.0f, 1.0f / 2, 1.0f / 6, 1.0f / 24, 1.0f / 120, 1.0f / 720}, rest);
  return hn::BitCast(f, hn::Sub(hn::BitCast(s32, series), hn::ShiftLeft<23>(halvings)));
}

/// Bounds the Poisson quantile by two counts; where they are equal, and not negative, they are the quantile.
struct Bracket {
  VF least;
  VF most;
};

constexpr float large_mean = 12;

/// Brackets the quantile for means of 12 and more by the Cornish-Fisher expansion, whose error bound is checked in
/// tests/base/poisson_test.cpp. The mean is split into integer and fraction, so that the small terms keep their digits.
HWY_INLINE Bracket bracket_large(VF w, VF mean) {
  const VF whole = hn::Floor(mean), fraction = hn::Sub(mean, whole);
  const VF s = hn::Sqrt(mean), per_s = hn::Div(constant(1), s), per_mean = hn::Mul(per_s, per_s);
  const VF w2 = hn::Mul(w, w), w4 = hn::Mul(w2, w2), sw = hn::Mul(s, w);
  const VF skewness = polynomial({1.0f / 3, 1.0f / 6}, w2);
  const VF third = hn::Mul(hn::Mul(w, polynomial({1.0f / 36, 1.0f / 72}, w2)), per_s);
  const VF fourth = hn::Mul(polynomial({-8.0f / 405, 7.0f / 810, 1.0f / 270}, w2), per_mean);
  const VF t = hn::Add(hn::Add(sw, fraction), hn::Add(skewness, hn::Sub(fourth, third)));
  const VF series = hn::Add(constant(0.02f), hn::Mul(w4, polynomial({0.004f, 0.001f}, w2)));
  const VF rounding = hn::Add(hn::Mul(constant(8e-7f), hn::Abs(sw)), constant(1e-6f));
  const VF bound = hn::Add(hn::Mul(series, hn::Mul(per_mean, per_s)), rounding);
  return {hn::Add(whole, hn::Floor(hn::Sub(t, bound))), hn::Add(whole, hn::Floor(hn::Add(t, bound)))};
}

struct Reciprocals {
  float of[52] = {};
  constexpr Reciprocals() {
    for (int k = 1; k < 52; ++k) of[k] = 1.0f / static_cast<float>(k);
  }
};
constexpr Reciprocals reciprocals;

/// Brackets the quantile in the lanes of `small`, whose means are below 12: the summed CDF is compared with a value
/// slightly below u and one slightly above. Rounding lets the sum stall just below 1; the bracket turns that into a
/// lane to be resolved, not a false bright pixel.
HWY_INLINE Bracket bracket_small(VU r, VF mean, MF small) {
  const Floats f;
  const Ints s32;
  const VF u = hn::Mul(hn::ConvertTo(f, hn::BitCast(s32, hn::ShiftRight<1>(r))), constant(0x1p-31f));
  const VF lower = hn::IfThenElse(small, hn::Sub(u, constant(4e-6f)), constant(-1));
  const VF upper = hn::IfThenElse(small, hn::Add(u, constant(4e-6f)), constant(-1));
  const VF lambda = hn::IfThenElseZero(small, mean);
  VF term = exp_of_minus(lambda), reached = term;
  VI least = hn::Zero(s32), most = least;
  int k = 1;
  do {  // four terms at once, and always the first four: the branch would be hard to predict
    for (int j = k; j < k + 4; ++j) {
      least = hn::Sub(least, hn::VecFromMask(s32, hn::RebindMask(s32, hn::Gt(lower, reached))));
      most = hn::Sub(most, hn::VecFromMask(s32, hn::RebindMask(s32, hn::Gt(upper, reached))));
      term = hn::Mul(term, hn::Mul(lambda, constant(reciprocals.of[j])));
      reached = hn::Add(reached, term);
    }
    k += 4;
  } while (k < 49 && !hn::AllFalse(f, hn::Gt(upper, reached)));
  return {hn::ConvertTo(f, least), hn::ConvertTo(f, most)};
}

/// Returns `counts` with the lanes of `open` replaced by the double-precision results.
HWY_NOINLINE inline VF resolved(VU r, VF mean, MF open, VF counts) {
  const Floats f;
  HWY_ALIGN std::uint32_t words[hn::MaxLanes(Floats())];
  HWY_ALIGN float means[hn::MaxLanes(Floats())], out[hn::MaxLanes(Floats())], is_open[hn::MaxLanes(Floats())];
  hn::Store(r, Words(), words);
  hn::Store(mean, f, means);
  hn::Store(counts, f, out);
  hn::Store(hn::IfThenElseZero(open, constant(1)), f, is_open);
  for (std::size_t i = 0; i < hn::Lanes(f); ++i) {
    if (is_open[i] != 0) out[i] = static_cast<float>(exact_poisson(words[i], static_cast<double>(means[i])));
  }
  return hn::Load(f, out);
}

/// Clamps means to 0..poisson_max_mean and replaces those that are not a number by 0.
HWY_INLINE VF valid_mean(VF mean) {
  const VF positive = hn::IfThenElseZero(hn::Gt(mean, hn::Zero(Floats())), mean);
  return hn::Min(positive, constant(1e6f));
}

/// Brackets the Poisson quantile of (r + 1/2) / 2^32 for a mean from valid_mean.
HWY_INLINE Bracket poisson_bracket(VU r, VF mean) {
  const Floats f;
  const MF small = hn::Lt(mean, constant(large_mean));
  if (hn::AllTrue(f, small)) return bracket_small(r, mean, small);
  const Bracket large = bracket_large(normal_of(r), mean);
  if (hn::AllFalse(f, small)) return large;
  const Bracket other = bracket_small(r, mean, small);
  return {hn::IfThenElse(small, other.least, large.least), hn::IfThenElse(small, other.most, large.most)};
}

/// Returns the lanes that a bracket leaves undecided.
HWY_INLINE MF open_lanes(const Bracket& b) {
  return hn::Or(hn::Ne(b.least, b.most), hn::Lt(b.least, hn::Zero(Floats())));
}

/// Returns the Poisson quantile of (r + 1/2) / 2^32, as defined in random.h.
HWY_INLINE VF poisson_of(VU r, VF any_mean) {
  const VF mean = valid_mean(any_mean);
  const Bracket bracket = poisson_bracket(r, mean);
  const MF open = open_lanes(bracket);
  if (HWY_LIKELY(hn::AllFalse(Floats(), open))) return bracket.least;
  return resolved(r, mean, open, bracket.least);
}

/// Sets the number of pixels that share one filling of a buffer with words. The words and their results are long chains
/// of operations: separate loops let the processor work on several vectors at once.
constexpr std::size_t block_pixels = 256;
static_assert(block_pixels % hn::MaxLanes(Words()) == 0);

/// Computes words kFirst and, for kCount of 2, kFirst + 1, of pixels first..first + count - 1 of a row. Writes full
/// vectors.
template <int kFirst, int kCount>
HWY_INLINE void put_block(const Row& row, std::size_t first, std::size_t count, std::uint32_t (*out)[block_pixels]) {
  const Words w;
  VU x = hn::Iota(w, row.x0 + static_cast<std::uint32_t>(first));
  for (std::size_t i = 0; i < count; i += hn::Lanes(w)) {
    const FourWords r = words_of(row, x);
    for (int k = 0; k < kCount; ++k) hn::Store(r.word[kFirst + k], w, out[k] + i);
    x = hn::Add(x, hn::Set(w, static_cast<std::uint32_t>(hn::Lanes(w))));
  }
}

/// Returns whether Add(Mul(a, b), c) rounds twice: (1 + 2^-12)^2 - (1 + 2^-11) is 2^-24 exactly, and 0 if the square is
/// rounded.
HWY_INLINE bool rounds_products() {
  volatile float a = 1 + 0x1p-12f, c = -1 - 0x1p-11f;  // volatile: prevents evaluation by the compiler
  const VF sum = hn::Add(hn::Mul(constant(a), constant(a)), constant(c));
  return hn::AllTrue(Floats(), hn::Eq(sum, hn::Zero(Floats())));
}

}  // namespace lowlux::draws::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
