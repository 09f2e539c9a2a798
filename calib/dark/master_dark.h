#pragma once

#include <optional>

#include "calib/dark/dark_stack.h"
#include "calib/dark/light_in_darks.h"
#include "isp/base/cfa.h"
#include "isp/base/frame.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Largest number of exposures of a master dark.
inline constexpr int max_exposures = 10000;

/// Variance of rounding to whole codes [DN^2].
inline constexpr double rounding_dn2 = 1.0 / 12;

/// Noise model of an image in codes: variance = read_variance_dn2 + gain_dn_per_e * (level - pedestal), per site.
struct DarkNoiseModel {
  PerSite<double> gain_dn_per_e{};
  PerSite<double> read_variance_dn2{};
  friend bool operator==(const DarkNoiseModel&, const DarkNoiseModel&) = default;
};

/// Returns the variance of one exposure at the level of a dark [DN^2]; without a pedestal that of reading alone.
PerSite<double> noise_of_one_exposure(const DarkNoiseModel& noise, const PerSite<DarkSite>& sites,
                                      const std::optional<PerSite<double>>& pedestal_dn);

/// Estimates how many exposures a single file is the mean of, at least 1 and at most max_exposures:
///     N = V / (v - c - 1/12)
/// V is the variance of one exposure by the noise model; v is half the mean square difference of neighbours of a site
/// in the dark, c half the mean product of these differences with those of the image, and 1/12 only where the file
/// holds whole codes. c is the variance of the fixed pattern: only the pattern is common to the dark and the image, if
/// both have the same exposure time and temperature. Otherwise c is 0, and N is a lower bound. Hot pixels and edges of
/// the image, beyond five standard deviations, are excluded. The divisor is at least its own standard error. The result
/// is rounded to whole numbers below 16 and to three significant bits and a half above, so that images of one setting
/// share a dark frame. For a median of n exposures the result is close to 2 n / pi.
/// Precondition: group.frames == 1, and the group has the size of the image's active area.
double estimate_exposures(const DarkGroup& group, const RawDn& picture, const DarkNoiseModel& noise,
                          const std::optional<PerSite<double>>& pedestal_dn);

/// Estimates how many exposures each of several files of one setting is the mean of, at least 1 and at most
/// max_exposures:
///     N = V / (v - 1/12)
/// v is the variance between the files, so that the fixed pattern does not count; V as in estimate_exposures, but at
/// most the variance of a pixel in the darkest places of the image, which is that of one exposure and more: a noise
/// model that states too much makes no master darks of ordinary ones. For the same reason the result is 1 below 4. The
/// divisor is at least 1/12 for whole codes, as the rounding of values that scatter less is not noise, and at least its
/// standard error. The result is rounded as that of estimate_exposures. Precondition: group.frames > 1.
double estimate_exposures_between(const DarkGroup& group, const RawDn& picture, const DarkNoiseModel& noise,
                                  const std::optional<PerSite<double>>& pedestal_dn);

/// Returns the group of a master dark that states no exposure settings: those of the image are assumed, except for what
/// `stated` holds. The dark is cut to the active area if it has the size of the readout. Errors: another size; a level
/// below the pedestal by more than two standard deviations of a pixel and 0.1 % of the range, which a master has after
/// its bias has been subtracted, or in other units.
Result<DarkGroup> group_of_master(const Plane<float>& dn, bool rounded, const FrameInfo& stated, const RawDn& picture,
                                  const std::optional<PerSite<double>>& pedestal_dn);

}  // namespace lowlux::calib
