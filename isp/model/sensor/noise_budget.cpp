#include "isp/model/sensor/noise_budget.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <string>

#include "isp/base/sensor.h"
#include "isp/base/text.h"

namespace lowlux::isp {
namespace {

std::string six_digits(double value) { return number_text(value, 6); }

/// Rejects a law of the dark current that no sensor follows.
Result<void> check_dark_law(const SensorModel& s) {
  const auto wrong = [&](const std::string& what) { return fail(ErrorCode::invalid_argument, what, s.name); };
  if (!(s.dark_doubling_c >= 1) || !(s.dark_doubling_c <= 1e3)) {
    return wrong("the dark current must double every 1 to 1000 degrees, found " + six_digits(s.dark_doubling_c));
  }
  if (!(std::fabs(s.dark_temperature_c) <= 200)) {
    return wrong("the temperature of the dark current must lie between -200 and 200 C, found " +
                 six_digits(s.dark_temperature_c));
  }
  if (s.dark_activation_ev != 0 && !(s.dark_activation_ev >= 0.01 && s.dark_activation_ev <= 2)) {
    return wrong("the activation energy of the dark current must be 0 or between 0.01 and 2 eV, found " +
                 six_digits(s.dark_activation_ev));
  }
  const double least = *std::ranges::min_element(s.dark_current_e_per_s);
  if (!(s.dark_floor_e_per_s >= 0) || !(s.dark_floor_e_per_s <= least)) {
    return wrong("the floor of the dark current must lie between 0 and the least channel's current, " +
                 six_digits(least) + " e-/s, found " + six_digits(s.dark_floor_e_per_s));
  }
  return {};
}

/// Rejects a glow unless its rate lies within 0..1e6 e-/s, its position within -1..2 widths and heights, and its length
/// within 0.001..10 diagonals.
Result<void> check_glow(const SensorModel& sensor) {
  const auto wrong = [&](const std::string& limits, double found) {
    return fail(ErrorCode::invalid_argument, limits + ", found " + six_digits(found), sensor.name);
  };
  if (!(sensor.glow_e_per_s >= 0) || !(sensor.glow_e_per_s <= 1e6)) {
    return wrong("the amplifier glow must lie between 0 and 1e6 e-/s", sensor.glow_e_per_s);
  }
  for (const double part : sensor.glow_position) {
    if (!(part >= -1) || !(part <= 2)) {
      return wrong("the position of the amplifier glow must lie between -1 and 2 widths and heights", part);
    }
  }
  if (!(sensor.glow_length >= 0.001) || !(sensor.glow_length <= 10)) {
    return wrong("the length of the amplifier glow must lie between 0.001 and 10 diagonals", sensor.glow_length);
  }
  return {};
}

/// Rejects figures that are negative or above their limits.
Result<void> check_figures(const SensorModel& s) {
  struct Limit {
    double most;
    const char* text;
  };
  constexpr Limit noise{largest_noise_e, "1e6 e-"}, current{1e9, "1e9 e-/s"}, fraction{1, "1"};
  struct Figure {
    const char* name;
    double value;
    const Limit& limit;
  };
  for (const Figure& figure :
       std::initializer_list<Figure>{{"read noise", s.read_noise_e, noise},
                                     {"dark current of red", s.dark_current_e_per_s[0], current},
                                     {"dark current of green", s.dark_current_e_per_s[1], current},
                                     {"dark current of blue", s.dark_current_e_per_s[2], current},
                                     {"photo response non-uniformity", s.prnu, fraction},
                                     {"dark signal non-uniformity", s.dsnu, fraction},
                                     {"fraction of hot pixels", s.hot_pixel_fraction, fraction},
                                     {"dark current of hot pixels", s.hot_pixel_current_e_per_s, current},
                                     {"fraction of telegraph pixels", s.telegraph_fraction, fraction},
                                     {"telegraph noise", s.telegraph_e, noise},
                                     {"row noise", s.row_noise_e, noise},
                                     {"column noise", s.column_noise_e, noise}}) {
    if (figure.value >= 0 && figure.value <= figure.limit.most) continue;
    return fail(ErrorCode::invalid_argument,
                std::string("the ") + figure.name + " must lie between 0 and " + figure.limit.text + ", found " +
                    six_digits(figure.value),
                s.name);
  }
  return {};
}

double density(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi); }

/// Returns the probability that a standard normal variable lies between a and b, without cancellation in either tail.
double probability(double a, double b) {
  if (a > 0) return probability(-b, -a);
  return 0.5 * (std::erfc(-b / std::numbers::sqrt2) - std::erfc(-a / std::numbers::sqrt2));
}

}  // namespace

Result<void> check_sensor(const SensorModel& s) {
  if (auto good = check_figures(s); !good) return good;
  const auto wrong = [&](const std::string& what) { return fail(ErrorCode::invalid_argument, what, s.name); };
  if (!(s.system_gain_dn_per_e > 0) || !(s.system_gain_dn_per_e <= 1e6)) {
    return wrong("the system gain must be above 0 and at most 1e6 DN/e-, found " + six_digits(s.system_gain_dn_per_e));
  }
  if (s.bits < 1 || s.bits > 16) return wrong("the converter must have 1 to 16 bits, found " + std::to_string(s.bits));
  const double largest_code = (1 << s.bits) - 1;
  if (!(s.black_level_dn >= 0) || !(s.white_level_dn <= largest_code) || !(s.black_level_dn < s.white_level_dn)) {
    return wrong("black and white level must be 0 <= black < white <= " + six_digits(largest_code) + ", found " +
                 six_digits(s.black_level_dn) + " and " + six_digits(s.white_level_dn));
  }
  if (s.white_level_dn != std::floor(s.white_level_dn)) {
    return wrong("the white level must be a whole number, found " + six_digits(s.white_level_dn));
  }
  if (!(s.full_well_e > 0) || !(s.full_well_e <= largest_full_well_e)) {
    return wrong("the full well must be above 0 and at most 990000 e-, found " + six_digits(s.full_well_e));
  }
  if (!(s.crosstalk >= 0) || !(s.crosstalk <= largest_crosstalk)) {
    return wrong("the crosstalk must lie between 0 and 0.2 of a pixel's light for each neighbour, found " +
                 six_digits(s.crosstalk));
  }
  if (auto good = check_glow(s); !good) return good;
  return check_dark_law(s);
}

Result<void> check_exposure(const Exposure& exposure) {
  if (!(exposure.time_s >= 0) || !(exposure.time_s <= 1e6)) {
    return fail(ErrorCode::invalid_argument,
                "the exposure time must lie between 0 and 1e6 s, found " + six_digits(exposure.time_s));
  }
  if (!(exposure.temperature_c >= -100) || !(exposure.temperature_c <= 150)) {
    return fail(ErrorCode::invalid_argument, "the sensor's temperature must lie between -100 and 150 C, found " +
                                                 six_digits(exposure.temperature_c));
  }
  return {};
}

double dark_current_factor(const SensorModel& sensor, double temperature_c) {
  if (sensor.dark_activation_ev > 0) {
    const double t_k = temperature_c + zero_celsius_k, reference_k = sensor.dark_temperature_c + zero_celsius_k;
    return std::exp(sensor.dark_activation_ev / boltzmann_ev_per_k * (t_k - reference_k) / (t_k * reference_k));
  }
  return std::exp2((temperature_c - sensor.dark_temperature_c) / sensor.dark_doubling_c);
}

std::array<double, 3> dark_mean_e(const SensorModel& sensor, const Exposure& exposure) {
  const double factor = exposure.time_s * dark_current_factor(sensor, exposure.temperature_c);
  std::array<double, 3> mean{};
  const double floor_e = sensor.dark_floor_e_per_s * exposure.time_s;
  for (int k = 0; k < 3; ++k) {
    mean[k] = (sensor.dark_current_e_per_s[k] - sensor.dark_floor_e_per_s) * factor + floor_e;
  }
  return mean;
}

double telegraph_variance_e2(const SensorModel& sensor) {
  return 0.5 * sensor.telegraph_fraction * sensor.telegraph_e * sensor.telegraph_e;
}

double saturation_charge_e(const SensorModel& sensor) {
  return std::min(sensor.full_well_e, (sensor.white_level_dn - sensor.black_level_dn) / sensor.system_gain_dn_per_e);
}

std::array<bool, 3> saturated_channels(const SensorModel& sensor, const std::array<double, 3>& largest_dn) {
  const double k = sensor.system_gain_dn_per_e;
  const double noise_e = std::hypot(sensor.read_noise_e, std::hypot(sensor.row_noise_e, sensor.column_noise_e));
  const double full_dn = std::floor(sensor.black_level_dn + k * (sensor.full_well_e - 5 * noise_e));
  const double saturated_dn = std::min(sensor.white_level_dn, full_dn);
  std::array<bool, 3> flags{};
  for (int c = 0; c < 3; ++c) flags[c] = !(largest_dn[c] < saturated_dn);
  return flags;
}

double variance_dn2(const SensorModel& sensor, const MeanCharge& charge) {
  const double variance_e2 = charge.signal_e + charge.dark_e + sensor.read_noise_e * sensor.read_noise_e;
  return sensor.system_gain_dn_per_e * sensor.system_gain_dn_per_e * variance_e2 + quantisation_dn2;
}

double snr(const SensorModel& sensor, const MeanCharge& charge) {
  const double signal_dn = sensor.system_gain_dn_per_e * charge.signal_e;
  return signal_dn * signal_dn / variance_dn2(sensor, charge);
}

Moments clamped_normal(const Moments& normal, double low, double high) {
  const double s = std::sqrt(std::max(normal.variance, 0.0));
  const double centre = std::clamp(normal.mean, low, high);
  if (s == 0) return {centre, 0};
  // The moments are about `centre`, so that a variable far outside its bounds keeps its digits.
  const double a = (low - normal.mean) / s, b = (high - normal.mean) / s;
  const double below = probability(-INFINITY, a), inside = probability(a, b), above = probability(b, INFINITY);
  const double phi_a = std::isinf(a) ? 0 : density(a), phi_b = std::isinf(b) ? 0 : density(b);
  const double a_phi_a = std::isinf(a) ? 0 : a * phi_a, b_phi_b = std::isinf(b) ? 0 : b * phi_b;
  const double shift = normal.mean - centre;
  const double first = inside * shift + s * (phi_a - phi_b);  // E[(X - centre) inside]
  const double second =
      inside * (shift * shift + s * s) + 2 * shift * s * (phi_a - phi_b) + s * s * (a_phi_a - b_phi_b);
  const double to_low = below > 0 ? low - centre : 0, to_high = above > 0 ? high - centre : 0;
  const double mean = first + below * to_low + above * to_high;
  const double square = second + below * to_low * to_low + above * to_high * to_high;
  return {centre + mean, std::max(square - mean * mean, 0.0)};
}

QuantisationBounds quantisation_bounds(double std_dn) {
  constexpr int terms = 20;  // the rest matters below 0.05 DN only, where both bounds are at their limit
  constexpr double pi = std::numbers::pi;
  const double s2 = std_dn * std_dn;
  double mean = 0, variance = 0;
  for (int n = 1; n <= terms; ++n) {
    const double share = std::exp(-2 * pi * pi * n * n * s2);
    mean += share / (pi * n);
    variance += (4 * s2 + 1 / (pi * pi * n * n)) * share;
  }
  mean = std::min(mean, 0.5);
  return {mean, std::min(variance + mean * mean, s2 + 0.25)};
}

}  // namespace lowlux::isp
