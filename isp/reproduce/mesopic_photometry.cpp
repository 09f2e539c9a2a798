#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "isp/model/spectrum/cie_data.h"
#include "isp/model/vision/mesopic.h"
#include "isp/reproduce/reproduce.h"

namespace lowlux::isp {
namespace {

constexpr double states[] = {0, 0.25, 0.5, 0.75, 1};  // m of the plotted and checked V_mes
constexpr int shortest_nm = 380, longest_nm = 780;

double adaptation_at(double luminance_cd_m2, double scotopic_ratio) {
  return mesopic_state({luminance_cd_m2, scotopic_ratio * luminance_cd_m2}).m;
}

/// Returns m V(lambda) + (1 - m) V'(lambda), which is M(m) V_mes(lambda) (Eq. 2.8).
double mesopic_sensitivity(double m, double nm) {
  return m * cie_1931_observer()[1].at(nm) + (1 - m) * scotopic_observer().at(nm);
}

/// Returns the wavelength of the largest V_mes, the middle one where several share the table's value [nm].
double peak_nm(double m) {
  int first = shortest_nm, last = shortest_nm;
  for (int nm = shortest_nm; nm <= longest_nm; ++nm) {
    const double here = mesopic_sensitivity(m, nm), largest = mesopic_sensitivity(m, first);
    if (here > largest) first = nm;
    if (here >= largest) last = nm;
  }
  return 0.5 * (first + last);
}

Finding state_at_0_3() {
  constexpr double luminance_cd_m2 = 0.3, published = 0.6, half_a_digit = 0.05;
  const double equal = adaptation_at(luminance_cd_m2, 1);
  const double white = adaptation_at(luminance_cd_m2, scotopic_ratio_of_equal_energy);
  return {"mesopic-photometry/state",
          "the coefficient of adaptation at 0.3 cd/m2 (Eq. 2.9, Fig. 5-5)",
          "m = 0.6",
          fmt::format("{:.3f} at S/P = 1, {:.3f} at {}", equal, white, scotopic_ratio_of_equal_energy),
          std::fabs(equal - published) < half_a_digit && std::fabs(white - published) < half_a_digit,
          "agrees within half of the published digit; the thesis does not state S/P"};
}

Finding mesopic_region() {
  const double a = mes2_response(1), b = mes2_response(10) - a;
  const double low = std::pow(10, -a / b), high = std::pow(10, (1 - a) / b);
  return {"mesopic-photometry/region",
          "vision is mesopic from 0.005 to 5 cd/m2 (CIE 191:2010)",
          "0.005 to 5 cd/m2",
          fmt::format("{:.5f} to {:.4f} cd/m2", low, high),
          figures_agree({{0.005, low}, {5, high}}),
          "mesopic luminances at which m of Eq. 2.9 leaves 0 and reaches 1"};
}

Finding peaks() {
  const double by_day = peak_nm(1), by_night = peak_nm(0);
  return {"mesopic-photometry/peaks",
          "V_mes(lambda) of Eq. 2.8 goes from V to V': its peak moves from 555 to 507 nm",
          "555 and 507 nm",
          fmt::format("{} nm at m = 1, {} nm at m = 0", by_day, by_night),
          by_day == 555 && by_night == 507,
          "tables of CIE 1924 and 1951 in steps of 1 nm; V' is 1 from 506 to 508 nm in its table",
          Finding::Kind::check};
}

/// Compares L_mes by the integral of V_mes (Eq. 2.8) with the weighted luminances of Eq. 2.9.
Finding luminance_by_integral() {
  double worst = 0;
  for (const char* name : {"A", "D65", "E"}) {
    const Spectrum light = *light_named(name);
    for (const double m : states) {
      const double by_integral = luminous_efficacy_lm_w / mesopic_sensitivity(m, 555) *
                                 integrate(light, [&](double nm) { return mesopic_sensitivity(m, nm); });
      worst = std::max(worst, std::fabs(mesopic_luminance_cd_m2(m, luminance_of(light)) / by_integral - 1));
    }
  }
  constexpr double rounded_efficacy = 6e-4;  // 1700 for 1699 lm/W, and V'(555 nm) in three digits
  return {"mesopic-photometry/luminance",
          "L_mes by V_mes(lambda) (Eq. 2.8) is L_mes of Eq. 2.9",
          "equal to 6e-4",
          fmt::format("{:.1e} relative at most", worst),
          worst < rounded_efficacy,
          "illuminants A, D65 and E, m from 0 to 1; CIE 191 uses 1699 lm/W, the scotopic luminance 1700",
          Finding::Kind::check};
}

/// Returns whether the plain iteration of CIE 191, m <- a + b log10 L(m) from 0.5, reaches its root.
bool iteration_converges(double luminance_cd_m2, double scotopic_ratio) {
  constexpr int iterations = 500;
  constexpr double tolerance = 1e-6;
  const LuminancePair field{luminance_cd_m2, scotopic_ratio * luminance_cd_m2};
  double m = 0.5;
  for (int i = 0; i < iterations; ++i) {
    m = std::clamp(mes2_response(mesopic_luminance_cd_m2(m, field)), 0.0, 1.0);
  }
  return std::fabs(m - mesopic_state(field).m) < tolerance;
}

Finding iteration() {
  int first = 0;
  for (int ratio = 1; ratio <= 30 && first == 0; ++ratio) {
    for (int i = 0; i <= 100; ++i) {
      if (!iteration_converges(std::pow(10, -2 + i / 33.0), ratio)) first = ratio;
    }
  }
  return {
      "mesopic-photometry/iteration",
      "the iteration of Eq. 2.9 converges",
      "at all S/P",
      first == 0 ? "up to S/P = 30" : fmt::format("fails from S/P = {}", first),
      first == 0,
      "whole S/P from 1, 101 luminances from 0.01 to 10 cd/m2, 500 iterations; the iteration alternates between two "
      "values, lowlux finds the root instead; blue LEDs reach such S/P",
      Finding::Kind::check};
}

Plot state_plot() {
  Plot plot{"mesopic-photometry-state", "Adaptation between rods and cones", "luminance [cd/m2]", "m",
            AxisScale::logarithmic};
  for (const double ratio : {0.5, 1.0, scotopic_ratio_of_equal_energy}) {
    Series series{fmt::format("S/P = {}", ratio), {}, {}, Mark::line};
    for (int i = 0; i <= 80; ++i) {
      series.x.push_back(std::pow(10, -3 + i / 20.0));
      series.y.push_back(adaptation_at(series.x.back(), ratio));
    }
    plot.series.push_back(std::move(series));
  }
  plot.caption = "As Figure 5-5: the coefficient of adaptation of CIE 191.";
  return plot;
}

Plot sensitivity_plot() {
  Plot plot{"mesopic-photometry-sensitivity", "Mesopic spectral sensitivity", "wavelength [nm]", "V_mes"};
  for (const double m : states) {
    Series series{fmt::format("m = {}", m), {}, {}, Mark::line};
    const double peak = mesopic_sensitivity(m, peak_nm(m));
    for (int nm = shortest_nm; nm <= longest_nm; nm += 5) {
      series.x.push_back(nm);
      series.y.push_back(mesopic_sensitivity(m, nm) / peak);
    }
    plot.series.push_back(std::move(series));
  }
  plot.caption = "Eq. 2.8, peak 1.";
  return plot;
}

}  // namespace

Result<Outcome> run_mesopic_photometry(const RunOptions& /*nothing is drawn*/) {
  return Outcome{{state_at_0_3(), mesopic_region(), peaks(), luminance_by_integral(), iteration()},
                 {state_plot(), sensitivity_plot()}};
}

}  // namespace lowlux::isp
