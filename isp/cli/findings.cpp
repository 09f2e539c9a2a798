#include "isp/cli/findings.h"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace lowlux::cli {
namespace {

constexpr std::array<std::size_t, 4> widths{40, 24, 32, 13};  // finding, published, ours, verdict
constexpr std::size_t note_width = 104;

// Broken at blanks; a word that is longer than the width has its own line.
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

std::string table_row(const std::array<std::string, 4>& cells) {
  std::array<std::vector<std::string>, 4> columns;
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
  std::string out = table_row({"finding", "published", "ours", "verdict"});
  std::size_t holding = 0;
  for (const isp::Finding& f : findings) {
    out += table_row({f.id, f.published, f.ours, std::string(isp::verdict_of(f))});
    if (f.holds) {
      ++holding;
      continue;
    }
    for (const std::string& line : wrapped(f.claim + ": " + f.note, note_width)) out += fmt::format("    {}\n", line);
  }
  return out + fmt::format("{} of {} findings hold\n", holding, findings.size());
}

std::string findings_json(std::span<const isp::Finding> findings) {
  auto out = nlohmann::ordered_json::array();
  for (const isp::Finding& f : findings) {
    out.push_back({{"id", f.id},
                   {"claim", f.claim},
                   {"published", f.published},
                   {"ours", f.ours},
                   {"holds", f.holds},
                   {"note", f.note}});
  }
  return out.dump(2);
}

}  // namespace lowlux::cli
