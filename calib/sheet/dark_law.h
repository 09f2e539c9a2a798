#pragma once

#include <optional>
#include <span>

#include "isp/base/estimate.h"

namespace lowlux::calib {

/// Dark current at one temperature of the sensor.
struct RateAtTemperature {
  double temperature_c = 0;
  Estimate e_per_s;  // with a standard error above 0
};

/// Arrhenius law of the dark current, D(T) = F + A exp(-E / (k T)) with T in kelvin (Widenhorn and others 2002, without
/// the slow power of T).
struct DarkLaw {
  Estimate activation_ev;  // E
  Estimate floor_e_per_s;  // F, which cooling does not reduce; may lie below 0 by its error
};

/// Fits the law by weighted least squares to the rates at three or more temperatures that differ by more than a degree.
/// Standard errors are those that the rates' errors give, to first order. Returns nullopt if there are fewer
/// temperatures, or if the rates do not determine an energy of 0.1 to 2 eV with an error below a half of it.
std::optional<DarkLaw> fit_dark_law(std::span<const RateAtTemperature> rates);

}  // namespace lowlux::calib
