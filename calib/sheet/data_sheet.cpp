#include "calib/sheet/data_sheet.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/frame_setting.h"
#include "calib/sheet/dark_levels.h"
#include "isp/base/sensor.h"

namespace lowlux::calib {
namespace {

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

std::vector<DarkOfFlats> dark_levels_of_flats(const SheetFrames& frames, const DarkLevels& levels, DataSheet& out) {
  std::vector<DarkOfFlats> darks;
  const FrameSetting* without = nullptr;
  for (const PairStatistics& pair : frames.flat_pairs) {
    darks.push_back(levels.at(pair.setting));
    if (without == nullptr && !darks.back().contains_dark_current) without = &pair.setting;
  }
  if (without == nullptr) return darks;
  out.warnings.push_back(
      fmt::format("quantum efficiency contains dark current: there are no two darks of the flats' {}, nor of two "
                  "exposure times at that temperature; take darks of the exposure time of the flats",
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
        fmt::format("PRNU contains the nonuniformity of dark current: there are no two darks of the flats' {}; take 16 "
                    "darks of the exposure time of the flats near half of saturation",
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
  auto rates = dark_rates(frames.darks, out.transfer.system_gain_dn_per_e);
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
