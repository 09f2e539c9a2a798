#include "isp/cli/calibrate/black_report.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "isp/cli/shared/lines.h"

namespace lowlux::cli {
namespace {

constexpr const char* channels[] = {"red", "green", "blue"};

template <class Values, class Text>
std::string cells(const Values& values, const Text& text) {
  std::string out;
  for (const auto& v : values) out += fmt::format("{:>22}", text(v));
  return out;
}

void add_pedestal(const PerSite<Estimate>& level, Lines& out) {
  out.add("", cells(site_names, [](const char* name) { return std::string(name); }));
  out.add("black [DN]", cells(level, text_of));
}

isp::Table table_of(const GainProfile& gain) {
  isp::Table table{{"figure", "value", "standard error", "unit"}, {}};
  const auto add = [&table](std::string name, const Estimate& estimate, const char* unit) {
    EstimateCells cells = cells_of(estimate);
    table.rows.push_back({std::move(name), std::move(cells.value), std::move(cells.standard_error), unit});
  };
  for (int site = 0; gain.pedestal_dn && site < 4; ++site) {
    add(fmt::format("black level, {}", site_names[site]), (*gain.pedestal_dn)[site], "DN");
  }
  const SensorModel& s = *gain.sensor;
  add("system gain", {s.system_gain_dn_per_e, gain.errors.system_gain_dn_per_e}, "DN/e-");
  add("read noise", {s.read_noise_e, gain.errors.read_noise_e}, "e-");
  for (int k = 0; k < 3; ++k) {
    add(fmt::format("dark current at {:g} C, {}", s.dark_temperature_c, channels[k]),
        {s.dark_current_e_per_s[k], gain.errors.dark_current_e_per_s[k]}, "e-/s");
  }
  for (int k = 0; gain.dark_chromaticity && k < 3; ++k) {
    add(fmt::format("dark colour, {}", channels[k]), (*gain.dark_chromaticity)[k], "fraction of the dark current");
  }
  if (gain.errors.dark_doubling_c > 0) add("doubling", {s.dark_doubling_c, gain.errors.dark_doubling_c}, "C");
  add("DSNU", {s.dsnu, gain.errors.dsnu}, "fraction of the dark current");
  table.rows.push_back({"row noise", fmt::format("{:.3g}", s.row_noise_e), "", "e-"});
  table.rows.push_back({"column noise", fmt::format("{:.3g}", s.column_noise_e), "", "e-"});
  table.rows.push_back({"hot pixels", std::to_string(gain.hot_pixels.size()), "", ""});
  return table;
}

std::string celsius_of(const calib::DarkGroup& group) {
  return group.setting.temperature_c ? fmt::format("{:g} C, ", *group.setting.temperature_c) : "";
}

/// Returns series by temperature and site of the quantity that `value` returns for a point.
template <class Value>
std::vector<isp::Series> by_site(const calib::DarkSeries& series, std::span<const calib::DarkGroup> groups,
                                 isp::Mark mark, const Value& value) {
  std::vector<isp::Series> out;
  for (const calib::DarkPoint& p : series.points) {
    const calib::DarkGroup& group = groups[static_cast<std::size_t>(p.group)];
    const std::string name = celsius_of(group) + site_names[p.site];
    auto own = std::find_if(out.begin(), out.end(), [&](const isp::Series& s) { return s.name == name; });
    if (own == out.end()) own = out.insert(out.end(), isp::Series{.name = name, .mark = mark});
    own->x.push_back(*group.setting.exposure_s);
    own->y.push_back(value(p));
  }
  return out;
}

isp::Plot plot_of_charge(const calib::DarkSeries& series, std::span<const calib::DarkGroup> groups,
                         const std::string& id) {
  isp::Plot plot{.id = id + "-dark-charge",
                 .title = "Dark charge against time",
                 .x_label = "exposure time [s]",
                 .y_label = "mean above the pedestal [DN]"};
  const auto above = [&](const calib::DarkPoint& p) { return p.mean_dn - series.pedestal_dn[p.site].value; };
  plot.series = by_site(series, groups, isp::Mark::points, above);
  std::vector<isp::Series> fit = by_site(series, groups, isp::Mark::line,
                                         [&](const calib::DarkPoint& p) { return above(p) - p.residual_dn.value; });
  for (isp::Series& s : fit) {
    s.name += ", fit";
    plot.series.push_back(std::move(s));
  }
  return plot;
}

isp::Plot plot_of_residuals(const calib::DarkSeries& series, std::span<const calib::DarkGroup> groups,
                            const std::string& id) {
  return {.id = id + "-dark-residuals",
          .title = "Residuals",
          .x_label = "exposure time [s]",
          .y_label = "residual / standard error",
          .series = by_site(series, groups, isp::Mark::points,
                            [](const calib::DarkPoint& p) {
                              const Estimate& off = p.residual_dn;
                              return off.standard_error > 0 ? off.value / off.standard_error : 0;
                            }),
          .caption = fmt::format("Mean square {:.3g}, {} degrees of freedom.", series.reduced_chi_square,
                                 series.degrees_of_freedom)};
}

isp::Plot plot_of_temperature(const calib::DarkSeries& series, const std::string& id) {
  isp::Plot plot{.id = id + "-dark-temperature",
                 .title = "Dark current against temperature",
                 .x_label = "temperature [C]",
                 .y_label = "dark current [e-/s]",
                 .y_scale = isp::AxisScale::logarithmic};
  for (int k = 0; k < 3; ++k) {
    isp::Series points{.name = channels[k], .mark = isp::Mark::points};
    isp::Series fit{.name = std::string(channels[k]) + ", fit"};
    for (const calib::DarkCurrent& c : series.currents) {
      if (!c.temperature_c) continue;
      points.x.push_back(*c.temperature_c);
      points.y.push_back(c.current_e_per_s[k].value);
      if (!series.law) continue;
      fit.x.push_back(*c.temperature_c);
      fit.y.push_back(series.law->current_e_per_s[k].value *
                      std::exp2((*c.temperature_c - series.law->temperature_c) / series.law->doubling_c.value));
    }
    plot.series.push_back(std::move(points));
    if (!fit.x.empty()) plot.series.push_back(std::move(fit));
  }
  return plot;
}

std::string fit_text(const calib::DarkSeries& series) {
  if (series.degrees_of_freedom == 0)
    return "exact, because the number of parameters equals the number of settings: add a third exposure time";
  return fmt::format("mean square of residual / error {:.3g}, {} degrees of freedom", series.reduced_chi_square,
                     series.degrees_of_freedom);
}

/// Plots R and G fractions of the dark current, with standard errors as a cross; light of equal charge is at 1/3, 1/3.
isp::Plot plot_of_black_point(const std::array<Estimate, 3>& share, const std::string& id) {
  const auto& [r, g, b] = share;
  isp::Series cross{
      .name = "dark current +- 1 standard error",
      .x = {r.value - r.standard_error, r.value, r.value + r.standard_error, NAN, r.value, r.value, r.value},
      .y = {g.value, g.value, g.value, NAN, g.value - g.standard_error, g.value, g.value + g.standard_error}};
  return {.id = id + "-black-point",
          .title = "Colour of the dark current",
          .x_label = "R / (R + G + B)",
          .y_label = "G / (R + G + B)",
          .equal_scales = true,
          .series = {{.name = "equal charge", .x = {1.0 / 3}, .y = {1.0 / 3}, .mark = isp::Mark::points}, cross},
          .caption = "Camera RGB. Shadows move towards this colour where the dark current is not subtracted."};
}

std::string id_of(const calib::FrameSetting& setting) {
  return setting.iso ? fmt::format("iso{:.0f}", *setting.iso) : "gain";
}

}  // namespace

std::string name_of_gain(const calib::FrameSetting& setting) {
  return setting.iso ? fmt::format("ISO {:g}", *setting.iso) : "gain not stated";
}

void show_black(const calib::BlackFigures& black, const calib::FrameSetting& setting, Calibration& found) {
  Lines out;
  add_pedestal(black.level_dn, out);
  out.add("deviation [DN]", cells(black.deviation_dn, [](double v) { return fmt::format("{:.4g}", v); }));
  const auto scatter = [](const calib::LineScatter& s) {
    return fmt::format("{:.3g} ({:.3g})", s.found_dn, s.white_dn);
  };
  out.add("row means", cells(black.rows, scatter));
  out.add("column means", cells(black.columns, scatter));
  out.add("", fmt::format("standard deviation in DN{}; in brackets the value for white noise",
                          black.frames == 1 ? "" : " of the mean of the frames"));
  out.add("row noise", fmt::format("{:.3g} DN, column noise {:.3g} DN beyond white noise", black.row_noise_dn,
                                   black.column_noise_dn));
  out.add("pixels", fmt::format("{} in {} frame{}, {:.3g} % of the pixels not used", black.pixels, black.frames,
                                black.frames == 1 ? "" : "s", 100 * black.excluded_fraction));
  out.add("holds", fmt::format("pedestal including dark charge{}: they can be separated with a second exposure time",
                               setting.exposure_s ? fmt::format(", at {:g} s", *setting.exposure_s) : ""));
  found.text += name_of_gain(setting) + "\n" + out.text();

  isp::Table table{{"site", "black [DN]", "standard error [DN]", "deviation [DN]"}, {}};
  for (int site = 0; site < 4; ++site) {
    EstimateCells level = cells_of(black.level_dn[site]);
    table.rows.push_back({site_names[site], std::move(level.value), std::move(level.standard_error),
                          fmt::format("{:.4g}", black.deviation_dn[site])});
  }
  found.report.sections.push_back(
      {name_of_gain(setting),
       fmt::format("Row noise {:.3g} DN, column noise {:.3g} DN.", black.row_noise_dn, black.column_noise_dn),
       table,
       {}});
}

void show_dark_series(const calib::DarkSeries& series, std::span<const calib::DarkGroup> groups,
                      const GainProfile& gain, const std::string& gain_source, Calibration& found) {
  const calib::FrameSetting& setting = groups.front().setting;
  Lines out;
  int frames = 0;
  for (const calib::DarkGroup& g : groups) frames += g.frames;
  out.add("darks", fmt::format("{} frames of {} settings, {:.3g} % of the pixels left out", frames, groups.size(),
                               100 * series.excluded_fraction));
  out.add(
      "system gain",
      fmt::format("{} DN/e-, {}",
                  text_of(Estimate{gain.sensor->system_gain_dn_per_e, gain.errors.system_gain_dn_per_e}), gain_source));
  add_pedestal(series.pedestal_dn, out);
  out.add("", cells(channels, [](const char* name) { return std::string(name); }));
  for (const calib::DarkCurrent& c : series.currents) {
    out.add("dark [e-/s]", fmt::format("{}{}", cells(c.current_e_per_s, text_of),
                                       c.temperature_c ? fmt::format("  at {:g} C", *c.temperature_c) : std::string()));
  }
  if (series.chromaticity) {
    out.add("dark colour", fmt::format("{}  of the dark current", cells(*series.chromaticity, text_of)));
  } else {
    out.add("dark colour", "not measurable: the dark current is too small");
  }
  if (series.law) out.add("doubling", fmt::format("every {} C", text_of(series.law->doubling_c)));
  out.add("read noise", series.read_noise_e
                            ? text_of(*series.read_noise_e) + " e-"
                            : std::string("not measurable: smaller than quantisation noise and dark charge"));
  out.add("patterns", fmt::format("DSNU {:.3g} of the dark current, row noise {:.3g} e-, column noise {:.3g} e-",
                                  series.dsnu.value, series.row_noise_e, series.column_noise_e));
  out.add("hot pixels", std::to_string(series.hot.size()));
  out.add("fit", fit_text(series));
  found.text += name_of_gain(setting) + "\n" + out.text();

  const std::string id = id_of(setting);
  isp::ReportSection section{name_of_gain(setting),
                             fmt::format("System gain: {}.\nFit: {}.", gain_source, fit_text(series)),
                             table_of(gain),
                             {plot_of_charge(series, groups, id)}};
  if (series.degrees_of_freedom > 0) section.plots.push_back(plot_of_residuals(series, groups, id));
  if (series.currents.size() > 1) section.plots.push_back(plot_of_temperature(series, id));
  if (series.chromaticity) section.plots.push_back(plot_of_black_point(*series.chromaticity, id));
  found.report.sections.push_back(std::move(section));
}

}  // namespace lowlux::cli
