#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/model/colour/chromaticity_cloud.h"
#include "isp/reproduce/clouds/observed_clouds.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {

inline constexpr double drawn_deviations = 10;  // scale of the thesis' ellipses, in standard deviations

/// Names a set of colours and their observer in findings.
struct ColourSet {
  std::string id;     // ends the names of findings: chromaticity-clouds/size-II
  std::string text;   // ends their claims
  std::string cones;  // ends the names of findings that are one for each observer: "" for that of CIE 1931
};

/// These are findings on the ellipses of colours: whether they grow as light falls; whether they grow with the power
/// -1/2 of light (the colour that is farthest off, in its standard errors); whether their orientation stays; whether
/// the sampled covariances are the predicted ones.
Finding ellipses_grow(const std::vector<Colour>& colours, const ColourSet& set);
Finding size_law(const std::vector<Colour>& colours, const ColourSet& set);
Finding orientation(const std::vector<Colour>& colours, const ColourSet& set);
Finding covariance(const std::vector<Colour>& colours, const ColourSet& set);

/// Returns the findings on whether bluish chips have smaller ellipses than reddish ones, in the mean and each.
std::vector<Finding> blue_and_red(const std::vector<Colour>& chips, const ColourSet& set);

/// Plots the ellipses of colours at the dimmest level, and MacAdam's.
Plot chip_plot(const std::string& id, const std::string& title, const std::vector<Colour>& chips);

/// Returns the reflectances of the ColorChecker under D65, each followed by the smoothest light of the same colour
/// (isp/model/spectrum/spectral_lift.h), without clouds. Errors: a reflectance whose colour has no such light.
Result<std::vector<Colour>> metameric_halves();

/// Samples the metameric halves, which stand for MetaCow's (Fig. 3-4, 3-7, 3-8).
Result<Outcome> metameric_clouds(const RunOptions& options);

/// Returns the distances E_xy of a cloud's samples from the chromaticity of the bright light (Eq. 3.11): their mean and
/// standard deviation (Eq. 3.12), and the mean of their squares.
struct ChromaticityError {
  double mean = 0;
  double deviation = 0;
  double mean_square = 0;
};
ChromaticityError chromaticity_error(const Cloud& cloud, const Xy& bright);

/// Returns the cloud of all samples of a colour from its brightest level down to level `last`, as the thesis pools them
/// (Fig. 3-6, 3-8). The first-order prediction has the mean of the levels' covariances: all have the same mean.
struct PooledCloud {
  ChromaticityCloud sampled;
  XyCovariance predicted;
};
PooledCloud pooled_cloud(const Colour& colour, std::size_t last);

/// Returns the ellipse of least area around all samples that is centred at a given chromaticity, as in the thesis'
/// Figure 3-3 (section 3.4.1): the least one around the samples and their mirror images. nullopt as
/// enclosing_ellipse().
std::optional<XyEllipse> centred_ellipse(const Xy& centre, std::span<const Xy> samples);

/// Returns the findings on E_xy of a colour, and its plot (Fig. 3-3b).
std::vector<Finding> error_findings(const Colour& colour);
Plot error_plot(const Colour& colour);

/// Returns whether the pooled ellipses of all colours are larger down to the dimmest level than down to the second.
bool pooled_ellipses_grow(const std::vector<Colour>& colours);

/// Returns the findings on the pooled ellipses of chips, and the plot of their sizes (Fig. 3-6).
std::vector<Finding> pooled_findings(const std::vector<Colour>& chips);
Plot pooled_plot(const std::vector<Colour>& chips);

}  // namespace lowlux::isp
