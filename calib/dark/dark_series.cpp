#include "calib/dark/dark_series.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/dark/dark_fit.h"
#include "calib/dark/dark_image.h"
#include "calib/dark/dark_temperature.h"

namespace lowlux::calib {
namespace {

constexpr double hot_deviations = 8;
constexpr double max_excluded = 0.05;
constexpr double clipped_fraction = 1e-3;
constexpr double min_misfit = 0.02;   // of the dark charge: smallest deviation that counts as nonlinear
constexpr double min_gradient = 0.1;  // of the dark charge, from edge to edge
constexpr double certain = 5;         // standard errors

using Groups = std::span<const DarkGroup>;

double full_dn_of(const FrameSetting& setting) {
  return full_fraction * *std::min_element(setting.white_dn.begin(), setting.white_dn.end());
}

Result<void> check_groups(Groups groups) {
  if (groups.empty()) return fail(ErrorCode::insufficient, "there are no dark frames");
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto what = fmt::format("group {} of the darks", g + 1);
    const FrameSetting& first = groups.front().setting;
    if (auto same = check_same_camera(first, groups[g].setting, what); !same) return same;
    if (!groups[g].setting.exposure_s) {
      return fail(ErrorCode::insufficient, what + " states no exposure time, which dark current needs");
    }
    if (auto known = check_noise_is_known(groups[g]); !known) return known;
    if (first.temperature_c.has_value() != groups[g].setting.temperature_c.has_value()) {
      return fail(ErrorCode::invalid_argument,
                  "some darks state their temperature and some do not; use frames of one kind");
    }
    const double zero = *std::max_element(groups[g].fraction_at_zero.begin(), groups[g].fraction_at_zero.end());
    if (zero > clipped_fraction) {
      return fail(
          ErrorCode::insufficient,
          fmt::format("{:.3g} % of the samples of {} are at code 0, so their mean is too high; raise the camera's "
                      "black level (offset)",
                      100 * zero, what));
    }
    const double full = saturated_fraction(groups[g], full_dn_of(groups[g].setting));
    if (full > max_excluded) {
      return fail(
          ErrorCode::insufficient,
          fmt::format("{:.3g} % of the pixels of {} are saturated, so their mean is too low; leave out the darks "
                      "of {:g} s{} or take shorter ones",
                      100 * full, what, *groups[g].setting.exposure_s,
                      first.temperature_c ? fmt::format(" at {:g} C", *groups[g].setting.temperature_c) : ""));
    }
  }
  return {};
}

Result<double> excluded_fraction(const PixelMask& mask) {
  const auto excluded = std::count(mask.data(), mask.data() + mask.size(), std::uint8_t{1});
  const double share = static_cast<double>(excluded) / static_cast<double>(mask.size());
  if (share <= max_excluded) return share;
  return fail(ErrorCode::insufficient,
              fmt::format("{:.3g} % of the pixels are outliers, at most {:g} % are allowed; are these dark frames?",
                          100 * share, 100 * max_excluded));
}

double dark_charge_dn(const DarkFit& s, const std::vector<PerSite<Estimate>>& parameters, std::size_t g, int site) {
  return parameters[1 + s.temperature_of[g]][site].value * *s.groups[g].setting.exposure_s;
}

Result<void> check_linear(const DarkFit& s, const std::vector<PerSite<Estimate>>& parameters,
                          std::span<const DarkPoint> points) {
  PerSite<double> most{};
  for (const DarkPoint& p : points) {
    most[p.site] = std::max(most[p.site], dark_charge_dn(s, parameters, p.group, p.site));
  }
  for (const DarkPoint& p : points) {
    const Estimate& off = p.residual_dn;
    if (std::fabs(off.value) <= certain * off.standard_error) continue;
    if (std::fabs(off.value) <= min_misfit * most[p.site]) continue;
    return fail(
        ErrorCode::malformed,
        fmt::format("the darks are not linear in time: at {:g} s the mean is off by {:.3g} +- {:.2g} DN of {:.3g} DN; "
                    "light reaches the sensor, or the temperature changes; cover the camera and let it settle",
                    *s.groups[p.group].setting.exposure_s, off.value, off.standard_error,
                    dark_charge_dn(s, parameters, p.group, p.site)));
  }
  return {};
}

void put_quality(const DarkFit& s, const std::vector<PerSite<Estimate>>& parameters, DarkSeries& out) {
  double sum = 0;
  int judged = 0;
  for (const DarkPoint& p : out.points) {
    if (!(p.residual_dn.standard_error > 0)) continue;
    sum += std::pow(p.residual_dn.value / p.residual_dn.standard_error, 2);
    ++judged;
  }
  out.degrees_of_freedom = 4 * static_cast<int>(s.groups.size() - parameters.size());
  out.reduced_chi_square = out.degrees_of_freedom > 0 && judged > 0 ? sum / judged : 0;
}

Result<void> check_even(const DarkFit& s) {
  for (int site = 0; site < 4; ++site) {
    for (std::size_t p = 1; p < s.estimators[site].size(); ++p) {
      const ImageFigures f = figures_of({s.groups, s.estimators[site][p]}, s.mask, site);
      for (const auto& [change, error] : {std::pair(f.change_x, f.error_x), std::pair(f.change_y, f.error_y)}) {
        if (std::fabs(change) <= certain * error || std::fabs(change) <= min_gradient * std::fabs(f.mean)) continue;
        return fail(ErrorCode::malformed,
                    fmt::format("the dark charge changes by {:.3g} DN/s across the frame, its mean is {:.3g} DN/s; "
                                "light reaches the sensor, or the sensor glows; cover camera and viewfinder",
                                std::fabs(change), f.mean));
      }
    }
  }
  return {};
}

Estimate mean_of(std::span<const Estimate> estimates) {
  Estimate out;
  for (const Estimate& e : estimates) {
    out.value += e.value / static_cast<double>(estimates.size());
    out.standard_error += e.standard_error * e.standard_error;
  }
  out.standard_error = std::sqrt(out.standard_error) / static_cast<double>(estimates.size());
  return out;
}

/// Returns the channels of sites [DN/s]; a sensor without filters has the mean of all sites in each.
std::array<Estimate, 3> channels_of(const FrameSetting& setting, const PerSite<Estimate>& sites) {
  std::array<Estimate, 3> out{};
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<Estimate> own;
    for (int site = 0; site < 4; ++site) {
      if (setting.layout != SensorLayout::bayer || channel_of_site(setting, site) == channel)
        own.push_back(sites[site]);
    }
    out[channel] = mean_of(own);
  }
  return out;
}

void put_patterns(const DarkFit& s, std::size_t darkest, DarkSeries& out) {
  double row = 0, column = 0, spread = 0, slope = 0, error2 = 0;
  for (int site = 0; site < 4; ++site) {
    const auto pedestal = figures_of({s.groups, s.estimators[site][0]}, s.mask, site);
    const auto current = figures_of({s.groups, s.estimators[site][1 + s.temperature_of[darkest]]}, s.mask, site);
    column += pedestal.column_variance / 4;
    spread += (current.variance - current.temporal_variance) / 4;
    slope += current.mean / 4;
    error2 += 2 * current.variance * current.variance / current.pixels / 16;
    for (const DarkGroup& g : s.groups) row += g.row_variance_dn2[site] / (4 * static_cast<double>(s.groups.size()));
  }
  out.row_noise_e = std::sqrt(std::max(0.0, row)) / s.gain.value;
  out.column_noise_e = std::sqrt(std::max(0.0, column)) / s.gain.value;
  if (!(slope > 0)) return;
  const double deviation = std::sqrt(std::max(0.0, spread)), error_of_square = std::sqrt(error2);
  const double smallest = std::max(deviation, std::sqrt(error_of_square));  // near 0 it is the square that is normal
  out.dsnu = {deviation / slope, error_of_square > 0 ? error_of_square / (2 * smallest * slope) : 0};
}

/// Returns the excess of one pixel in the longest darks of that temperature in which it is not saturated; if it always
/// is, in the shortest: then this is a lower bound.
double excess_e_per_s(const DarkFit& s, std::size_t darkest, int x, int y) {
  const double full_dn = full_dn_of(s.groups[darkest].setting);
  const auto time_of = [&](std::size_t g) { return *s.groups[g].setting.exposure_s; };
  std::optional<std::size_t> longest;
  std::size_t shortest = darkest;
  for (std::size_t g = 0; g < s.groups.size(); ++g) {
    if (s.temperature_of[g] != s.temperature_of[darkest] || !(time_of(g) > 0)) continue;
    if (time_of(g) < time_of(shortest)) shortest = g;
    const bool is_full = s.groups[g].mean_dn.at(x, y) > full_dn;
    if (!is_full && (!longest || time_of(g) > time_of(*longest))) longest = g;
  }
  const std::size_t group = longest.value_or(shortest);
  const double excess_dn = s.groups[group].mean_dn.at(x, y) - s.spread[group][site_of(x, y)].median;
  return excess_dn / s.gain.value / time_of(group);
}

void list_hot_pixels(const DarkFit& s, std::size_t darkest, DarkSeries& out) {
  const DarkGroup& group = s.groups[darkest];
  out.hot_temperature_c = group.setting.temperature_c;
  if (!(*group.setting.exposure_s > 0)) return;
  PerSite<double> limit{};
  for (int site = 0; site < 4; ++site) {
    const double deviation = s.spread[darkest][site].deviation, noise = s.noise_dn2[darkest][site];
    const double spatial = std::max(0.0, deviation * deviation - noise / group.frames);
    limit[site] = hot_deviations * std::sqrt(noise + spatial);
  }
  for (int y = 0; y < s.mask.height(); ++y) {
    for (int x = 0; x < s.mask.width(); ++x) {
      const int site = site_of(x, y);
      const double excess = group.mean_dn.at(x, y) - s.spread[darkest][site].median;
      if (excess > limit[site]) out.hot.push_back({x, y, excess_e_per_s(s, darkest, x, y)});
    }
  }
}

double level_of(const DarkFit& s, std::size_t g) {
  double sum = 0;
  for (const SiteSpread& spread : s.spread[g]) sum += spread.median;
  return sum;
}

struct Extremes {
  std::size_t least = 0, most = 0;  // dark charge
};

Extremes extremes_of(const DarkFit& s) {
  Extremes out;
  for (std::size_t g = 1; g < s.groups.size(); ++g) {
    if (level_of(s, g) > level_of(s, out.most)) out.most = g;
    if (level_of(s, g) < level_of(s, out.least)) out.least = g;
  }
  return out;
}

void put_read_noise(const DarkFit& s, const std::vector<PerSite<Estimate>>& parameters, std::size_t least,
                    DarkSeries& out) {
  PerSite<double> charge{};
  for (int site = 0; site < 4; ++site) charge[site] = std::max(0.0, dark_charge_dn(s, parameters, least, site));
  out.read_noise_e = read_noise_of(s, least, charge);
}

}  // namespace

Result<DarkSeries> fit_dark_series(Groups groups, const Estimate& gain) {
  if (!(gain.value > 0) || !std::isfinite(gain.value) || !(gain.standard_error >= 0)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the system gain must be above 0, found {:g} DN/e-", gain.value));
  }
  if (auto good = check_groups(groups); !good) return tl::make_unexpected(good.error());
  DarkFit s = begin_fit(groups, gain);
  DarkSeries out;
  const auto share = excluded_fraction(s.mask);
  if (!share) return tl::make_unexpected(share.error());
  out.excluded_fraction = *share;
  if (auto good = finish_fit(s); !good) return tl::make_unexpected(good.error());
  for (const PerSite<double>& of_group : s.correction_dn) {
    for (const double dn : of_group) out.largest_correction_dn = std::max(out.largest_correction_dn, std::fabs(dn));
  }
  std::vector<PerSite<Estimate>> parameters(1 + s.temperature_c.size());
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    for (int site = 0; site < 4; ++site) parameters[p][site] = estimate(s, s.estimators[site][p], site);
  }
  out.points = points_of(s, parameters);
  if (auto good = check_linear(s, parameters, out.points); !good) return tl::make_unexpected(good.error());
  if (auto good = check_even(s); !good) return tl::make_unexpected(good.error());
  out.pedestal_dn = parameters[0];
  std::vector<std::array<Estimate, 3>> slopes_dn;
  const FrameSetting& setting = groups.front().setting;
  for (std::size_t t = 0; t < s.temperature_c.size(); ++t) slopes_dn.push_back(channels_of(setting, parameters[1 + t]));
  put_currents(s.temperature_c, slopes_dn, setting.temperature_c.has_value(), gain, out);
  const Extremes extremes = extremes_of(s);
  put_patterns(s, extremes.most, out);
  list_hot_pixels(s, extremes.most, out);
  put_read_noise(s, parameters, extremes.least, out);
  put_quality(s, parameters, out);
  out.pedestal_map_dn = map_of(s, 0, 1);
  out.current_map_e_per_s = map_of(s, 1 + s.temperature_of[extremes.most], gain.value);
  return out;
}

}  // namespace lowlux::calib
