#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isp/base/plane.h"
#include "isp/base/result.h"

/// Measures and subtracts row and column noise by comparing segments of lines with the same segments of other lines.

namespace lowlux::denoise {

/// Direction of the lines. An offset is common to a row or column of a readout, and no transform's threshold removes
/// it.
enum class Lines : std::uint8_t { rows, columns };

/// Offsets to subtract from each line, with the prediction of the line noise that remains.
struct LineOffsets {
  Lines lines = Lines::rows;
  std::vector<double> offset_e;  // one for each line, already multiplied by the gain
  double line_std_e = 0;         // standard deviation of the lines' own noise
  double measured_std_e = 0;     // error of one line's measured offset
  double gain = 0;               // V / (V + e^2), V = line_std_e^2, e = measured_std_e
  double residual_std_e = 0;     // predicted standard deviation of the lines' noise once the offsets are subtracted
  /// Variance of the 16 groups of a line about its difference from the next line of the same colours, relative to the
  /// square of the difference, for the quarter of lines that differ most. What the scene adds differs between colours
  /// and along the line, an offset of the readout only by the noise of the pixels.
  double unevenness = 0;
};

/// Measures offsets in light-shielded pixels next to the image: each line's mean less the median of all lines of even
/// or of odd number, as it is, group by group, times the Wiener gain. The remaining variance is V e^2 / (V + e^2). A
/// line's mean is the Hodges-Lehmann estimate over up to 16 groups of its pixels, which a quarter of groups with hot
/// pixels does not shift.
/// @param masked_e  pedestal may be in; for rows as many rows as the image has. Values that are not finite are ignored
/// @return an error unless there are 16 lines of 4 pixels, with values in most of them
Result<LineOffsets> line_offsets_of_masked(PlaneView<const float> masked_e, Lines lines);

/// Holds the options of line_offsets_of_frame().
struct FrameLineOptions {
  std::optional<double> known_std_e;  // calibrated line noise, >= 0; absent: measured, so that blinds look like noise
  int reach = 8;                      // lines of the same colours to either side that a line is compared with, 1 to 64
  /// If the measured value is less than this, or the gain is below 0.5, no line is compared: no offsets are returned,
  /// and the residual is the lines' own noise. Comparing takes most of the time.
  double min_std_e = 0;
};

/// Measures offsets in the image itself: each line against its neighbours of the same colours,
///     offset = gain * mean over the neighbours j and itself of d_ij,   d_ij = median of line i less line j over 16
///     groups
/// The mean includes only neighbours with |d_ij| <= 3 sqrt(2 (V + e^2)): this excludes lines beyond an edge of the
/// scene, or the rest of the scene for a line through a lamp. Edges across part of the width do not shift a median. The
/// remaining variance is V (1 - gain (1 - 1/n)) with n lines compared, which is the mean of the neighbours' own
/// offsets; n is smaller towards the borders. A horizontal edge across the full width that is lower than the bound is
/// partly taken for noise, up to half of it.
/// @param charge_e  a mosaic [e-]. Values that are not finite are ignored
/// @return an error unless there are 16 lines of 4 pixels, with values in most of them
Result<LineOffsets> line_offsets_of_frame(PlaneView<const float> charge_e, Lines lines,
                                          const FrameLineOptions& options = {});

/// Subtracts each line's offset from a frame of as many lines as were measured, or from a crop of it.
/// @param first  number of the crop's first line
void subtract_lines(const LineOffsets& offsets, PlaneView<float> charge_e, int first = 0);

inline constexpr int segments =
    8;  // segments of a line, each in two groups: even and odd positions, whose colours differ
inline constexpr int groups = 2 * segments;

/// Returns the means of the groups of pixels of every line: as wide as there are lines, `groups` high. NaN for a group
/// without finite values.
Plane<double> group_means(PlaneView<const float> pixels, Lines lines);

/// Returns each line's difference from the line `distance` before it, as the median over their groups; the first value
/// is that of line `distance`. NaN where no group is finite in both lines.
/// @param means  result of group_means()
std::vector<double> differences(const Plane<double>& means, int distance);

/// Returns the median of the finite values; NaN if there are none. Reorders the values.
double median_of(std::span<double> values);

}  // namespace lowlux::denoise
