#include "isp/reproduce/sensor_scatter.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "isp/metrics/statistics.h"
#include "isp/model/sensor/photon.h"
#include "isp/model/spectrum/cie_data.h"

namespace lowlux::isp {
namespace {

using Levels = std::vector<LevelResult>;

/// Returns the mean of Delta E ab over the patches that are not saturated.
double mean_delta_e(const LevelResult& level) {
  std::vector<double> found;
  for (const PatchResult& patch : level.patches) {
    if (std::isfinite(patch.delta_e_ab)) found.push_back(patch.delta_e_ab);
  }
  return mean_of(found).value;
}

/// Returns the ellipse of one standard deviation that is expected of a patch's samples.
XyEllipse ellipse_of(const PatchResult& patch) { return principal_ellipse(patch.expected, 1); }

/// Returns the angle of an ellipse's major axis to the horizontal [degrees], 0..90.
double slope_deg(const PatchResult& patch) {
  return std::fabs(inclination_difference_deg(ellipse_of(patch).inclination_deg, 0));
}

double size_of_patch(const PatchResult& patch) { return size_of(ellipse_of(patch)); }

/// Returns the standard deviation of the ellipses' sizes over the patches, relative to their mean.
double spread_of_sizes(const LevelResult& level) {
  const double mean = mean_over(level, size_of_patch);
  return std::sqrt(mean_over(level, [&](const PatchResult& p) { return std::pow(size_of_patch(p) / mean - 1, 2); }));
}

/// Returns the largest turn of a patch's expected ellipse between the brightest level and another [degrees].
double largest_turn_deg(const Levels& levels) {
  double out = 0;
  for (const LevelResult& level : levels) {
    for (std::size_t i = 0; i < level.patches.size(); ++i) {
      const double bright = ellipse_of(levels.front().patches[i]).inclination_deg;
      out = std::max(out, std::fabs(inclination_difference_deg(ellipse_of(level.patches[i]).inclination_deg, bright)));
    }
  }
  return out;
}

/// Returns the largest difference of a sampled inclination from that expected at the brightest level, in standard
/// errors.
double worst_inclination_error(const Levels& levels) {
  double out = 0;
  for (const LevelResult& level : levels) {
    for (std::size_t i = 0; i < level.patches.size(); ++i) {
      const PatchResult& p = level.patches[i];
      if (!p.sampled) continue;
      const double bright = ellipse_of(levels.front().patches[i]).inclination_deg;
      out = std::max(out, orientation_error(p.sampled->covariance, p.expected.covariance, bright, p.xy.size()));
    }
  }
  return out;
}

/// Returns the brightest level with a mean Delta E ab above a threshold [cd/m2]; 0 if there is none.
double first_above_cd_m2(double threshold, const Levels& levels) {
  const auto found =
      std::ranges::find_if(levels, [&](const LevelResult& level) { return mean_delta_e(level) > threshold; });
  return found == levels.end() ? 0 : cd_m2_per_level * found->level;
}

std::string delta_e_text(const Levels& levels) {
  std::string out;
  for (const LevelResult& level : levels) {
    out +=
        fmt::format("{}{:.2g} at {:.3g}", out.empty() ? "" : ", ", mean_delta_e(level), cd_m2_per_level * level.level);
  }
  return out + " cd/m2";
}

// CIELAB's unit is about the smallest difference that is noticed; 2.3 is its measured mean (Mahy, Van Eycken &
// Oosterlinck, Color Res. Appl. 19 (1994) 105-121).
constexpr double noticed_delta_e = 1, measured_delta_e = 2.3;

std::vector<Finding> photons_matter(const SensorScenarios& s) {
  constexpr double published_cd_m2 = 1e-11;
  const double as_published = first_above_cd_m2(noticed_delta_e, s.published);
  const double own = first_above_cd_m2(noticed_delta_e, s.photons);
  const auto note = [](const Levels& levels) {
    return fmt::format("first level with a mean Delta E ab of single samples above {}; above {} it is {:.3g} cd/m2: {}",
                       noticed_delta_e, measured_delta_e, first_above_cd_m2(measured_delta_e, levels),
                       delta_e_text(levels));
  };
  const std::string claim = "photon noise matters from 1e-11 cd/m2 down (scenario I), with the light of ";
  return {{"sensor-scenarios/photons-matter-1-m2-sr", claim + "1 m2 sr", "1e-11 cd/m2",
           fmt::format("{:.0e} cd/m2", as_published), figures_agree({{published_cd_m2, as_published}}),
           note(s.published) +
               "; the published Qe is in e- m2 sr per photon without a pixel's area, which is an etendue of 1 m2 sr"},
          {"sensor-scenarios/photons-matter", claim + "a pixel", "1e-11 cd/m2", fmt::format("{:.3g} cd/m2", own),
           own <= published_cd_m2,
           note(s.photons) +
               "; a pixel of 9000 e- that a white of 100 cd/m2 fills has 4e-14 m2 sr, where the published figure takes "
               "1 m2 sr"}};
}

Finding delta_e_grows(const SensorScenarios& s) {
  const auto grows = [](const Levels& levels) { return std::ranges::is_sorted(levels, {}, mean_delta_e); };
  return {"sensor-scenarios/delta-e-grows",
          "the mean Delta E ab of samples grows as light falls (Fig. 4-6c, 4-8c, 4-11c)",
          "grows",
          fmt::format("{:.2g} to {:.2g} with photon noise, {:.2g} to {:.2g} with dark current, {:.2g} to {:.2g} with "
                      "all noises",
                      mean_delta_e(s.photons.front()), mean_delta_e(s.photons.back()), mean_delta_e(s.dark.front()),
                      mean_delta_e(s.dark.back()), mean_delta_e(s.all.front()), mean_delta_e(s.all.back())),
          grows(s.published) && grows(s.photons) && grows(s.dark) && grows(s.all),
          "from 100 to 0.1 cd/m2 with the pixel's own light, and scenario I also with 1 m2 sr"};
}

std::vector<Finding> photon_ellipses(const SensorScenarios& s) {
  const double errors = worst_inclination_error(s.published);
  const double first = mean_over(s.published.front(), size_of_patch),
               last = mean_over(s.published.back(), size_of_patch);
  return {{"sensor-scenarios/photon-inclination",
           "with photon noise the ellipses' inclination does not depend on intensity (Fig. 4-6a)", "constant",
           fmt::format("within {:.1f} standard errors at all levels", errors), errors <= confidence_errors,
           fmt::format("{} patches from 100 to 1e-12 cd/m2; the expectation turns by {:.1e} degrees",
                       s.published.front().patches.size(), largest_turn_deg(s.published))},
          {"sensor-scenarios/photon-size", "with photon noise the ellipses grow as light falls (Fig. 4-6b)", "grow",
           fmt::format("mean size {:.2g} at 100 cd/m2, {:.2g} at 1e-12", first, last), last > first,
           "one expected standard deviation in xy, 1 m2 sr"}};
}

std::vector<Finding> dark_ellipses(const SensorScenarios& s) {
  const LevelResult &bright = s.dark.front(), &dim = s.dark.back();
  LevelResult same_patches = s.photons.back();  // scenario I has more
  same_patches.patches.resize(dim.patches.size());
  const double without = mean_over(same_patches, slope_deg), with = mean_over(dim, slope_deg);
  const double turn = largest_turn_deg(s.dark);
  return {
      {"sensor-scenarios/dark-horizontal", "with dark noise the ellipses lie more horizontally (Fig. 4-8a)",
       "more horizontally",
       fmt::format("{:.0f} degrees from the horizontal in the mean, {:.0f} without", with, without), with < without,
       "expected ellipses at 0.1 cd/m2, where dark current dominates"},
      {"sensor-scenarios/dark-turns", "with dark noise the ellipses' inclination depends on the level (Fig. 4-8a)",
       "differs by level", fmt::format("turns by {:.0f} degrees at most", turn), turn > 1,
       "expected ellipses from 100 to 0.1 cd/m2; turns by more than a degree"},
      {"sensor-scenarios/dark-uniform", "the ellipses' sizes are more uniform in the dark (Fig. 4-8b)", "more uniform",
       fmt::format("they vary by {:.1f} % at 0.1 cd/m2, by {:.0f} % at 100", 100 * spread_of_sizes(dim),
                   100 * spread_of_sizes(bright)),
       spread_of_sizes(dim) < spread_of_sizes(bright),
       "standard deviation of the expected sizes over the patches, relative to their mean"}};
}

Finding sparse_codes(const SensorScenarios& s) {
  const auto different = [](const LevelResult& level) {
    return mean_over(level, [](const PatchResult& p) { return p.codes; });
  };
  const LevelResult &bright = s.all[1], &dim = s.all.back();
  return {"sensor-scenarios/sparse-codes",
          "with quantisation the samples of a dark patch have few different chromaticities (Fig. 4-10)",
          "few",
          fmt::format("{:.0f} of {} samples differ at 0.1 cd/m2, {:.0f} at 50", different(dim),
                      dim.patches.front().unsaturated, different(bright)),
          different(dim) < different(bright) / 2,
          "mean number of different codes of a patch, scenario III; few: less than half as many"};
}

using Quantity = double (*)(const PatchResult&);

/// Plots a quantity of each patch over luminance.
Plot patch_plot(const std::string& id, const std::string& title, const std::string& y_label, const Levels& levels,
                Quantity quantity, AxisScale scale) {
  Plot plot{"sensor-scenarios-" + id, title, "luminance [cd/m2]", y_label, AxisScale::logarithmic, scale};
  for (std::size_t i = 0; i < levels.front().patches.size(); ++i) {
    Series series{fmt::format("{}", i + 1), {}, {}, Mark::line};
    for (const LevelResult& level : levels) {
      series.x.push_back(cd_m2_per_level * level.level);
      series.y.push_back(level.patches[i].sampled ? quantity(level.patches[i]) : std::nan(""));
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

double sampled_inclination_deg(const PatchResult& p) { return principal_ellipse(*p.sampled, 1).inclination_deg; }
double sampled_size(const PatchResult& p) { return size_of(principal_ellipse(*p.sampled, 1)); }

Series delta_e_series(const std::string& name, const Levels& levels) {
  Series out{name, {}, {}, Mark::line};
  for (const LevelResult& level : levels) {
    out.x.push_back(cd_m2_per_level * level.level);
    out.y.push_back(mean_delta_e(level));
  }
  return out;
}

Plot delta_e_plot(const std::string& id, const std::string& title, std::vector<Series> series) {
  Plot plot{"sensor-scenarios-" + id, title, "luminance [cd/m2]", "mean Delta E ab", AxisScale::logarithmic,
            AxisScale::logarithmic};
  plot.series = std::move(series);
  return plot;
}

}  // namespace

std::vector<Finding> scatter_findings(const SensorScenarios& scenarios) {
  std::vector<Finding> out = photons_matter(scenarios);
  out.push_back(delta_e_grows(scenarios));
  for (const auto& more : {photon_ellipses(scenarios), dark_ellipses(scenarios)}) {
    out.insert(out.end(), more.begin(), more.end());
  }
  out.push_back(sparse_codes(scenarios));
  return out;
}

std::vector<Plot> scatter_plots(const SensorScenarios& s) {
  constexpr auto linear = AxisScale::linear, logarithmic = AxisScale::logarithmic;
  const std::string tilt = "inclination [degrees]", size = "size, one deviation [xy]";
  return {delta_e_plot("delta-e-1-m2-sr", "Photon noise as published (Fig. 4-6c)",
                       {delta_e_series("photon noise, 1 m2 sr", s.published)}),
          delta_e_plot("delta-e", "Colour difference of single samples (Fig. 4-6c, 4-8c, 4-11c)",
                       {delta_e_series("I, photon noise", s.photons), delta_e_series("II, with dark current", s.dark),
                        delta_e_series("III, everything", s.all)}),
          patch_plot("I-inclination", "Scenario I (Fig. 4-6a)", tilt, s.published, sampled_inclination_deg, linear),
          patch_plot("I-size", "Scenario I (Fig. 4-6b)", size, s.published, sampled_size, logarithmic),
          patch_plot("II-inclination", "Scenario II (Fig. 4-8a)", tilt, s.dark, sampled_inclination_deg, linear),
          patch_plot("II-size", "Scenario II (Fig. 4-8b)", size, s.dark, sampled_size, logarithmic),
          patch_plot("III-inclination", "Scenario III (Fig. 4-11a)", tilt, s.all, sampled_inclination_deg, linear),
          patch_plot("III-size", "Scenario III (Fig. 4-11b)", size, s.all, sampled_size, logarithmic)};
}

Plot photons_plot(const ThesisCamera& camera) {
  Plot plot{"sensor-scenarios-photons", "Photons in the exposure time (Fig. 4-5c)",
            "luminance [cd/m2]",        "photons",
            AxisScale::logarithmic,     AxisScale::logarithmic};
  const auto photons = photon_radiance(*at_full_level(*light_named("D65")));
  const double white = camera.exposure_s * integrate(*photons);
  const std::pair<const char*, double> collected[] = {{"1 m2 sr", published_etendue_m2_sr},
                                                      {"the pixel's own etendue", camera.response.etendue_m2_sr}};
  for (const auto& [name, etendue] : collected) {
    Series series{name, {}, {}, Mark::line};
    for (const double level : photon_levels) {
      series.x.push_back(cd_m2_per_level * level);
      series.y.push_back(level * white * etendue);
    }
    plot.series.push_back(std::move(series));
  }
  plot.caption = "A white under D65, 380 to 780 nm, 1 s.";
  return plot;
}

}  // namespace lowlux::isp
