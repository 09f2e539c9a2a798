#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace lowlux::isp {

/// Names the rule that decided an automatic exposure.
enum class ExposureRule : std::uint8_t {
  mid_grey,     // the median block is mapped to mid-grey
  highlights,   // the brightest blocks reach as far into the shoulder as allowed
  black_noise,  // more gain would raise the noise of black too far
  no_gain,      // the frame is bright enough as it is: 0 EV
  max_gain,     // the largest gain allowed
  no_signal,    // no signal above the noise of black: 0 EV
};

/// Returns "mid-grey", "highlights", "black-noise", "no-gain", "most-gain" or "no-signal".
std::string_view name_of(ExposureRule rule);

struct AutoExposure {
  double ev = 0;  // gain 2^ev on scene-linear values
  ExposureRule rule = ExposureRule::no_signal;
};

struct AutoExposureOptions {
  double mid_grey = 0.18;        // maximum level that the median may reach
  double highlight = 0.9;        // level that the 99th percentile reaches, before the shoulder ...
  double shoulder_ev = 1;        // ... plus this, because the shoulder compresses what lies above
  double max_ev = 10;            // the gain is in 0..max_ev
  double black_noise = 0.02;     // display-linear level that the black noise of one pixel may reach
  double signal_to_scatter = 3;  // minimum ratio of the 99th percentile to the scatter of black blocks
};

/// Computes the gain for an image from the luminance of its blocks (white balanced, 1 at the white level, negative
/// values allowed):
///     EV = min( log2(mid_grey / median),
///               log2(highlight / p99) + shoulder_ev,
///               log2(black_noise / noise_floor) ),     clamped to 0..max_ev
/// A term with a median, p99 or noise_floor that is not positive does not count. So the middle of the image is never
/// brighter than mid-grey, small lamps do not keep a night scene dark, and grain in the black stays dark. If the 99th
/// percentile is not above signal_to_scatter times the scatter of the negative blocks, the frame is taken to be black
/// (a lens cap) and is not brightened: 0 EV, no_signal. Blocks that are not finite are left out.
/// @param noise_floor  standard deviation of the black noise of one pixel, same unit; 0 if unknown
AutoExposure auto_exposure(std::span<const float> luminance, double noise_floor,
                           const AutoExposureOptions& options = {});
/// Computes the gain as auto_exposure() without allocating memory; it leaves the blocks in another order.
AutoExposure auto_exposure_reordering(std::span<float> luminance, double noise_floor,
                                      const AutoExposureOptions& options = {});

}  // namespace lowlux::isp
