#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// What a table is made for.
struct ColourTableRequest {
  Matrix3 rgb_to_xyz = *isp::rgb_to_xyz(primaries_rec709);  // of the linear RGB of pictures, in and out
  double limit = 1;                                  // brightest channel value of interest, white being 1: 1e-6 to 1e6
  double error_bound = 0.5;                          // CIEDE2000 that 99 of 100 colours should stay below
  std::size_t largest_bytes = std::size_t{8} << 20;  // 512 KiB to 256 MiB
};

/// CIEDE2000 between table and map at the middle of cells inside of the gamut: of the brightest colour of its
/// chromaticity within the limit, or, if the table has levels, of the colours midway between them.
struct ColourTableError {
  double mean = 0;
  double p99 = 0;  // 99 % of the colours are no farther off
  double largest = 0;
  int colours = 0;
};

/// A map of colours as a table over chromaticity. With the sum s = R + G + B it holds the answer for s = 1 at even
/// steps of the shares R / s and G / s, from -margin to 1 + 2 margin, and interpolates bilinearly. That is all there is
/// to a homogeneous map. For others the same is held at levels of s: 2, 4... an octave, evenly spaced in s between
/// powers of two, linear between levels, proportional below the lowest (2^-18 of the brightest) and above the highest.
/// The identity is linear in the shares, so it comes out exactly.
///
/// Shares below -margin are moved to it, towards the grey of equal luminance; margin is small enough for every colour
/// within to have positive luminance, so that nothing jumps where luminance becomes 0. Negative luminance gives the
/// grey that black's neighbours become, scaled.
struct ColourTable {
  Vector3 luminance{};  // of R, G and B
  Vector3 grey{};       // what a grey of Y = 1 becomes, taken from the darkest level
  double margin = 0;
  int cells = 0;              // in either direction
  int levels = 1;             // 1: the map is homogeneous
  int levels_per_octave = 1;  // a power of two
  int first_level_log2 = 0;   // the lowest level is 2^this
  std::vector<float> node;    // R, G, B and a 0 for each share of red, within each share of green, within each level
  ColourTableError error;
  bool within_bound = false;
};

/// Starts with 32 cells, or 16 and one level per octave, and doubles the cells or the levels, whichever err more, until
/// error.p99 is below the bound (within_bound), or the table would take more than largest_bytes, or have more than 256
/// cells or 64 levels per octave. Whether the map is homogeneous is found out on ten colours at three brightnesses (to
/// 1e-5).
/// Errors: invalid_argument for figures outside the ranges above, primaries without luminance or in one line, and a map
/// whose answer is not finite.
Result<ColourTable> make_colour_table(const ColourMap& map, const ColourTableRequest& request);

/// Every pixel through the table; planes of equal size, `out` may be `in`. What is not a number counts as 0, beyond
/// +-1e30 as that.
void apply_colour_table(const ColourTable& table, const RgbView<const float>& in, const RgbView<float>& out,
                        Executor& executor);

}  // namespace lowlux::isp
