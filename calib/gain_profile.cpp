#include "calib/gain_profile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

double smallest_white(const FrameSetting& setting) {
  return *std::min_element(setting.white_dn.begin(), setting.white_dn.end());
}

constexpr double dithered_deviation_dn = 0.5;  // noise below it is lost in the codes
constexpr const char* dark_series_note = "dark series";
constexpr const char* black_level_note = "black level";

double mean_of(const PerSite<double>& v) { return (v[0] + v[1] + v[2] + v[3]) / 4; }

PerSite<double> values_of(const PerSite<Estimate>& estimates) {
  PerSite<double> out{};
  for (int site = 0; site < 4; ++site) out[site] = estimates[site].value;
  return out;
}

/// Takes the place of an older entry about the same figures.
void note(Provenance provenance, GainProfile& out) {
  std::erase_if(out.provenance, [&](const Provenance& p) { return p.figures == provenance.figures; });
  out.provenance.push_back(std::move(provenance));
}

Provenance measured_figures(const std::string& figures, const Measured& m, double chi_square, int freedom) {
  return {Provenance::Kind::measured, figures, m.source, m.date, m.files, chi_square, freedom};
}

Provenance assumed(const std::string& figures, const std::string& what, const Measured& m) {
  return {Provenance::Kind::quoted, figures, what, m.date, {}, 0, 0};
}

/// Electrons that were counted with another system gain, counted anew: the codes they were read from stay.
void recount(double ratio, GainProfile& out) {
  SensorModel& s = *out.sensor;
  SensorErrors& e = out.errors;
  for (double* figure : {&s.read_noise_e, &s.full_well_e, &s.row_noise_e, &s.column_noise_e,
                         &s.hot_pixel_current_e_per_s, &e.read_noise_e, &e.full_well_e}) {
    *figure *= ratio;
  }
  for (int k = 0; k < 3; ++k) {
    s.dark_current_e_per_s[k] *= ratio;
    e.dark_current_e_per_s[k] *= ratio;
  }
  for (HotPixelFigure& hot : out.hot_pixels) hot.excess_e_per_s *= ratio;
}

/// A sensor of this gain, with what any frame tells of it.
SensorModel& begin_sensor(const FrameSetting& setting, const Estimate& gain, double black_dn, const Measured& measured,
                          GainProfile& out) {
  const bool is_new = !out.sensor;
  if (is_new) {
    out.sensor.emplace();
    out.sensor->name = setting.model;
  } else {
    recount(out.sensor->system_gain_dn_per_e / gain.value, out);
  }
  SensorModel& s = *out.sensor;
  s.system_gain_dn_per_e = gain.value;
  out.errors.system_gain_dn_per_e = gain.standard_error;
  s.white_level_dn = smallest_white(setting);
  s.black_level_dn = black_dn;
  s.bits = std::max(1, static_cast<int>(std::bit_width(static_cast<unsigned>(s.white_level_dn))));
  if (is_new) {
    s.full_well_e = (s.white_level_dn - black_dn) / gain.value;
    note(assumed("full well", "taken as the charge at the white level", measured), out);
  }
  return s;
}

bool has_note(const GainProfile& gain, const char* figures) {
  return std::any_of(gain.provenance.begin(), gain.provenance.end(),
                     [&](const Provenance& p) { return p.figures == figures; });
}

/// Whether the pedestal comes from dark pixels, and so is better than what flats or a picture say in passing.
bool pedestal_is_measured(const GainProfile& gain) {
  return gain.pedestal_dn && (has_note(gain, dark_series_note) || has_note(gain, black_level_note));
}

double pixel_noise(double with_rows_e, double rows_e) {
  return std::sqrt(std::max(0.0, with_rows_e * with_rows_e - rows_e * rows_e));
}

MeasuredRange range_of(std::span<const double> values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {*low, *high};
}

void put_ranges(std::span<const FrameSetting> settings, GainProfile& out) {
  std::vector<double> times, temperatures;
  for (const FrameSetting& s : settings) {
    if (s.exposure_s) times.push_back(*s.exposure_s);
    if (s.temperature_c) temperatures.push_back(*s.temperature_c);
  }
  out.dark_exposure_s.reset();
  out.dark_temperature_c.reset();
  if (!times.empty()) out.dark_exposure_s = range_of(times);
  if (!temperatures.empty()) out.dark_temperature_c = range_of(temperatures);
}

void put_current(const DarkSeries& series, GainProfile& out) {
  SensorModel& sensor = *out.sensor;
  std::array<Estimate, 3> current{};
  if (series.law) {
    sensor.dark_temperature_c = series.law->temperature_c;
    sensor.dark_doubling_c = series.law->doubling_c.value;
    out.errors.dark_doubling_c = series.law->doubling_c.standard_error;
    current = series.law->current_e_per_s;
  } else {
    sensor.dark_temperature_c = series.currents.back().temperature_c.value_or(20);
    current = series.currents.back().current_e_per_s;
  }
  for (int k = 0; k < 3; ++k) {
    sensor.dark_current_e_per_s[k] = std::max(0.0, current[k].value);
    out.errors.dark_current_e_per_s[k] = current[k].standard_error;
  }
}

void put_hot_pixels(const DarkSeries& series, const FrameSetting& setting, GainProfile& out) {
  SensorModel& sensor = *out.sensor;
  double sum = 0;
  out.hot_pixels.clear();
  out.hot_pixels.reserve(series.hot.size());
  const double hot_c = series.hot_temperature_c.value_or(sensor.dark_temperature_c);
  const double factor = std::exp2((sensor.dark_temperature_c - hot_c) / sensor.dark_doubling_c);
  for (const HotPixel& hot : series.hot) {
    out.hot_pixels.push_back({hot.x, hot.y, factor * hot.excess_e_per_s});
    sum += out.hot_pixels.back().excess_e_per_s;
  }
  const auto count = static_cast<double>(series.hot.size());
  sensor.hot_pixel_fraction = count / (static_cast<double>(setting.width) * setting.height);
  sensor.hot_pixel_current_e_per_s = count > 0 ? sum / count : 0;
}

}  // namespace

std::string gain_setting_of(const FrameSetting& setting) {
  return setting.iso ? fmt::format("ISO {:g}", *setting.iso) : "";
}

GainProfile& gain_at(CameraProfile& profile, const FrameSetting& setting) {
  const auto found = std::find_if(profile.gains.begin(), profile.gains.end(),
                                  [&](const GainProfile& g) { return g.iso == setting.iso; });
  if (found != profile.gains.end()) return *found;
  GainProfile& added = profile.gains.emplace_back();
  added.iso = setting.iso;
  added.gain_setting = gain_setting_of(setting);
  return added;
}

void put_photon_transfer(const PhotonTransfer& transfer, const FrameSetting& darks, const Measured& measured,
                         GainProfile& out) {
  const bool keeps_pedestal = pedestal_is_measured(out);
  const double black = mean_of(keeps_pedestal ? values_of(*out.pedestal_dn) : transfer.black_dn);
  SensorModel& sensor = begin_sensor(darks, transfer.system_gain_dn_per_e, black, measured, out);
  if (transfer.read_noise_e) {
    sensor.read_noise_e = pixel_noise(transfer.read_noise_e->value, transfer.row_noise_e);
    out.errors.read_noise_e = transfer.read_noise_e->standard_error;
  } else {
    sensor.read_noise_e = dithered_deviation_dn / sensor.system_gain_dn_per_e;
    out.errors.read_noise_e = 0;
    note(assumed("read noise", "the darks scatter by less than half a code: at most this", measured), out);
  }
  sensor.row_noise_e = transfer.row_noise_e;
  sensor.prnu = transfer.prnu.value;
  out.errors.prnu = transfer.prnu.standard_error;
  if (transfer.saturation) {
    sensor.full_well_e = transfer.saturation->charge_e.value;
    out.errors.full_well_e = transfer.saturation->charge_e.standard_error;
    note(measured_figures("full well", measured, 0, 0), out);
  }
  if (!keeps_pedestal) {
    out.pedestal_dn.emplace();
    for (int site = 0; site < 4; ++site) {
      (*out.pedestal_dn)[site] = {transfer.black_dn[site], transfer.black_standard_error_dn[site]};
    }
    out.pedestal_holds = BlackPoint::Holds::pedestal_and_dark;
    put_ranges({&darks, 1}, out);
  }
  note(measured_figures("photon transfer", measured, transfer.reduced_chi_square, transfer.degrees_of_freedom), out);
}

void put_dark_series(const DarkSeries& series, std::span<const DarkGroup> groups, const Estimate& gain,
                     const Measured& measured, GainProfile& out) {
  const FrameSetting& setting = groups.front().setting;
  const double black = mean_of(values_of(series.pedestal_dn));
  const bool had_read_noise = out.sensor && out.sensor->read_noise_e > 0;
  SensorModel& sensor = begin_sensor(setting, gain, black, measured, out);
  if (!had_read_noise && series.read_noise_e) {
    sensor.read_noise_e = series.read_noise_e->value;
    out.errors.read_noise_e = series.read_noise_e->standard_error;
  }
  put_current(series, out);
  sensor.row_noise_e = series.row_noise_e;
  sensor.column_noise_e = series.column_noise_e;
  sensor.dsnu = std::min(1.0, series.dsnu.value);
  out.errors.dsnu = series.dsnu.standard_error;
  out.pedestal_dn = series.pedestal_dn;
  out.pedestal_holds = BlackPoint::Holds::pedestal_only;
  out.dark_chromaticity = series.chromaticity;
  std::vector<FrameSetting> settings;
  settings.reserve(groups.size());
  for (const DarkGroup& g : groups) settings.push_back(g.setting);
  put_ranges(settings, out);
  put_hot_pixels(series, setting, out);
  note(measured_figures(dark_series_note, measured, series.reduced_chi_square, series.degrees_of_freedom), out);
}

void put_black(const BlackFigures& black, const FrameSetting& setting, const Measured& measured, GainProfile& out) {
  out.pedestal_dn = black.level_dn;
  out.pedestal_holds = BlackPoint::Holds::pedestal_and_dark;
  put_ranges({&setting, 1}, out);
  if (out.sensor) out.sensor->black_level_dn = mean_of(values_of(black.level_dn));
  note(measured_figures(black_level_note, measured, 0, 0), out);
}

void put_picture_noise(const PictureNoise& noise, const BlackPoint& black, const FrameSetting& setting,
                       const Measured& measured, GainProfile& out) {
  const bool keeps_pedestal = pedestal_is_measured(out);
  const Estimate& gain = noise.gain_dn_per_e;
  const double level = mean_of(keeps_pedestal ? values_of(*out.pedestal_dn) : black.pedestal_dn);
  SensorModel& sensor = begin_sensor(setting, gain, level, measured, out);
  const double step = noise.traces.code_step_dn;
  const double without_codes_dn2 = std::max(0.0, noise.offset_dn2.value - step * step / 12);
  sensor.read_noise_e = std::sqrt(without_codes_dn2) / gain.value;
  const double smallest = std::max(sensor.read_noise_e, std::sqrt(noise.offset_dn2.standard_error) / gain.value);
  out.errors.read_noise_e =
      smallest > 0 ? noise.offset_dn2.standard_error / (2 * smallest * gain.value * gain.value) : 0;
  note(measured_figures("noise of one picture", measured, noise.reduced_chi_square, noise.degrees_of_freedom), out);
  if (keeps_pedestal) return;
  out.pedestal_dn.emplace();
  for (int site = 0; site < 4; ++site) {
    (*out.pedestal_dn)[site] = {black.pedestal_dn[site], black.pedestal_standard_error_dn[site]};
  }
  out.pedestal_holds = black.holds;
  out.dark_exposure_s.reset();
  out.dark_temperature_c.reset();
  if (black.source == BlackPoint::Source::masked_pixels) put_ranges({&setting, 1}, out);
}

}  // namespace lowlux::calib
