#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isp/base/result.h"
#include "isp/base/sensor.h"

namespace lowlux::isp {

/// Holds the figures a user gives for a sensor, which replace or complete those of the table.
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
  std::optional<double> dark_activation_ev;
  std::optional<double> dark_floor_e_per_s;
  std::optional<double> prnu;
  std::optional<double> dsnu;
  std::optional<double> hot_pixel_fraction;
  std::optional<double> hot_pixel_current_e_per_s;
  std::optional<double> telegraph_fraction;
  std::optional<double> telegraph_e;
  std::optional<double> crosstalk;
  std::optional<double> glow_e_per_s;
  std::optional<std::array<double, 2>> glow_position;
  std::optional<double> glow_length;
  std::optional<double> row_noise_e;
  std::optional<double> column_noise_e;
  std::optional<double> pixel_pitch_um;
  std::optional<double> peak_quantum_efficiency;
  std::optional<double> iso;
  std::optional<Quantisation> quantisation;
  std::optional<std::string> camera;  // camera whose spectral sensitivities are used
};

/// Describes a sensor by name, complete enough to be simulated, with the figures that had to be assumed.
struct NamedSensor {
  SensorModel model;
  std::string gain_setting;  // name that the source uses; may be empty
  std::string source;        // source of the figures
  std::string camera;        // camera whose spectral sensitivities are used, see camera_sensitivity()
  std::optional<double> pixel_pitch_um;
  std::optional<double> peak_quantum_efficiency;
  std::optional<double> iso;  // speed of the gain setting
  bool iso_given = false;     // by the user: it takes precedence over pitch and efficiency
  /// Electronics of the table alone, of which a speed of the table holds; nullopt: those of `model`. Figures that a
  /// user gives in their place change the charge that saturates the sensor, not the electrons that light causes.
  std::optional<SensorModel> published;
  std::vector<std::string> assumptions;  // one line each: a figure no source gives, and the value used instead
  bool black_level_is_sourced = false;   // by the table or the user
};

/// Names the thesis' camera of Table 4-1: in the table as three rows, one for each channel.
inline constexpr std::string_view thesis_sensor = "thesis";

/// Returns each name once, "thesis" first.
std::vector<std::string_view> sensor_names();

/// Returns the gain settings of a sensor, as its source names them.
std::vector<std::string_view> gain_settings(std::string_view name);

/// Returns the camera of camera_sensitivity() that is the camera of a sensor; empty if its sensitivities are unknown
/// and those of another camera replace them.
std::string_view own_camera(std::string_view sensor);

/// Returns the options without which a sensor at a gain setting cannot be simulated, none if its sources suffice: those
/// that sensor_named() and spectral_response() would require. Empty for an unknown sensor or setting.
std::vector<std::string_view> options_needed(std::string_view name, std::string_view gain);

/// Returns a sensor of data/sensors.csv at a gain setting.
/// @param gain     a gain setting or its number ("ISO 1600", "1600"); empty: the first of the table
/// @param figures  replace those of the table
/// Errors: an unknown name or setting (near matches or the list are offered); a figure required for simulation (gain,
/// read noise, bits) that neither table nor `figures` give, named; an impossible sensor. A full well that is not
/// sourced is the charge at the white level; a pedestal that is not sourced is a sixteenth of the range; an effect
/// without figures is treated as absent: each of these is an assumption.
Result<NamedSensor> sensor_named(std::string_view name, std::string_view gain, const SensorFigures& figures);

}  // namespace lowlux::isp
