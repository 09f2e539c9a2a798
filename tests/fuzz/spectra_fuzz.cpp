// Tables of spectra from arbitrary text: what is accepted has rising wavelengths and finite values, and written again
// it is the same table.
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "capture/file/spectra_file.h"
#include "tests/fuzz/input.h"

namespace {

using lowlux::test::require;
using Table = std::vector<lowlux::capture::SpectrumColumn>;

void append(std::string& text, double value) {
  char digits[32];  // the shortest that reads back as the same number
  text.append(digits, std::to_chars(std::begin(digits), std::end(digits), value).ptr);
}

std::string text_of(const Table& table) {
  std::string text = "nm";
  for (const auto& column : table) text += "," + column.name;
  const auto nm = table.front().spectrum.wavelengths_nm();
  for (std::size_t row = 0; row < nm.size(); ++row) {
    append(text += '\n', nm[row]);
    for (const auto& column : table) append(text += ',', column.spectrum.values()[row]);
  }
  return text;
}

void check(const Table& table) {
  require(!table.empty() && table.size() < 4096);
  const std::size_t rows = table.front().spectrum.size();
  require(rows >= 2 && rows <= 100000);
  for (const auto& column : table) {
    const auto nm = column.spectrum.wavelengths_nm();
    require(column.spectrum.size() == rows);
    for (std::size_t row = 0; row < rows; ++row) {
      require(std::isfinite(nm[row]) && std::isfinite(column.spectrum.values()[row]));
      require(row == 0 || nm[row] > nm[row - 1]);
    }
  }
}

void require_same(const Table& a, const Table& b) {
  require(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto values_a = a[i].spectrum.values(), values_b = b[i].spectrum.values();
    require(a[i].name == b[i].name && values_a.size() == values_b.size());
    for (std::size_t row = 0; row < values_a.size(); ++row) require(values_a[row] == values_b[row]);
  }
}

}  // namespace

LOWLUX_FUZZ_TARGET(spectra)(const std::uint8_t* data, std::size_t size) {
  const auto table = lowlux::capture::parse_spectra({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!table) {
    require(table.error().where == "fuzz" && table.error().message.find('\n') == std::string::npos);
    return 0;
  }
  check(*table);
  const auto again = lowlux::capture::parse_spectra(text_of(*table), "again");
  require(again.has_value());
  require_same(*table, *again);
  return 0;
}
