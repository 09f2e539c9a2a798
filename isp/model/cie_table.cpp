#include "isp/model/cie_table.h"

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

namespace lowlux::isp {

Spectrum column_of(const CieTable& table, std::size_t column) {
  const std::size_t columns = table.columns.size();
  std::vector<double> nm, value;
  for (std::size_t i = 0; i < table.cells.size(); i += columns) {
    nm.push_back(table.cells[i]);
    value.push_back(table.cells[i + column]);
  }
  auto spectrum = Spectrum::of(std::move(nm), std::move(value));
  assert(spectrum && "a compiled-in table is well formed");
  return *std::move(spectrum);
}

std::optional<Spectrum> column_named(const CieTable& table, std::string_view name) {
  const auto found = std::find(table.columns.begin() + 1, table.columns.end(), name);
  if (found == table.columns.end()) return std::nullopt;
  return column_of(table, static_cast<std::size_t>(found - table.columns.begin()));
}

}  // namespace lowlux::isp
