#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "isp/base/spectrum.h"

namespace lowlux {

/// Lists how the converter rounds a voltage to a code: to the nearest one, or the one below (thesis Eq. 4.10).
enum class Quantisation : std::uint8_t { round, floor };

/// Gives the variance that rounding to integer codes adds [DN^2].
inline constexpr double quantisation_dn2 = 1.0 / 12;

/// Describes an image sensor at one gain setting, in the terms of EMVA 1288. Arrays of three are for R, G and B. A
/// noise source whose figure is 0 (the default) is absent. Checked by isp::check_sensor.
struct SensorModel {
  std::string name;
  double system_gain_dn_per_e = 1;  // K
  double read_noise_e = 0;          // temporal dark noise without that of dark current
  double full_well_e = 0;           // saturation capacity: the charge at which a pixel is full
  int bits = 12;                    // bits of the converter
  double black_level_dn = 0;        // pedestal: the mean code without charge
  double white_level_dn = 4095;     // largest code the converter gives
  Quantisation quantisation = Quantisation::round;

  /// Mean dark current at dark_temperature_c; the part above the floor follows isp::dark_current_factor.
  std::array<double, 3> dark_current_e_per_s{};
  double dark_temperature_c = 20;
  double dark_doubling_c = 7;     // degrees over which it doubles, unless there is an activation energy
  double dark_activation_ev = 0;  // E_a of an Arrhenius law, which replaces the doubling; 0: none
  double dark_floor_e_per_s = 0;  // part of the current of all channels that is the same at every temperature

  double prnu = 0;                // standard deviation of the pixels' sensitivity, relative to its mean
  double dsnu = 0;                // standard deviation of the pixels' dark current, relative to its mean
  double hot_pixel_fraction = 0;  // fraction of all pixels
  double hot_pixel_current_e_per_s =
      0;  // mean of their extra dark current, exponentially distributed; same temperature law
  /// Random telegraph noise: a trap in the transistor of a pixel moves its signal between two levels.
  double telegraph_fraction = 0;  // fraction of all pixels that have a trap
  double telegraph_e = 0;         // mean distance of the levels, exponentially distributed
  double crosstalk = 0;           // fraction of the light of a pixel that each of its four neighbours collects
  /// Amplifier glow: light of the output amplifier falls on the pixels around it (isp/model/sensor/amplifier_glow.h).
  double glow_e_per_s = 0;                    // at its source, the same at every temperature
  std::array<double, 2> glow_position{1, 1};  // source, in widths and heights from the upper left corner
  double glow_length = 0.1;                   // distance over which it falls by a factor e, in diagonals
  double row_noise_e = 0;                     // standard deviation of an offset drawn for each row of each frame
  double column_noise_e = 0;  // standard deviation of an offset drawn for each column, the same in all frames
};

/// Describes the response of the sensor to light: electrons in one pixel for radiance in front of the camera.
///     mu_k [e-] = exposure_s * etendue_m2_sr * integral of photons(nm) * quantum_efficiency[k](nm)
/// with photons in s-1 m-2 sr-1 nm-1 (isp/model/sensor/photon.h).
struct SpectralResponse {
  std::string name;
  std::array<Spectrum, 3> quantum_efficiency;  // efficiencies of R, G, B [e- per photon]; filters and optics included
  double etendue_m2_sr = 0;                    // pixel area times solid angle
};

}  // namespace lowlux
