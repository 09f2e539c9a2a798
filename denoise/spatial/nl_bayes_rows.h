#pragma once

#include <cstddef>
#include <cstdint>

#include "denoise/spatial/rows.h"

/// The kernel under nl_bayes.h: plain types only, as in rows.h.
namespace lowlux::denoise::rows {

inline constexpr int patch = 4;         // cells, each way
inline constexpr int search_reach = 8;  // rows above and below, columns to the left; one less to the right
inline constexpr int group = 32;        // patches filtered together, a multiple of 4
inline constexpr int ring = 32;         // rows of sums: those that patches found from one row cover, rounded up

/// Remaining variance of patches; see PatchShares.
struct ResidualOfPatches {
  float trace;
  float squares;
  float other;
};

/// Input of a row of patches, side by side.
struct PatchRow {
  const float* noisy[4];  // row 0 of L, C1, C2, C3
  const float* pilot[4];
  std::ptrdiff_t stride;     // stride of `noisy` and of `pilot`
  const float* variance[4];  // variance planes of half width and height: a quarter of the mean over 2x2 cells
  std::ptrdiff_t variance_stride;
  int width;  // cells, a multiple of 4, as is `height`
  int height;
  int y;                       // first row of the patches, a multiple of 4
  const std::uint8_t* chroma;  // for each patch, whether C1, C2, C3 are wanted; null: nowhere
  ResidualOfPatches left[3];   // luma, chroma, luma where chroma is not wanted
};
/// Weighted sums of patches.
struct PatchSums {
  float* change[4][ring];  // change of the pilot, times weight; row y at index y % ring
  float* weight[4][ring];
  float* residual[4][2];  // rows of half width
  float* residual_weight[4][2];
};
std::size_t patch_scratch();
void nl_bayes_row(const PatchRow& in, const RowScratch& scratch, const PatchSums& sums);

/// Computes out = to + sum / weight, or `to` where the weight is 0. If `to` is null, it counts as 0.
void add_mean_row(const float* sum, const float* weight, int count, const float* to, float* out);

}  // namespace lowlux::denoise::rows
