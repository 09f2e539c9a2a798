#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

/// Requests a table: its colour space, range, accuracy and size.
struct ColourTableRequest {
  Matrix3 rgb_to_xyz = *isp::rgb_to_xyz(primaries_rec709);  // matrix of the linear RGB of images, in and out
  double limit = 1;                                  // brightest channel value of interest, white being 1: 1e-6 to 1e6
  double error_bound = 0.5;                          // CIEDE2000 that 99 % of the colours should stay below
  std::size_t largest_bytes = std::size_t{8} << 20;  // 512 KiB to 256 MiB
};

/// CIEDE2000 between table and map at the centre of cells inside the gamut, for the brightest colour of each
/// chromaticity within the limit or, if the table has levels, for the colours midway between them.
struct ColourTableError {
  double mean = 0;
  double p99 = 0;  // 99 % of the colours have at most this error
  double largest = 0;
  int colours = 0;
};

/// Tabulates a colour map over chromaticity. With the sum s = R + G + B it holds the map's result for s = 1 at even
/// steps of the fractions R / s and G / s, from -margin to 1 + 2 margin, and interpolates bilinearly. This suffices for
/// a homogeneous map. Other maps are tabulated at levels of s: 2, 4... per octave, evenly spaced in s between powers of
/// two, linear between levels, proportional below the lowest (2^-18 of the brightest) and above the highest. The
/// identity is linear in the fractions, so it is reproduced exactly.
///
/// A table by noise has a level for each octave or part of an octave of the ratio of noise to signal, from 2^-5 to 2^5,
/// each with a homogeneous map, and is linear between them; ratios outside take the outermost level.
///
/// Fractions below -margin are moved to it, towards the grey of equal luminance; margin is small enough for every
/// colour within to have positive luminance, so that there is no step where luminance becomes 0. Negative luminance
/// gives the grey that colours next to black map to, scaled.
struct ColourTable {
  Vector3 luminance{};  // weights of R, G and B
  Vector3 grey{};       // result for a grey of Y = 1, taken from the darkest level
  double margin = 0;
  int cells = 0;              // in either direction
  bool by_noise = false;      // levels are ratios of noise to signal, not sums
  int levels = 1;             // 1: the map is homogeneous
  int levels_per_octave = 1;  // a power of two
  int first_level_log2 = 0;   // the lowest level is 2^this
  std::vector<float> node;    // R, G, B and a 0 for each R fraction, within each G fraction, within each level
  ColourTableError error;
  bool within_bound = false;
};

/// Starts with 32 cells, or 16 and one level per octave, and doubles the cells or the levels, whichever have the larger
/// error, until error.p99 is below the bound (within_bound), or the table would take more than largest_bytes, or have
/// more than 256 cells or 64 levels per octave. Ten colours at three brightnesses (to 1e-5) decide whether the map is
/// homogeneous.
/// Errors: invalid_argument for values outside the ranges above, primaries without luminance or in one line, and a map
/// whose result is not finite.
Result<ColourTable> make_colour_table(const ColourMap& map, const ColourTableRequest& request);

/// Makes a homogeneous map for a ratio of noise to signal.
using NoiseColourMap = std::function<Result<ColourMap>(double noise_to_signal)>;

/// Tabulates a map over chromaticity and the ratio of noise to signal, as make_colour_table does over brightness.
/// Errors: as make_colour_table, and those of the maps.
Result<ColourTable> make_noise_colour_table(const NoiseColourMap& maps, const ColourTableRequest& request);

/// Applies the table to every pixel; planes have equal size, `out` may be `in`. A sample that is not a number counts as
/// 0, one beyond +-1e30 as +-1e30. Precondition: !table.by_noise.
void apply_colour_table(const ColourTable& table, const RgbView<const float>& in, const RgbView<float>& out,
                        Executor& executor);

/// Holds the ratio of signal to noise at the centres of cells of 4 x 4 pixels, as of LookGrid, linear between them. The
/// levels of a table are ratios of noise to signal, which are infinite in cells without light; interpolated, they would
/// turn the pixels of neighbouring cells grey.
struct NoiseGrid {
  PlaneView<const float> signal_to_noise;  // not NaN; negative counts as 0
};

/// Applies a table by noise to every pixel. Precondition: table.by_noise.
/// @param noise  ceil(height / 4) x ceil(width / 4)
void apply_colour_table(const ColourTable& table, const RgbView<const float>& in, const NoiseGrid& noise,
                        const RgbView<float>& out, Executor& executor);

}  // namespace lowlux::isp
