#include "isp/bench/accuracy_time.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <ctime>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "isp/metrics/statistics.h"
#include "isp/raw/kernel/raw_to_rgb.h"

namespace lowlux::isp {
namespace {

constexpr int max_repeats = 1000000;
constexpr double max_copied_mp = 16;  // 64 MB: beyond any cache

double now_s(bool wall_clock) {
  timespec now{};
  clock_gettime(wall_clock ? CLOCK_MONOTONIC : CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Returns the seconds of one run of the work; short work is repeated.
template <class Work>
double time_of(const Work& work, const AccuracyTiming& timing) {
  const double start = now_s(timing.wall_clock);
  int repeats = 0;
  double taken = 0;
  do {
    work();
    ++repeats;
    taken = now_s(timing.wall_clock) - start;
  } while (taken < timing.min_s && repeats < max_repeats);
  return taken / repeats;
}

bool dominates(const AccuracyRow& a, const AccuracyRow& b) {
  return a.ms_per_mp <= b.ms_per_mp && a.error <= b.error && (a.ms_per_mp < b.ms_per_mp || a.error < b.error);
}

/// Returns the rows of the group that begins at `first`.
template <class Row>
std::span<Row> group_from(std::span<Row> rows, std::size_t first) {
  std::size_t last = first;
  while (last < rows.size() && rows[last].group == rows[first].group) ++last;
  return rows.subspan(first, last - first);
}

Plot plot_of(const std::string& stage, std::size_t number, std::span<const AccuracyRow> rows) {
  Plot plot{.id = fmt::format("{}-{}", stage, number),
            .title = rows.front().group,
            .x_label = "time [ms/MP]",
            .y_label = rows.front().error_of,
            .x_scale = AxisScale::logarithmic,
            .y_scale = AxisScale::linear};
  std::vector<const AccuracyRow*> front;
  for (const AccuracyRow& row : rows) {
    plot.series.push_back({row.level, {row.ms_per_mp}, {row.error}, Mark::points});
    if (row.undominated) front.push_back(&row);
  }
  std::ranges::sort(front, {}, [](const AccuracyRow* row) { return row->ms_per_mp; });
  Series line{"undominated", {}, {}, Mark::line};
  std::string names;
  for (const AccuracyRow* row : front) {
    line.x.push_back(row->ms_per_mp);
    line.y.push_back(row->error);
    names += (names.empty() ? "" : "; ") + row->level;
  }
  plot.series.push_back(std::move(line));
  plot.name_points = true;
  plot.caption = "Pareto-optimal levels: " + names;
  return plot;
}

}  // namespace

std::vector<AccuracyRow> measure(const AccuracyGroup& group, const AccuracyTiming& timing) {
  assert(timing.rounds >= 1);
  const std::size_t count = group.levels.size();
  std::vector<std::vector<double>> s_per_mp(count), ratio(count);
  double max_mp = 0;
  for (const AccuracyLevel& level : group.levels) max_mp = std::max(max_mp, level.megapixels);
  const std::vector<float> from(static_cast<std::size_t>(std::min(max_mp, max_copied_mp) * 1e6) + 1, 1.0f);
  std::vector<float> to(from.size());
  const auto copy = [&] { std::memcpy(to.data(), from.data(), from.size() * sizeof(float)); };
  for (int round = -1; round < timing.rounds; ++round) {
    const double copy_s_per_mp = time_of(copy, timing) / (1e-6 * static_cast<double>(from.size()));
    for (std::size_t i = 0; i < count; ++i) {
      const double s = time_of(group.levels[i].run, timing) / group.levels[i].megapixels;
      if (round < 0) continue;
      s_per_mp[i].push_back(s);
      ratio[i].push_back(s / copy_s_per_mp);
    }
  }
  std::vector<AccuracyRow> rows;
  rows.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    rows.push_back({.group = group.name,
                    .error_of = group.error_of,
                    .level = group.levels[i].name,
                    .error = group.levels[i].error,
                    .ms_per_mp = 1e3 * median(s_per_mp[i]),
                    .spread = spread_of(s_per_mp[i]),
                    .times_memcpy = median(ratio[i]),
                    .largest = group.levels[i].largest});
  }
  mark_undominated(rows);
  return rows;
}

void mark_undominated(std::span<AccuracyRow> rows) {
  for (std::size_t first = 0; first < rows.size();) {
    const std::span<AccuracyRow> group = group_from(rows, first);
    for (AccuracyRow& row : group) {
      row.undominated = std::ranges::none_of(group, [&](const AccuracyRow& other) { return dominates(other, row); });
    }
    first += group.size();
  }
}

BenchTable accuracy_table(std::span<const AccuracyRow> rows) {
  BenchTable table{{"case", "level", "error", "error of", "time [ms/MP]", "spread [%]", "x memcpy", "undominated"}, {}};
  const bool with_largest =
      std::ranges::any_of(rows, [](const AccuracyRow& row) { return std::isfinite(row.largest); });
  if (with_largest) table.columns.emplace_back("largest error");
  table.rows.reserve(rows.size());
  for (const AccuracyRow& row : rows) {
    table.rows.push_back({row.group, row.level, row.error, row.error_of, row.ms_per_mp, 100 * row.spread,
                          row.times_memcpy, std::string(row.undominated ? "yes" : "no")});
    if (with_largest) table.rows.back().emplace_back(row.largest);
  }
  return table;
}

std::vector<Plot> accuracy_plots(const std::string& stage, std::span<const AccuracyRow> rows) {
  std::vector<Plot> plots;
  for (std::size_t first = 0; first < rows.size();) {
    const std::span<const AccuracyRow> group = group_from(rows, first);
    plots.push_back(plot_of(stage, plots.size() + 1, group));
    first += group.size();
  }
  return plots;
}

BenchOutcome accuracy_outcome(const std::string& stage, std::span<const AccuracyRow> rows, const AccuracyTiming& timing,
                              int threads) {
  return {.table = accuracy_table(rows),
          .plots = accuracy_plots(stage, rows),
          .remarks = {timing_remark(timing, threads)},
          .threads = threads};
}

std::string timing_remark(const AccuracyTiming& timing, int threads) {
  return fmt::format("Times: median of {} rounds in which all levels of a case and memcpy alternate; {} of {}; {}",
                     timing.rounds, timing.wall_clock ? "wall clock" : "CPU time",
                     threads == 1 ? std::string("one thread") : fmt::format("{} threads", threads),
                     raw_to_rgb_target());
}

void StageRows::add(const AccuracyGroup& group, std::vector<std::vector<double>> figures_of,
                    const AccuracyTiming& timing) {
  assert(figures_of.size() == group.levels.size());
  std::ranges::move(measure(group, timing), std::back_inserter(rows));
  std::ranges::move(figures_of, std::back_inserter(figures));
}

BenchOutcome outcome_of(const std::string& stage, const StageRows& rows, TimeOf time_of) {
  BenchOutcome out{.table = accuracy_table(rows.rows), .plots = accuracy_plots(stage, rows.rows)};
  if (time_of == TimeOf::whole) {
    std::ranges::replace(out.table.columns, std::string("time [ms/MP]"), std::string("time [ms]"));
    for (Plot& plot : out.plots) plot.x_label = "time [ms]";
  }
  for (const std::string& name : rows.further) out.table.columns.push_back(name);
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    assert(rows.figures[i].size() == rows.further.size());
    std::vector<BenchCell>& cells = out.table.rows[i];
    cells.reserve(cells.size() + rows.further.size());
    for (const double figure : rows.figures[i]) cells.emplace_back(figure);
  }
  return out;
}

Finding check_of(std::string id, std::string claim, std::string expected, std::string found, bool holds) {
  return {.id = std::move(id),
          .claim = std::move(claim),
          .published = std::move(expected),
          .ours = std::move(found),
          .holds = holds,
          .note = {},
          .kind = Finding::Kind::check};
}

}  // namespace lowlux::isp
