#include "capture/file/spectra_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

#include "capture/file/file_bytes.h"
#include "isp/base/text.h"

namespace lowlux::capture {
namespace {

constexpr std::size_t max_bytes = 16 << 20;
constexpr std::size_t max_columns = 4096;
constexpr std::size_t max_rows = 100000;

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t start = 0; start <= line.size();) {
    const std::size_t end = std::min(line.find(',', start), line.size());
    cells.push_back(trimmed(line.substr(start, end - start)));
    start = end + 1;
  }
  return cells;
}

/// Returns a cell as a finite number with a decimal point; nullopt for any other text.
std::optional<double> finite_number_of(std::string_view cell) {
  double value = 0;
  const auto read = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool whole = read.ec == std::errc() && read.ptr == cell.data() + cell.size();
  return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

class Table {
 public:
  explicit Table(std::string name) : name_(std::move(name)) {}

  Result<void> add(std::string_view line) {
    ++line_;
    line = trimmed(line);
    if (line.empty() || line.front() == '#') return {};
    const auto cells = cells_of(line);
    if (names_.empty()) return add_names(cells);
    if (cells.size() != names_.size()) {
      return wrong("has " + std::to_string(cells.size()) + " cells, the row of names " + std::to_string(names_.size()));
    }
    if (columns_.front().size() == max_rows) return wrong("is one row too many: at most " + std::to_string(max_rows));
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::optional<double> value = finite_number_of(cells[i]);
      if (!value) {
        return wrong("holds '" + std::string(cells[i].substr(0, 40)) + "', which is not a finite number");
      }
      if (i == 0 && !columns_[0].empty() && *value <= columns_[0].back()) {
        return wrong("goes from " + number_text(columns_[0].back()) + " nm to " + number_text(*value) +
                     " nm: wavelengths must rise");
      }
      columns_[i].push_back(*value);
    }
    return {};
  }

  Result<std::vector<SpectrumColumn>> spectra() const {
    if (names_.empty()) return fail(ErrorCode::malformed, "holds no row of names", name_);
    std::vector<SpectrumColumn> out;
    for (std::size_t i = 1; i < names_.size(); ++i) {
      auto spectrum = Spectrum::of(columns_[0], columns_[i]);
      if (!spectrum) return fail(spectrum.error().code, spectrum.error().message, name_);
      out.push_back({names_[i], *std::move(spectrum)});
    }
    return out;
  }

 private:
  Result<void> add_names(const std::vector<std::string_view>& cells) {
    if (cells.size() < 2 || cells.size() > max_columns) {
      return wrong("names " + std::to_string(cells.size()) +
                   " columns: a table has the wavelength and 1 to 4095 spectra");
    }
    if (finite_number_of(cells[0])) return wrong("holds numbers; it must name the columns: wavelength_nm,power");
    for (const std::string_view cell : cells) names_.emplace_back(cell);
    columns_.resize(cells.size());
    return {};
  }
  tl::unexpected<Error> wrong(const std::string& what) const {
    return fail(ErrorCode::malformed, "line " + std::to_string(line_) + " " + what, name_);
  }

  std::string name_;
  int line_ = 0;
  std::vector<std::string> names_;
  std::vector<std::vector<double>> columns_;
};

}  // namespace

Result<std::vector<SpectrumColumn>> parse_spectra(const std::string& text, const std::string& name) {
  if (text.size() > max_bytes) return fail(ErrorCode::too_large, "a table of spectra has at most 16 MB", name);
  Table table(name);
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    if (const auto good = table.add(std::string_view(text).substr(start, end - start)); !good) {
      return tl::make_unexpected(good.error());
    }
    start = end + 1;
  }
  return table.spectra();
}

Result<std::vector<SpectrumColumn>> read_spectra(const std::string& path) {
  const auto bytes = read_file_bytes(path, max_bytes);
  if (!bytes) return tl::make_unexpected(bytes.error());
  return parse_spectra(std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()), path);
}

}  // namespace lowlux::capture
