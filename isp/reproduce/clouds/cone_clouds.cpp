#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "isp/reproduce/clouds/chromaticity_clouds.h"

namespace lowlux::isp {
namespace {

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

}  // namespace

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

}  // namespace lowlux::isp
