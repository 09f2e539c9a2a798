#pragma once

#include <cstdint>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/sensor.h"

namespace lowlux::isp {

/// A sensor and its dark charge, which define the dark pixels.
struct DarkCase {
  const char* name;
  SensorModel sensor;  // without patterns, except hot pixels in the case that has them
  double dark_e = 0;
};

/// Returns the standard deviation of a mean over `pixels` dark pixels [e-]: sqrt((d + sigma_r^2 + 1 / (12 K^2)) /
/// pixels). Hot pixels are not included.
double black_error_e(const DarkCase& dark, std::int64_t pixels);

/// Returns a frame of masked columns with `pixels_per_site` pixels of each site between the trims of
/// measure_masked_black(), and a few active columns next to them.
/// @param pixels_per_site  a multiple of 20, at least 100
RawDn masked_frame(const DarkCase& dark, std::int64_t pixels_per_site, std::uint64_t seed);

/// Returns the mean code of each site over all pixels of the measured columns, without rejection.
PerSite<double> mean_black_dn(const RawDn& raw);

}  // namespace lowlux::isp
