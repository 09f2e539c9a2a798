#include "isp/cli/shared/lines.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "isp/base/text.h"

namespace lowlux::cli {
namespace {

thread_local std::string* collected_errors = nullptr;  // null: they are printed

}  // namespace

void print_err(std::string_view text) {
  if (collected_errors == nullptr) return print_text(stderr, text);
  collected_errors->append(text);
}

ErrorText::ErrorText() : previous_(std::exchange(collected_errors, &text_)) {}

ErrorText::~ErrorText() { collected_errors = previous_; }

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

EstimateCells cells_of(const Estimate& e) {
  if (!(e.standard_error > 0)) return {fmt::format("{:.5g}", e.value), ""};
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(e.standard_error)));
  if (decimals < 0 || decimals > 9) return {fmt::format("{:.5g}", e.value), fmt::format("{:.2g}", e.standard_error)};
  return {fmt::format("{:.{}f}", e.value, decimals), fmt::format("{:.{}f}", e.standard_error, decimals)};
}

std::string text_of(const Estimate& e) {
  const EstimateCells cells = cells_of(e);
  return cells.standard_error.empty() ? cells.value : cells.value + " +- " + cells.standard_error;
}

std::string one_line(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]),
               next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
    if (c < 0x20 || c == 0x7f) text[i] = ' ';
    if (c == 0xc2 && next >= 0x80 && next < 0xa0) text[i] = text[i + 1] = ' ';  // U+0080 to U+009F in UTF-8
  }
  return text;
}

std::string suggestion(std::string_view wanted, std::span<const std::string_view> known) {
  const auto near = near_matches(wanted, known);
  return near.empty() ? std::string() : fmt::format(" (did you mean {}?)", fmt::join(near, " or "));
}

}  // namespace lowlux::cli
