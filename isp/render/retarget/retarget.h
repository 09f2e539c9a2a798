#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/appearance/appearance_model.h"
#include "isp/model/appearance/shin_table.h"
#include "isp/render/retarget/retarget_optimum.h"

namespace lowlux::isp {

/// Names the methods that preserve the appearance of an image on a display of another luminance.
enum class RetargetMethod : std::uint8_t {
  constrained,  // this project's method: the displayable colour with the closest appearance by Shin's model
                // (closest_displayable)
  shin,         // Shin's model inverted as published, Y' that of the source, then moved towards neutral (thesis 5.3)
  shin_consistent,  // like `shin`, with Y' of the result itself
  wanat,            // saturation and luminance curve of Wanat & Mantiuk 2014
  cao,              // the two-term model of Cao et al. 2008, which the thesis calls Wanat & Mantiuk's
  icam06,           // the displayable colour with the closest appearance by iCAM06
  none,             // the image unchanged
};

/// Holds a method and its name.
struct NamedRetargetMethod {
  RetargetMethod method;
  std::string_view name;
};

inline constexpr std::array<NamedRetargetMethod, 7> retarget_methods{
    {{RetargetMethod::constrained, "constrained"},
     {RetargetMethod::shin, "shin"},
     {RetargetMethod::shin_consistent, "shin-consistent"},
     {RetargetMethod::wanat, "wanat"},
     {RetargetMethod::cao, "cao"},
     {RetargetMethod::icam06, "icam06"},
     {RetargetMethod::none, "none"}}};

std::string_view name_of(RetargetMethod method);

/// Holds the request for another display.
struct RetargetOptions {
  RetargetMethod method = RetargetMethod::constrained;
  double source_cd_m2 = 250;         // white of the display or scene for which the image is correct
  double display_cd_m2 = 2;          // white of the display for which the result is made
  double display_black_cd_m2 = 0;    // neutral luminance that the display shows for code 0
  const ShinTable* shin = nullptr;   // absent: the substitute SHIN-SUB-1; borrowed for the call
  ShinUnits units = ShinUnits::lux;  // luminance_as_is: as in the thesis
  MatchWeights weights;              // weights of `constrained`
};

/// Returns the origin of the coefficients, for reports; empty for methods without Shin's model.
std::string coefficients_name(const RetargetOptions& options);

/// Holds a colour for another display.
struct RetargetedColour {
  Vector3 code{};
  bool held = false;  // whether the colour of equal appearance is outside the display's gamut
};

/// Maps sRGB code values, 0..1, of the image to those of the display.
using RetargetMap = std::function<RetargetedColour(const Vector3& code)>;

/// Returns the map for the given options. Colours stay as they are where both luminances are the same and the display's
/// black is 0; neutrals stay neutral, except with `cao`, which adds the rods' own colour.
/// Errors: invalid_argument for luminances that are not positive and finite, a black that is not below the display's
/// white, coefficients the model cannot use.
Result<RetargetMap> retargeting(const RetargetOptions& options);

}  // namespace lowlux::isp
