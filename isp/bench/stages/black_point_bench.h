#pragma once

#include <cstdint>

#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/sensor.h"

namespace lowlux::isp {

/// A sensor and its dark charge: what dark pixels are like.
struct DarkCase {
  const char* name;
  SensorModel sensor;  // without patterns, but for hot pixels where it has any
  double dark_e = 0;
};

/// Standard deviation of a mean over `pixels` dark pixels [e-]: sqrt((d + sigma_r^2 + 1 / (12 K^2)) / pixels). Hot
/// pixels are not in it.
double black_error_e(const DarkCase& dark, std::int64_t pixels);

/// Masked columns with `pixels_per_site` pixels of each site between the trims of measure_masked_black(), and a few
/// active ones beside them.
/// @param pixels_per_site  a multiple of 20, at least 100
RawDn masked_frame(const DarkCase& dark, std::int64_t pixels_per_site, std::uint64_t seed);

/// Mean code of the sites of that part: of all pixels, whatever they are.
PerSite<double> mean_black_dn(const RawDn& raw);

}  // namespace lowlux::isp
