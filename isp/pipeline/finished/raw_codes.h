#pragma once

#include <array>

#include "isp/base/executor.h"
#include "isp/base/frame.h"
#include "isp/base/plane.h"

namespace lowlux::isp {

/// Holds the levels of a raw frame that is encoded again.
struct SampleLevels {
  bool is_float = false;  // fractions of white: black is 0 and white 1, nothing is rounded or clipped
  double black_dn = 0;
  double range_dn = 1;  // from black to white

  /// Returns the variance that rounding adds, in fractions of white squared: codes are rounded up with the probability
  /// of their fraction f, which adds f (1 - f) DN^2, on average 1/6.
  double rounding_variance() const { return is_float ? 0 : 1 / (6 * range_dn * range_dn); }
};

/// Returns levels of 16-bit codes at which 8 standard deviations of a dark pixel stay positive: black is a multiple of
/// 256 from 1024 on, at most a quarter of the codes; white is 65535.
/// @param dark_noise  standard deviation of a dark pixel, in fractions of white
SampleLevels code_levels(double dark_noise);

/// Returns levels of 16-bit codes for images of three samples: black is as small as negative samples allow, a multiple
/// of 16 from 16 on, and at most that of code_levels. darktable and others do not subtract the black level of such
/// images, and RawTherapee and others do not read floating-point ones.
/// @param min_sample  the smallest sample, in fractions of white
SampleLevels rgb_code_levels(double dark_noise, double min_sample);

/// Returns the smallest sample of an image of interleaved R, G and B, in fractions of white; 0 if none is negative.
double min_sample(const Plane<float>& samples_e, const PerSite<double>& at_white_e);

/// Returns the levels of floating-point samples, DNG's defaults for them.
inline SampleLevels float_levels() { return {.is_float = true}; }

/// Holds a mosaic of the active area that is encoded as a raw frame, or an image of interleaved samples R G B for
/// SensorLayout::linear_rgb, with the figures of R, G and B at sites 0, 1 and 2.
struct SignalToEncode {
  PlaneView<const float> signal_e;
  PlaneView<const float> charge_e;  // charge, of equal size: a pixel is saturated from saturation_e of its colour on
  std::array<double, 3> saturation_e{};  // saturation levels of R, G, B
  PerSite<double> signal_at_white_e{};   // signal of a white pixel
  PerSite<double> charge_at_white_e{};
};

/// Encodes a signal as a raw frame: black + range * signal / signal_at_white_e. Codes are rounded up with the
/// probability of their fraction, so that no mean is biased and smooth shadows do not break into steps; saturated
/// pixels get the code of white. Floating-point samples of saturated pixels are those of their charge, at least 1.
/// @param like  the frame that states layout, phase, crop and how it was taken; its active area is the frame
RawDn encode_signal(const SignalToEncode& signal, const RawDn& like, const SampleLevels& levels, Executor& executor);

}  // namespace lowlux::isp
