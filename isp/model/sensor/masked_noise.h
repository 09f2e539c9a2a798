#pragma once

#include <algorithm>
#include <optional>

namespace lowlux::isp {

/// Charge above the limit of outliers that means of dark pixels keep [e-]. A dark charge of less than an electron is in
/// few pixels, which robust deviations do not show: at a mean of 0.5 e- 1e-6 of the pixels hold more than 6 e-, and
/// from 1 e- on the median absolute deviation shows the charge.
inline constexpr double max_hidden_charge_e = 6;

/// Describes the masked pixels of one site, and what a camera's profile states of the sensor.
struct MaskedLevel {
  double gain_dn_per_e = 0;           // system gain K
  double read_variance_dn2 = 0;       // without dark charge; rounding included
  double level_dn = 0;                // mean of the masked pixels: pedestal plus dark charge
  std::optional<double> pedestal_dn;  // without dark charge; absent if it is not known apart from it
  double std_dn = 0;                  // standard deviation of the masked pixels; 0 if it was not measured
};

/// Returns the variance of a pixel without light [DN^2]. Masked pixels show the dark charge of their own frame by their
/// level, whatever the temperature was:
///     Var = K (level - pedestal) + read variance
/// The result is at least the read variance. Where the standard deviation of the masked pixels is known, the result is
/// at most their variance, because a pedestal may have drifted since the profile was made; where the
/// pedestal is not known, it is their variance.
/// @return nullopt where neither the pedestal nor the standard deviation is known
inline std::optional<double> masked_variance_dn2(const MaskedLevel& m) {
  if (!m.pedestal_dn && !(m.std_dn > 0)) return std::nullopt;
  double variance = m.std_dn * m.std_dn;
  if (m.pedestal_dn) {
    const double by_level = m.gain_dn_per_e * (m.level_dn - *m.pedestal_dn) + m.read_variance_dn2;
    variance = m.std_dn > 0 ? std::min(variance, by_level) : by_level;
  }
  return std::max(variance, m.read_variance_dn2);
}

}  // namespace lowlux::isp
