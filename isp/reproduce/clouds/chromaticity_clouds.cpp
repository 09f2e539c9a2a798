#include "isp/reproduce/clouds/chromaticity_clouds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "isp/metrics/statistics.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_data.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sampled_light.h"

namespace lowlux::isp {
namespace {

constexpr double degree = std::numbers::pi / 180;

const ColourSet scenario_i{"I", "scenario I", ""}, scenario_ii{"II", "scenario II", ""};

/// Names the findings of a set of cones.
ColourSet cone_set(ConeSet cones) {
  const bool smith_pokorny = cones == ConeSet::smith_pokorny_1975;
  const std::string id = smith_pokorny ? "smith" : "stockman";
  return {id, "scenario II by the cones of " + cone_observer(cones).name + " (Eq. 3.9, 3.10)", "-" + id};
}

/// Compares the predicted ellipses of chips by cones with those by the CIE 1931 functions.
Finding like_the_standard(const std::vector<Colour>& chips, const std::vector<Colour>& by_cones, const ColourSet& set) {
  double smallest = 1, largest = 1, turn_deg = 0, shift = 0;
  for (std::size_t c = 0; c < chips.size(); ++c) {
    const ChromaticityCloud &a = chips[c].clouds.back().predicted, &b = by_cones[c].clouds.back().predicted;
    const XyEllipse first = principal_ellipse(a, 1), second = principal_ellipse(b, 1);
    const double ratio = size_of(second) / size_of(first);
    smallest = std::min(smallest, ratio);
    largest = std::max(largest, ratio);
    turn_deg = std::max(turn_deg, std::fabs(inclination_difference_deg(first.inclination_deg, second.inclination_deg)));
    shift = std::max(shift, std::hypot(a.mean.x - b.mean.x, a.mean.y - b.mean.y));
  }
  constexpr double tolerance = 0.1, tolerance_deg = 5;
  return {
      "chromaticity-clouds/like-cie-" + set.id,
      "ellipses have the size and the inclination of those by the CIE 1931 functions, " + set.text,
      "1 times, 0 degrees",
      fmt::format("{:.3f} to {:.3f} times, {:.1f} degrees at most", smallest, largest, turn_deg),
      smallest >= 1 - tolerance && largest <= 1 + tolerance && turn_deg <= tolerance_deg,
      fmt::format("agrees within a tenth and {} degrees; ten chips, predicted; their chromaticities differ by {:.4f} "
                  "at most; XYZ are the sums of the cones that are nearest to the CIE 1931 functions",
                  tolerance_deg, shift),
      Finding::Kind::check};
}

/// Returns the finding on the means, whose note states what each chip does.
Finding blue_and_red_by_cones(const std::vector<Colour>& seen, const ColourSet& set) {
  std::vector<Finding> both = blue_and_red(seen, set);
  Finding out = std::move(both.front());
  out.note += fmt::format("; each of them: {}, {}", both.back().holds ? "agrees" : "does not hold", both.back().ours);
  return out;
}

/// Samples the chips by cones (Eq. 3.9, 3.10) in place of the CIE 1931 functions, and compares the ellipses.
/// @param chips  as the CIE 1931 observer sees them by the same draws
Result<Outcome> cone_clouds(const std::vector<Colour>& chips, const CloudDraws& draws) {
  Outcome out;
  for (const ConeSet cones : {ConeSet::smith_pokorny_1975, ConeSet::stockman_sharpe_2000}) {
    std::vector<Colour> seen = chips;
    for (Colour& chip : seen) chip.clouds.clear();
    const Observer observer = cone_observer(cones);
    if (const auto sampled = sample_colours(seen, observer, draws); !sampled) {
      return tl::make_unexpected(sampled.error());
    }
    const ColourSet set = cone_set(cones);
    out.findings.push_back(orientation(seen, set));
    out.findings.push_back(covariance(seen, set));
    out.findings.push_back(blue_and_red_by_cones(seen, set));
    out.findings.push_back(like_the_standard(chips, seen, set));
    out.plots.push_back(
        chip_plot("chromaticity-clouds-" + set.id, "Ten Munsell chips by the cones of " + observer.name, seen));
  }
  return out;
}

}  // namespace

Finding size_law(const std::vector<Colour>& colours, const ColourSet& set) {
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
  return {"chromaticity-clouds/size-law-" + set.id,
          "the ellipses' size follows the photons' relative noise, " + set.text,
          "F^-0.5",
          fmt::format("F^{:.5f} +- {:.5f} (the colour farthest off)", worst.value, worst.standard_error),
          errors_off(worst) <= confidence_errors,
          fmt::format("fitted from 1 W to 6e-15 W over {} colours", colours.size()),
          Finding::Kind::check};
}

namespace {

/// Returns the size of a colour's sampled ellipse of one deviation at a level.
double sampled_size(const Cloud& cloud) { return size_of(principal_ellipse(cloud.sampled, 1)); }

}  // namespace

Finding ellipses_grow(const std::vector<Colour>& colours, const ColourSet& set) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Colour& colour : colours) {
    const double factor = sampled_size(colour.clouds.back()) / sampled_size(colour.clouds.front());
    least = std::min(least, factor);
    most = std::max(most, factor);
  }
  return {"chromaticity-clouds/size-" + set.id,
          "ellipses grow as light falls, " + set.text,
          "grow",
          fmt::format("{:.1e} to {:.1e} times from 1 W to 6e-15 W", least, most),
          least > 1,
          fmt::format("sampled ellipses of {} colours", colours.size())};
}

Finding orientation(const std::vector<Colour>& colours, const ColourSet& set) {
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
  return {"chromaticity-clouds/orientation-" + set.id,
          "the ellipses' orientation does not change with light, " + set.text,
          "constant",
          fmt::format("within {:.1f} standard errors ({:.1f} degrees) at all levels", worst_errors, worst_deg),
          worst_errors <= confidence_errors,
          fmt::format("the prediction itself turns by {:.1e} degrees; the rounder an ellipse, the larger its standard "
                      "error",
                      drift_deg)};
}

Finding covariance(const std::vector<Colour>& colours, const ColourSet& set) {
  double worst = 0;
  for (const Colour& colour : colours) {
    for (const Cloud& cloud : colour.clouds) {
      worst = std::max(
          worst, worst_covariance_error(cloud.sampled.covariance, cloud.predicted.covariance, cloud.samples.size()));
    }
  }
  return {"chromaticity-clouds/covariance-" + set.id,
          "clouds are those of independent Poisson bins, " + set.text,
          "0 standard errors",
          fmt::format("{:.1f} standard errors at most", worst),
          worst <= confidence_errors,
          "each entry of each covariance against the first-order prediction",
          Finding::Kind::check};
}

namespace {

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

}  // namespace

std::vector<Finding> blue_and_red(const std::vector<Colour>& chips, const ColourSet& set) {
  const Family blue = family_of(chips, {"5B_", "5PB_", "2p5P_"});
  const Family red = family_of(chips, {"10R_", "10RP_", "7p5YR_"});
  const std::string claim = "bluish patches have smaller ellipses than reddish ones, " + set.text + ", ";
  const std::string id = "chromaticity-clouds/blue-and-red" + set.cones;
  return {
      {id, claim + "in the mean", "smaller",
       fmt::format("{:.4f} bluish, {:.4f} reddish at 6e-15 W", blue.mean, red.mean), blue.mean < red.mean,
       "one predicted standard deviation in xy; bluish 5B, 5PB, 2.5P, reddish 10R, 10RP, 7.5YR"},
      {id + "-each", claim + "each of them", "smaller",
       fmt::format("largest bluish {:.4f}, smallest reddish {:.4f}", blue.largest.size, red.smallest.size),
       blue.largest.size < red.smallest.size,
       fmt::format("{} against {}, at equal radiant power after reflection; sampled ellipses have standard errors of "
                   "{:.4f} and {:.4f}",
                   blue.largest.name, red.smallest.name, blue.largest.error, red.smallest.error)}};
}

namespace {

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

}  // namespace

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

namespace {

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

CloudDraws draws_of_chips(const RunOptions& options) {
  return {options.seed, frames_of_clouds_ii, options.quick ? 60u : 200u};
}

}  // namespace

Result<Outcome> run_chromaticity_clouds(const RunOptions& options) {
  const Spectrum light = *light_named("E");
  std::vector<Colour> white{{"equi-energy", light, {}}}, chips = colours_under(light, SpectrumSet::munsell_ten);
  const Observer observer = standard_observer();
  const auto first = sample_colours(white, observer, {options.seed, frames_of_clouds_i, options.quick ? 50u : 100u});
  if (!first) return tl::make_unexpected(first.error());
  const CloudDraws draws = draws_of_chips(options);
  const auto second = sample_colours(chips, observer, draws);
  if (!second) return tl::make_unexpected(second.error());
  Outcome out;
  out.findings = {ellipses_grow(white, scenario_i), size_law(white, scenario_i),       orientation(white, scenario_i),
                  covariance(white, scenario_i),    ellipses_grow(chips, scenario_ii), size_law(chips, scenario_ii),
                  orientation(chips, scenario_ii),  covariance(chips, scenario_ii)};
  for (const auto& more : {error_findings(white.front()), blue_and_red(chips, scenario_ii), pooled_findings(chips)}) {
    out.findings.insert(out.findings.end(), more.begin(), more.end());
  }
  out.plots = {cloud_plot(white.front()), error_plot(white.front()),
               chip_plot("chromaticity-clouds-II", "Ten Munsell chips", chips), size_plot(chips), pooled_plot(chips)};
  for (const auto& run : {cone_clouds(chips, draws), metameric_clouds(options)}) {
    if (!run) return tl::make_unexpected(run.error());
    out.findings.insert(out.findings.end(), run->findings.begin(), run->findings.end());
    out.plots.insert(out.plots.end(), run->plots.begin(), run->plots.end());
  }
  return out;
}

}  // namespace lowlux::isp
