#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "isp/metrics/statistics.h"
#include "isp/model/vision/seeing.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sampled_light.h"

namespace lowlux::isp {
namespace {

constexpr int thresholds[] = {1, 2, 3, 5, 7, 10};
constexpr std::uint32_t draw_purpose_flash = draw_purpose::wavelength_bin;

/// Returns the curve's width over log N, from 25 % to 75 % seen [decades of photons]; alpha moves both ends alike.
Result<double> width_decades(int threshold, double isomerisations_per_photon) {
  const auto quarter = isomerisations_seen_with(0.25, threshold);
  const auto three = isomerisations_seen_with(0.75, threshold);
  if (!quarter || !three) return tl::make_unexpected(quarter ? three.error() : quarter.error());
  return std::log10(*three / isomerisations_per_photon) - std::log10(*quarter / isomerisations_per_photon);
}

Result<Finding> shape() {
  double worst = 0, widest = 0, narrowest = 1e9;
  for (const int k : thresholds) {
    const auto reference = width_decades(k, 1);
    if (!reference) return tl::make_unexpected(reference.error());
    widest = std::max(widest, *reference);
    narrowest = std::min(narrowest, *reference);
    for (const double alpha : {1e-4, 0.03, 0.1, 0.5}) {
      const auto width = width_decades(k, alpha);
      if (!width) return tl::make_unexpected(width.error());
      worst = std::max(worst, std::fabs(*width - *reference));
    }
  }
  return Finding{
      "frequency-of-seeing/shape",
      "the curve's shape over log N depends on the threshold K only (section 2.2.1)",
      "K only",
      fmt::format("changes by {:.1e} decades", worst),
      worst < 1e-12,
      fmt::format("width from 25 to 75 %: {:.2f} decades at K = 1, {:.2f} at K = 10; alpha from 1e-4 to 1, no "
                  "dark isomerisations",
                  widest, narrowest)};
}

Result<Finding> drawn_flashes(const RunOptions& options) {
  const std::uint32_t flashes = options.quick ? 2000 : 20000;
  double worst = 0;
  std::uint32_t place = 0;
  for (const int k : thresholds) {
    for (const double photons : {20.0, 50.0, 100.0}) {
      const auto p = frequency_of_seeing({photons, 0.06, 0.2}, k);
      if (!p) return tl::make_unexpected(p.error());
      std::uint32_t seen = 0;
      for (std::uint32_t i = 0; i < flashes; ++i) {
        const double count =
            poisson_count({options.seed, frames_of_flashes, draw_purpose_flash}, i, place, photons * 0.06 + 0.2);
        if (count >= k) ++seen;
      }
      ++place;
      const double expected = *p * flashes;
      // Where nearly all or no flashes are detected, a difference of one flash is not an error.
      const double deviation = std::max(1.0, std::sqrt(expected * (1 - *p)));
      worst = std::max(worst, std::fabs(seen - expected) / deviation);
    }
  }
  return Finding{"frequency-of-seeing/drawn",
                 "a flash is seen if at least K isomerisations happen (Eq. 2.5 to 2.7)",
                 "0 standard errors",
                 fmt::format("{:.1f} standard errors at most", worst),
                 worst <= confidence_errors,
                 fmt::format("{} drawn flashes for each of {} combinations of K and N", flashes, place),
                 Finding::Kind::check};
}

Result<Finding> tail() {
  constexpr int k = 20;
  constexpr double x = 0.1;
  const auto exact = frequency_of_seeing({x, 1, 0}, k);
  if (!exact) return tl::make_unexpected(exact.error());
  double term = std::exp(-x), sum = 0;
  for (int m = 0; m < k; ++m, term *= x / m) sum += term;
  // This is the first term of the series of P(K, x) and its bound: x^K e^-x / K! (1 + x / (K + 1) + ...).
  int sign = 0;  // sign of the gamma function, which the thread-safe lgamma_r returns
  const double first = std::exp(k * std::log(x) - x - ::lgamma_r(k + 1.0, &sign));
  const bool agrees = std::fabs((1 - sum) / *exact - 1) < 1e-6;
  const bool bounded = *exact >= first * (1 - 1e-12) && *exact <= first / (1 - x / (k + 1)) * (1 + 1e-12);
  return Finding{
      "frequency-of-seeing/tail",
      "P(see) as 1 minus a sum of Poisson terms (Eq. 2.7)",
      fmt::format("{:.2e} by that sum in double", 1 - sum),
      fmt::format("{:.4e} by the gamma function", *exact),
      agrees,
      fmt::format("K = 20, x = 0.1: the sum loses all digits where P is small; ours {} the bounds of its series",
                  bounded ? "keeps" : "breaks"),
      Finding::Kind::check};
}

Result<Plot> curves() {
  Plot plot{"frequency-of-seeing", "Frequency of seeing", "photons at the cornea N", "P(see)", AxisScale::logarithmic};
  for (const int k : thresholds) {
    Series series{fmt::format("K = {}", k), {}, {}, Mark::line};
    for (int i = 0; i <= 60; ++i) {
      const double photons = std::pow(10.0, 0.5 + i / 20.0);
      const auto p = frequency_of_seeing({photons, 0.06, 0}, k);
      if (!p) return tl::make_unexpected(p.error());
      series.x.push_back(photons);
      series.y.push_back(*p);
    }
    plot.series.push_back(series);
  }
  plot.caption = "Eq. 2.7 with alpha = 0.06: another alpha moves the curves sideways.";
  return plot;
}

}  // namespace

Result<Outcome> run_frequency_of_seeing(const RunOptions& options) {
  Outcome out;
  for (const auto& finding : {shape(), drawn_flashes(options), tail()}) {
    if (!finding) return tl::make_unexpected(finding.error());
    out.findings.push_back(*finding);
  }
  const auto plot = curves();
  if (!plot) return tl::make_unexpected(plot.error());
  out.plots.push_back(*plot);
  return out;
}

}  // namespace lowlux::isp
