#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "isp/base/matrix3.h"
#include "isp/base/result.h"
#include "isp/model/colour/colorimetry.h"

namespace lowlux::isp {

struct ShinTable;

/// Whether the coefficients of Shin's model are looked up with the illuminance on a white surface [lx], as its authors
/// measured them, or with the figure in cd/m2 as it stands, as the thesis does.
enum class ShinUnits : std::uint8_t { lux, luminance_as_is };

/// How a scene is seen.
struct ViewingConditions {
  double white_cd_m2 = 100;  // luminance of a perfect white diffuser in the scene
  Xyz white{0.95047, 1.0, 1.08883};
  std::optional<double> adaptation_cd_m2;      // of the adaptation field; absent: a fifth of the white
  double scotopic_ratio = 2.26;                // S/P of the adaptation field
  std::optional<double> colour_temperature_k;  // of the light
  const ShinTable* shin = nullptr;             // absent: the substitute SHIN-SUB-1
  ShinUnits shin_units = ShinUnits::lux;
  std::optional<Matrix3> noise_covariance;  // of cone responses, up to a factor: for the spectral model

  double adaptation() const { return adaptation_cd_m2.value_or(0.2 * white_cd_m2); }
};

/// XYZ in the scene to the XYZ that looks so to an eye adapted to daylight, both relative to a white of Y = 1. Finite
/// figures, negative ones and black among them, give finite figures.
using ColourMap = std::function<Xyz(const Xyz&)>;

/// One model of how colours look in the dark.
struct AppearanceModel {
  std::string_view name;        // as options spell it: "shin"
  std::string_view source;      // authors and year
  std::string_view needs;       // what it needs to know beyond colours
  std::string_view limits;      // what it does not claim, in a sentence
  double valid_from_cd_m2 = 0;  // of the scene's white; beyond, the answer is an extrapolation
  double valid_to_cd_m2 = 0;
  /// Everything that does not depend on the colour is done here, once. Errors: invalid_argument for conditions that
  /// are not positive and finite (luminances within 1e-12..1e12 cd/m2), or a white that leaves a cone or the rods dark.
  Result<ColourMap> (*at)(const ViewingConditions& conditions);
};

/// All of them, ordered by year of their source.
std::span<const AppearanceModel> appearance_models();

/// One by its name. Error: invalid_argument; the message names those there are.
Result<AppearanceModel> appearance_model_named(std::string_view name);

}  // namespace lowlux::isp
