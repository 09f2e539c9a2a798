#pragma once

#include <vector>

#include "capture/x_trans/x_trans_pattern.h"
#include "capture/x_trans/x_trans_setting.h"
#include "isp/base/correction.h"
#include "isp/base/executor.h"
#include "isp/base/plane.h"

/// Interpolation of X-Trans mosaics, by filters that were computed for the least error (scripts/train-x-trans), and
/// their noise and defects. capture/README.md has the method, its figures and its limits.
namespace lowlux::capture {

/// Interpolates three colours at every site. Every site keeps the value that was measured there.
///
/// Constants and, away from borders, linear gradients of each colour are reproduced exactly but for rounding, whatever
/// the other colours are: noise of mean 0 leaves means as they are. Values are signed and not limited, except within
/// five pixels of saturated sites (1 or more): gradients are not exact there, and where all sites of a colour within
/// one pixel are saturated, so is the interpolated value (capture/README.md). A colour without any site in the mosaic
/// gets the mean of the sites there are.
///
/// @param mosaic  height x width, finite
/// @param out     height x (3 width), R, G, B interleaved; must not overlap `mosaic`
/// @note The bytes do not depend on the number of threads. It takes 1 MB for each thread.
void interpolate_x_trans(PlaneView<const float> mosaic, const XTransSetting& setting, PlaneView<float> out,
                         Executor& executor);

/// The variance of a value x: scale x + offset, both >= 0.
struct NoiseLine {
  double scale = 0;
  double offset = 0;
};

/// Estimates the noise of a mosaic from its blocks of 2 x 2 green sites: the difference of their diagonals has the
/// variance of a site where the scene is a plane, and the lower quartile of many of its amounts is that of smooth
/// regions. Texture makes the estimate too large, never too small.
/// @param mosaic  height x width, fractions of white; every 4th row of blocks of large mosaics is used
/// @return a line through the levels that occur; 0 and 0 for mosaics with fewer than 64 blocks
NoiseLine estimate_mosaic_noise(PlaneView<const float> mosaic, const XTransPhase& phase);

/// Finds hot and dead sites of an X-Trans mosaic by the facts that isp/raw/repair.h states for Bayer mosaics: a site is
/// defective when both hold.
///   1. It lies outside the range of the sites of its colour within two pixels, beyond the nearer end by more than 12
///      times the part of the range that noise does not explain, 8 standard deviations of noise and 1 % of white.
///   2. The mean excess of its four direct neighbours over the median of the sites of their colours around them is less
///      than a tenth of its own excess (7 % at green sites): a star would be spread by the lens.
/// @param mosaic  height x width, fractions of white
/// @return single sites, ascending by row, then column. Sites within three of the border are not tested.
std::vector<DefectRect> find_mosaic_defects(PlaneView<const float> mosaic, const XTransPhase& phase,
                                            const NoiseLine& noise, Executor& executor);

/// Replaces the sites of each rectangle by the mean of the nearest sound sites of their colour: of those on the
/// smallest square around them that has some, up to 6 pixels away; a site without any keeps its value. Rectangles are
/// clipped to the mosaic.
void repair_mosaic(PlaneView<float> mosaic, const XTransPhase& phase, const std::vector<DefectRect>& defects);

}  // namespace lowlux::capture
