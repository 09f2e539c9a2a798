#pragma once

#include <vector>

#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sensor_scenario.h"

namespace lowlux::isp {

/// Returns the findings on the scatter of single samples in scenarios I to III: Delta E ab, inclination and size of the
/// ellipses, sparse codes (thesis Fig. 4-5, 4-6, 4-8, 4-10 and 4-11).
std::vector<Finding> scatter_findings(const SensorScenarios& scenarios);

/// Returns the plots of Delta E ab, inclination and size of the ellipses over luminance.
std::vector<Plot> scatter_plots(const SensorScenarios& scenarios);

/// Returns the plot of photons per pixel over luminance (Fig. 4-5c), by the published etendue and the pixel's own.
Plot photons_plot(const ThesisCamera& camera);

}  // namespace lowlux::isp
