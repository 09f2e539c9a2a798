#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "isp/metrics/statistics.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sampled_light.h"

namespace lowlux::isp {
namespace {

// The levels continue below the thesis' last one until most samples have no photon: there the API has to report that
// there is no spectrum.
constexpr double levels_w[] = {1e-9, 1e-11, 1e-12, 1e-13, 1e-14, 6e-15, 1e-16, 1e-17, 1e-18};
constexpr double fewest_photons = 1000;  // minimum per sample, for the laws that hold to first order in 1 / photons

struct Level {
  double power_w = 0;
  double photons = 0;             // expected number, all wavelengths
  std::vector<double> distances;  // Eq. 3.8, of the samples that have a spectrum
  std::vector<double> squares;
  int without_photon = 0;
  double expected_square = 0;
  std::vector<Spectrum> examples;  // spectrum of the first sample, if it has one
};

Result<Level> sample_level(const Spectrum& light, std::uint32_t index, std::uint32_t samples, std::uint64_t seed) {
  Level out;
  out.power_w = levels_w[index];
  const auto means = mean_photons(light, out.power_w, photon_exposure_s);
  const auto truth = normalised(light);
  if (!means || !truth) return tl::make_unexpected(means ? truth.error() : means.error());
  for (const double photons : means->photons) out.photons += photons;
  out.expected_square = expected_squared_distance(*means).value_or(0);
  for (std::uint32_t sample = 0; sample < samples; ++sample) {
    const auto seen =
        estimated_spectrum(*means, draw_photons(*means, {seed, frames_of_few_photons + index, 0, sample}));
    if (!seen) {
      ++out.without_photon;
      continue;
    }
    out.distances.push_back(spectral_distance(*seen, *truth));
    out.squares.push_back(out.distances.back() * out.distances.back());
    if (sample == 0) out.examples.push_back(*seen);
  }
  return out;
}

Finding distance_grows(const std::vector<Level>& levels) {
  bool grows = true;
  double before = 0;
  for (const Level& level : levels) {
    if (level.photons < fewest_photons) break;
    const double mean = mean_of(level.distances).value;
    grows = grows && mean > before;
    before = mean;
  }
  return {"few-photons/distance-grows",
          "the estimated spectrum departs from the bright one as light falls (Fig. 3-1, 3-2)",
          "grows",
          fmt::format("mean D {:.2g} at {:.0e} W, {:.2g} at 6e-15 W", mean_of(levels[0].distances).value,
                      levels[0].power_w, before),
          grows,
          "D of Eq. 3.8 in nm^-1/2, Munsell 5Y 5/4 under equi-energy light"};
}

Finding distance_law(const std::vector<Level>& levels) {
  std::vector<double> x;
  std::vector<Estimate> y;
  for (const Level& level : levels) {
    if (level.photons < fewest_photons) break;
    const Estimate square = mean_of(level.squares);
    x.push_back(level.power_w);
    y.push_back({0.5 * std::log(square.value), 0.5 * square.standard_error / square.value});
  }
  const Estimate fit = power_law_exponent(x, y);
  return {"few-photons/distance-law",
          "that distance follows the photons' relative noise (Eq. 3.5 to 3.8)",
          "F^-0.5",
          fmt::format("F^{:.4f} +- {:.4f}", fit.value, fit.standard_error),
          std::fabs(fit.value + 0.5) <= confidence_errors * fit.standard_error,
          "exponent of the root mean square distance from 1e-9 to 6e-15 W; -0.5 follows from Poisson counts",
          Finding::Kind::check};
}

Finding distance_predicted(const std::vector<Level>& levels) {
  double worst = 0;
  for (const Level& level : levels) {
    if (level.photons < fewest_photons) break;
    const Estimate square = mean_of(level.squares);
    worst = std::max(worst, std::fabs(square.value - level.expected_square) / square.standard_error);
  }
  return {"few-photons/distance-predicted",
          "its mean square is that of independent Poisson bins (Eq. 3.5)",
          "0 standard errors",
          fmt::format("{:.1f} standard errors at most", worst),
          worst <= confidence_errors,
          "against the first-order expectation of E[D^2]",
          Finding::Kind::check};
}

Finding no_photon(const std::vector<Level>& levels, std::uint32_t samples) {
  double worst = 0;
  for (const Level& level : levels) {
    const double p = std::exp(-level.photons);
    const double deviation = std::sqrt(p * (1 - p) * samples);
    const double difference = std::fabs(level.without_photon - p * samples);
    // Where p is practically 0 or 1, the deviation is below one count.
    worst = std::max(worst, difference / std::max(deviation, 1.0));
  }
  const Level& last = levels.back();
  return {"few-photons/no-photon",
          "without a photon there is no spectrum (section 3.3)",
          fmt::format("{:.1f} of {} samples at {:.0e} W", std::exp(-last.photons) * samples, samples, last.power_w),
          fmt::format("{} of {}", last.without_photon, samples),
          worst <= confidence_errors,
          fmt::format("expected exp(-{:.2f} photons); such samples are reported, not replaced", last.photons),
          Finding::Kind::check};
}

std::vector<Plot> plots_of(const Spectrum& light, const std::vector<Level>& levels) {
  Plot spectra{"few-photons-spectra", "Normalised spectra through few photons", "wavelength [nm]", "spectrum [nm^-1]"};
  const auto add = [&](const std::string& name, const Spectrum& s, Mark mark) {
    spectra.series.push_back(
        {name, {s.wavelengths_nm().begin(), s.wavelengths_nm().end()}, {s.values().begin(), s.values().end()}, mark});
  };
  add("bright", *normalised(light), Mark::dashed);
  for (const Level& level : levels) {
    if (level.photons > 1e6 || level.photons < 50) continue;
    for (const Spectrum& s : level.examples) add(fmt::format("{:.0e} W", level.power_w), s, Mark::line);
  }
  spectra.caption = "As Figure 3-1: one sample for each level, 0.2 s, bins of 5 nm.";
  Plot distance{
      "few-photons-distance", "Distance to the bright spectrum", "F [W]", "D [nm^-1/2]", AxisScale::logarithmic,
      AxisScale::logarithmic};
  Series sampled{"mean of samples", {}, {}, Mark::points}, expected{"first order", {}, {}, Mark::line};
  for (const Level& level : levels) {
    if (level.distances.size() < 2) continue;
    sampled.x.push_back(level.power_w);
    sampled.y.push_back(mean_of(level.distances).value);
    expected.x.push_back(level.power_w);
    expected.y.push_back(std::sqrt(level.expected_square));
  }
  distance.series = {sampled, expected};
  distance.caption = "As Figure 3-2.";
  return {spectra, distance};
}

}  // namespace

Result<Outcome> run_few_photons(const RunOptions& options) {
  const Spectrum light = reflected(*light_named("E"), *spectrum_named(SpectrumSet::munsell_ten, "5Y_5_4"));
  const std::uint32_t samples = options.quick ? 50 : 200;
  std::vector<Level> levels;
  for (std::uint32_t i = 0; i < std::size(levels_w); ++i) {
    auto level = sample_level(light, i, samples, options.seed);
    if (!level) return tl::make_unexpected(level.error());
    levels.push_back(*std::move(level));
  }
  Outcome out;
  out.findings = {distance_grows(levels), distance_law(levels), distance_predicted(levels), no_photon(levels, samples)};
  out.plots = plots_of(light, levels);
  return out;
}

}  // namespace lowlux::isp
