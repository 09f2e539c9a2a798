#pragma once

#include "denoise/spatial/layout.h"

/// How much of its noise a block leaves, for the predicted residual variances. Denoiser and reference share the
/// figures.
namespace lowlux::denoise {

/// Variance a block leaves in each of its cells, in units of its noise variance V, where squared gains g^2 add up to P:
///     kept (P - 1) + other (64 - P) + mean
/// P - 1 counts the coefficients that are taken for signal. `other` is the noise that passes with the rest: a threshold
/// of T standard deviations lets noise pass that has 2 T phi(T) more power than the V of each coefficient that is
/// counted, and what coarser levels replace is less. It does not follow from P, where noise that passed is far above V.
struct ResidualShares {
  float kept;
  float other;
  float mean;  // of the block's mean, on the coarsest level: 1/64 less what overlapping blocks average out
};

enum class PlaneKind : unsigned char { luma, chroma };

/// Of `level` of `levels`. Finer levels give their coarse structure up to coarser ones, whose fine structure G3 and up2
/// take away: one quarter of what is kept there counts. `other` is what tests/denoise/flat_noise measures on white
/// noise: of the finest level within 3 %, of coarser ones, a tenth of it all, within a third. Cross-covariances between
/// levels are in that of the finest.
constexpr ResidualShares residual_shares(PlaneKind kind, int pass, int step, int level, int levels) {
  struct Other {
    float finest;
    float coarser;
  };
  const int recipe = pass == 0 ? 0 : step == 4 ? 1 : 2;
  constexpr Other other[2][3] = {{{50.6e-6f, 1.0e-6f}, {40.9e-6f, 4.9e-6f}, {17.1e-6f, 2.0e-6f}},
                                 {{19.4e-6f, 4.2e-6f}, {20.2e-6f, 4.5e-6f}, {7.8e-6f, 2.0e-6f}}};
  const Other& o = other[kind == PlaneKind::luma ? 0 : 1][recipe];
  const float mean = (recipe == 2 ? 0.473f : 0.5625f) / 64;
  return {level == 0 ? 1.0f / 64 : 0.25f / 64, level == 0 ? o.finest : o.coarser, level + 1 == levels ? mean : 0};
}

/// Variance a patch of Level::best leaves in each of its cells, in units of V, where W is its group's filter:
///     trace tr W / 16 + squares tr W^2 / 16 + other
/// `trace` is there because the pilot, which made W, has seen the same noise. `other` are blotches of the pilot that
/// many patches of a group share: they stay, and W does not know of them. Similar chroma tells blotches of luma from
/// each other, so that groups found by luma alone share more of them; what chroma leaves is in `trace`.
struct PatchShares {
  float trace;
  float squares;
  float other;
};

enum class FoundBy : unsigned char { luma, all_planes };

/// On all levels but the coarsest. Of luma, `trace` and `squares` hold for texture within a fifth; of chroma, `squares`
/// does, and `trace` is what flat frames leave. `other` makes up for three things there: white noise leaves 12e-6 and
/// 74e-6; false point sources 1e-5 of V in all on the average, but in one place in ten megapixels; and G has a seventh
/// more than the sum of its planes, as luma and chroma of one cell covary.
constexpr PatchShares patch_shares(PlaneKind kind, FoundBy found_by) {
  if (kind == PlaneKind::chroma) return {0.08f, 0.6f, 0};
  return {0.21f, 0.5f, found_by == FoundBy::luma ? 86e-6f : 22e-6f};
}

/// By how much more the noise of a coarser level counts where chroma starts there: nothing finer takes it away. Not of
/// the coarsest.
inline constexpr double as_finest = 2.8;

}  // namespace lowlux::denoise
