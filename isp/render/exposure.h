#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace lowlux::isp {

/// Names the rule that decided an automatic exposure.
enum class ExposureRule : std::uint8_t {
  mid_grey,     // the median block is mapped to mid-grey
  night,        // the median block is mapped to a darker grey, because its light is that of a night
  highlights,   // the brightest blocks reach as far into the shoulder as allowed
  black_noise,  // more gain would raise the noise of black too far
  no_gain,      // the frame is bright enough as it is: 0 EV
  max_gain,     // the largest gain allowed
  no_signal,    // no signal above the noise of black: 0 EV
};

/// Returns "mid-grey", "night", "highlights", "black-noise", "no-gain", "most-gain" or "no-signal".
std::string_view name_of(ExposureRule rule);

/// Holds an automatic exposure and the rule that decided it.
struct AutoExposure {
  double ev = 0;  // gain 2^ev on scene-linear values
  ExposureRule rule = ExposureRule::no_signal;
};

/// Holds the options of auto_exposure().
struct AutoExposureOptions {
  double mid_grey = 0.18;             // maximum level that the median may reach
  double highlight = 0.9;             // level that the 99th percentile of the largest channel reaches, before the ...
  double shoulder_ev = 1;             // ... shoulder, plus this, because the shoulder compresses what lies above
  double max_ev = 10;                 // the gain is in 0..max_ev
  double black_noise = 0.02;          // display-linear level that the black noise of one pixel may reach
  double signal_to_scatter = 3;       // minimum ratio of the 99th percentile to the scatter of black blocks
  std::optional<double> white_cd_m2;  // luminance of the scene at 1; absent: the light is not known to be dark
};

/// Returns the level that the median of a scene of this luminance is mapped to: the key of Krawczyk, Myszkowski and
/// Seidel, Perceptual effects in real-time tone mapping (SCCG 2005), equation 11,
///     1.03 - 2 / (2 + log10(L + 1)),
/// but no more than mid_grey: 0.030 in darkness, 0.041 at 0.05 cd/m2, 0.11 at 0.5 cd/m2, mid-grey from 1.3 cd/m2 up.
double level_of_median(double luminance_cd_m2, double mid_grey);

/// Computes the gain for an image from the luminance of its blocks (white balanced, 1 at the white level, negative
/// values allowed):
///     EV = min( log2(level_of_median(median white_cd_m2) / median),
///               log2(highlight / p99 of the largest channel) + shoulder_ev,
///               log2(black_noise / noise_floor) ),     clamped to 0..max_ev
/// A term with a median, p99 or noise_floor that is not positive does not count. So the middle of the image is never
/// brighter than mid-grey, a night stays dark where its luminance is known, small lamps do not keep a night scene dark,
/// saturated colours keep their channels apart, and grain in the black stays dark. If the 99th percentile of luminance
/// is not above signal_to_scatter times the scatter of the negative blocks, the frame is taken to be black (a lens cap)
/// and is not brightened: 0 EV, no_signal. Blocks that are not finite are left out.
/// @param largest      the largest channel of each block as it will be rendered, before exposure
/// @param noise_floor  standard deviation of the black noise of one pixel, same unit; 0 if unknown
AutoExposure auto_exposure(std::span<const float> luminance, std::span<const float> largest, double noise_floor,
                           const AutoExposureOptions& options = {});
/// Computes the gain as auto_exposure() without allocating memory; it leaves the blocks in another order.
AutoExposure auto_exposure_reordering(std::span<float> luminance, std::span<float> largest, double noise_floor,
                                      const AutoExposureOptions& options = {});

}  // namespace lowlux::isp
