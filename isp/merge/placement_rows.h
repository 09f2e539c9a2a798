#pragma once

#include "isp/merge/samples.h"

/// The kernels under placement.h, with plain types only: their source is compiled for several instruction sets.
/// Displacements of the pixels of a row vary slowly, so that neighbouring pixels mostly take neighbouring samples.
namespace lowlux::merge::rows {

/// Displacements of the pixels (0, y), (1, y) ... of a row, whose place is (x + dx[x], y + dy[x]). NaN: there is none.
struct DisplacedRow {
  int y;
  int count;
  const float* dx;
  const float* dy;
};

/// Interpolates `even` at the places of even pixels and `odd`, of the same size, at those of odd ones by cubic
/// convolution; next to the border, samples of the border count for those beyond it. NaN at places outside of the
/// plane.
void interpolate_row(const Samples& even, const Samples& odd, const DisplacedRow& at, float* out);

/// Takes the samples of the same site of a 2x2 cell that are nearest to the places, up to one pixel away on each axis.
/// NaN where there is none.
void nearest_row(const Samples& samples, const DisplacedRow& at, float* out);

/// A mosaic, by the position (0 or 1) of red in its 2x2 cells.
struct Mosaic {
  Samples samples;
  int red_column;
  int red_row;
};

/// The radii of drops at even and at odd pixels of a row, at most 2 pixels.
struct DropRadius {
  float even;
  float odd;
};

/// Adds up the samples of the pixels' own colours around their places, weighted by a tent of the distance:
///     t = max(1 - |dx| / radius, 0) max(1 - |dy| / radius, 0)
/// NaN samples do not count.
/// @param value   sum t D / sum t, NaN where the sum of t is 0
/// @param weight  sum t
void drop_row(const Mosaic& mosaic, const DisplacedRow& at, const DropRadius& radius, float* value, float* weight);

/// The radii of the drops of a colour, at most 1 pixel.
struct ColourRadius {
  float green;
  float red_blue;
};

/// The sums of a row of pixels for R, G and B.
struct ColourRow {
  float* value[3];
  float* weight[3];
};

/// Adds up the samples of each colour around the places of pixels, whatever the pixels' own colours are, weighted by
/// the same tent, rounded to multiples of 1/256 so that sums of weights are exact. NaN samples do not count.
/// @param out  sum t D and sum t
void colour_row(const Mosaic& mosaic, const DisplacedRow& at, const ColourRadius& radius, const ColourRow& out);

}  // namespace lowlux::merge::rows
