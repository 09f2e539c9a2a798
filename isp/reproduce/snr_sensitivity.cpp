#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "isp/base/sensor.h"
#include "isp/model/sensor/noise_budget.h"
#include "isp/reproduce/reproduce.h"
#include "isp/reproduce/sensor_scenario.h"
#include "isp/reproduce/thesis_sensor.h"

namespace lowlux::isp {
namespace {

constexpr double levels[] = {0.1, 0.05, 0.01, 0.005, 0.001};
constexpr int chosen_patches[] = {1, 3, 6, 8, 10, 12};  // of the 13, counted from 1, as published
constexpr double more = 1.1;                            // + 10 %

enum class Form : std::uint8_t { consistent, as_printed };

/// Amounts of the noises other than photon noise. `rounded`: the signal of Eq. 4.13 is the code of the noise-free
/// charge, [G G_Ve mu]_nb, and not a fraction of codes.
struct Noise {
  double dark = 0;  // factor of the sensor's
  double read = 0;
  bool quantisation = false;
  bool rounded = false;
};

/// Returns the SNR of one channel with a signal [e-] (Eq. 4.13). As printed, Eq. 4.12 adds the shot term in volts to
/// squares of volts:
///     Var [DN^2] = G^2 (G_Ve (mu + d) + (G_Ve sigma_r)^2) + 1/12
double snr_of(Form form, const ThesisCamera& camera, int channel, double signal_e, const Noise& noise) {
  SensorModel sensor = camera.sensor;
  sensor.read_noise_e *= noise.read;
  const MeanCharge charge{signal_e, noise.dark * dark_charge_e(camera)[channel]};
  const double exact_dn = sensor.system_gain_dn_per_e * signal_e;
  const double signal_dn = noise.rounded ? std::min(std::floor(exact_dn), sensor.white_level_dn) : exact_dn;
  double variance = variance_dn2(sensor, charge) - quantisation_dn2;
  if (form == Form::as_printed) {
    const double shot_v = thesis_volt_per_e * (charge.signal_e + charge.dark_e);
    const double read_v = thesis_volt_per_e * sensor.read_noise_e;
    variance = thesis_dn_per_volt * thesis_dn_per_volt * (shot_v + read_v * read_v);
  }
  if (noise.quantisation) variance += quantisation_dn2;
  return signal_dn * signal_dn / variance;
}

/// Pairs the noises between which the loss of SNR is measured.
struct Step {
  Noise from, to;
};

/// Returns the relative loss of SNR of one channel by a step.
double loss_of(Form form, const ThesisCamera& camera, const Patch& patch, int channel, double level, const Step& step) {
  const double signal_e = level * patch.signal_e[channel];
  return 1 - snr_of(form, camera, channel, signal_e, step.to) / snr_of(form, camera, channel, signal_e, step.from);
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

void include(Range& range, double loss) {
  range.least = std::min(range.least, loss);
  range.most = std::max(range.most, loss);
}

Range range_of(Form form, const ThesisCamera& camera, const std::vector<Patch>& patches, const Step& step) {
  Range out;
  for (const double level : levels) {
    for (const int number : chosen_patches) {
      const Patch& patch = patches[number - 1];
      include(out, loss_of(form, camera, patch, brightest(patch), level, step));
    }
  }
  return out;
}

/// Returns the range over the patches and levels in one channel.
Range range_in_channel(const ThesisCamera& camera, const std::vector<Patch>& patches, const Step& step, int channel) {
  Range out;
  for (const double level : levels) {
    for (const int number : chosen_patches) {
      include(out, loss_of(Form::consistent, camera, patches[number - 1], channel, level, step));
    }
  }
  return out;
}

/// Returns the range over the patches at one level, in the channel with the most signal of each.
Range range_at(const ThesisCamera& camera, const std::vector<Patch>& patches, const Step& step, double level) {
  Range out;
  for (const int number : chosen_patches) {
    const Patch& patch = patches[number - 1];
    include(out, loss_of(Form::consistent, camera, patch, brightest(patch), level, step));
  }
  return out;
}

std::string percent(double share) {
  return share < 0.1 ? fmt::format("{:.2g}", 100 * share) : fmt::format("{:.0f}", 100 * share);
}

std::string percent(const Range& r) { return fmt::format("{} to {} %", percent(r.least), percent(r.most)); }

std::string channels(const ThesisCamera& camera, const std::vector<Patch>& patches, const Step& step) {
  return fmt::format("R {}, G {}, B {}", percent(range_in_channel(camera, patches, step, 0)),
                     percent(range_in_channel(camera, patches, step, 1)),
                     percent(range_in_channel(camera, patches, step, 2)));
}

constexpr Noise all{1, 1, true}, unquantised{1, 1, false};
constexpr Step more_read{{0, 1, false}, {0, more, false}};  // one noise at a time, photon noise always
constexpr Step more_dark{{1, 0, false}, {more, 0, false}};  // likewise
constexpr Step more_read_in_all{all, {1, more, true}}, more_dark_in_all{all, {more, 1, true}};
constexpr Step more_read_with_dark{unquantised, {1, more, false}};
constexpr Step quantised{unquantised, {1, 1, true, true}};  // Eq. 4.12 and 4.13: 1/12, and the signal's own code
constexpr Step twelfth{unquantised, all};                   // 1/12 alone

std::vector<Finding> read_findings(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  const Range printed = range_of(Form::as_printed, camera, patches, more_read);
  const Range alone = range_of(Form::consistent, camera, patches, more_read);
  const Range together = range_of(Form::consistent, camera, patches, more_read_with_dark);
  const std::string claim = "10 % more read noise costs less than 1 % of the SNR (section 4), ";
  return {{"snr-sensitivity/read-as-printed", claim + "Eq. 4.12 as printed", "below 1 %", percent(printed),
           printed.most < 0.01, "photon and read noise only; 10 to 0.1 cd/m2, patches 1, 3, 6, 8, 10, 12"},
          {"snr-sensitivity/read", claim + "consistent units", "below 1 %", percent(alone), alone.most < 0.01,
           "as printed, the shot term is in volts next to read noise in volts squared, which makes it 5000 times too "
           "large; in consistent units 16 e-^2 of read noise are compared with few electrons of signal; " +
               channels(camera, patches, more_read)},
          {"snr-sensitivity/read-all-on", claim + "consistent units, dark current on", "below 1 %", percent(together),
           together.most < 0.01, "dark current's shot noise, about 215 e-^2, covers part of the read noise",
           Finding::Kind::check}};
}

std::vector<Finding> dark_findings(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  constexpr double published_least = 0.01, published_most = 0.09;
  constexpr double half_a_digit = 0.005;  // the published figures are whole percents
  const Range dark = range_of(Form::consistent, camera, patches, more_dark);
  const Range dark_on = range_of(Form::consistent, camera, patches, more_dark_in_all);
  const Range read_on = range_of(Form::consistent, camera, patches, more_read_in_all);
  return {
      {"snr-sensitivity/dark", "10 % more dark current costs 1 to 9 % of the SNR (section 4)", "1 to 9 %",
       percent(dark),
       std::fabs(dark.least - published_least) < half_a_digit && std::fabs(dark.most - published_most) < half_a_digit,
       "photon and dark noise only, consistent units; agrees within half a percent, half of the last published "
       "digit; the bound for no signal is 9.1 %; " +
           channels(camera, patches, more_dark)},
      {"snr-sensitivity/dark-rules", "with all noises on, dark current costs more of the SNR than read noise",
       "dark > read", fmt::format("dark {}, read {}", percent(dark_on), percent(read_on)),
       dark_on.least > read_on.least && dark_on.most > read_on.most,
       "10 % more of each; consistent units with quantisation", Finding::Kind::check}};
}

/// Returns whether a step costs more of the SNR at each level than at the level above it, in all patches and channels.
bool grows_in_the_dark(const ThesisCamera& camera, const std::vector<Patch>& patches, const Step& step) {
  for (const int number : chosen_patches) {
    for (int k = 0; k < 3; ++k) {
      const auto loss = [&](double level) {
        return loss_of(Form::consistent, camera, patches[number - 1], k, level, step);
      };
      if (!std::ranges::is_sorted(levels, {}, loss)) return false;
    }
  }
  return true;
}

/// Counts, over the levels and channels, how often the patch with the most signal in a channel loses the least there,
/// and how often the losses of all patches rise with falling signal.
struct Order {
  int best_seen_first = 0;
  int all = 0;
  int cases = 0;
};

Order order_of(const ThesisCamera& camera, const std::vector<Patch>& patches, const Step& step) {
  Order out;
  for (const double level : levels) {
    for (int k = 0; k < 3; ++k) {
      auto numbers = std::to_array(chosen_patches);
      std::ranges::sort(numbers, std::greater<>(), [&](int number) { return patches[number - 1].signal_e[k]; });
      const auto loss = [&](int number) {
        return loss_of(Form::consistent, camera, patches[number - 1], k, level, step);
      };
      out.best_seen_first += std::ranges::min(numbers, {}, loss) == numbers.front() ? 1 : 0;
      out.all += std::ranges::is_sorted(numbers, {}, loss) ? 1 : 0;
      ++out.cases;
    }
  }
  return out;
}

std::vector<Finding> pattern_findings(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  const bool read = grows_in_the_dark(camera, patches, more_read);
  const bool dark = grows_in_the_dark(camera, patches, more_dark);
  const Order by_read = order_of(camera, patches, more_read), by_dark = order_of(camera, patches, more_dark);
  const Order by_codes = order_of(camera, patches, quantised);
  const bool best = by_read.best_seen_first == by_read.cases && by_dark.best_seen_first == by_dark.cases;
  const auto text = [](bool yes) { return yes ? "yes" : "no"; };
  const std::string where = "R, G and B of patches 1, 3, 6, 8, 10, 12";
  return {
      {"snr-sensitivity/read-monotone", "read noise costs more of the SNR the less light there is (Fig. 4-12 to 4-14)",
       "monotone", text(read), read, where},
      {"snr-sensitivity/largest-in-the-dark",
       "the influence of read noise and dark current is largest at the smallest F (Fig. 4-12 to 4-14)", "largest",
       text(read && dark), read && dark, where},
      {"snr-sensitivity/best-seen", "the patch that a channel sees best suffers least (Fig. 4-12 to 4-14)", "least",
       text(best), best, where + "; read noise and dark current"},
      {"snr-sensitivity/quantisation-pattern",
       "the influence of quantisation has no consistent pattern (Fig. 4-12 to 4-14)", "none",
       fmt::format("losses follow the signal in {} of {} levels and channels, with read noise in {}", by_codes.all,
                   by_codes.cases, by_read.all),
       by_codes.all < by_codes.cases && by_read.all == by_read.cases && by_dark.all == by_dark.cases,
       where + fmt::format("; {} at 10 cd/m2, {} at 1; a signal's distance from the code below it is a saw-tooth",
                           percent(range_at(camera, patches, quantised, 0.1)),
                           percent(range_at(camera, patches, quantised, 0.01)))}};
}

Finding quantisation(const ThesisCamera& camera, const std::vector<Patch>& patches) {
  const Range ours = range_of(Form::consistent, camera, patches, quantised);
  const Range read = range_of(Form::consistent, camera, patches, more_read);
  const Range dark = range_of(Form::consistent, camera, patches, more_dark);
  return {
      "snr-sensitivity/quantisation",
      "quantisation has the most significant influence on the SNR (section 4)",
      "the most",
      fmt::format("{}; read noise {}, dark current {}", percent(ours), percent(read), percent(dark)),
      ours.least > std::max(read.least, dark.least) && ours.most > std::max(read.most, dark.most),
      fmt::format("with and without it, the signal in Eq. 4.13 being the code of the noise-free charge; 1/12 DN^2 "
                  "alone costs {}, and {} by Eq. 4.12 as printed; {}",
                  percent(range_of(Form::consistent, camera, patches, twelfth)),
                  percent(range_of(Form::as_printed, camera, patches, twelfth)), channels(camera, patches, quantised))};
}

/// Plots the loss of SNR by a step over luminance, each channel of the chosen patches.
Plot loss_plot(const std::string& id, const std::string& title, const ThesisCamera& camera,
               const std::vector<Patch>& patches, const Step& step) {
  Plot plot{"snr-sensitivity-" + id, title, "luminance [cd/m2]", "loss of SNR [%]", AxisScale::logarithmic};
  constexpr Mark marks[] = {Mark::line, Mark::dashed, Mark::points};
  for (int k = 0; k < 3; ++k) {
    for (const int number : chosen_patches) {
      Series series{fmt::format("{}{}", "RGB"[k], number), {}, {}, marks[k]};
      for (const double level : levels) {
        series.x.push_back(cd_m2_per_level * level);
        series.y.push_back(100 * loss_of(Form::consistent, camera, patches[number - 1], k, level, step));
      }
      plot.series.push_back(std::move(series));
    }
  }
  plot.caption = "As Figures 4-12 to 4-14: R, G and B of patches 1, 3, 6, 8, 10, 12, in consistent units.";
  return plot;
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
        series.x.push_back(cd_m2_per_level * level);
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
  const auto patches = thesis_patches(*camera, scenario_ii_patches);
  if (!patches) return tl::make_unexpected(patches.error());
  Outcome out;
  for (const auto& some :
       {read_findings(*camera, *patches), dark_findings(*camera, *patches), pattern_findings(*camera, *patches)}) {
    out.findings.insert(out.findings.end(), some.begin(), some.end());
  }
  out.findings.push_back(quantisation(*camera, *patches));
  out.plots = {curves(*camera, *patches), loss_plot("read", "10 % more read noise", *camera, *patches, more_read),
               loss_plot("dark", "10 % more dark current", *camera, *patches, more_dark),
               loss_plot("quantisation", "Quantisation to 8 bits", *camera, *patches, quantised)};
  return out;
}

}  // namespace lowlux::isp
