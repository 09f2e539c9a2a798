#include "isp/cli/bench/findings.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace lowlux::cli {
namespace {

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

std::string findings_text(std::span<const isp::Finding> findings) {
  std::string out = table_row({"finding", "kind", "published", "ours", "verdict"});
  for (const isp::Finding& f : findings) {
    out += table_row({f.id, std::string(isp::kind_of(f)), f.published, f.ours, std::string(isp::verdict_of(f))});
    if (f.holds && !f.direction_only) continue;
    for (const std::string& line : wrapped(f.claim + ": " + f.note, note_width)) out += fmt::format("    {}\n", line);
  }
  out += fmt::format("published findings: {}\nchecks of our own: {}\n",
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
