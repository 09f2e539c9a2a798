#include "isp/bench/stages/stage_rows.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

namespace lowlux::isp {

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
