#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/dark/dark_stack.h"
#include "calib/frame_setting.h"
#include "calib/sheet/dark_rates.h"
#include "isp/base/cfa.h"
#include "isp/base/estimate.h"

namespace lowlux::calib {

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
  /// @param rates   of these groups
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

}  // namespace lowlux::calib
