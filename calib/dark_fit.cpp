#include "calib/dark_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/poisson_gauss.h"

namespace lowlux::calib {
namespace {

constexpr double cut_deviations = 5;
constexpr double quantisation_dn2 = 1.0 / 12;
constexpr double dithered_variance_dn2 = 0.25 + quantisation_dn2;  // half a code of noise, and quantisation's
constexpr double same_temperature_c = 1;
constexpr int iterations = 3;  // of corrections that are a small part of a mean

void name_temperatures(DarkFit& s) {
  const auto celsius = [](const DarkGroup& g) { return g.setting.temperature_c.value_or(0); };
  for (const DarkGroup& g : s.groups) s.temperature_c.push_back(celsius(g));
  std::sort(s.temperature_c.begin(), s.temperature_c.end());
  const auto same = [](double a, double b) { return b - a <= same_temperature_c; };
  s.temperature_c.erase(std::unique(s.temperature_c.begin(), s.temperature_c.end(), same), s.temperature_c.end());
  for (const DarkGroup& g : s.groups) {
    const auto above = std::upper_bound(s.temperature_c.begin(), s.temperature_c.end(), celsius(g));
    s.temperature_of.push_back(static_cast<int>(above - s.temperature_c.begin()) - 1);
  }
}

void exclude_outliers(DarkFit& s) {
  const FrameSetting& setting = s.groups.front().setting;
  s.mask = PixelMask(setting.width, setting.height);
  std::fill_n(s.mask.data(), s.mask.size(), std::uint8_t{0});
  for (const DarkGroup& group : s.groups) {
    PerSite<SiteSpread> spread{};
    for (int site = 0; site < 4; ++site) spread[site] = spread_of(group.mean_dn, site, 0.5 / group.frames);
    for (int y = 0; y < setting.height; ++y) {
      for (int x = 0; x < setting.width; ++x) {
        const SiteSpread& own = spread[site_of(x, y)];
        s.mask.at(x, y) |= std::fabs(group.mean_dn.at(x, y) - own.median) > cut_deviations * own.deviation;
      }
    }
    s.spread.push_back(spread);
  }
}

Result<void> measure_noise(DarkFit& s) {
  for (std::size_t g = 0; g < s.groups.size(); ++g) {
    PerSite<double> noise{};
    const double one = 1;
    for (int site = 0; site < 4; ++site) {
      const auto figures = figures_of({s.groups.subspan(g, 1), {&one, 1}}, s.mask, site);
      noise[site] = figures.temporal_variance * s.groups[g].frames;
      if (noise[site] >= dithered_variance_dn2) continue;
      return fail(
          ErrorCode::insufficient,
          fmt::format("group {} of the darks scatters by {:.2g} DN, so that whole codes do not average out; means "
                      "need {:.2g} DN (half a code and its rounding); use a higher gain",
                      g + 1, std::sqrt(noise[site]), std::sqrt(dithered_variance_dn2)));
    }
    s.noise_dn2.push_back(noise);
  }
  return {};
}

Result<void> make_estimators(DarkFit& s) {
  for (std::size_t g = 0; g < s.groups.size(); ++g) {
    std::vector<double> row(1 + s.temperature_c.size());
    row[0] = 1;
    row[1 + s.temperature_of[g]] = *s.groups[g].setting.exposure_s;
    s.design.push_back(std::move(row));
  }
  for (int site = 0; site < 4; ++site) {
    std::vector<double> weights;
    for (std::size_t g = 0; g < s.groups.size(); ++g) {
      weights.push_back(s.groups[g].frames / s.noise_dn2[g][site]);
    }
    auto estimators = linear_estimators(s.design, weights);
    if (!estimators) {
      return fail(
          ErrorCode::insufficient,
          fmt::format("{} groups of darks at {} temperatures do not tell pedestal from dark current; add another "
                      "exposure time, the longest at least ten times the shortest",
                      s.groups.size(), s.temperature_c.size()));
    }
    s.estimators[site] = std::move(*estimators);
  }
  return {};
}

/// The law of a stack's mean is that of its frames' sum: Poisson + normal, the pixels' own spread taken as normal.
double exclusion_bias_dn(const DarkFit& s, std::size_t g, int site, double pedestal_dn) {
  const double one = 1, gain = s.gain.value, frames = s.groups[g].frames;
  const ImageFigures figures = figures_of({s.groups.subspan(g, 1), {&one, 1}}, s.mask, site);
  const SiteSpread& spread = s.spread[g][site];
  const auto sum_e = [&](double dn) { return frames * (dn - pedestal_dn) / gain; };
  const double dark_e = std::clamp(sum_e(figures.mean + s.correction_dn[g][site]), 0.0, 1e6);
  const double total_e2 = frames * frames * figures.variance / (gain * gain);
  const double least_e2 = frames * quantisation_dn2 / (gain * gain);
  const PoissonGauss law{dark_e, std::max(total_e2 - dark_e, least_e2)};
  const double cut_dn = cut_deviations * spread.deviation;
  return truncation_bias_e(law, sum_e(spread.median - cut_dn), sum_e(spread.median + cut_dn)) * gain / frames;
}

void correct_for_exclusion(DarkFit& s) {
  s.correction_dn.assign(s.groups.size(), {});
  for (int i = 0; i < iterations; ++i) {
    for (int site = 0; site < 4; ++site) {
      const double pedestal = estimate(s, s.estimators[site][0], site).value;
      for (std::size_t g = 0; g < s.groups.size(); ++g) {
        s.correction_dn[g][site] = -exclusion_bias_dn(s, g, site, pedestal);
      }
    }
  }
}

}  // namespace

Estimate estimate(const DarkFit& s, const std::vector<double>& weights, int site) {
  const ImageFigures figures = figures_of({s.groups, weights}, s.mask, site);
  double correction = 0;
  for (std::size_t g = 0; g < weights.size(); ++g) correction += weights[g] * s.correction_dn[g][site];
  return {figures.mean + correction, figures.standard_error};
}

DarkFit begin_fit(std::span<const DarkGroup> groups, const Estimate& gain_dn_per_e) {
  DarkFit out{.groups = groups, .gain = gain_dn_per_e};
  name_temperatures(out);
  exclude_outliers(out);
  return out;
}

Result<void> finish_fit(DarkFit& fit) {
  if (auto good = measure_noise(fit); !good) return good;
  if (auto good = make_estimators(fit); !good) return good;
  correct_for_exclusion(fit);
  return {};
}

}  // namespace lowlux::calib
