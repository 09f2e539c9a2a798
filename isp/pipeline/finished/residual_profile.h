#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "isp/base/frame.h"
#include "isp/base/plane.h"
#include "isp/pipeline/noise_reduction.h"
#include "isp/pipeline/render/region.h"

namespace lowlux::isp {

/// Lists what a line is fitted to.
enum class ProfileFit : std::uint8_t {
  mean,   // the mean of variances that scatter: the largest likelihood of gamma variances
  least,  // the smallest variances, by least squares relative to each: the dark sites of a bracket
};

/// Returns the straight line variance = scale x + offset that is nearest, as `fit` states, to the residual noise at
/// each site; x and variances in fractions of white. Scales are at least what electrons_at_white accepts, offsets at
/// least 0.
/// @param signal_e         the clean mosaic
/// @param site_variance_e2 site variance of R, G, B in each 2x2 cell
/// @param light_e          signal of a white pixel
/// @param added            variance of the codes' rounding, in fractions of white squared
NoiseProfile residual_profile(const SignalElectronsView& signal_e, const std::array<Plane<float>, 3>& site_variance_e2,
                              const PerSite<double>& light_e, double added, ProfileFit fit = ProfileFit::mean);

/// Returns the same line for frames that are no mosaics.
/// @param planes  the clean pixels in fractions of white: R, G and B, or the one of a monochrome frame, whose line all
///                three colours of the profile get
/// @param maps    noise maps of their cells, one for each pixel. The variance of a green value is taken as that of its
/// sites, a
///                little too much at most: their difference is left out of their mean. The standard deviation stated
///                for flats is 0.9 to 1.2 times that measured (clean_pixels_test); for monochrome frames 0.9 to 0.95,
///                with Level::best 0.7 to 0.8.
/// @param cell_e  charge of the sites of R, G and B at white: NoiseReduction::cell_e
NoiseProfile residual_profile(std::span<const Plane<float>> planes, const NoiseMaps& maps,
                              const std::array<double, 3>& cell_e, double added);

}  // namespace lowlux::isp
