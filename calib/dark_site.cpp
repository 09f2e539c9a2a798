#include "calib/dark_site.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace lowlux::calib {
namespace {

constexpr double least_deviation_dn = 1e-3;
constexpr double far_out = 5;  // standard deviations: left out of means
constexpr double hot = 8;      // standard deviations
constexpr std::size_t fewest_hot = 16;

double noise_of_differences(const Plane<float>& dn, int site) {
  Plane<float> difference(dn.width() - 2, dn.height());
  for (int y = 0; y < difference.height(); ++y) {
    for (int x = 0; x < difference.width(); ++x) difference.at(x, y) = dn.at(x + 2, y) - dn.at(x, y);
  }
  const double deviation = spread_of(difference, site, least_deviation_dn).deviation;
  return deviation * deviation / 2;
}

}  // namespace

PerSite<DarkSite> sites_of(const DarkGroup& group) {
  PerSite<DarkSite> out{};
  for (int site = 0; site < 4; ++site) {
    const SiteSpread spread = spread_of(group.mean_dn, site, least_deviation_dn);
    double sum = 0, n = 0;
    for (int y = site >> 1; y < group.mean_dn.height(); y += 2) {
      for (int x = site & 1; x < group.mean_dn.width(); x += 2) {
        if (std::fabs(group.mean_dn.at(x, y) - spread.median) > far_out * spread.deviation) continue;
        sum += group.variance_dn2.at(x, y);
        ++n;
      }
    }
    out[site] = {spread, group.frames > 1 && n > 0 ? sum / n : noise_of_differences(group.mean_dn, site)};
  }
  return out;
}

double hot_pixel_gain_dn(const DarkGroup& group, const PerSite<DarkSite>& sites) {
  if (group.frames < 2) return 0;
  std::vector<double> gains;
  for (int y = 0; y < group.mean_dn.height(); ++y) {
    for (int x = 0; x < group.mean_dn.width(); ++x) {
      const DarkSite& site = sites[site_of(x, y)];
      const double excess = group.mean_dn.at(x, y) - site.spread.median;
      if (excess * excess <= hot * hot * site.noise_dn2 || excess <= 0) continue;
      gains.push_back((group.variance_dn2.at(x, y) - site.noise_dn2) / excess);
    }
  }
  if (gains.size() < fewest_hot) return 0;
  const auto middle = gains.begin() + static_cast<std::ptrdiff_t>(gains.size() / 2);
  std::ranges::nth_element(gains, middle);
  const double degrees = group.frames - 1;
  return std::max(0.0, *middle / std::pow(1 - 2 / (9 * degrees), 3));
}

}  // namespace lowlux::calib
