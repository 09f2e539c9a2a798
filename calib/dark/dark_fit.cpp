#include "calib/dark/dark_fit.h"
#include "isp/base/sensor.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include <fmt/format.h>

namespace lowlux::calib {
namespace {

constexpr double cut_deviations = 5;
constexpr double dithered_variance_dn2 = 0.25 + quantisation_dn2;  // half a code of noise, with quantisation
constexpr int iterations = 3;                                      // of corrections that are a small fraction of a mean

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
      return fail(ErrorCode::insufficient,
                  fmt::format("the noise of group {} of the darks is {:.2g} DN, less than the {:.2g} DN that average "
                              "out the rounding to codes; use a higher gain",
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
          fmt::format("{} groups of darks at {} temperatures do not separate pedestal from dark current; add another "
                      "exposure time, the longest at least ten times the shortest",
                      s.groups.size(), s.temperature_c.size()));
    }
    s.estimators[site] = std::move(*estimators);
  }
  return {};
}

/// Returns the bias by excluded pixels. The distribution of a stack's mean is that of its frames' sum: Poisson +
/// normal, the pixels' own spread taken as normal.
double exclusion_bias_dn(const DarkFit& s, std::size_t g, int site, double pedestal_dn) {
  const double one = 1, gain = s.gain.value, frames = s.groups[g].frames;
  const ImageFigures figures = figures_of({s.groups.subspan(g, 1), {&one, 1}}, s.mask, site);
  const SiteSpread& spread = s.spread[g][site];
  const auto sum_e = [&](double dn) { return frames * (dn - pedestal_dn) / gain; };
  const double dark_e = std::clamp(sum_e(figures.mean + s.correction_dn[g][site]), 0.0, 1e6);
  const double total_e2 = frames * frames * figures.variance / (gain * gain);
  const double min_e2 = frames * quantisation_dn2 / (gain * gain);
  const PoissonGauss law{dark_e, std::max(total_e2 - dark_e, min_e2)};
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

namespace {

constexpr double singular = 1e-12;  // of a column's own square: remainder that elimination leaves of dependent columns

}  // namespace

std::optional<Design> linear_estimators(const Design& design, std::span<const double> weights) {
  const std::size_t observations = design.size();
  const std::size_t parameters = observations > 0 ? design.front().size() : 0;
  if (parameters == 0) return std::nullopt;
  Design normal(parameters, std::vector<double>(parameters)), out(parameters, std::vector<double>(observations));
  for (std::size_t i = 0; i < parameters; ++i) {
    for (std::size_t k = 0; k < observations; ++k) {
      out[i][k] = weights[k] * design[k][i];
      for (std::size_t j = 0; j < parameters; ++j) normal[i][j] += out[i][k] * design[k][j];
    }
  }
  const Design before = normal;
  // Symmetric and positive semidefinite: the diagonal holds the pivots.
  for (std::size_t i = 0; i < parameters; ++i) {
    const double pivot = normal[i][i];
    if (!(pivot > singular * before[i][i])) return std::nullopt;
    for (std::size_t row = 0; row < parameters; ++row) {
      if (row == i) continue;
      const double factor = normal[row][i] / pivot;
      for (std::size_t j = 0; j < parameters; ++j) normal[row][j] -= factor * normal[i][j];
      for (std::size_t k = 0; k < observations; ++k) out[row][k] -= factor * out[i][k];
    }
  }
  for (std::size_t i = 0; i < parameters; ++i) {
    for (double& weight : out[i]) weight /= normal[i][i];
  }
  return out;
}

namespace {

double below(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }
double density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi); }

/// Calls visit(count, probability) for the Poisson counts with a significant probability.
template <class Visit>
void for_each_count(double mean, const Visit& visit) {
  const double reach = 10 * std::sqrt(mean) + 40;
  const double first = std::max(0.0, std::floor(mean - reach)), last = std::ceil(mean + reach);
  const double counts = last - first + 1;  // 0 for a NaN mean
  int sign = 0;                            // sign of the gamma function; needed by its thread-safe form
  for (int i = 0; i < counts; ++i) {
    const double k = first + i;
    visit(k, mean > 0 ? std::exp(k * std::log(mean) - mean - ::lgamma_r(k + 1, &sign)) : (k == 0 ? 1.0 : 0.0));
  }
}

}  // namespace

double truncation_bias_e(const PoissonGauss& law, double low_e, double high_e) {
  assert(law.normal_variance_e2 > 0);
  const double deviation = std::sqrt(law.normal_variance_e2);
  double share = 0, sum = 0;
  for_each_count(law.poisson_mean_e, [&](double k, double p) {
    const double a = (low_e - k) / deviation, b = (high_e - k) / deviation;
    const double inside = a > 0 ? below(-a) - below(-b) : below(b) - below(a);  // no cancellation in either tail
    share += p * inside;
    sum += p * ((k - law.poisson_mean_e) * inside + deviation * (density(a) - density(b)));
  });
  return share > 0 ? sum / share : 0;
}

namespace {

/// Returns the weights that give the residual of one group from the groups' means.
std::vector<double> residual_weights(const DarkFit& s, std::size_t group, int site) {
  std::vector<double> out(s.groups.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t p = 0; p < s.estimators[site].size(); ++p) {
      out[i] -= s.design[group][p] * s.estimators[site][p][i];
    }
  }
  out[group] += 1;
  return out;
}

/// Returns whether the fit passes through a group's mean whatever the means are: what is left of it is rounding.
bool is_zero(const std::vector<double>& weights) {
  return std::ranges::all_of(weights, [](double weight) { return std::fabs(weight) < 1e-9; });
}

}  // namespace

std::vector<DarkPoint> points_of(const DarkFit& fit, std::span<const PerSite<Estimate>> parameters) {
  std::vector<DarkPoint> out;
  out.reserve(4 * fit.groups.size());
  for (std::size_t g = 0; g < fit.groups.size(); ++g) {
    for (int site = 0; site < 4; ++site) {
      const std::vector<double> weights = residual_weights(fit, g, site);
      const Estimate off = is_zero(weights) ? Estimate{} : estimate(fit, weights, site);
      double fitted = 0;
      for (std::size_t p = 0; p < parameters.size(); ++p) fitted += fit.design[g][p] * parameters[p][site].value;
      out.push_back({static_cast<int>(g), site, fitted + off.value, off});
    }
  }
  return out;
}

std::optional<Estimate> read_noise_of(const DarkFit& fit, std::size_t group, const PerSite<double>& dark_charge_dn) {
  const double gain = fit.gain.value, frames = fit.groups[group].frames;
  double square = 0, error2 = 0;
  for (int site = 0; site < 4; ++site) {
    const double noise = fit.noise_dn2[group][site];
    const double row = std::max(0.0, fit.groups[group].row_variance_dn2[site]);
    const double pixels = static_cast<double>(fit.mask.size()) / 4;
    square += (noise - row - quantisation_dn2 - gain * dark_charge_dn[site]) / 4;
    error2 += 2 * noise * noise / (pixels * (frames - 1)) / 16;
  }
  if (!(square > 0)) return std::nullopt;
  const double read_dn = std::sqrt(square), relative_gain = fit.gain.standard_error / gain;
  return Estimate{read_dn / gain, read_dn / gain * std::hypot(std::sqrt(error2) / (2 * square), relative_gain)};
}

Plane<float> map_of(const DarkFit& fit, std::size_t parameter, double unit) {
  Plane<float> out(fit.mask.width(), fit.mask.height());
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      const std::vector<double>& weights = fit.estimators[site_of(x, y)][parameter];
      double value = 0;
      for (std::size_t g = 0; g < weights.size(); ++g) value += weights[g] * fit.groups[g].mean_dn.at(x, y);
      out.at(x, y) = static_cast<float>(value / unit);
    }
  }
  return out;
}

}  // namespace lowlux::calib
