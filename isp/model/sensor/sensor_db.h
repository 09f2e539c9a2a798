#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/base/sensor.h"

namespace lowlux::isp {

/// Figures a user gives for a sensor, in place of those of the table or where it has none.
struct SensorFigures {
  std::optional<double> system_gain_dn_per_e;
  std::optional<double> read_noise_e;
  std::optional<double> full_well_e;
  std::optional<int> bits;
  std::optional<double> black_level_dn;
  std::optional<double> white_level_dn;
  std::optional<std::array<double, 3>> dark_current_e_per_s;
  std::optional<double> dark_temperature_c;
  std::optional<double> dark_doubling_c;
  std::optional<double> prnu;
  std::optional<double> dsnu;
  std::optional<double> hot_pixel_fraction;
  std::optional<double> hot_pixel_current_e_per_s;
  std::optional<double> row_noise_e;
  std::optional<double> column_noise_e;
  std::optional<double> pixel_pitch_um;
  std::optional<double> peak_quantum_efficiency;
  std::optional<double> iso;
  std::optional<Quantisation> quantisation;
  std::optional<std::string> camera;  // whose spectral sensitivities
};

/// A sensor by name, complete enough to be simulated, and what of it nobody has measured.
struct NamedSensor {
  SensorModel model;
  std::string gain_setting;  // as the source calls it; may be empty
  std::string source;        // of the figures
  std::string camera;        // whose spectral sensitivities stand in, see camera_sensitivity()
  std::optional<double> pixel_pitch_um;
  std::optional<double> peak_quantum_efficiency;
  std::optional<double> iso;             // of the gain setting
  bool iso_given = false;                // by the user: it comes before pitch and efficiency
  std::vector<std::string> assumptions;  // one line each: a figure no source gives, and what was taken instead
  bool black_level_is_sourced = false;   // by the table or the user
};

/// The thesis' camera of Table 4-1: in the table as three rows, one for each channel.
inline constexpr std::string_view thesis_sensor = "thesis";

/// Each name once, "thesis" first.
std::vector<std::string_view> sensor_names();

/// The gain settings of a sensor, as its source calls them.
std::vector<std::string_view> gain_settings(std::string_view name);

/// The options without which a sensor at a gain setting cannot be simulated, none if its sources suffice: what
/// sensor_named() and spectral_response() would ask for. Of an unknown sensor or setting there are none.
std::vector<std::string_view> options_needed(std::string_view name, std::string_view gain);

/// A sensor of data/sensors.csv at a gain setting.
/// @param gain     a gain setting or its number ("ISO 1600", "1600"); empty: the first of the table
/// @param figures  take the place of the table's
/// Errors: an unknown name or setting (near matches or the list are offered); a figure without which no frame can be
/// simulated (gain, read noise, bits) that neither table nor `figures` give, named; a sensor that cannot be.
/// A full well that is not sourced is the charge at the white level; a pedestal that is not sourced is a
/// sixteenth of the range; an effect without figures is one the sensor has not: each of these is an assumption.
Result<NamedSensor> sensor_named(std::string_view name, std::string_view gain, const SensorFigures& figures);

}  // namespace lowlux::isp
