#pragma once

#include "denoise/spatial/bands.h"
#include "denoise/spatial/frame_memory.h"
#include "isp/base/cfa.h"

/// Correction for the positions of sites: those of a 2x2 cell lie a quarter of a cell from its middle. Where the luma
/// has a slope they differ by it, and this appears as colour in C2 = (R - B) / sqrt 2 and C3 = G1 - G2; thresholds
/// would remove that colour, and cells would become steps. So the part explained by the luma's own slope is subtracted
/// first, and added back with the slope of the denoised luma:
///     C2 -> C2 -+ (sx gx + sy gy) / (2 sqrt 2),   C3 -> C3 -+ (sy gy - sx gx) / 2
/// gx is the harmonic mean of L(x) - L(x - 1) and L(x + 1) - L(x), 0 where they differ in sign (van Leer's limiter:
/// next to a lamp there is a step and not a slope), gy likewise, edges repeated; (sx, sy) are the signs of R's offset.
/// The subtraction adds less than 3 % to the noise of C2 and C3. Greys without slope stay as they are.
namespace lowlux::denoise {

/// Factors of C2 += c2_x gx + c2_y gy, C3 += c3_x gx + c3_y gy.
struct SiteSlopes {
  float c2_x;
  float c2_y;
  float c3_x;
  float c3_y;
};

/// Returns the factors that add slopes; their negatives subtract them.
SiteSlopes site_slopes(BayerPhase phase);

/// Repeats the luma's first and last column at both ends of every row. This comes before rows are read, because each
/// row is read by the threads of its neighbours too.
void repeat_luma_edges(const PlaneSet& planes, int columns, int rows, const Workers& workers);

/// The rows of the luma above, at and below row y of `rows`.
struct LumaRows {
  const float* above;
  const float* own;
  const float* below;
};
LumaRows luma_rows(const PlaneSet& planes, int y, int rows);

/// Subtracts the slopes from the finest planes of a frame of columns x rows cells, and mirrors C2 and C3 anew beyond
/// it.
void subtract_slopes(const PyramidLevel& level, BayerPhase phase, int columns, int rows, const Workers& workers);

}  // namespace lowlux::denoise
