#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "calib/chart/colour_fit.h"
#include "calib/dark/dark_series.h"
#include "isp/model/spectrum/cie_data.h"
#include "tests/properties/draws.h"

namespace lowlux::calib {
namespace {

using namespace properties;

RC_GTEST_PROP(ColourFitProperty, AnExactMatrixComesBackWithTheLightThatFell, ()) {
  const Spectrum light = *isp::light_named("D65");
  const auto reference = *chart_reference(light);
  Matrix3 matrix = identity3();
  for (auto& row : matrix) {
    for (double& value : row) value += any_between(-0.25, 0.25);
  }
  const LightGradient gradient{any_between(-0.2, 0.2), any_between(-0.2, 0.2)};
  const Matrix3 to_camera = any_between(0.01, 10) * *inverse(matrix);  // diagonally dominant
  std::vector<ColourSample> samples;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    ColourSample sample{to_camera * vector_of(reference[i]), reference[i], (static_cast<double>(i % 6) - 2.5) / 3,
                        (static_cast<double>(i / 6) - 1.5) / 2};
    for (double& value : sample.camera_rgb) value *= gradient.at(sample.x, sample.y);
    samples.push_back(sample);
  }
  const isp::Xyz sum = isp::xyz_of(light);
  const isp::Xyz white{sum.x / sum.y, 1, sum.z / sum.y};
  const auto fit = fit_colour(samples, {.white = white, .minimise_ciede2000 = false});
  RC_ASSERT(fit.has_value());
  RC_ASSERT(std::abs(fit->light.per_x - gradient.per_x) < 1e-8);
  RC_ASSERT(std::abs(fit->light.per_y - gradient.per_y) < 1e-8);
  RC_ASSERT(summary_of(colour_errors(*fit, samples, white)).largest < 1e-6);
}

/// The mean of some darks: Gaussian scatter about a pedestal and a charge that grows with time.
DarkGroup any_dark(const PerSite<double>& pedestal_dn, const PerSite<double>& slope_dn, double time_s, int size_px,
                   std::mt19937& random) {
  constexpr int frames = 8;
  constexpr double scatter_dn = 6;
  DarkGroup out{
      .frames = frames, .mean_dn = Plane<float>(size_px, size_px), .variance_dn2 = Plane<float>(size_px, size_px)};
  out.setting = {.make = "Maker", .model = "Model", .width = size_px, .height = size_px};
  out.setting.white_dn.fill(16383);
  out.setting.exposure_s = time_s;
  std::normal_distribution<double> normal;
  for (int y = 0; y < size_px; ++y) {
    for (int x = 0; x < size_px; ++x) {
      const auto site = static_cast<std::size_t>(site_of(x, y));
      const double variance = scatter_dn * scatter_dn + slope_dn[site] * time_s;
      const double mean = pedestal_dn[site] + slope_dn[site] * time_s;
      out.mean_dn.at(x, y) = static_cast<float>(mean + std::sqrt(variance / frames) * normal(random));
      out.variance_dn2.at(x, y) = static_cast<float>(variance);
    }
  }
  return out;
}

// Eight standard errors: one in 1e15 of normal estimates lies beyond, and a few hundred are looked at.
RC_GTEST_PROP(DarkSeriesProperty, DarksThatGrowWithTimeGiveThatCurrent, ()) {
  PerSite<double> pedestal_dn{}, current{};
  for (std::size_t site = 0; site < 4; ++site) pedestal_dn[site] = any_between(100, 2000);
  const double red = any_between(0.5, 20), green = any_between(0.5, 20), blue = any_between(0.5, 20);
  current = {red, green, green, blue};
  const double gain = 1;  // variance = mean where charge is counted in codes
  auto random = any_random();
  std::vector<DarkGroup> groups;
  for (const double time_s : {0.0, 4.0, 10.0}) groups.push_back(any_dark(pedestal_dn, current, time_s, 96, random));
  const auto found = fit_dark_series(groups, {gain, 0});
  RC_ASSERT(found.has_value());
  for (std::size_t site = 0; site < 4; ++site) {
    const Estimate& pedestal = found->pedestal_dn[site];
    RC_ASSERT(std::abs(pedestal.value - pedestal_dn[site]) < 8 * pedestal.standard_error + 1e-3);
  }
  const std::array<double, 3> expected{red, green, blue};
  for (std::size_t k = 0; k < 3; ++k) {
    const Estimate& d = found->currents.at(0).current_e_per_s[k];
    RC_ASSERT(std::abs(d.value - expected[k]) < 8 * d.standard_error + 1e-4);
  }
}

}  // namespace
}  // namespace lowlux::calib
