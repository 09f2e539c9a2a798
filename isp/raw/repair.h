#pragma once

#include <optional>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"

namespace lowlux::isp {

/// A pixel of the active area.
struct Pixel {
  int x = 0;
  int y = 0;
  friend bool operator==(const Pixel&, const Pixel&) = default;
};

/// Temporal variance of a code v DN above black: black_std_dn^2 + shot_dn * v.
struct DefectNoise {
  double black_std_dn = 0;  // 0 if unknown
  double shot_dn = 0;       // the system gain [DN/e-]; 0 if unknown
};

/// Finds hot and dead pixels of a Bayer frame by one fact of optics: a point of light passes a lens and so never lands
/// in a single pixel, while a defect does. A pixel is defective when both hold (all in DN above black):
///   1. it lies outside the range of its eight nearest neighbours of the same colour, beyond the nearer end by more
///   than
///      4 ranges + 8 black_std_dn + 1 % of the range from black to white;
///      where the noise is known at every level (sigma), 12 times what of the range noise does not explain + 5 sigma;
///   2. its four direct neighbours, against the median of their own same-colour surroundings, share less than a tenth
///   of its excess, at
///      green sites 7 %, and so little that 3.5 standard deviations of noise do not make it of a star's. A star of 1.5
///      pixels FWHM, in the middle of the pixel, gives them a fifth; at green sites a ninth, red and blue being weaker.
/// @return ascending by row, then column. Pixels within two of the border are not judged.
std::vector<Pixel> find_defects(const RawDn& raw, const BlackPoint& black, const DefectNoise& noise,
                                Executor& executor);

/// The pixels a source names as defective that lie in the active area, ascending, each once; nullopt if it names more
/// than a sixteenth of them (repeats counted), which is a fault of the source and would take memory without bound.
std::optional<std::vector<Pixel>> named_defects(const RawDn& raw, const std::vector<DefectRect>& defects);

/// Both ascending lists in one, each pixel once.
std::vector<Pixel> merged(const std::vector<Pixel>& a, const std::vector<Pixel>& b);

/// Replaces each defect in a mosaic by the mean of the pair of same-colour neighbours (left and right, or above and
/// below) that differ least; defective neighbours do not count. A defect without any sound neighbour stays.
/// @param defects  ascending
/// @param step     distance of the same-colour neighbours: 2 for Bayer, 1 for monochrome
void repair(PlaneView<float> mosaic, const std::vector<Pixel>& defects, int step);
/// The same on a piece of a mosaic whose corner is at `corner` of it: its pixels `step` from the piece's border and
/// farther in get the same values as there.
void repair(PlaneView<float> piece, const Pixel& corner, const std::vector<Pixel>& defects, int step);

}  // namespace lowlux::isp
