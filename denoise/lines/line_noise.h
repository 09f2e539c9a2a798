#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "isp/base/plane.h"
#include "isp/base/result.h"

/// Parts of lines that are compared with the same parts of other lines.

namespace lowlux::denoise {

/// Offsets that whole rows or columns of a readout share. No transform's threshold removes them: they stay as lines.
enum class Lines : std::uint8_t { rows, columns };

/// What is to be subtracted from each line, and how much of the noise that leaves.
struct LineOffsets {
  Lines lines = Lines::rows;
  std::vector<double> offset_e;  // one for each line, the gain already in it
  double line_std_e = 0;         // of the lines' own noise
  double measured_std_e = 0;     // error of one line's measured offset
  double gain = 0;               // V / (V + e^2), V = line_std_e^2, e = measured_std_e
  double residual_std_e = 0;     // predicted of the lines' noise once the offsets are subtracted
};

/// From light-shielded pixels beside the picture: each line's mean less the median of all lines of even or of odd
/// number, as it is, group by group, times the Wiener gain. Left is V e^2 / (V + e^2). A line's mean is the
/// Hodges-Lehmann estimate over up to 16 groups of its pixels, which a quarter of groups with hot pixels do not move.
/// @param masked_e  pedestal may be in; for rows as many rows as the picture has. Values that are not finite are left
/// out
/// @return an error unless there are 16 lines of 4 pixels, with values in most of them
Result<LineOffsets> line_offsets_of_masked(PlaneView<const float> masked_e, Lines lines);

struct FrameLineOptions {
  std::optional<double>
      known_std_e;  // line noise by calibration, >= 0; absent: measured, so that blinds look like noise
  int reach = 8;    // lines of the same colours to either side that a line is compared with, 1 to 64
  /// Where less than this is measured, or the gain is below 0.5, no line is compared: no offsets are given, and the
  /// residual is the lines' own noise. Comparing takes most of the time.
  double least_std_e = 0;
};

/// From the picture itself: each line against its neighbours of the same colours,
///     offset = gain * mean over the neighbours j and itself of d_ij,   d_ij = median of line i less line j over 16
///     groups
/// in which only neighbours with |d_ij| <= 3 sqrt(2 (V + e^2)) take part: those beyond an edge of the scene, or the
/// rest of a scene with a lamp's line in it, do not. Edges across part of the width do not move a median. Left is V (1
/// - gain (1 - 1/n)) of n lines compared, which is the mean of the neighbours' own offsets; fewer towards the borders.
/// A horizontal edge all across that is lower than the bound is in part taken for noise, up to half of it.
/// @param charge_e  a mosaic [e-]. Values that are not finite are left out
/// @return an error unless there are 16 lines of 4 pixels, with values in most of them
Result<LineOffsets> line_offsets_of_frame(PlaneView<const float> charge_e, Lines lines,
                                          const FrameLineOptions& options = {});

/// Subtracts each line's offset; as many lines as were measured, or a piece of the frame.
/// @param first  number of the piece's first line
void subtract_lines(const LineOffsets& offsets, PlaneView<float> charge_e, int first = 0);

inline constexpr int segments = 8;  // of a line, each in two groups: even and odd places, whose colours differ
inline constexpr int groups = 2 * segments;

/// Means of the groups of pixels of every line: as wide as there are lines, `groups` high. NaN for a group without
/// finite values.
Plane<double> group_means(PlaneView<const float> pixels, Lines lines);

/// Each line's difference from the one `distance` before it, as the median over their groups: of lines `distance` and
/// on, the first left out. NaN where no group has both.
/// @param means  as group_means() gives them
std::vector<double> differences(const Plane<double>& means, int distance);

/// The median of what is finite; NaN if nothing is. Reorders.
double median_of(std::span<double> values);

}  // namespace lowlux::denoise
