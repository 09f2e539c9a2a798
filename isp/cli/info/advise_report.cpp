#include "isp/cli/info/advise_report.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/cli/shared/lines.h"
#include "isp/cli/shared/machine.h"
#include "isp/cli/shared/report.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double heavy_tails = 5;  // see isp::ChromaPrecision::weight_snr

const char* limit_name(isp::ExposureLimit limit) {
  static constexpr const char* names[] = {"longest exposure", "converter range", "full well"};
  return names[static_cast<int>(limit)];
}

const char* source_name(isp::NoiseSource source) {
  static constexpr const char* names[] = {"photons", "dark current", "read noise", "quantisation"};
  return names[static_cast<int>(source)];
}

std::string limit_of(const isp::AdvicePoint& point) { return point.exceeds ? limit_name(*point.exceeds) : ""; }

bool has_heavy_tails(const isp::AdvicePoint& p) { return p.midtone && p.midtone->weight_snr < heavy_tails; }

/// Returns the cells of a point: exposure, SNR, std of u'v', highlight relative to the well and to the range.
std::vector<std::string> cells_of_point(const isp::AdvicePoint& p) {
  std::vector<std::string> cells{fmt::format("{:.4g}", p.exposure_s)};
  if (p.midtone) {
    cells.push_back(fmt::format("{:.1f}", isp::decibel(p.midtone->snr)));
    cells.push_back(fmt::format("{:.3g}", p.midtone->snr));
    cells.push_back(fmt::format("{:.2g}{}", p.midtone->uv_std, has_heavy_tails(p) ? "*" : ""));
  } else {
    cells.insert(cells.end(), {"clips", "clips", "clips"});
  }
  cells.push_back(fmt::format("{:.3g}", 100 * p.highlight_charge_fraction));
  cells.push_back(fmt::format("{:.3g}", 100 * p.highlight_code_fraction));
  return cells;
}

const std::vector<std::string> columns{"gain",      "exposure [s]",          "SNR [dB]",     "SNR [power]",
                                       "u'v' std.", "highlight [% of well]", "[% of range]", "limit"};

isp::Table gains_table(const AdviceCase& asked, const isp::ExposureAdvice& advice) {
  isp::Table table{columns, {}};
  table.columns.emplace_back("largest noise");
  table.rows.reserve(advice.gains.size());
  for (const isp::GainAdvice& gain : advice.gains) {
    std::vector<std::string> row = cells_of_point(gain.at);
    row.insert(row.begin(), asked.request.gains[gain.at.gain].name);
    row.emplace_back(limit_name(gain.limit));
    row.push_back(fmt::format("{} {:.0f} %", source_name(gain.largest_noise), 100 * gain.largest_noise_fraction));
    table.rows.push_back(std::move(row));
  }
  return table;
}

isp::Table curve_table(const AdviceCase& asked, const isp::ExposureAdvice& advice) {
  isp::Table table{columns, {}};
  table.columns.back() = "exceeds";
  table.rows.reserve(advice.curve.size());
  for (const isp::AdvicePoint& point : advice.curve) {
    std::vector<std::string> row = cells_of_point(point);
    row.insert(row.begin(), asked.request.gains[point.gain].name);
    row.push_back(limit_of(point));
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string advised(const AdviceCase& asked, const isp::ExposureAdvice& advice) {
  const isp::AdvicePoint& p = advice.gains[advice.best].at;
  return fmt::format("{}, {}: SNR {:.1f} dB, u'v' standard deviation {:.2g}{}", asked.request.gains[p.gain].name,
                     exposure_text(p.exposure_s), isp::decibel(p.midtone->snr), p.midtone->uv_std,
                     has_heavy_tails(p) ? "*" : "");
}

std::string scene_of(const isp::AdviceRequest& r) {
  return fmt::format(
      "mid tone {:.4g} cd/m2, highlight {:.4g} cd/m2, at most {:.4g} s, {:g} C, {} frame{}, patch of {:g} "
      "red pixels",
      r.midtone_cd_m2, r.highlight_cd_m2, r.longest_exposure_s, r.temperature_c, r.frames, r.frames == 1 ? "" : "s",
      r.patch_pixels);
}

constexpr const char* heavy_note =
    "* only a lower bound: at this low signal the distribution of the chromaticity has heavy tails";

Json point_json(const isp::AdvicePoint& p) {
  Json json{{"exposure_s", p.exposure_s},
            {"snr", nullptr},
            {"snr_db", nullptr},
            {"uv_std", nullptr},
            {"weight_snr", nullptr},
            {"highlight_fraction_of_full_well", p.highlight_charge_fraction},
            {"highlight_fraction_of_range", p.highlight_code_fraction}};
  if (p.midtone) {
    json["snr"] = p.midtone->snr;
    json["snr_db"] = isp::decibel(p.midtone->snr);
    json["uv_std"] = p.midtone->uv_std;
    json["weight_snr"] = p.midtone->weight_snr;
  }
  return json;
}

isp::Plot plot_of(const AdviceCase& asked, const isp::ExposureAdvice& advice, bool chromaticity) {
  isp::Plot plot{chromaticity ? "chromaticity" : "snr",
                 chromaticity ? "Chromaticity of the patch" : "Signal-to-noise ratio of the mid tone",
                 "exposure [s]",
                 chromaticity ? "standard deviation of u'v'" : "SNR [dB]",
                 isp::AxisScale::logarithmic,
                 chromaticity ? isp::AxisScale::logarithmic : isp::AxisScale::linear};
  const auto value = [&](const isp::AdvicePoint& p) {
    if (!p.midtone) return nan;
    return chromaticity ? p.midtone->uv_std : isp::decibel(p.midtone->snr);
  };
  plot.series.reserve(2 * advice.gains.size() + 1);
  for (std::size_t gain = 0; gain < advice.gains.size(); ++gain) {
    isp::Series allowed{asked.request.gains[gain].name, {}, {}, isp::Mark::line};
    isp::Series beyond{asked.request.gains[gain].name + ", highlight clipped", {}, {}, isp::Mark::dashed};
    for (const isp::AdvicePoint& point : advice.curve) {
      if (point.gain != gain) continue;
      isp::Series& series = point.exceeds ? beyond : allowed;
      if (point.exceeds && beyond.x.empty()) {  // starting at the limit
        const isp::AdvicePoint& at = advice.gains[gain].at;
        for (isp::Series* s : {&allowed, &beyond}) s->x.push_back(at.exposure_s), s->y.push_back(value(at));
      }
      series.x.push_back(point.exposure_s);
      series.y.push_back(value(point));
    }
    plot.series.push_back(std::move(allowed));
    if (!beyond.x.empty()) plot.series.push_back(std::move(beyond));
  }
  const isp::AdvicePoint& best = advice.gains[advice.best].at;
  plot.series.push_back({"advised", {best.exposure_s}, {value(best)}, isp::Mark::points});
  plot.caption = chromaticity ? "Lower bound for unbiased estimators (Cramer-Rao)."
                              : "Signal-to-noise ratio of the channel with the largest signal.";
  return plot;
}

}  // namespace

std::string advice_text(const AdviceCase& asked, const isp::ExposureAdvice& advice) {
  std::string text;
  auto out = std::back_inserter(text);
  fmt::format_to(out, "advice            {}\n", advised(asked, advice));
  fmt::format_to(out, "  because         {}\n", advice.reason);
  fmt::format_to(out, "  sensor          {}\n", asked.camera);
  fmt::format_to(out, "  scene           {}\n", scene_of(asked.request));
  for (const std::string& note : asked.notes) fmt::format_to(out, "  note            {}\n", note);
  fmt::format_to(out, "the best exposure of each gain setting\n{}", aligned_text(gains_table(asked, advice), 7));
  if (std::ranges::any_of(advice.gains, has_heavy_tails, &isp::GainAdvice::at)) {
    fmt::format_to(out, "{}\n", heavy_note);
  }
  fmt::format_to(out, "--report and --json contain the curves over exposure time\n");
  return text;
}

std::string advice_json(const AdviceCase& asked, const isp::ExposureAdvice& advice) {
  const isp::AdviceRequest& r = asked.request;
  Json gains = Json::array(), curve = Json::array();
  for (const isp::GainAdvice& gain : advice.gains) {
    Json json{{"gain", r.gains[gain.at.gain].name}};
    json.update(point_json(gain.at));
    json["limit"] = limit_name(gain.limit);
    json["largest_noise"] = source_name(gain.largest_noise);
    json["max_noise_fraction"] = gain.largest_noise_fraction;
    gains.push_back(std::move(json));
  }
  for (const isp::AdvicePoint& point : advice.curve) {
    Json json{{"gain", r.gains[point.gain].name}};
    json.update(point_json(point));
    json["exceeds"] = point.exceeds ? Json(limit_name(*point.exceeds)) : Json(nullptr);
    curve.push_back(std::move(json));
  }
  const Json json{{"advice", gains[advice.best]},
                  {"reason", advice.reason},
                  {"sensor", asked.camera},
                  {"midtone_cd_m2", r.midtone_cd_m2},
                  {"highlight_cd_m2", r.highlight_cd_m2},
                  {"longest_exposure_s", r.longest_exposure_s},
                  {"clipped_fraction", r.clipped_fraction},
                  {"temperature_c", r.temperature_c},
                  {"patch_pixels", r.patch_pixels},
                  {"frames", r.frames},
                  {"notes", asked.notes},
                  {"gains", gains},
                  {"curve", curve}};
  return json_text(json, 2);
}

isp::Report advice_page(const AdviceCase& asked, const isp::ExposureAdvice& advice) {
  std::string notes;
  for (const std::string& note : asked.notes) notes += "Note: " + note + ".\n";
  isp::Report report{"Exposure and gain: " + advised(asked, advice),
                     fmt::format("Reason: {}.\nSensor: {}.\nScene: {}.\nPredicted by lowlux {}.", advice.reason,
                                 asked.camera, scene_of(asked.request), version_number()),
                     {}};
  const std::string tails = std::ranges::any_of(advice.curve, has_heavy_tails) ? heavy_note : "";
  report.sections.push_back({"The best exposure of each gain setting",
                             notes,
                             gains_table(asked, advice),
                             {plot_of(asked, advice, false), plot_of(asked, advice, true)}});
  report.sections.push_back({"Curve", tails, curve_table(asked, advice), {}});
  return report;
}

}  // namespace lowlux::cli
