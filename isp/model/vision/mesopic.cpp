#include "isp/model/vision/mesopic.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isp/model/spectrum/cie_data.h"

namespace lowlux::isp {
namespace {

constexpr double a = 0.7670;  // CIE 191:2010
constexpr double b = 0.3334;
constexpr double v0 = scotopic_at_555_nm;
constexpr double max_luminance = 1e30;

double sound(double luminance) { return luminance > 0 ? std::min(luminance, max_luminance) : 0; }

struct Step {
  double h;      // a + b log10 L(m) - m
  double slope;  // dh/dm
};

Step step_at(double m, const LuminancePair& field) {
  const double numerator = m * field.photopic + (1 - m) * field.scotopic * v0;
  const double denominator = m + (1 - m) * v0;
  const double h = mes2_response(numerator / denominator) - m;
  return {h, b / std::numbers::ln10 * v0 * (field.photopic - field.scotopic) / (numerator * denominator) - 1};
}

// Returns the root of h: h(0) > 0 > h(1), or infinitely far below where a luminance is 0.
double root(const LuminancePair& field) {
  double low = 0, high = 1;
  const double middle = std::sqrt(field.photopic) * std::sqrt(field.scotopic);
  double m = middle > 0 ? std::clamp(a + b * std::log10(middle), 0.0, 1.0) : 0.5;
  for (int i = 0; i < 200; ++i) {
    const Step s = step_at(m, field);
    if (std::fabs(s.h) < 1e-12) return m;
    (s.h > 0 ? low : high) = m;
    const double next = m - s.h / s.slope;
    m = next > low && next < high ? next : 0.5 * (low + high);
  }
  return m;
}

}  // namespace

double mes2_response(double luminance_cd_m2) { return a + b * std::log10(luminance_cd_m2); }

double rod_fraction(double m) { return (1 - m) * v0 / (m + (1 - m) * v0); }

double mesopic_luminance_cd_m2(double m, const LuminancePair& stimulus) {
  return stimulus.photopic + rod_fraction(m) * (stimulus.scotopic - stimulus.photopic);
}

MesopicState mesopic_state(const LuminancePair& adaptation) {
  const LuminancePair field{sound(adaptation.photopic), sound(adaptation.scotopic)};
  const auto state = [&](double m) { return MesopicState{m, mesopic_luminance_cd_m2(m, field)}; };
  if (!(step_at(0, field).h > 0)) return state(0);
  if (step_at(1, field).h >= 0) return state(1);
  return state(root(field));
}

const Spectrum& scotopic_observer() {
  static const Spectrum observer = column_of(cie1951_scotopic_1nm_table(), 1);
  return observer;
}

LuminancePair luminance_of(const Spectrum& radiance) {
  const auto integral = [&](const Spectrum& observer) {
    return integrate(radiance, [&](double nm) { return observer.at(nm); });
  };
  return {luminous_efficacy_lm_w * integral(cie_1931_observer()[1]),
          scotopic_efficacy_lm_w * integral(scotopic_observer())};
}

double scotopic_luminance(const Xyz& colour) {
  const Vector3& w = scotopic_weights;
  return std::max(0.0, w[0] * colour.x + w[1] * colour.y + w[2] * colour.z);
}

double scotopic_luminance_ward(const Xyz& colour) {
  if (!(colour.x > 1e-9)) return scotopic_luminance(colour);
  return std::max(0.0, colour.y * (1.33 * (1 + (colour.y + colour.z) / colour.x) - 1.68));
}

double pupil_diameter_mm(double luminance_cd_m2) {
  if (!(luminance_cd_m2 > 0)) return 4.9 + 3;
  return 4.9 - 3 * std::tanh(0.4 * (std::log10(luminance_cd_m2) + 1));
}

double retinal_illuminance_td(double luminance_cd_m2) {
  const double diameter = pupil_diameter_mm(luminance_cd_m2);
  return luminance_cd_m2 * std::numbers::pi * diameter * diameter / 4;
}

}  // namespace lowlux::isp
