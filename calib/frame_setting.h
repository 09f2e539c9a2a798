#pragma once

#include <array>
#include <optional>
#include <string>

#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Properties that frames must have in common before their results may be combined, and the exposure of each.
struct FrameSetting {
  std::string make;
  std::string model;
  SensorLayout layout = SensorLayout::bayer;
  BayerPhase phase = BayerPhase::rggb;
  int width = 0;  // width of the active area
  int height = 0;
  std::array<double, 3> white_dn{};  // white levels of R, G, B
  std::optional<double> iso;
  std::optional<double> exposure_s;
  std::optional<double> temperature_c;
  friend bool operator==(const FrameSetting&, const FrameSetting&) = default;
};

/// Returns the setting of a frame.
/// Errors: a layout that is not a mosaic, floating-point samples, an active area below 16 x 16 or outside the readout,
/// a white level that is not positive, an exposure time that is negative or NaN.
Result<FrameSetting> setting_of(const RawDn& raw);

/// Largest temperature difference of frames of one setting.
inline constexpr double same_temperature_c = 1;

/// Returns whether two temperatures agree within same_temperature_c, or neither is stated.
bool same_temperature(const std::optional<double>& first_c, const std::optional<double>& second_c);

/// Returns an error unless both are of the same camera, size, mosaic, white level and gain; `what` names the second.
Result<void> check_same_camera(const FrameSetting& first, const FrameSetting& second, const std::string& what);

/// Returns an error unless check_same_camera() passes and both are of the same exposure time.
Result<void> check_same_setting(const FrameSetting& first, const FrameSetting& second, const std::string& what);

/// Returns the mean code of the active area.
double mean_dn(const RawDn& raw);

/// Returns the colour of a site, 0..2 for R, G, B; 1 for a sensor without filters.
int channel_of_site(const FrameSetting& setting, int site);

}  // namespace lowlux::calib
