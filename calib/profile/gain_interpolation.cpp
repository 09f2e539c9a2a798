#include "calib/profile/gain_interpolation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

constexpr double same_iso = 1e-3;  // relative

double between(double a, double b, double share) { return a + share * (b - a); }

double between_logs(double a, double b, double share) {
  return a > 0 && b > 0 ? std::exp(between(std::log(a), std::log(b), share)) : between(a, b, share);
}

/// Interpolates by `share` of the way from a to b; patterns and hot pixels are those of the nearer one.
GainProfile between(const GainProfile& a, const GainProfile& b, double share) {
  GainProfile out = share < 0.5 ? a : b;
  if (!a.pedestal_dn || !b.pedestal_dn) out.pedestal_dn.reset();
  for (int site = 0; out.pedestal_dn && site < 4; ++site) {
    const Estimate &low = (*a.pedestal_dn)[site], &high = (*b.pedestal_dn)[site];
    (*out.pedestal_dn)[site] = {between(low.value, high.value, share),
                                std::max(low.standard_error, high.standard_error)};
  }
  if (!a.sensor || !b.sensor) {
    out.sensor.reset();
    return out;
  }
  SensorModel& s = *out.sensor;
  s.system_gain_dn_per_e = between_logs(a.sensor->system_gain_dn_per_e, b.sensor->system_gain_dn_per_e, share);
  s.read_noise_e = between_logs(a.sensor->read_noise_e, b.sensor->read_noise_e, share);
  s.full_well_e = between_logs(a.sensor->full_well_e, b.sensor->full_well_e, share);
  s.black_level_dn = between(a.sensor->black_level_dn, b.sensor->black_level_dn, share);
  return out;
}

/// Extrapolates beyond the measured settings: the gain follows the ISO, values in electrons stay.
GainProfile beyond(const GainProfile& nearest, double ratio) {
  GainProfile out = nearest;
  if (!out.sensor) return out;
  SensorModel& s = *out.sensor;
  s.system_gain_dn_per_e *= ratio;
  s.full_well_e = std::min(s.full_well_e, (s.white_level_dn - s.black_level_dn) / s.system_gain_dn_per_e);
  return out;
}

std::string settings_of(const CameraProfile& profile) {
  std::string text;
  for (const GainProfile& g : profile.gains) text += fmt::format("{}'{}'", text.empty() ? "" : ", ", g.gain_setting);
  return text;
}

/// Parses "ISO 1600" or "1600"; nullopt if it is neither.
std::optional<double> iso_named(std::string_view name) {
  constexpr std::string_view prefix = "ISO ";
  if (name.starts_with(prefix)) name.remove_prefix(prefix.size());
  double iso = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), iso);
  const bool whole = error == std::errc() && end == name.data() + name.size();
  return whole && iso > 0 && std::isfinite(iso) ? std::optional(iso) : std::nullopt;
}

std::string names_of(const std::vector<const GainProfile*>& gains) {
  std::string text;
  for (const GainProfile* g : gains) text += fmt::format("{}{:g}", text.empty() ? "" : ", ", *g->iso);
  return text;
}

}  // namespace

Result<GainAtIso> gain_at_iso(const CameraProfile& profile, const std::optional<double>& iso) {
  if (profile.gains.size() == 1 && !(iso && profile.gains[0].iso)) {
    const GainProfile& only = profile.gains[0];
    if (!only.iso) return GainAtIso{only, ""};
    return GainAtIso{only,
                     fmt::format("the frame states no ISO: the profile's only setting, ISO {:g}, is used", *only.iso)};
  }
  std::vector<const GainProfile*> stated, unstated;
  for (const GainProfile& g : profile.gains) (g.iso ? stated : unstated).push_back(&g);
  if (!iso && unstated.size() == 1) return GainAtIso{*unstated.front(), ""};
  if (stated.empty() || !iso) {
    return fail(ErrorCode::insufficient,
                fmt::format("the {} states no ISO: choose one of the profile's gain settings with --gain-setting: {}",
                            iso ? "profile" : "frame", settings_of(profile)));
  }
  std::sort(stated.begin(), stated.end(), [](const auto* a, const auto* b) { return *a->iso < *b->iso; });
  for (const GainProfile* g : stated) {
    if (std::fabs(*iso / *g->iso - 1) <= same_iso) return GainAtIso{*g, ""};
  }
  const auto above = std::find_if(stated.begin(), stated.end(), [&](const auto* g) { return *g->iso > *iso; });
  if (above == stated.begin() || above == stated.end()) {
    const GainProfile& nearest = above == stated.begin() ? *stated.front() : *stated.back();
    return GainAtIso{
        beyond(nearest, *iso / *nearest.iso),
        fmt::format("ISO {:g} is outside the range of the profile ({}): the gain is extrapolated from ISO {:g}", *iso,
                    names_of(stated), *nearest.iso)};
  }
  const GainProfile &low = **(above - 1), &high = **above;
  const double share = std::log(*iso / *low.iso) / std::log(*high.iso / *low.iso);
  if (low.pedestal_holds != high.pedestal_holds || low.sensor.has_value() != high.sensor.has_value()) {
    const GainProfile& nearer = share < 0.5 ? low : high;
    return GainAtIso{beyond(nearer, *iso / *nearer.iso),
                     fmt::format("ISO {:g} and ISO {:g} of the profile were not measured in the same way: ISO {:g} is "
                                 "extrapolated from ISO {:g}",
                                 *low.iso, *high.iso, *iso, *nearer.iso)};
  }
  return GainAtIso{between(low, high, share), ""};
}

std::optional<double> only_iso(const CameraProfile& profile) {
  return profile.gains.size() == 1 ? profile.gains[0].iso : std::nullopt;
}

Result<GainAtIso> gain_named(const CameraProfile& profile, const std::string& name) {
  const auto found = std::ranges::find(profile.gains, name, &GainProfile::gain_setting);
  if (found != profile.gains.end()) return GainAtIso{*found, ""};
  const bool has_iso = std::ranges::any_of(profile.gains, [](const GainProfile& g) { return g.iso.has_value(); });
  if (const auto iso = iso_named(name); iso && has_iso) return gain_at_iso(profile, iso);
  return fail(ErrorCode::invalid_argument,
              fmt::format("the profile has no gain setting '{}', it has {}", name, settings_of(profile)));
}

}  // namespace lowlux::calib
