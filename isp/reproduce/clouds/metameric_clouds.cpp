#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/metrics/statistics.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/model/spectrum/spectral_lift.h"
#include "isp/reproduce/clouds/chromaticity_clouds.h"
#include "isp/reproduce/sampled_light.h"

namespace lowlux::isp {
namespace {

const ColourSet checker{"checker", "24 ColorChecker reflectances and their smoothest metamers under D65", ""};

/// Calls a function with the clouds of both halves of each colour at the dimmest level.
template <class Call>
void for_each_pair(const std::vector<Colour>& halves, const Call& call) {
  for (std::size_t i = 0; i + 1 < halves.size(); i += 2) call(halves[i].clouds.back(), halves[i + 1].clouds.back());
}

Finding halves_match(const std::vector<Colour>& halves) {
  double worst = 0;
  for_each_pair(halves, [&](const Cloud& a, const Cloud& b) {
    const Xy &first = a.predicted.mean, &second = b.predicted.mean;
    worst = std::max(worst, std::hypot(first.x - second.x, first.y - second.y));
  });
  constexpr double tolerance = 1e-4;  // in xy: the lift's smoothing moves a chromaticity by less
  return {"chromaticity-clouds/metamers-match",
          "both halves of each ColorChecker colour match in bright light (CIE 1931, D65)",
          "0 in xy",
          fmt::format("{:.0e} at most", worst),
          worst <= tolerance,
          fmt::format("agrees within {:.0e}; the second half is the smoothest light of the first one's colour, not "
                      "MetaCow's, whose difference under illuminant A is the largest possible",
                      tolerance),
          Finding::Kind::check};
}

/// Reports how the predicted ellipses of halves that match differ, and how many pairs their samples distinguish.
Finding halves_differ(const std::vector<Colour>& halves) {
  constexpr double tenth = 0.1;
  double smallest = 1, largest = 1;
  int distinguished = 0;
  for_each_pair(halves, [&](const Cloud& a, const Cloud& b) {
    const double ratio = size_of(principal_ellipse(b.predicted, 1)) / size_of(principal_ellipse(a.predicted, 1));
    smallest = std::min(smallest, ratio);
    largest = std::max(largest, ratio);
    const double errors = worst_covariance_error(b.sampled.covariance, a.predicted.covariance, b.samples.size());
    distinguished += errors > confidence_errors ? 1 : 0;
  });
  return {"chromaticity-clouds/metamers-differ",
          "halves that match in bright light have ellipses of different size through few photons",
          "by a tenth or more",
          fmt::format("{:.2f} to {:.2f} times as large", smallest, largest),
          smallest < 1 - tenth || largest > 1 + tenth,
          fmt::format("predicted; the samples of {} of {} smooth halves at 6e-15 W have another covariance than is "
                      "predicted for the reflectance, by more than five standard errors",
                      distinguished, halves.size() / 2),
          Finding::Kind::check};
}

Finding pooled_halves(const std::vector<Colour>& halves) {
  const bool grow = pooled_ellipses_grow(halves);
  return {"chromaticity-clouds/pooled-checker",
          "ellipses of MetaCow's colours, pooled from 1 W down to a least intensity, grow as it falls (Fig. 3-8)",
          "grow",
          grow ? "all halves" : "not all halves",
          grow,
          "24 ColorChecker reflectances, which are one half of MetaCow's, and their smoothest metamers under D65, down "
          "to 1e-3 and to 6e-15 W"};
}

}  // namespace

Result<std::vector<Colour>> metameric_halves() {
  std::vector<Colour> out;
  for (Colour& colour : colours_under(*light_named("D65"), SpectrumSet::colorchecker)) {
    const auto smoothest = lift(xyz_of(colour.light));
    if (!smoothest) return fail(ErrorCode::insufficient, "no smooth light has the colour of " + colour.name);
    const std::string name = colour.name + ", smoothest";
    out.push_back(std::move(colour));
    out.push_back({name, *smoothest, {}});
  }
  return out;
}

Result<Outcome> metameric_clouds(const RunOptions& options) {
  auto halves = metameric_halves();
  if (!halves) return tl::make_unexpected(halves.error());
  const auto sampled =
      sample_colours(*halves, standard_observer(), {options.seed, frames_of_checker, options.quick ? 60u : 200u});
  if (!sampled) return tl::make_unexpected(sampled.error());
  Outcome out;
  out.findings = {size_law(*halves, checker), orientation(*halves, checker), covariance(*halves, checker)};
  for (Finding& finding : out.findings) finding.kind = Finding::Kind::check;
  out.findings.insert(out.findings.end(), {halves_match(*halves), halves_differ(*halves), pooled_halves(*halves)});
  out.plots = {
      chip_plot("chromaticity-clouds-checker", "24 ColorChecker reflectances under D65 and smooth metamers", *halves)};
  return out;
}

}  // namespace lowlux::isp
