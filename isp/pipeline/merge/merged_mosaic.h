#pragma once

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/merge/mosaic_mean.h"
#include "isp/pipeline/finished/raw_codes.h"
#include "isp/pipeline/merge/frame_electrons.h"
#include "isp/pipeline/merge/merged_raw.h"

namespace lowlux::isp {

/// Returns the standard deviation of a dark pixel of one frame in fractions of white, the largest of all sites: where
/// only one frame matched, its noise must not be clipped.
double dark_noise(const FrameElectrons& reference, const PerSite<double>& site_white_e);

/// Returns levels of 16-bit codes, or of floating-point samples where rounding to codes would add more than a tenth to
/// the variance of the darkest sites, as in brackets of many EV and in means of many frames.
SampleLevels fine_levels(const SampleLevels& codes, const FrameElectrons& reference,
                         const PerSite<double>& site_white_e, const MergedRaw& merged);

/// Smooths gains that were measured for each pixel (flat frames): after displaced frames were averaged, the pixels of
/// the reference have no response of their own, and what the lens takes away is left. Each gain becomes the mean of
/// those within 16 sites of its own parity.
/// @param height_px  height of the frame; coarser maps stay
void smooth_gain_maps(RawCorrections& corrections, int height_px, Executor& executor);

/// Encodes the mean of a merge as a raw frame, with its noise. The variance of a site is 1 / MosaicMean::weight, times
/// that of one frame for frames of equal exposure. White of a bracket is where its shortest exposure saturates.
/// @param mean       emptied
/// @param reference  the noise and levels of the reference
/// @param saturated  of a bracket: 1 where its shortest exposure is saturated
/// @param frame      the reference as it was read; colour and corrections are moved out of it
/// @param out        alignment, bracket and the use of each frame are read; frame and mean_count are set
void encode_merged(merge::MosaicMean& mean, const FrameElectrons& reference, PlaneView<const float> saturated,
                   RawFrame& frame, MergedRaw& out, Executor& executor);

}  // namespace lowlux::isp
