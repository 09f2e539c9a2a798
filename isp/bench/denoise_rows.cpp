#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "isp/bench/denoise_bench.h"

namespace lowlux::isp {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

bool same_light(const DenoiseRow& a, const DenoiseRow& b) { return name_of(a.light) == name_of(b.light); }

bool dominates(const DenoiseRow& a, const DenoiseRow& b) {
  return a.s_per_mp <= b.s_per_mp && a.error.ciede2000 <= b.error.ciede2000 &&
         (a.s_per_mp < b.s_per_mp || a.error.ciede2000 < b.error.ciede2000);
}

BenchCell if_ceiling_none(const DenoiseRow& row, double value) { return row.kind == MethodKind::ceiling ? nan : value; }

/// The rows of the light of `first`, which follow it.
std::span<const DenoiseRow> rows_of_light(std::span<const DenoiseRow> rows, std::size_t first) {
  std::size_t last = first;
  while (last < rows.size() && same_light(rows[first], rows[last])) ++last;
  return rows.subspan(first, last - first);
}

Plot plot_of(std::span<const DenoiseRow> rows) {
  const DenoiseLight& light = rows.front().light;
  Plot plot{.id = fmt::format("denoise-{:g}-{:g}", light.mean_e, light.dark_e),
            .title = fmt::format("{:g} e- over {:g} e- of dark", light.mean_e, light.dark_e),
            .x_label = "CPU time of one thread [s/MP]",
            .y_label = "mean CIEDE2000",
            .x_scale = AxisScale::logarithmic,
            .y_scale = AxisScale::linear};
  std::vector<std::pair<double, double>> front;
  std::string names;
  for (const DenoiseRow& row : rows) {
    if (row.kind == MethodKind::ceiling) continue;
    plot.series.push_back({row.method, {row.s_per_mp}, {row.error.ciede2000}, Mark::points});
    if (!row.undominated) continue;
    front.emplace_back(row.s_per_mp, row.error.ciede2000);
    names += (names.empty() ? "" : ", ") + row.method;
  }
  std::sort(front.begin(), front.end());
  Series line{"undominated", {}, {}, Mark::line};
  for (const auto& [time, error] : front) {
    line.x.push_back(time);
    line.y.push_back(error);
  }
  plot.series.push_back(std::move(line));
  plot.name_points = true;
  plot.caption = "No other row is faster and as good, or better and as fast: " + names;
  return plot;
}

}  // namespace

std::vector<DenoiseLight> denoise_lights(bool quick) {
  constexpr double small_dark_e = 2, small_read_e = 1.5, large_dark_e = 200, large_read_e = 4;
  constexpr double most_over_large_dark_e = 20;  // with more light, that dark makes no other picture than little dark
  if (quick) return {{20, small_dark_e, small_read_e}, {4, large_dark_e, large_read_e}};
  std::vector<DenoiseLight> out;
  for (const double mean_e : {2000, 200, 20, 4, 1}) {
    out.push_back({mean_e, small_dark_e, small_read_e});
    if (mean_e <= most_over_large_dark_e) out.push_back({mean_e, large_dark_e, large_read_e});
  }
  return out;
}

void mark_undominated(std::span<DenoiseRow> rows) {
  for (DenoiseRow& row : rows) {
    row.undominated =
        row.kind != MethodKind::ceiling && std::none_of(rows.begin(), rows.end(), [&row](const DenoiseRow& other) {
          return other.kind != MethodKind::ceiling && same_light(row, other) && dominates(other, row);
        });
  }
}

BenchTable denoise_table(std::span<const DenoiseRow> rows) {
  BenchTable table{
      {"mean_e", "dark_e", "read_noise_e", "method", "psnr_db", "ciede2000", "chroma_rmse", "box_chroma_rmse",
       "uv_shift", "saturation_ratio", "s_per_mp", "spread_percent", "times_memcpy", "speed_of_nlm", "undominated"},
      {}};
  table.rows.reserve(rows.size());
  for (const DenoiseRow& row : rows) {
    const PictureError& e = row.error;
    table.rows.push_back({row.light.mean_e, row.light.dark_e, row.light.read_noise_e, row.method, e.psnr_db,
                          e.ciede2000, e.chroma_rmse, e.box_chroma_rmse, e.uv_shift, e.saturation_ratio,
                          if_ceiling_none(row, row.s_per_mp), if_ceiling_none(row, 100 * row.spread),
                          if_ceiling_none(row, row.times_memcpy), if_ceiling_none(row, row.speed_of_nlm),
                          std::string(row.undominated ? "yes" : "")});
  }
  return table;
}

std::vector<Plot> denoise_plots(std::span<const DenoiseRow> rows) {
  std::vector<Plot> out;
  for (std::size_t first = 0; first < rows.size();) {
    const auto light = rows_of_light(rows, first);
    out.push_back(plot_of(light));
    first += light.size();
  }
  return out;
}

}  // namespace lowlux::isp
