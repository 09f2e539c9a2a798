#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "calib/noise/noise_figures.h"
#include "calib/noise/raspberry_tuning.h"
#include "isp/base/camera_profile.h"

/// Holds the noise that libcamera's tuning files state of the sensors of Raspberry Pi cameras.
namespace lowlux::calib {

/// Returns the bits and the largest analogue gain of a sensor by the name of its tuning file: "imx477_noir.json" is an
/// imx477. `source` is empty. nullopt for sensors that are not known.
std::optional<TunedSensor> tuned_sensor(std::string_view file_name);

/// Returns the profile of a sensor by its name, "imx477", with the figures of its tuning file (profile_of_tuning).
/// nullopt for sensors that are not known.
std::optional<CameraProfile> raspberry_profile(std::string_view sensor);

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
