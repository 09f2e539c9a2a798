#include "isp/merge/stars/psf_equations.h"

#include <cmath>
#include <numbers>

namespace lowlux::merge {

AxisProfile::AxisProfile(int first, int count, double place, double sigma) {
  double below = 0, density_below = 0, t_below = 0;
  for (int i = 0; i <= count; ++i) {
    const double t = (first + i - 0.5 - place) / sigma;
    const double cdf = 0.5 * std::erf(t / std::numbers::sqrt2);
    const double density = std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
    if (i > 0) {
      const auto k = static_cast<std::size_t>(i - 1);
      value[k] = cdf - below;
      by_place[k] = (density_below - density) / sigma;
      by_width[k] = t_below * density_below - t * density;
    }
    below = cdf;
    density_below = density;
    t_below = t;
  }
}

ColourFit solve_colour(const ColourSums& s) {
  ColourFit out;
  const double determinant = s.one * s.ee - s.e * s.e;
  if (!(determinant > 1e-9 * s.one * s.ee)) {
    out.background = s.one > 0 ? s.y / s.one : 0;
    return out;
  }
  out.measured = true;
  out.flux = (s.one * s.ey - s.e * s.y) / determinant;
  out.background = (s.ee * s.y - s.e * s.ey) / determinant;
  out.flux_variance = s.one / determinant;
  for (std::size_t a = 0; a < 3; ++a) out.share[a] = (s.one * s.ed[a] - s.e * s.d[a]) / determinant;
  return out;
}

void ShapeEquations::add(const ColourSums& s, const ColourFit& fit) {
  if (!fit.measured) return;
  const double f = fit.flux, b = fit.background;
  for (std::size_t i = 0; i < 3; ++i) {
    gradient[i] += f * (s.yd[i] - b * s.d[i] - f * s.ed[i]);
    const double constant_fraction = s.one > 0 ? (s.d[i] - fit.share[i] * s.e) / s.one : 0;
    for (std::size_t j = 0; j <= i; ++j) {
      const double projected = fit.share[i] * s.ed[j] + constant_fraction * s.d[j];
      normal[i][j] += f * f * (s.dd[i][j] - projected);
      normal[j][i] = normal[i][j];
    }
  }
}

}  // namespace lowlux::merge
