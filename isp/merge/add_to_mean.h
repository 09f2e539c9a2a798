#pragma once

#include <array>
#include <cstdint>

#include "isp/base/executor.h"
#include "isp/base/image.h"
#include "isp/base/plane.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/merge/motion.h"

/// Adds frames that lie in the place of the reference to a mean.
namespace lowlux::merge {

/// States what of a frame counts.
struct MeanPart {
  PlaneView<const float> site_weight;           // inverse variance of one sample; without data all sites weigh the same
  PlaneView<const std::uint8_t> block_matches;  // like Comparison::block_matches; without data all blocks match
};

/// Adds a mosaic that was placed in whole cells.
void add_placed(PlaneView<const float> placed, const MeanPart& part, MosaicMean& mean, Executor& executor);

/// Adds differences as drops (DropRows). The weights of each colour are divided by their mean over the frame, so that a
/// frame counts as one sample for each site, wherever its samples lie.
/// @param prediction  that the differences were formed with
/// @return of R, G and B, the noise that the frame adds over larger areas: the variance over that of one sample for
/// each
///         site, at least 1. Samples whose drops lie between sites count for less, and others for more.
std::array<double, 3> add_drops(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                                const RgbView<const float>& prediction, double radius_px, const MeanPart& part,
                                MosaicMean& mean, Executor& executor);

/// Adds differences as drops of all three colours of each pixel (ColourDropRows).
/// @param prediction  that the differences were formed with
void add_colour_drops(PlaneView<const float> differences, BayerPhase phase, const Motion& motion,
                      const RgbView<const float>& prediction, PlaneView<const std::uint8_t> block_matches,
                      ColourMean& mean, Executor& executor);

}  // namespace lowlux::merge
