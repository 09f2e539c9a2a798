#include "isp/cli/calibrate/calibrate_colour_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/cli/calibrate/calibration.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/report.h"
#include "isp/model/spectrum/spectral_data.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> patch_names() {
  std::vector<std::string> out;
  out.reserve(24);
  for (const isp::NamedSpectrum& patch : isp::spectra_of(isp::SpectrumSet::colorchecker)) out.emplace_back(patch.name);
  return out;
}

std::string cell(const std::optional<PatchError>& error) {
  return error ? fmt::format("{:.2f}", error->ciede2000) : std::string("-");
}

/// Returns CIEDE2000 of each patch, a column for each matrix; for charts also the camera's values.
isp::Table patch_table(const ColourOutcome& outcome) {
  isp::Table out{{"patch"}, {}};
  if (outcome.chart) out.columns.insert(out.columns.end(), {"R", "G", "B", "error %"});
  for (const MatrixErrors& errors : outcome.matrices) out.columns.push_back(errors.name);
  const auto names = patch_names();
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::vector<std::string> row{names[i]};
    if (outcome.chart) {
      const calib::ChartPatch& patch = outcome.chart->found.patches[i];
      for (const double value : patch.camera_rgb) row.push_back(fmt::format("{:.4f}", value));
      double error = 0;
      for (std::size_t c = 0; c < 3; ++c) error = std::max(error, patch.standard_error[c] / patch.camera_rgb[c]);
      row.push_back(fmt::format("{:.2f}", 100 * error));
    }
    for (const MatrixErrors& errors : outcome.matrices) row.push_back(cell(errors.patches[i]));
    out.rows.push_back(std::move(row));
  }
  return out;
}

isp::Table summary_table(const ColourOutcome& outcome) {
  isp::Table out{{"CIEDE2000", "mean", "median", "largest", "of"}, {}};
  for (const MatrixErrors& errors : outcome.matrices) {
    const calib::ErrorSummary summary = summary_of(errors);
    out.rows.push_back({errors.name, fmt::format("{:.2f}", summary.mean), fmt::format("{:.2f}", summary.median),
                        fmt::format("{:.2f}", summary.largest), errors.what});
  }
  return out;
}

/// Returns the chart's corners in pixels of the active area: a half-size pixel's centre lies between two.
std::array<calib::PicturePoint, 4> corners_px(const calib::ChartGrid& grid) {
  std::array<calib::PicturePoint, 4> out{grid.at(0, 0), grid.at(6, 0), grid.at(6, 4), grid.at(0, 4)};
  for (calib::PicturePoint& p : out) p = {2 * p.x + 0.5, 2 * p.y + 0.5};
  return out;
}

std::string facts(const ColourOutcome& o) {
  std::string text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "  illuminant      {}, {:.0f} K ({})\n", o.colour.illuminant, o.colour.calibration.cct_k,
                 o.illuminant_reason);
  if (o.chart) {
    const auto corner = corners_px(o.chart->found.grid);
    fmt::format_to(
        out, "  chart           corners ({:.0f}, {:.0f}) ({:.0f}, {:.0f}) ({:.0f}, {:.0f}) ({:.0f}, {:.0f})\n",
        corner[0].x, corner[0].y, corner[1].x, corner[1].y, corner[2].x, corner[2].y, corner[3].x, corner[3].y);
    fmt::format_to(out, "  light gradient  {:+.1f} % from the centre to the right edge, {:+.1f} % to the lower edge\n",
                   100 * o.chart->light.per_x, 100 * o.chart->light.per_y);
    fmt::format_to(out, "  neutral         {:.4f} {:.4f} {:.4f}\n", o.chart->neutral[0], o.chart->neutral[1],
                   o.chart->neutral[2]);
  }
  fmt::format_to(out, "  condition       {:.1f}\n", o.colour.condition_number.value_or(0));
  return text;
}

Json matrix_json(const Matrix3& m) {
  Json json = m;
  return json;
}

Json errors_json(const MatrixErrors& errors) {
  const calib::ErrorSummary summary = summary_of(errors);
  Json patches = Json::array();
  for (const auto& patch : errors.patches) patches.push_back(patch ? Json(patch->ciede2000) : Json(nullptr));
  return {{"matrix", errors.name},
          {"what", errors.what},
          {"mean_ciede2000", summary.mean},
          {"median_ciede2000", summary.median},
          {"largest_ciede2000", summary.largest},
          {"patches_ciede2000", patches}};
}

Json chart_json(const MeasuredChart& chart) {
  Json corners = Json::array(), patches = Json::array();
  for (const calib::PicturePoint& p : corners_px(chart.found.grid)) corners.push_back({p.x, p.y});
  for (const calib::ChartPatch& patch : chart.found.patches) {
    patches.push_back({{"camera_rgb", patch.camera_rgb},
                       {"standard_error", patch.standard_error},
                       {"clipped_fraction", patch.clipped_fraction},
                       {"outlying_fraction", patch.outlying_fraction},
                       {"pixels", patch.pixels},
                       {"used", calib::usable(patch)}});
  }
  Json out{{"corners_px", corners},
           {"light_per_x", chart.light.per_x},
           {"light_per_y", chart.light.per_y},
           {"neutral", chart.neutral}};
  out["neutral_cct_k"] = chart.neutral_cct_k ? Json(*chart.neutral_cct_k) : Json(nullptr);
  out["patches"] = patches;
  return out;
}

isp::Plot error_plot(const ColourOutcome& outcome) {
  isp::Plot plot{.id = "patches",
                 .title = "CIEDE2000 of each patch",
                 .x_label = "patch",
                 .y_label = "CIEDE2000",
                 .caption = "Patches in the chart's order, row by row; the last six are grey."};
  for (const MatrixErrors& errors : outcome.matrices) {
    isp::Series series{.name = errors.name, .mark = isp::Mark::points};
    for (std::size_t i = 0; i < errors.patches.size(); ++i) {
      if (!errors.patches[i]) continue;
      series.x.push_back(static_cast<double>(i + 1));
      series.y.push_back(errors.patches[i]->ciede2000);
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

isp::Plot ab_plot(const ColourOutcome& outcome) {
  isp::Plot plot{.id = "ab",
                 .title = "Patches in CIELAB",
                 .x_label = "a*",
                 .y_label = "b*",
                 .equal_scales = true,
                 .caption = "Relative to the illuminant's white."};
  isp::Series reference{.name = "reference", .mark = isp::Mark::points};
  for (const isp::Lab& lab : outcome.reference) {
    reference.x.push_back(lab.a);
    reference.y.push_back(lab.b);
  }
  plot.series.push_back(std::move(reference));
  for (const MatrixErrors& errors : outcome.matrices) {
    isp::Series series{.name = errors.name, .mark = isp::Mark::points};
    for (const auto& patch : errors.patches) {
      if (!patch || !patch->lab) continue;
      series.x.push_back(patch->lab->a);
      series.y.push_back(patch->lab->b);
    }
    if (!series.x.empty()) plot.series.push_back(std::move(series));
  }
  return plot;
}

}  // namespace

std::string colour_text(const ColourOutcome& outcome) {
  const isp::Table patches = patch_table(outcome), summary = summary_table(outcome);
  return fmt::format("{}\n{}\n{}\n{}", one_line(outcome.input), facts(outcome),
                     aligned_text(patches, patches.columns.size()), aligned_text(summary, summary.columns.size() - 1));
}

std::string colour_json(const ColourOutcome& outcome, const std::string& profile) {
  Json matrices = Json::array();
  for (const MatrixErrors& errors : outcome.matrices) matrices.push_back(errors_json(errors));
  const ColourCalibration& calibration = outcome.colour.calibration;
  Json out{{"input", outcome.input},
           {"profile", profile},
           {"illuminant", outcome.colour.illuminant},
           {"illuminant_reason", outcome.illuminant_reason},
           {"cct_k", calibration.cct_k},
           {"condition_number", outcome.colour.condition_number.value_or(0)},
           {"xyz_to_camera", matrix_json(calibration.xyz_to_camera)}};
  if (calibration.forward) out["forward"] = matrix_json(*calibration.forward);
  out["matrices"] = matrices;
  if (outcome.chart) out["chart"] = chart_json(*outcome.chart);
  out["warnings"] = outcome.warnings;
  return json_text(out);
}

isp::Report colour_report(const ColourOutcome& outcome, const std::string& profile) {
  isp::ReportSection summary{"Matrices", facts(outcome), summary_table(outcome), {}};
  isp::ReportSection patches{"Patches", {}, patch_table(outcome), {error_plot(outcome), ab_plot(outcome)}};
  return {
      fmt::format("Colour calibration: {}", outcome.input),
      "CIEDE2000 between the patches of the camera, converted by a matrix, and a ColorChecker under the illuminant.\n" +
          measurement_text(profile),
      {std::move(summary), std::move(patches)}};
}

namespace {

using Colour = std::array<std::uint8_t, 3>;

void draw(Encoded8& picture, const calib::PicturePoint& from, const calib::PicturePoint& to, const Colour& colour) {
  const int steps = static_cast<int>(std::ceil(std::max(std::fabs(to.x - from.x), std::fabs(to.y - from.y)))) + 1;
  for (int i = 0; i <= steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    const auto x = std::lround(from.x + t * (to.x - from.x)), y = std::lround(from.y + t * (to.y - from.y));
    if (x < 0 || y < 0 || x >= picture.width() || y >= picture.height()) continue;
    std::copy(colour.begin(), colour.end(), picture.codes.row(static_cast<int>(y)) + 3 * x);
  }
}

/// Returns the brightest channel of the chart's brightest patch, white balanced; it becomes nearly white in the image.
double white_of(const MeasuredChart& chart) {
  double brightest = 0;
  for (const calib::ChartPatch& patch : chart.found.patches) {
    for (std::size_t c = 0; c < 3; ++c) brightest = std::max(brightest, patch.camera_rgb[c] / chart.neutral[c]);
  }
  return brightest > 0 ? brightest / 0.9 : 1;
}

}  // namespace

Encoded8 colour_overlay(const MeasuredChart& chart) {
  constexpr Colour outline{255, 255, 0}, first{255, 0, 0};
  const CameraRgb& rgb = chart.picture.rgb;
  Encoded8 out{Plane<std::uint8_t>(3 * rgb.width(), rgb.height())};
  const double white = white_of(chart);
  for (int y = 0; y < rgb.height(); ++y) {
    for (int x = 0; x < rgb.width(); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = std::clamp(rgb.plane[c].at(x, y) / (chart.neutral[c] * white), 0.0, 1.0);
        out.codes.row(y)[3 * x + static_cast<int>(c)] =
            static_cast<std::uint8_t>(std::lround(255 * std::pow(value, 1 / 2.2)));
      }
    }
  }
  for (int i = 0; i < calib::chart_patch_count; ++i) {
    const auto corner = calib::measured_corners(chart.found.grid, i);
    for (std::size_t k = 0; k < 4; ++k) draw(out, corner[k], corner[(k + 1) % 4], i == 0 ? first : outline);
  }
  return out;
}

}  // namespace lowlux::cli
