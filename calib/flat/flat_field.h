#pragma once

#include <optional>

#include "calib/dark/dark_stack.h"
#include "calib/dark/master_dark.h"
#include "calib/frame_setting.h"
#include "isp/base/cfa.h"
#include "isp/base/correction.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Black level and noise of flat frames.
struct FlatLevels {
  PerSite<double> black_dn{};
  std::optional<DarkNoiseModel> noise;  // noise of one frame; used if there is only one, whose noise cannot be measured
};

/// Flat field of a sensor behind a lens: the gains that divide out vignetting and photo response non-uniformity.
struct FlatField {
  GainMap gain;          // one gain for each pixel of the active area, 1 at the centre in the mean of each site; its
                         // noise is that of the flats
  FrameSetting setting;  // setting of the flats
  std::optional<double> f_number;  // f-number of the first flat
  int frames = 0;
  double max_gain = 1;        // largest gain of local means, which is the vignetting at the darkest place
  double prnu = 0;            // standard deviation of the pixels' response relative to their neighbours, noise removed
  double noise = 0;           // standard deviation that the gains add, relative to the signal
  double pixel_fraction = 1;  // fraction of each pixel's deviation from its neighbours that is divided out
};

/// Computes the flat field of the mean S of flat frames, black subtracted. For each site
///     gain = S_centre / (L (1 + w d)),  d = S / L - 1,  w = P / (P + N)        (Wiener)
/// The relative variance of a gain is F N, with F = w^2 (1 - 1 / 81) + 1 / 81 for the 81 neighbours of L, and
/// N = (R + K L) / (n L^2) for n flats of the read variance R and the gain K.
/// L is the mean of S over 9 x 9 neighbours of the site, fewer at the borders; S_centre that of the middle quarter of
/// width and height; P the variance of d without noise, N the variance of the noise in d. Noise follows from the
/// frames, or for a single frame from its noise model; without one w is 0. Deviations beyond five standard deviations,
/// for example dust, are divided out in full, except where a pixel has less than a quarter or more than four times the
/// response of its neighbours: that is a defect.
/// @param flats  flats of DarkStack
/// Errors: more than 0.1 % of the pixels above 95 % of the range from black to white; a centre below 5 % of it; local
/// means below a fiftieth of the centre; deviations of neighbours that no flat has, above 10 %.
Result<FlatField> make_flat_field(const DarkGroup& flats, const FlatLevels& levels);

}  // namespace lowlux::calib
