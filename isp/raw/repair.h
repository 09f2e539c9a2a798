#pragma once

#include <optional>
#include <vector>

#include "isp/base/executor.h"
#include "isp/base/frame.h"

namespace lowlux::isp {

/// Coordinates of a pixel in the active area.
struct Pixel {
  int x = 0;
  int y = 0;
  friend bool operator==(const Pixel&, const Pixel&) = default;
};

/// Temporal variance of a code v DN above black: (black_std_dn^2 + shot_dn * v) * ratio.
struct DefectNoise {
  double black_std_dn = 0;  // 0 if unknown
  double shot_dn = 0;       // the system gain [DN/e-]; 0 if unknown
  NoiseRatioView ratio{};   // noise ratio of the active area; only used where both figures are known
};

/// Finds hot and dead pixels of a Bayer frame by one fact of optics: the lens spreads a point of light over more than
/// one pixel, while a defect affects a single pixel. A pixel is defective when both hold (all in DN above black):
///   1. It lies outside the range of its eight nearest neighbours of the same colour, beyond the nearer end by more
///      than 4 ranges + 8 black_std_dn + 1 % of the range from black to white; where the noise is known at every level
///      (sigma), by more than 12 times the part of the range that noise does not explain + 5 sigma.
///   2. The mean excess of its four direct neighbours over the median of their own same-colour surroundings is less
///      than a tenth of its own excess (7 % at green sites), and 3.5 standard deviations of noise below that of a star.
///      A star of 1.5 pixels FWHM, in the middle of the pixel, gives its neighbours a fifth; at green sites a ninth,
///      because red and blue are weaker.
/// Within two pixels of a border, the neighbours that are missing are those of the opposite side, and the distance
/// of 1. is twice as large.
/// @return pixels ascending by row, then column; none of frames below 5 x 5 pixels
std::vector<Pixel> find_defects(const RawDn& raw, const BlackPoint& black, const DefectNoise& noise,
                                Executor& executor);

/// Returns the pixels a source lists as defective that lie in the active area, ascending, each once; nullopt if it
/// lists more than a sixteenth of them (repeats counted), which is a fault of the source and would take memory without
/// bound.
std::optional<std::vector<Pixel>> named_defects(const RawDn& raw, const std::vector<DefectRect>& defects);

/// Merges two ascending lists into one, each pixel once.
std::vector<Pixel> merged(const std::vector<Pixel>& a, const std::vector<Pixel>& b);

/// Replaces each defect in a mosaic by the mean of the pair of same-colour neighbours (left and right, or above and
/// below) that differ least; defective neighbours do not count. Where no pair is complete, the mean of
/// the sound neighbours is used. A defect without any sound neighbour keeps its value.
/// @param defects  ascending
/// @param step     distance of the same-colour neighbours: 2 for Bayer, 1 for monochrome
void repair(PlaneView<float> mosaic, const std::vector<Pixel>& defects, int step);
/// Repairs a tile of a mosaic, the tile's corner being at `corner` of the mosaic. Pixels at least `step` from the
/// tile's border get the same values as in a repair of the entire mosaic.
void repair(PlaneView<float> piece, const Pixel& corner, const std::vector<Pixel>& defects, int step);

}  // namespace lowlux::isp
