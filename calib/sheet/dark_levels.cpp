#include "calib/sheet/dark_levels.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace lowlux::calib {
namespace {

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

}  // namespace

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

}  // namespace lowlux::calib
