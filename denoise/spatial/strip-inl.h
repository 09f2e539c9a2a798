// Transforms of one strip of blocks, for shrink_rows.cpp. Included once for each instruction set: hence a guard that
// toggles instead of #pragma once.
#if defined(LOWLUX_DENOISE_STRIP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef LOWLUX_DENOISE_STRIP_INL_H
#undef LOWLUX_DENOISE_STRIP_INL_H
#else
#define LOWLUX_DENOISE_STRIP_INL_H
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>

#include "denoise/spatial/dct-inl.h"
#include "denoise/spatial/rows.h"

HWY_BEFORE_NAMESPACE();
namespace lowlux::denoise::rows::HWY_NAMESPACE {

// Lanes are adjacent blocks, which are two cells apart. Column c of block i is cell 2 i + c, i.e. place i + c / 2 of
// the run of the cells of phase c % 2: rows are split into such runs once, so that all later accesses are contiguous.

constexpr int run = strip_blocks + 32;  // places of one run in a strip, including the columns of the last blocks
constexpr int lead = 16;                // empty places before a strip's blocks, which shifted reads may touch
constexpr int places = lead + run;

/// Memory for one strip, zero at first: places that no strip writes, before the first block and after the last, stay 0.
struct Strip {
  float noisy[8][2][run];  // vertical frequency, phase, place
  float pilot[8][2][run];
  /// Of luma, for chroma: the square of a coefficient, with hard thresholds where it is kept, with Wiener gains that of
  /// the pilot; 0 elsewhere and for the mean.
  float luma[64][run];
  float luma_power[run];    // the sum of these squares, and 4 V
  float value[64][places];  // vertical frequency and column of blocks, before the inverse vertical transform
  float weight[places];
};

/// Returns the window in row i of a block. Blocks 4 rows apart have one that is higher in their middle and adds up to
/// the same in each row, so that the edges of single blocks do not show; blocks 2 cells apart need none. It is the same
/// for pairs of rows, so that half the weights suffice.
constexpr float window(int rows_apart, int i) { return rows_apart == 2 ? 1 : i >= 2 && i < 6 ? 5 : 2; }

/// Computes the vertical transform of the cells of `count` blocks, split into runs.
HWY_INLINE void transform_columns(const float* from, std::ptrdiff_t stride, int count, float (*out)[2][run]) {
  HWY_ALIGN float rows[8][2 * hn::MaxLanes(Floats())];
  const int n = lanes();
  for (int k = 0; k < count + 3; k += n) {
    for (int part = 0; part < 2; ++part) {
      VF x[8];
      for (int y = 0; y < 8; ++y) x[y] = load(from + y * stride + 2 * k + part * n);
      forward8(x);
      for (int y = 0; y < 8; ++y) store(x[y], rows[y] + part * n);
    }
    for (int y = 0; y < 8; ++y) {
      VF even, odd;
      hn::LoadInterleaved2(Floats(), rows[y], even, odd);
      store(even, out[y][0] + k);
      store(odd, out[y][1] + k);
    }
  }
}

HWY_INLINE void coefficients(const float (*from)[run], int place, VF (&x)[8]) {
  for (int c = 0; c < 8; ++c) x[c] = load(from[c % 2] + place + c / 2);
  forward8(x);
}

/// Transforms one group of blocks with the gains gain(i, x) of coefficient i of value x, and returns the sum of their
/// squares. The gain of the mean is 1.
/// @param row  row(v, x) reads the coefficients of vertical frequency v
template <class Row, class Gain>
HWY_INLINE VF filter(Strip& s, int place, const Row& row, const Gain& gain) {
  VF sum = hn::Zero(Floats());
  for (int v = 0; v < 8; ++v) {
    VF x[8];
    row(v, x);
    for (int u = 0; u < 8; ++u) {
      const VF g = u == 0 && v == 0 ? constant(1) : gain(8 * v + u, x[u]);
      sum = hn::MulAdd(g, g, sum);
      x[u] = hn::Mul(x[u], g);
    }
    inverse8(x);
    for (int c = 0; c < 8; ++c) store(x[c], s.value[8 * v + c] + lead + place);
  }
  return sum;
}

HWY_INLINE VF wiener_gain(VF power, VF variance) { return hn::Div(power, hn::Add(power, variance)); }

/// Signal in the coefficients of a block that are below their thresholds. Each of them is hidden by its noise, but
/// together they have more power than noise has: texture, or the edges of faint colours. Its spectrum is taken as
/// A / sqrt(u^2 + v^2), with A measured in each block (denoise/README.md, "Faint signal").
struct FaintSignal {
  float factor;  // factor of the excess beyond the margin
  float margin;  // standard errors of the excess in pure noise
};

/// Chosen by a script on kodim03, 16, 20 and 23 and on patches of random colours, of 1 to 200 e- over 2 to 230 e-. Luma
/// is within 0.03 dB for factors of 1 to 2 and margins of 1.5 to 3. Chroma would keep 0.03 more of faint colours with a
/// margin of 3, but two thirds more noise, not a fifth more, where its standard deviation is stated a fifth too small.
/// Without margins, blotches of noise in flat areas cost 0.7 dB at 4 e- over 230 e-.
constexpr FaintSignal faint_luma{1, 2};
constexpr FaintSignal faint_chroma{4, 4};

/// Mean square of standard normal values that are below T in magnitude: 1 - 2 T phi(T) / (2 Phi(T) - 1).
constexpr float below_3_sigma = 0.97334f;
constexpr float below_2_5_sigma = 0.91126f;

/// Returns 1 / sqrt(u^2 + v^2) of coefficient 8 v + u, 0 for the mean.
constexpr std::array<float, 64> faint_shapes() {
  std::array<float, 64> out{};
  for (int i = 1; i < 64; ++i) {
    const double square = (i % 8) * (i % 8) + (i / 8) * (i / 8);
    double root = square;
    for (int k = 0; k < 12; ++k) root = (root + square / root) / 2;  // Newton's method
    out[static_cast<std::size_t>(i)] = static_cast<float>(1 / root);
  }
  return out;
}
constexpr std::array<float, 64> faint_shape = faint_shapes();

/// The coefficients of one group of blocks.
struct Coefficients {
  HWY_ALIGN float value[64 * hn::MaxLanes(Floats())];

  HWY_INLINE void read(const Strip& s, int place) {
    for (int v = 0; v < 8; ++v) {
      VF x[8];
      coefficients(s.noisy[v], place, x);
      for (int u = 0; u < 8; ++u) store(x[u], value + (8 * v + u) * lanes());
    }
  }
  HWY_INLINE VF at(int i) const { return load(value + i * lanes()); }
  HWY_INLINE void row(int v, VF (&x)[8]) const {
    for (int u = 0; u < 8; ++u) x[u] = at(8 * v + u);
  }
};

/// Sums over the coefficients below their thresholds. To be initialised with zeros: constructors are not compiled for
/// every instruction set.
struct SumsBelow {
  VF excess;  // excess of the shape: F^2 minus the noise, which may be negative
  VF shape2;  // squared shape

  /// @param noise  the mean square of noise of which only what is below the threshold counts
  HWY_INLINE void add(int i, hn::Mask<Floats> below, VF square, VF noise) {
    const VF shape = hn::IfThenElseZero(below, constant(faint_shape[i]));
    excess = hn::MulAdd(shape, hn::Sub(square, noise), excess);
    shape2 = hn::MulAdd(shape, shape, shape2);
  }
  /// Returns A of the spectrum A shape of the signal in these coefficients (denoise/README.md, "Faint signal").
  HWY_INLINE VF faint_power(VF variance, const FaintSignal& of_plane) const {
    const VF per_sum = hn::Div(constant(1), hn::Max(shape2, constant(1e-6f)));
    const VF error = hn::Mul(variance, hn::Sqrt(hn::Mul(constant(2), per_sum)));
    const VF power = hn::NegMulAdd(constant(of_plane.margin), error, hn::Mul(excess, per_sum));
    return hn::Mul(constant(of_plane.factor), hn::Max(power, hn::Zero(Floats())));
  }
};

/// Hard threshold of luma. What falls below gets the gain P / (P + V), where P is the spectrum of faint signal.
HWY_INLINE VF threshold_luma(Strip& s, int place, VF variance) {
  const Floats f;
  const VF least = hn::Mul(constant(9), variance), noise = hn::Mul(constant(below_3_sigma), variance);
  VF kept_power = hn::Zero(f);
  SumsBelow below{hn::Zero(f), hn::Zero(f)};
  Coefficients all;
  all.read(s, place);
  store(hn::Zero(f), s.luma[0] + place);
  for (int i = 1; i < 64; ++i) {
    const VF x = all.at(i), square = hn::Mul(x, x);
    const auto kept = hn::Gt(square, least);
    const VF power = hn::IfThenElseZero(kept, square);
    kept_power = hn::Add(kept_power, power);
    store(power, s.luma[i] + place);
    below.add(i, hn::Not(kept), square, noise);
  }
  store(hn::MulAdd(constant(4), variance, kept_power), s.luma_power + place);
  const VF faint = below.faint_power(variance, faint_luma);
  const auto row = [&](int v, VF(&x)[8]) HWY_ATTR { all.row(v, x); };
  return filter(s, place, row, [&](int i, VF) HWY_ATTR {
    const auto kept = hn::Gt(load(s.luma[i] + place), hn::Zero(f));
    return hn::IfThenElse(kept, constant(1), wiener_gain(hn::Mul(faint, constant(faint_shape[i])), variance));
  });
}

/// Thresholds of chroma, after that of luma: lower where luma is kept. What falls below gets the gain P / (P + V),
/// where P is the larger of a spectrum shaped like that of the luma and of that of faint signal.
/// @param luma_shaped  power of the former over that of what is kept
HWY_INLINE VF threshold_chroma(Strip& s, int place, VF variance, float luma_shaped) {
  const Floats f;
  const VF least = hn::Mul(constant(16), variance), least_beside_luma = hn::Mul(constant(6.25f), variance);
  const VF noise_beside_luma = hn::Mul(constant(below_2_5_sigma), variance);
  const auto is_kept = [&](VF square, VF luma) HWY_ATTR {
    return hn::Gt(square, hn::IfThenElse(hn::Gt(luma, hn::Zero(f)), least_beside_luma, least));
  };
  VF kept_power = hn::Zero(f);
  SumsBelow below{hn::Zero(f), hn::Zero(f)};
  Coefficients all;
  all.read(s, place);
  for (int i = 1; i < 64; ++i) {
    const VF x = all.at(i), square = hn::Mul(x, x), luma = load(s.luma[i] + place);
    const auto kept = is_kept(square, luma);
    kept_power = hn::Add(kept_power, hn::IfThenElseZero(kept, square));
    const VF noise = hn::IfThenElse(hn::Gt(luma, hn::Zero(f)), noise_beside_luma, variance);
    below.add(i, hn::Not(kept), square, noise);
  }
  const VF per_luma = hn::Div(hn::Mul(constant(luma_shaped), kept_power), load(s.luma_power + place));
  const VF faint = below.faint_power(variance, faint_chroma);
  const auto row = [&](int v, VF(&x)[8]) HWY_ATTR { all.row(v, x); };
  return filter(s, place, row, [&](int i, VF x) HWY_ATTR {
    const VF luma = load(s.luma[i] + place);
    const VF power = hn::Max(hn::Mul(per_luma, luma), hn::Mul(faint, constant(faint_shape[i])));
    return hn::IfThenElse(is_kept(hn::Mul(x, x), luma), constant(1), wiener_gain(power, variance));
  });
}

/// Stores the squares of the pilot's coefficients for one group of blocks, 0 for the mean, and returns their sum.
/// @param square  64 vectors, `stride` floats apart
HWY_INLINE VF pilot_squares(const Strip& s, int place, float* square, std::ptrdiff_t stride) {
  VF sum = hn::Zero(Floats());
  for (int v = 0; v < 8; ++v) {
    VF x[8];
    coefficients(s.pilot[v], place, x);
    if (v == 0) x[0] = hn::Zero(Floats());
    for (int u = 0; u < 8; ++u) {
      const VF power = hn::Mul(x[u], x[u]);
      sum = hn::Add(sum, power);
      store(power, square + (8 * v + u) * stride);
    }
  }
  return sum;
}

/// Empirical Wiener gains of luma: P is `pilot_power` times the pilot's.
HWY_INLINE VF wiener_luma(Strip& s, int place, VF variance, float pilot_power) {
  const VF sum = pilot_squares(s, place, s.luma[0] + place, run);
  store(hn::MulAdd(constant(4), variance, sum), s.luma_power + place);
  const auto row = [&](int v, VF(&x)[8]) HWY_ATTR { coefficients(s.noisy[v], place, x); };
  const VF noise = hn::Mul(constant(1 / pilot_power), variance);
  return filter(s, place, row, [&](int i, VF) HWY_ATTR { return wiener_gain(load(s.luma[i] + place), noise); });
}

/// Empirical Wiener gains of chroma, after those of luma: P is the larger of `pilot_power` times the pilot's and of a
/// spectrum shaped like that of the luma. The pilot has lost the fine structure of colour, which mostly lies where luma
/// has its own.
/// @param luma_shaped  power of that spectrum over the pilot's
HWY_INLINE VF wiener_chroma(Strip& s, int place, VF variance, float luma_shaped, float pilot_power) {
  HWY_ALIGN float square[64 * hn::MaxLanes(Floats())];
  const int n = lanes();
  const VF sum = pilot_squares(s, place, square, n);
  // Powers and noise in units of pilot_power.
  const VF per_luma = hn::Div(hn::Mul(constant(luma_shaped / pilot_power), sum), load(s.luma_power + place));
  const VF noise = hn::Mul(constant(1 / pilot_power), variance);
  const auto row = [&](int v, VF(&x)[8]) HWY_ATTR { coefficients(s.noisy[v], place, x); };
  return filter(s, place, row, [&](int i, VF) HWY_ATTR {
    const VF power = hn::Max(hn::Mul(per_luma, load(s.luma[i] + place)), load(square + i * n));
    return wiener_gain(power, noise);
  });
}

/// Adds weighted, overlapping blocks to eight rows, through the inverse vertical transform.
HWY_INLINE void add_columns(const Strip& s, int count, int first_cell, int rows_apart, float* const (&rows)[8]) {
  HWY_ALIGN float row[2 * hn::MaxLanes(Floats())];
  const int n = lanes();
  for (int k = 0; k < count + 3; k += n) {
    VF out[8][2];
    for (int j = 0; j < 2; ++j) {
      VF x[8];
      for (int v = 0; v < 8; ++v) {
        x[v] = hn::Zero(Floats());
        for (int m = 0; m < 4; ++m) {
          const int place = lead + k - m;
          x[v] = hn::MulAdd(load(s.weight + place), load(s.value[8 * v + j + 2 * m] + place), x[v]);
        }
      }
      inverse8(x);
      for (int y = 0; y < 8; ++y) out[y][j] = x[y];
    }
    for (int y = 0; y < 8; ++y) {
      hn::StoreInterleaved2(out[y][0], out[y][1], Floats(), row);
      float* const to = rows[y] + first_cell + 2 * k;
      const VF factor = constant(window(rows_apart, y));
      for (int part = 0; part < 2; ++part) {
        store(hn::MulAdd(factor, load(row + part * n), load(to + part * n)), to + part * n);
      }
    }
  }
}

}  // namespace lowlux::denoise::rows::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
