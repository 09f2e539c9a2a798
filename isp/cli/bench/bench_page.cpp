#include "isp/cli/bench/bench_page.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "isp/cli/shared/report.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {
namespace {

constexpr std::array<std::string_view, 3> whole_pipeline{"develop", "error-sources", "simulate"};  // ids of stages

std::vector<const MeasuredStage*> in_order_of_page(const std::vector<MeasuredStage>& measured) {
  std::vector<const MeasuredStage*> out;
  out.reserve(measured.size());
  for (const MeasuredStage& m : measured) out.push_back(&m);
  const auto place = [](const MeasuredStage* m) { return std::ranges::find(whole_pipeline, m->stage.id); };
  std::ranges::stable_sort(out, {}, place);
  return out;
}

isp::ReportSection machine_section(const Machine& machine) {
  isp::ReportSection section{.title = "Machine", .table = {{"what", "is"}, {}}};
  const auto add = [&](std::string what, std::string is) {
    section.table.rows.push_back({std::move(what), std::move(is)});
  };
  add("processor", machine.cpu.value_or("not stated by the system"));
  add("processors online", fmt::format("{}", machine.processors));
  add("threads used, unless a stage states otherwise", fmt::format("{}", machine.threads));
  add("instruction set of the kernels", machine.kernels);
  add("memory", machine.memory_gib ? fmt::format("{:.1f} GiB", *machine.memory_gib) : "not stated by the system");
  add("system", machine.system);
  add("compiler", machine.compiler);
  add("lowlux", machine.lowlux);
  return section;
}

std::string count_of_findings(const std::vector<isp::Finding>& findings) {
  if (findings.empty()) return "none are stated";
  return fmt::format("{} of {} hold", std::ranges::count_if(findings, &isp::Finding::holds), findings.size());
}

isp::ReportSection overview(const std::vector<const MeasuredStage*>& stages) {
  isp::ReportSection section{.title = "At a glance",
                             .text =
                                 "Findings are the expectations of a stage, next to its results. Rows whose findings "
                                 "do not all hold have a tinted background.",
                             .table = {{"stage", "what", "rows measured", "findings", "took [s]"}, {}}};
  section.table.rows.reserve(stages.size());
  for (const MeasuredStage* m : stages) {
    const isp::BenchOutcome& outcome = m->outcome;
    if (!std::ranges::all_of(outcome.findings, &isp::Finding::holds)) {
      section.table.marked.push_back(section.table.rows.size());
    }
    section.table.rows.push_back({std::string(m->stage.id), std::string(m->stage.title),
                                  fmt::format("{}", outcome.table.rows.size()), count_of_findings(outcome.findings),
                                  fmt::format("{:.1f}", m->took_s)});
  }
  return section;
}

/// Returns the rows whose cell in column `undominated` is "yes".
std::vector<std::size_t> undominated_rows(const isp::BenchTable& table) {
  std::vector<std::size_t> out;
  const auto column = std::ranges::find(table.columns, "undominated") - table.columns.begin();
  if (column == std::ssize(table.columns)) return out;
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    const auto* text = std::get_if<std::string>(&table.rows[r][static_cast<std::size_t>(column)]);
    if (text != nullptr && *text == "yes") out.push_back(r);
  }
  return out;
}

isp::ReportSection measured_part(const isp::BenchTable& table) {
  isp::ReportSection part{.title = "What was measured", .table = isp::table_of(table, shown_digits), .is_part = true};
  part.table.marked = undominated_rows(table);
  if (!part.table.marked.empty()) {
    part.text =
        "Rows with a tinted background are Pareto-optimal: no other row is faster and as good, or better and as fast.";
  }
  return part;
}

isp::ReportSection findings_part(const std::vector<isp::Finding>& findings) {
  isp::ReportSection part{.title = "Expectations", .table = isp::table_of(findings), .is_part = true};
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (!findings[i].holds) part.table.marked.push_back(i);
  }
  part.text = count_of_findings(findings);
  part.text += part.table.marked.empty() ? "." : "; the others have a tinted background.";
  return part;
}

Result<isp::ComparedPicture> side(const isp::BenchOutcome& outcome, const std::string& id, const std::string& label,
                                  Executor& executor) {
  const auto image = std::ranges::find(outcome.images, id, &isp::BenchImage::id);
  assert(image != outcome.images.end());
  auto png = isp::png_bytes(image->codes, OutputSpace::srgb, executor);
  if (!png) return tl::make_unexpected(png.error());
  return isp::ComparedPicture{label, *std::move(png)};
}

Result<isp::ReportSection> pictures_part(const isp::BenchOutcome& outcome, Executor& executor) {
  isp::ReportSection part{.title = "Pictures", .is_part = true};
  if (!outcome.comparisons.empty()) {
    part.text = "The slider moves the edge between the two, with the mouse, a finger, or the arrow keys.\n";
  }
  part.text += "Next to this page are";
  for (const isp::BenchImage& image : outcome.images) {
    part.text += fmt::format("{} {}.png", &image == &outcome.images.front() ? "" : ",", image.id);
  }
  part.text += '.';
  part.comparisons.reserve(outcome.comparisons.size());
  for (const isp::BenchComparison& c : outcome.comparisons) {
    auto before = side(outcome, c.before_id, c.before_label, executor);
    if (!before) return tl::make_unexpected(before.error());
    auto after = side(outcome, c.after_id, c.after_label, executor);
    if (!after) return tl::make_unexpected(after.error());
    part.comparisons.push_back({c.title, *std::move(before), *std::move(after)});
  }
  return part;
}

isp::ReportSection remarks_part(const std::vector<std::string>& remarks) {
  isp::ReportSection part{.title = "How it was measured", .is_part = true};
  for (const std::string& remark : remarks) part.text += remark + ".\n";
  return part;
}

isp::ReportSection failures_part(const std::vector<Error>& failures) {
  isp::ReportSection part{.title = "What failed", .is_part = true};
  for (const Error& error : failures) part.text += error_line(error.where, error) + "\n";
  return part;
}

isp::ReportSection settings_part(const std::vector<isp::BenchSetting>& settings) {
  isp::ReportSection part{.title = "To repeat it", .table = {{"what", "is"}, {}}, .is_part = true};
  for (const isp::BenchSetting& setting : settings) part.table.rows.push_back({setting.name, setting.value});
  return part;
}

Result<void> add_stage(const MeasuredStage& measured, Executor& executor, isp::Report& page) {
  const isp::BenchOutcome& outcome = measured.outcome;
  page.sections.push_back({.title = std::string(measured.stage.title)});
  if (!outcome.plots.empty()) {
    page.sections.push_back({.title = "Charts", .plots = outcome.plots, .is_part = true});
  }
  if (!outcome.images.empty()) {
    auto pictures = pictures_part(outcome, executor);
    if (!pictures) return tl::make_unexpected(pictures.error());
    page.sections.push_back(*std::move(pictures));
  }
  page.sections.push_back(measured_part(outcome.table));
  if (!outcome.failures.empty()) page.sections.push_back(failures_part(outcome.failures));
  if (!outcome.settings.empty()) page.sections.push_back(settings_part(outcome.settings));
  if (!outcome.findings.empty()) page.sections.push_back(findings_part(outcome.findings));
  if (!outcome.remarks.empty()) page.sections.push_back(remarks_part(outcome.remarks));
  return {};
}

}  // namespace

std::string time_text(const std::vector<MeasuredStage>& measured) {
  double sum_s = 0;
  for (const MeasuredStage& m : measured) sum_s += m.took_s;
  return fmt::format("{} stage{} took {:.1f} s", measured.size(), measured.size() == 1 ? "" : "s", sum_s);
}

Result<std::string> bench_page(const std::vector<MeasuredStage>& measured, const Machine& machine, Executor& executor) {
  const std::vector<const MeasuredStage*> stages = in_order_of_page(measured);
  isp::Report page{.title = "lowlux bench: accuracy against time",
                   .text =
                       "Time and error of each stage of the pipeline, at each of its levels and compared with other "
                       "methods. Times were measured on the machine below; ratios apply better to other machines.",
                   .sections = {machine_section(machine), overview(stages)}};
  page.sections.back().text += '\n' + time_text(measured) + '.';
  for (const MeasuredStage* stage : stages) {
    if (auto added = add_stage(*stage, executor, page); !added) return tl::make_unexpected(added.error());
  }
  return isp::html_of(page);
}

}  // namespace lowlux::cli
