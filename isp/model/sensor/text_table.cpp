#include "isp/model/sensor/text_table.h"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cstddef>

namespace lowlux::isp {
namespace {

/// Removes the text up to the next `end` from the front and returns it.
std::string_view take(std::string_view& text, char end) {
  const std::size_t length = std::min(text.find(end), text.size());
  const std::string_view front = text.substr(0, length);
  text.remove_prefix(std::min(length + 1, text.size()));
  return front;
}

std::vector<std::string_view> split(std::string_view line, std::size_t expected) {
  std::vector<std::string_view> cells;
  while (!line.empty()) cells.push_back(take(line, ','));
  cells.resize(std::max(cells.size(), expected));  // no text follows the comma of a blank last cell
  return cells;
}

}  // namespace

TextTable::TextTable(std::string_view csv) {
  while (!csv.empty()) {
    const std::string_view line = take(csv, '\n');
    if (line.empty() || line.front() == '#') continue;
    if (columns_.empty()) {
      columns_ = split(line, 0);
    } else {
      cells_.push_back(split(line, columns_.size()));
      assert(cells_.back().size() == columns_.size() && "a compiled-in table is well formed");
    }
  }
}

std::string_view TextTable::text(int row, std::string_view column) const {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  assert(found != columns_.end());
  return cells_[row][found - columns_.begin()];
}

std::optional<double> TextTable::number(int row, std::string_view column) const {
  const std::string_view cell = text(row, column);
  double number = 0;
  const auto read = std::from_chars(cell.data(), cell.data() + cell.size(), number);
  if (read.ec != std::errc() || read.ptr != cell.data() + cell.size()) return std::nullopt;
  return number;
}

}  // namespace lowlux::isp
