#include "isp/cli/calibrate/sheet_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calib/sheet/pattern_plots.h"
#include "isp/base/json_text.h"
#include "isp/cli/calibrate/noise_report.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr int histogram_bins = 128;
constexpr const char* method = "EMVA 1288 release 4.0 linear";

/// A figure of the sheet. Texts and JSON have the same ones.
struct Figure {
  std::string name;
  std::string key;  // JSON key, with its unit
  std::optional<Estimate> value;
  std::string unit;
  double shown = 1;  // factor from `value` to the unit of the text: 100 for percent
};

std::optional<Estimate> of_parts(const std::optional<calib::Nonuniformity>& parts,
                                 Estimate calib::Nonuniformity::*member) {
  if (!parts) return std::nullopt;
  return (*parts).*member;
}

void add_nonuniformity(const char* name, const std::string& key, const std::string& unit, double shown,
                       const std::optional<calib::Nonuniformity>& parts, std::vector<Figure>& out) {
  using Parts = calib::Nonuniformity;
  const std::string suffix = unit == "e-" ? "_e" : "";
  out.push_back({fmt::format("{}1288", name), key + suffix, of_parts(parts, &Parts::total), unit, shown});
  out.push_back(
      {fmt::format("{}1288 of rows", name), key + "_row" + suffix, of_parts(parts, &Parts::row), unit, shown});
  out.push_back(
      {fmt::format("{}1288 of columns", name), key + "_column" + suffix, of_parts(parts, &Parts::column), unit, shown});
  out.push_back(
      {fmt::format("{}1288 of pixels", name), key + "_pixel" + suffix, of_parts(parts, &Parts::pixel), unit, shown});
}

std::optional<Estimate> decibels(const std::optional<Estimate>& ratio) {
  if (!ratio) return std::nullopt;
  return Estimate{20 * std::log10(ratio->value), 20 / std::log(10.0) * ratio->standard_error / ratio->value};
}

void add_dark_rates(const calib::DataSheet& sheet, std::vector<Figure>& out) {
  if (!sheet.dark_rates) {
    out.push_back({"dark current", "dark_current_by_mean_e_per_s", {}, "e-/s"});
    return;
  }
  for (const calib::DarkRate& rate : sheet.dark_rates->rates) {
    const std::string at = rate.temperature_c ? fmt::format(" at {:g} C", *rate.temperature_c) : "";
    const std::string key = rate.temperature_c ? fmt::format("_at_{:g}_c", *rate.temperature_c) : "";
    out.push_back(
        {"dark current by the mean" + at, "dark_current_by_mean_e_per_s" + key, rate.by_mean_e_per_s, "e-/s"});
    out.push_back({"dark current by the variance" + at, "dark_current_by_variance_e_per_s" + key,
                   rate.by_variance_e_per_s, "e-/s"});
  }
  out.push_back({"doubling of dark current", "dark_current_doubling_c", sheet.dark_rates->doubling_c, "C"});
  const std::optional<calib::DarkLaw>& law = sheet.dark_rates->law;
  out.push_back({"activation energy of dark current", "dark_current_activation_ev",
                 law ? std::optional(law->activation_ev) : std::nullopt, "eV"});
  out.push_back({"floor of dark current", "dark_current_floor_e_per_s",
                 law ? std::optional(law->floor_e_per_s) : std::nullopt, "e-/s"});
}

void add_efficiencies(const calib::DataSheet& sheet, std::vector<Figure>& out) {
  for (std::size_t c = 0; c < 3; ++c) {
    constexpr std::array names{"R", "G", "B"};
    const auto& all = sheet.quantum_efficiency;
    out.push_back({fmt::format("quantum efficiency of {}", names[c]), fmt::format("quantum_efficiency_{}", "rgb"[c]),
                   all ? std::optional((*all)[c]) : std::nullopt, "%", 100});
  }
}

std::vector<Figure> figures_of(const calib::DataSheet& sheet) {
  const calib::PhotonTransfer& transfer = sheet.transfer;
  std::vector<Figure> out{
      {"system gain K", "system_gain_dn_per_e", transfer.system_gain_dn_per_e, "DN/e-"},
      {"temporal dark noise", "temporal_dark_noise_e", transfer.read_noise_e, "e-"},
      {"saturation capacity", "saturation_capacity_e", sheet.saturation_e, "e-"},
      {"maximum SNR", "snr_max", sheet.snr_max, ""},
      {"maximum SNR", "snr_max_db", decibels(sheet.snr_max), "dB"},
      {"absolute sensitivity threshold", "sensitivity_threshold_e", sheet.threshold_e, "e-"},
      {"dynamic range", "dynamic_range", sheet.dynamic_range, ""},
      {"dynamic range", "dynamic_range_db", decibels(sheet.dynamic_range), "dB"},
  };
  add_nonuniformity("DSNU", "dsnu", "e-", 1, sheet.dsnu_e, out);
  add_nonuniformity("PRNU", "prnu", "%", 100, sheet.prnu, out);
  std::optional<Estimate> linearity;
  if (transfer.linearity_error) linearity = Estimate{*transfer.linearity_error, 0};
  out.push_back({"linearity error", "linearity_error", linearity, "%", 100});
  add_dark_rates(sheet, out);
  add_efficiencies(sheet, out);
  return out;
}

std::string figure_text(const Figure& figure) {
  if (!figure.value) return "not determined by these frames";
  const Estimate shown{figure.shown * figure.value->value, figure.shown * figure.value->standard_error};
  const std::string number = shown.standard_error > 0 ? text_of(shown) : fmt::format("{:.3g}", shown.value);
  return figure.unit.empty() ? number : number + " " + figure.unit;
}

isp::Series series_of(const char* name, const calib::DarkGroup& group, double gain, calib::Direction direction) {
  isp::Series out{.name = name};
  const auto spectrum = calib::spectrogram(calib::deviations_of(group), direction);
  for (std::size_t k = 1; k < spectrum.size(); ++k) {
    out.x.push_back(0.5 * static_cast<double>(k) / static_cast<double>(spectrum.size() - 1));
    out.y.push_back(spectrum[k] / gain);
  }
  return out;
}

isp::Plot spectrogram_plot(const calib::SheetFrames& frames, double gain, calib::Direction direction) {
  const bool rows = direction == calib::Direction::along_rows;
  isp::Plot plot{.id = rows ? "spectrogram-rows" : "spectrogram-columns",
                 .title = rows ? "Spectrogram along rows" : "Spectrogram along columns",
                 .x_label = "frequency [cycles per pixel]",
                 .y_label = "deviation [e-]",
                 .y_scale = isp::AxisScale::logarithmic};
  plot.series.push_back(series_of("darks (DSNU)", frames.darks.front(), gain, direction));
  if (frames.bright) plot.series.push_back(series_of("half of saturation (PRNU)", *frames.bright, gain, direction));
  return plot;
}

isp::Plot histogram_plot(const char* id, const char* title, const calib::DarkGroup& group, double gain) {
  isp::Plot plot{.id = id,
                 .title = title,
                 .x_label = "deviation from the site's mean [e-]",
                 .y_label = "pixels",
                 .y_scale = isp::AxisScale::logarithmic};
  const calib::Histogram histogram = calib::histogram_of(calib::deviations_of(group), histogram_bins);
  isp::Series series{.name = "pixels", .mark = isp::Mark::points};
  for (std::size_t i = 0; i < histogram.count.size(); ++i) {
    series.x.push_back(histogram.centre[i] / gain);
    series.y.push_back(histogram.count[i] > 0 ? histogram.count[i] : std::numeric_limits<double>::quiet_NaN());
  }
  plot.series.push_back(std::move(series));
  return plot;
}

isp::ReportSection sheet_section(const calib::DataSheet& sheet) {
  isp::ReportSection out{
      .title = "Data sheet",
      .text = fmt::format("By {}. Values are followed by their standard errors. PRNU and quantum efficiency are "
                          "computed from flats minus the darks of their exposure time.",
                          method),
      .table = {{"figure", "value"}, {}}};
  for (const Figure& figure : figures_of(sheet)) out.table.rows.push_back({figure.name, figure_text(figure)});
  return out;
}

isp::ReportSection pattern_section(const calib::SheetFrames& frames, double gain) {
  isp::ReportSection out{
      .title = "Patterns",
      .text = fmt::format("Averages of {} darks{}. White noise has a flat spectrogram. The light must be even, because "
                          "neither a correction nor a high-pass filter is applied.",
                          frames.darks.front().frames,
                          frames.bright ? fmt::format(" and of {} flats", frames.bright->frames) : "")};
  out.plots = {spectrogram_plot(frames, gain, calib::Direction::along_rows),
               spectrogram_plot(frames, gain, calib::Direction::along_columns),
               histogram_plot("histogram-dark", "Histogram of the darks", frames.darks.front(), gain)};
  if (frames.bright) {
    out.plots.push_back(histogram_plot("histogram-bright", "Histogram at half of saturation", *frames.bright, gain));
  }
  return out;
}

Json json_of(const std::optional<Estimate>& estimate) {
  if (!estimate) return nullptr;
  Json out{{"value", estimate->value}};
  if (estimate->standard_error > 0) out["standard_error"] = estimate->standard_error;
  return out;
}

}  // namespace

void show_data_sheet(const calib::DataSheet& sheet, const calib::SheetFrames& frames, Calibration& found) {
  found.warnings.insert(found.warnings.end(), sheet.warnings.begin(), sheet.warnings.end());
  found.report.sections.push_back(sheet_section(sheet));
  show_photon_transfer(sheet.transfer, frames.dark_pairs, frames.flat_pairs, found);
  found.report.sections.push_back(pattern_section(frames, sheet.transfer.system_gain_dn_per_e.value));
  found.report.sections.push_back({"Frames", "", found.frames, {}});
  const std::vector<std::vector<std::string>>& rows = found.report.sections.front().table.rows;
  std::size_t width = 0;
  for (const auto& row : rows) width = std::max(width, row[0].size());
  found.text.clear();
  for (const auto& row : rows) found.text += fmt::format("  {:<{}}  {}\n", row[0], width, row[1]);
}

std::string sheet_json(const calib::DataSheet& sheet, const calib::SheetFrames& frames, const Calibration& found) {
  Json out{{"method", method},
           {"lowlux", version_number()},
           {"make", found.profile.make},
           {"model", found.profile.model},
           {"iso", frames.darks.front().setting.iso ? Json(*frames.darks.front().setting.iso) : Json(nullptr)}};
  for (const Figure& figure : figures_of(sheet)) out["figures"][figure.key] = json_of(figure.value);
  const double gain = sheet.transfer.system_gain_dn_per_e.value;
  for (const auto direction : {calib::Direction::along_rows, calib::Direction::along_columns}) {
    const isp::Plot plot = spectrogram_plot(frames, gain, direction);
    for (const isp::Series& series : plot.series) out["spectrograms_e"][plot.id][series.name] = series.y;
  }
  out["warnings"] = found.warnings;
  return json_text(out, 2) + "\n";
}

}  // namespace lowlux::cli
