#include "isp/bench/stages/method_rows.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "isp/bench/accuracy_time.h"

namespace lowlux::isp {

void rank_methods(std::vector<MethodRow>& rows) {
  const auto ranked = [](const MethodRow& row) { return row.method != name_of_noise_free; };
  std::vector<std::string> lights;
  for (const MethodRow& row : rows) {
    if (std::ranges::find(lights, row.light) == lights.end()) lights.push_back(row.light);
  }
  const auto place = [&](const MethodRow& row) { return std::ranges::find(lights, row.light) - lights.begin(); };
  std::ranges::stable_sort(rows, [&](const MethodRow& a, const MethodRow& b) {
    if (a.light != b.light) return place(a) < place(b);
    if (ranked(a) != ranked(b)) return !ranked(a);
    return a.score.error.psnr_db > b.score.error.psnr_db;
  });
  std::vector<AccuracyRow> timed;
  int rank = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i == 0 || rows[i].light != rows[i - 1].light) rank = 0;
    rows[i].rank = ranked(rows[i]) ? ++rank : 0;
    if (!std::isfinite(rows[i].ms_per_mp)) continue;
    timed.push_back({.group = rows[i].light,
                     .level = rows[i].method,
                     .error = rows[i].score.error.ciede2000,
                     .ms_per_mp = rows[i].ms_per_mp});
  }
  mark_undominated(timed);
  for (const AccuracyRow& row : timed) {
    const auto at =
        std::ranges::find_if(rows, [&](const MethodRow& r) { return r.light == row.group && r.method == row.level; });
    at->undominated = row.undominated;
  }
}

BenchTable methods_table(std::span<const MethodRow> rows) {
  BenchTable table{
      {"light [e-/e-]", "rank", "method", "run as", "PSNR [dB]", "CIEDE2000", "saturation kept", "chroma bias",
       "blotches", "texture kept", "stars kept", "time [ms/MP]", "CPU [ms/MP]", "peak memory [MiB]", "undominated"},
      {}};
  table.rows.reserve(rows.size());
  for (const MethodRow& row : rows) {
    const PictureError& error = row.score.error;
    table.rows.push_back({row.light, row.rank > 0 ? fmt::format("{}", row.rank) : std::string(), row.method, row.run_as,
                          error.psnr_db, error.ciede2000, error.saturation_ratio, row.score.chroma_bias,
                          error.box_chroma_rmse, row.score.texture_kept, row.score.stars_kept, row.ms_per_mp,
                          row.cpu_ms_per_mp, row.peak_mib, std::string(row.undominated ? "yes" : "")});
  }
  return table;
}

}  // namespace lowlux::isp
