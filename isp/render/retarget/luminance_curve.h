#pragma once

#include <array>

#include "isp/base/result.h"

namespace lowlux::isp {

/// Describes the scene and the display of a luminance curve.
struct LuminanceRange {
  double source_white_cd_m2 = 250;
  double display_white_cd_m2 = 2;
  double display_black_cd_m2 = 0;
};

/// Maps luminances of a source: log10 of the display's [cd/m2] over log10 of the source's, linear between nodes, which
/// are evenly spaced over the 3.5 decades below the source's white, the range of 8-bit codes.
struct LuminanceCurve {
  static constexpr int segments = 32;
  static constexpr double decades = 3.5;
  double first_log = 0;                          // log10 of the source's luminance at the first node
  std::array<double, segments + 1> shown_log{};  // log10 of the display's luminance at each node, not falling
  double display_black_cd_m2 = 0;

  static constexpr double spacing() { return decades / segments; }
};

/// Returns the integral over l = log10 Y of
///     [(G - Gt(l)) - (T'(l) G - Gt(T(l)))]^2 + tau (l - T(l))^2,   G = 0.4, tau = 1e-4,
/// Gt = threshold_log_contrast: the change of contrasts above the threshold, and the change of luminances (Wanat &
/// Mantiuk, ACM Trans. Graph. 33 (2014)); one sample in the middle of each segment.
double luminance_curve_cost(const LuminanceCurve& curve);

/// Returns the curve of least cost that does not fall and stays within the display's black and white. It is found by
/// dynamic programming over a few values for each node around the best so far, in decreasing steps, to 1e-5 of a
/// decade. Errors: invalid_argument for luminances that are not positive and finite, a black not below the display's
/// white.
Result<LuminanceCurve> luminance_curve(const LuminanceRange& range);

/// Returns the luminance shown for one of the source [cd/m2]. Above the source's white it is the last node's; below the
/// first node it is proportional, so that zero light gives the display's black.
double retargeted_luminance(const LuminanceCurve& curve, double source_cd_m2);

}  // namespace lowlux::isp
