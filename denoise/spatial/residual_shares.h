#pragma once

#include "denoise/spatial/layout.h"

/// Fractions of the noise that blocks and patches leave, for the predicted residual variances. Denoiser and reference
/// share these values.
namespace lowlux::denoise {

/// Factors of the variance that a block leaves in each of its cells, in units of its noise variance V, where squared
/// gains g^2 add up to P:
///     kept (P - 1) + other (64 - P) + mean
/// P - 1 counts the coefficients that are taken for signal. `other` is the noise that passes in the rest: a threshold
/// of T standard deviations passes noise that has 2 T phi(T) more power than the V of each counted coefficient; where
/// coarser levels replace it, it is less. It does not follow from P, where noise that passed is far above V.
struct ResidualShares {
  float kept;
  float other;
  float mean;  // fraction for the mean of the block on the coarsest level: 1/64, reduced by overlapping blocks
};

enum class PlaneKind : unsigned char { luma, chroma };

/// Returns the factors of `level` of `levels`. Coarser levels replace the coarse structure of finer ones and lose their
/// own fine structure to G3 and up2: one quarter of their kept variance counts. `other` is measured on white noise by
/// tests/denoise/flat_noise: within 3 % on the finest level, within a third on coarser ones, which are a tenth of the
/// total. Cross-covariances between levels are included in that of the finest.
constexpr ResidualShares residual_fractions(PlaneKind kind, int pass, int rows_apart, int level, int levels) {
  struct Other {
    float finest;
    float coarser;
  };
  const int recipe = pass == 0 ? 0 : rows_apart == 4 ? 1 : 2;
  constexpr Other other[2][3] = {{{25.8e-6f, 0}, {16.6e-6f, 2.7e-6f}, {10.2e-6f, 2.0e-6f}},
                                 {{8.3e-6f, 2.3e-6f}, {8.7e-6f, 2.5e-6f}, {7.2e-6f, 1.9e-6f}}};
  const Other& o = other[kind == PlaneKind::luma ? 0 : 1][recipe];
  const float mean = (recipe == 2 ? 0.473f : 0.548f) / 64;
  return {level == 0 ? 1.0f / 64 : 0.25f / 64, level == 0 ? o.finest : o.coarser, level + 1 == levels ? mean : 0};
}

/// Factors of the variance that a patch of Level::best leaves in each of its cells, in units of V, where W is its
/// group's filter:
///     trace tr W / 16 + squares tr W^2 / 16 + other
/// `trace` is needed because the pilot, from which W is made, contains the same noise. `other` is blotches of the pilot
/// that are common to many patches of a group: they stay, and W does not include them. Chroma similarity separates
/// blotches of luma, so that groups found by luma alone have more of them in common; the remaining variance of chroma
/// is in `trace`.
struct PatchShares {
  float trace;
  float squares;
  float other;
};

enum class FoundBy : unsigned char { luma, all_planes };

/// Returns the factors on all levels but the coarsest. For luma, `trace` and `squares` hold for texture within a fifth;
/// for chroma, `squares` does, and `trace` is measured on flat frames. `other` includes three terms for luma: white
/// noise; false point sources, which add 1e-5 of V on average, although in one place in ten megapixels; and G has a
/// seventh more than the sum of its planes, as luma and chroma of one cell covary. `trace` and `other` of luma are
/// chosen so that the errors of flats and of the patches of charts are predicted (tests/denoise/denoiser_flats_test.cpp
/// with LOWLUX_NIGHTLY=1).
constexpr PatchShares patch_fractions(PlaneKind kind, FoundBy found_by) {
  if (kind == PlaneKind::chroma) return {0.08f, 0.6f, 0};
  return {0.15f, 0.5f, found_by == FoundBy::luma ? 74e-6f : 20e-6f};
}

/// Factor on the noise of a coarser level where chroma starts there: no finer level reduces it. It does not apply to
/// the coarsest level.
inline constexpr double as_finest = 2.5;

}  // namespace lowlux::denoise
