#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/correction.h"
#include "isp/base/plane.h"

namespace lowlux {

/// What a sensor gives without light under the setting of one picture, pixel by pixel: pedestal and dark charge in one,
/// so that nothing of either is left to subtract. Made of dark frames by calib/dark/dark_frame.h.
struct DarkFrame {
  Plane<float> dn;                       // active height x width: the mean code expected without light
  std::vector<DefectRect> unknown;       // pixels whose dark cannot be told, ascending, 1 x 1; to be repaired
  PerSite<double> mean_dn{};             // of `dn`, pixels far from the others left out
  PerSite<double> noise_std_dn{};        // temporal, of a pixel of the picture without light
  PerSite<double> added_variance_dn2{};  // mean over the pixels of what subtracting `dn` adds

  int frames = 0;            // dark frames used
  int settings = 0;          // exposure times and temperatures among them
  double scale = 1;          // dark charge of the picture over that of the longest or warmest darks used
  double doubling_c = 0;     // degrees over which dark charge was taken to double; 0 if no temperature was scaled
  double noise_share = 0;    // mean of added variance over the picture's own variance without light
  double pattern_share = 1;  // of each pixel's deviation that was kept; 1: all of it
  std::optional<PerSite<double>> masked_dn;  // the picture's masked pixels, where the level of `dn` follows from them
  std::vector<std::string> warnings;
};

}  // namespace lowlux
