#pragma once

#include <cstdint>

#include "isp/base/image.h"
#include "isp/base/tone_table.h"

namespace lowlux::isp {

enum class ToneCurve : std::uint8_t { standard, none };

/// Describes a change of the standard curve; the default changes nothing.
struct ToneShape {
  double brightness_ev = 0;  // -1..2: mid-grey is shown 2^brightness_ev times as bright, black and white stay
  double contrast = 1;       // 0.5..1.5: factor of the slope at mid-grey
  friend bool operator==(const ToneShape&, const ToneShape&) = default;
};
inline constexpr double min_brightness_ev = -1;
inline constexpr double max_brightness_ev = 2;
inline constexpr double min_contrast = 0.5;
inline constexpr double max_contrast = 1.5;

/// make_tone_table accepts limits up to this gain, 2^12.
inline constexpr double max_tone_limit = 4096;

/// Returns the scene-linear value, after exposure, that becomes display white: where the sensor saturates, but not
/// below 1 and not above max_tone_limit. `none` compresses nothing: 1.
double tone_limit(ToneCurve curve, double exposure_ev);

/// Converts a scene-linear value after exposure to a display-linear value, both relative to white.
///
/// `none` is the identity up to 1.
///
/// `standard` maps [0, limit] onto [0, 1] in two segments that meet at mid-grey m = 0.18 with equal value and slope:
///     toe,      x <= m:  y = x (s + (1 - s) x / m),              s = 0.7 (slope at black)
///     shoulder, x >= m:  y = m + g t / (1 + (a t)^p)^(1/p),      t = x - m, g = 2 - s = 1.3, p = 1.5
///     a = ((g T / (1 - m))^p - 1)^(1/p) / T,                     T = limit - m
/// Derivation. Mid-grey has to stay where exposure put it, for every limit, so the curve is built outward from (m, m).
/// Downward the simplest curve through (0, 0) and (m, m) that gives contrast is a parabola; its slope runs evenly from
/// s to 2 - s, so shadows get up to 1.3 times contrast at the expense of the deepest ones. Slope s < 1 at black: noise
/// around zero is not amplified, and below zero the line s x continues, so it is not rectified either. Upward the
/// straight line of slope g has to bend to reach 1 at the limit. (1 + z^p)^(-1/p) bends the line z towards a level
/// smoothly and without end: p = 1 bends from the start (mid-tones lose contrast), a large p is a corner; 1.5 shows a
/// white wall (x = 0.9) at 0.92 of white for limit 1, at 0.73 for limit 1000, where lamps need the range above. `a`
/// follows from y(limit) = 1 and is real because g T >= 1 - m for limit >= 1. The slope g (1 + (a t)^p)^(-1/p - 1) is
/// positive everywhere and continuous at m: monotone and C1 for every limit.
///
/// A shape changes g to 1.3 contrast (and s to 2 - g, so that the toe stays a parabola through black and mid-grey), and
/// multiplies the result at m, and the slopes on both sides of it, by k = 2^brightness_ev:
///     toe:       y = k x (s + (1 - s) x / m)
///     shoulder:  y = k m + k g t / (1 + (a t)^p)^(1/p),          a so that y(limit) = 1
/// (a t)^p is negative where the line of slope k g ends below 1: the shoulder then bends upward. All shapes are
/// monotone and C1, with y(0) = 0 and y(limit) = 1. `none` has no shape.
///
/// Above the limit the result is 1.
/// @param limit  value that tone_limit returns
double apply_tone(ToneCurve curve, double scene_linear, double limit, const ToneShape& shape = {});

/// Combines apply_tone and encode_transfer in one table, for kernels. The table's input is v = x / limit in 0..1. Even
/// steps reach up to x = 2^-6 (or the power of two next to it, if the limit is not a power of two); from there every
/// octave has the same number of bins, as many as fit: 512 for limits to 2^1.4, 256 to 2^9.4, 128 above.
/// Errors against the exact curve, over all v, for limits up to   2^1.4   2^9.4   2^12
///     code8, srgb p3 rec2020 (0.5 of it is the rounding)           0.6     0.7     0.8
///     code8, linear spaces                                         0.7     0.75    0.9
///     interpolated edges, of 65535                                 0.2     0.2     0.5
/// v = 0 gives exactly 0 and v = 1 exactly 1; the upper edge of the last bin, beyond v = 1, may lie above 1, so that
/// the line through it meets 1 at v = 1.
/// @param limit  1..max_tone_limit; exactly 1 for ToneCurve::none
ToneTable make_tone_table(ToneCurve curve, OutputSpace space, double limit, const ToneShape& shape = {});

}  // namespace lowlux::isp
