#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "isp/metrics/convex_hull.h"
#include "isp/metrics/statistics.h"
#include "isp/model/sensor/photon.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sampled_light.h"
#include "isp/reproduce/sensor_scatter.h"

namespace lowlux::isp {
namespace {

constexpr double half = 0.5;

Result<SensorScenarios> run_all(const ThesisCamera& camera, const RunOptions& options) {
  const auto twenty = thesis_patches(camera, scenario_i_patches);
  if (!twenty) return tl::make_unexpected(twenty.error());
  const std::vector<Patch> thirteen(twenty->begin(), twenty->begin() + scenario_ii_patches);
  const int samples = options.quick ? 60 : 200;
  const double published_light = published_etendue_m2_sr / camera.response.etendue_m2_sr;
  constexpr Quantisation below = Quantisation::floor, nearest = Quantisation::round;
  struct Run {
    Scenario scenario;
    const std::vector<Patch>& patches;
    std::vector<LevelResult> SensorScenarios::*result;
  };
  const Run runs[] = {
      {{{}, frames_of_sensor + 0x60, samples, photon_levels, published_light}, *twenty, &SensorScenarios::published},
      {{{}, frames_of_sensor + 0x10, samples}, *twenty, &SensorScenarios::photons},
      {{{.dark = true}, frames_of_sensor + 0x20, samples}, thirteen, &SensorScenarios::dark},
      {{{true, true, true, below}, frames_of_sensor + 0x30, samples}, thirteen, &SensorScenarios::all},
      {{{true, true, true, nearest}, frames_of_sensor + 0x40, samples}, thirteen, &SensorScenarios::nearest}};
  SensorScenarios out;
  for (const Run& run : runs) {
    auto result = run_scenario(camera, run.patches, run.scenario, options.seed);
    if (!result) return tl::make_unexpected(result.error());
    out.*run.result = *std::move(result);
  }
  return out;
}

double jnd_of_dark(const LevelResult& level) {
  return mean_over(level, [](const PatchResult& p) { return noticeable_differences(p.truth, p.expected.mean); });
}

double area_of(const LevelResult& level, bool with_dark) {
  std::vector<Xy> points;
  for (const PatchResult& p : level.patches) points.push_back(with_dark ? p.expected.mean : p.truth);
  return hull_area(points);
}

Finding dark_matters(const SensorScenarios& s) {
  double first = 0;
  for (const LevelResult& level : s.dark) {
    if (first == 0 && area_of(level, true) < half * area_of(level, false)) first = cd_m2_per_level * level.level;
  }
  return {"sensor-scenarios/dark-matters",
          "dark current matters from 10 cd/m2 down (section 4, scenario II)",
          "10 cd/m2",
          fmt::format("{:.3g} cd/m2", first),
          first == 10,
          fmt::format("first level with less than half of the gamut's area; the mean shift is {:.1f} just noticeable "
                      "differences (3 MacAdam deviations) at 100 cd/m2, {:.1f} at 10, {:.1f} at 0.1",
                      jnd_of_dark(s.dark[0]), jnd_of_dark(s.dark[2]), jnd_of_dark(s.dark[6]))};
}

Finding means_stay(const SensorScenarios& s) {
  const double worst = worst_mean_error(s.photons);
  return {"sensor-scenarios/photons-scatter",
          "photon noise scatters chromaticities and does not move them (scenario I)",
          "scatters, does not move",
          fmt::format("{:.1f} standard errors at most", worst),
          worst <= confidence_errors,
          fmt::format("chromaticity of the mean code, {} patches at {} levels", scenario_i_patches,
                      std::size(sensor_levels))};
}

Finding means_on_line(const SensorScenarios& s) {
  const double worst = worst_mean_error(s.dark);
  return {"sensor-scenarios/dark-moves",
          "dark current moves the means along the line to the black point (scenario II)",
          "within the confidence interval",
          fmt::format("{:.1f} standard errors at most", worst),
          worst <= confidence_errors,
          fmt::format("against Eq. 4.23, {} patches at {} levels", scenario_ii_patches, std::size(sensor_levels))};
}

struct Movement {
  double by_dark = 0;    // mean shift of the expectation
  double by_others = 0;  // mean distance of the mean code's chromaticity from the expectation
  int patches = 0;
};

// Averages over levels below 10 cd/m2, where no patch saturates.
Movement movement(const std::vector<LevelResult>& levels) {
  Movement out;
  for (const LevelResult& level : levels) {
    if (level.level > 0.1) continue;
    for (const PatchResult& p : level.patches) {
      if (p.saturated > 0 || !p.mean_code_xy) continue;
      out.by_dark += distance(p.truth, p.expected.mean);
      out.by_others += distance(*p.mean_code_xy, p.expected.mean);
      ++out.patches;
    }
  }
  return out;
}

Finding dark_moves_most(const SensorScenarios& s, bool rounded) {
  const Movement m = movement(rounded ? s.nearest : s.all);
  const double ratio = m.by_dark / m.by_others;
  const std::string how = rounded ? "nearest" : "below";
  return {
      "sensor-scenarios/dark-moves-most-" + how,
      "dark current moves chromaticity far more than photon, read and quantisation noise (scenario III), code " + how,
      "far more",
      fmt::format("{:.0f} times as far", ratio),
      ratio > 10,
      fmt::format("mean over {} patches and levels without saturation: {:.4f} in xy against {:.4f}{}", m.patches,
                  m.by_dark / m.patches, m.by_others / m.patches,
                  rounded ? "" : "; the integer part of Eq. 4.10 takes half a code, 18 e-, from each channel")};
}

Finding saturation(const SensorScenarios& s) {
  int flagged = 0, dim = 0, total = 0;
  for (const LevelResult& level : s.all) {
    for (const PatchResult& p : level.patches) {
      flagged += p.saturated;
      total += p.saturated + p.unsaturated;
      if (level.level <= 0.1) dim += p.saturated;
    }
  }
  return {"sensor-scenarios/saturation",
          "saturated samples have no meaningful chromaticity (scenario III)",
          "-",
          fmt::format("{} of {} samples flagged and left out, {} of them at 10 cd/m2 or below", flagged, total, dim),
          dim == 0,
          "a channel has a code of a saturated pixel (254 or 255); the bluest patches give more charge in blue than "
          "white in any channel",
          Finding::Kind::check};
}

/// Returns variance over mean of the electrons of one channel by the published sampling: sum x Qe^2 / sum x Qe.
double published_ratio(const ThesisCamera& camera, const Patch& patch, int channel) {
  const auto photons = photon_radiance(patch.radiance);
  const Spectrum& qe = camera.response.quantum_efficiency[channel];
  const double mean = integrate(*photons, [&](double nm) { return qe.at(nm); });
  return integrate(*photons, [&](double nm) { return qe.at(nm) * qe.at(nm); }) / mean;
}

Result<Finding> published_sampling(const ThesisCamera& camera, const RunOptions& options) {
  const auto patches = thesis_patches(camera, 8);
  if (!patches) return tl::make_unexpected(patches.error());
  const Patch& white = patches->back();
  const int samples = options.quick ? 500 : 4000;
  const Noises noises{.sampling = capture::PhotonSampling::published};
  const auto drawn = photograph(camera, white, 0.1, noises, {options.seed, frames_of_sensor + 0x50, 0}, samples);
  double worst = 0;
  Vector3 ratio{};
  for (int k = 0; k < 3; ++k) {
    std::vector<double> electrons;
    for (const Vector3& dn : drawn.dn) electrons.push_back(dn[k] / camera.sensor.system_gain_dn_per_e);
    const Estimate mean = mean_of(electrons);
    ratio[k] = mean.standard_error * mean.standard_error * samples / mean.value;
    const double expected = published_ratio(camera, white, k);
    worst = std::max(worst, std::fabs(ratio[k] / expected - 1) / std::sqrt(2.0 / samples));
  }
  const bool poisson = std::ranges::all_of(
      ratio, [&](double r) { return std::fabs(r - 1) <= confidence_errors * std::sqrt(2.0 / samples); });
  return Finding{"sensor-scenarios/published-sampling",
                 "photons drawn for each wavelength and weighted by Qe have Poisson variance (Eq. 4.5 to 4.7)",
                 "variance / mean 1 1 1",
                 fmt::format("{:.2f} {:.2f} {:.2f}", ratio[0], ratio[1], ratio[2]),
                 poisson,
                 fmt::format("R, G, B with a peak Qe of 1, the most favourable value; {:.1f} standard errors from sum "
                             "x Qe^2 / sum x Qe. Detected photons are a thinned Poisson process, whose ratio is 1; the "
                             "other findings are simulated in this way",
                             worst),
                 Finding::Kind::check};
}

Plot shift_plot(const SensorScenarios& s) {
  Plot plot{"sensor-scenarios-shift", "Shift and scatter of chromaticities",
            "luminance [cd/m2]",      "distance in xy",
            AxisScale::logarithmic,   AxisScale::logarithmic};
  const auto add = [&](const std::string& name, const std::vector<LevelResult>& levels, Mark mark, const auto& of) {
    Series series{name, {}, {}, mark};
    for (const LevelResult& level : levels) {
      series.x.push_back(cd_m2_per_level * level.level);
      series.y.push_back(mean_over(level, of));
    }
    plot.series.push_back(series);
  };
  const auto scatter = [](const PatchResult& p) {
    return std::sqrt(p.expected.covariance.xx + p.expected.covariance.yy);
  };
  add("shift by dark current", s.dark, Mark::line,
      [](const PatchResult& p) { return distance(p.truth, p.expected.mean); });
  add("shift of means, photon noise alone", s.photons, Mark::line,
      [](const PatchResult& p) { return p.mean_code_xy ? distance(p.truth, *p.mean_code_xy) : std::nan(""); });
  add("scatter, photon noise alone", s.photons, Mark::dashed, scatter);
  add("scatter, photon and dark noise", s.dark, Mark::dashed, scatter);
  add("scatter, everything", s.all, Mark::dashed, scatter);
  plot.caption = "Mean over the patches; scatter is one standard deviation of a single pixel, to first order.";
  return plot;
}

Plot cloud_plot(const SensorScenarios& s) {
  Plot plot{"sensor-scenarios-clouds", "Scenario III at 10 cd/m2: all noise sources", "x", "y"};
  plot.equal_scales = true;
  plot.series.push_back(spectral_locus());
  Series truth{"truth", {}, {}, Mark::points}, samples{"samples", {}, {}, Mark::points};
  for (const PatchResult& p : s.all[2].patches) {
    truth.x.push_back(p.truth.x);
    truth.y.push_back(p.truth.y);
    for (const Xy& xy : p.xy) samples.x.push_back(xy.x), samples.y.push_back(xy.y);
  }
  plot.series.insert(plot.series.end(), {samples, truth});
  plot.caption = "13 patches, every sample of each: the clouds lie between the truth and the black point.";
  return plot;
}

}  // namespace

Result<Outcome> run_sensor_scenarios(const RunOptions& options) {
  const auto camera = thesis_camera();
  if (!camera) return tl::make_unexpected(camera.error());
  const auto scenarios = run_all(*camera, options);
  if (!scenarios) return tl::make_unexpected(scenarios.error());
  const auto published = published_sampling(*camera, options);
  if (!published) return tl::make_unexpected(published.error());
  Outcome out;
  out.findings = {means_stay(*scenarios),
                  means_on_line(*scenarios),
                  dark_matters(*scenarios),
                  dark_moves_most(*scenarios, false),
                  dark_moves_most(*scenarios, true),
                  saturation(*scenarios),
                  *published};
  for (const Finding& finding : scatter_findings(*scenarios)) out.findings.push_back(finding);
  out.plots = {shift_plot(*scenarios), cloud_plot(*scenarios)};
  for (Plot& plot : scatter_plots(*scenarios)) out.plots.push_back(std::move(plot));
  out.plots.push_back(photons_plot(*camera));
  return out;
}

}  // namespace lowlux::isp
