#pragma once

#include <array>

/// Signal in the coefficients of a block that are below their thresholds. Each of them is hidden by its noise, but
/// together they have more power than noise has: texture, or the edges of faint colours. Its spectrum is taken as
/// A / sqrt(u^2 + v^2), with A measured in each block (step 4 of denoise/README.md).
namespace lowlux::denoise {

/// How A follows from the excess of power in the coefficients below.
struct FaintSignal {
  float factor;  // of the excess beyond the margin
  float margin;  // standard errors of the excess in pure noise
};

/// Chosen on kodim03, 16, 20 and 23 and on patches of random colours, of 1 to 200 e- over 2 to 230 e-: luma is within
/// 0.03 dB for factors of 1 to 2 and margins of 1.5 to 3. Chroma would keep 0.03 more of faint colours with a margin of
/// 3, but two thirds more noise, not a fifth more, where its standard deviation is stated a fifth too small. Without
/// margins, blotches of noise in flat areas cost 0.7 dB at 4 e- over 230 e-.
inline constexpr FaintSignal faint_luma{1, 2};
inline constexpr FaintSignal faint_chroma{4, 4};

/// Mean square of standard normal values that are below T in magnitude: 1 - 2 T phi(T) / (2 Phi(T) - 1).
inline constexpr float below_3_sigma = 0.97334f;
inline constexpr float below_2_5_sigma = 0.91126f;

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
inline constexpr std::array<float, 64> faint_shape = faint_shapes();

}  // namespace lowlux::denoise
