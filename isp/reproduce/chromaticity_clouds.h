#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isp/base/spectrum.h"
#include "isp/model/colour/chromaticity_cloud.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {

inline constexpr double drawn_deviations = 10;  // scale of the thesis' ellipses, in standard deviations

/// Holds the samples of one colour at one level.
struct Cloud {
  double power_w = 0;
  std::vector<Xy> samples;
  ChromaticityCloud sampled;
  ChromaticityCloud predicted;  // to first order
};

struct Colour {
  std::string name;
  Spectrum light;
  std::vector<Cloud> clouds;  // by level, brightest first
};

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

/// Returns the findings on the pooled ellipses of chips, and the plot of their sizes (Fig. 3-6).
std::vector<Finding> pooled_findings(const std::vector<Colour>& chips);
Plot pooled_plot(const std::vector<Colour>& chips);

}  // namespace lowlux::isp
