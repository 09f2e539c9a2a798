#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>

#include <fmt/format.h>

#include "isp/metrics/convex_hull.h"
#include "isp/metrics/statistics.h"
#include "isp/model/colour/dark_desaturation.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sampled_light.h"
#include "isp/reproduce/sensor_scenario.h"

namespace lowlux::isp {
namespace {

constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();  // of sums of three products of numbers near 1

Xyz scaled(const Xyz& v, double f) { return {f * v.x, f * v.y, f * v.z}; }
Xyz sum(const Xyz& a, const Xyz& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

struct Law {
  double worst_line = 0;  // error of the expectation against Eq. 4.23, in xy
  double worst_undo = 0;  // inverse of Eq. 4.23 against the truth, in xy, times alpha: the rounding it amplifies
  double smallest_alpha = 1;
};

Result<Law> check_law(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  const Xyz dark = xyz_of_charge(camera, dark_charge_e(camera));
  Law out;
  for (const double level : sensor_levels) {
    for (const Patch& patch : patches) {
      const Xyz signal = scaled(xyz_of_charge(camera, patch.signal_e), level);
      const auto alpha = signal_fraction(signal, dark);
      const auto measured = xy_of(sum(signal, dark)), truth = xy_of(signal), black = xy_of(dark);
      if (!alpha || !measured || !truth || !black) {
        return fail(ErrorCode::insufficient, patch.name + " has no chromaticity: its X + Y + Z is not positive");
      }
      out.worst_line = std::max(out.worst_line, distance(*measured, desaturated(*truth, *black, *alpha)));
      const auto undone = resaturated(*measured, *black, *alpha);
      if (!undone) return fail(ErrorCode::insufficient, "Eq. 4.23 cannot be undone for " + patch.name);
      out.worst_undo = std::max(out.worst_undo, *alpha * distance(*undone, *truth));
      out.smallest_alpha = std::min(out.smallest_alpha, *alpha);
    }
  }
  return out;
}

std::vector<double> areas(const std::vector<LevelResult>& levels) {
  std::vector<double> out;
  for (const LevelResult& level : levels) {
    std::vector<Xy> points;
    for (const PatchResult& patch : level.patches) points.push_back(patch.expected.mean);
    out.push_back(hull_area(points));
  }
  return out;
}

double true_area(const LevelResult& level) {
  std::vector<Xy> points;
  for (const PatchResult& patch : level.patches) points.push_back(patch.truth);
  return hull_area(points);
}

// Returns the largest error of corrected means against the truth, in their standard errors: subtracting the dark leaves
// the variance and shrinks S.
double worst_undone(const ThesisCamera& camera, const std::vector<Patch>& patches,
                    const std::vector<LevelResult>& levels, int samples) {
  const Vector3 dark_e = dark_charge_e(camera);
  double worst = 0;
  for (const LevelResult& level : levels) {
    for (std::size_t i = 0; i < patches.size(); ++i) {
      Vector3 mean_e{}, variance_e2{};
      for (int k = 0; k < 3; ++k) {
        mean_e[k] = level.level * patches[i].signal_e[k];
        variance_e2[k] = mean_e[k] + dark_e[k];
      }
      const auto cloud = sensor_cloud(camera, mean_e, variance_e2);
      const auto& undone = level.patches[i].undone_xy;
      // The chromaticity is a ratio: the first order holds only while the sum's own error is small against the sum.
      const double sum_error = std::sqrt(variance_e2[0] + variance_e2[1] + variance_e2[2]) /
                               (mean_e[0] + mean_e[1] + mean_e[2]) / std::sqrt(samples);
      if (!cloud || sum_error > 0.02) continue;
      worst = std::max(worst,
                       undone ? mean_error(*undone, cloud->mean, cloud->covariance, static_cast<std::size_t>(samples))
                              : std::numeric_limits<double>::infinity());
    }
  }
  return worst;
}

Finding gamut(const std::vector<LevelResult>& levels) {
  const std::vector<double> area = areas(levels);
  const double whole = true_area(levels.front());
  const bool falls = std::ranges::is_sorted(area, std::greater<>()) && area.front() < whole;
  return {"dark-desaturation/gamut",
          "dark current shrinks the gamut as light falls (section 4, scenario II)",
          "shrinks",
          fmt::format("{:.0f} % of its area at 100 cd/m2, {:.0f} % at 10, {:.1f} % at 1, {:.2f} % at 0.1",
                      100 * area[0] / whole, 100 * area[2] / whole, 100 * area[4] / whole, 100 * area[6] / whole),
          falls,
          fmt::format("convex hull in xy of the expectations of {} patches", levels.front().patches.size())};
}

// Returns the expectations of all patches as one line with gaps, each ending at the black point.
Series paths_of(const std::vector<LevelResult>& levels, const Xy& black) {
  Series out{"expectation, 100 to 0.1 cd/m2", {}, {}, Mark::line};
  for (std::size_t i = 0; i < levels.front().patches.size(); ++i) {
    for (const LevelResult& level : levels) {
      out.x.push_back(level.patches[i].expected.mean.x);
      out.y.push_back(level.patches[i].expected.mean.y);
    }
    out.x.push_back(black.x);
    out.y.push_back(std::nan(""));
  }
  return out;
}

Plot path_plot(const std::vector<LevelResult>& levels, const Xy& black) {
  Plot plot{"dark-desaturation-paths", "Chromaticities on their way to the black point", "x", "y"};
  plot.equal_scales = true;
  Series truth{"truth", {}, {}, Mark::points};
  for (const PatchResult& patch : levels.front().patches) {
    truth.x.push_back(patch.truth.x);
    truth.y.push_back(patch.truth.y);
  }
  plot.series = {spectral_locus(), paths_of(levels, black), truth, {"black point", {black.x}, {black.y}, Mark::points}};
  for (const std::size_t l : {0, 2, 4, 6}) {
    Series dots{fmt::format("means of samples, {} cd/m2", 100 * levels[l].level), {}, {}, Mark::points};
    for (const PatchResult& patch : levels[l].patches) {
      if (!patch.mean_code_xy) continue;
      dots.x.push_back(patch.mean_code_xy->x);
      dots.y.push_back(patch.mean_code_xy->y);
    }
    plot.series.push_back(dots);
  }
  plot.caption = "Scenario II: photon and dark noise. The lines are Eq. 4.23.";
  return plot;
}

Plot gamut_plot(const std::vector<LevelResult>& levels) {
  Plot plot{"dark-desaturation-gamut", "Gamut under dark current", "luminance [cd/m2]", "area of the hull / true area",
            AxisScale::logarithmic};
  const std::vector<double> area = areas(levels);
  Series left{"expectation", {}, {}, Mark::line};
  for (std::size_t l = 0; l < levels.size(); ++l) {
    left.x.push_back(100 * levels[l].level);
    left.y.push_back(area[l] / true_area(levels[l]));
  }
  plot.series.push_back(left);
  return plot;
}

std::vector<Finding> findings_on_line(const Law& law, double sampled, int samples) {
  return {
      {"dark-desaturation/line", "measured, true and black-point chromaticity are collinear (Eq. 4.23), expectations",
       "0", fmt::format("{:.1e} in xy at most", law.worst_line), law.worst_line <= rounding,
       fmt::format("an identity of Eq. 4.23; {} patches at {} levels, alpha down to {:.4f}", scenario_ii_patches,
                   std::size(sensor_levels), law.smallest_alpha),
       Finding::Kind::check},
      {"dark-desaturation/sampled-line",
       fmt::format("the means of {} samples are on the line of Eq. 4.23 (scenario II)", samples),
       "within the confidence interval", fmt::format("{:.1f} standard errors at most", sampled),
       sampled <= confidence_errors, "chromaticity of the mean code against Eq. 4.23, first-order covariance"}};
}

std::vector<Finding> findings_on_undoing(const Law& law, double sampled) {
  return {{"dark-desaturation/undo", "the true chromaticity follows by undoing Eq. 4.23 (expectations)", "exact",
           fmt::format("{:.1e} / alpha in xy at most", law.worst_undo), law.worst_undo <= rounding,
           "an identity of Eq. 4.23; the error of rounding grows by 1 / alpha", Finding::Kind::check},
          {"dark-desaturation/undo-sampled", "means of samples, less the mean dark, have the true chromaticity", "-",
           fmt::format("{:.1f} standard errors at most", sampled), sampled <= confidence_errors,
           "patches and levels where the sum's own relative error is below 2 %", Finding::Kind::check}};
}

}  // namespace

Result<Outcome> run_dark_desaturation(const RunOptions& options) {
  const auto camera = thesis_camera();
  if (!camera) return tl::make_unexpected(camera.error());
  const auto patches = thesis_patches(*camera, scenario_ii_patches);
  if (!patches) return tl::make_unexpected(patches.error());
  const Scenario scenario{{.dark = true}, frames_of_sensor, options.quick ? 60 : 200};
  const auto law = check_law(*camera, *patches);
  if (!law) return tl::make_unexpected(law.error());
  const auto levels = run_scenario(*camera, *patches, scenario, options.seed);
  if (!levels) return tl::make_unexpected(levels.error());
  Outcome out;
  out.findings = findings_on_line(*law, worst_mean_error(*levels), scenario.samples);
  for (const Finding& finding : findings_on_undoing(*law, worst_undone(*camera, *patches, *levels, scenario.samples))) {
    out.findings.push_back(finding);
  }
  out.findings.push_back(gamut(*levels));
  const auto black = xy_of(xyz_of_charge(*camera, dark_charge_e(*camera)));
  if (!black) return fail(ErrorCode::insufficient, "the dark current has no chromaticity");
  out.plots = {path_plot(*levels, *black), gamut_plot(*levels)};
  return out;
}

}  // namespace lowlux::isp
