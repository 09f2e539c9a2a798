#include "isp/model/contrast_sensitivity.h"

#include <algorithm>
#include <cmath>

namespace lowlux::isp {

double barten_sensitivity(double cycles_per_degree, double luminance_cd_m2, double field_deg) {
  if (!(luminance_cd_m2 > 0)) return 0;
  const double u2 = cycles_per_degree * cycles_per_degree;
  const double optics = std::exp(-0.0016 * u2 * std::pow(1 + 100 / luminance_cd_m2, 0.08));
  const double integration = 1 + 144 / (field_deg * field_deg) + 0.64 * u2;
  const double noise = 63 / std::pow(luminance_cd_m2, 0.83) + 1 / (1 - std::exp(-0.02 * u2));
  return 5200 * optics / std::sqrt(integration * noise);
}

double threshold_contrast(double luminance_cd_m2) {
  constexpr double cycles_per_degree = 2, field_deg = 10;
  constexpr double anchor_cd_m2 = 100, anchor = 0.0041, most = 0.999;
  static const double scale = anchor * barten_sensitivity(cycles_per_degree, anchor_cd_m2, field_deg);
  const double sensitivity = barten_sensitivity(cycles_per_degree, luminance_cd_m2, field_deg);
  return sensitivity * most > scale ? scale / sensitivity : most;
}

double threshold_log_contrast(double luminance_cd_m2) {
  const double m = threshold_contrast(luminance_cd_m2);
  return 0.5 * std::log10((1 + m) / (1 - m));
}

}  // namespace lowlux::isp
