#pragma once

#include <cstddef>
#include <cstdint>

/// The row kernels under Denoiser, dispatched at run time. Their interface has plain types only: their sources are
/// compiled for several instruction sets, and must not share inline code. Rows consist of cells (2x2 sites) of a
/// pyramid level.
namespace lowlux::denoise::rows {

/// Number of floats that may be read and written after the last of a row.
inline constexpr int padding = 192;

/// Memory for a kernel's own use, of at least as many floats as the kernel's ..._scratch() returns. It is zero at first
/// (see ScratchUse), and no other kernel uses it in between.
struct RowScratch {
  float* data;
  std::size_t floats;
};

/// Number of blocks of one row that are transformed together: their coefficients stay in the first-level cache.
inline constexpr int strip_blocks = 32;

/// Where the stabiliser (stabiliser.h) becomes linear: light and stabilised value over the offset, and the slope of the
/// light there and below.
inline constexpr float linear_light = -0.5f;
inline constexpr float linear_value = -0.585786437627f;  // sqrt 2 - 2
inline constexpr float linear_slope = 0.707106781187f;

/// Input for one row of cells: two raw rows, which hold an even number of samples each (see raw_of).
struct PackRow {
  const float* raw[2];  // the row with red, the row with blue
  bool red_is_odd;      // red lies in odd columns
  int cells;
  float dark_e[3];  // R, G, B
  float gain[3];
  float saturation_e[3];
  float offset_e;  // offset of the stabiliser
};
struct PackedRow {
  float* raw_e[3];   // R, mean of both greens, B, dark charge included, as measured
  float* saturated;  // 1 where a site is saturated, else 0
  float* plane[4];   // stabilised L, C1, C2, C3; null: neither these nor `saturated` are wanted
};
void pack_row(const PackRow& in, const PackedRow& out);

/// Input for variances of the four stabilised planes in one row of half width: the ten rows of R, G, B around its two
/// rows of cells.
struct VarianceRow {
  const float* raw_e[3][10];  // read from 4 cells before to 4 cells after
  int cells;
  float min_e[3];  // floor of the local mean
  float dark_e[3];
  float variance_e2[3];
  float gain[3];       // gain of the noise: white balance times the root of the variance's scale
  float balance[3];    // gain of white balance
  float offset_e;      // offset of the stabiliser
  const float* ratio;  // factor of each variance of the row; null: 1, and nothing below is read
  float max_ratio;     // largest noise ratio of the frame
  float* plane[3][2];  // L, C1, C2 of the two rows of cells, whose means become those of noise of the largest ratio
};
std::size_t variance_scratch(int cells);
void variance_row(const VarianceRow& in, const RowScratch& scratch, float* const out[4]);

/// Returns the sum of `count` samples, with NaN as 0, each limited to +-1e9.
double sum_of(const float* in, int count);

/// Computes means of 2x2 cells times `scale`.
void down2_row(const float* const in[2], int out_cells, float scale, float* out);

/// Computes coarse - mean of 2x2 cells.
void difference_row(const float* const fine[2], const float* coarse, int cells, float* out);

/// Input for bilinear upsampling of one row, `near` and `far` being the coarse rows at 1/4 and 3/4 of a cell's
/// distance.
struct UpRow {
  const float* near[3];  // only the middle one is read by smooth_row
  const float* far[3];
  int coarse_cells;
};
std::size_t up_scratch(int coarse_cells);
/// Computes inout += up2 of the 3x3 binomial mean of the rows.
void add_correction_row(const UpRow& in, const RowScratch& scratch, float* inout);
/// Computes out = up2 of near[1], far[1].
void smooth_row(const UpRow& in, const RowScratch& scratch, float* out);

/// Computes inout = (1 - share) inout + share coarse.
void blend_row(const float* coarse, const float* share, int cells, float* inout);
/// Computes inout = (1 - share) own + inout.
void add_residual_row(const float* own, const float* share, int cells, float* inout);

/// Factors of the variance that blocks leave; see ResidualShares.
struct ResidualOfBlocks {
  float kept;
  float other;
  float mean;
};

/// Input of all blocks with their corner on one row of cells.
struct BlockRow {
  const float* noisy[4];     // L, C1, C2, C3
  const float* pilot[4];     // result of pass 0; null: hard thresholds
  std::ptrdiff_t stride;     // stride of `noisy` and of `pilot`
  const float* variance[4];  // variance of half width and height
  std::ptrdiff_t variance_stride;
  int blocks;
  int rows_apart;              // cells to the next row of blocks, 2 or 4; in a row, blocks are 2 cells apart
  ResidualOfBlocks left[2];    // luma, chroma
  const std::uint8_t* chroma;  // for each strip, whether C1, C2, C3 are wanted; null: nowhere
  /// Power of a spectrum shaped like that of luma over that of the chroma that is known: at least as much is expected.
  float luma_shaped;
  float pilot_power[2];  // factor of the pilot's squared coefficients; luma, chroma
  /// Blocks of the coarsest level have the weight 1 / V, others 1 / (V sum g^2): there, colours fainter than their
  /// noise are in few blocks, which would count less than those around them.
  bool coarsest;
};
/// Weighted sums of blocks: 8 rows of cells, 4 rows of half width.
struct BlockSums {
  float* value[4][8];
  float* weight[4][4];
  float* residual[4][4];
};
/// Returns the scratch size for rows of up to `cells` cells.
std::size_t block_scratch(int cells);
void shrink_block_row(const BlockRow& in, const RowScratch& scratch, const BlockSums& sums);

/// Two rows of sums, and one of half width, to be divided by their weight; a sum without weight gives 0.
struct SumRows {
  const float* value[2];
  const float* weight;
  const float* residual;
  int cells;
};
struct FinishedRows {
  float* value[2];
  float* residual;
};
std::size_t finish_scratch(int cells);
void finish_rows(const SumRows& in, const RowScratch& scratch, const FinishedRows& out);

/// Factors of the slopes gx and gy, as in SiteSlopes.
struct Slopes {
  float c2_x, c2_y, c3_x, c3_y;
};
/// Adds the slopes of a row of luma, given with those above and below and read one cell beyond both ends, to C2 and C3.
void add_slope_row(const float* const (&luma)[3], int cells, const Slopes& slopes, float* const (&chroma)[2]);

/// Input for converting one row of cells to two raw rows of 2 cells samples.
struct UnpackRow {
  const float* plane[4];
  const float* residual[4];
  const float* seen;  // 0 where a site is saturated: no chroma and no confidence; else 1
  int cells;
  float rho;  // < 0: no prior
  float per_gain[3];
  bool red_is_odd;
  bool sites_coincide;             // both greens of a cell are one value
  const float* neighbour_luma[2];  // rows above and below
  Slopes slopes;
  float offset_e;  // offset of the stabiliser
  float dark_e[3];
  float min_e[3];  // floor of the raw mean
  float variance_e2[3];
  const float* removed;  // variance of the removed noise over that of dark_e, min_e and variance_e2
};
struct UnpackedRow {
  float* signal_e[2];  // the row with red, the row with blue
  float* confidence;
  float* luma_variance_e2;  // variance of white-balanced luma; these rows may be those of the residuals
  float* variance_e2[3];    // variance of sites of R, G, B
};
void unpack_row(const UnpackRow& in, const UnpackedRow& out);

/// Input for the limit of changes in a raw row; arrays have the values of even and of odd sites.
struct ChangedRow {
  const float* raw_e;  // with dark charge; values that are not numbers set no limit
  const float* ratio;  // noise ratio of each site; infinity: no limit
  int width;
  float dark_e[2];
  float min_e[2];  // floor of the raw mean
  float variance_e2[2];
  float variance_scale;
};
/// Takes back changes of raw values by more than five standard deviations, sigma^2 = ratio (mean + variance) with the
/// larger of raw value and result for the mean, because small counts are skewed: half of a change by 6.7 sigma, and all
/// of those by 10 or more.
/// @param signal_e  the result without dark charge, changed in place; this row and `ratio` are padded, raw_e is not
void undo_excessive_row(const ChangedRow& in, float* signal_e);

/// Input for the noise removed from a row of cells, the first of them even; variances have half width.
struct RemovedRow {
  const float* noisy[4];  // L, C1, C2, C3
  const float* value[4];
  const float* variance[4];  // only C2 and C3 are read
  int cells;
  float offset_e;
};
/// Sums over sites of squared differences and of stated variances, in squares of the offset; see removed_noise().
struct RemovedSums {
  float removed;
  float stated;
};
RemovedSums removed_row(const RemovedRow& in);

/// Computes the sums of two raw rows, samples as in sum_of.
void pair_row(const float* upper, const float* lower, int width, float* out);

/// Input for windows of 2x2 sites in one row of them: pair[3] is the sum of the window's rows, pair[i] that 2 (i - 3)
/// rows below.
struct WindowRow {
  const float* pair[7];
  const float* above;  // sums of two rows one row above the windows; `below` one row below
  const float* below;
  int first;  // column of the first window, at least 6
  int last;   // one beyond the last; 8 columns more are read
  float floor_e;
  float variance_e2;
  const float* ratio;  // factor of the variance of the window of each column; null: 1
  float significance;
  float* inner;  // scratch, as long as a row and its padding
  float* outer;
};
/// Finds the columns of windows whose excess t over the mean around has t > 0, t^2 / (2 V) >= significance, and that no
/// window one site away clearly exceeds: necessary conditions of those in point_sources.h. Returns their number.
int bright_windows(const WindowRow& in, std::int32_t* columns);

const char* target_name();

}  // namespace lowlux::denoise::rows
