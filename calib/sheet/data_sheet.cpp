#include "calib/sheet/data_sheet.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/dark/dark_stack.h"
#include "calib/frame_setting.h"
#include "calib/sheet/dark_rates.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/sensor.h"

namespace lowlux::calib {
namespace {

/// Mean of the darks that belong to flats of one exposure time and temperature.
struct DarkOfFlats {
  PerSite<Estimate> level_dn{};          // standard errors are by temporal noise: patterns are those of the flats too
  const DarkGroup* same_time = nullptr;  // darks of that exposure time and temperature; null if there are none
  bool contains_dark_current = false;    // known from darks of that time, or from the dark current
};

/// Means of groups of darks, each measured once.
class DarkLevels {
 public:
  /// @param groups  one or more, the shortest exposure first; they have to outlive this
  /// @param rates   rates of these groups
  DarkLevels(std::span<const DarkGroup> groups, const std::optional<DarkRates>& rates, const Estimate& gain_dn_per_e);

  /// Returns the level of darks that belong to flats (EMVA 1288 R4 takes darks of their exposure time): that of the
  /// group of their exposure time and temperature (same_temperature); else that of the nearest exposure time at that
  /// temperature, plus the dark current times the difference of the times; else that of the first group.
  DarkOfFlats at(const FrameSetting& flats) const;

 private:
  const DarkGroup* nearest(const FrameSetting& flats) const;
  const DarkRate* rate_at(const std::optional<double>& temperature_c) const;

  std::span<const DarkGroup> groups_;
  std::vector<PerSite<Estimate>> levels_dn_;
  std::vector<DarkRate> rates_;
  double gain_dn_per_e_;
};

PerSite<Estimate> levels_of(const DarkGroup& group) {
  const int width = group.mean_dn.width(), height = group.mean_dn.height();
  PerSite<double> sum{}, variance{}, pixels{};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto site = static_cast<std::size_t>(site_of(x, y));
      sum[site] += group.mean_dn.at(x, y);
      variance[site] += group.variance_dn2.at(x, y);
      ++pixels[site];
    }
  }
  PerSite<Estimate> out{};
  for (std::size_t site = 0; site < out.size(); ++site) {
    const int rows = (height + 1 - static_cast<int>(site >> 1)) / 2;
    const double variance_dn2 = variance[site] / pixels[site] / pixels[site] +
                                std::max(0.0, group.row_variance_dn2[site]) / rows +
                                std::max(0.0, group.frame_variance_dn2[site]);
    out[site] = {sum[site] / pixels[site], std::sqrt(variance_dn2 / group.frames)};
  }
  return out;
}

/// Returns the difference of two temperatures that same_temperature() holds for equal.
double degrees_between(const std::optional<double>& first_c, const std::optional<double>& second_c) {
  return first_c && second_c ? std::fabs(*first_c - *second_c) : 0;
}

DarkLevels::DarkLevels(std::span<const DarkGroup> groups, const std::optional<DarkRates>& rates,
                       const Estimate& gain_dn_per_e)
    : groups_(groups), gain_dn_per_e_(gain_dn_per_e.value) {
  assert(!groups.empty());
  for (const DarkGroup& group : groups) levels_dn_.push_back(levels_of(group));
  if (rates) rates_ = rates->rates;
}

const DarkGroup* DarkLevels::nearest(const FrameSetting& flats) const {
  const DarkGroup* out = nullptr;
  std::pair<double, double> least;
  for (const DarkGroup& group : groups_) {
    const FrameSetting& darks = group.setting;
    if (!same_temperature(darks.temperature_c, flats.temperature_c)) continue;
    if (darks.exposure_s.has_value() != flats.exposure_s.has_value()) continue;
    const std::pair off(std::fabs(darks.exposure_s.value_or(0) - flats.exposure_s.value_or(0)),
                        degrees_between(darks.temperature_c, flats.temperature_c));
    if (out != nullptr && off >= least) continue;
    out = &group;
    least = off;
  }
  return out;
}

const DarkRate* DarkLevels::rate_at(const std::optional<double>& temperature_c) const {
  const DarkRate* out = nullptr;
  for (const DarkRate& rate : rates_) {
    if (!same_temperature(rate.temperature_c, temperature_c)) continue;
    if (out != nullptr &&
        degrees_between(out->temperature_c, temperature_c) <= degrees_between(rate.temperature_c, temperature_c)) {
      continue;
    }
    out = &rate;
  }
  return out;
}

DarkOfFlats DarkLevels::at(const FrameSetting& flats) const {
  const DarkGroup* group = nearest(flats);
  if (group == nullptr) return {levels_dn_.front(), nullptr, false};
  DarkOfFlats out{levels_dn_[static_cast<std::size_t>(group - groups_.data())], nullptr, true};
  const double more_s = flats.exposure_s.value_or(0) - group->setting.exposure_s.value_or(0);
  if (more_s == 0) {
    out.same_time = group;
    return out;
  }
  const DarkRate* rate = rate_at(flats.temperature_c);
  if (rate == nullptr) return {levels_dn_.front(), nullptr, false};
  const double dn_per_e = gain_dn_per_e_ * more_s;
  for (Estimate& level : out.level_dn) {
    level = {level.value + dn_per_e * rate->by_mean_e_per_s.value,
             std::hypot(level.standard_error, dn_per_e * rate->by_mean_e_per_s.standard_error)};
  }
  return out;
}

constexpr double planck_j_s = 6.62607015e-34, light_m_per_s = 299792458;  // SI 2019
constexpr double linear_fraction = 0.7;  // R4, section 6.5: responsivity is fitted up to 70 % of saturation

std::optional<Estimate> snr_max_of(const std::optional<Estimate>& saturation_e) {
  if (!saturation_e || !(saturation_e->value > 0)) return std::nullopt;
  const double snr = std::sqrt(saturation_e->value);
  return Estimate{snr, saturation_e->standard_error / (2 * snr)};
}

std::optional<Estimate> threshold_of(const PhotonTransfer& transfer) {
  if (!transfer.read_noise_e) return std::nullopt;
  const double gain = transfer.system_gain_dn_per_e.value, read_e = transfer.read_noise_e->value;
  const double root = std::sqrt(read_e * read_e + quantisation_dn2 / (gain * gain) + 0.25);
  // Quantisation depends on the gain, whose relative error is far smaller than that of the read noise.
  return Estimate{root + 0.5, read_e / root * transfer.read_noise_e->standard_error};
}

std::optional<Estimate> ratio_of(const std::optional<Estimate>& a, const std::optional<Estimate>& b) {
  if (!a || !b || !(b->value > 0)) return std::nullopt;
  const double ratio = a->value / b->value;
  return Estimate{ratio, ratio * std::hypot(a->standard_error / a->value, b->standard_error / b->value)};
}

/// Returns the quantum efficiency [e-/photon] from the slope of the mean over photons, through the darks, by least
/// squares with weights of photon noise; nullopt without flats in the linear range.
std::optional<Estimate> efficiency_of(const SheetFrames& frames, const std::vector<DarkOfFlats>& darks,
                                      const Estimate& gain_dn_per_e, int channel, double max_signal_dn) {
  const double gain = gain_dn_per_e.value;
  double signal_e = 0, photons = 0, variance_e2 = 0, dark_error_e = 0;
  for (std::size_t i = 0; i < frames.flat_pairs.size(); ++i) {
    const PairStatistics& pair = frames.flat_pairs[i];
    if (!pair.setting.exposure_s) continue;
    for (int site = 0; site < 4; ++site) {
      const auto s = static_cast<std::size_t>(site);
      const SiteStatistics& statistics = pair.site[s];
      const Estimate& dark_dn = darks[i].level_dn[s];
      const double signal_dn = statistics.mean_dn - dark_dn.value;
      if (channel_of_site(pair.setting, site) != channel || signal_dn > max_signal_dn || signal_dn <= 0) continue;
      signal_e += signal_dn / gain;
      photons += photons_of(*frames.irradiance, *pair.setting.exposure_s);
      const auto pixels = static_cast<double>(statistics.pixels);
      variance_e2 += (statistics.variance_dn2 / (2 * pixels) + statistics.covariance_dn2 / pixels +
                      std::max(0.0, statistics.row_variance_dn2) / (2 * statistics.rows)) /
                     (gain * gain);
      dark_error_e += dark_dn.standard_error / gain;
    }
  }
  if (!(photons > 0)) return std::nullopt;
  const double efficiency = signal_e / photons;
  // The patterns and the darks are common to all flats, so that their errors add up: at most as many as there are.
  const auto levels = static_cast<double>(frames.flat_pairs.size());
  return Estimate{efficiency, std::hypot(std::sqrt(variance_e2 * levels) / photons, dark_error_e / photons,
                                         efficiency * gain_dn_per_e.standard_error / gain)};
}

double largest_signal_dn(const std::vector<PairStatistics>& flats, const PhotonTransfer& transfer) {
  double most = 0;
  for (const PairStatistics& pair : flats) {
    for (std::size_t s = 0; s < pair.site.size(); ++s) {
      most = std::max(most, pair.site[s].mean_dn - transfer.black_dn[s]);
    }
  }
  return most;
}

std::string setting_text(const FrameSetting& setting) {
  const std::string time = setting.exposure_s ? fmt::format("{:g} s", *setting.exposure_s) : "exposure time";
  return setting.temperature_c ? fmt::format("{} at {:g} C", time, *setting.temperature_c) : time;
}

/// Returns the code above which a dark may be saturated: that of the saturation capacity, where the flats show it.
double saturation_code(const SheetFrames& frames, const DataSheet& sheet) {
  const auto& white = frames.darks.front().setting.white_dn;
  const double of_white_dn = full_fraction * *std::ranges::min_element(white);
  if (!sheet.saturation_e) return of_white_dn;
  const double capacity_dn = sheet.saturation_e->value * sheet.transfer.system_gain_dn_per_e.value;
  return std::min(of_white_dn, mean_of_sites(sheet.transfer.black_dn) + capacity_dn);
}

void warn_of_saturated_darks(std::span<const DarkGroup> darks, double full_dn, DataSheet& out) {
  constexpr double hot_pixels = 1e-4;  // whose charge may be some percent of all
  for (const DarkGroup& group : darks) {
    const std::string setting = setting_text(group.setting);
    const double full = saturated_fraction(group, full_dn);
    if (is_saturated(group, full_dn)) {
      out.warnings.push_back(
          fmt::format("the darks of {} are saturated: dark current is measured without them", setting));
    } else if (full > hot_pixels) {
      out.warnings.push_back(
          fmt::format("{:.3g} % of the pixels are saturated in the darks of {}, so the mean dark current is too low; "
                      "take shorter darks",
                      100 * full, setting));
    }
  }
}

std::vector<DarkOfFlats> dark_levels_of_flats(const SheetFrames& frames, const DarkLevels& levels, DataSheet& out) {
  std::vector<DarkOfFlats> darks;
  const FrameSetting* without = nullptr;
  for (const PairStatistics& pair : frames.flat_pairs) {
    darks.push_back(levels.at(pair.setting));
    if (without == nullptr && !darks.back().contains_dark_current) without = &pair.setting;
  }
  if (without == nullptr) return darks;
  out.warnings.push_back(fmt::format(
      "dark current is not subtracted for the quantum efficiency, because two darks of the flats' {}, or of two "
      "exposure times at that temperature, are missing; take darks of the exposure time of the flats",
      setting_text(*without)));
  return darks;
}

/// @param shortest  parts of the darks of the shortest exposure, for flats without darks of their own exposure
Result<void> put_prnu(const DarkGroup& flats, const PerSite<SpatialParts>& shortest, const DarkLevels& levels,
                      DataSheet& out) {
  const auto bright = spatial_parts(flats);
  if (!bright) return tl::make_unexpected(bright.error());
  const DarkOfFlats level = levels.at(flats.setting);
  PerSite<SpatialParts> dark = shortest;
  if (level.same_time != nullptr) {
    const auto same = spatial_parts(*level.same_time);
    if (!same) return tl::make_unexpected(same.error());
    dark = *same;
  } else {
    out.warnings.push_back(
        fmt::format("the non-uniformity of dark current is not subtracted from PRNU, because two darks of the flats' "
                    "{} are missing; take 16 darks of the exposure time of the flats near half of saturation",
                    setting_text(flats.setting)));
  }
  for (std::size_t site = 0; site < dark.size(); ++site) dark[site].mean_dn = level.level_dn[site].value;
  out.prnu = photo_response_nonuniformity(*bright, dark);
  return {};
}

std::optional<std::array<Estimate, 3>> efficiencies_of(const SheetFrames& frames, const DarkLevels& levels,
                                                       DataSheet& sheet) {
  if (!frames.irradiance) return std::nullopt;
  const std::vector<DarkOfFlats> darks = dark_levels_of_flats(frames, levels, sheet);
  const double saturation_dn = sheet.saturation_e
                                   ? sheet.saturation_e->value * sheet.transfer.system_gain_dn_per_e.value
                                   : largest_signal_dn(frames.flat_pairs, sheet.transfer);
  const double max_dn = linear_fraction * saturation_dn;
  const bool filters = frames.flat_pairs.front().setting.layout == SensorLayout::bayer;
  std::array<Estimate, 3> out;
  for (int c = 0; c < 3; ++c) {
    const auto found = efficiency_of(frames, darks, sheet.transfer.system_gain_dn_per_e, filters ? c : 1, max_dn);
    if (!found) return std::nullopt;
    out[static_cast<std::size_t>(c)] = *found;
  }
  return out;
}

}  // namespace

double photons_of(const Irradiance& light, double exposure_s) {
  const double energy_j = light.w_per_m2 * light.pixel_um2 * 1e-12 * exposure_s;
  return energy_j * light.wavelength_nm * 1e-9 / (planck_j_s * light_m_per_s);
}

Result<DataSheet> make_data_sheet(const SheetFrames& frames) {
  auto transfer = fit_photon_transfer(frames.dark_pairs, frames.flat_pairs,
                                      {.steady_light = frames.steady_light || frames.irradiance.has_value()});
  if (!transfer) return tl::make_unexpected(transfer.error());
  const auto dark = spatial_parts(frames.darks.front());
  if (!dark) return tl::make_unexpected(dark.error());
  DataSheet out;
  out.transfer = *std::move(transfer);
  out.saturation_e = out.transfer.saturation_capacity_e;
  out.snr_max = snr_max_of(out.saturation_e);
  out.threshold_e = threshold_of(out.transfer);
  out.dynamic_range = ratio_of(out.saturation_e, out.threshold_e);
  const double full_dn = saturation_code(frames, out);
  warn_of_saturated_darks(frames.darks, full_dn, out);
  auto rates = dark_rates(frames.darks, out.transfer.system_gain_dn_per_e, full_dn);
  if (rates) {
    out.dark_rates = *std::move(rates);
  } else if (rates.error().code != ErrorCode::insufficient) {
    return tl::make_unexpected(rates.error());
  }
  out.dsnu_e = dark_nonuniformity(*dark, out.transfer.system_gain_dn_per_e);
  const DarkLevels levels(frames.darks, out.dark_rates, out.transfer.system_gain_dn_per_e);
  if (frames.bright) {
    if (auto done = put_prnu(*frames.bright, *dark, levels, out); !done) return tl::make_unexpected(done.error());
  }
  out.quantum_efficiency = efficiencies_of(frames, levels, out);
  return out;
}

}  // namespace lowlux::calib
