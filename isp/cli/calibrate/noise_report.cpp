#include "isp/cli/calibrate/noise_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calib/flat/transfer_curve.h"
#include "isp/cli/calibrate/black_report.h"
#include "isp/cli/shared/lines.h"
#include "isp/raw/black_point.h"

namespace lowlux::cli {
namespace {

using Pairs = std::span<const calib::PairStatistics>;

std::string optional_text(const std::optional<Estimate>& e, const char* unit, const char* none) {
  return e ? text_of(*e) + unit : std::string(none);
}

std::string saturation_text(const calib::PhotonTransfer& t) {
  if (!t.saturation) {
    return t.saturation_capacity_e ? fmt::format("{:.5g} e- at the largest variance; no flat reaches the full well",
                                                 t.saturation_capacity_e->value)
                                   : "not reached by the flats";
  }
  const bool well = t.saturation->limited_by == calib::Saturation::LimitedBy::full_well;
  return fmt::format("{} e-, {}", text_of(t.saturation->charge_e),
                     well ? "the full well of the pixels" : "the largest code of the converter");
}

/// Returns values by name, for text and table alike.
std::vector<std::pair<const char*, std::string>> figures_of(const calib::PhotonTransfer& t) {
  const auto& b = t.black_dn;
  return {
      {"system gain", text_of(t.system_gain_dn_per_e) + " DN/e-"},
      {"of each site",
       fmt::format("{:.5g} {:.5g} {:.5g} {:.5g} DN/e-, reduced chi square {:.3g}", t.gain_of_site_dn_per_e[0].value,
                   t.gain_of_site_dn_per_e[1].value, t.gain_of_site_dn_per_e[2].value, t.gain_of_site_dn_per_e[3].value,
                   t.reduced_chi_square_of_sites)},
      {"read noise", optional_text(t.read_noise_e, " e-", "unknown: the noise of the darks is less than half a code")},
      {"row noise", fmt::format("{:.3g} e-", t.row_noise_e)},
      {"black [DN]", fmt::format("{:.3f} {:.3f} {:.3f} {:.3f}", b[0], b[1], b[2], b[3])},
      {"full well", saturation_text(t)},
      {"PRNU", fmt::format("{:.3g} +- {:.2g} %", 100 * t.prnu.value, 100 * t.prnu.standard_error)},
      {"dark pattern", optional_text(t.dsnu_e, " e-", "unknown: the noise of the darks is less than half a code")},
      {"linearity", t.linearity_error ? fmt::format("{:.2g} % mean deviation from a line", 100 * *t.linearity_error)
                                      : std::string("not measured: needs --steady-light and three exposure times")},
      {"fit", fmt::format("reduced chi square {:.3g}, {} degrees of freedom, {} levels of light", t.reduced_chi_square,
                          t.degrees_of_freedom, t.levels)},
  };
}

/// Returns the points of each site, `value` against signal.
template <class Value>
std::vector<isp::Series> by_site(const std::vector<calib::TransferPoint>& points, const Value& value) {
  std::vector<isp::Series> out;
  for (int site = 0; site < 4; ++site) {
    isp::Series own{.name = site_names[site], .mark = isp::Mark::points};
    for (const calib::TransferPoint& p : points) {
      if (p.site != site || p.pair < 0) continue;
      own.x.push_back(p.signal_dn);
      own.y.push_back(value(p));
    }
    out.push_back(std::move(own));
  }
  return out;
}

double fitted_dn2(const calib::TransferLine& line, double signal_dn) {
  return line.gain_dn_per_e.value * signal_dn + line.offset_dn2.value;
}

isp::Plot plot_of_curve(const calib::TransferCurve& curve, const calib::TransferLine& line, const std::string& id) {
  isp::Plot plot{.id = id + "-photon-transfer",
                 .title = "Photon transfer curve",
                 .x_label = "mean above the darks [DN]",
                 .y_label = "temporal variance without quantisation [DN^2]",
                 .x_scale = isp::AxisScale::logarithmic,
                 .y_scale = isp::AxisScale::logarithmic};
  plot.series = by_site(curve.flats, [](const calib::TransferPoint& p) { return p.variance_dn2; });
  isp::Series fit{.name = "fit"};
  for (const calib::TransferPoint& p : curve.linear) {
    if (p.pair >= 0) fit.x.push_back(p.signal_dn);
  }
  std::sort(fit.x.begin(), fit.x.end());
  for (const double x : fit.x) fit.y.push_back(fitted_dn2(line, x));
  plot.series.push_back(std::move(fit));
  return plot;
}

isp::Plot plot_of_residuals(const calib::TransferCurve& curve, const calib::TransferLine& line, const std::string& id) {
  return {.id = id + "-transfer-residuals",
          .title = "Residuals of the linear range",
          .x_label = "mean above the darks [DN]",
          .y_label = "variance / fit - 1",
          .x_scale = isp::AxisScale::logarithmic,
          .series = by_site(curve.linear, [&](const calib::TransferPoint& p) {
            return p.variance_dn2 / fitted_dn2(line, p.signal_dn) - 1;
          })};
}

}  // namespace

void show_photon_transfer(const calib::PhotonTransfer& transfer, Pairs darks, Pairs flats, Calibration& found) {
  const std::string name = name_of_gain(darks.front().setting);
  Lines out;
  isp::ReportSection section{name, "", {{"figure", "value"}, {}}, {}};
  for (const auto& [label, value] : figures_of(transfer)) {
    out.add(label, value);
    section.table.rows.push_back({label, value});
  }
  found.text += name + "\n" + out.text();
  const auto joined = calib::join_darks(darks);
  const auto curve = calib::curve_of(darks, flats, *joined, transfer.under_dithered);  // as in the fit
  const calib::TransferLine line = calib::fit_line(curve->linear, joined->scatter);
  const std::string id = darks.front().setting.iso ? fmt::format("iso{:.0f}", *darks.front().setting.iso) : "gain";
  section.plots = {plot_of_curve(*curve, line, id), plot_of_residuals(*curve, line, id)};
  found.report.sections.push_back(std::move(section));
}

namespace {

using Figures = std::vector<std::pair<const char*, std::string>>;

std::string black_text(const BlackPoint& black) {
  const auto& p = black.pedestal_dn;
  return fmt::format("{:.2f} {:.2f} {:.2f} {:.2f} DN{}", p[0], p[1], p[2], p[3],
                     black.holds == BlackPoint::Holds::pedestal_and_dark ? ", dark charge included" : "");
}

std::string agreement_text(const calib::NoiseAgreement& a) {
  return fmt::format("gain {:.4g} DN/e-, offset {:.4g} DN^2: the measured values are {:.3g} and {:.3g} times these, {}",
                     a.gain_dn_per_e, a.offset_dn2, a.gain_ratio, a.offset_ratio,
                     a.agrees ? "they agree" : "they disagree");
}

Figures figures_of(const calib::PictureNoise& n, const RawFrame& frame, const BlackPoint& black) {
  const double read_dn = std::sqrt(std::max(0.0, n.offset_dn2.value));
  Figures out{
      {"black", black_text(black)},
      {"system gain", text_of(n.gain_dn_per_e) + " DN/e-"},
      {"offset", fmt::format("{} DN^2: {:.3g} e- of noise without light", text_of(n.offset_dn2),
                             read_dn / n.gain_dn_per_e.value)},
      {"contrast",
       fmt::format("{:.2g} % of the signal: PRNU, grain and fine texture", 100 * std::sqrt(n.contrast_squared))},
      {"fit",
       fmt::format("reduced chi square {:.3g}, {} degrees of freedom, {:.3g} % of the image is flat, {:.4g} to "
                   "{:.4g} DN above black",
                   n.reduced_chi_square, n.degrees_of_freedom, 100 * n.flat_fraction, n.darkest_dn, n.brightest_dn)},
      {"codes",
       fmt::format("steps of {} DN, noise of {:.2g} steps in the dark", n.traces.code_step_dn, n.darkest_noise_steps)},
  };
  if (!frame.noise) {
    out.emplace_back("file's profile", "none");
    return out;
  }
  static constexpr const char* labels[] = {"file, red", "file, green", "file, blue"};
  const auto agreement = calib::compare_with(*frame.noise, n, isp::mean_range_dn(frame.raw, black));
  for (std::size_t k = 0; k < 3; ++k) out.emplace_back(labels[k], agreement_text(agreement[k]));
  return out;
}

}  // namespace

void show_picture_noise(const calib::PictureNoise& noise, const RawFrame& frame, const BlackPoint& black,
                        Calibration& found) {
  Lines out;
  const std::string name = name_of_gain(*calib::setting_of(frame.raw));
  isp::ReportSection section{name, "", {{"figure", "value"}, {}}, {}};
  for (const auto& [label, value] : figures_of(noise, frame, black)) {
    out.add(label, value);
    section.table.rows.push_back({label, value});
  }
  for (const std::string& reason : noise.reasons) section.text += reason + ". ";
  found.text += name + "\n" + out.text();
  found.report.sections.push_back(std::move(section));
}

}  // namespace lowlux::cli
