#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "isp/base/sensor.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/model/spectrum/cie_data.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/thesis_sensor.h"

namespace lowlux::isp {
namespace {

constexpr double levels[] = {0.1, 0.05, 0.01, 0.005, 0.001};
constexpr int chosen_patches[] = {1, 3, 6, 8, 10, 12};  // of the 13, counted from 1, as published
constexpr double more = 1.1;                            // + 10 %

enum class Form : std::uint8_t { consistent, as_printed };

/// Amounts of the noises other than photon noise.
struct Noise {
  double dark = 0;  // factor of the sensor's
  double read = 0;
  bool quantisation = false;
};

/// Returns the SNR of one channel with a signal [e-]. As printed, Eq. 4.12 adds the shot term in volts to squares of
/// volts:
///     Var [DN^2] = G^2 (G_Ve (mu + d) + (G_Ve sigma_r)^2) + 1/12
double snr_of(Form form, const ThesisCamera& camera, int channel, double signal_e, const Noise& noise) {
  SensorModel sensor = camera.sensor;
  sensor.read_noise_e *= noise.read;
  const MeanCharge charge{signal_e, noise.dark * dark_charge_e(camera)[channel]};
  const double signal_dn = sensor.system_gain_dn_per_e * signal_e;
  double variance = variance_dn2(sensor, charge) - quantisation_dn2;
  if (form == Form::as_printed) {
    const double shot_v = thesis_volt_per_e * (charge.signal_e + charge.dark_e);
    const double read_v = thesis_volt_per_e * sensor.read_noise_e;
    variance = thesis_dn_per_volt * thesis_dn_per_volt * (shot_v + read_v * read_v);
  }
  if (noise.quantisation) variance += quantisation_dn2;
  return signal_dn * signal_dn / variance;
}

/// Minimum and maximum relative loss of SNR from one noise to another, over the published levels and patches, in the
/// channel with the most signal of each patch.
struct Range {
  double least = 1;
  double most = 0;
};

int brightest(const Patch& patch) {
  return static_cast<int>(std::ranges::max_element(patch.signal_e) - patch.signal_e.begin());
}

Range loss(Form form, const ThesisCamera& camera, const std::vector<Patch>& patches, const Noise& from,
           const Noise& to) {
  Range out;
  for (const double level : levels) {
    for (const int number : chosen_patches) {
      const Patch& patch = patches[number - 1];
      const int k = brightest(patch);
      const double signal_e = level * patch.signal_e[k];
      const double lost = 1 - snr_of(form, camera, k, signal_e, to) / snr_of(form, camera, k, signal_e, from);
      out.least = std::min(out.least, lost);
      out.most = std::max(out.most, lost);
    }
  }
  return out;
}

std::string percent(const Range& r) { return fmt::format("{:.2g} to {:.2g} %", 100 * r.least, 100 * r.most); }

constexpr Noise read_only{0, 1, false}, more_read_only{0, more, false};
constexpr Noise dark_only{1, 0, false}, more_dark_only{more, 0, false};
constexpr Noise all{1, 1, true}, more_read{1, more, true}, more_dark{more, 1, true};
constexpr Noise unquantised{1, 1, false}, more_read_unquantised{1, more, false};

std::vector<Finding> read_findings(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  const Range printed = loss(Form::as_printed, camera, patches, read_only, more_read_only);
  const Range alone = loss(Form::consistent, camera, patches, read_only, more_read_only);
  const Range together = loss(Form::consistent, camera, patches, unquantised, more_read_unquantised);
  const std::string claim = "10 % more read noise costs less than 1 % of the SNR (section 4), ";
  return {{"snr-sensitivity/read-as-printed", claim + "Eq. 4.12 as printed", "below 1 %", percent(printed),
           printed.most < 0.01, "photon and read noise only; 10 to 0.1 cd/m2, patches 1, 3, 6, 8, 10, 12"},
          {"snr-sensitivity/read", claim + "consistent units", "below 1 %", percent(alone), alone.most < 0.01,
           "as printed, the shot term is in volts next to read noise in volts squared, which makes it 5000 times too "
           "large; in consistent units 16 e-^2 of read noise are compared with few electrons of signal"},
          {"snr-sensitivity/read-all-on", claim + "consistent units, dark current on", "below 1 %", percent(together),
           together.most < 0.01, "dark current's shot noise, about 215 e-^2, covers part of the read noise"}};
}

std::vector<Finding> dark_findings(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  const Range dark = loss(Form::consistent, camera, patches, dark_only, more_dark_only);
  const Range dark_on = loss(Form::consistent, camera, patches, all, more_dark);
  const Range read_on = loss(Form::consistent, camera, patches, all, more_read);
  return {{"snr-sensitivity/dark", "10 % more dark current costs SNR, more the darker it is (section 4)", "-",
           percent(dark), dark.most > dark.least && dark.most < 1 - 1 / more,
           "photon and dark noise only, consistent units; the bound for no signal is 9.1 %"},
          {"snr-sensitivity/dark-rules", "with all noises on, dark current rules (section 4)", "dark > read",
           fmt::format("dark {}, read {}", percent(dark_on), percent(read_on)),
           dark_on.least > read_on.least && dark_on.most > read_on.most,
           "10 % more of each; consistent units with quantisation"}};
}

Finding quantisation(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  const Range printed = loss(Form::as_printed, camera, patches, unquantised, all);
  const Range ours = loss(Form::consistent, camera, patches, unquantised, all);
  return {"snr-sensitivity/quantisation",
          "what quantisation to 8 bits costs of the SNR, 10 to 0.1 cd/m2",
          percent(printed) + " by Eq. 4.12 as printed",
          percent(ours),
          ours.most < 2 * printed.most,
          "one code is 35 e-, so 1/12 DN^2 are 104 e-^2 compared with 215 e-^2 of dark noise; as printed, that dark "
          "noise is 5000 "
          "times as much",
          Finding::Kind::check};
}

// Checks "about 9 e- at 0.1 cd/m2" for a perfect white, which follows from the scale of Qe.
Finding signal(const ThesisCamera& camera) {
  const double white_e = 0.001 * std::ranges::max(signal_charge_e(camera, *at_full_level(*light_named("D65"))));
  return {"snr-sensitivity/signal",
          "signal of a white at 0.1 cd/m2 (section 4)",
          "about 9 e-",
          fmt::format("{:.1f} e-", white_e),
          std::fabs(white_e - 9) < 1,
          "a perfect white under D65 at 100 cd/m2 fills the best channel; the consequence of that scale"};
}

Plot curves(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  Plot plot{"snr-sensitivity",      "Signal-to-noise ratio, all noises on",
            "luminance [cd/m2]",    "SNR (ratio of powers)",
            AxisScale::logarithmic, AxisScale::logarithmic};
  for (const Form form : {Form::consistent, Form::as_printed}) {
    for (const int number : chosen_patches) {
      const Patch& patch = patches[number - 1];
      Series series{fmt::format("{}{}", number, form == Form::consistent ? "" : ", as printed"),
                    {},
                    {},
                    form == Form::consistent ? Mark::line : Mark::dashed};
      for (int i = 0; i <= 20; ++i) {
        const double level = std::pow(10.0, -3 + i / 10.0);
        series.x.push_back(100 * level);
        series.y.push_back(snr_of(form, camera, brightest(patch), level * patch.signal_e[brightest(patch)], all));
      }
      plot.series.push_back(series);
    }
  }
  plot.caption = "Brightest channel of patches 1, 3, 6, 8, 10, 12; Eq. 4.12 in consistent units and as printed.";
  return plot;
}

}  // namespace

Result<Outcome> run_snr_sensitivity(const RunOptions& /*nothing is drawn*/) {
  const auto camera = thesis_camera();
  if (!camera) return tl::make_unexpected(camera.error());
  const auto patches = thesis_patches(*camera, scenario_iii_patches);
  if (!patches) return tl::make_unexpected(patches.error());
  Outcome out;
  out.findings = {signal(*camera)};
  for (const auto& more_findings : {read_findings(*camera, *patches), dark_findings(*camera, *patches)}) {
    out.findings.insert(out.findings.end(), more_findings.begin(), more_findings.end());
  }
  out.findings.push_back(quantisation(*camera, *patches));
  out.plots.push_back(curves(*camera, *patches));
  return out;
}

}  // namespace lowlux::isp
