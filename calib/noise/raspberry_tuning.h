#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/noise/noise_figures.h"
#include "isp/base/camera_profile.h"
#include "isp/base/result.h"

/// Reads the tuning files of libcamera's Raspberry Pi pipelines (BSD-2-Clause), and holds the noise that they state of
/// the sensors of Raspberry Pi cameras.
namespace lowlux::calib {

inline constexpr std::size_t max_tuning_bytes = std::size_t{8} << 20;

/// Holds the entries of a tuning file that describe noise. Values are 16-bit codes, whatever the sensor's bits:
///     standard deviation = sqrt(gain) (constant + slope sqrt(value))        [ctt_noise.py of libcamera's tuning tool]
/// with value above black, and gain the analogue gain (controller/rpi/noise.cpp).
struct RaspberryTuning {
  double reference_constant = 0;
  double reference_slope = 0;
  double black_level = 0;
  std::string target;  // "bcm2835" or "pisp"; empty in files of the first version
};

/// Parses a tuning file of either version. Errors: those of read_json; no rpi.noise, or one whose slope is not above 0
/// and below 100 or whose constant is not within 0 to 1000; a black level that is missing or not below half of the
/// range.
Result<RaspberryTuning> parse_raspberry_tuning(std::string_view json);

/// Describes the sensor of a tuning file, which states neither.
struct TunedSensor {
  std::string name;
  int bits = 0;          // bits of the sensor's codes, 8 to 16
  double max_gain = 16;  // largest analogue gain, above 1
  std::string source;    // file and version
};

/// Returns the uncertainty of the gain that follows from a slope, as a factor. Slopes include the unevenness of the
/// chart and the read noise. Those of "pisp" are about sqrt 2 times those of "bcm2835" for ten of the eighteen sensors
/// that have both in libcamera v0.7.1, and equal for six: which holds for a file is not known.
double tuning_gain_factor(const RaspberryTuning& tuning);

/// Returns the system gain at analogue gain 1 [DN/e-, of a sensor of `bits`]: slope^2 2^(bits - 16), since the photons
/// give variance = K value; for "pisp" that is divided by sqrt 2, the middle between the two conventions.
double tuning_gain_dn_per_e(const RaspberryTuning& tuning, int bits);

/// Returns a profile with the settings "analogue gain 1", ISO 100, and the largest analogue gain. Full well and
/// pedestal follow from the black level. Where the constant is 0, the tuning file does not state the read noise: it is
/// that of the class of the sensor, at most, and a provenance entry states this. Standard errors include the
/// uncertainty. Errors: bits outside 8 to 16, a gain of at most 1; figures that no sensor has (isp::check_sensor).
Result<CameraProfile> profile_of_tuning(const RaspberryTuning& tuning, const TunedSensor& sensor);

/// Returns the bits and the largest analogue gain of a sensor by the name of its tuning file: "imx477_noir.json" is an
/// imx477. `source` is empty. nullopt for sensors that are not known.
std::optional<TunedSensor> tuned_sensor(std::string_view file_name);

/// Returns the profile of a sensor by its name, "imx477", with the figures of its tuning file (profile_of_tuning).
/// nullopt for sensors that are not known.
std::optional<CameraProfile> raspberry_profile(std::string_view sensor);

/// Returns the names of the sensors that raspberry_profile knows.
std::vector<std::string> raspberry_sensors();

/// Holds what the tuning files state of a frame's sensor.
struct RaspberryMatch {
  NoiseFigures figures;
  std::string sensor;
  double analogue_gain = 1;
};

/// Returns the noise of a frame of a Raspberry Pi camera at an ISO speed, which these cameras state as 100 times the
/// analogue gain. The make has to contain "raspberry", and the model the name of a sensor, as "/base/soc/.../imx477@1a"
/// does; case is ignored. Figures are those of bcm2835 (src/ipa/rpi/vc4/data, libcamera v0.7.1, BSD-2-Clause), whose
/// convention is known; the read noise is that of the sensor's class (sensor_class.h).
/// @param range_dn  white less black of the frame, in codes of any number of bits
/// @return nullopt: no such sensor, or an ISO that is not within 50 to 6400
std::optional<RaspberryMatch> find_raspberry_noise(std::string_view make, std::string_view model, double iso,
                                                   double range_dn);

}  // namespace lowlux::calib
