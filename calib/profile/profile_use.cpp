#include "calib/profile/profile_use.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "calib/dark/dark_stack.h"
#include "calib/frame_setting.h"
#include "calib/profile/gain_interpolation.h"
#include "isp/base/camera_profile.h"
#include "isp/base/sensor.h"
#include "isp/model/sensor/masked_noise.h"

namespace lowlux::calib {
namespace {

constexpr const char* monochrome = "monochrome";
constexpr double hot_deviations = 6;
constexpr double same_exposure = 0.01;    // relative
constexpr double telling_charge_e = 0.2;  // smaller dark charge does not change a black point measurably

Result<void> check_camera(const CameraProfile& profile, const FrameInfo& info) {
  if (may_be_same_camera({profile.make, profile.model}, {info.make, info.model})) return {};
  return fail(ErrorCode::invalid_argument,
              fmt::format(R"(the profile is of "{}", the frame of "{}")", camera_name(profile.make, profile.model),
                          camera_name(info.make, info.model)));
}

/// Compares the mosaics. A mode of the sensor or a crop may begin at another site.
Result<void> check_mosaic(const CameraProfile& profile, const RawDn& frame, std::vector<std::string>& warnings) {
  const std::string mosaic = mosaic_of(frame);
  if (profile.mosaic.empty() || profile.mosaic == mosaic) return {};
  if (profile.mosaic == monochrome || mosaic == monochrome) {
    return fail(
        ErrorCode::invalid_argument,
        fmt::format("the profile was measured on a sensor that is {}, but the frame is {}", profile.mosaic, mosaic));
  }
  warnings.push_back(
      fmt::format("the profile was measured on a {} mosaic, but the frame is {}: its values may belong to other sites; "
                  "calibrate in the mode in which the image was taken",
                  profile.mosaic, mosaic));
  return {};
}

int channel_of(const RawDn& frame, int site) {
  return channel_of_site({.layout = frame.layout, .phase = frame.phase}, site);
}

/// Returns the ratio of dark current to that at the profile's temperature.
double temperature_factor(const GainProfile& gain, const FrameInfo& info, double charge_e,
                          std::vector<std::string>& warnings) {
  const SensorModel& sensor = *gain.sensor;
  const bool matters = charge_e > telling_charge_e;
  const bool was_measured = gain.dark_exposure_s.has_value();
  if (!info.temperature_c) {
    if (matters && gain.dark_temperature_c) {
      warnings.push_back(fmt::format("the frame states no temperature: the dark current at {:g} C is used",
                                     sensor.dark_temperature_c));
    }
    return 1;
  }
  if (was_measured && !gain.dark_temperature_c) {
    if (matters) warnings.emplace_back("the profile's darks state no temperature: their dark current is used");
    return 1;
  }
  const double celsius = *info.temperature_c;
  if (matters && gain.dark_temperature_c &&
      (celsius < gain.dark_temperature_c->low - same_temperature_c ||
       celsius > gain.dark_temperature_c->high + same_temperature_c)) {
    warnings.push_back(
        fmt::format("the sensor was at {:g} C, the darks of the profile at {:g} to {:g} C: the dark current is "
                    "extrapolated, doubling every {:.2g} C{}",
                    celsius, gain.dark_temperature_c->low, gain.dark_temperature_c->high, sensor.dark_doubling_c,
                    gain.errors.dark_doubling_c > 0 ? "" : " (assumed, not measured)"));
  }
  return std::exp2((celsius - sensor.dark_temperature_c) / sensor.dark_doubling_c);
}

/// Returns the relative error that the doubling figure adds to a dark current beyond the temperatures of the darks.
/// Within them the currents are measured. The error of the nearest one is correlated with it: the two add up.
double extrapolation_error(const GainProfile& gain, const FrameInfo& info) {
  const SensorModel& sensor = *gain.sensor;
  if (!info.temperature_c) return 0;
  const MeasuredRange measured =
      gain.dark_temperature_c.value_or(MeasuredRange{sensor.dark_temperature_c, sensor.dark_temperature_c});
  const double beyond_c = std::max({measured.low - *info.temperature_c, *info.temperature_c - measured.high, 0.0});
  return std::numbers::ln2 * beyond_c * gain.errors.dark_doubling_c / (sensor.dark_doubling_c * sensor.dark_doubling_c);
}

void warn_of_exposure(const GainProfile& gain, double exposure_s, bool scaled, std::vector<std::string>& warnings) {
  if (!gain.dark_exposure_s) return;
  const auto& [low, high] = *gain.dark_exposure_s;
  if (exposure_s > high * (1 + same_exposure)) {
    warnings.push_back(
        fmt::format("the exposure of {:g} s is longer than those of the darks of the profile, {:g} to {:g} s: the dark "
                    "charge is {}",
                    exposure_s, low, high, scaled ? "extrapolated" : "that of the darks"));
  } else if (!scaled && exposure_s < low * (1 - same_exposure)) {
    warnings.push_back(
        fmt::format("the exposure of {:g} s is shorter than those of the darks of the profile, {:g} s: the dark charge "
                    "of the darks is used",
                    exposure_s, low));
  }
}

/// Computes the dark charge at the frame's exposure and temperature, if the profile separates it from the pedestal.
/// @return the standard errors of the charge
Result<PerSite<double>> find_dark_charge(const GainProfile& gain, const RawDn& frame, ProfileAtFrame& out) {
  SensorModel& sensor = *out.sensor;
  const double fastest = *std::max_element(sensor.dark_current_e_per_s.begin(), sensor.dark_current_e_per_s.end());
  if (fastest == 0) {
    if (!gain.dark_exposure_s) out.warnings.emplace_back("the profile states no dark current");
    return PerSite<double>{};
  }
  if (!frame.info.exposure_s) {
    return fail(ErrorCode::insufficient,
                "the frame does not state its exposure time, which the profile's dark current needs");
  }
  const double time_s = *frame.info.exposure_s;
  const double factor = temperature_factor(gain, frame.info, fastest * time_s, out.warnings);
  if (fastest * factor * time_s > telling_charge_e) warn_of_exposure(gain, time_s, true, out.warnings);
  for (double& current : sensor.dark_current_e_per_s) current *= factor;
  if (frame.info.temperature_c) sensor.dark_temperature_c = *frame.info.temperature_c;
  const double beyond = extrapolation_error(gain, frame.info);
  PerSite<double> errors{};
  for (int site = 0; site < 4; ++site) {
    const int k = channel_of(frame, site);
    out.dark_mean_e[site] = sensor.dark_current_e_per_s[k] * time_s;
    // Codes are subtracted: the system gain's error is in the current, and cancels.
    const double of_gain = gain.errors.system_gain_dn_per_e / gain.sensor->system_gain_dn_per_e;
    const double all = gain.errors.dark_current_e_per_s[k], shared = of_gain * gain.sensor->dark_current_e_per_s[k];
    errors[site] =
        std::sqrt(std::max(0.0, all * all - shared * shared)) * factor * time_s + beyond * out.dark_mean_e[site];
  }
  return errors;
}

void set_black(const GainProfile& gain, const PerSite<double>& dark_error_e, ProfileAtFrame& out) {
  if (!gain.pedestal_dn) return;
  BlackPoint& black = out.black.emplace();
  black.source = BlackPoint::Source::profile;
  const bool knows_dark = gain.dark_exposure_s.has_value() || out.dark_mean_e != PerSite<double>{};
  black.holds = knows_dark || gain.pedestal_holds == BlackPoint::Holds::pedestal_and_dark
                    ? BlackPoint::Holds::pedestal_and_dark
                    : BlackPoint::Holds::pedestal_only;
  const double k = out.sensor ? out.sensor->system_gain_dn_per_e : 0;
  const bool is_apart = gain.pedestal_holds == BlackPoint::Holds::pedestal_only;
  if (is_apart) out.pedestal_dn.emplace();
  for (int site = 0; site < 4; ++site) {
    const Estimate& pedestal = (*gain.pedestal_dn)[site];
    if (is_apart) (*out.pedestal_dn)[site] = pedestal.value;
    black.pedestal_dn[site] = pedestal.value + k * out.dark_mean_e[site];
    black.pedestal_standard_error_dn[site] = std::hypot(pedestal.standard_error, k * dark_error_e[site]);
  }
}

double dark_variance_dn2(const SensorModel& s, double dark_mean_e) {
  const double k = s.system_gain_dn_per_e;
  return k * k * (s.read_noise_e * s.read_noise_e + dark_mean_e) + quantisation_dn2;
}

/// Returns the black level that is subtracted, dark charge included.
double black_of(const RawDn& frame, int site, const ProfileAtFrame& out) {
  if (out.black) return out.black->pedestal_dn[site];
  const double pedestal = frame.black_tag ? frame.black_tag->at(site & 1, site >> 1) : out.sensor->black_level_dn;
  return pedestal + out.sensor->system_gain_dn_per_e * out.dark_mean_e[site];
}

/// Returns the noise of sites as that of the channels; nullopt if black is not below white. A sensor without filters
/// has one value for the three channels.
std::optional<NoiseProfile> by_channel(const RawDn& frame, double gain_dn_per_e, const PerSite<double>& black_dn,
                                       const PerSite<double>& variance_dn2) {
  NoiseProfile sum;
  std::array<double, 3> sites{};
  for (int site = 0; site < 4; ++site) {
    const int k = channel_of(frame, site);
    const double range_dn = frame.white_dn[k] - black_dn[site];
    if (!(range_dn > 0)) return std::nullopt;  // choose_black rejects such a frame
    sum.scale[k] += gain_dn_per_e / range_dn;
    sum.offset[k] += variance_dn2[site] / (range_dn * range_dn);
    ++sites[k];
  }
  NoiseProfile out;
  for (int k = 0; k < 3; ++k) {
    const int own = sites[k] > 0 ? k : 1;
    out.scale[k] = sum.scale[own] / sites[own];
    out.offset[k] = sum.offset[own] / sites[own];
  }
  return out;
}

/// Adds the noise above the profile's black point, or above that of the frame where the profile has none.
void add_noise(const RawDn& frame, ProfileAtFrame& out) {
  PerSite<double> black_dn{}, variance_dn2{};
  for (int site = 0; site < 4; ++site) {
    black_dn[site] = black_of(frame, site, out);
    variance_dn2[site] = dark_variance_dn2(*out.sensor, out.dark_mean_e[site]);
    if (out.black) out.black->noise_std_dn[site] = std::sqrt(variance_dn2[site]);
  }
  out.noise = by_channel(frame, out.sensor->system_gain_dn_per_e, black_dn, variance_dn2);
}

/// Lists the hot pixels. Excess currents are those at the profile's temperature, as the dark current is.
void list_hot_pixels(const GainProfile& gain, const RawDn& frame, ProfileAtFrame& out) {
  const double time_s = frame.info.exposure_s.value_or(0);
  const double reference = gain.sensor->dark_current_e_per_s[1], now = out.sensor->dark_current_e_per_s[1];
  const double factor = reference > 0 ? now / reference : 1;
  for (const HotPixelFigure& hot : gain.hot_pixels) {
    if (hot.x >= frame.active.width || hot.y >= frame.active.height) continue;
    const double noise_dn = std::sqrt(dark_variance_dn2(*out.sensor, out.dark_mean_e[site_of(hot.x, hot.y)]));
    const double excess_dn = hot.excess_e_per_s * factor * time_s * out.sensor->system_gain_dn_per_e;
    if (excess_dn > hot_deviations * noise_dn) out.hot_pixels.push_back({hot.x, hot.y, 1, 1});
  }
}

}  // namespace

std::optional<NoiseProfile> noise_above(const BlackPoint& black, const ProfileAtFrame& found, const RawDn& frame) {
  if (!found.sensor) return std::nullopt;
  PerSite<double> variance_dn2{};
  const bool has_masked = black.source == BlackPoint::Source::masked_pixels;
  const bool has_dark_frame = black.source == BlackPoint::Source::dark_frame && found.pedestal_dn &&
                              black.holds == BlackPoint::Holds::pedestal_and_dark;
  for (int site = 0; site < 4; ++site) {
    variance_dn2[site] = dark_variance_dn2(*found.sensor, found.dark_mean_e[site]);
    if (!has_masked && !has_dark_frame) continue;
    const auto measured = isp::masked_variance_dn2(
        {.gain_dn_per_e = found.sensor->system_gain_dn_per_e,
         .read_variance_dn2 = dark_variance_dn2(*found.sensor, 0),
         .level_dn = black.pedestal_dn[site],
         .pedestal_dn = found.pedestal_dn ? std::optional((*found.pedestal_dn)[site]) : std::nullopt,
         .std_dn = has_masked ? black.noise_std_dn[site] : 0});
    variance_dn2[site] = measured.value_or(variance_dn2[site]);
  }
  return by_channel(frame, found.sensor->system_gain_dn_per_e, black.pedestal_dn, variance_dn2);
}

std::string mosaic_of(const RawDn& frame) {
  if (frame.layout == SensorLayout::linear_rgb) return "";
  if (frame.layout == SensorLayout::monochrome) return monochrome;
  constexpr std::array phases{"RGGB", "GRBG", "GBRG", "BGGR"};
  return phases[static_cast<std::size_t>(frame.phase)];
}

std::vector<ColourCalibration> calibrations_of(const CameraProfile& profile) {
  std::vector<ColourCalibration> out;
  out.reserve(profile.colours.size());
  for (const ColourProfile& c : profile.colours) out.push_back(c.calibration);
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.cct_k < b.cct_k; });
  if (out.size() > 2) out = {out.front(), out.back()};
  return out;
}

Result<ProfileAtFrame> profile_at(const CameraProfile& profile, const RawDn& frame, const std::string& gain_setting) {
  if (frame.layout == SensorLayout::linear_rgb) {
    return fail(ErrorCode::unsupported,
                frame.from_x_trans ? "profiles describe the 2 x 2 sites of a Bayer mosaic, which X-Trans does not have"
                                   : "the frame is already demosaiced: a profile describes the mosaic");
  }
  if (const auto same = check_camera(profile, frame.info); !same) return tl::make_unexpected(same.error());
  ProfileAtFrame out;
  if (const auto fits = check_mosaic(profile, frame, out.warnings); !fits) return tl::make_unexpected(fits.error());
  if (profile.gains.empty()) return out;
  if (frame.is_float()) {
    out.warnings.emplace_back(
        "the frame has floating-point samples: the profile's black level, noise and hot pixels apply to integer codes "
        "and are not used");
    return out;
  }
  auto found = gain_setting.empty() ? gain_at_iso(profile, frame.info.iso) : gain_named(profile, gain_setting);
  if (!found) return tl::make_unexpected(found.error());
  const GainProfile& gain = found->gain;
  if (!found->warning.empty()) out.warnings.push_back(found->warning);
  out.sensor = gain.sensor;
  out.iso = gain.iso;
  PerSite<double> dark_error_e{};
  if (gain.pedestal_holds == BlackPoint::Holds::pedestal_and_dark) {
    if (frame.info.exposure_s) warn_of_exposure(gain, *frame.info.exposure_s, false, out.warnings);
  } else if (gain.sensor) {
    const auto errors = find_dark_charge(gain, frame, out);
    if (!errors) return tl::make_unexpected(errors.error());
    dark_error_e = *errors;
  }
  set_black(gain, dark_error_e, out);
  if (!out.sensor) return out;
  add_noise(frame, out);
  list_hot_pixels(gain, frame, out);
  return out;
}

}  // namespace lowlux::calib
