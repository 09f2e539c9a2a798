#pragma once

#include <cstddef>

/// The kernel under compare_mosaics, with plain types only: its source is compiled for several instruction sets.
namespace lowlux::merge::rows {

/// Describes the noise of the difference d of a frame and the reference for a mean signal mu, by the sites of a CFA
/// cell: Var = slope max(mu, 0) + offset, and the cumulants of d for each electron of mu.
struct BlockNoise {
  float reference_slope;  // variance of the reference for each electron of signal
  float frame_slope;
  float slope;   // of both
  float third;   // third cumulant of d
  float fourth;  // fourth cumulant
  float reference_offset[4];
  float frame_offset[4];
  float offset[4];
};

/// Holds the limits within which content counts as the same scene.
struct BlockLimits {
  float site_deviate;               // normal deviate beyond which a site is an outlier; 0: none is
  float displacement_variance_px2;  // expected square of the error of the displacement, for each axis
};

/// Sums of a block over the sites that have a value in both mosaics and are no outliers.
struct BlockSums {
  float spread;           // sum d^2 / V
  float spread_variance;  // of it, as predicted
  float count;
  float d[4];  // for each site of the cell
  float v[4];
  float fourth[4];  // fourth cumulants
  int outliers;
};

/// Adds up a block of 8 x 8 sites, whose corner has even coordinates. See compare_mosaics.
/// @param reference  the block's corner, with `stride` values from row to row; two more rows and columns exist on each
///                   side (NaN: no value)
/// @param frame      the same of the frame, with `frame_stride` and nothing around it; outliers become NaN
BlockSums add_block(const float* reference, std::ptrdiff_t stride, float* frame, std::ptrdiff_t frame_stride,
                    const BlockNoise& noise, const BlockLimits& limits);

}  // namespace lowlux::merge::rows
