#include "isp/cli/lines.h"

#include <vector>

#include <fmt/format.h>

namespace lowlux::cli {

std::string aligned_text(const isp::Table& table, std::size_t words_from) {
  std::vector<std::size_t> widths(table.columns.size());
  const auto widen = [&](const std::vector<std::string>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  };
  widen(table.columns);
  for (const auto& row : table.rows) widen(row);
  std::string text;
  const auto print = [&](const std::vector<std::string>& row) {
    std::string line = "  ";
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool words = i == 0 || i >= words_from;
      line += words ? fmt::format("{:<{}}  ", row[i], widths[i]) : fmt::format("{:>{}}  ", row[i], widths[i]);
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  };
  print(table.columns);
  for (const auto& row : table.rows) print(row);
  return text;
}

}  // namespace lowlux::cli
