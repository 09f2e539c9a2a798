#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "isp/bench/stages/denoise_bench.h"

namespace lowlux::isp {
namespace {

/// Finds rows by light and method.
class Rows {
 public:
  explicit Rows(std::span<const DenoiseRow> rows) : rows_(rows) {}

  const DenoiseRow* find(std::string_view light, std::string_view method) const {
    const auto at = std::find_if(rows_.begin(), rows_.end(), [&](const DenoiseRow& row) {
      return row.method == method && name_of(row.light) == light;
    });
    return at == rows_.end() ? nullptr : &*at;
  }
  template <class Predicate>
  std::vector<const DenoiseRow*> ours(const Predicate& predicate) const {
    std::vector<const DenoiseRow*> out;
    for (const DenoiseRow& row : rows_) {
      if (row.kind == MethodKind::ours && predicate(row)) out.push_back(&row);
    }
    return out;
  }

 private:
  std::span<const DenoiseRow> rows_;
};

Finding check(std::string id, std::string claim, std::string expected, std::string ours, bool holds, std::string note) {
  return {"denoise/" + std::move(id), std::move(claim), std::move(expected), std::move(ours), holds, std::move(note),
          Finding::Kind::check};
}

struct AgainstNlMeans {
  std::string_view light;
  double gain_db;
  double ciede_fraction;
};
constexpr std::array against_nl_means{AgainstNlMeans{"20/2", 1.0, 0.92}, AgainstNlMeans{"20/200", 1.5, 0.85},
                                      AgainstNlMeans{"4/2", 1.5, 0.85}, AgainstNlMeans{"4/200", 1.5, 0.85}};

void add_against_nl_means(const Rows& rows, std::vector<Finding>& out) {
  for (const AgainstNlMeans& gate : against_nl_means) {
    const DenoiseRow* const ours = rows.find(gate.light, "standard");
    const DenoiseRow* const theirs = rows.find(gate.light, name_of_nl_means);
    if (ours == nullptr || theirs == nullptr) continue;
    const double gain_db = ours->error.psnr_db - theirs->error.psnr_db;
    const double share = ours->error.ciede2000 / theirs->error.ciede2000;
    out.push_back(check(
        fmt::format("nlm-psnr-{}", gate.light), "the PSNR of standard is higher than that of OpenCV's NLM",
        fmt::format("at least {:+.1f} dB", gate.gain_db), fmt::format("{:+.2f} dB", gain_db), gain_db >= gate.gain_db,
        fmt::format("{:.2f} and {:.2f} dB, with strengths of NLM that are optimised against the truth",
                    ours->error.psnr_db, theirs->error.psnr_db)));
    out.push_back(check(fmt::format("nlm-ciede2000-{}", gate.light),
                        "the CIEDE2000 of standard is lower than that of OpenCV's NLM",
                        fmt::format("at most {:.2f} of it", gate.ciede_fraction), fmt::format("{:.3f}", share),
                        share <= gate.ciede_fraction,
                        fmt::format("{:.2f} and {:.2f}", ours->error.ciede2000, theirs->error.ciede2000)));
  }
}

constexpr std::array<std::string_view, 4> gain_lights{"200/2", "20/2", "20/200", "4/200"};
struct GainOverNone {
  std::string_view level;
  std::array<double, gain_lights.size()> gain_db;
};
constexpr std::array gains_over_none{
    GainOverNone{"draft", {3.0, 7.5, 10.0, 11.0}}, GainOverNone{"standard", {3.3, 7.8, 10.3, 11.3}},
    GainOverNone{"high", {3.7, 8.3, 10.7, 11.8}}, GainOverNone{"best", {4.3, 9.3, 11.6, 12.5}}};

void add_gains(const Rows& rows, std::vector<Finding>& out) {
  for (const GainOverNone& gate : gains_over_none) {
    for (std::size_t i = 0; i < gain_lights.size(); ++i) {
      const DenoiseRow* const ours = rows.find(gain_lights[i], gate.level);
      const DenoiseRow* const none = rows.find(gain_lights[i], name_of_none);
      if (ours == nullptr || none == nullptr) continue;
      const double gain_db = ours->error.psnr_db - none->error.psnr_db;
      out.push_back(check(fmt::format("gain-{}-{}", gate.level, gain_lights[i]), "PSNR over none",
                          fmt::format("at least {:+.1f} dB", gate.gain_db[i]), fmt::format("{:+.2f} dB", gain_db),
                          gain_db >= gate.gain_db[i],
                          fmt::format("{:.2f} and {:.2f} dB", ours->error.psnr_db, none->error.psnr_db)));
    }
  }
}

constexpr double dark_enough_e = 20;

void add_undominated(std::span<const DenoiseRow> all, const Rows& rows, std::vector<Finding>& out) {
  for (const DenoiseRow& first : all) {
    if (first.method != name_of_none || first.light.mean_e > dark_enough_e) continue;
    const std::string light = name_of(first.light);
    std::string beaten;
    for (const DenoiseRow* row : rows.ours([&](const DenoiseRow& r) { return name_of(r.light) == light; })) {
      if (!row->undominated) beaten += (beaten.empty() ? "" : ", ") + row->method;
    }
    out.push_back(check("undominated-" + light, "no row dominates a level of lowlux in time and CIEDE2000",
                        "no level beaten", beaten.empty() ? "none" : beaten, beaten.empty(),
                        "a level is dominated by another row"));
  }
}

struct Speed {
  std::string_view level;
  double times;
};
constexpr std::array speeds{Speed{"draft", 60}, Speed{"standard", 30}, Speed{"high", 10}};

void add_speeds(const Rows& rows, std::vector<Finding>& out) {
  for (const Speed& gate : speeds) {
    const auto measured =
        rows.ours([&](const DenoiseRow& row) { return row.method == gate.level && std::isfinite(row.speed_of_nlm); });
    if (measured.empty()) continue;
    const auto [least, most] = std::minmax_element(measured.begin(), measured.end(),
                                                   [](auto* a, auto* b) { return a->speed_of_nlm < b->speed_of_nlm; });
    out.push_back(check(fmt::format("speed-{}", gate.level), "times the speed of OpenCV's NLM, at every light level",
                        fmt::format("at least {:.0f}", gate.times), fmt::format("{:.1f}", (*least)->speed_of_nlm),
                        (*least)->speed_of_nlm >= gate.times,
                        fmt::format("from {:.1f} at {} to {:.1f} at {}", (*least)->speed_of_nlm,
                                    name_of((*least)->light), (*most)->speed_of_nlm, name_of((*most)->light))));
  }
}

struct Range {
  double least;
  std::optional<double> most;
};

std::optional<Range> saturation_range(const DenoiseLight& light) {
  if (light.dark_e == 2 && light.mean_e >= dark_enough_e) return Range{0.98, 1.02};
  if (name_of(light) == "20/200") return Range{0.945, {}};
  if (name_of(light) == "4/2") return Range{0.96, {}};
  return std::nullopt;
}

void add_saturation(const Rows& rows, std::vector<Finding>& out) {
  for (const DenoiseRow* row : rows.ours([](const DenoiseRow& r) { return saturation_range(r.light).has_value(); })) {
    const Range range = *saturation_range(row->light);
    const double got = row->error.saturation_ratio;
    out.push_back(check(
        fmt::format("saturation-{}-{}", row->method, name_of(row->light)),
        "saturation of coloured patches, relative to the truth",
        range.most ? fmt::format("{:g} to {:g}", range.least, *range.most) : fmt::format("at least {:g}", range.least),
        fmt::format("{:.4f}", got), got >= range.least && (!range.most || got <= *range.most), "mean of the images"));
  }
}

}  // namespace

std::vector<Finding> denoise_findings(std::span<const DenoiseRow> all) {
  const Rows rows(all);
  std::vector<Finding> out;
  add_against_nl_means(rows, out);
  add_gains(rows, out);
  add_undominated(all, rows, out);
  add_speeds(rows, out);
  add_saturation(rows, out);
  return out;
}

}  // namespace lowlux::isp
