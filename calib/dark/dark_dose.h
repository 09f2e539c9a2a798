#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/result.h"

namespace lowlux::calib {

/// Exposure of a frame to dark current.
struct DarkExposure {
  double time_s = 0;
  std::optional<double> temperature_c;
};

/// Returns whether the times agree within 1 %, and the temperatures, where both are known, within a degree.
bool is_same_exposure(const DarkExposure& a, const DarkExposure& b);

/// Mean level of the darks of one setting.
struct DarkLevel {
  DarkExposure exposure;
  double frames = 1;
  double level_dn = 0;      // mean of the sites
  double variance_dn2 = 0;  // variance of that mean
};

/// Additional information for scaling darks.
struct DarkScaling {
  std::optional<double> doubling_c;    // degrees over which dark charge doubles
  std::optional<double> pedestal_dn;   // from a file's tag: mean code without charge
  bool pedestal_from_picture = false;  // the image's own masked pixels determine the pedestal that goes with the scale
};

/// The dark expected in an image as a weighted sum of the darks' means and of the pedestal. Weights add up to 1.
struct DarkWeights {
  std::vector<double> of_level;  // one for each level; 0 for those not used
  double of_pedestal = 0;
  double scale = 1;                  // dark charge of the image over that of the longest or warmest darks used
  std::optional<double> doubling_c;  // set where a temperature was scaled
  bool same_setting = false;         // the plain mean of darks exposed like the image
  std::vector<std::string> warnings;
};

/// Computes the weights of darks for an image. Dark charge is current * time, the current doubling every `doubling_c`
/// degrees, on top of the pedestal. In this order: darks of the same time (within 1 %) and temperature (within a
/// degree) are averaged; darks whose charge differs twofold give a straight line for each pixel (least squares,
/// weighted by their numbers of frames); other darks are scaled above the pedestal. A doubling that is not given is
/// fitted to the levels, if they determine it. Errors: no darks; a pedestal or doubling that is needed and not known;
/// more than 4 times the charge of the darks. Warnings: charge or temperature beyond the darks'; a temperature that is
/// not stated.
Result<DarkWeights> compute_dark_weights(std::span<const DarkLevel> levels, const DarkExposure& picture,
                                         const DarkScaling& known);

/// Returns the degrees over which the dark charge of the levels doubles, 2 to 30, by least squares with pedestal
/// (fitted too, if none is known) and current. nullopt unless both ends of that range lie five standard deviations off.
std::optional<double> fitted_doubling_c(std::span<const DarkLevel> levels, std::optional<double> pedestal_dn);

}  // namespace lowlux::calib
