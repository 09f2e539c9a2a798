#pragma once

#include "isp/base/matrix3.h"
#include "isp/model/appearance/appearance_model.h"

namespace lowlux::isp {

/// Weights of differences in appearance, in the units of CIE 116-1995 (Delta E 94, the source as reference, S_L = 1).
struct MatchWeights {
  double lightness = 0.6;
  double chroma = 1;
  double hue = 1;
  /// Weight of the squared difference as perceived by an eye adapted to daylight. It keeps colours from departing from
  /// those of the image for an invisible gain, and makes the optimum unique and continuous.
  double faithfulness = 0.0015;
};

/// Models the perception of an image's colours and of a display's colours.
struct AppearanceMatch {
  ColourMap seen_source;     // perceived colour of XYZ relative to the image's white
  ColourMap seen_display;    // perceived colour of XYZ relative to the display's white
  double display_black = 0;  // light of the display's neutral black relative to its white; 0 <= black < 1
  MatchWeights weights;
};

/// Holds the displayable colour that looks most like a colour of the image.
struct MatchedColour {
  Vector3 code{};          // sRGB code values, 0..1
  double cost = 0;         // match_cost of the colour
  bool held = false;       // a better colour lies outside the display's gamut
  bool converged = false;  // the last step was below 1e-7 of the code range
  int steps = 0;
};

/// Returns the weighted sum of squared differences between `shown` on the display and `source`, both sRGB code values
/// 0..1:
///     sum of w_i^2 (Delta_i(seen) / S_i)^2 + faithfulness * (the same of the colours themselves),
/// Delta_i the differences in lightness L*, along and across the chroma of the source, S_C = 1 + 0.045 C and S_H = 1 +
/// 0.015 C; neutrals have no direction, there both are plain differences.
double match_cost(const AppearanceMatch& match, const Vector3& source, const Vector3& shown);

/// Minimises match_cost over the cube of codes by Levenberg-Marquardt steps that are each the exact minimum within the
/// cube. Code values rather than light are the unknowns: in them appearance is nearly linear, down to black. The search
/// starts at the source's own codes, so that equal conditions give the same colour back.
/// @param source  sRGB code values; values outside 0..1 count as the nearest
MatchedColour closest_displayable(const AppearanceMatch& match, const Vector3& source);

}  // namespace lowlux::isp
