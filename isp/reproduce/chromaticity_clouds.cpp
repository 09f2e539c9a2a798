#include "isp/reproduce/chromaticity_clouds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "isp/metrics/statistics.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sampled_light.h"

namespace lowlux::isp {
namespace {

constexpr const char* colour_checker = "checker";
constexpr double degree = std::numbers::pi / 180;

Result<Cloud> sample_cloud(const Colour& colour, double power_w, DrawPlace place, std::uint32_t samples) {
  const auto means = mean_photons(colour.light, power_w, photon_exposure_s);
  if (!means) return tl::make_unexpected(means.error());
  const auto predicted = predicted_cloud(*means);
  Cloud out{power_w, {}, {}, predicted.value_or(ChromaticityCloud{})};
  for (place.sample = 0; place.sample < samples; ++place.sample) {
    if (const auto xy = xy_of(xyz_of_photons(*means, draw_photons(*means, place)))) out.samples.push_back(*xy);
  }
  const auto sampled = cloud_of(out.samples);
  if (!sampled || !predicted) {
    return fail(ErrorCode::insufficient, fmt::format("too few photons at {} W for a cloud of chromaticities", power_w));
  }
  out.sampled = *sampled;
  return out;
}

Result<void> sample_colours(std::vector<Colour>& colours, std::uint32_t first_frame, std::uint32_t samples,
                            std::uint64_t seed) {
  const std::vector<double> levels = photon_levels_w();
  for (std::uint32_t c = 0; c < colours.size(); ++c) {
    for (std::uint32_t l = 0; l < levels.size(); ++l) {
      auto cloud = sample_cloud(colours[c], levels[l], {seed, first_frame + l, c, 0}, samples);
      if (!cloud) return tl::make_unexpected(cloud.error());
      colours[c].clouds.push_back(*std::move(cloud));
    }
  }
  return {};
}

/// Returns what a finding calls the colours of a scenario.
std::string colours_of(const std::string& scenario) {
  return scenario == colour_checker ? "24 ColorChecker reflectances" : "scenario " + scenario;
}

/// Reports the exponent that is farthest from -1/2 in units of its own standard error, over all colours.
Finding size_law(const std::vector<Colour>& colours, const std::string& scenario) {
  Estimate worst{-0.5, 1};
  const auto errors_off = [](const Estimate& e) { return std::fabs(e.value + 0.5) / e.standard_error; };
  for (const Colour& colour : colours) {
    std::vector<double> x;
    std::vector<Estimate> y;
    for (const Cloud& cloud : colour.clouds) {
      x.push_back(cloud.power_w);
      y.push_back(log_size_of(cloud.sampled.covariance, cloud.samples.size()));
    }
    const Estimate fit = power_law_exponent(x, y);
    if (errors_off(fit) >= errors_off(worst)) worst = fit;
  }
  return {"chromaticity-clouds/size-law-" + scenario,
          "the ellipses' size follows the photons' relative noise, " + colours_of(scenario),
          "F^-0.5",
          fmt::format("F^{:.5f} +- {:.5f} (the colour farthest off)", worst.value, worst.standard_error),
          errors_off(worst) <= confidence_errors,
          fmt::format("fitted from 1 W to 6e-15 W over {} colours", colours.size()),
          Finding::Kind::check};
}

/// Returns the size of a colour's sampled ellipse of one deviation at a level.
double sampled_size(const Cloud& cloud) { return size_of(principal_ellipse(cloud.sampled, 1)); }

Finding ellipses_grow(const std::vector<Colour>& colours, const std::string& scenario) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Colour& colour : colours) {
    const double factor = sampled_size(colour.clouds.back()) / sampled_size(colour.clouds.front());
    least = std::min(least, factor);
    most = std::max(most, factor);
  }
  return {"chromaticity-clouds/size-" + scenario,
          "ellipses grow as light falls, " + colours_of(scenario),
          "grow",
          fmt::format("{:.1e} to {:.1e} times from 1 W to 6e-15 W", least, most),
          least > 1,
          fmt::format("sampled ellipses of {} colours", colours.size())};
}

Finding orientation(const std::vector<Colour>& colours, const std::string& scenario) {
  double worst_errors = 0, worst_deg = 0, drift_deg = 0;
  for (const Colour& colour : colours) {
    const double bright = principal_ellipse(colour.clouds.front().predicted, 1).inclination_deg;
    for (const Cloud& cloud : colour.clouds) {
      const auto off = [&](const ChromaticityCloud& c) {
        return std::fabs(inclination_difference_deg(principal_ellipse(c, 1).inclination_deg, bright));
      };
      worst_errors = std::max(worst_errors, orientation_error(cloud.sampled.covariance, cloud.predicted.covariance,
                                                              bright, cloud.samples.size()));
      worst_deg = std::max(worst_deg, off(cloud.sampled));
      drift_deg = std::max(drift_deg, off(cloud.predicted));
    }
  }
  return {"chromaticity-clouds/orientation-" + scenario,
          "the ellipses' orientation does not change with light, " + colours_of(scenario),
          "constant",
          fmt::format("within {:.1f} standard errors ({:.1f} degrees) at all levels", worst_errors, worst_deg),
          worst_errors <= confidence_errors,
          fmt::format("the prediction itself turns by {:.1e} degrees; the rounder an ellipse, the larger its standard "
                      "error",
                      drift_deg)};
}

Finding covariance(const std::vector<Colour>& colours, const std::string& scenario) {
  double worst = 0;
  for (const Colour& colour : colours) {
    for (const Cloud& cloud : colour.clouds) {
      worst = std::max(
          worst, worst_covariance_error(cloud.sampled.covariance, cloud.predicted.covariance, cloud.samples.size()));
    }
  }
  return {"chromaticity-clouds/covariance-" + scenario,
          "clouds are those of independent Poisson bins, " + colours_of(scenario),
          "0 standard errors",
          fmt::format("{:.1f} standard errors at most", worst),
          worst <= confidence_errors,
          "each entry of each covariance against the first-order prediction",
          Finding::Kind::check};
}

bool is_one_of(const std::string& name, std::initializer_list<std::string_view> families) {
  return std::ranges::any_of(families, [&](std::string_view family) { return name.starts_with(family); });
}

/// Predicted sizes of the chips of some hue families at the dimmest level, without sampling error.
struct Family {
  struct Member {
    std::string name;
    double size = 0;
    double error = 0;  // standard error of a sampled ellipse of this size
  };
  double mean = 0;
  Member smallest, largest;
};

Family family_of(const std::vector<Colour>& chips, std::initializer_list<std::string_view> hues) {
  Family out;
  for (const Colour& chip : chips) {
    if (!is_one_of(chip.name, hues)) continue;
    const Cloud& dimmest = chip.clouds.back();
    const double size = size_of(principal_ellipse(dimmest.predicted, 1));
    const double relative = log_size_of(dimmest.predicted.covariance, dimmest.samples.size()).standard_error;
    const Family::Member member{chip.name, size, size * relative};
    out.mean += size / static_cast<double>(hues.size());
    if (out.smallest.name.empty() || size < out.smallest.size) out.smallest = member;
    if (out.largest.name.empty() || size > out.largest.size) out.largest = member;
  }
  return out;
}

std::vector<Finding> blue_and_red(const std::vector<Colour>& chips) {
  const Family blue = family_of(chips, {"5B_", "5PB_", "2p5P_"});
  const Family red = family_of(chips, {"10R_", "10RP_", "7p5YR_"});
  const std::string claim = "bluish patches have smaller ellipses than reddish ones (scenario II), ";
  return {
      {"chromaticity-clouds/blue-and-red", claim + "in the mean", "smaller",
       fmt::format("{:.4f} bluish, {:.4f} reddish at 6e-15 W", blue.mean, red.mean), blue.mean < red.mean,
       "one predicted standard deviation in xy; bluish 5B, 5PB, 2.5P, reddish 10R, 10RP, 7.5YR"},
      {"chromaticity-clouds/blue-and-red-each", claim + "each of them", "smaller",
       fmt::format("largest bluish {:.4f}, smallest reddish {:.4f}", blue.largest.size, red.smallest.size),
       blue.largest.size < red.smallest.size,
       fmt::format("{} against {}, at equal radiant power after reflection; sampled ellipses have standard errors of "
                   "{:.4f} and {:.4f}",
                   blue.largest.name, red.smallest.name, blue.largest.error, red.smallest.error)}};
}

Series drawn(const std::string& name, const XyEllipse& e, Mark mark) {
  Series out{name, {}, {}, mark};
  const double c = std::cos(e.inclination_deg * degree), s = std::sin(e.inclination_deg * degree);
  for (int angle = 0; angle <= 360; angle += 10) {
    const double u = e.semi_major * std::cos(angle * degree), v = e.semi_minor * std::sin(angle * degree);
    out.x.push_back(e.centre.x + u * c - v * s);
    out.y.push_back(e.centre.y + u * s + v * c);
  }
  return out;
}

// Returns all of MacAdam's ellipses as one line with gaps.
Series macadam_ellipses() {
  Series out{"MacAdam, x10", {}, {}, Mark::dashed};
  const CieTable table = macadam1942_table();
  for (std::size_t i = 0; i < table.cells.size(); i += table.columns.size()) {
    const auto row = table.cells.subspan(i, table.columns.size());
    const double scale = drawn_deviations * 1e-3;
    const Series one = drawn("", {{row[0], row[1]}, scale * row[2], scale * row[3], row[4]}, Mark::dashed);
    out.x.insert(out.x.end(), one.x.begin(), one.x.end());
    out.y.insert(out.y.end(), one.y.begin(), one.y.end());
    out.x.push_back(row[0]);
    out.y.push_back(std::nan(""));
  }
  return out;
}

Plot cloud_plot(const Colour& white) {
  Plot plot{"chromaticity-clouds-I", "Equi-energy light through few photons", "x", "y"};
  plot.equal_scales = true;
  const Cloud& cloud = white.clouds.back();
  Series points{"samples at 6e-15 W", {}, {}, Mark::points};
  for (const Xy& xy : cloud.samples) points.x.push_back(xy.x), points.y.push_back(xy.y);
  plot.series = {points, drawn("principal axes, 2 deviations", principal_ellipse(cloud.sampled, 2), Mark::line),
                 drawn("predicted, 2 deviations", principal_ellipse(cloud.predicted, 2), Mark::dashed)};
  if (const auto least = centred_ellipse(white.clouds.front().predicted.mean, cloud.samples)) {
    plot.series.push_back(drawn("least area around all, centred", *least, Mark::line));
  }
  plot.caption =
      "Scenario I: as Figure 3-3a, with the ellipse of least area centred at the bright chromaticity, and that of the "
      "principal axes.";
  return plot;
}

Plot chip_plot(const std::string& id, const std::string& title, const std::vector<Colour>& chips) {
  Plot plot{id, title + " at 6e-15 W, and MacAdam's ellipses", "x", "y"};
  plot.equal_scales = true;
  plot.series = {spectral_locus(), macadam_ellipses()};
  for (const Colour& chip : chips) {
    plot.series.push_back(drawn(chip.name, principal_ellipse(chip.clouds.back().sampled, 1), Mark::line));
  }
  plot.caption =
      "One standard deviation of each colour's chromaticity; MacAdam's standard deviations drawn ten times as large.";
  return plot;
}

Plot size_plot(const std::vector<Colour>& chips) {
  Plot plot{"chromaticity-clouds-size", "Size of the ellipses", "F [W]",
            "size, 10 deviations [xy]", AxisScale::logarithmic, AxisScale::logarithmic};
  for (const Colour& chip : chips) {
    Series series{chip.name, {}, {}, Mark::line};
    for (const Cloud& cloud : chip.clouds) {
      series.x.push_back(cloud.power_w);
      series.y.push_back(size_of(principal_ellipse(cloud.sampled, drawn_deviations)));
    }
    plot.series.push_back(series);
  }
  plot.caption = "Straight lines of slope -1/2.";
  return plot;
}

std::vector<Colour> colours_under(const Spectrum& light, SpectrumSet set) {
  std::vector<Colour> out;
  for (const NamedSpectrum& chip : spectra_of(set)) {
    out.push_back({std::string(chip.name), reflected(light, chip.spectrum), {}});
  }
  return out;
}

/// Reports on the reflectances of the ColorChecker, the colours of MetaCow's animals: the image and the spectra of its
/// metameric halves are not bundled.
std::vector<Finding> checker_findings(const std::vector<Colour>& checker) {
  std::vector<Finding> out{size_law(checker, colour_checker), orientation(checker, colour_checker)};
  for (Finding& finding : out) finding.kind = Finding::Kind::check;
  return out;
}

}  // namespace

Result<Outcome> run_chromaticity_clouds(const RunOptions& options) {
  const Spectrum light = *light_named("E");
  std::vector<Colour> white{{"equi-energy", light, {}}}, chips = colours_under(light, SpectrumSet::munsell_ten);
  std::vector<Colour> checker = colours_under(light, SpectrumSet::colorchecker);
  const auto first = sample_colours(white, frames_of_clouds_i, options.quick ? 50 : 100, options.seed);
  if (!first) return tl::make_unexpected(first.error());
  const std::uint32_t samples = options.quick ? 60 : 200;
  const auto second = sample_colours(chips, frames_of_clouds_ii, samples, options.seed);
  if (!second) return tl::make_unexpected(second.error());
  const auto third = sample_colours(checker, frames_of_checker, samples, options.seed);
  if (!third) return tl::make_unexpected(third.error());
  Outcome out;
  out.findings = {ellipses_grow(white, "I"),  size_law(white, "I"),  orientation(white, "I"),  covariance(white, "I"),
                  ellipses_grow(chips, "II"), size_law(chips, "II"), orientation(chips, "II"), covariance(chips, "II")};
  for (const auto& more :
       {error_findings(white.front()), blue_and_red(chips), pooled_findings(chips), checker_findings(checker)}) {
    out.findings.insert(out.findings.end(), more.begin(), more.end());
  }
  out.plots = {cloud_plot(white.front()),
               error_plot(white.front()),
               chip_plot("chromaticity-clouds-II", "Ten Munsell chips", chips),
               chip_plot("chromaticity-clouds-checker", "24 ColorChecker reflectances", checker),
               size_plot(chips),
               pooled_plot(chips)};
  return out;
}

}  // namespace lowlux::isp
