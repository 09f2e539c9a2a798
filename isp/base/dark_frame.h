#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/correction.h"
#include "isp/base/plane.h"

namespace lowlux {

/// Holds the output of a sensor without light at the settings of one image, per pixel: pedestal and dark charge
/// together, so that nothing of either remains to be subtracted; without `holds_dark` the pedestal alone. It is made
/// from dark frames by calib/dark/dark_frame.h.
struct DarkFrame {
  Plane<float> dn;                       // active height x width: the mean code expected without light
  std::vector<DefectRect> unknown;       // pixels whose dark value is unknown, ascending, 1 x 1; to be repaired
  PerSite<double> mean_dn{};             // mean of `dn` without outliers
  PerSite<double> noise_std_dn{};        // temporal noise of a pixel of the image without light
  PerSite<double> added_variance_dn2{};  // mean over the pixels of the variance that subtracting `dn` adds

  int frames = 0;               // exposures that the dark frames used are the mean of
  int files = 0;                // files that hold them: fewer than `frames` if there are master darks
  bool estimated = false;       // `frames` follows from the noise of the files, and is not counted or given
  int settings = 0;             // number of exposure times and temperatures among them
  double scale = 1;             // dark charge of the image over that of the longest or warmest darks used
  double doubling_c = 0;        // degrees over which dark charge is assumed to double; 0 if no temperature was scaled
  double noise_fraction = 0;    // mean of added variance over the image's own variance without light
  double pattern_fraction = 1;  // fraction of each pixel's deviation that was kept; 1: all of it
  std::optional<PerSite<double>> masked_dn;  // masked pixels of the image, if they set the level of `dn`
  bool is_bias = false;    // made from bias frames: of the shortest exposure time, without the image's dark charge
  bool holds_dark = true;  // the level of `dn` includes the image's dark charge
  std::vector<std::string> warnings;
};

}  // namespace lowlux
