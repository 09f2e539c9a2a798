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

/// Selects whether the coefficients of Shin's model are looked up by the illuminance on a white surface [lx], as its
/// authors measured them, or by the unconverted figure in cd/m2, as the thesis does.
enum class ShinUnits : std::uint8_t { lux, luminance_as_is };

/// States the noise of a measured colour, for models that weigh it.
struct ColourNoise {
  Matrix3 covariance = identity3();  // covariance of X, Y and Z where the noise of Y has a variance of 1
  double to_signal = 0;              // standard deviation of Y over Y
};

/// Describes how a scene is seen.
struct ViewingConditions {
  double white_cd_m2 = 100;  // luminance of a perfect white diffuser in the scene
  Xyz white{0.95047, 1.0, 1.08883};
  std::optional<double> adaptation_cd_m2;      // luminance of the adaptation field; absent: a fifth of the white
  double scotopic_ratio = 2.26;                // S/P of the adaptation field
  std::optional<double> colour_temperature_k;  // temperature of the light
  const ShinTable* shin = nullptr;             // absent: the substitute SHIN-SUB-1
  ShinUnits shin_units = ShinUnits::lux;
  std::optional<ColourNoise> noise;  // for AppearanceModel::uses_noise

  double adaptation() const { return adaptation_cd_m2.value_or(0.2 * white_cd_m2); }
};

/// Maps XYZ in the scene to the XYZ that looks the same to an eye adapted to daylight, both relative to a white of Y =
/// 1. Finite values, including negative ones and black, give finite values.
using ColourMap = std::function<Xyz(const Xyz&)>;

/// Describes one model of colour appearance at low luminance.
struct AppearanceModel {
  std::string_view name;        // name in options: "shin"
  std::string_view source;      // authors and year
  std::string_view needs;       // required knowledge beyond colours
  std::string_view limits;      // effects not modelled, in a sentence
  double valid_from_cd_m2 = 0;  // luminance of the scene's white; outside, results are extrapolated
  double valid_to_cd_m2 = 0;
  bool uses_noise = false;  // results depend on ViewingConditions::noise
  /// Makes the map for given conditions; everything that does not depend on the colour is computed here, once. Errors:
  /// invalid_argument for conditions that are not positive and finite (luminances within 1e-12..1e12 cd/m2), or a white
  /// that leaves a cone or the rods dark.
  Result<ColourMap> (*at)(const ViewingConditions& conditions);
};

/// Returns all appearance models, ordered by year of their source.
std::span<const AppearanceModel> appearance_models();

/// Returns the model of a name. Error: invalid_argument; the message lists the known names.
Result<AppearanceModel> appearance_model_named(std::string_view name);

}  // namespace lowlux::isp
