#pragma once

#include <string>

#include "calib/noise/noise_figures.h"
#include "isp/base/frame.h"

namespace lowlux::calib {

/// Coefficients of the prior, with their scatter between cameras as factors. Sources: calib/README.md.
inline constexpr double large_sensor_e = 40'000;  // at white at ISO 100: interchangeable-lens cameras
inline constexpr double large_sensor_factor = 1.8;
inline constexpr double small_sensor_e = 5'000;  // phones, compact cameras, camera modules
inline constexpr double small_sensor_factor = 1.8;
inline constexpr double gain_range = 16;   // an ISO that is not stated is 100 to 1600, equal in its logarithm
inline constexpr double read_floor_e = 3;  // read noise = sqrt(floor^2 + (fraction * electrons at white)^2)
inline constexpr double read_fraction = 1.5e-4;
inline constexpr double read_noise_factor = 2.1;

/// Names the class that a frame's metadata place its sensor in.
enum class SensorClass { large, small };

/// Holds the noise expected of a sensor by its class.
struct ClassNoise {
  SensorClass kind = SensorClass::large;
  NoiseFigures figures;
};

/// Returns the read noise that cameras with so many electrons at white have in the median.
double class_read_noise_e(double electrons_at_white);

/// Returns the noise expected of a frame. Electrons at white are those of its class, small where the focal length is
/// below 9 mm or the codes have 10 bits or fewer, else large; times 100 / ISO, at most twice those of ISO 100. Where
/// the ISO is not stated, the middle of gain_range.
/// @param range_dn  white less black, above 0
ClassNoise class_noise(const RawDn& raw, double range_dn);

/// Returns the class in words: "large sensor at ISO 1600".
std::string text_of(const ClassNoise& noise, const FrameInfo& info);

}  // namespace lowlux::calib
