#pragma once

#include <cstdint>

#include "isp/base/look_grid.h"
#include "isp/base/tone_table.h"
#include "isp/raw/kernel/encoding.h"

/// The row kernels of RawToRgb are dispatched at run time. They take plain types only: their sources are compiled for
/// several instruction sets, which must not have inline code in common.
namespace lowlux::isp::rows {

/// These are the samples that may be read before the first and after the last pair of a run; see docs/kernels.md.
inline constexpr int padding_before = 16;
inline constexpr int padding_after = 48;

/// Stores one row in two runs: even[i] is column 2i, odd[i] column 2i + 1.
struct SplitRow {
  float* even;
  float* odd;
};

/// Holds the levels of the even and the odd columns of one row.
struct RowLevels {
  float black[2];
  float gain[2];
};

/// Computes (in - black) * gain of one row, without mirrored ends. A row of odd width leaves a finite value in its last
/// odd position.
void split_dn(const std::uint16_t* in, int width, const RowLevels& levels, const SplitRow& out);
void split_float(const float* in, int width, const RowLevels& levels, const SplitRow& out);

/// Holds the rows y-2 .. y+2 around an output row, with mirrored borders. Each row holds green and one of red and blue:
/// its own colour, at odd columns if own_is_odd. Where the rows are encoded, they come with the linear values of row y.
struct MosaicRows {
  const float* even[5];
  const float* odd[5];
  bool own_is_odd;
  bool encoded;
  Encoding encoding;
  const float* linear_even;
  const float* linear_odd;
};

/// Holds three rows of camera RGB.
struct PlaneRows {
  const float* even[3];
  const float* odd[3];
};

/// Holds a LookGrid for one row of pixels: the parts interpolated between rows of cells, with one cell repeated before
/// the first and look_padding after the last.
struct LookRow {
  const float* part[LookGrid::parts];
  float luminance[3];
  float rods[3];
  float tint[3];
  float dark;
};
inline constexpr int look_padding = 24;

/// Holds an RgbTransform for one channel order of the camera: (own, green, other) of a mosaic row, (R, G, B) of planes.
struct Colour {
  float column[3][3];  // column[c][j]: contribution of camera channel c to output j
  float luminance[3];
  float clip;
  bool move_into_gamut;
  const LookRow* look;  // null: none
};

struct Codes8 {
  const ToneTable* tone;
  std::uint8_t* out;    // interleaved
  int pixel_bytes = 3;  // 4: the last is 255
  bool is_bgr = false;  // B G R in place of R G B
};
struct Codes16 {
  const ToneTable* tone;
  std::uint16_t* out;
};
struct Planes {
  float* out[3];
};

void convert_row(const MosaicRows& in, const Colour& colour, int width, const Codes8& out);
void convert_row(const MosaicRows& in, const Colour& colour, int width, const Codes16& out);
void convert_row(const MosaicRows& in, const Colour& colour, int width, const Planes& out);
void convert_row(const PlaneRows& in, const Colour& colour, int width, const Codes8& out);
void convert_row(const PlaneRows& in, const Colour& colour, int width, const Codes16& out);
void convert_row(const PlaneRows& in, const Colour& colour, int width, const Planes& out);

/// Holds one row of 2x2 cells; the sites of a cell are in the order R, G1, G2, B, one run each.
struct CellRow {
  const float* site[4];
};
void bin_row(const CellRow& in, int cells, const Planes& out);

/// Holds runs of samples to be averaged over four columns of pixels: out[j] = factor * the sum of samples 2j and 2j + 1
/// of all runs.
struct QuarterRuns {
  const float* run[8];
  int runs;
  float factor;
};
void quarter_row(const QuarterRuns& in, int cells, float* out);

/// Computes out = a + t (b - a) for samples 0 to n - 1.
void blend_row(const float* a, const float* b, float t, int n, float* out);

const char* target_name();

}  // namespace lowlux::isp::rows
