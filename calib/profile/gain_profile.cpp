#include "calib/profile/gain_profile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/dark/dark_image.h"
#include "isp/model/sensor/masked_noise.h"

namespace lowlux::calib {
namespace {

double smallest_white(const FrameSetting& setting) {
  return *std::min_element(setting.white_dn.begin(), setting.white_dn.end());
}

constexpr double dithered_deviation_dn = 0.5;  // smaller noise is not measurable in the codes
constexpr const char* dark_series_note = "dark series";
constexpr const char* black_level_note = "black level";

PerSite<double> values_of(const PerSite<Estimate>& estimates) {
  PerSite<double> out{};
  for (int site = 0; site < 4; ++site) out[site] = estimates[site].value;
  return out;
}

/// Adds an entry, which replaces an older one about the same figures.
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

/// Converts values in electrons from another system gain: the codes they were measured in stay.
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

/// Returns a sensor of this gain, with the properties that any frame states.
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
    out.errors.full_well_e = s.full_well_e * gain.standard_error / gain.value;
    note(assumed("full well", "taken as the charge at the white level", measured), out);
  }
  return s;
}

bool has_note(const GainProfile& gain, const char* figures) {
  return std::any_of(gain.provenance.begin(), gain.provenance.end(),
                     [&](const Provenance& p) { return p.figures == figures; });
}

/// Returns whether the pedestal comes from dark pixels: then it is better than an estimate from flats or an image.
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
  const double black = mean_of_sites(keeps_pedestal ? values_of(*out.pedestal_dn) : transfer.black_dn);
  SensorModel& sensor = begin_sensor(darks, transfer.system_gain_dn_per_e, black, measured, out);
  if (transfer.read_noise_e) {
    sensor.read_noise_e = pixel_noise(transfer.read_noise_e->value, transfer.row_noise_e);
    out.errors.read_noise_e = transfer.read_noise_e->standard_error;
  } else {
    sensor.read_noise_e = dithered_deviation_dn / sensor.system_gain_dn_per_e;
    out.errors.read_noise_e = sensor.read_noise_e / 2;
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
  const double black = mean_of_sites(values_of(series.pedestal_dn));
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
  if (out.sensor) out.sensor->black_level_dn = mean_of_sites(values_of(black.level_dn));
  note(measured_figures(black_level_note, measured, 0, 0), out);
}

void put_picture_noise(const PictureNoise& noise, const BlackPoint& black, const FrameSetting& setting,
                       const Measured& measured, GainProfile& out) {
  const bool keeps_pedestal = pedestal_is_measured(out);
  const Estimate& gain = noise.gain_dn_per_e;
  const double level = mean_of_sites(keeps_pedestal ? values_of(*out.pedestal_dn) : black.pedestal_dn);
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

namespace {

constexpr double cut_deviations = 5;
constexpr double max_excluded = 0.05;
constexpr double clipped_fraction = 1e-3;
constexpr double fewest_pixels = 500;  // of a site: the standard error is below 0.05 standard deviations

int lines_of(int pixels, int parity) { return (pixels + 1 - parity) / 2; }

LineScatter scatter_of(double common_variance, double pixel_variance, double pixels, int lines) {
  const double white = pixel_variance * lines / pixels;
  return {std::sqrt(std::max(0.0, common_variance + white)), std::sqrt(white)};
}

void exclude(const Plane<float>& mean_dn, int site, int frames, double gain_dn_per_e, PixelMask& mask) {
  const SiteSpread spread = spread_of(mean_dn, site, 0.5 / frames);
  const double cut = cut_deviations * std::max(spread.deviation, 0.5 / frames);
  const double low = spread.median - cut;
  const double high = spread.median + cut + isp::max_hidden_charge_e * gain_dn_per_e / frames;
  for (int y = site >> 1; y < mask.height(); y += 2) {
    for (int x = site & 1; x < mask.width(); x += 2) {
      mask.at(x, y) = mean_dn.at(x, y) < low || mean_dn.at(x, y) > high ? 1 : 0;
    }
  }
}

Result<void> check_codes(const DarkGroup& group) {
  for (int site = 0; site < 4; ++site) {
    if (group.fraction_at_zero[site] <= clipped_fraction) continue;
    return fail(ErrorCode::insufficient,
                fmt::format("{:.3g} % of the dark samples are at code 0, so their mean is too high; raise the camera's "
                            "black level (offset)",
                            100 * group.fraction_at_zero[site]));
  }
  const double white = *std::min_element(group.setting.white_dn.begin(), group.setting.white_dn.end());
  const auto at_white = std::count_if(group.mean_dn.data(), group.mean_dn.data() + group.mean_dn.size(),
                                      [white](float dn) { return dn >= white; });
  const double share = static_cast<double>(at_white) / static_cast<double>(group.mean_dn.size());
  if (share <= max_excluded) return {};
  return fail(ErrorCode::insufficient,
              fmt::format("{:.3g} % of the dark samples are at the white level {:g} DN; expose "
                          "less, or cover the lens",
                          100 * share, white));
}

}  // namespace

Result<BlackFigures> measure_black(const DarkGroup& group, double gain_dn_per_e) {
  if (auto good = check_codes(group); !good) return tl::make_unexpected(good.error());
  BlackFigures out;
  out.frames = group.frames;
  PixelMask mask(group.mean_dn.width(), group.mean_dn.height());
  double row = 0, column = 0;
  const double one = 1;
  for (int site = 0; site < 4; ++site) {
    exclude(group.mean_dn, site, group.frames, gain_dn_per_e, mask);
    const ImageFigures f = figures_of({{&group, 1}, {&one, 1}}, mask, site);
    if (f.pixels < fewest_pixels) {
      return fail(ErrorCode::insufficient,
                  fmt::format("a CFA site has {:g} dark pixels, a black level needs {:g}", f.pixels, fewest_pixels));
    }
    out.level_dn[site] = {f.mean, f.standard_error};
    // The mean of the frames has less noise than one of them.
    const double averaged_away = 1 - 1.0 / group.frames, temporal = f.temporal_variance * group.frames;
    out.deviation_dn[site] = std::sqrt(f.variance + averaged_away * temporal);
    out.rows[site] = scatter_of(f.row_variance, f.variance, f.pixels, lines_of(mask.height(), site >> 1));
    out.columns[site] = scatter_of(f.column_variance, f.variance, f.pixels, lines_of(mask.width(), site & 1));
    row += (f.row_variance + averaged_away * group.row_variance_dn2[site]) / 4;
    column += f.column_variance / 4;
    out.pixels += static_cast<std::int64_t>(f.pixels);
  }
  out.row_noise_dn = std::sqrt(std::max(0.0, row));
  out.column_noise_dn = std::sqrt(std::max(0.0, column));
  out.excluded_fraction = 1 - static_cast<double>(out.pixels) / static_cast<double>(mask.size());
  if (out.excluded_fraction <= max_excluded) return out;
  return fail(ErrorCode::insufficient,
              fmt::format("{:.3g} % of the pixels are outliers, at most {:g} % are allowed; is this a dark frame?",
                          100 * out.excluded_fraction, 100 * max_excluded));
}

Result<BlackFigures> measure_black(const RawDn& frame, double gain_dn_per_e) {
  DarkStack stack;
  if (auto added = stack.add(frame); !added) return tl::make_unexpected(added.error());
  return measure_black(stack.average(), gain_dn_per_e);
}

Result<RawDn> part_of(const RawDn& frame, const Rect& part) {
  if (frame.is_float()) return fail(ErrorCode::unsupported, "floating-point samples have no masked pixels");
  Rect even = part;
  const auto align = [](int& start, int& length, int origin) {
    if (((start - origin) & 1) != 0) {
      ++start;
      --length;
    }
  };
  align(even.x, even.width, frame.active.x);
  align(even.y, even.height, frame.active.y);
  if (even.x < 0 || even.y < 0 || even.width < 1 || even.height < 1 || even.width > frame.dn.width() - even.x ||
      even.height > frame.dn.height() - even.y) {
    return fail(ErrorCode::invalid_argument, fmt::format("there are no pixels {} x {} at ({}, {}) in the readout",
                                                         part.width, part.height, part.x, part.y));
  }
  RawDn out;
  out.dn = Plane<std::uint16_t>(even.width, even.height);
  for (int y = 0; y < even.height; ++y) {
    std::copy_n(frame.dn.row(even.y + y) + even.x, even.width, out.dn.row(y));
  }
  out.layout = frame.layout;
  out.phase = frame.phase;
  out.active = out.default_crop = {0, 0, even.width, even.height};
  out.white_dn = frame.white_dn;
  out.info = frame.info;
  return out;
}

}  // namespace lowlux::calib
