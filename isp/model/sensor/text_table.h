#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace lowlux::isp {

/// Reads a table of isp/model/data that holds text: '#' comments, one row of column names, rows of cells separated by
/// commas. The cells are views into the text, which must outlive the table.
class TextTable {
 public:
  explicit TextTable(std::string_view csv);

  int rows() const { return static_cast<int>(cells_.size()); }
  /// Returns a cell; empty where the source is blank. The column must exist.
  std::string_view text(int row, std::string_view column) const;
  /// Returns a cell as a number; nullopt where the source is blank.
  std::optional<double> number(int row, std::string_view column) const;

 private:
  std::vector<std::string_view> columns_;
  std::vector<std::vector<std::string_view>> cells_;
};

std::string_view noise_eld_per_iso_text();
std::string_view sensors_text();

}  // namespace lowlux::isp
