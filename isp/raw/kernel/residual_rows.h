#pragma once

#include "isp/raw/kernel/encoding.h"

/// The row kernels of demosaicing on encoded values are dispatched at run time and take plain types only: see
/// raw_to_rgb_rows.h.
///
/// Each row of a mosaic holds green and one of red and blue, its own colour. A quantity of a row is stored in two runs:
/// own[i] and green[i] belong to pair i of columns. `shift` is 1 if the own colour is in odd columns: the green
/// neighbours of own[i] are then green[i] and green[i + 1], else green[i - 1] and green[i]. In the rows above and
/// below, the columns of own[i] hold green[i], those of green[i] hold own[i].
namespace lowlux::isp::rows {

/// Kernels compute the pairs -run_margin to pairs + run_margin - 1 of a run, and read up to three more.
inline constexpr int run_margin = 8;

/// Holds a quantity of one row.
struct SiteRow {
  float* own;
  float* green;
};
struct ConstSiteRow {
  const float* own;
  const float* green;
};

/// Computes out = u of min(in, clip), limited to encoding_min..encoding_max, for samples 0 to n - 1.
void encode_row(const float* in, float clip, const Encoding& encoding, int n, float* out);

/// Computes the differences green - own colour along the row and along the column (Hamilton, Adams 1997):
///     +-(1/2 (u[-1] + u[1]) - 1/4 (u[-2] + u[2]) - 1/2 u[0]), + at the own colour, - at green.
struct DifferenceRows {
  ConstSiteRow u[5];  // rows y - 2 to y + 2
  int shift;
  SiteRow horizontal;
  SiteRow vertical;
};
void difference_row(const DifferenceRows& in, int pairs);

/// Computes the gradients of the differences: |D[+1] - D[-1]| of the horizontal ones along the row, of the vertical
/// ones along the column.
struct GradientRows {
  ConstSiteRow horizontal;  // difference of the row
  ConstSiteRow above;       // vertical differences of rows y - 1 and y + 1
  ConstSiteRow below;
  int shift;
  SiteRow gradient_h;
  SiteRow gradient_v;
};
void gradient_row(const GradientRows& in, int pairs);

/// Computes 3x3 sums of gradients at the sites of the own colour.
struct GradientSumRows {
  ConstSiteRow gradient_h[3];  // rows y - 1 to y + 1
  ConstSiteRow gradient_v[3];
  int shift;
  float* sum_h;
  float* sum_v;
};
void gradient_sum_row(const GradientSumRows& in, int pairs);

/// Holds the detail of a row at the sites of its own colour: with d the difference of the own colour across a site,
/// u[2] - u[-2], and e that of green at the same places, the sums over both directions of d^2, e^2 and d e. `fine` is
/// the square of the two greens next to a site along the row less the two along the column.
template <class Float>
struct DetailRow {
  Float* own;
  Float* green;
  Float* both;
  Float* fine;
};

/// Computes the detail of row y. Along the row, e is half of u[1] - u[-1] plus half of the difference between the means
/// of the greens above and below the places of u[2] and of u[-2]. Along the column it is computed in the same way.
struct DetailRows {
  ConstSiteRow u[5];  // rows y - 2 to y + 2
  int shift;
  DetailRow<float> detail;
};
void detail_row(const DetailRows& in, int pairs);

/// Computes how far green shares the detail of the own colour. With o, g, b and f the means of d^2, e^2, d e and `fine`
/// over 3x3 sites of the own colour,
///     shared = max(min(1 + 2 b / (sqrt(o g) + floor), (4 g + floor) / (o + floor)), 2 f / (o + floor)),
/// limited to 0..1. The last term is for detail of 3 to 4 px, which is aliased in the own colour, so that b says
/// nothing. Where all colours share detail of more than 4 px this is 1. Next to petals, signs or lamps of one strong
/// colour green has less detail, or the opposite.
struct SharedDetailRows {
  DetailRow<const float> detail[3];  // rows y - 2, y, y + 2
  float floor;
  float* sum[4];  // memory
  float* shared;
};
void shared_detail_row(const SharedDetailRows& in, int pairs);

/// Computes green at the sites of the own colour. Where it shares the detail of the own colour this is the own colour
/// plus the mean of four one-sided means of five differences (Pekkucuksen, Altunbasak, ICIP 2010), where it does not,
/// the mean of the neighbouring greens, else between the two. Both means are weighted by 1 / (floor + sum)^2 of the
/// gradients two sites away on a side.
struct GreenRows {
  ConstSiteRow u[3];         // rows y - 1 to y + 1
  ConstSiteRow horizontal;   // differences of the row
  ConstSiteRow vertical[9];  // rows y - 4 to y + 4, alternately of the own colour and of green
  const float* sum_h;
  const float* sum_above;  // vertical sums of rows y - 2 and y + 2
  const float* sum_below;
  const float* shared;
  float floor;
  int shift;
  float* green;       // u of green
  float* difference;  // own colour - green
};
void green_row(const GreenRows& in, int pairs);

/// Computes the slope of the difference (own colour - green) over green in windows of 3x3 samples of the own colour, by
/// ridge regression: cov(difference, green) / (var(green) + ridge).
struct SlopeRows {
  const float* green[3];  // rows y - 2, y, y + 2
  const float* difference[3];
  float ridge;
  float* sum[4];  // memory
  float* slope;
};
void slope_row(const SlopeRows& in, int pairs);

/// Computes the 3x3 means of slopes and, with them, difference - slope * green.
struct RestRows {
  const float* slope[3];  // rows y - 2, y, y + 2
  const float* green;
  const float* difference;
  float* mean_slope;
  float* rest;
};
void rest_row(const RestRows& in, int pairs);

/// Interpolates the differences to green of both colours at all sites but the measured ones: with slope and rest
/// bilinear between the samples of a colour, difference = slope * green + rest.
struct ColourDifferenceRows {
  const float* slope[3];  // rows y - 1 to y + 1: the own colour in the middle, the other colour above and below
  const float* rest[3];
  const float* green_at_own;
  const float* green;
  int shift;
  float* own_at_green;
  SiteRow other;
};
void colour_difference_row(const ColourDifferenceRows& in, int pairs);

/// Holds the differences to green of one colour in rows y - 1 to y + 1, by the columns of the own and the green sites
/// of row y.
struct DifferenceColumns {
  const float* own[3];
  const float* green[3];
};

/// Holds camera RGB of a row at the sites of one kind: own colour, green, other colour.
struct ColourRuns {
  float* own;
  float* green;
  float* other;
};

/// Computes linear values of all three colours: those measured as they are, the others decoded from green plus
/// difference, on request with 3x3 medians of the differences.
struct FinishRows {
  ConstSiteRow linear;
  const float* green_at_own;
  const float* green;
  DifferenceColumns own;
  DifferenceColumns other;
  int shift;
  bool median;
  ColourRuns at_own;
  ColourRuns at_green;
};
void finish_row(const FinishRows& in, const Encoding& encoding, int pairs);

}  // namespace lowlux::isp::rows
