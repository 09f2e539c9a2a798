#include "isp/cli/bench/bench_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "isp/base/json_text.h"
#include "isp/cli/shared/report.h"
#include "isp/output/picture/image_writer.h"

namespace lowlux::cli {
namespace {

using Json = nlohmann::ordered_json;
constexpr const char* page_name = "bench.html";

/// Returns columns as wide as their widest cell, numbers aligned at the right.
std::string table_text(const isp::BenchTable& bench) {
  const isp::Table table = isp::table_of(bench, shown_digits);
  std::vector<std::size_t> width;
  width.reserve(table.columns.size());
  for (const std::string& column : table.columns) width.push_back(column.size());
  for (const auto& row : table.rows) {
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  }
  std::string out;
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t c = 0; c < cells.size(); ++c) text += fmt::format("{:>{}}  ", cells[c], width[c]);
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + '\n';
  };
  line(table.columns);
  for (const auto& row : table.rows) line(row);
  return out;
}

Json json_of(const isp::BenchCell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) return *text;
  const double value = std::get<double>(cell);
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json json_of(const Machine& machine) {
  return {{"cpu", machine.cpu ? Json(*machine.cpu) : Json(nullptr)},
          {"processors", machine.processors},
          {"threads", machine.threads},
          {"kernels", machine.kernels},
          {"memory_gib", machine.memory_gib ? Json(*machine.memory_gib) : Json(nullptr)},
          {"system", machine.system},
          {"compiler", machine.compiler},
          {"lowlux", machine.lowlux}};
}

/// Returns JSON text; names of systems and processors may hold any bytes, so that invalid UTF-8 is replaced.
std::string dumped(const Json& json) { return json_text(json, 2); }

Json json_of(const MeasuredStage& measured, const Machine& machine) {
  Json rows = Json::array();
  for (const auto& cells : measured.outcome.table.rows) {
    Json row = Json::object();
    for (std::size_t c = 0; c < cells.size(); ++c) row[measured.outcome.table.columns[c]] = json_of(cells[c]);
    rows.push_back(std::move(row));
  }
  Json out{{"stage", measured.stage.id}, {"machine", json_of(machine)},
           {"took_s", measured.took_s},  {"remarks", measured.outcome.remarks},
           {"rows", std::move(rows)},    {"findings", Json::parse(findings_json(measured.outcome.findings))}};
  if (measured.outcome.settings.empty()) return out;
  for (const isp::BenchSetting& setting : measured.outcome.settings) out["settings"][setting.name] = setting.value;
  out["failures"] = Json::array();
  for (const Error& error : measured.outcome.failures) out["failures"].push_back(error_line(error.where, error));
  return out;
}

struct OutputFile {
  std::string name;
  std::string text;
};

/// Returns the table with columns for the conditions of its times, because lines of a CSV are used without context.
isp::Table self_contained_table(const MeasuredStage& measured, const Machine& machine) {
  constexpr int all_digits = 17;
  isp::Table out = isp::table_of(measured.outcome.table, all_digits);
  const auto add = [&out](const char* column, const std::string& cell) {
    if (std::ranges::find(out.columns, column) != out.columns.end()) return;
    out.columns.emplace_back(column);
    for (auto& row : out.rows) row.push_back(cell);
  };
  add("threads", fmt::format("{}", measured.outcome.threads));
  add("instruction set", machine.kernels);
  return out;
}

std::vector<OutputFile> text_files(const MeasuredStage& measured, const Machine& machine) {
  const std::string id(measured.stage.id);
  return {{id + ".csv", isp::csv_of(self_contained_table(measured, machine))},
          {id + ".json", dumped(json_of(measured, machine)) + "\n"}};
}

Result<void> check_output_is_free(const std::string& name, const BenchArgs& args) {
  const std::filesystem::path file = std::filesystem::path(args.output) / name;
  std::error_code ignored;
  if (args.force || !std::filesystem::exists(file, ignored)) return {};
  return fail(ErrorCode::exists, "the file exists: use --force to overwrite it", file.string());
}

Result<void> check_texts_free(const isp::BenchStage& stage, const BenchArgs& args) {
  for (const char* end : {".csv", ".json"}) {
    if (auto free = check_output_is_free(std::string(stage.id) + end, args); !free) return free;
  }
  return {};
}

Result<void> check_all_free(const std::vector<MeasuredStage>& measured, const BenchArgs& args) {
  if (auto free = check_output_is_free(page_name, args); !free) return free;
  for (const MeasuredStage& m : measured) {
    if (auto free = check_texts_free(m.stage, args); !free) return free;
    for (const isp::BenchImage& image : m.outcome.images) {
      if (auto free = check_output_is_free(image.id + ".png", args); !free) return free;
    }
  }
  return {};
}

constexpr std::array<std::size_t, 5> widths{40, 9, 24, 32, 14};  // finding, kind, published, ours, verdict
constexpr std::size_t note_width = 104;

// Wraps text at blanks; a word that is longer than the width has its own line.
std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines{""};
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find(' ', start), text.size());
    const std::string word = text.substr(start, end - start);
    if (!lines.back().empty() && lines.back().size() + 1 + word.size() > width) lines.emplace_back();
    if (!lines.back().empty()) lines.back() += ' ';
    lines.back() += word;
    start = end + 1;
  }
  return lines;
}

std::string table_row(const std::array<std::string, 5>& cells) {
  std::array<std::vector<std::string>, 5> columns;
  std::size_t height = 1;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    columns[c] = wrapped(cells[c], widths[c]);
    height = std::max(height, columns[c].size());
  }
  std::string out;
  for (std::size_t line = 0; line < height; ++line) {
    std::string text;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      text += fmt::format("{:<{}}", line < columns[c].size() ? columns[c][line] : "", widths[c] + 2);
    }
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + '\n';
  }
  return out;
}

}  // namespace

std::string bench_text(const MeasuredStage& measured) {
  std::string out = fmt::format("{}\n\n", measured.stage.title);
  for (const std::string& remark : measured.outcome.remarks) out += remark + '\n';
  return out + '\n' + table_text(measured.outcome.table) + '\n' + findings_text(measured.outcome.findings);
}

std::string bench_json(const std::vector<MeasuredStage>& measured, const Machine& machine) {
  Json out = Json::array();
  for (const MeasuredStage& m : measured) out.push_back(json_of(m, machine));
  return dumped(out);
}

Result<void> check_bench_files(const std::vector<isp::BenchStage>& stages, const BenchArgs& args) {
  if (args.output.empty()) return {};
  std::error_code error;
  std::filesystem::create_directories(args.output, error);
  if (error) return fail(ErrorCode::unwritable, "the folder cannot be created: " + error.message(), args.output);
  if (auto free = check_output_is_free(page_name, args); !free) return free;
  for (const isp::BenchStage& stage : stages) {
    if (auto free = check_texts_free(stage, args); !free) return free;
  }
  return {};
}

Result<std::vector<std::string>> write_bench_files(const std::vector<MeasuredStage>& measured, const Machine& machine,
                                                   const BenchArgs& args, Executor& executor) {
  const std::filesystem::path folder(args.output);
  if (auto free = check_all_free(measured, args); !free) return tl::make_unexpected(free.error());
  const auto overwrite = args.force ? isp::Overwrite::yes : isp::Overwrite::no;
  std::vector<std::string> out;
  const auto write = [&](const OutputFile& file) {
    out.push_back((folder / file.name).string());
    return isp::write_text(out.back(), file.text, overwrite);
  };
  auto page = bench_page(measured, machine, executor);
  if (!page) return tl::make_unexpected(page.error());
  if (auto written = write({page_name, *std::move(page)}); !written) return tl::make_unexpected(written.error());
  for (const MeasuredStage& m : measured) {
    for (const OutputFile& file : text_files(m, machine)) {
      if (auto written = write(file); !written) return tl::make_unexpected(written.error());
    }
    for (const isp::BenchImage& image : m.outcome.images) {
      out.push_back((folder / (image.id + ".png")).string());
      auto written = isp::write_picture(Encoded8{image.codes.codes.clone()}, OutputSpace::srgb, {}, out.back(),
                                        {.overwrite = overwrite}, executor);
      if (!written) return tl::make_unexpected(written.error());
    }
  }
  return out;
}

std::string findings_text(std::span<const isp::Finding> findings) {
  std::string out = table_row({"finding", "kind", "published", "ours", "verdict"});
  for (const isp::Finding& f : findings) {
    out += table_row({f.id, std::string(isp::kind_of(f)), f.published, f.ours, std::string(isp::verdict_of(f))});
    if (f.holds && !f.direction_only) continue;
    for (const std::string& line : wrapped(f.claim + ": " + f.note, note_width)) out += fmt::format("    {}\n", line);
  }
  out += fmt::format("published findings: {}\nadditional checks: {}\n",
                     isp::count_of_verdicts(findings, isp::Finding::Kind::published),
                     isp::count_of_verdicts(findings, isp::Finding::Kind::check));
  for (const std::string& line : wrapped(std::string(isp::tolerance_of_verdicts), note_width)) out += line + '\n';
  return out;
}

std::string not_reproduced_text() {
  std::string out = "not reproduced:\n";
  for (const isp::NotReproduced& part : isp::not_reproduced()) {
    for (const std::string& line : wrapped(fmt::format("{}: {}", part.what, part.why), note_width)) {
      out += fmt::format("    {}\n", line);
    }
  }
  return out;
}

std::string findings_json(std::span<const isp::Finding> findings) {
  auto out = nlohmann::ordered_json::array();
  for (const isp::Finding& f : findings) {
    out.push_back({{"id", f.id},
                   {"kind", isp::kind_of(f)},
                   {"claim", f.claim},
                   {"published", f.published},
                   {"ours", f.ours},
                   {"holds", f.holds},
                   {"verdict", isp::verdict_of(f)},
                   {"note", f.note}});
  }
  return out.dump(2);
}

}  // namespace lowlux::cli
