#pragma once

#include <array>
#include <optional>
#include <vector>

#include "isp/base/cfa.h"
#include "isp/base/estimate.h"
#include "isp/base/plane.h"

namespace lowlux::calib {

/// Dark current of R, G and B pixels that are not hot, at one temperature. Negative values are scatter about zero.
struct DarkCurrent {
  std::optional<double> temperature_c;  // absent if the frames do not state it
  std::array<Estimate, 3> current_e_per_s{};
};

/// Temperature law of the dark current, D(T) = current * 2^((T - temperature) / doubling), with one doubling for the
/// three channels.
struct DarkTemperatureLaw {
  double temperature_c = 0;
  std::array<Estimate, 3> current_e_per_s{};
  Estimate doubling_c;
  double lowest_c = 0, highest_c = 0;  // temperatures of the currents that the law was fitted to
  /// Largest relative deviation of the currents of a temperature from the law, without the part that their errors
  /// explain. The standard errors of the law follow from the deviations. 0 where errors explain them.
  double misfit = 0;
  double reduced_chi_square = 0;  // with the errors of the currents
  int degrees_of_freedom = 0;
};

/// A pixel whose mean lies more than 8 standard deviations of one frame above its site's median.
struct HotPixel {
  int x = 0;  // in active pixels
  int y = 0;
  double excess_e_per_s = 0;
};

/// Mean of one site's pixels in one group, with its deviation from the fit.
struct DarkPoint {
  int group = 0;
  int site = 0;
  double mean_dn = 0;
  Estimate residual_dn;  // its error is that of the residual, pixel by pixel; both 0 where the fit has to pass through
};

/// Results for one gain setting from darks of several exposures.
struct DarkSeries {
  PerSite<Estimate> pedestal_dn{};    // mean code without charge
  std::vector<DarkCurrent> currents;  // by rising temperature
  std::optional<DarkTemperatureLaw> law;
  /// R : G : B of the dark current where it is largest, sum 1. Absent if their sum is below five of its standard
  /// errors.
  std::optional<std::array<Estimate, 3>> chromaticity;
  Estimate dsnu;              // deviation of the pixels' dark current relative to its mean; 0 without current
  double row_noise_e = 0;     // temporal
  double column_noise_e = 0;  // fixed
  std::vector<HotPixel> hot;  // row by row, found in the group with most dark charge
  std::optional<double> hot_temperature_c;  // temperature of that group, if it is stated
  double excluded_fraction = 0;             // fraction of all pixels, excluded from all means
  double largest_correction_dn = 0;         // largest correction of a mean for excluded pixels
  std::optional<Estimate>
      read_noise_e;  // deviation of a pixel from its row, in the group with least dark charge; absent if not measurable
  std::vector<DarkPoint> points;  // four for each group
  double reduced_chi_square = 0;  // mean square of residual / error: about 1 where the mean is linear in time
  int degrees_of_freedom = 0;
  Plane<float> pedestal_map_dn;      // pedestal of every pixel, outliers included
  Plane<float> current_map_e_per_s;  // at the temperature where the dark current is largest
};

}  // namespace lowlux::calib
